//! From what was seen to the report: assembly, calibration, comparison with the truth.

use std::{path::PathBuf, time::Instant};

use super::{
    files,
    frames::{self, Inspected},
};
use crate::{
    calib::{
        Error, Result,
        calibrate::{Options, Problem, simplest_sufficient},
        camera::{Camera, Model},
        report::{Report, Settings},
        solution::{Calibration, Warning},
        synth::Truth,
        target::BoardSize,
    },
    job::{
        assemble::{Assembly, Wanted, assemble},
        ms_since,
    },
    worker::Pool,
};

/// What to calibrate and how.
pub(super) struct Plan {
    /// Where the pictures are, as the user gave it.
    pub(super) paths: Vec<PathBuf>,
    /// Inner corners; `None` finds them.
    pub(super) board: Option<BoardSize>,
    /// Models to try, simplest first; the simplest that suffices is taken.
    pub(super) models: Vec<Model>,
    /// Camera to start from, with the name of its file.
    pub(super) start: Option<(String, Camera)>,
    /// The true camera.
    pub(super) truth: Option<Known>,
    /// How to calibrate.
    pub(super) options: Options,
    /// The rest of what the report says about what was asked for.
    pub(super) settings: Settings,
}

/// The truth, as far as it is known.
pub(super) struct Known {
    /// Name of its file.
    pub(super) file: String,
    /// The camera.
    pub(super) camera: Camera,
    /// Corners and poses.
    pub(super) scene: Option<Truth>,
}

/// A report and the calibration in it.
pub(super) struct Evidence {
    pub(super) report: Report,
    pub(super) calibration: Option<Calibration>,
}

/// Assembles, without calibrating.
pub(super) fn sort_out(inspected: &Inspected, plan: &Plan) -> (Report, Assembly) {
    let wanted = Wanted {
        board: plan.board,
        square: plan.settings.square,
        model: plan.models.first().copied().unwrap_or(Model::Brown5),
        start: plan.start.as_ref().map(|s| s.1.clone()),
        options: plan.options.clone(),
    };
    let mut assembly = assemble(&inspected.entries, &wanted);
    if inspected.entries.is_empty() && !plan.paths.is_empty() {
        assembly.problem = Err(Error::NoBoard(files::no_pictures(&plan.paths).to_string()));
    }
    let settings = Settings {
        board: assembly.board,
        board_is_found: plan.board.is_none() && assembly.board.is_some(),
        images: inspected.entries.len(),
        model: wanted.model,
        start: plan.start.as_ref().map(|s| s.0.clone()),
        truth: plan.truth.as_ref().map(|t| t.file.clone()),
        ..plan.settings.clone()
    };
    let (groups, frames, warnings) =
        (assembly.groups.clone(), assembly.frames.clone(), assembly.warnings.clone());
    let mut report = Report::new(settings.with_options(&plan.options), groups, frames, warnings);
    report.timing_ms.read = inspected.read_ms;
    report.timing_ms.detect = inspected.detect_ms;
    (report, assembly)
}

/// Calibrates and gathers the evidence. What keeps a calibration from existing is in the report.
///
/// # Errors
/// Only where the run was stopped.
pub(super) fn evidence(pool: &mut Pool, inspected: &Inspected, plan: &Plan) -> Result<Evidence> {
    let (mut report, assembly) = sort_out(inspected, plan);
    let begun = Instant::now();
    let solved = match assembly.problem.and_then(|p| start_fits(p, plan)) {
        Ok(problem) => {
            let problems = plan.models.iter().map(|model| {
                let mut problem = problem.clone();
                problem.cameras.iter_mut().for_each(|c| c.model = *model);
                problem
            });
            choose(frames::solve(pool, problems.collect())?).map(|c| (c, problem.target))
        }
        Err(error) => Err(error),
    };
    report.timing_ms.calibrate = ms_since(begun);
    let calibration = match solved {
        Ok((calibration, target)) => {
            report.settings.model = calibration.camera.model;
            report.calibrated(&calibration, &target);
            if let Some(truth) = &plan.truth {
                compare(&mut report, &calibration, truth);
            }
            Some(calibration)
        }
        Err(error) => {
            report.failed(&error);
            None
        }
    };
    Ok(Evidence { report, calibration })
}

/// The simplest calibration that suffices; the last reason where none succeeded.
fn choose(results: Vec<Result<Calibration>>) -> Result<Calibration> {
    let mut failure = Error::Invalid("no camera model was asked for".to_owned());
    let mut list = Vec::new();
    for result in results {
        match result {
            Ok(calibration) => list.push(calibration),
            Err(error) => failure = error,
        }
    }
    simplest_sufficient(&list).map(|best| list.swap_remove(best)).ok_or(failure)
}

/// Refuses a start camera for pictures of another size.
fn start_fits(problem: Problem, plan: &Plan) -> Result<Problem> {
    if let (Some((file, start)), Some(setup)) = (&plan.start, problem.cameras.first())
        && start.size_px != setup.size_px
    {
        let ([w, h], [a, b]) = (start.size_px, setup.size_px);
        return Err(Error::Invalid(format!(
            "{file} is a camera of {w} x {h} px, the pictures are {a} x {b} px: give the camera of these pictures to --start \
             (straightedge convert --scale, --crop change a camera with its pictures)"
        )));
    }
    Ok(problem)
}

fn compare(report: &mut Report, calibration: &Calibration, truth: &Known) {
    match report.compared(calibration, &truth.camera) {
        Ok(()) => {
            if let Some(scene) = &truth.scene {
                report.compared_corners(scene);
            }
        }
        Err(error) => report.warnings.push(Warning::new(
            "truth_of_another_camera",
            format!("{} was not compared: {error}", truth.file),
        )),
    }
}
