//! Where dots may be: connected pixels that are darker, or brighter, than the mean of their surroundings.
//!
//! The local mean follows shadows and vignetting, so one threshold serves the whole picture. Dots of 4 to about 30 px in
//! diameter are whole in the window; larger ones are found where the picture is halved.

use nalgebra::Vector2;

use crate::image::Plane;

/// Half side of the window of the mean, px.
const HALF: usize = 16;
/// Fewest pixels of a spot.
const SMALLEST: i64 = 9;
/// Largest extent of a spot, px.
const WIDEST: i64 = 44;
/// Area of a spot over that of the ellipse with the same second moments: 1 for ellipses, 0.955 for squares.
const FILLED: std::ops::RangeInclusive<f64> = 0.86..=1.06;
/// Largest ratio of the axes.
const SLIM: f64 = 6.0;

/// Connected pixels that may be a dot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Spot {
    /// Centroid, px.
    pub(super) px: Vector2<f64>,
    /// Ellipse with the same second moments, px²: `Q = [xx, xy, yy]`, the boundary is `dᵀ Q⁻¹ d = 1`.
    pub(super) ellipse: [f64; 3],
    /// Mean distance from the local mean, grey levels, > 0.
    pub(super) contrast: f64,
    /// Darker than its surroundings.
    pub(super) dark: bool,
    /// Its area over that of the ellipse.
    pub(super) filled: f64,
}

impl Spot {
    /// Area of the ellipse over π, px².
    pub(super) fn area(&self) -> f64 {
        let [a, b, c] = self.ellipse;
        (a * c - b * b).max(0.0).sqrt()
    }

    /// Length of a step in units of the ellipse's radius along it: on a board of discs this undoes the tilt.
    pub(super) fn radii(&self, step: Vector2<f64>) -> f64 {
        self.product(step, step).max(0.0).sqrt()
    }

    /// Product of two steps in the metric of the ellipse.
    pub(super) fn product(&self, p: Vector2<f64>, q: Vector2<f64>) -> f64 {
        let [a, b, c] = self.ellipse;
        (c * p.x * q.x - b * (p.x * q.y + p.y * q.x) + a * p.y * q.y) / (a * c - b * b)
    }
}

/// Pixels `x0..x1` of a row on one side of the local mean.
#[derive(Clone, Copy)]
struct Run {
    y: u32,
    x0: u32,
    x1: u32,
    dark: bool,
    /// Sum of distances from the local mean, times the window's area.
    sum: i64,
    parent: u32,
}

/// Finds the spots that differ from their surroundings by more than `least` grey levels.
pub(super) fn spots(picture: &Plane<u8>, least: f64) -> Vec<Spot> {
    let mut runs = runs(picture, least);
    connect(&mut runs);
    let mut sums = vec![Sums::default(); runs.len()];
    let size = [picture.width() as u32, picture.height() as u32];
    for i in 0..runs.len() {
        let root = root(&mut runs, i as u32) as usize;
        if let Some(sum) = sums.get_mut(root) {
            sum.add(&runs[i], size);
        }
    }
    sums.iter().zip(&runs).filter_map(|(s, r)| s.spot(r.dark)).collect()
}

fn runs(picture: &Plane<u8>, least: f64) -> Vec<Run> {
    let (w, h) = (picture.width(), picture.height());
    let mut runs = Vec::new();
    if w < 5 || h < 5 {
        return runs;
    }
    let side = 2 * HALF + 1;
    let area = (side * side) as i32;
    let least = (least * f64::from(area)) as i32;
    // Beyond the border the outermost pixels are repeated.
    let clamp = |y: isize| picture.row(y.clamp(0, h as isize - 1) as usize);
    let mut column = vec![0u16; w];
    for y in -(HALF as isize)..=HALF as isize {
        column.iter_mut().zip(clamp(y)).for_each(|(c, v)| *c += u16::from(*v));
    }
    let mut padded = vec![0u16; w + side];
    for y in 0..h {
        padded[HALF..HALF + w].copy_from_slice(&column);
        padded[..HALF].fill(column[0]);
        padded[HALF + w..].fill(column[w - 1]);
        let mut sum: i32 = padded[..side].iter().map(|v| i32::from(*v)).sum();
        let (mut kind, mut x0, mut total) = (0i8, 0, 0i64);
        let mut close = |kind: i8, x0: usize, x1: usize, total: i64| {
            let parent = runs.len() as u32;
            runs.push(Run { y: y as u32, x0: x0 as u32, x1: x1 as u32, dark: kind > 0, sum: total, parent });
        };
        let steps = padded[side..].iter().zip(&padded);
        for (x, (v, (enters, leaves))) in picture.row(y).iter().zip(steps).enumerate() {
            let off = sum - area * i32::from(*v);
            let now = i8::from(off > least) - i8::from(off < -least);
            if now != kind {
                if kind != 0 {
                    close(kind, x0, x, total);
                }
                (kind, x0, total) = (now, x, 0);
            }
            total += i64::from(off.abs());
            sum += i32::from(*enters) - i32::from(*leaves);
        }
        if kind != 0 {
            close(kind, x0, w, total);
        }
        let (leaves, enters) = (clamp(y as isize - HALF as isize), clamp((y + HALF + 1) as isize));
        for (c, (e, l)) in column.iter_mut().zip(enters.iter().zip(leaves)) {
            *c = *c + u16::from(*e) - u16::from(*l);
        }
    }
    runs
}

fn root(runs: &mut [Run], mut i: u32) -> u32 {
    while runs[i as usize].parent != i {
        let up = runs[i as usize].parent;
        runs[i as usize].parent = runs[up as usize].parent;
        i = up;
    }
    i
}

/// Joins runs of neighbouring rows that share a column.
fn connect(runs: &mut [Run]) {
    let mut above = 0;
    for i in 0..runs.len() {
        let run = runs[i];
        while above < i
            && (runs[above].y + 1 < run.y || (runs[above].y + 1 == run.y && runs[above].x1 <= run.x0))
        {
            above += 1;
        }
        let mut j = above;
        while j < i && runs[j].y < run.y && runs[j].x0 < run.x1 {
            if runs[j].dark == run.dark && runs[j].x1 > run.x0 {
                let (a, b) = (root(runs, j as u32), root(runs, i as u32));
                runs[a.max(b) as usize].parent = a.min(b);
            }
            j += 1;
        }
    }
}

/// Sums over the pixels of a spot.
#[derive(Clone, Copy, Default)]
struct Sums {
    n: i64,
    x: i64,
    y: i64,
    xx: i64,
    xy: i64,
    yy: i64,
    off: i64,
    /// First and last column, first row.
    extent: Option<[u32; 3]>,
    last_row: u32,
    at_border: bool,
}

impl Sums {
    fn add(&mut self, run: &Run, [w, h]: [u32; 2]) {
        let (x0, x1, y) = (i64::from(run.x0), i64::from(run.x1), i64::from(run.y));
        let n = x1 - x0;
        let x = (x0 + x1 - 1) * n / 2;
        let squares = |m: i64| (m - 1) * m * (2 * m - 1) / 6;
        self.n += n;
        self.x += x;
        self.y += n * y;
        self.xx += squares(x1) - squares(x0);
        self.xy += x * y;
        self.yy += n * y * y;
        self.off += run.sum;
        let e = self.extent.get_or_insert([run.x0, run.x1, run.y]);
        *e = [e[0].min(run.x0), e[1].max(run.x1), e[2].min(run.y)];
        self.last_row = self.last_row.max(run.y);
        self.at_border |= run.x0 == 0 || run.x1 == w || run.y == 0 || run.y + 1 == h;
    }

    fn spot(&self, dark: bool) -> Option<Spot> {
        let [x0, x1, y0] = self.extent?.map(i64::from);
        let wide = (x1 - x0).max(i64::from(self.last_row) + 1 - y0);
        if self.at_border || self.n < SMALLEST || wide > WIDEST {
            return None;
        }
        let n = self.n as f64;
        let px = Vector2::new(self.x as f64 / n, self.y as f64 / n);
        // Pixels are squares, not points: 1/12. Four times the second moments are the ellipse.
        let q = [
            4.0 * (self.xx as f64 / n - px.x * px.x + 1.0 / 12.0),
            4.0 * (self.xy as f64 / n - px.x * px.y),
            4.0 * (self.yy as f64 / n - px.y * px.y + 1.0 / 12.0),
        ];
        let contrast = self.off as f64 / (n * ((2 * HALF + 1) as f64).powi(2));
        let mut spot = Spot { px, ellipse: q, contrast, dark, filled: 0.0 };
        let area = spot.area();
        spot.filled = n / (std::f64::consts::PI * area);
        // (largest + smallest)² / (largest · smallest) of the axes' squares.
        let slim = (q[0] + q[2]) / area;
        (FILLED.contains(&spot.filled) && slim < SLIM + 1.0 / SLIM).then_some(spot)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spots_of_both_kinds_have_their_place_and_shape() {
        let picture = Plane::from_fn(90, 60, |x, y| {
            let inside = |cx: f64, cy: f64, a: f64, b: f64| {
                ((x as f64 - cx) / a).powi(2) + ((y as f64 - cy) / b).powi(2) < 1.0
            };
            if inside(20.0, 30.0, 9.0, 5.0) {
                20
            } else if inside(60.5, 24.0, 4.0, 7.0) {
                230
            } else {
                110
            }
        });
        let found = spots(&picture, 5.0);
        assert_eq!(found.len(), 2);
        let by = |dark: bool| found.iter().find(|s| s.dark == dark).unwrap();
        assert!((by(true).px - Vector2::new(20.0, 30.0)).norm() < 0.01);
        assert!((by(false).px - Vector2::new(60.5, 24.0)).norm() < 0.1);
        for (dark, q) in [(true, [81.0, 0.0, 25.0]), (false, [16.0, 0.0, 49.0])] {
            assert!(by(dark).ellipse.iter().zip(q).all(|(a, b)| (a - b).abs() < 0.08 * b + 2.0), "{found:?}");
        }
        assert!((by(true).radii(Vector2::new(9.0, 0.0)) - 1.0).abs() < 0.05);
    }

    #[test]
    fn pictures_of_any_shape() {
        for (w, h) in [(0, 0), (1, 1), (4, 900), (900, 4), (5, 5), (6, 400), (400, 6)] {
            let picture = Plane::from_fn(w, h, |x, y| if (x / 3 + y / 3) % 2 == 0 { 9 } else { 240 });
            let _ = spots(&picture, 2.0);
        }
    }
}
