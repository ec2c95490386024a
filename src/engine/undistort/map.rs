//! Where each pixel of the output comes from.

use std::sync::Arc;

use nalgebra::{Vector2, Vector3};

use super::{MAX_ANGLE_RAD, reach};
use crate::{
    Error, Result,
    camera::{Camera, LANES, Lanes, Model},
    image::Plane,
    lens::Lens,
};

/// Fraction bits of a fixed-point position: 1/16384 px, and pictures up to 131 071 px wide.
pub(super) const FRACTION_BITS: u32 = 14;
/// One pixel in fixed point.
pub(super) const ONE: i32 = 1 << FRACTION_BITS;
/// Stands in the place of a position that is not valid.
pub(super) const INVALID: i32 = i32::MIN;

/// Adding it leaves an integer in the low bits of the sum: rounding that every lane can do.
const TO_INTEGER: f64 = 6_755_399_441_055_744.0; // 1.5 · 2⁵²

/// How far beyond the centres of the outermost pixels a position may lie by rounding, px.
const SLACK_PX: f64 = 1e-6;

/// From the pixels of an undistorted picture to positions in the photograph.
///
/// It holds lenses, not positions: a row of positions costs less to compute than to fetch from memory.
#[derive(Clone, Debug)]
pub struct Map {
    source: Arc<dyn Lens>,
    target: [f64; 4],
    size: [usize; 2],
    /// tan² of the largest angle off the axis that may be shown.
    limit2: f64,
}

/// Pixels between two nodes of a row.
const STEP: usize = 2 * LANES;

/// Positions of one row in fixed point.
#[derive(Clone, Debug, Default)]
pub(super) struct Row {
    /// x · [`ONE`], or [`INVALID`].
    pub(super) x: Vec<i32>,
    /// y · [`ONE`]; anything where x is [`INVALID`].
    pub(super) y: Vec<i32>,
    /// Position of every [`STEP`]-th pixel, from the one before the row, px.
    nodes: [Vec<f64>; 2],
}

impl Map {
    /// The map from the pinhole camera `target` back to the lens `source`.
    ///
    /// # Errors
    /// [`Error::Invalid`] where a camera is not valid, `target` is not a pinhole, or a side is longer than 131 071 px.
    pub fn new(source: &dyn Lens, target: &Camera) -> Result<Self> {
        source.validate()?;
        target.validate()?;
        if target.model != Model::Pinhole {
            return Err(Error::Invalid(format!(
                "undistorted pictures need a camera without distortion, not {}: give a pinhole camera",
                target.model
            )));
        }
        let longest = source.size_px().into_iter().chain(target.size_px).max().unwrap_or_default();
        if longest >= 1 << (31 - FRACTION_BITS) {
            return Err(Error::Invalid(format!(
                "a side of {longest} px is too long: give a smaller picture"
            )));
        }
        let [fx, fy, cx, cy] = target.intrinsics();
        let [w, h] = target.size_px.map(|n| f64::from(n) - 1.0);
        let view = [[0.0, 0.0], [w, 0.0], [0.0, h], [w, h]]
            .map(|[u, v]| ((u - cx) / fx).hypot((v - cy) / fy))
            .into_iter()
            .fold(0.0, f64::max)
            .min(MAX_ANGLE_RAD.tan());
        // What lies just on the limit counts as within.
        let limit = reach::fold_within(source, view).min(MAX_ANGLE_RAD.tan()) * (1.0 + 1e-9);
        Ok(Self {
            source: source.shared(),
            target: [fx, fy, cx, cy],
            size: target.size_px.map(|n| n as usize),
            limit2: limit * limit,
        })
    }

    /// `[width, height]` of the undistorted picture, px.
    pub const fn size(&self) -> [usize; 2] {
        self.size
    }

    /// `[width, height]` of the photograph, px.
    pub fn source_size(&self) -> [usize; 2] {
        self.source.size_px().map(|n| n as usize)
    }

    /// Position in the photograph of the output position `(u, v)`, px; `None` where it is not valid (see the module).
    pub fn at(&self, u: f64, v: f64) -> Option<Vector2<f64>> {
        let [fx, fy, cx, cy] = self.target;
        let (x, y) = ((u - cx) / fx, (v - cy) / fy);
        if x * x + y * y > self.limit2 {
            return None;
        }
        let px = self.source.project_px(&Vector3::new(x, y, 1.0))?;
        let [w, h] = self.last();
        let inside = |a: f64, last: f64| (-SLACK_PX..=last + SLACK_PX).contains(&a);
        (inside(px.x, w) && inside(px.y, h)).then(|| Vector2::new(px.x.clamp(0.0, w), px.y.clamp(0.0, h)))
    }

    /// 255 where the output pixel is valid, 0 elsewhere.
    pub fn mask(&self) -> Plane<u8> {
        let [w, h] = self.size;
        let mut row = Row::default();
        let mut mask = Plane::new(w, h);
        for v in 0..h {
            self.row(v, &mut row);
            for (out, x) in mask.row_mut(v).iter_mut().zip(&row.x) {
                *out = if *x == INVALID { 0 } else { 255 };
            }
        }
        mask
    }

    /// Whether all pixels on the border of the output are valid, and so all of it.
    pub(super) fn border_is_valid(&self) -> bool {
        let [w, h] = self.size;
        let valid = |u: usize, v: usize| self.at(u as f64, v as f64).is_some();
        (0..w).all(|u| valid(u, 0) && valid(u, h - 1)) && (0..h).all(|v| valid(0, v) && valid(w - 1, v))
    }

    /// Centre of the last pixel of the photograph, px.
    fn last(&self) -> [f64; 2] {
        self.source.size_px().map(|n| f64::from(n) - 1.0)
    }

    /// Positions of row `v`.
    ///
    /// Every [`STEP`]-th pixel goes through the model; between them a cubic through four neighbours stands in for it where its
    /// fourth differences show that it is as good ([`cubic`]). Elsewhere, and near the border of the photograph, every
    /// pixel goes through the model.
    #[inline(always)]
    pub(super) fn row(&self, v: usize, row: &mut Row) {
        let [width, _] = self.size;
        let steps = width.div_ceil(STEP);
        row.x.resize(steps * STEP, INVALID);
        row.y.resize(steps * STEP, INVALID);
        let [_, fy, _, cy] = self.target;
        let y = (v as f64 - cy) / fy;
        self.place_nodes(y, steps + 4, &mut row.nodes);
        let inside = |u: f64| self.ray_x(u).powi(2) + y * y <= self.limit2;
        let last = self.last();
        let (xs, ys) = (row.x.as_chunks_mut().0, row.y.as_chunks_mut().0);
        let nodes = row.nodes[0].windows(5).zip(row.nodes[1].windows(5));
        for (k, ((xs, ys), (a, b))) in xs.iter_mut().zip(ys).zip(nodes).enumerate() {
            let first = (k * STEP) as f64;
            let smooth = inside(first) && inside(first + STEP as f64);
            if !(smooth && cubic(a, last[0], xs) && cubic(b, last[1], ys)) {
                let halves = xs.as_chunks_mut().0.iter_mut().zip(ys.as_chunks_mut().0);
                for (h, (xs, ys)) in halves.enumerate() {
                    self.exact(first + (h * LANES) as f64, y, xs, ys);
                }
            }
        }
        row.x.truncate(width);
        row.y.truncate(width);
    }

    /// x of the ray of column `u` in the plane z = 1.
    fn ray_x(&self, u: f64) -> f64 {
        let [fx, _, cx, _] = self.target;
        (u - cx) / fx
    }

    /// Positions of `count` nodes of a row, the first one [`STEP`] pixels before it, px.
    fn place_nodes(&self, y: f64, count: usize, nodes: &mut [Vec<f64>; 2]) {
        let mut px: [Lanes; 2] = [[0.0; LANES]; 2];
        nodes.iter_mut().for_each(Vec::clear);
        for k in (0..count).step_by(LANES) {
            let x = std::array::from_fn(|i| self.ray_x((k + i) as f64 * STEP as f64 - STEP as f64));
            self.source.project_px_batch(&[x, [y; LANES], [1.0; LANES]], &mut px);
            nodes[0].extend(px[0]);
            nodes[1].extend(px[1]);
        }
    }

    /// Positions of the pixels from column `first`, by the model.
    fn exact(&self, first: f64, y: f64, xs: &mut [i32; LANES], ys: &mut [i32; LANES]) {
        let [w, h] = self.last();
        let x: Lanes = std::array::from_fn(|i| self.ray_x(first + i as f64));
        let mut px: [Lanes; 2] = [[0.0; LANES]; 2];
        self.source.project_px_batch(&[x, [y; LANES], [1.0; LANES]], &mut px);
        for i in 0..LANES {
            let (a, b) = (px[0][i], px[1][i]);
            let valid = (a >= -SLACK_PX)
                & (a <= w + SLACK_PX)
                & (b >= -SLACK_PX)
                & (b <= h + SLACK_PX)
                & (x[i] * x[i] + y * y <= self.limit2);
            let fixed =
                |p: f64, last: f64| (p.clamp(0.0, last) * f64::from(ONE) + TO_INTEGER).to_bits() as i32;
            xs[i] = if valid { fixed(a, w) } else { INVALID };
            ys[i] = fixed(b, h);
        }
    }
}

/// Fills the pixels between nodes 1 and 2 of five, in fixed point, by the cubic through nodes 0 to 3; `false` where that could
/// be off by more than 2.4e-5 px (less than the fixed point), or a position be outside of `0..=last`.
///
/// The error of the cubic is at most 3/128 of the fourth difference (Newton's interpolation).
#[inline(always)]
fn cubic(nodes: &[f64], last: f64, out: &mut [i32; STEP]) -> bool {
    const MOST: f64 = 1e-3;
    // Lagrange's weights of nodes 0, 2, 3; with differences to node 1 its own is not needed.
    const WEIGHTS: [[f32; STEP]; 3] = {
        let mut w = [[0.0; STEP]; 3];
        let mut i = 0;
        while i < STEP {
            let t = i as f32 / STEP as f32;
            w[0][i] = -t * (t - 1.0) * (t - 2.0) / 6.0;
            w[1][i] = -(t + 1.0) * t * (t - 2.0) / 2.0;
            w[2][i] = (t + 1.0) * t * (t - 1.0) / 6.0;
            i += 1;
        }
        w
    };
    // As [`TO_INTEGER`]: way enough, for `c` is within 128 px of `b`.
    const TO_INTEGER_F32: f32 = 12_582_912.0; // 1.5 · 2²³
    let &[a, b, c, d, e] = nodes else { return false };
    let (bend, next) = (a - 2.0 * b + c, b - 2.0 * c + d);
    let fourth = bend - 2.0 * next + (c - 2.0 * d + e);
    // Between b and c it leaves their chord by at most an eighth of the larger second difference.
    let within = |p: f64| p >= 1.0 && p <= last - 1.0;
    let tame = bend.abs().max(next.abs()) <= 8.0 && (c - b).abs() <= 128.0;
    if !(fourth.abs() <= MOST && within(b) && within(c) && tame) {
        return false;
    }
    let whole = b * f64::from(ONE) + TO_INTEGER;
    let rest = (b * f64::from(ONE) - (whole - TO_INTEGER)) as f32;
    let base = (whole.to_bits() as i32).wrapping_sub(TO_INTEGER_F32.to_bits() as i32);
    let [a, c, d] = [a, c, d].map(|p| ((p - b) * f64::from(ONE)) as f32);
    for i in 0..STEP {
        let sum = WEIGHTS[0][i] * a + WEIGHTS[1][i] * c + WEIGHTS[2][i] * d;
        out[i] = base.wrapping_add((sum + rest + TO_INTEGER_F32).to_bits() as i32);
    }
    true
}
