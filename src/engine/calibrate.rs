//! From corners to a camera with its evidence: the whole calibration.
//!
//! 1. Each observation gets a homography ([`super::homography`]), or of things that are not flat a projection ([`super::dlt`]);
//!    what cannot be a board is set aside with the reason.
//! 2. Zhang's closed form ([`super::zhang`]) or the projections, and focal lengths over the range of lenses start a refinement on a thinned
//!    set; the best goes on.
//! 3. Every pose by itself, then everything together ([`super::refine`]), until the scale of the loss and the weights agree
//!    with the residuals.
//! 4. A picture that contradicts all others is set aside by name.
//! 5. Covariance from the reduced normal matrix; sets that do not determine the camera are refused: a focal length or
//!    principal point is accepted only where *another value fits significantly worse*.

mod centred;
mod choose;
mod compare;
mod contradiction;
mod degenerate;
mod mirrored;
mod options;
mod overturned;
mod pose;
mod prepare;
mod robust;
mod start;

use nalgebra::{DMatrix, Vector2};
use serde::{Deserialize, Serialize};
use std::ops::ControlFlow;

use super::{
    Error, Result,
    camera::{Camera, Model},
    observation::{FrameId, Observation},
    refine::{self, State},
    solution::{Calibration, View, Warning},
    target::Target,
};
pub use centred::centred;
pub use choose::{simplest_sufficient, worth_trying};
pub use compare::{CANDIDATES, COLUMNS, Candidate, Comparison, SplinedCandidate, compare, splined};
use options::Constraints;
pub use options::{Fix, Loss, Options, Precision, Weights, check_fixes, parse_fixes};
pub use pose::pose_of;
use prepare::Seen;
use robust::Fitted;
pub(crate) use robust::{huber_of_squares_px, huber_px};

/// A camera to be calibrated.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CameraSetup {
    /// `[width, height]` of the pictures, px.
    pub size_px: [u32; 2],
    /// Model to fit.
    pub model: Model,
    /// Start of the refinement and values of held parameters; another model serves where names agree.
    pub start: Option<Camera>,
    /// Focal length that the pictures' metadata suggest, px: one more start, never trusted.
    pub focal_hint_px: Option<f64>,
}

/// Everything that a calibration is made from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Problem {
    /// The cameras; exactly one today.
    pub cameras: Vec<CameraSetup>,
    /// The board.
    pub target: Target,
    /// What was seen, one observation a picture.
    pub observations: Vec<Observation>,
    /// How to calibrate.
    pub options: Options,
}

/// Calibrates. `report` gets the share of the work done, 0..1, and may stop it.
///
/// # Errors
/// [`Error::TooFewViews`], [`Error::TooFewCorners`] and [`Error::Degenerate`] where the pictures cannot determine the
/// camera, [`Error::Invalid`] where the problem contradicts itself, [`Error::Stopped`] where `report` breaks.
pub fn calibrate(problem: &Problem, report: &mut dyn FnMut(f32) -> ControlFlow<()>) -> Result<Calibration> {
    let found = as_given(problem, true, report);
    if problem.target.is_solid() { mirrored::checked(problem, found, report) } else { found }
}

/// Whether the pictures determine the camera is asked if `judged`; else there is no covariance.
fn as_given(
    problem: &Problem,
    judged: bool,
    report: &mut dyn FnMut(f32) -> ControlFlow<()>,
) -> Result<Calibration> {
    let [setup] = &problem.cameras[..] else {
        return Err(Error::Invalid(format!(
            "{} cameras: exactly one is calibrated at a time",
            problem.cameras.len()
        )));
    };
    if setup.size_px.contains(&0) {
        return Err(Error::Invalid("the size of the pictures is zero".into()));
    }
    if let Some(start) = &setup.start {
        start.validate()?;
    }
    let constraints = Constraints::new(
        &problem.options.fixed,
        setup.model,
        setup.size_px,
        setup.start.as_ref(),
        setup.focal_hint_px,
    )?;
    let (views, mut set_aside) = prepare::prepare(problem);
    enough(&views, &constraints, &set_aside)?;

    // A step of the refinement is the unit of progress; the typical run has about thirty.
    let mut steps = 0.0f32;
    let mut tick = || {
        steps += 1.0;
        report(1.0 - (-steps / 30.0).exp())
    };
    let simpler = start::simpler(problem);
    let (first, held) = simpler.as_ref().map_or((problem, &constraints), |(p, c)| (p, c));
    let mut chosen = start::choose(first, &views, held, &mut tick)?;
    let nearer = [start::some(&views), simpler.is_some().then(|| views.clone())];
    for mut views in nearer.into_iter().flatten() {
        let fit = solve(first, &mut views, &mut Vec::new(), held, &chosen.params, &mut tick);
        if let Some(fit) = unless_stopped(fit)? {
            chosen.params = fit.refined.state.params;
        }
    }
    chosen.continue_to(setup.model, &constraints);
    let mut views = views;
    let mut fitted = solve(problem, &mut views, &mut set_aside, &constraints, &chosen.params, &mut tick)?;
    for rival in &chosen.rivals {
        let mut others = views.clone();
        let other = solve(problem, &mut others, &mut Vec::new(), &constraints, rival, &mut tick);
        if let Some(other) = unless_stopped(other)?
            && others.len() == views.len()
            && other.refined.cost < fitted.refined.cost * (1.0 - 1e-9)
        {
            fitted = other;
        }
    }
    overturned::put_right(problem, &views, &constraints, &mut fitted, &mut tick)?;
    contradiction::set_aside(problem, &mut views, &mut set_aside, &constraints, &mut fitted, &mut tick)?;
    enough(&views, &constraints, &set_aside)?;
    finish(problem, judged, &constraints, &views, set_aside, fitted, chosen, &mut tick)
}

/// An attempt that may fail: `None` where it does. A stop is no failure and is passed on, or what is left would look like a
/// result.
fn unless_stopped<T>(attempt: Result<T>) -> Result<Option<T>> {
    match attempt {
        Err(Error::Stopped) => Err(Error::Stopped),
        other => Ok(other.ok()),
    }
}

/// Refuses sets that cannot have a solution by their numbers alone.
fn enough(views: &[Seen], constraints: &Constraints, set_aside: &[(FrameId, String)]) -> Result<()> {
    let mut k: Vec<_> = (0..4).filter_map(|i| constraints.free.slot(i)).collect();
    k.dedup();
    // A plane says two things about the camera, a thing that is not flat everything.
    let uneven = views.iter().any(|v| v.plane.is_uneven());
    let need = if uneven { 1 } else { k.len().div_ceil(2).max(1) };
    if views.len() < need {
        // One reason that all share says more than a number.
        return match set_aside {
            [(_, why), rest @ ..] if views.is_empty() && rest.iter().all(|r| r.1 == *why) => {
                Err(Error::Degenerate(format!("no picture could be used: {why}")))
            }
            [(_, why), ..] if views.is_empty() => {
                Err(Error::Degenerate(format!("no picture could be used; of the first: {why}")))
            }
            _ => Err(Error::TooFewViews { need, got: views.len() }),
        };
    }
    let unknowns = constraints.free.len() + 6 * views.len();
    let corners: usize = views.iter().map(|v| v.px.len()).sum();
    if 2 * corners <= unknowns {
        return Err(Error::TooFewCorners { need: unknowns / 2 + 1, got: corners });
    }
    Ok(())
}

/// Refines everything from parameters; views whose pose cannot be found are set aside.
fn solve(
    problem: &Problem,
    views: &mut Vec<Seen>,
    set_aside: &mut Vec<(FrameId, String)>,
    constraints: &Constraints,
    params: &[f64],
    tick: &mut dyn FnMut() -> ControlFlow<()>,
) -> Result<Fitted> {
    let mut poses = Vec::with_capacity(views.len());
    let mut blocks = Vec::with_capacity(views.len());
    let mut kept = Vec::with_capacity(views.len());
    let mut memory = None;
    let model = problem.cameras[0].model;
    for view in std::mem::take(views) {
        match prepare::pose(&view, model, params, &mut memory) {
            Some((block, pose)) => {
                poses.push(pose);
                blocks.push(block);
                kept.push(view);
            }
            None => set_aside.push((view.frame, "no pose of the board explains its corners".into())),
        }
    }
    *views = kept;
    enough(views, constraints, set_aside)?;
    let whole = refine::Problem {
        spec: model.spec(),
        free: &constraints.free,
        blocks: &[],
        huber_px: None,
        single_precision: problem.options.precision == Precision::F32,
    };
    robust::fit(&whole, blocks, views, &State { params: params.to_vec(), poses }, &problem.options, tick)
}

/// Certainty, checks and warnings.
fn finish(
    problem: &Problem,
    judged: bool,
    constraints: &Constraints,
    views: &[Seen],
    set_aside: Vec<(FrameId, String)>,
    fitted: Fitted,
    chosen: start::Chosen,
    tick: &mut dyn FnMut() -> ControlFlow<()>,
) -> Result<Calibration> {
    let setup = &problem.cameras[0];
    let free = &constraints.free;
    let spec = setup.model.spec();
    let corners: usize = views.iter().map(|v| v.px.len()).sum();
    let sigma0_px = fitted.sigma0_px(2 * corners - free.len() - 6 * views.len());
    let at = refine::Problem { spec, free, blocks: &fitted.blocks, huber_px: None, single_precision: false };
    let covariance = if judged {
        degenerate::check(&at, setup, views, &fitted, sigma0_px, &chosen.singular_values, tick)?
    } else {
        DMatrix::from_element(free.len(), free.len(), f64::NAN)
    };
    let params = fitted.refined.state.params.clone();
    let camera = Camera { model: setup.model, size_px: setup.size_px, params };
    let sigma: Vec<Option<f64>> =
        (0..spec.params.len()).map(|i| free.slot(i).map(|s| covariance[(s, s)].sqrt())).collect();
    let list: Vec<View> = (0..views.len()).map(|i| view(&views[i], &fitted, i)).collect();
    let (mut inliers, mut squares) = (0usize, [0.0, 0.0]);
    for view in &list {
        for (r, index) in view.residuals_px.iter().zip(&view.indices) {
            squares[0] += r.norm_squared();
            if !view.outliers.contains(index) {
                squares[1] += r.norm_squared();
                inliers += 1;
            }
        }
    }
    let mut result = Calibration {
        camera,
        views: list,
        sigma,
        covariance,
        free: free.leaders(),
        tied_to: free.tied_to(),
        rms_px: (squares[0] / corners as f64).sqrt(),
        rms_inliers_px: (squares[1] / inliers.max(1) as f64).sqrt(),
        sigma0_px,
        termination: fitted.refined.termination,
        iterations: fitted.refined.iterations,
        starts: chosen.starts,
        closed_form: chosen.closed_form,
        set_aside,
        warnings: Vec::new(),
    };
    result.warnings = warnings(&result);
    Ok(result)
}

fn view(seen: &Seen, fitted: &Fitted, i: usize) -> View {
    let residuals_px = fitted.residuals[i].clone();
    let n = residuals_px.len();
    View {
        frame: seen.frame,
        camera_from_board: fitted.refined.state.poses[i],
        indices: seen.indices.clone(),
        weights: (0..n).map(|c| fitted.weight(i, c)).collect(),
        outliers: (0..n).filter(|c| fitted.is_outlier(i, *c)).map(|c| seen.indices[c]).collect(),
        rms_px: (residuals_px.iter().map(|r| r.norm_squared()).sum::<f64>() / n as f64).sqrt(),
        residuals_px,
    }
}

/// What the user should know beside the result.
fn warnings(result: &Calibration) -> Vec<Warning> {
    let mut list = Vec::new();
    let camera = &result.camera;
    let [w, h] = camera.size_px.map(f64::from);
    let [fx, fy, ..] = camera.intrinsics();
    let perspective = camera.spec().perspective;
    // A circular fisheye of 230° that fills a third of the width has a tenth of it.
    let lenses = if perspective { 0.3..=10.0 } else { 0.1..=10.0 };
    if !lenses.contains(&(fx / w)) || !lenses.contains(&(fy / w)) {
        list.push(Warning::new(
            "focal_absurd",
            format!(
                "the focal length of {fx:.0} x {fy:.0} px is {:.2} picture widths, which no ordinary lens has: check the pictures, or try another model",
                fx / w
            ),
        ));
    }
    if !result.termination.converged() {
        list.push(Warning::new(
            "not_converged",
            format!(
                "the refinement stopped ({:?}) before its optimum: do not rely on the figures",
                result.termination
            ),
        ));
    }
    let on_border = |i: i32| {
        let t = f64::from(i % 21) / 20.0;
        [[t, 0.0], [t, 1.0], [0.0, t], [1.0, t]][i as usize / 21]
    };
    // The corners of a fisheye picture are dark: the largest circle in it counts.
    let on_circle = |i: i32| {
        let (sin, cos) = (f64::from(i) / 84.0 * std::f64::consts::TAU).sin_cos();
        [0.5 + 0.47 * (h / w).min(1.0) * cos, 0.5 + 0.47 * (w / h).min(1.0) * sin]
    };
    let lost = (0..84)
        .map(|i| if perspective { on_border(i) } else { on_circle(i) })
        .filter(|[x, y]| camera.unproject(&Vector2::new(x * (w - 1.0), y * (h - 1.0))).is_none())
        .count();
    if lost > 0 {
        list.push(Warning::new(
            "model_folds",
            format!(
                "the lens model folds inside the picture ({:.0} % of its border cannot be undistorted): photograph the board in the corners of the picture, or hold k3",
                100.0 * lost as f64 / 84.0
            ),
        ));
    }
    let unsure = result.unobservable();
    if !unsure.is_empty() {
        list.push(Warning::new(
            "unobservable",
            format!(
                "{} cannot be told from zero (less than 2 σ): fixing it costs nothing, or photograph the board nearer to the corners of the picture",
                unsure.join(", ")
            ),
        ));
    }
    list
}

#[cfg(test)]
mod tests;
