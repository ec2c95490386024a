//! `straightedge detect`: where are the corners?

use std::{process::ExitCode, time::Instant};

use super::{NO_RESULT, args, files, frames, print, say, text};
use crate::{
    calib::{Result, json, report::Settings},
    job::{
        evidence::{Case, sort_out},
        ms_since,
    },
};

/// Find the corners of a checkerboard in photographs
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    pictures: args::Pictures,
    #[command(flatten)]
    board: args::Board,
    #[command(flatten)]
    detecting: args::Detecting,
    /// Print JSON instead of text; `calibrate --corners` reads it
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> Result<ExitCode> {
    let begun = Instant::now();
    let sources = frames::sources(&args.pictures.paths)?;
    let mut pool = frames::pool(args.detecting.threads);
    let inspected = frames::inspect(&mut pool, sources, args.detecting.options())?;
    let (square, unit) = args.board.square();
    let settings = Settings { square, unit, ..args.detecting.settings() };
    let case = Case { board: args.board.board.0, ..Case::new(inspected.entries, settings) };
    let (mut report, mut assembly) = sort_out(&case);
    if let Some(error) = files::none_found(&case.entries, &args.pictures.paths) {
        assembly.problem = Err(error);
    }
    (report.timing_ms.read, report.timing_ms.detect) = (inspected.read_ms, inspected.detect_ms);
    report.timing_ms.total = ms_since(begun);
    let found = report.frames.iter().any(|f| f.found);
    if let (false, Err(error)) = (found, &assembly.problem) {
        report.failed(error);
    }
    print(&if args.json { json::text(&report) } else { text::detection(&report) })?;
    if let Some(error) = &report.error {
        say(&format!("error: {}", error.text));
        return Ok(ExitCode::from(NO_RESULT));
    }
    Ok(ExitCode::SUCCESS)
}
