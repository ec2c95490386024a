//! From a report back to the problem that it is the answer to: what makes it reproduce itself.

use super::{FrameReport, Report};
use crate::calib::{
    Error, Result,
    calibrate::{CameraSetup, Options, Problem},
    observation::{FrameId, Observation},
};

/// Why a picture is not used that the user set aside.
pub const SET_ASIDE_BY_HAND: &str = "set aside by you";

impl Report {
    /// What was solved: the corners of the pictures of the calibrated camera with the settings, from scratch. Pictures that the solution
    /// itself set aside are in it, copies and those that the user set aside are not. [`FrameId`] is the position in [`Report::frames`].
    ///
    /// # Errors
    /// [`Error::Invalid`] where the report has no calibration, no corners or no board.
    pub fn problem(&self) -> Result<Problem> {
        let none = |what: &str| Err(Error::Invalid(what.to_owned()));
        let Some(solution) = &self.solution else {
            return none("it has no calibration, so there is nothing to solve again");
        };
        let group = self.groups.first().map(|g| g.name.as_str());
        let asked = |f: &FrameReport| {
            f.found && group.is_none_or(|g| f.group == g) && f.copy_of.is_none() && f.why != SET_ASIDE_BY_HAND
        };
        let observations: Vec<Observation> = (0..)
            .zip(&self.frames)
            .filter(|(_, f)| asked(f))
            .map(|(i, f)| Observation { camera: 0, frame: FrameId(i), corners: f.corners.clone() })
            .collect();
        if observations.is_empty() {
            return none(
                "it holds no corners, so nothing can be solved again: give the report or the JSON that `calibrate` wrote",
            );
        }
        let settings = &self.settings;
        let Some(target) = settings.target() else {
            return none("it does not say what board was photographed: calibrate again");
        };
        Ok(Problem {
            cameras: vec![CameraSetup {
                size_px: solution.camera.size_px,
                model: settings.model,
                start: settings.start_camera.clone(),
                focal_hint_px: settings.focal_hint_px,
            }],
            target,
            observations,
            options: Options {
                fixed: settings.fixed.clone(),
                loss: settings.loss,
                weights: settings.weights,
                normalise: settings.normalise,
                ransac: settings.ransac,
                precision: settings.precision,
                multi_start: settings.multi_start,
                max_iterations: settings.max_iterations,
            },
        })
    }
}
