//! `straightedge check`: whether a report is what its own observations give.

use std::{fmt::Write as _, ops::ControlFlow, path::PathBuf, process::ExitCode};

use serde::Serialize;

use super::{NO_RESULT, files, frames, print};
use crate::{
    calib::{
        Error, Result,
        check::{self, Check, Difference, TOLERANCE},
        format, html, json,
        number::counted,
        report::Report,
    },
    job::evidence,
};

/// Solve a report again from the observations and settings in it, and compare every parameter
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Report of `calibrate --report` or of the window (HTML), or JSON of `calibrate --json` or `--out FILE.json`
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Answer<'a> {
    version: &'static str,
    file: String,
    tolerance: f64,
    #[serde(flatten)]
    check: &'a Check,
}

pub(super) fn run(args: &Args) -> Result<ExitCode> {
    let name = args.file.display().to_string();
    let text = files::text(&args.file)?;
    let held = report(&text, &name)?;
    let page_as_written = html::embedded(&text).and_then(|_| html::is_as_written(&text, &held));
    let bar = frames::waiting("Solving again");
    let solved = evidence::again(&held, &mut |_| ControlFlow::Continue(()));
    bar.finish_and_clear();
    let solved = solved.map_err(|e| match e {
        Error::Invalid(message) => Error::format(&name, message),
        other => Error::Degenerate(format!("{name}: its observations give no camera: {other}")),
    })?;
    let check = check::compare(&held, &solved, page_as_written);
    if args.json {
        let answer =
            Answer { version: env!("CARGO_PKG_VERSION"), file: name, tolerance: TOLERANCE, check: &check };
        print(&json::text(&answer))?;
    } else {
        print(&words(&name, &check))?;
    }
    Ok(if check.agrees { ExitCode::SUCCESS } else { ExitCode::from(NO_RESULT) })
}

/// The report in a page or a JSON.
fn report(text: &str, name: &str) -> Result<Report> {
    let json = html::embedded(text).unwrap_or(text);
    // What its readers refuse, or find contradictory, is refused here too.
    let file = format::read(text, name)?;
    if file.format != "straightedge" {
        return Err(Error::format(
            name,
            format!(
                "this is a camera file of {}, which holds no observations to solve again: give the report (HTML) or the JSON of `calibrate`",
                file.format
            ),
        ));
    }
    Report::from_json(json).map_err(|e| {
        Error::format(
            name,
            format!("it has a camera, but not all of a report ({e}): give what `calibrate --report` or `--json` wrote"),
        )
    })
}

fn words(name: &str, check: &Check) -> String {
    let mut out = format!(
        "{name}: solved again from {} in {} with its settings\n",
        counted(check.corners, "corner"),
        counted(check.pictures, "picture")
    );
    for part in &check.parts {
        let _ = write!(out, "  {:<17} {:>6} numbers", part.name, part.numbers);
        if let Some(worst) = &part.worst {
            let _ = write!(out, ", largest difference {}", small(worst.relative));
        }
        if part.differ > 0 {
            let _ = write!(out, ", {} differ", part.differ);
        }
        if let (Some(worst), true) = (&part.worst, part.differ > 0) {
            let _ = write!(out, ": {}", beside(worst));
        }
        out.push('\n');
    }
    if !check.used_by_one.is_empty() {
        let _ = writeln!(out, "  pictures used by one of the two only: {}", check.used_by_one.join(", "));
    }
    if check.page_as_written == Some(false) {
        out += "  the words of the page are not those that its numbers give: it was changed after it was written\n";
    }
    let largest = check.worst().map_or(0.0, |w| w.relative);
    if check.agrees {
        let _ = writeln!(
            out,
            "It agrees: no number p differs by more than {} · max(|p|, 1); {TOLERANCE:e} is allowed",
            small(largest)
        );
    } else {
        out += "It does not agree: it was changed after it was written, or is damaged\n";
    }
    if check.written_by != check.checked_by {
        let _ = writeln!(
            out,
            "It was written by version {}, this is {}: where they differ, check with the version that wrote it",
            check.written_by, check.checked_by
        );
    }
    out
}

fn small(v: f64) -> String {
    if v == 0.0 { "0".to_owned() } else { format!("{v:.1e}") }
}

fn beside(d: &Difference) -> String {
    format!("{} is {} in the file, {} solved again", d.name, d.held, d.solved)
}
