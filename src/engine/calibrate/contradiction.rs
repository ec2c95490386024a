//! Sets aside a picture that contradicts all others, by name, rather than letting it ruin the run.
//!
//! A picture is only suspected when it is several times worse than the typical one, and only set aside when leaving it out
//! *changes the answer*: the others then fit far better, or the camera moves by many of its σ. A noisy or blurred picture does
//! neither and stays.

use nalgebra::Vector2;
use std::ops::ControlFlow;

use super::{Constraints, Loss, Problem, Seen, prepare, robust, robust::Fitted, solve, unless_stopped};
use crate::{Result, observation::FrameId};

/// Suspected from this many times the typical error…
const WORSE: f64 = 3.0;
/// …and this error, px.
const WORSE_PX: f64 = 0.5;
/// Set aside where the error of the others falls by this factor without it…
const RELIEF: f64 = 1.5;
/// …or, where a robust loss already holds its pull within bounds, the camera moves by this many σ and the picture is this
/// many times worse than the others then are. (Random errors of that size move it by a tenth of a σ.)
const SHIFT: f64 = 2.0;
const MISFIT: f64 = 10.0;

/// Sets aside at most a quarter of the views and never goes below four; solves again without each.
pub(super) fn set_aside(
    problem: &Problem,
    views: &mut Vec<Seen>,
    aside: &mut Vec<(FrameId, String)>,
    constraints: &Constraints,
    fitted: &mut Fitted,
    tick: &mut dyn FnMut() -> ControlFlow<()>,
) -> Result<()> {
    let least = (views.len() - views.len() / 4).max(4);
    while views.len() > least {
        let typical: Vec<f64> = fitted.residuals.iter().map(|r| median_length(r)).collect();
        let usual = robust::median(&mut typical.clone());
        let Some((worst, &error)) = typical.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1)) else {
            return Ok(());
        };
        if error < WORSE_PX || error < WORSE * usual {
            return Ok(());
        }
        let mut others = views.clone();
        let bad = others.remove(worst);
        let mut more = Vec::new();
        let start = fitted.refined.state.params.clone();
        let without = solve(problem, &mut others, &mut more, constraints, &start, tick);
        let Some(without) = unless_stopped(without)? else { return Ok(()) };
        let rest = || fitted.residuals.iter().enumerate().filter(|(i, _)| *i != worst).map(|(_, r)| r);
        let (before, after) = (rms(rest()), rms(without.residuals.iter()));
        let misfit = misfit(problem, &bad, &without).unwrap_or(f64::INFINITY);
        let moved = problem.options.loss == Loss::Huber
            && misfit > MISFIT * after
            && shift(constraints, fitted, &without) > SHIFT;
        if before < RELIEF * after && !moved {
            return Ok(());
        }
        aside.push((
            bad.frame,
            format!(
                "its corners contradict all other pictures ({misfit:.1} px against {after:.2} px): is it from another camera, zoom or board?"
            ),
        ));
        aside.append(&mut more);
        *views = others;
        *fitted = without;
    }
    Ok(())
}

/// Views that fit far worse than usual.
pub(super) fn suspected(fitted: &Fitted) -> Vec<usize> {
    let typical: Vec<f64> = fitted.residuals.iter().map(|r| median_length(r)).collect();
    let usual = robust::median(&mut typical.clone());
    (0..typical.len()).filter(|i| typical[*i] > WORSE_PX && typical[*i] > WORSE * usual).collect()
}

fn median_length(residuals: &[Vector2<f64>]) -> f64 {
    robust::median(&mut residuals.iter().map(|r| r.norm()).collect::<Vec<_>>())
}

fn rms<'a>(residuals: impl Iterator<Item = &'a Vec<Vector2<f64>>>) -> f64 {
    let (sum, n) = residuals.flatten().fold((0.0, 0usize), |(s, n), r| (s + r.norm_squared(), n + 1));
    (sum / n.max(1) as f64).sqrt()
}

/// RMS of a picture under the camera of the others, px.
fn misfit(problem: &Problem, view: &Seen, fitted: &Fitted) -> Option<f64> {
    let params = &fitted.refined.state.params;
    let (block, pose) = prepare::pose(view, problem.cameras[0].model, params, &mut None)?;
    Some(rms(std::iter::once(&prepare::residuals(&block, problem.cameras[0].model, params, &pose))))
}

/// Largest change of a free intrinsic between two solutions, in σ of the second.
fn shift(constraints: &Constraints, a: &Fitted, b: &Fitted) -> f64 {
    let Some((covariance, _)) = b.information.as_ref().and_then(robust::covariance) else { return 0.0 };
    let (a, b_params) = (&a.refined.state.params, &b.refined.state.params);
    let in_sigma = constraints
        .free
        .leaders()
        .into_iter()
        .enumerate()
        .map(|(slot, i)| (a[i] - b_params[i]).abs() / (b.scale_px * covariance[(slot, slot)].sqrt()));
    in_sigma.fold(0.0, f64::max)
}
