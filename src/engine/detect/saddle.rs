//! A peak of the response, looked at closely: which way its edges run, which squares are black, and whether it is a corner.

use nalgebra::Vector2;

use super::response::Ring;
use crate::image::Plane;

/// A possible corner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Saddle {
    /// Position in the level, px.
    pub(crate) px: Vector2<f64>,
    /// Directions of the two edges, unit vectors: from `axes[0]` turning to `axes[1]` (x towards y, less than half a turn) the
    /// square is black. Both may be negated together.
    pub(crate) axes: [Vector2<f64>; 2],
    /// Bright minus dark, grey levels.
    pub(crate) contrast: f32,
    /// Share of the ring's variance that two black and two white squares explain, 0..1.
    pub(crate) quality: f32,
}

/// Smallest and largest number of neighbouring samples, of eight in half a turn, in the black square.
const ARC: std::ops::RangeInclusive<usize> = 2..=6;

impl Saddle {
    /// Splits the ring around pixel `(x, y)` into two black and two white arcs; `place` is the corner itself. `None` where the
    /// ring leaves the picture.
    pub(crate) fn at(
        picture: &Plane<u8>,
        ring: &Ring,
        [x, y]: [usize; 2],
        place: Vector2<f64>,
    ) -> Option<Self> {
        let r = ring.radius;
        if x < r || y < r || x + r >= picture.width() || y + r >= picture.height() {
            return None;
        }
        let samples = ring
            .offsets
            .map(|(dx, dy)| f32::from(picture.at((x as i32 + dx) as usize, (y as i32 + dy) as usize)));
        let mean = samples.iter().sum::<f32>() / 16.0;
        let total: f32 = samples.iter().map(|s| (s - mean) * (s - mean)).sum();
        // Opposite samples belong to squares of one colour.
        let folded: [f32; 8] = std::array::from_fn(|n| 0.5 * (samples[n] + samples[n + 8]) - mean);
        let (mut best, mut start, mut length) = (0.0, 0, 0);
        for first in 0..8 {
            let mut dark = 0.0;
            for n in 1..=*ARC.end() {
                dark += folded[(first + n - 1) % 8];
                // Variance between the classes: Σ folded = 0, so the bright ones sum to −dark.
                let between = 16.0 * dark * dark / (n * (8 - n)) as f32;
                if ARC.contains(&n) && dark < 0.0 && between > best {
                    (best, start, length) = (between, first, n);
                }
            }
        }
        if best <= 0.0 {
            return None;
        }
        let (n, m) = (length as f32, (8 - length) as f32);
        let contrast = (best * 8.0 / (2.0 * n * m)).sqrt();
        // Black lies (m/8) of the contrast below the mean, white (n/8) above: the edge is half-way.
        let middle = contrast * (n - m) / 16.0;
        let crossing = |dark: usize, bright: usize| {
            let (a, b) = (folded[dark % 8], folded[bright % 8]);
            let t = if b > a { ((middle - a) / (b - a)).clamp(0.0, 1.0) } else { 0.5 };
            let (from, to) = (direction(ring, dark), direction(ring, bright));
            (from * f64::from(1.0 - t) + to * f64::from(t)).normalize()
        };
        // Samples count on through the second half turn, so no direction jumps.
        let axes = [crossing(start + 8, start + 7), crossing(start + 8 + length - 1, start + 8 + length)];
        Some(Self { px: place, axes, contrast, quality: best / total.max(1e-6) })
    }

    /// How well the edges run along `along` (within a grid cell `[u, v]` of which the square between +u and +v is black where
    /// `black`): the larger sine of the two angles; `None` where the other colour fits better.
    pub(super) fn mismatch(&self, [u, v]: [Vector2<f64>; 2], black: bool) -> Option<f64> {
        let sine = |a: Vector2<f64>, b: Vector2<f64>| a.perp(&b).abs() / b.norm().max(1e-9);
        let [a, b] = self.axes;
        let straight = sine(a, u).max(sine(b, v));
        let crossed = sine(a, v).max(sine(b, u));
        let (own, other) = if black { (straight, crossed) } else { (crossed, straight) };
        (own < other).then_some(own)
    }
}

/// Direction to sample `n` of a ring, `n` counted on beyond 15.
fn direction(ring: &Ring, n: usize) -> Vector2<f64> {
    let (x, y) = ring.offsets[n % 16];
    Vector2::new(f64::from(x), f64::from(y)).normalize()
}

#[cfg(test)]
mod tests {
    use super::super::response::{RING, SMALL_RING};
    use super::*;

    /// A corner whose black square lies between directions `a` and `b`, degrees.
    fn corner(a: f64, b: f64) -> Plane<u8> {
        Plane::from_fn(21, 21, |x, y| {
            let mean: f64 = (0..25)
                .map(|k| {
                    let (dx, dy) = (f64::from(k % 5) / 5.0 - 0.4, f64::from(k / 5) / 5.0 - 0.4);
                    let at = (y as f64 - 10.0 + dy).atan2(x as f64 - 10.0 + dx).to_degrees();
                    let turn = (at - a).rem_euclid(180.0);
                    if turn < b - a { 30.0 } else { 220.0 }
                })
                .sum::<f64>()
                / 25.0;
            mean as u8
        })
    }

    #[test]
    fn axes_follow_the_edges() {
        for (a, b) in
            [(0.0, 90.0), (10.0, 100.0), (33.0, 140.0), (80.0, 140.0), (-20.0, 40.0), (100.0, 235.0)]
        {
            for ring in [&RING, &SMALL_RING] {
                let s = Saddle::at(&corner(a, b), ring, [10, 10], Vector2::new(10.0, 10.0)).unwrap();
                let angle = |v: Vector2<f64>| v.y.atan2(v.x).to_degrees();
                let off = |got: f64, want: f64| ((got - want + 90.0).rem_euclid(180.0) - 90.0).abs();
                let worst = off(angle(s.axes[0]), a).max(off(angle(s.axes[1]), b));
                let turn = (angle(s.axes[1]) - angle(s.axes[0])).rem_euclid(360.0);
                assert!(worst < 9.0 && (turn - (b - a)).abs() < 14.0, "{a} {b}: {s:?}");
                assert!(s.quality > 0.7 && s.contrast > 120.0, "{a} {b}: {s:?}");
                let [u, v] = [a, b].map(|t: f64| Vector2::new(t.to_radians().cos(), t.to_radians().sin()));
                assert!(s.mismatch([u, v], true).is_some_and(|m| m < 0.2));
                assert_eq!(s.mismatch([u, v], false), None);
                assert!(s.mismatch([v, -u], false).is_some_and(|m| m < 0.2));
            }
        }
    }

    #[test]
    fn other_patterns_are_of_poor_quality() {
        let edge = Plane::from_fn(21, 21, |x, _| if x < 10 { 30 } else { 220 });
        let line = Plane::from_fn(21, 21, |x, _| if (9..12).contains(&x) { 30 } else { 220 });
        let flat = Plane::from_fn(21, 21, |_, _| 90);
        for picture in [edge, line, flat] {
            let s = Saddle::at(&picture, &RING, [10, 10], Vector2::new(10.0, 10.0));
            assert!(s.is_none_or(|s| s.quality < 0.6), "{s:?}");
        }
        assert_eq!(Saddle::at(&Plane::new(21, 21), &RING, [4, 10], Vector2::zeros()), None);
    }
}
