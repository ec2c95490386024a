//! The picture in 8 bits and at halved sizes: what corners are searched in. Refinement works on the picture itself.

use std::borrow::Cow;

use nalgebra::Vector2;

use crate::image::{Gray, Plane};

/// A picture reduced `level` times by two.
#[derive(Clone, Debug)]
pub(crate) struct Level<'a> {
    /// Number of halvings.
    pub(crate) level: u32,
    /// Grey values.
    pub(crate) picture: Cow<'a, Plane<u8>>,
}

impl Level<'_> {
    /// Pixels of the picture in one of this level.
    pub(crate) fn scale(&self) -> f64 {
        f64::from(1u32 << self.level)
    }

    /// A place of this level in the picture: pixels are means over squares, so centres shift by half of what they grow.
    pub(crate) fn to_picture(&self, px: Vector2<f64>) -> Vector2<f64> {
        px.map(|v| (v + 0.5) * self.scale() - 0.5)
    }
}

/// The picture in 8 bits. Of 16 bits the used range is stretched: raw sensor data often fills a corner of it.
pub(crate) fn eight_bits(picture: &Gray) -> Cow<'_, Plane<u8>> {
    match picture {
        Gray::U8(p) => Cow::Borrowed(p),
        Gray::U16(p) => {
            let (low, high) = used_range(p);
            let gain = 255.0 / f32::from(high.saturating_sub(low).max(1));
            Cow::Owned(p.map(|v| (f32::from(v.saturating_sub(low)) * gain + 0.5) as u8))
        }
    }
}

/// Range between the lowest and the highest thousandth of the samples.
fn used_range(picture: &Plane<u16>) -> (u16, u16) {
    let step = (picture.data().len() / 100_000).max(1);
    let mut some: Vec<u16> = picture.data().iter().copied().step_by(step).collect();
    if some.is_empty() {
        return (0, u16::MAX);
    }
    some.sort_unstable();
    let cut = some.len() / 1000;
    (some[cut], some[some.len() - 1 - cut])
}

/// Half the size; each pixel is the mean of 2 × 2. An odd last row or column is left out.
pub(crate) fn halve(picture: &Plane<u8>) -> Plane<u8> {
    let (w, h) = (picture.width() / 2, picture.height() / 2);
    let mut half = Plane::new(w, h);
    for y in 0..h {
        let (top, bottom) = (&picture.row(2 * y)[..2 * w], &picture.row(2 * y + 1)[..2 * w]);
        for (to, (t, b)) in half.row_mut(y).iter_mut().zip(top.chunks_exact(2).zip(bottom.chunks_exact(2))) {
            let sum = u16::from(t[0]) + u16::from(t[1]) + u16::from(b[0]) + u16::from(b[1]);
            *to = ((sum + 2) >> 2) as u8;
        }
    }
    half
}

/// Median of 3 × 3: single wrong pixels vanish, edges stay. The outermost pixels are copied.
pub(crate) fn median(picture: &Plane<u8>) -> Plane<u8> {
    let mut out = picture.clone();
    let (w, h) = (picture.width(), picture.height());
    if w < 3 {
        return out;
    }
    let order = |a: &mut u8, b: &mut u8| (*a, *b) = ((*a).min(*b), (*a).max(*b));
    for y in 1..h.saturating_sub(1) {
        let rows = [y - 1, y, y + 1].map(|y| picture.row(y));
        for (x, to) in out.row_mut(y)[1..w - 1].iter_mut().enumerate() {
            // Sort the columns; the median of nine is the median of largest low, median middle, smallest high.
            let column = |x: usize| {
                let [mut a, mut b, mut c] = [rows[0][x], rows[1][x], rows[2][x]];
                order(&mut a, &mut b);
                order(&mut b, &mut c);
                order(&mut a, &mut b);
                [a, b, c]
            };
            let [p, q, r] = [column(x), column(x + 1), column(x + 2)];
            let low = p[0].max(q[0]).max(r[0]);
            let high = p[2].min(q[2]).min(r[2]);
            let middle = median3(p[1], q[1], r[1]);
            *to = median3(low, middle, high);
        }
    }
    out
}

fn median3(a: u8, b: u8, c: u8) -> u8 {
    a.min(b).max(a.max(b).min(c))
}

/// Whether single pixels stand out of their surroundings as dead ones and bit errors do, in more than one of 500.
pub(crate) fn is_peppered(picture: &Plane<u8>) -> bool {
    let (mut total, mut lone) = (0, 0);
    for y in (0..picture.height()).step_by(1 + picture.height() / 300) {
        for t in picture.row(y).windows(3).step_by(2) {
            let [before, after] = [t[1].abs_diff(t[0]), t[1].abs_diff(t[2])];
            lone += usize::from(before.min(after) > 60 && t[0].abs_diff(t[2]) < 30);
            total += 1;
        }
    }
    500 * lone > total
}

/// Standard deviation of the noise, grey levels: the median size of a second difference along rows, which edges do not move
/// (after J. Immerkær, CVIU 64(2), 1996, with a median in place of a mean).
pub(crate) fn noise(picture: &Plane<u8>) -> f32 {
    let mut counts = [0u32; 1024];
    let mut total = 0u32;
    let step = (picture.height() / 200).max(1);
    for y in (0..picture.height()).step_by(step) {
        for t in picture.row(y).windows(3).step_by(3) {
            let second = 2 * i32::from(t[1]) - i32::from(t[0]) - i32::from(t[2]);
            counts[second.unsigned_abs() as usize] += 1;
            total += 1;
        }
    }
    let mut below = 0;
    for (size, n) in counts.iter().enumerate() {
        below += n;
        if 2 * below > total {
            // Linear within the bin, so that a median of zero still tells 0.1 from 0.4 levels.
            let part = (f64::from(total) / 2.0 - f64::from(below - n)) / f64::from(*n);
            let at = if size == 0 { 0.5 * part } else { size as f64 - 0.5 + part };
            return (at / (0.6745 * 6f64.sqrt())) as f32;
        }
    }
    0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halving_keeps_places() {
        let picture = Plane::from_fn(7, 5, |x, y| (10 * x + y) as u8);
        let half = halve(&picture);
        assert_eq!((half.width(), half.height(), half.at(1, 1)), (3, 2, 28));
        let level = Level { level: 1, picture: Cow::Owned(half) };
        assert_eq!(level.to_picture(Vector2::new(1.0, 1.0)), Vector2::new(2.5, 2.5));
    }

    #[test]
    fn medians_drop_single_pixels_and_keep_edges() {
        let mut picture = Plane::from_fn(9, 9, |x, _| if x < 4 { 10 } else { 200 });
        picture.data_mut()[4 * 9 + 2] = 255;
        let clean = median(&picture);
        assert_eq!((clean.at(2, 4), clean.at(3, 4), clean.at(4, 4)), (10, 10, 200));
        assert_eq!(median3(3, 1, 2), 2);
    }

    #[test]
    fn noise_is_measured_beside_edges() {
        let mut state = 1u32;
        let mut uniform = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(state >> 8) / f64::from(1 << 24)
        };
        let mut normal = || (0..12).map(|_| uniform()).sum::<f64>() - 6.0;
        for sigma in [0.0, 2.0, 10.0] {
            let picture = Plane::from_fn(300, 200, |x, y| {
                let board = if (x / 20 + y / 20) % 2 == 0 { 60.0 } else { 190.0 };
                (board + sigma * normal() + 0.5) as u8
            });
            assert!(
                (f64::from(noise(&picture)) - sigma).abs() < 0.15 * sigma + 0.4,
                "{sigma}: {}",
                noise(&picture)
            );
        }
    }

    #[test]
    fn sixteen_bits_are_stretched() {
        let raw = Plane::from_fn(64, 64, |x, _| 1000 + 8 * x as u16);
        let raw = Gray::U16(raw);
        let p = eight_bits(&raw);
        assert_eq!((p.at(0, 0), p.at(63, 0)), (0, 255));
    }
}
