//! How the answer changes with the pictures: halves and folds of them, and the error in pictures that were left out.
//!
//! Pictures of one pose are in one part ([`crate::calib::bursts`]), or the parts would not be independent.

use serde::{Deserialize, Serialize};
use std::ops::ControlFlow;

use super::Capture;
use crate::calib::{
    bursts,
    calibrate::pose_of,
    camera::Camera,
    observation::Corner,
    refine::{self, Free, Limits, State, block::Block},
    solution::Calibration,
};

/// Parts of the pictures.
const FOLDS: usize = 5;
/// Fewest poses that are divided.
const LEAST: usize = 6;

/// Differences between parts of the pictures.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CrossValidation {
    /// Poses: pictures of one pose count once.
    pub poses: usize,
    /// How far the projection maps of two halves are apart, px.
    pub halves_px: f64,
    /// How far they would be by chance, px.
    pub halves_by_chance_px: f64,
    /// How far the map moves when a fifth of the pictures is left out: RMS over the five, px.
    pub folds_px: f64,
    /// √(Σ|r|²/N) in pictures that were left out, px.
    pub held_out_px: f64,
    /// √(Σ|r|²/N) in those that were not, px.
    pub fitted_px: f64,
}

/// `None` where there are too few poses, or a half does not determine the camera.
pub(super) fn of(capture: &Capture<'_>) -> Option<CrossValidation> {
    let calibration = capture.calibration;
    let pictures: Vec<bursts::Corners> = calibration
        .views
        .iter()
        .zip(&capture.fixed.views)
        .map(|(view, seen)| view.indices.iter().copied().zip(seen.observed.iter().copied()).collect())
        .collect();
    let group = bursts::groups(&pictures, calibration.camera.size_px);
    let poses = group.iter().max().map_or(0, |last| last + 1);
    if poses < LEAST {
        return None;
    }
    let part = |keep: &dyn Fn(usize) -> bool| solved(capture, &|i| keep(group[i]));
    let [even, odd] = [part(&|g| g % 2 == 0)?, part(&|g| g % 2 == 1)?];
    // Of the mean of two halves the covariance is a quarter of that of their difference.
    let by_chance = {
        let sum = &even.1 + &odd.1;
        capture.map.scatters(&(sum * calibration.sigma0_px.powi(2)))?
    };
    let halves_px = capture.map.between(&even.0, &odd.0)?;
    let folds = FOLDS.min(poses);
    let (mut moved, mut squares, mut n) = (0.0, 0.0, 0usize);
    for k in 0..folds {
        let (camera, _) = part(&|g| g % folds != k)?;
        moved += capture.map.between(&calibration.camera, &camera)?.powi(2);
        for (i, view) in calibration.views.iter().enumerate().filter(|(i, _)| group[*i] % folds == k) {
            let corners: Vec<Corner> = view
                .indices
                .iter()
                .zip(&capture.fixed.views[i].observed)
                .filter(|(index, _)| !view.outliers.contains(index))
                .map(|(index, px)| Corner { index: *index, px: *px, sigma_px: 1.0 })
                .collect();
            let Ok((_, residuals)) = pose_of(&camera, capture.target, &corners) else { continue };
            squares += residuals.iter().map(|r| r.norm_squared()).sum::<f64>();
            n += residuals.len();
        }
    }
    Some(CrossValidation {
        poses,
        halves_px,
        halves_by_chance_px: by_chance,
        folds_px: (moved / folds as f64).sqrt(),
        held_out_px: (squares / n.max(1) as f64).sqrt(),
        fitted_px: calibration.rms_inliers_px,
    })
}

/// The camera of some of the views, from where the whole arrived, with its covariance for σ₀ = 1.
fn solved(capture: &Capture<'_>, keep: &dyn Fn(usize) -> bool) -> Option<(Camera, nalgebra::DMatrix<f64>)> {
    let Calibration { camera, views, .. } = capture.calibration;
    let free = Free::of(capture.calibration);
    let kept: Vec<usize> = (0..views.len()).filter(|i| keep(*i)).collect();
    let blocks: Vec<Block> = kept.iter().map(|&i| capture.fixed.views[i].block()).collect();
    let problem = refine::Problem {
        spec: camera.spec(),
        free: &free,
        blocks: &blocks,
        huber_px: None,
        single_precision: false,
    };
    let start = State {
        params: camera.params.clone(),
        poses: kept.iter().map(|&i| views[i].camera_from_board).collect(),
    };
    let limits = Limits { iterations: 20, tolerance: 1e-6, damping: 1e-7, enough: None };
    let end = refine::refine(&problem, &start, limits, &mut || ControlFlow::Continue(())).ok()?;
    let covariance = refine::information(&problem, &end.state)?.cholesky()?.inverse();
    Some((Camera { params: end.state.params, ..camera.clone() }, covariance))
}
