//! Whether a splined camera is worth having: judged as the models are, by pictures that it was not fitted to.

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};
use std::ops::ControlFlow;

use super::{Inliers, Tried, by_model, folds, held_out, surely_worse, to_common_groups, with};
use crate::{
    Result,
    calibrate::{Problem, calibrate, pose_of},
    camera::Model,
    number::significant,
    observation::Observation,
    solution::Calibration,
    splined::{self, Layout},
};

/// Control points from the left to the right of the picture.
pub const COLUMNS: usize = 20;

/// How a splined camera fares beside the model that it starts from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SplinedCandidate {
    /// The model that it starts from and stays with where no corner says otherwise.
    pub base: Model,
    /// Columns and rows of control points.
    pub knots: [usize; 2],
    /// √(Σ|r|²/N) of the fit to all pictures, px.
    pub rms_px: f64,
    /// Share of the picture that the corners support.
    pub supported: f64,
    /// RMS in pictures that were left out of the fit, over the corners that the base model does not call outliers, px; `None` where
    /// the pictures are too few.
    pub held_out_px: Option<f64>,
    /// That of the base model in the same pictures.
    pub base_held_out_px: Option<f64>,
    /// Whether it errs less by more than chance.
    pub worth_having: bool,
    /// What speaks against it; empty where nothing does.
    pub against: String,
}

impl SplinedCandidate {
    /// In one sentence.
    pub fn words(&self) -> String {
        let base = self.base.spec().title;
        if !self.against.is_empty() {
            return format!("A splined camera is no good: {}", self.against);
        }
        match (self.held_out_px, self.base_held_out_px) {
            (Some(own), Some(other)) => format!(
                "A splined camera errs by {} px in new pictures, {base} by {} px: {}worth having",
                significant(own, 3),
                significant(other, 3),
                if self.worth_having { "" } else { "not " }
            ),
            _ => "The pictures are too few to leave some out and ask a splined camera about them".to_owned(),
        }
    }
}

/// Fits a splined camera from `model` on, to all pictures and without each part of them.
///
/// # Errors
/// Those of [`calibrate`] and [`splined::fit`]; [`crate::Error::Stopped`] where `tick` breaks.
pub fn splined(
    problem: &Problem,
    model: Model,
    columns: usize,
    tick: &mut dyn FnMut(f32) -> ControlFlow<()>,
) -> Result<SplinedCandidate> {
    let target = &problem.target;
    let whole = calibrate(&with(problem, model), &mut |part| tick(0.1 * part))?;
    let layout = Layout::covering(&whole.camera, columns)?;
    let fitted = splined::fit(&whole, target, layout, &mut || tick(0.1))?;
    let inliers = Inliers::of(&whole);
    let size_px = problem.cameras.first().map_or([0; 2], |c| c.size_px);
    let parts = folds::of(&problem.observations, size_px);
    let by_splined = |fitted: &Calibration, left: &[&Observation]| -> Vec<Option<Vec<Vector2<f64>>>> {
        let camera = splined::fit(fitted, target, layout, &mut || ControlFlow::Continue(()));
        let answer = |o: &&Observation| {
            let (pose, _) = pose_of(&fitted.camera, target, &o.corners).ok()?;
            splined::residuals_of(&camera.as_ref().ok()?.camera, target, &o.corners, &pose)
        };
        left.iter().map(answer).collect()
    };
    let mut share = |from: f32, part: f32| tick(from + 0.45 * part);
    let base = held_out(problem, &whole, &parts, &inliers, &by_model(target), &mut |p| share(0.1, p))?;
    let own = held_out(problem, &whole, &parts, &inliers, &by_splined, &mut |p| share(0.55, p))?;
    let mut both = [base, own].map(|errors| Tried { calibration: whole.clone(), errors });
    to_common_groups(&mut both);
    let [base, own] = both;
    let against = if !fitted.converged {
        "it did not come to rest"
    } else if fitted.camera.folds() {
        "it turns back on itself inside the picture"
    } else {
        ""
    };
    let better = base.errors.is_some() && own.errors.is_some() && surely_worse(&base, &own);
    Ok(SplinedCandidate {
        base: model,
        knots: layout.knots,
        rms_px: fitted.rms_px,
        supported: fitted.camera.supported_fraction(),
        held_out_px: own.held_out_px(),
        base_held_out_px: base.held_out_px(),
        worth_having: better && against.is_empty(),
        against: against.to_owned(),
    })
}
