//! Refuses sets that do not determine the camera.
//!
//! The reduced normal matrix gives σ of each intrinsic; where one is suspiciously large, or all boards are nearly parallel
//! (there the linear σ cannot be trusted), the focal lengths or the principal point are *held at other values* and all the
//! rest is refined again: if that fits not significantly worse, any number reported would be arbitrary.

use nalgebra::{DMatrix, Vector3};
use std::ops::ControlFlow;

use super::{CameraSetup, prepare::Seen, robust, unless_stopped};
use crate::{
    Error, Result,
    refine::{self, Limits, State},
};
use robust::Fitted;

/// σ/f and σ(centre)/width from which the profile is looked at.
const SUSPICIOUS: [f64; 2] = [0.01, 0.05];
/// Largest angle between two boards below which the profile is looked at in any case, rad.
const PARALLEL: f64 = 0.14;
/// Largest angle between two boards below which all count as one view, rad.
const ALIKE: f64 = 0.05;
/// Relative change of a focal length, and share of the picture width for the centre, that must be excluded…
const CHANGE: f64 = 0.3;
/// …by this many standard deviations.
const SIGNIFICANT: f64 = 3.0;

/// Covariance of the free intrinsics, or the reason why there is none.
pub(super) fn check(
    problem: &refine::Problem<'_>,
    setup: &CameraSetup,
    views: &[Seen],
    fitted: &Fitted,
    sigma0_px: f64,
    singular_values: &[f64; 5],
    tick: &mut dyn FnMut() -> ControlFlow<()>,
) -> Result<DMatrix<f64>> {
    let state = &fitted.refined.state;
    let spread = spread_rad(state, views);
    // Things that are not flat need not be turned.
    let solid = views.iter().any(|v| v.plane.is_solid());
    let uneven = views.iter().any(|v| v.plane.is_uneven());
    let covariance = fitted.information.as_ref().and_then(robust::covariance);
    let Some((unit, _)) = covariance else {
        return Err(refusal(problem, setup, spread, singular_values, None));
    };
    let covariance = unit * (sigma0_px * sigma0_px);
    // Boards that are parallel say about the camera what one view says: two numbers.
    let mut unknown: Vec<_> = (0..4).filter_map(|i| problem.free.slot(i)).collect();
    unknown.dedup();
    if spread < ALIKE && unknown.len() > 2 && !uneven {
        return Err(refusal(problem, setup, spread, singular_values, None));
    }
    let width = f64::from(setup.size_px[0].max(setup.size_px[1]));
    for i in 0..4 {
        let Some(slot) = problem.free.slot(i) else { continue };
        if (0..i).any(|j| problem.free.slot(j) == Some(slot)) {
            continue;
        }
        let unit = if i < 2 { state.params[i] } else { width };
        let sigma = covariance[(slot, slot)].sqrt();
        let relative = sigma / unit;
        if relative < SUSPICIOUS[i / 2] && (solid || spread > PARALLEL || i >= 2) {
            continue;
        }
        // The centre of the picture needs more room: a long lens hardly knows it, and that does little harm.
        let changes: [f64; 2] = if i < 2 {
            [1.0 + CHANGE, 1.0 / (1.0 + CHANGE)].map(|s| (s - 1.0) * unit)
        } else {
            [CHANGE * unit, -CHANGE * unit]
        };
        for change in changes {
            if !excluded(problem, fitted, sigma0_px, i, sigma, change, tick)? {
                return Err(refusal(problem, setup, spread, singular_values, Some((i, change))));
            }
        }
    }
    Ok(covariance)
}

/// Whether holding parameter `i` at its value + `change` fits significantly worse, everything else refined again.
fn excluded(
    problem: &refine::Problem<'_>,
    fitted: &Fitted,
    sigma0_px: f64,
    i: usize,
    sigma: f64,
    change: f64,
    tick: &mut dyn FnMut() -> ControlFlow<()>,
) -> Result<bool> {
    let Some(slot) = problem.free.slot(i) else { return Ok(true) };
    // σ that is so large is too large, whatever the profile.
    if change.abs() < SIGNIFICANT * sigma {
        return Ok(false);
    }
    let free = problem.free.holding(i);
    let whole = refine::Problem { huber_px: fitted.huber_px, ..*problem };
    let held = refine::Problem { free: &free, ..whole };
    let mut at = fitted.refined.state.clone();
    // Rounding of coordinates is the least noise there can be.
    let limit = fitted.refined.cost + (SIGNIFICANT * sigma0_px.max(1e-9)).powi(2);
    // Half as far again as σ wants where that is less than all, but in no more than four steps, each of which starts where the
    // last leads to.
    let step = (1.5 * SIGNIFICANT * sigma).clamp(0.25 * change.abs(), change.abs());
    let mut gone = 0.0;
    while gone < change.abs() {
        let by = step.min(change.abs() - gone);
        gone += by;
        let Some(start) = refine::along(&whole, &at, slot, by.copysign(change)) else { return Ok(false) };
        let limits = Limits { iterations: 30, tolerance: 1e-6, damping: 1e-7, enough: Some(limit) };
        // Where it does not even see the board, it fits worse.
        let Some(refined) = unless_stopped(refine::refine(&held, &start, limits, tick))? else {
            return Ok(true);
        };
        if refined.cost > limit {
            // Further on it fits still worse.
            return Ok(true);
        }
        at = refined.state;
    }
    Ok(false)
}

/// Largest angle between the normals of two boards, rad.
fn spread_rad(state: &State, views: &[Seen]) -> f64 {
    let normals: Vec<Vector3<f64>> =
        state.poses.iter().zip(views).map(|(p, v)| p.rotation * v.plane.normal_in_board()).collect();
    // Farthest from the first, then farthest from that: within a factor of two of the diameter, in linear time.
    let farthest = |from: &Vector3<f64>| {
        normals.iter().copied().fold((*from, 0.0f64), |best, n| {
            let angle = from.cross(&n).norm().atan2(from.dot(&n));
            if angle > best.1 { (n, angle) } else { best }
        })
    };
    normals.first().map_or(0.0, |first| farthest(&farthest(first).0).1)
}

fn refusal(
    problem: &refine::Problem<'_>,
    setup: &CameraSetup,
    spread: f64,
    singular_values: &[f64; 5],
    found: Option<(usize, f64)>,
) -> Error {
    let views = problem.blocks.len();
    let evidence = found.map_or_else(
        || {
            if spread < PARALLEL {
                format!("singular values of the closed form fall to {:.1e}", singular_values[3])
            } else {
                format!("terms of the model \"{}\" stand for each other", problem.spec.title)
            }
        },
        |(i, change)| {
            let name = problem.spec.params[i].name;
            if i < 2 {
                format!(
                    "a {name} {:.0} % {} fits as well",
                    100.0 * CHANGE,
                    if change > 0.0 { "longer" } else { "shorter" }
                )
            } else {
                format!("a {name} that is {:.0} px off fits as well", change.abs())
            }
        },
    );
    let degrees = spread.to_degrees();
    let remedy = "tilt the board by 20 to 40 degrees to the left, right, front and back";
    let [w, h] = setup.size_px;
    Error::Degenerate(if views == 1 {
        format!(
            "one view does not determine this camera ({evidence}): {remedy} in further pictures, or fix parameters (for example fx=fy,cx,cy)"
        )
    } else if spread < PARALLEL {
        format!(
            "all {views} boards are parallel within {degrees:.1} degrees, so focal length and distance cannot be told apart ({evidence}): {remedy}"
        )
    } else {
        let fewer = if found.is_none() { "choose a model with fewer terms, or " } else { "" };
        format!(
            "the {views} views do not determine the camera of the {w} x {h} px pictures ({evidence}): {fewer}{remedy}, and fill more of the picture"
        )
    })
}
