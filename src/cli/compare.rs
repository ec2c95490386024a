//! `straightedge compare`: two calibrations beside each other.

use std::{
    fmt::Write as _,
    path::{Path, PathBuf},
    process::ExitCode,
};

use serde::Serialize;

use super::{NO_RESULT, files, print, say};
use crate::{
    calib::{
        Result,
        compare::{self, Comparison, Parameter, Side, Verdict},
        format::CameraFile,
        json,
        number::{significant, with_sigma},
    },
    job::store,
};

/// Compare two calibrations of one camera: where in the picture they differ, and whether chance explains it
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Camera file of any format, or a report (HTML)
    #[arg(value_name = "A")]
    first: PathBuf,
    /// Another one, for pictures of the same size
    #[arg(value_name = "B")]
    second: PathBuf,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
    /// Write the maps as one page
    #[arg(long, value_name = "FILE.html")]
    html: Option<PathBuf>,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Answer<'a> {
    version: &'static str,
    files: [String; 2],
    #[serde(flatten)]
    comparison: &'a Comparison,
}

pub(super) fn run(args: &Args) -> Result<ExitCode> {
    let inputs = [args.first.as_path(), args.second.as_path()];
    if let Some(path) = &args.html {
        files::may_write(path, inputs)?;
    }
    let [first, second] = [read(inputs[0])?, read(inputs[1])?];
    let comparison = compare::compare(&Side::from(&first), &Side::from(&second))?;
    let files = inputs.map(|p| p.display().to_string());
    if args.json {
        print(&json::text(&Answer {
            version: env!("CARGO_PKG_VERSION"),
            files: files.clone(),
            comparison: &comparison,
        }))?;
    } else {
        print(&words(&files, [&first, &second], &comparison))?;
    }
    if let Some(path) = &args.html {
        store::write(path, compare::page([&files[0], &files[1]], &comparison).as_bytes())?;
        say(&format!("wrote {} (the comparison as one page)", path.display()));
    }
    Ok(if comparison.verdict == Verdict::Differ { ExitCode::from(NO_RESULT) } else { ExitCode::SUCCESS })
}

/// Reads a camera file, and says what reading told.
pub(super) fn read(path: &Path) -> Result<CameraFile> {
    let file = files::camera(path)?;
    file.notes.iter().for_each(|note| say(&format!("note: {note}")));
    Ok(file)
}

fn words(names: &[String; 2], read: [&CameraFile; 2], c: &Comparison) -> String {
    let mut out = format!("{}\n\n", c.sentence());
    for ((which, name), file) in ["A", "B"].iter().zip(names).zip(read) {
        let [w, h] = file.camera.size_px;
        let sigma = if file.evidence.covariance.is_some() { "" } else { ", without σ" };
        let map = if file.evidence.residual.is_some() { ", with its residual map" } else { "" };
        let _ = writeln!(
            out,
            "{which}  {name} ({}, {}, {w} x {h} px{map}{sigma})",
            file.format,
            file.camera.spec().title
        );
    }
    out += "\nDifference, px     mean     RMS  largest\n";
    for (name, f) in [("middle half", c.middle), ("whole picture", c.whole), ("four corners", c.corners)] {
        let [mean, rms, max] = [f.mean_px, f.rms_px, f.max_px].map(|v| significant(v, 3));
        let _ = writeln!(out, "  {name:<13} {mean:>7} {rms:>7}  {max:>7}");
    }
    if let Some(chance) = &c.chance {
        let [moved, expected, limit] =
            [chance.moved_px, chance.expected_px, chance.limit_px].map(|v| significant(v, 2));
        let _ = writeln!(
            out,
            "  weighted by certainty {moved} px; chance makes {expected} on average, {limit} in one of a hundred cases ({})",
            chance.words()
        );
    }
    out += "\n";
    for p in &c.parameters {
        let _ = writeln!(out, "{}", parameter(p));
    }
    out
}

fn parameter(p: &Parameter) -> String {
    let shown = |i: usize| match p.sigma[i] {
        Some(sigma) if sigma > 0.0 => with_sigma(p.values[i], sigma).join(" ± "),
        Some(_) => format!("{} fixed", p.values[i]),
        None => format!("{}", p.values[i]),
    };
    let in_sigma = p.in_sigma.map_or(String::new(), |s| format!("{s:+.1} σ"));
    format!("  {:<5} {:>24} {:>24}  {in_sigma:>8}", p.name, shown(0), shown(1))
}
