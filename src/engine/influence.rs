//! What each picture does to the camera: how far the projection would move without it, and what certainty it brings.
//!
//! An error tells neither: of two pictures that fit equally well one can move the camera by ten times as much as the other. Each view is
//! left out in turn and the others are refined from where they are, by a few Gauss–Newton steps, each with the threshold of the robust
//! loss that agrees with the residuals: near enough to a solve of its own, in a fraction of its time. What it brings to certainty is its
//! information at the camera of all pictures, taken from theirs ([`Scatter::without`]).
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

use nalgebra::{Matrix2x3, Matrix3, Rotation3, Vector2, Vector3};
use serde::{Deserialize, Serialize};
use std::ops::ControlFlow;

use super::{
    calibrate::{Loss, huber_of_squares_px, huber_px},
    camera::Camera,
    refine::{self, Descent, Free, Limits, State, block::Block},
    residual::Field,
    solution::Calibration,
    stats,
    target::Target,
    uncertainty::{Probe, Scatter, Seen},
};

/// Places in the picture at which cameras are compared, columns × rows.
const GRID: [usize; 2] = [13, 10];
/// Most steps of a refinement without one view.
const STEPS: usize = 3;
/// A step that is shorter than the first by this factor is the last.
const SHORTER: f64 = 0.1;
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
    let mut others = Others::of(&set);
    for (i, view) in calibration.views.iter().enumerate() {
        if report(i as f32 / set.blocks.len() as f32).is_break() {
            return None;
        }
        let outlying = view.rms_px > (OUTLYING * usual).max(OUTLYING_PX);
        list.push(others.without(i).and_then(|camera| set.influence(i, &camera, outlying)));
    }
    Some(list)
}

/// The camera of all other views, for each view; `None` as in [`of`].
pub fn left_out(calibration: &Calibration, target: &Target, loss: Loss) -> Vec<Option<Camera>> {
    let set = Set::new(calibration, target, loss);
    let mut others = set.as_ref().map(Others::of);
    (0..calibration.views.len()).map(|i| others.as_mut()?.without(i)).collect()
}

/// Displacement of each pixel of `from` when its direction is seen by `to`, after the rotation between the two that makes the sum of
/// `weights` × squares smallest, px; `None` where one of the two does not see the direction.
pub fn displacement(
    from: &Camera,
    to: &Camera,
    pixels: &[Vector2<f64>],
    weights: &[f64],
) -> Vec<Option<Vector2<f64>>> {
    displacement_with([(from, None), (to, None)], pixels, weights)
}

/// As [`displacement`] from the first to the second of two cameras, each with what its residual map adds. A map is so flat that its slope
/// is no part of the derivatives.
pub fn displacement_with(
    [(from, from_field), (to, to_field)]: [(&Camera, Option<&Field>); 2],
    pixels: &[Vector2<f64>],
    weights: &[f64],
) -> Vec<Option<Vector2<f64>>> {
    displaced(&rays(from, from_field, pixels), (to, to_field), pixels, weights)
}

/// What the camera sees in pixels; `None` where it sees nothing.
fn rays(from: &Camera, field: Option<&Field>, pixels: &[Vector2<f64>]) -> Vec<Option<Vector3<f64>>> {
    let ray = |px: &Vector2<f64>| match field {
        Some(field) => from.unproject(&field.modelled(px)?),
        None => from.unproject(px),
    };
    pixels.iter().map(ray).collect()
}

/// [`displacement`] of pixels whose rays are known.
fn displaced(
    rays: &[Option<Vector3<f64>>],
    (to, field): (&Camera, Option<&Field>),
    pixels: &[Vector2<f64>],
    weights: &[f64],
) -> Vec<Option<Vector2<f64>>> {
    let mut rotation = Rotation3::identity();
    let seen = |rotation: &Rotation3<f64>, k: usize| {
        let mut there = (to.spec().project)(&to.params, &(rotation * rays[k]?))?;
        if let Some(field) = field {
            there.px = field.seen(&there.px);
        }
        Some(there)
    };
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
        // The next one would be its square.
        if step.norm() < 1e-8 {
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
    scatter: Scatter,
    pixels: Vec<Vector2<f64>>,
    /// What the camera sees in them.
    rays: Vec<Option<Vector3<f64>>>,
    probes: Vec<Option<Probe>>,
    /// Variance at each pixel, px²; infinite where there is no answer.
    variances: Vec<f64>,
    /// 1/variance; 0 where there is none.
    weights: Vec<f64>,
}

impl<'a> Set<'a> {
    fn new(calibration: &'a Calibration, target: &'a Target, loss: Loss) -> Option<Self> {
        let blocks: Option<Vec<Block>> =
            (0..calibration.views.len()).map(|i| block(calibration, target, i)).collect();
        let mut blocks = blocks?;
        if loss == Loss::Huber {
            without_robust_factors(calibration, &mut blocks);
        }
        let free = Free::of(calibration);
        let scatter = scatter(calibration, target, &free, &blocks)?;
        let camera = &calibration.camera;
        let [w, h] = camera.size_px.map(f64::from);
        let middle = |i: usize, cells: usize, n: f64| (i as f64 + 0.5) / cells as f64 * n - 0.5;
        let pixels: Vec<Vector2<f64>> = (0..GRID[1])
            .flat_map(|j| {
                (0..GRID[0]).map(move |i| Vector2::new(middle(i, GRID[0], w), middle(j, GRID[1], h)))
            })
            .collect();
        let probes: Vec<Option<Probe>> = pixels.iter().map(|px| scatter.probe(camera, px, None)).collect();
        let variances = variances(&scatter, &probes);
        let weights = variances.iter().map(|v| if *v > 0.0 { v.recip() } else { 0.0 }).collect();
        let rays = rays(camera, None, &pixels);
        Some(Self {
            calibration,
            target,
            loss,
            free,
            blocks,
            scatter,
            pixels,
            rays,
            probes,
            variances,
            weights,
        })
    }

    /// What view `i` tells.
    fn seen(&self, i: usize) -> Option<Seen> {
        let points = self.calibration.views[i].points_in_camera(self.target)?;
        let weights = &mut (0..points.len()).map(|k| self.blocks[i].weight(k));
        self.scatter.seen(&self.calibration.camera, &points, weights)
    }

    /// Of view `i`, without which the camera would be this one; `None` where the others leave most of the picture undetermined.
    fn influence(&self, i: usize, without: &Camera, fits_badly: bool) -> Option<Influence> {
        let moved = displaced(&self.rays, (without, None), &self.pixels, &self.weights);
        let variances = variances(&self.scatter.without(&self.seen(i)?)?, &self.probes);
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

/// Brings back the a-priori weights: the loss multiplies a corner beyond its threshold k by k/e, with e = √w·|r|, so that √(w k/e)·|r|
/// = √(k e). That keeps the order, and with it the median from which k follows.
fn without_robust_factors(calibration: &Calibration, blocks: &mut [Block]) {
    let views = &calibration.views;
    let residuals: Vec<_> = views.iter().map(|v| v.residuals_px.clone()).collect();
    let k = huber_px(blocks, &residuals);
    for (block, view) in blocks.iter_mut().zip(views) {
        block.set_weights(view.residuals_px.iter().zip(&view.weights).map(|(r, weight)| {
            let e = weight.sqrt() * r.norm();
            if e > k { (e * e / (k * r.norm())).powi(2) } else { *weight }
        }));
    }
}

/// Of the calibration with a-priori weights.
fn scatter(calibration: &Calibration, target: &Target, free: &Free, blocks: &[Block]) -> Option<Scatter> {
    let problem = refine::Problem {
        spec: calibration.camera.spec(),
        free,
        blocks,
        huber_px: None,
        single_precision: false,
    };
    let information = refine::information(&problem, &state(calibration))?;
    let mut plain = Calibration {
        covariance: information.cholesky()?.inverse() * calibration.sigma0_px.powi(2),
        ..calibration.clone()
    };
    for (view, block) in plain.views.iter_mut().zip(blocks) {
        view.weights = (0..block.len()).map(|k| block.weight(k)).collect();
    }
    Scatter::new(&plain, target)
}

fn state(calibration: &Calibration) -> State {
    let poses = calibration.views.iter().map(|v| v.camera_from_board).collect();
    State { params: calibration.camera.params.clone(), poses }
}

/// Infinite where there is no answer.
fn variances(scatter: &Scatter, probes: &[Option<Probe>]) -> Vec<f64> {
    let variance =
        |p: &Option<Probe>| p.as_ref().and_then(|p| scatter.sigma_px(p)).map_or(f64::INFINITY, |s| s * s);
    probes.iter().map(variance).collect()
}

/// All views but one, refined again and again in the same memory.
struct Others<'s, 'a> {
    set: &'s Set<'a>,
    /// Those of all views but the one that is left out.
    blocks: Vec<Block>,
    start: State,
    descent: Option<Descent>,
    squares: Vec<f64>,
}

impl<'s, 'a> Others<'s, 'a> {
    fn of(set: &'s Set<'a>) -> Self {
        let start = state(set.calibration);
        Self { set, blocks: set.blocks.clone(), start, descent: None, squares: Vec::new() }
    }

    /// The camera of the views without `i`.
    fn without(&mut self, i: usize) -> Option<Camera> {
        let (block, pose) = (self.blocks.remove(i), self.start.poses.remove(i));
        let params = self.refined();
        self.blocks.insert(i, block);
        self.start.poses.insert(i, pose);
        Some(Camera { params: params?, ..self.set.calibration.camera.clone() })
    }

    fn refined(&mut self) -> Option<Vec<f64>> {
        let Set { calibration, loss, free, .. } = self.set;
        let mut problem = refine::Problem {
            spec: calibration.camera.spec(),
            free,
            blocks: &self.blocks,
            huber_px: None,
            single_precision: false,
        };
        let descent = match &mut self.descent {
            Some(descent) => {
                descent.restart(&problem, &self.start).ok()?;
                descent
            }
            none => none.insert(Descent::new(&problem, &self.start).ok()?),
        };
        let limits = Limits { iterations: 1, tolerance: 1e-9, damping: 1e-9, enough: None };
        let mut first = None;
        for _ in 0..STEPS {
            if *loss == Loss::Huber {
                descent.weighted_squares(&problem, &mut self.squares);
                problem.huber_px = Some(huber_of_squares_px(&mut self.squares));
                descent.reweigh(&problem);
            }
            descent.run(&problem, limits, &mut || ControlFlow::Continue(())).ok()?;
            // What a step promises is the square of its length: the next one would be shorter by as much again.
            let Some(promise) = descent.promise() else { break };
            if promise <= SHORTER.powi(2) * *first.get_or_insert(promise) {
                break;
            }
        }
        Some(descent.params().to_vec())
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
