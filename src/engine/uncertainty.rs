//! How sure the projection is: by how many px the place of a point in the picture would scatter if the calibration were
//! repeated with other noise.
//!
//! The RMS says how well the corners fit; this says what the fit is worth, also where no corner was. It is *mrcal's* measure, in
//! the gauge of the boards: a pixel q is taken along its ray to a range ρ, from there into the frame of every board by the
//! poses found, back by poses that scatter, averaged, and projected by a camera that scatters. What a tilt of the
//! camera makes good is no error, because the boards tilt with it.
//!
//! No samples are drawn; the covariance is propagated. With the normal matrix of [`super::refine`] (U, V, W: intrinsics b,
//! poses p, between them) the poses answer to the intrinsics and to noise of their own,
//!
//! ```text
//! δpᵢ = −Vᵢ⁻¹Wᵢᵀ δb + εᵢ,    Cov(εᵢ) = σ₀² Vᵢ⁻¹,    δb, ε₁, ε₂ … uncorrelated
//! ```
//!
//! and a small motion of a board moves the point x as the twist (ω, τ) about the camera does: δx = ω × x + τ. So the mean
//! of all boards is one twist, whatever their number: its answer to δb and its own covariance are summed once,
//!
//! ```text
//! δq = (∂q/∂b + ∂q/∂x D T) δb + ∂q/∂x D ε,    D = [−[x]ₓ  I],   T = −(1/n) Σ Vᵢ⁻¹Wᵢᵀ,   Cov(ε) = (σ₀²/n²) Σ Vᵢ⁻¹
//! ```
//!
//! each in the frame of the camera. The value is the largest 1σ of δq over directions, px. With the robust loss Vᵢ holds the
//! final weights, which is some 5 % too careful about ε and nothing else.
//!
//! It presumes that the model is right: a lean model is too sure of itself. Near the boards' own distance it is smallest;
//! nearer it grows without bound, further it tends to the value at infinity.
//!
//! A view that was not taken yet counts as one that was: the information that its corners would bring, its pose eliminated, is added
//! to that of the others, and its answer to the mean ([`Scatter::seen`], [`Scatter::with`]).
//!
//! D. Kogan, *mrcal*, "Projection uncertainty" (mean of the boards' frames).

mod pose;

use nalgebra::{DMatrix, Matrix2, Matrix2x6, Matrix2xX, Matrix6, Matrix6xX, Vector2, Vector3};
use serde::{Deserialize, Serialize};

use super::{
    camera::{Camera, Projection},
    solution::{Calibration, View},
    stats,
    target::Target,
};
pub use pose::{PoseCovariance, of_poses};

/// Cells of the grid along the longer side of the picture.
pub const CELLS: usize = 20;

/// How far away the points are whose projection is asked for, along their rays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Range {
    /// As far as the boards were: the median of their distances.
    #[default]
    Boards,
    /// This far, in the unit of the square; greater than zero.
    At(f64),
    /// Beyond all translations.
    Infinity,
}

/// 1σ of the projection over the picture, px: the largest over directions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Uncertainty {
    /// Distance of the points, in the unit of the square; `None` at infinity.
    pub range: Option<f64>,
    /// In the middle of the picture; `None` where it has no answer.
    pub center_px: Option<f64>,
    /// In the worst of the four corners; `None` where one has no answer, so that it is never better than the truth.
    pub worst_corner_px: Option<f64>,
    /// In the middles of equal cells, rows from the top; `None` beyond the fold of the model and where the boards do not determine
    /// an answer.
    pub grid_px: Vec<Vec<Option<f64>>>,
}

impl Uncertainty {
    /// Mean over the picture, px; `None` where a part of it has no answer.
    pub fn mean_px(&self) -> Option<f64> {
        let n: usize = self.grid_px.iter().map(Vec::len).sum();
        let sum = self.grid_px.iter().flatten().try_fold(0.0, |sum, px| Some(sum + (*px)?))?;
        (n > 0).then(|| sum / n as f64)
    }

    /// What it stays below over a share of the picture, px; `None` where it has no answer there.
    pub fn over_share(&self, share: f64) -> Option<f64> {
        let mut all: Vec<f64> = self.grid_px.iter().flatten().map(|v| v.unwrap_or(f64::INFINITY)).collect();
        all.sort_by(f64::total_cmp);
        all.get((share * all.len() as f64) as usize).copied().filter(|v| v.is_finite())
    }
}

/// How sure the projection of a calibrated camera is. A camera that was held is sure: 0 everywhere.
///
/// `target` is the board of the calibration. Cost: linear in the number of corners.
pub fn of(calibration: &Calibration, target: &Target, range: Range) -> Uncertainty {
    let [one] = of_ranges(calibration, target, [range]);
    one
}

/// [`of`] at several distances.
pub fn of_ranges<const N: usize>(
    calibration: &Calibration,
    target: &Target,
    ranges: [Range; N],
) -> [Uncertainty; N] {
    let scatter = Scatter::new(calibration, target);
    ranges.map(|range| over(scatter.as_ref(), &calibration.camera, distance(calibration, target, range)))
}

/// The map of a camera whose scatter is known.
fn over(scatter: Option<&Scatter>, camera: &Camera, range: Option<f64>) -> Uncertainty {
    let at = |px: &Vector2<f64>| scatter?.at(camera, px, range);
    let [corners, center, cells] = places(camera.size_px);
    Uncertainty {
        range,
        center_px: center.iter().flatten().find_map(at),
        worst_corner_px: corners.iter().flatten().try_fold(0.0, |worst, px| Some(f64::max(worst, at(px)?))),
        grid_px: cells.iter().map(|row| row.iter().map(at).collect()).collect(),
    }
}

/// Rows of pixels at which a map has its numbers: the four corners of the picture, its middle, the middles of its cells.
pub fn places(size_px: [u32; 2]) -> [Vec<Vec<Vector2<f64>>>; 3] {
    let [w, h] = size_px.map(f64::from);
    let corners = [[0.0, 0.0], [w - 1.0, 0.0], [0.0, h - 1.0], [w - 1.0, h - 1.0]].map(Vector2::from);
    let [columns, rows] = [w, h].map(|n| (CELLS as f64 * n / w.max(h)).round().max(1.0) as usize);
    let middle = |i: usize, cells: usize, n: f64| (i as f64 + 0.5) / cells as f64 * n - 0.5;
    let row = |j| (0..columns).map(|i| Vector2::new(middle(i, columns, w), middle(j, rows, h))).collect();
    let center = Vector2::new((w - 1.0) / 2.0, (h - 1.0) / 2.0);
    [vec![corners.to_vec()], vec![vec![center]], (0..rows).map(row).collect()]
}

/// 1σ at single pixels, px: the largest over directions; `None` where it has no answer.
pub fn at(
    calibration: &Calibration,
    target: &Target,
    range: Range,
    pixels: &[Vector2<f64>],
) -> Vec<Option<f64>> {
    let largest = |c: Option<Matrix2<f64>>| worst(&c?);
    covariances(calibration, target, range, pixels).into_iter().map(largest).collect()
}

/// Covariance of the projection at single pixels, px²; `None` where it has no answer.
pub fn covariances(
    calibration: &Calibration,
    target: &Target,
    range: Range,
    pixels: &[Vector2<f64>],
) -> Vec<Option<Matrix2<f64>>> {
    let range = distance(calibration, target, range);
    let scatter = Scatter::new(calibration, target);
    let of =
        |scatter: &Scatter, px| Some(scatter.covariance(&scatter.probe(&calibration.camera, px, range)?));
    pixels.iter().map(|px| of(scatter.as_ref()?, px)).collect()
}

/// 1σ in the worst direction, px; `None` where the covariance is none.
fn worst(covariance: &Matrix2<f64>) -> Option<f64> {
    let largest = covariance.symmetric_eigenvalues().max();
    largest.is_finite().then(|| largest.max(0.0).sqrt())
}

/// The distance that is meant, in the unit of the square; `None` at infinity.
pub fn distance(calibration: &Calibration, target: &Target, range: Range) -> Option<f64> {
    match range {
        Range::Boards => Some(typical_distance(calibration, target)),
        Range::At(range) => Some(range),
        Range::Infinity => None,
    }
}

/// Median distance of the boards' middles.
fn typical_distance(calibration: &Calibration, target: &Target) -> f64 {
    let views = calibration.views.iter();
    let mut all: Vec<f64> = views.map(|v| stats::stance(&v.camera_from_board, target).distance).collect();
    all.sort_by(f64::total_cmp);
    stats::quantile(&all, 0.5)
}

/// Covariance of the intrinsics and of the mean motion of the boards.
#[derive(Clone, Debug)]
pub struct Scatter {
    /// Covariance of the free intrinsics.
    intrinsics: DMatrix<f64>,
    /// For each parameter of the model its place among the free ones.
    slots: Vec<Option<usize>>,
    /// `T`: the mean twist (ω, τ) that a change of the free intrinsics brings.
    answer: Matrix6xX<f64>,
    /// Covariance of the mean twist beside that.
    own: Matrix6<f64>,
    /// Views that the mean is of.
    views: f64,
    /// σ₀, px.
    sigma0_px: f64,
}

/// What a view tells, its pose eliminated.
#[derive(Clone, Debug)]
pub struct Seen {
    /// On the free intrinsics: U − W V⁻¹ Wᵀ, for σ₀ = 1 px.
    information: DMatrix<f64>,
    /// Twist of the board about the camera that a change of the free intrinsics brings.
    answer: Matrix6xX<f64>,
    /// Covariance of that twist beside it, for σ₀ = 1 px.
    own: Matrix6<f64>,
}

/// A pixel, ready to be asked how sure it is.
#[derive(Clone, Debug)]
pub struct Probe {
    /// ∂px/∂(free intrinsics), the ray held.
    by_free: Matrix2xX<f64>,
    /// ∂px/∂(ω, τ).
    by_twist: Matrix2x6<f64>,
}

impl Scatter {
    /// `None` where no view determines its pose.
    pub fn new(calibration: &Calibration, target: &Target) -> Option<Self> {
        let slots = calibration.slots();
        let free = calibration.free.len();
        let (mut answer, mut own) = (Matrix6xX::zeros(free), Matrix6::zeros());
        let mut views = 0.0;
        for view in &calibration.views {
            let twist = Blocks::of(calibration, target, &slots, view).and_then(|blocks| blocks.twist());
            let Some((by_free, by_chance)) = twist else { continue };
            answer += by_free;
            own += by_chance;
            views += 1.0;
        }
        if views == 0.0 {
            return None;
        }
        own *= (calibration.sigma0_px / views).powi(2);
        if calibration.free.is_empty() {
            own.fill(0.0);
        }
        let (intrinsics, sigma0_px) = (calibration.covariance.clone(), calibration.sigma0_px);
        Some(Self { intrinsics, slots, answer: answer / views, own, views, sigma0_px })
    }

    /// What a view of these points of the camera frame tells, each with its weight in the sum; `None` where the model does
    /// not see one of them, or they do not determine a pose.
    pub fn seen(
        &self,
        camera: &Camera,
        points: &[Vector3<f64>],
        weights: &mut dyn Iterator<Item = f64>,
    ) -> Option<Seen> {
        let free = self.intrinsics.nrows();
        let mut information = DMatrix::zeros(free, free);
        let blocks = Blocks::new(camera, &self.slots, free, points, weights, Some(&mut information))?;
        let (answer, own) = blocks.twist()?;
        information -= blocks.w.transpose() * blocks.v.cholesky()?.solve(&blocks.w);
        Some(Seen { information, answer, own })
    }

    /// With one more view. `None` where the intrinsics were not determined before.
    pub fn with(&self, seen: &Seen) -> Option<Self> {
        self.joined(seen, 1.0)
    }

    /// Without one of its views, at the same camera. `None` where the others do not determine the intrinsics.
    pub fn without(&self, seen: &Seen) -> Option<Self> {
        self.joined(seen, -1.0)
    }

    fn joined(&self, seen: &Seen, sign: f64) -> Option<Self> {
        let variance = self.sigma0_px.powi(2);
        let information =
            self.intrinsics.clone().cholesky()?.inverse() + &seen.information * (sign / variance);
        let views = self.views + sign;
        if views <= 0.0 {
            return None;
        }
        Some(Self {
            intrinsics: information.cholesky()?.inverse(),
            slots: self.slots.clone(),
            answer: (&self.answer * self.views + &seen.answer * sign) / views,
            own: (self.own * self.views.powi(2) + seen.own * (sign * variance)) / views.powi(2),
            views,
            sigma0_px: self.sigma0_px,
        })
    }

    /// Covariance of the free intrinsics.
    #[cfg(test)]
    pub(crate) const fn intrinsics(&self) -> &DMatrix<f64> {
        &self.intrinsics
    }

    /// 1σ of a parameter of the camera, by its place in the model; `None` where it is held.
    pub fn sigma_of(&self, param: usize) -> Option<f64> {
        let slot = (*self.slots.get(param)?)?;
        Some(self.intrinsics.get((slot, slot))?.sqrt())
    }

    /// The map over the picture, of points at this distance; `None` is infinity.
    pub fn over(&self, camera: &Camera, range: Option<f64>) -> Uncertainty {
        over(Some(self), camera, range)
    }

    /// A pixel of the camera, of points at this distance; `None` where the camera has no answer.
    pub fn probe(&self, camera: &Camera, px: &Vector2<f64>, range: Option<f64>) -> Option<Probe> {
        let inverse_range = Some(range.map_or(0.0, f64::recip)).filter(|r| r.is_finite() && *r >= 0.0)?;
        let ray = camera.unproject(px)?;
        let there = (camera.spec().project)(&camera.params, &ray)?;
        // The projection does not depend on the range, so the ray stands for its point with the twist's translation scaled.
        let by_twist = by_motion(&there, &ray, inverse_range);
        Some(Probe { by_free: by_free(&there, &self.slots, self.intrinsics.nrows()), by_twist })
    }

    /// Covariance there, px².
    fn covariance(&self, probe: &Probe) -> Matrix2<f64> {
        let by_free = &probe.by_free + probe.by_twist * &self.answer;
        &by_free * &self.intrinsics * by_free.transpose()
            + probe.by_twist * self.own * probe.by_twist.transpose()
    }

    /// 1σ there in the worst direction, px.
    pub fn sigma_px(&self, probe: &Probe) -> Option<f64> {
        worst(&self.covariance(probe))
    }

    /// 1σ at a pixel in the worst direction, px.
    fn at(&self, camera: &Camera, px: &Vector2<f64>, range: Option<f64>) -> Option<f64> {
        self.sigma_px(&self.probe(camera, px, range)?)
    }
}

/// The parts of a view in the normal matrix.
struct Blocks {
    v: Matrix6<f64>,
    /// `Wᵀ`.
    w: Matrix6xX<f64>,
    /// Middle of the points in the camera frame: poses turn about it.
    center: Vector3<f64>,
}

impl Blocks {
    /// Of a view of a calibration; `None` also where it has no corners.
    fn of(calibration: &Calibration, target: &Target, slots: &[Option<usize>], view: &View) -> Option<Self> {
        let points = view.points_in_camera(target)?;
        let weights = &mut view.weights.iter().copied();
        Self::new(&calibration.camera, slots, calibration.free.len(), &points, weights, None)
    }

    /// `None` where the model does not see a point. The view's part of `U` is added to `u`, where that is wanted.
    fn new(
        camera: &Camera,
        slots: &[Option<usize>],
        free: usize,
        points: &[Vector3<f64>],
        weights: &mut dyn Iterator<Item = f64>,
        mut u: Option<&mut DMatrix<f64>>,
    ) -> Option<Self> {
        let center = points.iter().sum::<Vector3<f64>>() / points.len() as f64;
        let (mut v, mut w) = (Matrix6::zeros(), Matrix6xX::zeros(free));
        let mut by_free = Matrix2xX::zeros(free);
        for (point, weight) in points.iter().zip(weights) {
            let there = (camera.spec().project)(&camera.params, point)?;
            let by_pose = by_motion(&there, &(point - center), 1.0);
            fill_by_free(&there, slots, &mut by_free);
            v.gemm_tr(weight, &by_pose, &by_pose, 1.0);
            w.gemm_tr(weight, &by_pose, &by_free, 1.0);
            if let Some(u) = &mut u {
                u.gemm_tr(weight, &by_free, &by_free, 1.0);
            }
        }
        Some(Self { v, w, center })
    }

    /// The twist about the camera with which the board answers to the free intrinsics, and its covariance for σ₀ = 1 px; `None` where
    /// the pose is not determined.
    fn twist(&self) -> Option<(Matrix6xX<f64>, Matrix6<f64>)> {
        let v = self.v.cholesky()?;
        // From a motion about the middle of the corners to a twist about the camera: ω × (x − c) + τ = ω × x + (τ + c × ω).
        let mut about_camera = Matrix6::identity();
        about_camera.fixed_view_mut::<3, 3>(3, 0).copy_from(&self.center.cross_matrix());
        Some((-(about_camera * v.solve(&self.w)), about_camera * v.inverse() * about_camera.transpose()))
    }
}

/// ∂px/∂(ω, τ) for δx = ω × arm + scale · τ.
fn by_motion(there: &Projection, arm: &Vector3<f64>, scale: f64) -> Matrix2x6<f64> {
    let mut by = Matrix2x6::zeros();
    by.fixed_view_mut::<2, 3>(0, 0).copy_from(&(there.by_point * -arm.cross_matrix()));
    by.fixed_view_mut::<2, 3>(0, 3).copy_from(&(there.by_point * scale));
    by
}

/// ∂px/∂(free intrinsics); tied ones move together.
fn by_free(there: &Projection, slots: &[Option<usize>], free: usize) -> Matrix2xX<f64> {
    let mut by = Matrix2xX::zeros(free);
    fill_by_free(there, slots, &mut by);
    by
}

fn fill_by_free(there: &Projection, slots: &[Option<usize>], by: &mut Matrix2xX<f64>) {
    by.fill(0.0);
    for (slot, column) in slots.iter().zip(&there.by_params) {
        if let Some(slot) = slot {
            let mut to = by.column_mut(*slot);
            to += column;
        }
    }
}

#[cfg(test)]
pub(crate) mod tests;
