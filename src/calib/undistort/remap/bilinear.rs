//! Bilinear interpolation in integers.

use super::{FRACTION_BITS, INVALID, ONE, Row, Sample, Source, split};

/// Samples that can be blended.
pub(super) trait Blend: Sample {
    /// `a b` above `c d`, at the fractions `x` and `y` of [`ONE`], rounded.
    fn blend(a: Self, b: Self, c: Self, d: Self, x: i32, y: i32) -> Self;
}

impl Blend for u8 {
    fn blend(a: Self, b: Self, c: Self, d: Self, x: i32, y: i32) -> Self {
        // 11 bits of each fraction fill an i32: 8 + 11 + 11.
        const BITS: u32 = 11;
        const HALF: i32 = 1 << (2 * BITS - 1);
        let (x, y) = (x >> (FRACTION_BITS - BITS), y >> (FRACTION_BITS - BITS));
        let [a, b, c, d] = [a, b, c, d].map(i32::from);
        let top = (a << BITS) + (b - a) * x;
        let bottom = (c << BITS) + (d - c) * x;
        (((top << BITS) + (bottom - top) * y + HALF) >> (2 * BITS)) as Self
    }
}

impl Blend for u16 {
    fn blend(a: Self, b: Self, c: Self, d: Self, x: i32, y: i32) -> Self {
        let [a, b, c, d] = [a, b, c, d].map(i64::from);
        let (x, y) = (i64::from(x), i64::from(y));
        let top = (a << FRACTION_BITS) + (b - a) * x;
        let bottom = (c << FRACTION_BITS) + (d - c) * x;
        let half = 1i64 << (2 * FRACTION_BITS - 1);
        (((top << FRACTION_BITS) + (bottom - top) * y + half) >> (2 * FRACTION_BITS)) as Self
    }
}

/// One row of the output, `C` samples a pixel.
pub(super) fn row<T: Blend, const C: usize>(source: &Source<'_, T>, row: &Row, out: &mut [T]) {
    let (w, h) = (source.width, source.height);
    if w < 2 || h < 2 {
        return thin::<T, C>(source, row, out);
    }
    let stride = w * C;
    for ((out, &x), &y) in out.as_chunks_mut::<C>().0.iter_mut().zip(&row.x).zip(&row.y) {
        if x == INVALID {
            *out = [T::default(); C];
            continue;
        }
        let (column, fx) = split(x, w);
        let (line, fy) = split(y, h);
        // One check for all taps: the last is 2 C − 1 beyond the start of the next line.
        let start = line * stride + column * C;
        let taps = &source.samples[start..start + stride + 2 * C];
        let (top, bottom) = (&taps[..2 * C], &taps[stride..]);
        for c in 0..C {
            out[c] = T::blend(top[c], top[c + C], bottom[c], bottom[c + C], fx, fy);
        }
    }
}

/// A source of one row or column: the neighbour that is not there repeats the last.
fn thin<T: Blend, const C: usize>(source: &Source<'_, T>, row: &Row, out: &mut [T]) {
    let (w, h) = (source.width, source.height);
    for ((out, &x), &y) in out.as_chunks_mut::<C>().0.iter_mut().zip(&row.x).zip(&row.y) {
        if x == INVALID {
            continue;
        }
        let (column, line) = ((x >> FRACTION_BITS) as usize, (y >> FRACTION_BITS) as usize);
        let (right, below) = ((column + 1).min(w - 1), (line + 1).min(h - 1));
        for (channel, out) in out.iter_mut().enumerate() {
            let at = |i: usize, j: usize| source.samples[(j * w + i) * C + channel];
            let [a, b, c, d] = [at(column, line), at(right, line), at(column, below), at(right, below)];
            *out = T::blend(a, b, c, d, x & (ONE - 1), y & (ONE - 1));
        }
    }
}
