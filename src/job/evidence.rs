//! From what was seen to the report: assembly, calibration, comparison with the truth.

mod bursts;

use std::{ops::ControlFlow, sync::Arc};

use serde::{Deserialize, Serialize};
use web_time::Instant;

use super::{
    assemble::{Assembly, Entry, Wanted, assemble},
    ms_since,
};
use crate::calib::{
    Error, Result,
    advice::{Advice, Goal, advise},
    board::Design,
    calibrate::{
        self, CANDIDATES, COLUMNS, Comparison, Options, Problem, SplinedCandidate, calibrate, centred,
        simplest_sufficient, worth_trying,
    },
    camera::{Camera, Model},
    diagnose::{self, Finding, Verdict, sources},
    format, influence,
    observation::Corner,
    report::{Report, SET_ASIDE_BY_HAND, Settings},
    solution::{Calibration, Warning},
    splined::{self, Layout},
    synth::Truth,
    target::Target,
};

/// What to calibrate and how.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Case {
    /// What was seen, one for each picture, in order.
    pub entries: Arc<Vec<Entry>>,
    /// The board; `None` finds it.
    pub board: Option<Design>,
    /// What was photographed, where it is no board to be found.
    #[serde(default)]
    pub target: Option<Target>,
    /// Models to try, simplest first; the simplest that suffices is taken.
    pub models: Vec<Model>,
    /// Camera to start from, with the name of its file.
    pub start: Option<(String, Camera)>,
    /// The true camera.
    pub truth: Option<Known>,
    /// How to calibrate.
    pub options: Options,
    /// Positions of pictures that the user set aside.
    pub excluded: Vec<usize>,
    /// Corners that the user dropped: position of the picture, index on the board.
    pub dropped: Vec<(usize, u32)>,
    /// Whether what the model leaves is sought as a displacement over the picture.
    #[serde(default)]
    pub residual_map: bool,
    /// The rest of what the report says about what was asked for.
    pub settings: Settings,
}

impl Case {
    /// With nothing else asked for.
    pub fn new(entries: Vec<Entry>, settings: Settings) -> Self {
        Self {
            entries: Arc::new(entries),
            board: None,
            target: None,
            models: vec![Model::Brown5],
            start: None,
            truth: None,
            options: Options::default(),
            excluded: Vec::new(),
            dropped: Vec::new(),
            residual_map: false,
            settings,
        }
    }
}

/// The truth, as far as it is known.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Known {
    /// Name of its file.
    pub file: String,
    /// The camera.
    pub camera: Camera,
    /// Corners and poses.
    pub scene: Option<Truth>,
}

/// A report and the calibration in it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Evidence {
    /// Everything that is known.
    pub report: Report,
    /// The calibration; the report says why there is none.
    pub calibration: Option<Calibration>,
    /// The corners that the user dropped, with the position of their picture.
    pub dropped: Vec<(usize, Corner)>,
    /// What it is worth.
    pub verdict: Verdict,
    /// What is behind the verdict, the worst first.
    pub findings: Vec<Finding>,
}

/// Assembles, without calibrating.
pub fn sort_out(case: &Case) -> (Report, Assembly) {
    let wanted = Wanted {
        board: case.board,
        target: case.target.clone(),
        square: case.settings.square,
        model: case.models.first().copied().unwrap_or(Model::Brown5),
        start: case.start.as_ref().map(|s| s.1.clone()),
        options: case.options.clone(),
    };
    let assembly = assemble(&case.entries, &wanted);
    let settings = Settings {
        board: assembly.target.as_ref().and_then(Target::grid),
        board_is_found: case.board.is_none() && case.target.is_none() && assembly.target.is_some(),
        target: assembly.target.clone().filter(|t| !matches!(t, Target::Checkerboard { .. })),
        images: case.entries.len(),
        model: wanted.model,
        start: case.start.as_ref().map(|s| s.0.clone()),
        start_camera: case.start.as_ref().map(|s| s.1.clone()),
        focal_hint_px: assembly.problem.as_ref().ok().and_then(|p| p.cameras.first()?.focal_hint_px),
        truth: case.truth.as_ref().map(|t| t.file.clone()),
        ..case.settings.clone()
    };
    let (groups, frames, warnings) =
        (assembly.groups.clone(), assembly.frames.clone(), assembly.warnings.clone());
    let report = Report::new(settings.with_options(&case.options), groups, frames, warnings);
    (report, assembly)
}

/// Calibrates and gathers the evidence. What keeps a calibration from existing is in the report.
///
/// # Errors
/// [`Error::Stopped`] where `tick` breaks.
pub fn evidence(case: &Case, tick: &mut dyn FnMut(f32) -> ControlFlow<()>) -> Result<Evidence> {
    let (mut report, mut assembly) = sort_out(case);
    let dropped = leave_out(case, &mut report, &mut assembly);
    let begun = Instant::now();
    let solved = match assembly.problem.and_then(|p| start_fits(p, case)) {
        Ok(problem) => answer(&mut report, &problem, &case.models, tick)?
            .map(|calibration| (calibration, problem.target)),
        Err(error) => Err(error),
    };
    report.timing_ms.calibrate = ms_since(begun);
    let calibration = match solved {
        Ok((calibration, target)) => {
            if case.residual_map {
                report.with_residual_map(&calibration, &target);
            }
            if let Some(truth) = &case.truth {
                compare(&mut report, &calibration, truth);
            }
            Some(calibration)
        }
        Err(error) => {
            report.failed(&error);
            None
        }
    };
    let (verdict, findings) = (diagnose::verdict(&report), diagnose::findings(&report));
    Ok(Evidence { report, calibration, dropped, verdict, findings })
}

/// Solves, with repeated poses once, and writes the answer into the report.
fn answer(
    report: &mut Report,
    problem: &Problem,
    models: &[Model],
    tick: &mut dyn FnMut(f32) -> ControlFlow<()>,
) -> Result<Result<Calibration>> {
    let calibration = match solve(problem, models, tick)? {
        Ok(calibration) => calibration,
        Err(error) => return Ok(Err(error)),
    };
    let (calibration, averaged) = bursts::once(problem, calibration, tick)?;
    report.settings.model = calibration.camera.model;
    report.calibrated(&calibration, &problem.target);
    if let Some(averaged) = averaged {
        averaged.told(problem, &calibration, report)?;
    }
    Ok(Ok(calibration))
}

/// Solves what a report is the answer to once more, from its own corners and settings, and answers the report of that solution; see
/// [`crate::calib::check`].
///
/// # Errors
/// Those of [`Report::problem`] and of the calibration.
pub fn again(report: &Report, tick: &mut dyn FnMut(f32) -> ControlFlow<()>) -> Result<Report> {
    let problem = report.problem()?;
    let mut fresh = report.clone();
    let calibration = answer(&mut fresh, &problem, &[report.settings.model], tick)??;
    if report.solution.as_ref().is_some_and(|s| s.residual_map.is_some()) {
        fresh.with_residual_map(&calibration, &problem.target);
    }
    Ok(fresh)
}

/// Most views whose influence is asked for: the time grows with their square, and each matters less.
const MOST_INFLUENCES: usize = 300;

/// Adds what each picture does to the camera, and what follows from it.
///
/// # Errors
/// [`Error::Stopped`] where `tick` breaks.
pub fn with_influence(found: &mut Evidence, tick: &mut dyn FnMut(f32) -> ControlFlow<()>) -> Result<()> {
    let (Some(calibration), Some(target)) = (&found.calibration, found.report.settings.target()) else {
        return Ok(());
    };
    if calibration.views.len() <= MOST_INFLUENCES {
        let influences =
            influence::of(calibration, &target, found.report.settings.loss, tick).ok_or(Error::Stopped)?;
        found.report.with_influence(calibration, &influences);
        (found.verdict, found.findings) =
            (diagnose::verdict(&found.report), diagnose::findings(&found.report));
    }
    Ok(())
}

/// Adds the seven sources of error and the faults behind them, and what follows from those.
///
/// # Errors
/// [`Error::Stopped`] where `tick` breaks.
pub fn with_sources(found: &mut Evidence, tick: &mut dyn FnMut(f32) -> ControlFlow<()>) -> Result<()> {
    let (Some(calibration), Some(target)) = (&found.calibration, found.report.settings.target()) else {
        return Ok(());
    };
    let mut stopped = false;
    found.report.sources = sources::of(&found.report, calibration, &target, &mut |share| {
        let flow = tick(share);
        stopped |= flow.is_break();
        flow
    });
    if stopped {
        return Err(Error::Stopped);
    }
    (found.verdict, found.findings) = (diagnose::verdict(&found.report), diagnose::findings(&found.report));
    Ok(())
}

/// What to photograph next.
pub fn advised(found: &Evidence, goal: Goal) -> Advice {
    match (&found.calibration, found.report.settings.target()) {
        (Some(calibration), Some(target)) => advise(calibration, &target, found.report.settings.unit, goal),
        _ => Advice::first(goal),
    }
}

/// Compares all usual camera models on what a case would be calibrated from.
///
/// # Errors
/// Why nothing can be calibrated; [`Error::Stopped`] where `tick` breaks.
pub fn compared(case: &Case, tick: &mut dyn FnMut(f32) -> ControlFlow<()>) -> Result<Comparison> {
    let (mut report, mut assembly) = sort_out(case);
    leave_out(case, &mut report, &mut assembly);
    let problem = assembly.problem.and_then(|p| start_fits(p, case))?;
    let mut comparison = calibrate::compare(&problem, &CANDIDATES, &mut |part| tick(0.7 * part))?;
    let rest = &mut |part: f32| tick(0.7 + 0.3 * part);
    match calibrate::splined(&problem, comparison.recommended, COLUMNS, rest) {
        Err(Error::Stopped) => return Err(Error::Stopped),
        other => comparison.splined = other.ok(),
    }
    Ok(comparison)
}

/// How a splined camera would fare in pictures that it was not fitted to, from `model` on.
///
/// # Errors
/// Why there is none; [`Error::Stopped`] where `tick` breaks.
pub fn splined(
    case: &Case,
    model: Model,
    tick: &mut dyn FnMut(f32) -> ControlFlow<()>,
) -> Result<SplinedCandidate> {
    let (mut report, mut assembly) = sort_out(case);
    leave_out(case, &mut report, &mut assembly);
    let problem = assembly.problem.and_then(|p| start_fits(p, case))?;
    calibrate::splined(&problem, model, COLUMNS, tick)
}

/// The splined camera that explains the corners of a calibration best, as a file of mrcal, and how it was fitted.
///
/// # Errors
/// Those of [`splined::fit`].
pub fn splined_camera(calibration: &Calibration, target: &Target) -> Result<(String, splined::Fitted)> {
    let layout = Layout::covering(&calibration.camera, COLUMNS)?;
    let fitted = splined::fit(calibration, target, layout, &mut || ControlFlow::Continue(()))?;
    Ok((format::write_splined(&fitted.camera), fitted))
}

/// Takes out what the user set aside or dropped; answers the dropped corners.
fn leave_out(case: &Case, report: &mut Report, assembly: &mut Assembly) -> Vec<(usize, Corner)> {
    let mut dropped = Vec::new();
    for &(position, index) in &case.dropped {
        let Some(frame) = report.frames.get_mut(position) else { continue };
        if let Some(at) = frame.corners.iter().position(|c| c.index == index) {
            dropped.push((position, frame.corners.remove(at)));
        }
    }
    for &position in &case.excluded {
        if let Some(frame) = report.frames.get_mut(position) {
            SET_ASIDE_BY_HAND.clone_into(&mut frame.why);
        }
    }
    if let Ok(problem) = &mut assembly.problem {
        problem.observations.retain(|o| !case.excluded.contains(&(o.frame.0 as usize)));
        for observation in &mut problem.observations {
            let position = observation.frame.0 as usize;
            observation.corners.retain(|c| !case.dropped.contains(&(position, c.index)));
        }
    }
    dropped
}

/// From what is to be solved to the calibration.
///
/// # Errors
/// [`Error::Stopped`] where `tick` breaks.
fn solve(
    problem: &Problem,
    models: &[Model],
    tick: &mut dyn FnMut(f32) -> ControlFlow<()>,
) -> Result<Result<Calibration>> {
    match choose(problem, models, tick)? {
        Ok(calibration) => match centred(problem, calibration, tick) {
            Err(Error::Stopped) => Err(Error::Stopped),
            other => Ok(other),
        },
        Err(error) => Ok(Err(error)),
    }
}

/// The simplest calibration that suffices; the last reason where none succeeded.
///
/// # Errors
/// [`Error::Stopped`] where `tick` breaks.
fn choose(
    problem: &Problem,
    models: &[Model],
    tick: &mut dyn FnMut(f32) -> ControlFlow<()>,
) -> Result<Result<Calibration>> {
    let mut failure = Error::Invalid("no camera model was asked for".to_owned());
    let mut list = Vec::new();
    for (k, model) in models.iter().enumerate() {
        if !worth_trying(*model, &list) {
            continue;
        }
        let mut problem = problem.clone();
        problem.cameras.iter_mut().for_each(|c| c.model = *model);
        let mut share = |part: f32| tick((k as f32 + part) / models.len() as f32);
        match calibrate(&problem, &mut share) {
            Ok(calibration) => list.push(calibration),
            Err(Error::Stopped) => return Err(Error::Stopped),
            Err(error) => failure = error,
        }
    }
    Ok(simplest_sufficient(&list).map(|best| list.swap_remove(best)).ok_or(failure))
}

/// Refuses a start camera for pictures of another size.
fn start_fits(problem: Problem, case: &Case) -> Result<Problem> {
    if let (Some((file, start)), Some(setup)) = (&case.start, problem.cameras.first())
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
