//! Bilinear interpolation in integers.

#[cfg(all(target_arch = "x86_64", not(feature = "narrow")))]
pub(crate) mod avx2;

use super::{FRACTION_BITS, INVALID, ONE, Row, Sample, Source, split};
use crate::wide;

/// Samples that can be blended.
pub(super) trait Blend: Sample {
    /// `a b` above `c d`, at the fractions `x` and `y` of [`ONE`], rounded.
    fn blend(a: Self, b: Self, c: Self, d: Self, x: i32, y: i32) -> Self;

    /// One row of the output, `C` samples a pixel, from a source of at least 2 × 2 pixels.
    #[inline(always)]
    fn row<const C: usize>(source: &Source<'_, Self>, row: &Row, out: &mut [Self]) {
        row_of_pixels::<Self, C>(source, row, out);
    }
}

/// A row pixel by pixel.
#[inline(always)]
fn row_of_pixels<T: Blend, const C: usize>(source: &Source<'_, T>, row: &Row, out: &mut [T]) {
    for ((out, &x), &y) in out.as_chunks_mut::<C>().0.iter_mut().zip(&row.x).zip(&row.y) {
        *out = pixel(source, x, y);
    }
}

/// One pixel of the output.
#[inline(always)]
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

    #[inline(always)]
    fn row<const C: usize>(source: &Source<'_, Self>, row: &Row, out: &mut [Self]) {
        if u32::try_from(source.samples.len()).is_ok() {
            blocks::<C>(source, row, out);
        } else {
            row_of_pixels::<Self, C>(source, row, out);
        }
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

/// Pixels that are fetched, then blended together: so many that what was written piece by piece is in the cache when it is read in
/// wide registers.
pub(crate) const BLOCK: usize = 64;

/// A row block by block, `C` samples a pixel.
#[inline(always)]
fn blocks<const C: usize>(source: &Source<'_, u8>, row: &Row, out: &mut [u8]) {
    let positions = row.x.chunks(BLOCK).zip(row.y.chunks(BLOCK));
    for (out, (xs, ys)) in out.chunks_mut(BLOCK * C).zip(positions) {
        let (xs, ys) = match (xs.first_chunk(), ys.first_chunk()) {
            (Some(xs), Some(ys)) => (*xs, *ys),
            _ => (filled(xs), filled(ys)),
        };
        let taps = Taps::of(source, C, &xs, &ys);
        let mut blended = [0; BLOCK * 4 + 4];
        if C == 1 {
            taps.single(source, &mut blended);
        } else if !wide::group::<C>(&taps, source, &mut blended) {
            taps.group::<C>(source, &mut blended);
        }
        out.copy_from_slice(&blended[..out.len()]);
    }
}

/// The last block of a row: nothing is valid beyond it.
fn filled(few: &[i32]) -> [i32; BLOCK] {
    let mut all = [INVALID; BLOCK];
    all[..few.len()].copy_from_slice(few);
    all
}

/// Where the pixels of a block come from.
pub(crate) struct Taps {
    /// Of the upper left one, in samples.
    start: [u32; BLOCK],
    /// 255 where the pixel is valid.
    valid: [u8; BLOCK],
    /// Fractions of [`ONE`].
    x: [i16; BLOCK],
    y: [i16; BLOCK],
}

impl Taps {
    #[inline(always)]
    fn of(source: &Source<'_, u8>, channels: usize, xs: &[i32; BLOCK], ys: &[i32; BLOCK]) -> Self {
        let mut taps = Self { start: [0; BLOCK], valid: [0; BLOCK], x: [0; BLOCK], y: [0; BLOCK] };
        let [width, height] = [source.width as i32, source.height as i32];
        let (stride, channels) = (source.width as u32 * channels as u32, channels as u32);
        for i in 0..BLOCK {
            let valid = xs[i] != INVALID;
            let column = (xs[i] >> FRACTION_BITS).min(width - 2);
            let line = (ys[i] >> FRACTION_BITS).min(height - 2);
            taps.x[i] = (xs[i].wrapping_sub(column << FRACTION_BITS)) as i16;
            taps.y[i] = (ys[i].wrapping_sub(line << FRACTION_BITS)) as i16;
            let start =
                (line as u32).wrapping_mul(stride).wrapping_add((column as u32).wrapping_mul(channels));
            taps.start[i] = if valid { start } else { 0 };
            taps.valid[i] = if valid { 255 } else { 0 };
        }
        taps
    }

    /// One channel: a pair of neighbours from both lines.
    #[inline(always)]
    fn single(&self, source: &Source<'_, u8>, out: &mut [u8; BLOCK * 4 + 4]) {
        let (mut top, mut bottom) = ([0u16; BLOCK], [0u16; BLOCK]);
        let below = &source.samples[source.width..];
        let fours = self.start.as_chunks::<4>().0.iter();
        for ((starts, top), bottom) in
            fours.zip(top.as_chunks_mut::<4>().0).zip(bottom.as_chunks_mut::<4>().0)
        {
            for k in 0..4 {
                let start = starts[k] as usize;
                bottom[k] = neighbours(below, start);
                top[k] = neighbours(source.samples, start);
            }
        }
        for i in 0..BLOCK {
            let [a, c] = [top[i], bottom[i]].map(|pair| (pair & 255) as i16);
            let [b, d] = [top[i], bottom[i]].map(|pair| (pair >> 8) as i16);
            let (x, y) = (self.x[i], self.y[i]);
            out[i] = round(across(down(a, c, y), down(b, d, y), x)) & self.valid[i];
        }
    }

    /// Eight samples from the upper left tap of a pixel on, and eight below them.
    #[inline(always)]
    fn lines(&self, source: &Source<'_, u8>, i: usize, stride: usize) -> [u64; 2] {
        let start = self.start[i] as usize;
        let lines = match source.samples.get(start..start + stride + 8) {
            Some(taps) => [eight(taps), eight(&taps[stride..])],
            None => [eight(&source.samples[start..]), eight(&source.samples[start + stride..])],
        };
        lines.map(u64::from_le_bytes)
    }

    /// Several channels, each pixel in four lanes.
    #[inline(always)]
    fn group<const C: usize>(&self, source: &Source<'_, u8>, out: &mut [u8; BLOCK * 4 + 4]) {
        let stride = source.width * C;
        let mut taps = [[[0u8; 4]; BLOCK]; 4];
        let (mut x, mut y) = ([[0i16; 4]; BLOCK], [[0i16; 4]; BLOCK]);
        for i in 0..BLOCK {
            let [top, bottom] = self.lines(source, i, stride);
            let four = |taps: u64| (taps as u32).to_le_bytes();
            taps[0][i] = four(top);
            taps[1][i] = four(top >> (8 * C));
            taps[2][i] = four(bottom);
            taps[3][i] = four(bottom >> (8 * C));
            (x[i], y[i]) = ([self.x[i]; 4], [self.y[i]; 4]);
        }
        let mut blended = [[0u8; 4]; BLOCK];
        let [a, b, c, d] = taps.each_ref().map(|t| t.as_flattened());
        let (x, y) = (x.as_flattened(), y.as_flattened());
        for (i, out) in blended.as_flattened_mut().iter_mut().enumerate() {
            let [a, b, c, d] = [a[i], b[i], c[i], d[i]].map(i16::from);
            *out = round(across(down(a, c, y[i]), down(b, d, y[i]), x[i]));
        }
        for (i, (blended, valid)) in blended.iter().zip(self.valid).enumerate() {
            // What is written too much the next pixel overwrites.
            let valid = u32::from_le_bytes([valid; 4]);
            out[i * C..i * C + 4].copy_from_slice(&(u32::from_le_bytes(*blended) & valid).to_le_bytes());
        }
    }
}

/// A sample and the next.
#[inline(always)]
fn neighbours(samples: &[u8], start: usize) -> u16 {
    samples[start..start + 2].first_chunk().map_or(0, |pair| u16::from_le_bytes(*pair))
}

/// The first eight samples; zeros beyond the end of the source, where nothing is blended.
#[inline(always)]
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
#[inline(always)]
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
