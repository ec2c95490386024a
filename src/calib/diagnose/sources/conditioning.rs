//! Arithmetic: whether the optimum is the only one, and reached to the last digit that matters.

use std::ops::ControlFlow;

use super::{Card, Facts, Show, px};
use crate::calib::{
    calibrate::pose_of,
    observation::Corner,
    refine::{self, Free, Limits, State, block::Block},
};

/// Focal lengths of other starts, relative.
const STARTS: [f64; 2] = [0.8, 1.25];
/// Costs that differ by this share are those of one optimum.
const SAME: f64 = 1e-3;

pub(super) fn card(facts: &Facts<'_>) -> Card {
    let calibration = facts.capture.calibration;
    let (spread, elsewhere) = restarted(facts);
    let starts = &calibration.starts;
    let reached = if elsewhere == 0 && starts.agreeing == starts.tried {
        format!("All {} starts end at the same camera", starts.tried + STARTS.len())
    } else {
        format!(
            "{} of {} starts end elsewhere, at larger errors",
            elsewhere + starts.tried - starts.agreeing,
            starts.tried + STARTS.len()
        )
    };
    let text = format!(
        "{reached}, to {}; the normal equations have condition {:.0e}, {:.0e} with scaled unknowns.",
        px(spread),
        condition(facts, false),
        condition(facts, true)
    );
    Card {
        px: spread,
        text,
        show: Show::Errors,
        remedy: None,
        advice: "Nothing: coordinates are scaled and arithmetic is double".to_owned(),
    }
}

/// How far apart the maps of other starts are that reach the optimum, px, and how many do not.
fn restarted(facts: &Facts<'_>) -> (f64, usize) {
    let capture = facts.capture;
    let calibration = capture.calibration;
    let free = Free::of(calibration);
    let blocks: Vec<Block> = capture.fixed.views.iter().map(|seen| seen.block()).collect();
    let problem = refine::Problem {
        spec: calibration.camera.spec(),
        free: &free,
        blocks: &blocks,
        huber_px: None,
        single_precision: false,
    };
    let corners = blocks.iter().map(Block::len).sum();
    // The optimum of the very sum that the others minimise.
    let solved = |state: &State| {
        refine::refine(&problem, state, Limits::full(corners), &mut || ControlFlow::Continue(())).ok()
    };
    let poses = calibration.views.iter().map(|v| v.camera_from_board).collect();
    let Some(best) = solved(&State { params: calibration.camera.params.clone(), poses }) else {
        return (0.0, 0);
    };
    let camera = |state: &State| crate::calib::camera::Camera {
        params: state.params.clone(),
        ..calibration.camera.clone()
    };
    let (mut spread, mut elsewhere) = (0.0f64, 0);
    for by in STARTS {
        let mut start = calibration.camera.clone();
        for k in 0..2 {
            if free.slot(k).is_some() {
                start.params[k] *= by;
            }
        }
        let poses: Option<Vec<_>> = calibration
            .views
            .iter()
            .zip(&capture.fixed.views)
            .map(|(view, seen)| {
                let corners: Vec<Corner> = view
                    .indices
                    .iter()
                    .zip(&seen.observed)
                    .map(|(index, px)| Corner { index: *index, px: *px, sigma_px: 1.0 })
                    .collect();
                Some(pose_of(&start, capture.target, &corners).ok()?.0)
            })
            .collect();
        let end = poses.and_then(|poses| solved(&State { params: start.params.clone(), poses }));
        match end.filter(|end| end.cost < best.cost * (1.0 + SAME)) {
            Some(end) => {
                let apart = capture.map.between(&camera(&best.state), &camera(&end.state));
                spread = spread.max(apart.unwrap_or_default());
            }
            None => elsewhere += 1,
        }
    }
    (spread, elsewhere)
}

/// Largest over smallest eigenvalue of the reduced normal equations, as they are or with unknowns scaled to unit diagonal.
fn condition(facts: &Facts<'_>, scaled: bool) -> f64 {
    let covariance = &facts.capture.calibration.covariance;
    let n = covariance.nrows();
    let scale = |i: usize| if scaled { covariance[(i, i)].sqrt() } else { 1.0 };
    let matrix = nalgebra::DMatrix::from_fn(n, n, |i, j| covariance[(i, j)] / (scale(i) * scale(j)));
    let eigen = matrix.symmetric_eigenvalues();
    eigen.max() / eigen.min().max(f64::MIN_POSITIVE)
}
