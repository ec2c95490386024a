//! Where each pixel of the output comes from.

use std::sync::Arc;

use nalgebra::Vector2;

use super::{
    Projection, View,
    curves::{Course, STEP, TO_INTEGER},
    reach,
};
use crate::{
    Error, Result,
    camera::{Camera, LANES, Lanes, Model},
    image::Plane,
    lens::Lens,
    wide,
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
/// It holds lenses, not positions, unless it is told to keep what it computes ([`Map::keep`]).
#[derive(Clone, Debug)]
pub struct Map {
    source: Arc<dyn Lens>,
    view: View,
    size: [usize; 2],
    limit: Limit,
    /// The courses of all rows, where they are kept.
    kept: Option<Arc<[Course]>>,
}

/// The cone of rays about the axis that may be shown.
#[derive(Clone, Copy, Debug)]
struct Limit {
    /// tan² of its angle.
    tan2: f64,
    /// Whether it is wider than a half space.
    wide: bool,
}

impl Limit {
    /// What lies just on the limit counts as within.
    fn new(angle_rad: f64) -> Self {
        let wide = angle_rad > std::f64::consts::FRAC_PI_2;
        let tan = angle_rad.tan() * if wide { 1.0 - 1e-9 } else { 1.0 + 1e-9 };
        Self { tan2: tan * tan, wide }
    }

    /// Whether a ray is within; one of NaN is not.
    #[inline(always)]
    fn has(self, [x, y, z]: [f64; 3]) -> bool {
        let (rho2, edge) = (x * x + y * y, self.tan2 * (z * z));
        if self.wide { (z > 0.0) | (rho2 >= edge) } else { (z > 0.0) & (rho2 <= edge) }
    }
}

/// Positions of one row in fixed point.
#[derive(Clone, Debug, Default)]
pub(super) struct Row {
    /// x · [`ONE`], or [`INVALID`].
    pub(super) x: Vec<i32>,
    /// y · [`ONE`]; anything where x is [`INVALID`].
    pub(super) y: Vec<i32>,
    /// Position of every [`STEP`]-th pixel, from the one before the row, px.
    nodes: [Vec<f64>; 2],
    /// Whether the rays of the nodes are within the limit.
    within: Vec<bool>,
    course: Course,
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
        let view = View {
            projection: Projection::Perspective,
            size_px: target.size_px,
            intrinsics: target.intrinsics(),
        };
        Self::of_view(source, &view)
    }

    /// The map from the pixels of a view back to `source`.
    ///
    /// # Errors
    /// [`Error::Invalid`] where the camera is not valid, or a side is longer than 131 071 px.
    pub fn of_view(source: &dyn Lens, view: &View) -> Result<Self> {
        source.validate()?;
        let most = view.projection.spec().max_angle_rad;
        let [w, h] = view.size_px.map(|n| f64::from(n) - 1.0);
        let angle = |[u, v]: [f64; 2]| view.ray(u, v).map_or(most, |r| r.x.hypot(r.y).atan2(r.z));
        let widest = match view.projection {
            // The corners of a flat picture look furthest off the axis.
            Projection::Perspective => {
                [[0.0, 0.0], [w, 0.0], [0.0, h], [w, h]].map(angle).into_iter().fold(0.0, f64::max).min(most)
            }
            _ => most,
        };
        Self::within(source, view, reach::fold_within(source, widest).min(most))
    }

    /// The map of a view that shows no ray further off the axis than `limit_rad`.
    pub(super) fn within(source: &dyn Lens, view: &View, limit_rad: f64) -> Result<Self> {
        let longest = source.size_px().into_iter().chain(view.size_px).max().unwrap_or_default();
        if longest >= 1 << (31 - FRACTION_BITS) {
            return Err(Error::Invalid(format!(
                "a side of {longest} px is too long: give a smaller picture"
            )));
        }
        Ok(Self {
            source: source.shared(),
            view: view.clone(),
            size: view.size_px.map(|n| n as usize),
            limit: Limit::new(limit_rad),
            kept: None,
        })
    }

    /// Computes all positions and keeps them, as curves of 2.6 bytes a pixel, for the photographs to come: for three or more it is worth
    /// the time. The results are the same to the bit.
    pub fn keep(&mut self) {
        if self.kept.is_none() {
            let mut row = Row::default();
            let courses = (0..self.size[1]).map(|v| {
                wide::run(Place { map: self, v, row: &mut row });
                row.course.clone()
            });
            self.kept = Some(courses.collect());
        }
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
        let px = self.beyond(u, v)?;
        let [w, h] = self.last();
        let inside = |a: f64, last: f64| (-SLACK_PX..=last + SLACK_PX).contains(&a);
        (inside(px.x, w) && inside(px.y, h)).then(|| Vector2::new(px.x.clamp(0.0, w), px.y.clamp(0.0, h)))
    }

    /// [`Self::at`], beyond the edges of the photograph too, as far as the model reaches.
    pub fn beyond(&self, u: f64, v: f64) -> Option<Vector2<f64>> {
        let ray = self.view.ray(u, v)?;
        if !self.limit.has(ray.into()) {
            return None;
        }
        self.source.project_px(&ray)
    }

    /// 255 where the output pixel is valid, 0 elsewhere.
    pub fn mask(&self) -> Plane<u8> {
        let [w, h] = self.size;
        let mut row = Row::default();
        let mut mask = Plane::new(w, h);
        for v in 0..h {
            wide::run(WholeRow { map: self, v, row: &mut row });
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
    /// fourth differences show that it is as good ([`Course`]). Elsewhere, and near the border of the photograph, every
    /// pixel goes through the model.
    #[inline(always)]
    pub(super) fn row(&self, v: usize, row: &mut Row) {
        let [width, _] = self.size;
        let steps = width.div_ceil(STEP);
        row.x.resize(steps * STEP, INVALID);
        row.y.resize(steps * STEP, INVALID);
        let (xs, ys) = (row.x.as_chunks_mut().0, row.y.as_chunks_mut().0);
        match &self.kept {
            Some(courses) => courses[v].fill(xs, ys),
            None => {
                self.place(v, &mut row.nodes, &mut row.within, &mut row.course);
                row.course.fill(xs, ys);
            }
        }
        row.x.truncate(width);
        row.y.truncate(width);
    }

    /// The course of row `v`.
    #[inline(always)]
    fn place(&self, v: usize, nodes: &mut [Vec<f64>; 2], within: &mut Vec<bool>, course: &mut Course) {
        let [_, fy, _, cy] = self.view.intrinsics;
        let y = (v as f64 - cy) / fy;
        let steps = self.size[0].div_ceil(STEP);
        self.place_nodes(y, steps.next_multiple_of(LANES) + 4, nodes, within);
        course.fit(nodes, within, self.last(), steps, |k, xs, ys| {
            let halves = xs.as_chunks_mut().0.iter_mut().zip(ys.as_chunks_mut().0);
            for (h, (xs, ys)) in halves.enumerate() {
                self.exact((k * STEP + h * LANES) as f64, y, xs, ys);
            }
        });
    }

    /// Rays of pixels of a row with this y in the plane.
    #[inline(always)]
    fn rays(&self, y: f64, column: impl Fn(usize) -> f64) -> [Lanes; 3] {
        let [fx, _, cx, _] = self.view.intrinsics;
        let x: Lanes = std::array::from_fn(|i| (column(i) - cx) / fx);
        let mut rays = [[0.0; LANES]; 3];
        (self.view.projection.spec().rays)(&x, y, &mut rays);
        rays
    }

    /// Positions of `count` nodes of a row, the first one [`STEP`] pixels before it, px, and whether their rays are within the limit.
    fn place_nodes(&self, y: f64, count: usize, nodes: &mut [Vec<f64>; 2], within: &mut Vec<bool>) {
        let mut px: [Lanes; 2] = [[0.0; LANES]; 2];
        nodes.iter_mut().for_each(Vec::clear);
        within.clear();
        for k in (0..count).step_by(LANES) {
            let rays = self.rays(y, |i| (k + i) as f64 * STEP as f64 - STEP as f64);
            self.source.project_px_batch(&rays, &mut px);
            nodes[0].extend(px[0]);
            nodes[1].extend(px[1]);
            within.extend((0..LANES).map(|i| self.limit.has([rays[0][i], rays[1][i], rays[2][i]])));
        }
    }

    /// Positions of the pixels from column `first`, by the model.
    fn exact(&self, first: f64, y: f64, xs: &mut [i32; LANES], ys: &mut [i32; LANES]) {
        let [w, h] = self.last();
        let rays = self.rays(y, |i| first + i as f64);
        let mut px: [Lanes; 2] = [[0.0; LANES]; 2];
        self.source.project_px_batch(&rays, &mut px);
        for i in 0..LANES {
            let (a, b) = (px[0][i], px[1][i]);
            let valid = (a >= -SLACK_PX)
                & (a <= w + SLACK_PX)
                & (b >= -SLACK_PX)
                & (b <= h + SLACK_PX)
                & self.limit.has([rays[0][i], rays[1][i], rays[2][i]]);
            let fixed =
                |p: f64, last: f64| (p.clamp(0.0, last) * f64::from(ONE) + TO_INTEGER).to_bits() as i32;
            xs[i] = if valid { fixed(a, w) } else { INVALID };
            ys[i] = fixed(b, h);
        }
    }
}

/// [`Map::place`].
struct Place<'a> {
    map: &'a Map,
    v: usize,
    row: &'a mut Row,
}

impl wide::Kernel for Place<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Row { nodes, within, course, .. } = self.row;
        self.map.place(self.v, nodes, within, course);
    }
}

/// [`Map::row`].
struct WholeRow<'a> {
    map: &'a Map,
    v: usize,
    row: &'a mut Row,
}

impl wide::Kernel for WholeRow<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        self.map.row(self.v, self.row);
    }
}
