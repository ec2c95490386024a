//! One sentence that says whether the camera can be used.

use super::{Report, Solution};
use crate::calib::number::{counted, significant};

/// Above this RMS the pictures and the model disagree visibly, px.
const LARGE_RMS_PX: f64 = 1.0;
/// Above this no lens, board or blur is the explanation that a user would accept, px.
const ABSURD_RMS_PX: f64 = 3.0;
/// Above this the camera is not known well in the corners of the picture, px.
const UNSURE_PX: f64 = 1.0;

impl Report {
    /// Whether the camera can be used: begins with `Good`, `Use with care`, `Do not use this` or `No calibration`, and says why
    /// and what to do.
    pub fn verdict(&self) -> String {
        match (&self.solution, &self.error) {
            (Some(solution), _) => of(self, solution),
            (None, Some(error)) => format!("No calibration: {}.", error.text),
            (None, None) => "No calibration.".to_owned(),
        }
    }
}

fn of(report: &Report, solution: &Solution) -> String {
    let used = report.included().count();
    let rms = format!("RMS {} px", significant(solution.rms_px, 3));
    let from = format!("{used} of {}", counted(report.frames.len(), "picture"));
    if !solution.termination.converged() {
        format!("Do not use this: the solution was not reached ({from}, {rms}).")
    } else if solution.rms_px > ABSURD_RMS_PX {
        format!(
            "Do not use this: the model misses the corners ({from}, {rms}). Is the lens a fisheye, or the board not flat?"
        )
    } else if solution.rms_px > LARGE_RMS_PX {
        format!("Use with care: {rms} is large ({from}). Is the board flat and are the pictures sharp?")
    } else {
        match solution.uncertainty.worst_corner_px {
            None => format!(
                "Use with care: the corners of the picture are not determined ({from}, {rms}). Photograph the board there, too."
            ),
            Some(px) if px > UNSURE_PX => format!(
                "Use with care: the corners of the picture are known to {} px only ({from}, {rms}). Photograph the board there, too.",
                significant(px, 2)
            ),
            Some(px) => format!(
                "Good: {from}, {rms}, projection certain to {} px or better everywhere.",
                significant(px, 2)
            ),
        }
    }
}
