//! `straightedge validate`: whether an old calibration still holds for new pictures.

use std::{fmt::Write as _, ops::ControlFlow, path::PathBuf, process::ExitCode};

use serde::Serialize;

use super::{NO_RESULT, args, compare::read, files, frames, measured::Measured, print, say};
use crate::{
    calib::{
        Result,
        board::Design,
        compare::{self, Answer, Side, Validity},
        json,
        number::significant,
        report::FrameReport,
    },
    job::{evidence::Case, store, validate::validate},
};

/// Tell from a few new pictures whether an old calibration still holds
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// New photographs of a board, or folders of them; beside --corners only where the pictures are
    #[arg(value_name = "PATHS", required_unless_present = "corners")]
    paths: Vec<PathBuf>,
    /// The old calibration: camera file of any format, or a report (HTML); best one with covariance
    #[arg(long, value_name = "FILE")]
    camera: PathBuf,
    #[command(flatten)]
    board: args::Board,
    #[command(flatten)]
    measured: Measured,
    #[command(flatten)]
    detecting: args::Detecting,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
    /// Write the map of the difference as one page
    #[arg(long, value_name = "FILE.html")]
    html: Option<PathBuf>,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Printed<'a> {
    version: &'static str,
    camera: String,
    #[serde(flatten)]
    validity: &'a Validity,
    frames: &'a [FrameReport],
}

pub(super) fn run(args: &Args) -> Result<ExitCode> {
    if let Some(path) = &args.html {
        files::may_write(path, [args.camera.as_path()])?;
    }
    let file = read(&args.camera)?;
    if file.evidence.residual.is_some() {
        say("note: the residual map of the old camera is left out: new pictures are solved without one");
    }
    let old = Side::from(&file);
    let name = args.camera.display().to_string();
    if old.covariance.is_none() {
        say(&format!("note: {name} holds no covariance: it is taken as exact"));
    }
    let mut settings = args.detecting.settings();
    let mut square = args.board.square.map(|s| (s.value, s.unit));
    let mut board = args.board.board.0;
    let mut target = None;
    let inspected = match args.measured.read(&args.paths, Some(file.camera.size_px))? {
        Some(given) => {
            board = board.or(given.board.map(Design::checkerboard));
            square = square.or(given.square);
            target = given.target;
            given.inspected
        }
        None => {
            let mut pool = frames::pool(args.detecting.threads);
            frames::inspect(&mut pool, frames::sources(&args.paths)?, args.detecting.options())?
        }
    };
    if let Some(error) = files::none_found(&inspected.entries, &args.paths) {
        return Err(error);
    }
    (settings.square, settings.unit) = square.unwrap_or(args.board.square());
    let start = Some((name.clone(), file.camera.clone()));
    let case = Case { board, target, start, ..Case::new(inspected.entries, settings) };
    let bar = frames::waiting("Comparing with new pictures");
    let found = validate(&case, &old, &mut |_| ControlFlow::Continue(()));
    bar.finish_and_clear();
    let (validity, held) = found?;
    if args.json {
        let printed = Printed {
            version: env!("CARGO_PKG_VERSION"),
            camera: name.clone(),
            validity: &validity,
            frames: &held.report.frames,
        };
        print(&json::text(&printed))?;
    } else {
        print(&words(&validity, &held.report.frames))?;
    }
    if let (Some(path), Some(comparison)) = (&args.html, &validity.comparison) {
        store::write(path, compare::page([&name, "the new pictures"], comparison).as_bytes())?;
        say(&format!("wrote {} (the comparison as one page)", path.display()));
    }
    let valid = validity.answer == Answer::StillValid;
    Ok(if valid { ExitCode::SUCCESS } else { ExitCode::from(NO_RESULT) })
}

fn words(v: &Validity, frames: &[FrameReport]) -> String {
    let mut out = format!("{}\n\n", v.sentence);
    let px = |v: Option<f64>| v.map_or("–".to_owned(), |v| format!("{} px", significant(v, 3)));
    let _ = writeln!(out, "RMS of {} corners in {} pictures", v.corners, v.pictures);
    for (what, rms) in [
        ("with the old camera, poses free", Some(v.held_rms_px)),
        ("expected of it by chance", v.expected_rms_px),
        ("with a camera of their own", v.free_rms_px),
    ] {
        let _ = writeln!(out, "  {what:<32} {}", px(rms));
    }
    if let Some(c) = &v.comparison {
        let _ = writeln!(
            out,
            "The projection would move by {} in the middle half, {} over the picture, {} in its corners (RMS)",
            px(Some(c.middle.rms_px)),
            px(Some(c.whole.rms_px)),
            px(Some(c.corners.rms_px))
        );
    }
    if let Some(why) = &v.why {
        let _ = writeln!(out, "note: {why}");
    }
    let wide = frames.iter().map(|f| f.name().chars().count()).max().unwrap_or(0).max(7);
    let _ = writeln!(out, "\n  {:wide$}  corners   rms px   max px", "picture");
    for f in frames {
        let name = f.name();
        match (f.rms_px, f.max_px) {
            (Some(rms), Some(max)) if f.included => {
                let _ = writeln!(out, "  {name:wide$}  {:>7}  {rms:>7.3}  {max:>7.3}", f.corners.len());
            }
            _ => {
                let _ = writeln!(out, "  {name:wide$}  not used: {}", f.why);
            }
        }
    }
    out
}
