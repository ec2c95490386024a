//! The outline of a marker below the pixel: four sides, each a parabola through the steepest places across it, and their crossings.
//!
//! A place on a side is the vertex of the gradient along the normal: what lies a few pixels off the side (a thin margin, the next
//! square) has little to say in it. Curvature is fitted where the side is long enough to show it: lenses bend. It is a safe start, where
//! [`super::sides`] begins.

use nalgebra::{Matrix3, Vector2, Vector3};

use crate::image::{Plane, Sample};

/// Part of a side, from its middle, that is looked at: corners are round.
const PART: f64 = 0.86;
/// Distance of the places on a side, px, and their number.
const STEP: f64 = 1.5;
const PLACES: std::ops::RangeInclusive<usize> = 6..=28;
/// Shortest side whose curvature is fitted, px.
const LONG: f64 = 22.0;
/// Share of the median gradient that a place needs.
const WEAK: f32 = 0.3;
/// How much less a parabola must leave than a line.
const BENT: f64 = 0.95;
/// Share of the places of a side that must agree.
const AGREE: f64 = 0.6;
/// Smallest standard deviation of a place that is believed, px: samples round.
const FLOOR_PX: f64 = 0.05;

/// Four sides of a marker.
#[derive(Clone, Copy, Debug)]
pub(super) struct Outline {
    /// Corners, clockwise as seen in the picture, px.
    pub(super) corners: [Vector2<f64>; 4],
    /// Their standard deviation per axis, px.
    pub(super) sigma_px: [f64; 4],
    /// How far the middle of side k (from corner k on) lies from its chord, px.
    pub(super) bulge: [Vector2<f64>; 4],
}

/// A side as a parabola: `middle + along t + normal (a + b t + c t²)`, t from −1 to 1.
#[derive(Clone, Copy)]
struct Side {
    middle: Vector2<f64>,
    /// To the end.
    along: Vector2<f64>,
    /// Outwards, of unit length.
    normal: Vector2<f64>,
    abc: Vector3<f64>,
    /// Standard deviation at the ends, px.
    sigma_px: f64,
}

impl Outline {
    /// Fits the sides near `start` (clockwise), each within `reach` px. `None` where a side is not there or is ragged.
    pub(super) fn fit<T: Sample>(
        picture: &Plane<T>,
        start: &[Vector2<f64>; 4],
        dark: bool,
        reach: f64,
    ) -> Option<Self> {
        let mut sides = Vec::with_capacity(4);
        for k in 0..4 {
            sides.push(Side::fit(picture, start[k], start[(k + 1) % 4], dark, reach)?);
        }
        let mut out = Self { corners: *start, sigma_px: [0.0; 4], bulge: [Vector2::zeros(); 4] };
        for k in 0..4 {
            let (before, after) = (&sides[(k + 3) % 4], &sides[k]);
            let px = before.crossing(after)?;
            // Corners of regions are cut by a pixel or two; a sharp angle moves the crossing farther.
            if (px - start[k]).norm() > 2.0 * reach + 1.0 {
                return None;
            }
            let sine = before.normal.perp(&after.normal).abs().max(0.1);
            out.corners[k] = px;
            out.sigma_px[k] = (0.5 * (before.sigma_px.powi(2) + after.sigma_px.powi(2))).sqrt() / sine;
            out.bulge[k] = -after.normal * after.abc.z;
        }
        Some(out)
    }

    /// Where the marker's plane lies in the picture.
    pub(super) fn chart(&self) -> Option<Chart> {
        Some(Chart { h: square_to(&self.corners)?, bulge: self.bulge })
    }
}

impl Side {
    fn fit<T: Sample>(
        picture: &Plane<T>,
        from: Vector2<f64>,
        to: Vector2<f64>,
        dark: bool,
        reach: f64,
    ) -> Option<Self> {
        let (middle, along) = (0.5 * (from + to), 0.5 * (to - from));
        let half = along.norm();
        let unit = along / half;
        // Clockwise, so outwards is to the left of the way where y runs down.
        let normal = Vector2::new(unit.y, -unit.x);
        let n = ((2.0 * half / STEP) as usize).clamp(*PLACES.start(), *PLACES.end());
        let mut places: Vec<(f64, f64, f32)> = Vec::with_capacity(n);
        for i in 0..n {
            let t = PART * (2.0 * (i as f64 + 0.5) / n as f64 - 1.0);
            if let Some((off, steep)) = steepest(picture, middle + along * t, normal, dark, reach) {
                places.push((t, off, steep));
            }
        }
        let mut steeps: Vec<f32> = places.iter().map(|p| p.2).collect();
        steeps.sort_by(f32::total_cmp);
        let weak = WEAK * steeps.get(steeps.len() / 2)?;
        places.retain(|p| p.2 >= weak);
        let may_bend = 2.0 * half >= LONG && places.len() >= 9;
        let straight = parabola(&places, false)?;
        let curved = if may_bend { parabola(&places, true) } else { None };
        // A curvature that is not there costs accuracy at the ends.
        let curved = curved.filter(|c| c.2 > straight.2 || c.1 < BENT * straight.1);
        let bent = curved.is_some();
        let (abc, spread, agreeing) = curved.unwrap_or(straight);
        if (agreeing as f64) < AGREE * n as f64 || agreeing < 4 {
            return None;
        }
        let spread = spread.max(FLOOR_PX);
        // Variance at an end of n places that are spread evenly: 4/n of a line, 9/n of a parabola.
        let sigma_px = spread * if bent { 3.0 } else { 2.0 } / (agreeing as f64).sqrt();
        Some(Self { middle, along, normal, abc, sigma_px })
    }

    fn at(&self, t: f64) -> (Vector2<f64>, Vector2<f64>) {
        let [a, b, c] = self.abc.into();
        let place = self.middle + self.along * t + self.normal * (a + (b + c * t) * t);
        (place, self.along + self.normal * (b + 2.0 * c * t))
    }

    /// Where the end of this side meets the beginning of the next.
    fn crossing(&self, next: &Self) -> Option<Vector2<f64>> {
        let (mut t, mut u) = (1.0, -1.0);
        for _ in 0..3 {
            let ((p, d), (q, e)) = (self.at(t), next.at(u));
            let area = d.perp(&e);
            if area.abs() < 1e-9 {
                return None;
            }
            t += (q - p).perp(&e) / area;
            u += (q - p).perp(&d) / area;
        }
        // A corner that is off by more than half a side is none.
        ((t - 1.0).abs() < 0.6 && (u + 1.0).abs() < 0.6).then(|| self.at(t).0)
    }
}

/// The steepest place within ±`reach` px along `normal`: its offset and the gradient there, positive outwards of a dark marker.
fn steepest<T: Sample>(
    picture: &Plane<T>,
    at: Vector2<f64>,
    normal: Vector2<f64>,
    dark: bool,
    reach: f64,
) -> Option<(f64, f32)> {
    const MOST: usize = 64;
    let half = (reach.ceil() as usize + 2).min(MOST / 2 - 1);
    let n = 2 * half + 1;
    let mut v = [0f32; MOST];
    for (j, v) in v.iter_mut().take(n).enumerate() {
        let value = bilinear(picture, at + normal * (j as f64 - half as f64))?;
        *v = if dark { value } else { -value };
    }
    let gradient = |j: usize| v[j + 1] - v[j - 1];
    let best = (2..n - 2).max_by(|a, b| gradient(*a).total_cmp(&gradient(*b)))?;
    let [a, b, c] = [best - 1, best, best + 1].map(gradient);
    // At the end of the way the steepest place may lie beyond.
    if b <= 0.0 || (best == 2 && a > b) || (best == n - 3 && c > b) {
        return None;
    }
    let bend = a - 2.0 * b + c;
    let vertex = if bend < 0.0 { (0.5 * (a - c) / bend).clamp(-0.6, 0.6) } else { 0.0 };
    Some((best as f64 - half as f64 + f64::from(vertex), b))
}

/// Robust parabola `a + b t + c t²` (c = 0 unless `bent`) through `(t, offset, _)`: the standard deviation of what agrees, and
/// how much that is.
fn parabola(places: &[(f64, f64, f32)], bent: bool) -> Option<(Vector3<f64>, f64, usize)> {
    let mut offs: Vec<f64> = places.iter().map(|p| p.1).collect();
    offs.sort_by(f64::total_cmp);
    let mut abc = Vector3::new(*offs.get(offs.len() / 2)?, 0.0, 0.0);
    let value = |abc: &Vector3<f64>, t: f64| abc.x + (abc.y + abc.z * t) * t;
    let mut scale: f64 = 1.5;
    for round in 0..6 {
        let (mut a, mut b) = (Matrix3::zeros(), Vector3::zeros());
        for (t, off, _) in places {
            let r = (off - value(&abc, *t)) / scale;
            let weight = 1.0 / (1.0 + r * r).powi(2); // Geman & McClure
            let row = Vector3::new(1.0, *t, if bent && round > 0 { t * t } else { 0.0 });
            a += row * row.transpose() * weight;
            b += row * (off * weight);
        }
        if !(bent && round > 0) {
            a[(2, 2)] = 1.0;
        }
        abc = a.cholesky()?.solve(&b);
        let mut left: Vec<f64> = places.iter().map(|(t, off, _)| (off - value(&abc, *t)).abs()).collect();
        left.sort_by(f64::total_cmp);
        scale = (2.0 * 1.4826 * left[left.len() / 2]).clamp(0.15, scale);
    }
    let near =
        places.iter().map(|(t, off, _)| off - value(&abc, *t)).filter(|r| r.abs() < (2.0 * scale).max(0.6));
    let (n, sum) = near.fold((0, 0.0), |(n, s), r| (n + 1, s + r * r));
    (n > 0).then(|| (abc, (sum / f64::from(n)).sqrt(), n as usize))
}

/// Grey value between four pixels; `None` outside the picture.
pub(super) fn bilinear<T: Sample>(picture: &Plane<T>, at: Vector2<f64>) -> Option<f32> {
    let (w, h) = (picture.width(), picture.height());
    if !(at.x >= 0.0 && at.y >= 0.0) || w < 2 || h < 2 {
        return None;
    }
    let (x, y) = (at.x as usize, at.y as usize);
    if x + 1 >= w || y + 1 >= h {
        return None;
    }
    let (fx, fy) = ((at.x - x as f64) as f32, (at.y - y as f64) as f32);
    let (top, bottom) = (&picture.row(y)[x..x + 2], &picture.row(y + 1)[x..x + 2]);
    let mix = |r: &[T]| r[0].to_f32() + fx * (r[1].to_f32() - r[0].to_f32());
    let (a, b) = (mix(top), mix(bottom));
    Some(a + fy * (b - a))
}

/// The plane of a marker in the picture: a homography from the unit square, bent by what its sides bulge.
#[derive(Clone, Copy, Debug)]
pub(super) struct Chart {
    h: Matrix3<f64>,
    bulge: [Vector2<f64>; 4],
}

impl Chart {
    /// Picture of `(s, t)`: (0, 0) is corner 0, (1, 0) corner 1, (1, 1) corner 2.
    pub(super) fn px(&self, s: f64, t: f64) -> Vector2<f64> {
        let q = self.h * Vector3::new(s, t, 1.0);
        let (along, down) = (4.0 * s * (1.0 - s), 4.0 * t * (1.0 - t));
        let [a, b, c, d] = self.bulge;
        Vector2::new(q.x, q.y) / q.z + (a * (1.0 - t) + c * t) * along + (b * s + d * (1.0 - s)) * down
    }
}

/// The homography from the corners (0, 0), (1, 0), (1, 1), (0, 1) to four places (P. Heckbert, 1989).
pub(super) fn square_to(p: &[Vector2<f64>; 4]) -> Option<Matrix3<f64>> {
    let (d1, d2) = (p[1] - p[2], p[3] - p[2]);
    let sum = p[0] - p[1] + p[2] - p[3];
    let area = d1.perp(&d2);
    if area.abs() < 1e-9 {
        return None;
    }
    let (g, k) = (sum.perp(&d2) / area, d1.perp(&sum) / area);
    let (a, b) = (p[1] - p[0] + p[1] * g, p[3] - p[0] + p[3] * k);
    let h = Matrix3::new(a.x, b.x, p[0].x, a.y, b.y, p[0].y, g, k, 1.0);
    // No corner may lie beyond the horizon.
    [1.0 + g, 1.0 + k, 1.0 + g + k].iter().all(|w| *w > 0.05).then_some(h)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_corners_of_a_square_are_found_below_the_pixel() {
        let truth = [[20.3, 15.7], [61.2, 22.4], [55.8, 60.1], [14.9, 49.6]].map(Vector2::from);
        let inside =
            |p: Vector2<f64>| (0..4).all(|k| (truth[(k + 1) % 4] - truth[k]).perp(&(p - truth[k])) >= 0.0);
        let picture = Plane::from_fn(80, 75, |x, y| {
            let part = (0..100).filter(|i| {
                let [dx, dy] = [i % 10, i / 10].map(|k| f64::from(k) / 10.0 - 0.45);
                inside(Vector2::new(x as f64 + dx, y as f64 + dy))
            });
            (220.0 - 1.8 * part.count() as f64) as u8
        });
        let start = truth.map(|p| p + Vector2::new(1.2, -0.8));
        let found = Outline::fit(&picture, &start, true, 3.0).unwrap();
        for k in 0..4 {
            let off = (found.corners[k] - truth[k]).norm();
            assert!(off < 0.12 && found.sigma_px[k] < 0.2, "{k}: {off} {}", found.sigma_px[k]);
        }
        assert!(Outline::fit(&picture, &start, false, 3.0).is_none());
    }

    #[test]
    fn charts_hit_the_corners() {
        let p = [[10.0, 10.0], [50.0, 12.0], [45.0, 60.0], [8.0, 40.0]].map(Vector2::from);
        let h = square_to(&p).unwrap();
        let chart = Chart { h, bulge: [Vector2::new(0.0, 1.0); 4] };
        for (k, (s, t)) in [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].into_iter().enumerate() {
            assert!((chart.px(s, t) - p[k]).norm() < 1e-9);
        }
        assert!(square_to(&[Vector2::zeros(); 4]).is_none());
    }
}
