//! `straightedge calibrate`: from a folder of photographs to a camera with its evidence.

mod inputs;
mod outputs;

use std::{
    ops::ControlFlow,
    path::{Path, PathBuf},
    process::ExitCode,
    time::Instant,
};

use super::{
    NO_RESULT,
    args::{self, Fixes, ModelArg},
    fail_if::FailIf,
    files, frames,
    measured::Measured,
    print, say, text,
};
use crate::{
    calib::{
        Result,
        advice::Goal,
        board::Design,
        calibrate::{Loss, Options, Weights, check_fixes},
        camera::Model,
        format::Destination,
    },
    job::{
        evidence::{Case, Evidence, advised, compared, evidence, with_influence, with_sources},
        ms_since,
    },
};

/// Calibrate a camera from photographs of a board, or from known points that were measured in them
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Photographs, or folders of them; beside --corners only where the pictures are
    #[arg(value_name = "PATHS", required_unless_present = "corners")]
    paths: Vec<PathBuf>,
    #[command(flatten)]
    board: args::Board,
    /// Camera model: pinhole, radial1, radial2, radial3, brown3, brown4, brown5 (k1 k2 p1 p2 k3), brown5skew, rational, thinprism, tilted, eucm,
    /// ds, kb4 (fisheye), or auto for the simplest that errs as little as any in pictures left out of the fit
    #[arg(long, value_name = "MODEL", default_value = "brown5")]
    model: ModelArg,
    /// Hold or tie parameters: fx=fy,cx,cy,k3=0
    #[arg(long, value_name = "LIST", default_value = "", hide_default_value = true)]
    fix: Fixes,
    /// Camera file that the refinement starts from, and whose values --fix holds
    #[arg(long, value_name = "FILE")]
    start: Option<PathBuf>,
    /// Loss of a residual: huber, or linear (least squares, as OpenCV)
    #[arg(long, value_name = "LOSS", default_value_t)]
    loss: Loss,
    /// Weights of the corners: sigma (by their predicted accuracy), or none
    #[arg(long, value_name = "WEIGHTS", default_value_t)]
    weights: Weights,
    #[command(flatten)]
    measured: Measured,
    /// True camera to compare with: a truth file of `synth` or any camera file
    #[arg(long, value_name = "FILE")]
    truth: Option<PathBuf>,
    /// Write the camera; may be given several times. Formats: opencv (.yaml), ros, kalibr, colmap (.txt), nerfstudio,
    /// straightedge (.json), mrcal (.cameramodel), matlab (.m), metashape (.xml), basalt, gyroflow, opensfm
    #[arg(long, value_name = "[FORMAT:]FILE")]
    out: Vec<Destination>,
    /// Write the evidence as one HTML page
    #[arg(long, value_name = "FILE.html")]
    report: Option<PathBuf>,
    /// What the model leaves, as a smooth displacement over the picture (.npy: height x width x 2, px), and whether it is worth
    /// having. Where it is, the JSON carries it and `undistort` applies it; where it is not, the array is zero
    #[arg(long, value_name = "FILE.npy", value_parser = outputs::npy)]
    residual_map: Option<PathBuf>,
    /// Fit a splined camera (mrcal's, a grid of control points) from the solution on, and write it; `undistort` and `stmap` read it
    #[arg(long, value_name = "FILE.cameramodel", value_parser = outputs::cameramodel)]
    splined: Option<PathBuf>,
    /// How sure the camera shall be, for the advice on what to photograph next: 0.1px; 5mm@2m across at a distance; or
    /// 1cm@2m,baseline=12cm in depth from two such cameras; in the worst corner of the picture, or with ,mean or ,centre
    #[arg(long, value_name = "GOAL", default_value_t)]
    goal: Goal,
    /// Exit with 1 where a condition holds: 'rms>0.5,uncertainty>1'
    #[arg(long, value_name = "CONDITIONS")]
    fail_if: Option<FailIf>,
    /// Print JSON instead of text
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    detecting: args::Detecting,
}

pub(super) fn run(args: &Args) -> Result<ExitCode> {
    let begun = Instant::now();
    let inputs = || {
        let named = [&args.truth, &args.start];
        let paths = args.paths.iter().chain(named.into_iter().flatten()).map(PathBuf::as_path);
        paths.chain(args.measured.files())
    };
    let results = args.out.iter().map(|o| Path::new(&o.path));
    for path in results
        .chain([&args.report, &args.residual_map, &args.splined].into_iter().flatten().map(PathBuf::as_path))
    {
        files::may_write(path, inputs())?;
    }
    let truth = args.truth.as_deref().map(inputs::truth).transpose()?;
    let start = args.start.as_deref().map(inputs::start).transpose()?;
    let models = args.model.0.map_or_else(|| Model::USUAL.to_vec(), |model| vec![model]);
    check_fixes(&args.fix.0, &models, start.as_ref().map(|s| &s.1))?;
    let mut pool = frames::pool(args.detecting.threads);
    let mut settings = args.detecting.settings();
    let mut board = args.board.board.0;
    let mut square = args.board.square.map(|s| (s.value, s.unit));
    let mut target = None;
    let inspected = match args.measured.read(&args.paths, None)? {
        None => {
            let sources = frames::sources(&args.paths)?;
            frames::inspect(&mut pool, sources, args.detecting.options())?
        }
        Some(given) => {
            board = board.or(given.board.map(Design::checkerboard));
            square = square.or(given.square);
            target = given.target;
            settings.corners = args.measured.corners.as_ref().map(|path| path.display().to_string());
            given.inspected
        }
    };
    if let Some((value, unit)) = square {
        (settings.square, settings.unit) = (value, unit);
    }
    let mut case = Case {
        board,
        target,
        models,
        start,
        truth,
        residual_map: args.residual_map.is_some(),
        options: Options {
            fixed: args.fix.0.clone(),
            loss: args.loss,
            weights: args.weights,
            ..Options::default()
        },
        ..Case::new(inspected.entries, settings)
    };
    let mut found = solved(&case)?;
    if args.model.0.is_none() && found.calibration.is_some() {
        recommended(&mut case, &mut found)?;
    }
    with_influence(&mut found, &mut |_| ControlFlow::Continue(()))?;
    with_sources(&mut found, &mut |_| ControlFlow::Continue(()))?;
    found.report.advice = Some(advised(&found, args.goal));
    if let Some(error) = files::none_found(&case.entries, &args.paths) {
        found.report.failed(&error);
    }
    (found.report.timing_ms.read, found.report.timing_ms.detect) = (inspected.read_ms, inspected.detect_ms);
    found.report.timing_ms.total = ms_since(begun);
    answer(args, &case, &found)
}

fn solved(case: &Case) -> Result<Evidence> {
    let bar = frames::waiting("Calibrating");
    let found = evidence(case, &mut |_| ControlFlow::Continue(()));
    bar.finish_and_clear();
    found
}

/// Compares the models and takes the recommended one.
fn recommended(case: &mut Case, found: &mut Evidence) -> Result<()> {
    let bar = frames::waiting("Comparing models");
    let comparison = compared(case, &mut |_| ControlFlow::Continue(()));
    bar.finish_and_clear();
    let comparison = comparison?;
    if found.report.settings.model != comparison.recommended {
        case.models = vec![comparison.recommended];
        *found = solved(case)?;
    }
    found.report.models = Some(comparison);
    Ok(())
}

/// Prints, writes, and answers the exit code.
fn answer(args: &Args, case: &Case, found: &Evidence) -> Result<ExitCode> {
    let report = &found.report;
    // Files are written also where stdout cannot be.
    let mut well = outputs::done(print(&if args.json { report.to_json() } else { text::evidence(report) }));
    if let Some(error) = &report.error {
        say(&format!("error: {}", error.text));
        well = false;
    }
    if found.calibration.is_some() {
        for destination in &args.out {
            well &= outputs::told(outputs::camera(report, destination));
        }
        if let Some(path) = &args.residual_map {
            well &= outputs::told(outputs::residual_map(report, path));
        }
        if let Some(path) = &args.splined {
            well &= outputs::told(outputs::splined(case, found, path));
        }
        for reason in args.fail_if.iter().flat_map(|f| f.reasons(report)) {
            say(&format!("failed: {reason}"));
            well = false;
        }
    } else if !args.out.is_empty() || args.residual_map.is_some() || args.splined.is_some() {
        say("no camera file was written: there is no calibration");
    }
    if let Some(path) = &args.report {
        well &= outputs::told(outputs::page(report, path));
    }
    Ok(if well { ExitCode::SUCCESS } else { ExitCode::from(NO_RESULT) })
}
