//! What each picture does to the camera: how far the projection would move without it, and what certainty it brings.
//!
//! An error tells neither: of two pictures that fit equally well one can move the camera by ten times as much as the other. Each view is
//! left out in turn and the others are refined from where they are, by a few Gauss–Newton steps, each with the threshold of the robust
//! loss that agrees with the residuals: near enough to a solve of its own, in a fraction of its time.
//!
//! Two cameras are compared by the pixel in which a direction appears. The boards do not tell how the camera is turned, so the
//! rotation that brings the directions closest is no difference. Places count by their certainty 1/σ², or the extrapolated corners
//! of the picture would outvote what the boards cover.
//!
//! A picture that is as good as the others moves the camera too, by chance: leaving it out enlarges the covariance, and the two
//! solutions differ by the difference of their covariances, Cov(δ) = Cov₋ᵢ − Cov. What moves it by much more than that contradicts
//! the others.
//!
//! R. D. Cook, "Detection of influential observation in linear regression", Technometrics 19, 1977; the difference of maps after the
//! implied rotation: D. Kogan, *mrcal*.

use nalgebra::{DMatrix, Matrix2x3, Matrix3, Rotation3, Vector2, Vector3};
use serde::{Deserialize, Serialize};
use std::ops::ControlFlow;

use super::{
    calibrate::{Loss, huber_px},
    camera::Camera,
    refine::{self, Free, Limits, State, block::Block},
    solution::Calibration,
    stats,
    target::Target,
    uncertainty::{self, Range},
};

/// Places in the picture at which cameras are compared, columns × rows.
const GRID: [usize; 2] = [13, 10];
/// Steps of a refinement without one view.
const STEPS: usize = 3;
/// Harmful: it moves the camera by so many times what chance does.
const BEYOND_CHANCE: f64 = 3.0;
/// Precious: σ of the projection grows by so much without it.
const PRECIOUS: f64 = 0.1;
/// Outlier: its error is so many times the median of all pictures, and more than nothing, px.
const OUTLYING: f64 = 2.0;
const OUTLYING_PX: f64 = 0.05;
/// What moves the camera by less harms nobody, px.
const HARM_PX: f64 = 0.02;

/// What a picture is to the calibration.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Role {
    /// The camera is much less certain without it.
    Precious,
    /// One of many.
    Fine,
    /// It fits worse than the others, and moves nothing.
    HarmlessOutlier,
    /// It pulls the camera away from where all others put it.
    Harmful,
}

impl Role {
    /// In words.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Precious => "precious",
            Self::Fine => "fine",
            Self::HarmlessOutlier => "harmless outlier",
            Self::Harmful => "harmful",
        }
    }
}

/// What leaving a picture out would do.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Influence {
    /// How far the projection would move, px: the root of the mean square over the picture.
    pub moves_px: f64,
    /// How far it would by chance, if the picture were as good as the others, px.
    pub by_chance_px: f64,
    /// By which share of itself σ of the projection would grow; 0.1 is by a tenth.
    pub certainty: f64,
    /// All that in a word.
    pub role: Role,
}

/// Share of the picture, by weight, that the others must determine.
const MOST: f64 = 0.5;

/// The influence of every view, in the order of the views; `None` for a view without which the others do not determine the camera. A
/// camera of which nothing is free is moved by nothing.
///
/// `target` is the board of the calibration, `loss` that which it was made with. Cost: a few steps over all corners, for each view. `None` where `report`, which gets the
/// share of the work done, breaks.
pub fn of(
    calibration: &Calibration,
    target: &Target,
    loss: Loss,
    report: &mut dyn FnMut(f32) -> ControlFlow<()>,
) -> Option<Vec<Option<Influence>>> {
    let Some(set) = Set::new(calibration, target, loss) else {
        return Some(vec![None; calibration.views.len()]);
    };
    let mut errors: Vec<f64> = calibration.views.iter().map(|v| v.rms_px).collect();
    errors.sort_by(f64::total_cmp);
    let usual = stats::quantile(&errors, 0.5);
    let mut list = Vec::with_capacity(set.blocks.len());
    for (i, view) in calibration.views.iter().enumerate() {
        if report(i as f32 / set.blocks.len() as f32).is_break() {
            return None;
        }
        let outlying = view.rms_px > (OUTLYING * usual).max(OUTLYING_PX);
        list.push(set.without(i).and_then(|without| set.influence(&without, outlying)));
    }
    Some(list)
}

/// The camera of all other views, for each view; `None` as in [`of`].
pub fn left_out(calibration: &Calibration, target: &Target, loss: Loss) -> Vec<Option<Camera>> {
    let set = Set::new(calibration, target, loss);
    (0..calibration.views.len()).map(|i| Some(set.as_ref()?.without(i)?.camera)).collect()
}

/// Displacement of each pixel of `from` when its direction is seen by `to`, after the rotation between the two that makes the sum of
/// `weights` × squares smallest, px; `None` where one of the two does not see the direction.
pub fn displacement(
    from: &Camera,
    to: &Camera,
    pixels: &[Vector2<f64>],
    weights: &[f64],
) -> Vec<Option<Vector2<f64>>> {
    let rays: Vec<Option<Vector3<f64>>> = pixels.iter().map(|p| from.unproject(p)).collect();
    let mut rotation = Rotation3::identity();
    let seen = |rotation: &Rotation3<f64>, k: usize| (to.spec().project)(&to.params, &(rotation * rays[k]?));
    for _ in 0..5 {
        let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
        for (k, px) in pixels.iter().enumerate() {
            let (Some(ray), Some(there)) = (rays[k], seen(&rotation, k)) else { continue };
            let by_turn: Matrix2x3<f64> = there.by_point * -(rotation * ray).cross_matrix();
            normal += weights[k] * by_turn.transpose() * by_turn;
            right += weights[k] * by_turn.transpose() * (px - there.px);
        }
        let Some(step) = normal.cholesky().map(|c| c.solve(&right)) else { break };
        rotation = Rotation3::from_scaled_axis(step) * rotation;
        if step.norm() < 1e-12 {
            break;
        }
    }
    (0..pixels.len()).map(|k| Some(seen(&rotation, k)?.px - pixels[k])).collect()
}

/// The calibration as the refinement wants it, and its certainty over the picture.
struct Set<'a> {
    calibration: &'a Calibration,
    target: &'a Target,
    loss: Loss,
    free: Free,
    blocks: Vec<Block>,
    pixels: Vec<Vector2<f64>>,
    /// Variance at each pixel, px².
    variances: Vec<f64>,
    /// 1/variance; 0 where there is none.
    weights: Vec<f64>,
}

impl<'a> Set<'a> {
    fn new(calibration: &'a Calibration, target: &'a Target, loss: Loss) -> Option<Self> {
        let blocks: Option<Vec<Block>> =
            (0..calibration.views.len()).map(|i| block(calibration, target, i)).collect();
        let [w, h] = calibration.camera.size_px.map(f64::from);
        let middle = |i: usize, cells: usize, n: f64| (i as f64 + 0.5) / cells as f64 * n - 0.5;
        let pixels: Vec<Vector2<f64>> = (0..GRID[1])
            .flat_map(|j| {
                (0..GRID[0]).map(move |i| Vector2::new(middle(i, GRID[0], w), middle(j, GRID[1], h)))
            })
            .collect();
        let mut set = Self {
            calibration,
            target,
            loss,
            free: Free::of(calibration),
            blocks: blocks?,
            pixels,
            variances: Vec::new(),
            weights: Vec::new(),
        };
        if loss == Loss::Huber {
            set.without_robust_factors();
        }
        let poses = calibration.views.iter().map(|v| v.camera_from_board).collect();
        let state = State { params: calibration.camera.params.clone(), poses };
        let whole = Calibration { covariance: set.covariance(&set.blocks, &state)?, ..calibration.clone() };
        set.variances = set.variances_of(&whole);
        set.weights = set.variances.iter().map(|v| if *v > 0.0 { v.recip() } else { 0.0 }).collect();
        Some(set)
    }

    fn problem<'b>(&'b self, blocks: &'b [Block]) -> refine::Problem<'b> {
        let spec = self.calibration.camera.spec();
        refine::Problem { spec, free: &self.free, blocks, huber_px: None, single_precision: false }
    }

    /// Brings back the a-priori weights: the loss multiplies a corner beyond its threshold k by k/e, with e = √w·|r|, so that √(w k/e)·|r|
    /// = √(k e). That keeps the order, and with it the median from which k follows.
    fn without_robust_factors(&mut self) {
        let views = &self.calibration.views;
        let residuals: Vec<_> = views.iter().map(|v| v.residuals_px.clone()).collect();
        let k = huber_px(&self.blocks, &residuals);
        for (block, view) in self.blocks.iter_mut().zip(views) {
            block.set_weights(view.residuals_px.iter().zip(&view.weights).map(|(r, weight)| {
                let e = weight.sqrt() * r.norm();
                if e > k { (e * e / (k * r.norm())).powi(2) } else { *weight }
            }));
        }
    }

    fn covariance(&self, blocks: &[Block], state: &State) -> Option<DMatrix<f64>> {
        let information = refine::information(&self.problem(blocks), state)?;
        Some(information.cholesky()?.inverse() * self.calibration.sigma0_px.powi(2))
    }

    /// Infinite where there is no answer.
    fn variances_of(&self, calibration: &Calibration) -> Vec<f64> {
        let sigma = uncertainty::at(calibration, self.target, Range::Infinity, &self.pixels);
        sigma.into_iter().map(|s| s.map_or(f64::INFINITY, |s| s * s)).collect()
    }

    /// The calibration of all other views.
    fn without(&self, i: usize) -> Option<Calibration> {
        let others = |k: &usize| *k != i;
        let range = || (0..self.blocks.len()).filter(others);
        let blocks: Vec<Block> = range().map(|k| self.blocks[k].clone()).collect();
        let views = &self.calibration.views;
        let start = State {
            params: self.calibration.camera.params.clone(),
            poses: range().map(|k| views[k].camera_from_board).collect(),
        };
        let limits = Limits { iterations: 1, tolerance: 1e-9, damping: 1e-9, enough: None };
        let mut state = start;
        for _ in 0..STEPS {
            let mut problem = self.problem(&blocks);
            if self.loss == Loss::Huber {
                let residuals: Vec<_> =
                    (0..blocks.len()).map(|k| refine::residuals(&problem, &state, k)).collect();
                problem.huber_px = Some(huber_px(&blocks, &residuals));
            }
            state = refine::refine(&problem, &state, limits, &mut || ControlFlow::Continue(())).ok()?.state;
        }
        let mut left = Calibration {
            covariance: self.covariance(&blocks, &state)?,
            views: range().map(|k| views[k].clone()).collect(),
            ..self.calibration.clone()
        };
        for (view, pose) in left.views.iter_mut().zip(&state.poses) {
            view.camera_from_board = *pose;
        }
        left.camera.params = state.params;
        Some(left)
    }

    /// `None` where the others leave most of the picture undetermined.
    fn influence(&self, without: &Calibration, fits_badly: bool) -> Option<Influence> {
        let moved = displacement(&self.calibration.camera, &without.camera, &self.pixels, &self.weights);
        let variances = self.variances_of(without);
        // Sums of: weights, squares of the way, growth of the variance, the variance itself.
        let mut sums = [0.0; 4];
        for (k, by) in moved.iter().enumerate() {
            let (Some(by), true) = (by, variances[k].is_finite()) else { continue };
            let all = self.variances[k];
            let terms = [1.0, by.norm_squared(), (variances[k] - all).max(0.0), all];
            for (sum, term) in sums.iter_mut().zip(terms) {
                *sum += if self.weights[k] > 0.0 { self.weights[k] * term } else { 0.0 };
            }
        }
        let [total, squares, growth, variance] = sums;
        if total < MOST * self.weights.iter().sum::<f64>() {
            return None;
        }
        let mean = |sum: f64| if total > 0.0 { (sum / total).sqrt() } else { 0.0 };
        let (moves_px, by_chance_px, sigma) = (mean(squares), mean(growth), mean(variance));
        let certainty = if variance > 0.0 { (1.0 + growth / variance).sqrt() - 1.0 } else { 0.0 };
        let role = if moves_px > BEYOND_CHANCE * by_chance_px && moves_px > sigma.max(HARM_PX) {
            Role::Harmful
        } else if certainty > PRECIOUS {
            Role::Precious
        } else if fits_badly {
            Role::HarmlessOutlier
        } else {
            Role::Fine
        };
        Some(Influence { moves_px, by_chance_px, certainty, role })
    }
}

/// A view as the refinement stores it, with its final weights; `None` where the camera does not see one of its corners.
fn block(calibration: &Calibration, target: &Target, i: usize) -> Option<Block> {
    let view = &calibration.views[i];
    let camera = &calibration.camera;
    let on_board: Option<Vec<_>> = view.indices.iter().map(|k| target.point_in_board(*k)).collect();
    let projected = view.points_in_camera(target)?.into_iter().zip(&view.residuals_px);
    let observed: Option<Vec<_>> =
        projected.map(|(p, r)| Some((camera.spec().project)(&camera.params, &p)?.px + r)).collect();
    let mut block = Block::new(&on_board?, &observed?);
    block.set_weights(view.weights.iter().copied());
    Some(block)
}

#[cfg(test)]
mod tests;
