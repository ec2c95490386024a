//! Where each pixel of the output comes from.

use nalgebra::{Vector2, Vector3};

use super::{MAX_ANGLE_RAD, reach};
use crate::calib::{
    Error, Result,
    camera::{Camera, LANES, Lanes, Model},
    image::Plane,
};

/// Fraction bits of a fixed-point position: 1/16384 px, and pictures up to 131 071 px wide.
pub(super) const FRACTION_BITS: u32 = 14;
/// One pixel in fixed point.
pub(super) const ONE: i32 = 1 << FRACTION_BITS;
/// Stands in the place of a position that is not valid.
pub(super) const INVALID: i32 = i32::MIN;

/// How far beyond the centres of the outermost pixels a position may lie by rounding, px.
const SLACK_PX: f64 = 1e-6;

/// From the pixels of an undistorted picture to positions in the photograph.
///
/// It holds cameras, not positions: a row of positions costs less to compute than to fetch from memory.
#[derive(Clone, Debug)]
pub struct Map {
    source: Camera,
    target: [f64; 4],
    size: [usize; 2],
    /// tan² of the largest angle off the axis that may be shown.
    limit2: f64,
}

/// Positions of one row in fixed point.
#[derive(Clone, Debug, Default)]
pub(super) struct Row {
    /// x · [`ONE`], or [`INVALID`].
    pub(super) x: Vec<i32>,
    /// y · [`ONE`]; anything where x is [`INVALID`].
    pub(super) y: Vec<i32>,
}

impl Map {
    /// The map from the pinhole camera `target` back to `source`.
    ///
    /// # Errors
    /// [`Error::Invalid`] where a camera is not valid, `target` is not a pinhole, or a side is longer than 131 071 px.
    pub fn new(source: &Camera, target: &Camera) -> Result<Self> {
        source.validate()?;
        target.validate()?;
        if target.model != Model::Pinhole {
            return Err(Error::Invalid(format!(
                "undistorted pictures need a camera without distortion, not {}: give a pinhole camera",
                target.model
            )));
        }
        let longest = source.size_px.into_iter().chain(target.size_px).max().unwrap_or_default();
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
            source: source.clone(),
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
        self.source.size_px.map(|n| n as usize)
    }

    /// Position in the photograph of the output position `(u, v)`, px; `None` where it is not valid (see the module).
    pub fn at(&self, u: f64, v: f64) -> Option<Vector2<f64>> {
        let [fx, fy, cx, cy] = self.target;
        let (x, y) = ((u - cx) / fx, (v - cy) / fy);
        if x * x + y * y > self.limit2 {
            return None;
        }
        let px = (self.source.spec().project_px)(&self.source.params, &Vector3::new(x, y, 1.0))?;
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
        self.source.size_px.map(|n| f64::from(n) - 1.0)
    }

    /// Positions of row `v`.
    pub(super) fn row(&self, v: usize, row: &mut Row) {
        // Adding it leaves an integer in the low bits of the sum: rounding that every lane can do.
        const TO_INTEGER: f64 = 6_755_399_441_055_744.0; // 1.5 · 2⁵²
        let [width, _] = self.size;
        let padded = width.next_multiple_of(LANES);
        row.x.resize(padded, INVALID);
        row.y.resize(padded, INVALID);
        let [fx, fy, cx, cy] = self.target;
        let [w, h] = self.last();
        let y = (v as f64 - cy) / fy;
        let per_px = 1.0 / fx;
        let batch = self.source.spec().project_px_batch;
        let mut points: [Lanes; 3] = [[0.0; LANES], [y; LANES], [1.0; LANES]];
        let mut px: [Lanes; 2] = [[0.0; LANES]; 2];
        for (k, (xs, ys)) in row.x.chunks_exact_mut(LANES).zip(row.y.chunks_exact_mut(LANES)).enumerate() {
            let first = (k * LANES) as f64 - cx;
            for (i, x) in points[0].iter_mut().enumerate() {
                *x = (first + i as f64) * per_px;
            }
            batch(&self.source.params, &points, &mut px);
            for i in 0..LANES {
                let (a, b) = (px[0][i], px[1][i]);
                let x = points[0][i];
                let valid = (a >= -SLACK_PX)
                    & (a <= w + SLACK_PX)
                    & (b >= -SLACK_PX)
                    & (b <= h + SLACK_PX)
                    & (x * x + y * y <= self.limit2);
                let fixed =
                    |p: f64, last: f64| (p.clamp(0.0, last) * f64::from(ONE) + TO_INTEGER).to_bits() as i32;
                xs[i] = if valid { fixed(a, w) } else { INVALID };
                ys[i] = fixed(b, h);
            }
        }
        row.x.truncate(width);
        row.y.truncate(width);
    }
}
