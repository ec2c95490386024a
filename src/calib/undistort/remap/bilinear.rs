//! Bilinear interpolation in integers.

use super::{FRACTION_BITS, INVALID, ONE, Row, Sample, Source, split};

/// Samples that can be blended.
pub(super) trait Blend: Sample {
    /// `a b` above `c d`, at the fractions `x` and `y` of [`ONE`], rounded.
    fn blend(a: Self, b: Self, c: Self, d: Self, x: i32, y: i32) -> Self;

    /// One row of the output, `C` samples a pixel, from a source of at least 2 × 2 pixels.
    fn row<const C: usize>(source: &Source<'_, Self>, row: &Row, out: &mut [Self]) {
        for ((out, &x), &y) in out.as_chunks_mut::<C>().0.iter_mut().zip(&row.x).zip(&row.y) {
            *out = pixel(source, x, y);
        }
    }
}

/// One pixel of the output.
fn pixel<T: Blend, const C: usize>(source: &Source<'_, T>, x: i32, y: i32) -> [T; C] {
    if x == INVALID {
        return [T::default(); C];
    }
    let (column, fx) = split(x, source.width);
    let (line, fy) = split(y, source.height);
    let stride = source.width * C;
    // One check for all taps: the last is 2 C − 1 beyond the start of the next line.
    let start = line * stride + column * C;
    let taps = &source.samples[start..start + stride + 2 * C];
    let (top, bottom) = (&taps[..2 * C], &taps[stride..]);
    std::array::from_fn(|c| T::blend(top[c], top[c + C], bottom[c], bottom[c + C], fx, fy))
}

/// 8 bits are blended in lanes of `i16`, in units of 1/32 level.
impl Blend for u8 {
    fn blend(a: Self, b: Self, c: Self, d: Self, x: i32, y: i32) -> Self {
        let [a, b, c, d] = [a, b, c, d].map(i16::from);
        let (x, y) = (x as i16, y as i16);
        round(across(down(a, c, y), down(b, d, y), x))
    }

    fn row<const C: usize>(source: &Source<'_, Self>, row: &Row, out: &mut [Self]) {
        if C == 1 { singles(source, row, out) } else { groups::<C>(source, row, out) }
    }
}

/// From a level to the one below it, at the fraction `y`.
#[inline(always)]
fn down(top: i16, bottom: i16, y: i16) -> i16 {
    (top << 5) + high((bottom - top) << 7, y)
}

/// From left to right at the fraction `x`, both in 1/32 level.
#[inline(always)]
fn across(left: i16, right: i16, x: i16) -> i16 {
    left + high((right - left) << 2, x)
}

/// To whole levels; each product was rounded down, by half a unit on average.
#[inline(always)]
fn round(v: i16) -> u8 {
    ((v + 17) >> 5) as u8
}

/// Upper half of a product.
#[inline(always)]
fn high(a: i16, b: i16) -> i16 {
    ((i32::from(a) * i32::from(b)) >> 16) as i16
}

/// One channel: pairs of neighbours are fetched for many pixels, then all are blended.
fn singles(source: &Source<'_, u8>, row: &Row, out: &mut [u8]) {
    const N: usize = 32;
    let stride = source.width;
    let (mut top, mut bottom) = ([0u16; N], [0u16; N]);
    let (mut fx, mut fy) = ([0i16; N], [0i16; N]);
    for ((out, xs), ys) in out.chunks_mut(N).zip(row.x.chunks(N)).zip(row.y.chunks(N)) {
        for (i, (&x, &y)) in xs.iter().zip(ys).enumerate() {
            if x == INVALID {
                (top[i], bottom[i]) = (0, 0);
                continue;
            }
            let (column, a) = split(x, source.width);
            let (line, b) = split(y, source.height);
            (fx[i], fy[i]) = (a as i16, b as i16);
            let start = line * stride + column;
            let taps = &source.samples[start..start + stride + 2];
            top[i] = u16::from_le_bytes([taps[0], taps[1]]);
            bottom[i] = u16::from_le_bytes([taps[stride], taps[stride + 1]]);
        }
        let mut blended = [0u8; N];
        for i in 0..N {
            let [a, c] = [top[i], bottom[i]].map(|pair| (pair & 255) as i16);
            let [b, d] = [top[i], bottom[i]].map(|pair| (pair >> 8) as i16);
            blended[i] = round(across(down(a, c, fy[i]), down(b, d, fy[i]), fx[i]));
        }
        out.copy_from_slice(&blended[..xs.len()]);
    }
}

/// Several channels: both neighbours of a pixel lie side by side in eight lanes; many pixels are fetched, then all blended.
fn groups<const C: usize>(source: &Source<'_, u8>, row: &Row, out: &mut [u8]) {
    const N: usize = 32;
    let stride = source.width * C;
    let (mut top, mut bottom) = ([[0u8; 8]; N], [[0u8; 8]; N]);
    let (mut fx, mut fy) = ([[0i16; 8]; N], [[0i16; 8]; N]);
    let mut left = [[0i16; 8]; N + 1];
    let mut blended = [[0u8; 8]; N];
    for ((out, xs), ys) in out.chunks_mut(N * C).zip(row.x.chunks(N)).zip(row.y.chunks(N)) {
        for (i, (&x, &y)) in xs.iter().zip(ys).enumerate() {
            if x == INVALID {
                (top[i], bottom[i]) = ([0; 8], [0; 8]);
                continue;
            }
            let (column, a) = split(x, source.width);
            let (line, b) = split(y, source.height);
            (fx[i], fy[i]) = ([a as i16; 8], [b as i16; 8]);
            let start = line * stride + column * C;
            match source.samples.get(start..start + stride + 8) {
                Some(taps) => {
                    top[i].copy_from_slice(&taps[..8]);
                    bottom[i].copy_from_slice(&taps[stride..]);
                }
                None => {
                    top[i] = eight(&source.samples[start..]);
                    bottom[i] = eight(&source.samples[start + stride..]);
                }
            }
        }
        let lanes = left.as_flattened_mut();
        let taps = top.as_flattened().iter().zip(bottom.as_flattened()).zip(fy.as_flattened());
        for (left, ((&a, &c), &y)) in lanes.iter_mut().zip(taps) {
            *left = down(i16::from(a), i16::from(c), y);
        }
        let pairs = lanes.iter().zip(&lanes[C..]).zip(fx.as_flattened());
        for (blended, ((&left, &right), &x)) in blended.as_flattened_mut().iter_mut().zip(pairs) {
            *blended = round(across(left, right, x));
        }
        for (out, blended) in out.as_chunks_mut::<C>().0.iter_mut().zip(&blended) {
            out.copy_from_slice(&blended[..C]);
        }
    }
}

/// The first eight samples; zeros beyond the end of the source, where nothing is blended.
fn eight(samples: &[u8]) -> [u8; 8] {
    samples.first_chunk().copied().unwrap_or_else(|| {
        let mut few = [0; 8];
        few[..samples.len()].copy_from_slice(samples);
        few
    })
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
    if source.width < 2 || source.height < 2 {
        thin::<T, C>(source, row, out);
    } else {
        T::row::<C>(source, row, out);
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
