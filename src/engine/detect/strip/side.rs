//! One edge alone, the side of a marker: the strip fit ([`super`]) where no second edge crosses.
//!
//! ```text
//! I = m + n t + (a + b t) P((u − o − p t − k t²) / h),     t = v / half the length
//! ```
//!
//! with the profile P of one edge, in rows across it. Eight unknowns: `o p k`, the logarithm of the blur, and both levels with their
//! change along the side. All pixels that show nothing but the two surfaces are used with equal weight (maximum likelihood under
//! white noise); how the rows scatter says how true the covariance is that follows ([`super::scatter`]).

use nalgebra::{Matrix2, Matrix3, SMatrix, SVector, Vector2, Vector3};

use super::{
    edge::Edge,
    lanes::{Block, LANES, limit},
    normal::ROUNDING,
    scatter::towards,
};
use crate::image::{Plane, Sample};

/// Rows at most: what more of them would tell is below the model's own error.
const MOST_ROWS: f64 = 96.0;
const FEWEST_ROWS: usize = 5;
/// Half width of a row at first, px; then in widths of the profile, and at most.
const FIRST_HALF: f32 = 3.0;
const HALF: (f32, f32, f32) = (2.8, 0.6, 15.0);
/// How far from the next edge pixels are used, in widths of the profile, and how many at least: px, widths.
const FOREIGN_EDGE: (f32, f32, f32) = (2.5, 0.6, 1.2);
/// Blur at first and its bounds, px along u.
const BLUR: (f32, f32, f32) = (0.6, 0.12, 8.0);
/// Kept from either end: px, widths of the profile, at most this share of the length.
const ENDS: (f64, f64, f64) = (1.0, 3.0, 0.25);
/// Steps before and after the blur tells how wide rows must be.
const STEPS: [usize; 2] = [3, 7];
/// A smaller step is the last, px.
const STILL: f64 = 2e-3;
const MOVING: f64 = 0.03;
/// A row of so many times the usual squares shows something else.
const FOREIGN: f64 = 9.0;
/// The side of a square bends by a standard deviation of length² / this / the size of the picture.
const BEND: f64 = 6.0;
/// Farthest a fit may move an end, px.
const FARTHEST: f64 = 1.5;
/// Largest variance of an end before all sides say together how they bend, px².
const LARGEST_VARIANCE: f64 = 0.5;
/// Both levels change along a side by a standard deviation of this share of their difference.
const UNEVEN: f64 = 0.2;
/// Error of the model that no residual shows, px.
const FLOOR_PX: f64 = 0.0015;

/// Where the side of a square lies, roughly.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Start {
    /// Ends, within about 1 px across.
    pub(crate) ends: [Vector2<f64>; 2],
    /// How far the middle lies off the chord, px.
    pub(crate) bulge: Vector2<f64>,
    /// Out of the square, of unit length.
    pub(crate) outwards: Vector2<f64>,
    /// Distance of the next edge inside and outside, at least, px.
    pub(crate) clear_px: [f64; 2],
    /// Whether the square is darker than what is around it.
    pub(crate) dark: bool,
}

/// A fitted side.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Side {
    origin: Vector2<f64>,
    steep: bool,
    /// Half the length along v.
    half: f64,
    /// o, p, k: u = o + p t + k t².
    place: Vector3<f64>,
    /// Their covariance under white noise, px².
    covariance: Matrix3<f64>,
    /// Variance of a place at the ends by how the rows scatter, as a multiple of the white one, and how many rows told it.
    scatter: (f64, f64),
}

/// How a side bends, and where.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Curvature {
    pub(crate) at: Vector2<f64>,
    pub(crate) along: Vector2<f64>,
    pub(crate) normal: Vector2<f64>,
    pub(crate) value: f64,
    pub(crate) variance: f64,
}

type Matrix = SMatrix<f64, 8, 8>;
type Vector = SVector<f64, 8>;

/// Products of the base columns d = ∂I/∂u, q = ∂I/∂ln s, 1, P and the residual over a row.
#[derive(Clone, Copy, Default)]
struct Row {
    t: f64,
    /// By pairs of [`BASE`].
    sums: [[f64; 5]; 5],
}

/// Base column and power of t of each unknown.
const BASE: [(usize, i32); 8] = [(0, 0), (0, 1), (0, 2), (1, 0), (2, 0), (2, 1), (3, 0), (3, 1)];
const RESIDUAL: usize = 4;
const COUNT: usize = 2;

impl Row {
    fn squares(&self) -> f64 {
        self.sums[RESIDUAL][RESIDUAL] / self.sums[COUNT][COUNT].max(1.0)
    }

    fn gradient(&self) -> Vector {
        Vector::from_fn(|i, _| self.sums[BASE[i].0][RESIDUAL] * self.t.powi(BASE[i].1))
    }
}

/// Pixels across the edge, row by row.
#[derive(Default)]
struct Pixels {
    rows: Vec<(f32, f32)>,
    blocks: usize,
    values: Vec<Block>,
    /// 1 where a pixel is used, else 0.
    used: Vec<Block>,
}

struct Fit {
    edge: Edge,
    half: f64,
    /// m, n, a, b.
    levels: [f64; 4],
    /// Standard deviation of the bend that is expected, px.
    bend_px: f64,
    variance: f64,
}

impl Side {
    /// Fits a side; `None` where the pixels show no such edge.
    pub(crate) fn fit<T: Sample>(picture: &Plane<T>, start: &Start) -> Option<Self> {
        let [from, to] = start.ends;
        let along = 0.5 * (to - from);
        if !(along.norm() >= 3.0 && along.iter().all(|v| v.abs() < 1e6)) {
            return None;
        }
        let middle = 0.5 * (from + to);
        let origin = middle.map(f64::round);
        let steep = along.y.abs() >= along.x.abs();
        let uv = |p: Vector2<f64>| if steep { [p.x, p.y] } else { [p.y, p.x] };
        let mut edge = Edge::through((middle + start.bulge - origin).into(), along.into());
        let half = uv(along)[1].abs();
        // v runs from the middle of the side.
        let (cos, sin) = (f64::from(edge.cos()), f64::from(edge.p * edge.cos()).abs());
        edge.k = (-2.0 * uv(start.bulge)[0] / (half * half)) as f32;
        (edge.s, edge.steep) = (BLUR.0, steep);
        let out = uv(start.outwards)[0].signum();
        let [inside, outside] = start.clear_px.map(|c| c / cos);
        let clear = if out > 0.0 { [inside, outside] } else { [outside, inside] };
        let size = picture.width().max(picture.height()) as f64;
        let bend_px = 4.0 * along.norm_squared() / BEND / size + 1e-3;
        let mut fit = Fit { edge, half, levels: [0.0; 4], bend_px, variance: 4.0 };
        let mut pixels = Pixels::default();
        let mut across = FIRST_HALF;
        let (mut rows, mut solved) = (Vec::new(), None);
        for (stage, steps) in STEPS.into_iter().enumerate() {
            fit.edge.set_profile();
            let sd = f64::from(fit.edge.sd());
            let length = 2.0 * along.norm();
            let kept = (ENDS.0 + ENDS.1 * sd * cos + f64::from(across) * sin).min(ENDS.2 * length);
            let reach = half * (1.0 - 2.0 * kept / length);
            pixels.gather(picture, origin, &fit.edge, reach, across, clear)?;
            if stage == 0 {
                fit.levels = pixels.levels(&fit.edge);
            }
            for _ in 0..steps {
                fit.rows(&pixels, &mut rows);
                solved = Some(fit.step(&mut rows)?);
                if solved.as_ref().is_some_and(|s| s.1 < STILL) {
                    break;
                }
            }
            across = (HALF.0 * fit.edge.sd() + HALF.1).min(HALF.2);
        }
        // What still moves is no answer.
        let (inverse, _) = solved.filter(|s| s.1 < MOVING)?;
        fit.rows(&pixels, &mut rows);
        let side = fit.side(origin, &inverse, &mut rows);
        let a = fit.levels[2] * out;
        let right = a * if start.dark { 1.0 } else { -1.0 } > 1.5 * fit.variance.sqrt()
            && fit.levels[3].abs() < a.abs();
        let stayed = |t: f64, end: Vector2<f64>| {
            let (at, _) = side.at(t);
            (at - end).dot(&start.outwards).abs() < FARTHEST && side.variance(t) < LARGEST_VARIANCE
        };
        let [first, last] = if uv(along)[1] > 0.0 { [from, to] } else { [to, from] };
        (right && stayed(-1.0, first) && stayed(1.0, last)).then_some(side)
    }

    /// Position at t and its change with t, px.
    fn at(&self, t: f64) -> (Vector2<f64>, Vector2<f64>) {
        let [o, p, k] = self.place.into();
        let turned = |u: f64, v: f64| if self.steep { Vector2::new(u, v) } else { Vector2::new(v, u) };
        (self.origin + turned(o + (p + k * t) * t, self.half * t), turned(p + 2.0 * k * t, self.half))
    }

    /// Variance of the place at t along u under white noise, px².
    fn variance(&self, t: f64) -> f64 {
        let c = Vector3::new(1.0, t, t * t);
        c.dot(&(self.covariance * c))
    }

    /// Curvature of the side: position of its middle, unit tangent and normal (towards larger u), curvature along the normal and its
    /// variance, 1/px.
    pub(crate) fn curvature(&self) -> Curvature {
        let (at, along) = self.at(0.0);
        let cos = self.half / along.norm();
        let along = along.normalize();
        let normal =
            if self.steep { Vector2::new(along.y, -along.x) } else { Vector2::new(-along.y, along.x) };
        let to = 2.0 * cos.powi(3) / (self.half * self.half);
        let variance = self.covariance[(2, 2)] * to * to;
        Curvature { at, along, normal, value: self.place.z * to, variance }
    }

    /// The same side where something else tells its curvature, 1/px.
    #[must_use]
    pub(crate) fn bent(mut self, curvature: f64, variance: f64) -> Self {
        let c = self.curvature();
        let scale = self.place_per_curvature();
        // Both say the same thing of k: as one more measurement of it.
        let gain = self.covariance.column(2) / (self.covariance[(2, 2)] + variance * scale * scale);
        self.place += gain * ((curvature - c.value) * scale);
        self.covariance -= gain * self.covariance.row(2);
        self
    }

    fn place_per_curvature(&self) -> f64 {
        let (_, along) = self.at(0.0);
        0.5 * self.half * self.half * (along.norm() / self.half).powi(3)
    }

    /// How the rows scatter, as a multiple of white noise.
    pub(crate) const fn scatter(&self) -> f64 {
        self.scatter.0
    }

    /// Where two sides meet near `start`, and the standard deviation per axis, px, among sides that scatter `usual`ly.
    pub(crate) fn crossing(
        &self,
        other: &Self,
        start: Vector2<f64>,
        usual: f64,
    ) -> Option<(Vector2<f64>, f64)> {
        let mut px = start;
        let mut inverse = Matrix2::identity();
        let mut variances = [0.0; 2];
        for _ in 0..4 {
            let (mut normals, mut off) = (Matrix2::zeros(), Vector2::zeros());
            for (i, side) in [self, other].into_iter().enumerate() {
                let d = px - side.origin;
                let [u, v] = if side.steep { [d.x, d.y] } else { [d.y, d.x] };
                let t = v / side.half;
                let [o, p, k] = side.place.into();
                off[i] = u - (o + (p + k * t) * t);
                let slope = (p + 2.0 * k * t) / side.half;
                let row = if side.steep { [1.0, -slope] } else { [-slope, 1.0] };
                normals.set_row(i, &row.into());
                let (scatter, n) = side.scatter;
                variances[i] = side.variance(t.clamp(-1.5, 1.5)) * towards(scatter, n, usual);
            }
            inverse = normals.try_inverse().filter(|_| normals.determinant().abs() > 0.1)?;
            px -= inverse * off;
        }
        let cov = inverse * Matrix2::from_diagonal(&variances.into()) * inverse.transpose();
        let sigma = (0.5 * cov.trace() + FLOOR_PX * FLOOR_PX).sqrt();
        ((px - start).norm() < 2.0 * FARTHEST && sigma.is_finite()).then_some((px, sigma))
    }
}

impl Pixels {
    /// Takes the pixels within `across` of the edge, and within `clear` at smaller and at larger u.
    fn gather<T: Sample>(
        &mut self,
        picture: &Plane<T>,
        origin: Vector2<f64>,
        edge: &Edge,
        reach: f64,
        across: f32,
        clear: [f64; 2],
    ) -> Option<()> {
        let (w, h) = (picture.width() as i64, picture.height() as i64);
        // The next edge is as blurred as this one.
        let sd = edge.sd();
        let [low, high] = clear
            .map(|c| across.min((c as f32 - FOREIGN_EDGE.0 * sd).max(FOREIGN_EDGE.1 + FOREIGN_EDGE.2 * sd)));
        self.blocks = ((low + high) as usize + 1).div_ceil(LANES);
        let lanes = (self.blocks * LANES) as i64;
        self.rows.clear();
        self.values.clear();
        self.used.clear();
        let every = ((2.0 * reach / MOST_ROWS).ceil() as usize).max(1);
        for v in (-(reach as i64)..=reach as i64).step_by(every) {
            let centre = edge.u(v as f32);
            let first = (centre - low).ceil() as i64;
            let (mut values, mut used) = ([[0.0; LANES]; 4], [[0.0; LANES]; 4]);
            let mut any = 0;
            for l in 0..lanes.min(4 * LANES as i64) {
                let u = first + l;
                if u as f32 > centre + high {
                    break;
                }
                let (x, y) = if edge.steep { (u, v) } else { (v, u) };
                let (x, y) = (x + origin.x as i64, y + origin.y as i64);
                if x < 0 || y < 0 || x >= w || y >= h {
                    continue;
                }
                let (block, lane) = (l as usize / LANES, l as usize % LANES);
                values[block][lane] = picture.at(x as usize, y as usize).to_f32();
                used[block][lane] = 1.0;
                any += 1;
            }
            if any >= 3 {
                self.rows.push((v as f32, first as f32));
                self.values.extend(&values[..self.blocks]);
                self.used.extend(&used[..self.blocks]);
            }
        }
        (self.rows.len() >= FEWEST_ROWS).then_some(())
    }

    /// Both levels as the means on either side of the edge.
    fn levels(&self, edge: &Edge) -> [f64; 4] {
        let (mut sums, mut counts) = ([0.0f32; 2], [0.0f32; 2]);
        for ((v, first), (values, used)) in
            self.rows.iter().zip(self.values.chunks(self.blocks).zip(self.used.chunks(self.blocks)))
        {
            for (l, (value, used)) in values.as_flattened().iter().zip(used.as_flattened()).enumerate() {
                let off = first + l as f32 - edge.u(*v);
                if off.abs() >= 0.8 {
                    let side = usize::from(off > 0.0);
                    sums[side] += used * value;
                    counts[side] += used;
                }
            }
        }
        let [low, high] = [0, 1].map(|i| f64::from(sums[i] / counts[i].max(1.0)));
        [0.5 * (low + high), 0.0, 0.5 * (high - low), 0.0]
    }
}

impl Fit {
    /// The products of every row.
    fn rows(&mut self, pixels: &Pixels, out: &mut Vec<Row>) {
        self.edge.set_profile();
        let edge = &self.edge;
        let step = 1.0 / edge.profile.h;
        let blur = edge.s * edge.s / (edge.sd() * edge.sd());
        let [m, n, a, b] = self.levels;
        out.clear();
        for (i, (v, first)) in pixels.rows.iter().enumerate() {
            let t = f64::from(*v) / self.half;
            let (mean, amplitude) = ((m + n * t) as f32, (a + b * t) as f32);
            let centre = edge.u(*v);
            let mut sums = [[[0f32; LANES]; 5]; 5];
            let range = i * pixels.blocks..(i + 1) * pixels.blocks;
            for (block, (values, used)) in
                pixels.values[range.clone()].iter().zip(&pixels.used[range]).enumerate()
            {
                for l in 0..LANES {
                    let u = first + (block * LANES + l) as f32;
                    let x = limit((u - centre) * step, 1.0);
                    let (p, slope) = edge.profile.at(x);
                    let w = used[l];
                    let d = -amplitude * step * slope * w;
                    let q = -amplitude * blur * x * slope * w;
                    let p = p * w;
                    let r = (values[l] - mean) * w - amplitude * p;
                    let base = [d, q, w, p, r];
                    for (j, row) in sums.iter_mut().enumerate() {
                        for (k, sum) in row.iter_mut().enumerate().skip(j) {
                            sum[l] += base[j] * base[k];
                        }
                    }
                }
            }
            let mut row = Row { t, ..Row::default() };
            for j in 0..5 {
                for k in j..5 {
                    let sum = f64::from(sums[j][k].iter().sum::<f32>());
                    (row.sums[j][k], row.sums[k][j]) = (sum, sum);
                }
            }
            out.push(row);
        }
    }

    /// Leaves out rows that show something else.
    fn weed(rows: &mut Vec<Row>) -> Option<()> {
        let mut squares: Vec<f64> = rows.iter().map(Row::squares).collect();
        squares.sort_by(f64::total_cmp);
        let most = FOREIGN * squares[squares.len() / 2].max(4.0 * ROUNDING);
        let all = rows.len();
        rows.retain(|r| r.squares() <= most);
        (rows.len() >= FEWEST_ROWS && 5 * rows.len() >= 3 * all).then_some(())
    }

    /// One Gauss–Newton step: the inverse of the normal matrix, and how far the side moved, px.
    fn step(&mut self, rows: &mut Vec<Row>) -> Option<(Matrix, f64)> {
        Self::weed(rows)?;
        let (mut matrix, mut right, mut squares, mut count) = (Matrix::zeros(), Vector::zeros(), 0.0, 0.0);
        for row in rows.iter() {
            let powers = [1.0, row.t, row.t.powi(2), row.t.powi(3), row.t.powi(4)];
            for i in 0..8 {
                for j in i..8 {
                    let power = powers[(BASE[i].1 + BASE[j].1) as usize];
                    matrix[(i, j)] += row.sums[BASE[i].0][BASE[j].0] * power;
                }
                right[i] += row.sums[BASE[i].0][RESIDUAL] * powers[BASE[i].1 as usize];
            }
            squares += row.sums[RESIDUAL][RESIDUAL];
            count += row.sums[COUNT][COUNT];
        }
        matrix.fill_lower_triangle_with_upper_triangle();
        // What is known of the bend and of the light.
        let bend = f64::from(self.edge.k) * 0.5 * self.half * self.half;
        matrix[(2, 2)] += self.variance / (self.bend_px * self.bend_px);
        right[2] -= self.variance * bend / (self.bend_px * self.bend_px);
        let even = self.variance / (UNEVEN * self.levels[2]).powi(2).max(1.0);
        for (i, level) in [(5, self.levels[1]), (7, self.levels[3])] {
            matrix[(i, i)] += even;
            right[i] -= even * level;
        }
        for i in 0..8 {
            matrix[(i, i)] += 1e-9 + 1e-7 * matrix[(i, i)];
        }
        // The blur at its bound is no unknown: clamping it afterwards would shift the place.
        let least = f64::from(BLUR.1 / self.edge.s).ln();
        let mut inverse = matrix.cholesky()?.inverse();
        let mut step = inverse * right;
        if step[3] < least {
            matrix.row_mut(3).fill(0.0);
            matrix.column_mut(3).fill(0.0);
            matrix[(3, 3)] = 1.0;
            right[3] = 0.0;
            inverse = matrix.cholesky()?.inverse();
            step = inverse * right;
            self.edge.s = BLUR.1;
        }
        self.variance = ((squares - step.dot(&right)).max(0.0) / (count - 8.0).max(1.0)).max(ROUNDING);
        let bound = |v: f64, most: f64| v.clamp(-most, most);
        let edge = &mut self.edge;
        edge.o += bound(step[0], 1.0) as f32;
        edge.p += (bound(step[1], 1.0) / self.half) as f32;
        edge.k += (bound(step[2], 1.0) * 2.0 / (self.half * self.half)) as f32;
        edge.s = (f64::from(edge.s) * bound(step[3], 0.5).exp()).clamp(BLUR.1.into(), BLUR.2.into()) as f32;
        for (level, step) in self.levels.iter_mut().zip(step.iter().skip(4)) {
            *level += step;
        }
        let moved = step.fixed_rows::<3>(0).amax();
        (moved.is_finite() && self.levels[2].abs() >= 1.0).then_some((inverse, moved))
    }

    fn side(&self, origin: Vector2<f64>, inverse: &Matrix, rows: &mut Vec<Row>) -> Side {
        let white = inverse * self.variance;
        let covariance = white.fixed_view::<3, 3>(0, 0).into_owned();
        // The rows as clusters, at both ends.
        let _ = Self::weed(rows);
        let seen = rows.iter().fold(Matrix::zeros(), |sum, r| {
            let g = r.gradient();
            sum + g * g.transpose()
        });
        let n = rows.len() as f64;
        let seen = inverse * seen * inverse;
        let share = [-1.0, 1.0].map(|t| {
            let c = Vector3::new(1.0, t, t * t);
            c.dot(&(seen.fixed_view::<3, 3>(0, 0) * c)) / c.dot(&(covariance * c))
        });
        let e = &self.edge;
        let place = Vector3::new(
            f64::from(e.o),
            f64::from(e.p) * self.half,
            f64::from(e.k) * 0.5 * self.half * self.half,
        );
        let scatter = 0.5 * (share[0] + share[1]) * n / (n - 3.0).max(1.0);
        Side { origin, steep: e.steep, half: self.half, place, covariance, scatter: (scatter, n) }
    }
}
