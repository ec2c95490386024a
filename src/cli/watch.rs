//! `straightedge watch`: calibrations of one camera as a dated series.

use std::{
    fmt::Write as _,
    path::{Path, PathBuf},
    process::ExitCode,
};

use serde::Serialize;

use super::{NO_RESULT, compare::read, files, print, say};
use crate::{
    calib::{
        Error, Result,
        compare::{Member, Series, Side, date},
        json,
    },
    job::store,
};

/// Put calibrations of one camera into the order of their dates, and tell whether it has changed since the first
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Camera files of any format or reports (HTML); dates are those of the pictures or in the file, else when the file was written
    #[arg(value_name = "FILES", required = true)]
    paths: Vec<PathBuf>,
    /// Their dates instead, one for each file: 2026-05-01,2026-06-01
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = day)]
    dates: Vec<f64>,
    /// How warm the camera was, °C, one for each file: 20,25.5,31
    #[arg(long, value_name = "LIST", value_delimiter = ',', allow_hyphen_values = true)]
    temperature: Vec<f64>,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
    /// Write table and figures as one page
    #[arg(long, value_name = "FILE.html")]
    html: Option<PathBuf>,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Answer<'a> {
    version: &'static str,
    sentence: String,
    #[serde(flatten)]
    series: &'a Series,
}

fn day(text: &str) -> Result<f64> {
    date::days(text).ok_or_else(|| {
        Error::Invalid(format!("\"{text}\" is not a date: write year-month-day, for example 2026-05-01"))
    })
}

pub(super) fn run(args: &Args) -> Result<ExitCode> {
    if let Some(path) = &args.html {
        files::may_write(path, args.paths.iter().map(PathBuf::as_path))?;
    }
    for (name, n) in [("--dates", args.dates.len()), ("--temperature", args.temperature.len())] {
        if n > 0 && n != args.paths.len() {
            return Err(Error::Invalid(format!(
                "{name} has {n} values for {} files: give one for each",
                args.paths.len()
            )));
        }
    }
    let member = |(i, path): (usize, &PathBuf)| -> Result<Member> {
        let file = read(path)?;
        let own = file.evidence.date.as_deref().and_then(date::days);
        let days = args.dates.get(i).copied().or(own).or_else(|| written(path));
        Ok(Member {
            file: path.display().to_string(),
            side: Side::from(&file),
            days,
            temperature: args.temperature.get(i).copied(),
        })
    };
    let members = args.paths.iter().enumerate().map(member).collect::<Result<Vec<_>>>()?;
    let series = Series::new(members)?;
    if args.json {
        print(&json::text(&Answer {
            version: env!("CARGO_PKG_VERSION"),
            sentence: series.sentence(),
            series: &series,
        }))?;
    } else {
        print(&words(&series))?;
    }
    if let Some(path) = &args.html {
        store::write(path, series.page().as_bytes())?;
        say(&format!("wrote {} (the series as one page)", path.display()));
    }
    Ok(if series.recalibrate { ExitCode::from(NO_RESULT) } else { ExitCode::SUCCESS })
}

/// When a file was written, days since 1970.
fn written(path: &Path) -> Option<f64> {
    let days = store::written(path)?;
    say(&format!(
        "note: {} does not say when it was calibrated: it was written on {}",
        path.display(),
        date::iso(days)
    ));
    Some(days)
}

fn words(series: &Series) -> String {
    let mut out = format!("{}\n\n", series.sentence());
    let wide = series.entries.iter().map(|e| e.file.chars().count()).max().unwrap_or(0).max(11);
    let _ = writeln!(
        out,
        "  {:wide$}  date           °C  {:>18}  {:>16}  {:>16}  differs px  by chance",
        "calibration", "focal length px", "cx px", "cy px"
    );
    for e in &series.entries {
        let [date, warm, focal, cx, cy, moved, limit] = e.cells();
        let line = format!(
            "  {:wide$}  {date:10}  {warm:>5}  {focal:>18}  {cx:>16}  {cy:>16}  {moved:>10}  {limit:>9}  {}",
            e.file,
            e.word()
        );
        let _ = writeln!(out, "{}", line.trim_end());
    }
    for (what, unit, trend) in [
        ("over time", "day", series.focal_by_day),
        ("over the temperature", "°C", series.focal_by_temperature),
    ] {
        let Some(t) = trend else { continue };
        let _ = writeln!(
            out,
            "Focal length {what}: {:+.3} px per {unit} ({:+.3} to {:+.3}){}",
            t.slope,
            t.slope_ci95[0],
            t.slope_ci95[1],
            if t.is_significant() { "" } else { ", which is no more than chance" }
        );
    }
    out
}
