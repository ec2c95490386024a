//! The evidence for people: one verdict, then the numbers, worst first where something is wrong.

mod pictures;
mod table;

use std::fmt::Write as _;

use crate::calib::{
    camera::Model,
    diagnose::{self, Finding, Level, SHOWN},
    number::{counted, percent, significant, with_sigma},
    report::{Report, Solution},
    uncertainty::Uncertainty,
};
use table::sentence;
pub(super) use table::{Table, paragraph};

/// The evidence of a calibration, or what is known where there is none.
pub(super) fn evidence(report: &Report) -> String {
    let mut out = String::new();
    let mut findings = diagnose::findings(report);
    // What is wrong with a set without a camera is said as an error.
    findings.retain(|f| report.error.as_ref().is_none_or(|e| e.code != f.code));
    if let Some(solution) = &report.solution {
        out += &sentence(&diagnose::summary(report).1);
        out += &sentence(&diagnose::verdict(report).rms_words());
        out += &advice(report);
        out += &list(&findings.drain(..SHOWN.min(findings.len())).collect::<Vec<_>>());
        out += &camera(report, solution);
        out += &certainty(report, solution);
        out += &errors(report, solution);
    }
    out += &models(report);
    out += &sources(report);
    out += &pictures::table(report);
    if report.solution.is_none() {
        out += &advice(report);
    }
    out += &list(&findings);
    out.trim_start_matches('\n').to_owned()
}

/// What was found in pictures.
pub(super) fn detection(report: &Report) -> String {
    let found = report.frames.iter().filter(|f| f.found).count();
    let corners: usize = report.frames.iter().map(|f| f.corners.len()).sum();
    let board = report.settings.board_words().unwrap_or_else(|| "board".to_owned());
    let mut out = format!(
        "{} found in {found} of {}, {}\n",
        capital(&board),
        counted(report.frames.len(), "picture"),
        counted(corners, "corner")
    );
    out += &pictures::table(report);
    out += &warnings(report);
    out
}

/// Parameters with σ, beside the truth where it is known.
fn camera(report: &Report, solution: &Solution) -> String {
    let camera = &solution.camera;
    let [w, h] = camera.size_px;
    let mut out = format!("\nCamera: {}, {w} x {h} px", camera.spec().title);
    if !report.settings.fixed.is_empty() {
        let fixed: Vec<String> = report.settings.fixed.iter().map(ToString::to_string).collect();
        let _ = write!(out, ", fixed: {}", fixed.join(", "));
    }
    out.push('\n');
    let known = !solution.truth.is_empty();
    let mut table = Table::new(if known { "llllrrrr" } else { "llll" });
    let mut values = Vec::new();
    for (param, value) in camera.spec().params.iter().zip(&camera.params) {
        let sigma = solution.sigma.get(param.name).copied().flatten();
        let [value, sigma] = match sigma {
            Some(sigma) => with_sigma(*value, sigma),
            None => [short(*value), "fixed".to_owned()],
        };
        values.push((param, value, sigma));
    }
    // Values stand with their points in one column.
    let before = |text: &str| text.find('.').unwrap_or(text.len());
    let room = values.iter().map(|v| before(&v.1)).max().unwrap_or(0);
    if known {
        table.row(["", "", "", "", "truth", "difference", "relative", "in σ"]);
    }
    for (param, value, sigma) in values {
        let sigma = if sigma == "fixed" { sigma } else { format!("± {sigma}") };
        let value = format!("{}{value}", " ".repeat(room - before(&value)));
        let mut row = vec![param.name.to_owned(), value, sigma, param.unit.to_owned()];
        if let Some(c) = solution.truth.iter().find(|c| c.name == param.name) {
            row.push(c.truth.to_string());
            row.push(significant(c.absolute, 2));
            row.push(c.relative.map_or(String::new(), |r| format!("{} %", significant(100.0 * r, 2))));
            row.push(c.in_sigma.map_or(String::new(), |s| format!("{s:.1}")));
        }
        table.row(row);
    }
    out + &table.render()
}

/// A value that was given: at most nine significant digits.
fn short(value: f64) -> String {
    format!("{value:.8e}").parse().unwrap_or(value).to_string()
}

/// How sure the projection is, how the corners cover the picture, and how the solution was reached.
fn certainty(report: &Report, solution: &Solution) -> String {
    let mut table = Table::new("ll");
    let u = &solution.uncertainty;
    let px = |v: Option<f64>| v.map_or("unknown".to_owned(), |v| format!("{} px", significant(v, 2)));
    let certain = |u: &Uncertainty, of: &str| {
        format!(
            "{} in the middle, {} over 90 % of the picture, {} in the worst corner{of}",
            px(u.center_px),
            px(u.over_share(0.9)),
            px(u.worst_corner_px)
        )
    };
    table.row(["Projection certain to".to_owned(), certain(u, ", at the boards' distance")]);
    if let Some(far) = &solution.uncertainty_far {
        table.row([String::new(), certain(far, ", far away")]);
    }
    let c = &solution.coverage;
    table.row([
        "Coverage by corners".to_owned(),
        format!(
            "{} of the width, {} of the height, {} of the area; {:.0} of 100 cells",
            percent(c.width_fraction),
            percent(c.height_fraction),
            percent(c.hull_fraction),
            100.0 * c.cells_fraction
        ),
    ]);
    if let Some(region) = &solution.safe_region {
        table.row(["Safe region".to_owned(), region.words()]);
    }
    if let Some(map) = &solution.residual_map {
        table.row(["Residual map".to_owned(), map.to_string()]);
    }
    let starts = &solution.starts;
    let from = solution
        .closed_form
        .rms_px
        .map_or(String::new(), |v| format!("closed form {} px, then ", significant(v, 3)));
    table.row([
        "Solution".to_owned(),
        format!(
            "{from}{} steps to {} px; {} of {} starts agree",
            solution.iterations,
            significant(solution.rms_px, 3),
            starts.agreeing,
            starts.tried
        ),
    ]);
    if let Some(t) = solution.trends.rms_by_tilt_rad {
        let per_10_degrees = t.slope * 10f64.to_radians();
        let says = if t.is_significant() { "" } else { ", which is no more than chance" };
        table.row([
            "Error against tilt".to_owned(),
            format!("{per_10_degrees:+.3} px for 10° more{says} (r = {:.2})", t.correlation),
        ]);
    }
    if let Some(t) = &solution.truth_corners {
        table.row([
            "Corners against truth".to_owned(),
            format!(
                "rms {} px, p95 {} px, largest {} px",
                significant(t.rms, 2),
                significant(t.p95, 2),
                significant(t.max, 2)
            ),
        ]);
    }
    let t = &report.timing_ms;
    if t.total > 0.0 {
        table.row([
            "Time".to_owned(),
            format!("{:.2} s, of it calibration {:.2} s", t.total / 1e3, t.calibrate / 1e3),
        ]);
    }
    format!("\n{}", table.render())
}

/// The source document's Table IV.
fn errors(report: &Report, solution: &Solution) -> String {
    let s = &solution.stats;
    let outliers: usize = report.included().map(|f| f.outliers.len()).sum();
    let mut out = format!("\nErrors of {}, px", counted(s.n, "corner"));
    if outliers > 0 {
        let rms = significant(solution.rms_inliers_px, 3);
        let (are, word) = if outliers == 1 { ("is an", "outlier") } else { ("are", "outliers") };
        let _ = write!(out, " ({outliers} {are} {word}; RMS without: {rms})");
    }
    out.push('\n');
    let mut table = Table::new("rrrrrrrr");
    table.row(["rms", "mean", "median", "p95", "max", "min", "std", "rms per coordinate"]);
    let all = [s.rms, s.mean, s.median, s.p95, s.max, s.min, s.std, solution.rms_per_coordinate_px];
    table.row(all.map(|v| significant(v, 3)));
    out + &table.render()
}

/// The camera models side by side, where they were compared.
fn models(report: &Report) -> String {
    let Some(comparison) = &report.models else { return String::new() };
    let mut table = Table::new("lrrrrl");
    table.row(["", "free", "fit px", "new px", "corner ± px", ""]);
    let px = |v: Option<f64>| v.map_or("-".to_owned(), |v| significant(v, 3));
    for c in &comparison.candidates {
        let [fit, new, corner] = [Some(c.rms_px), c.held_out_px, c.worst_corner_px].map(px);
        table.row([
            c.model.to_string(),
            c.free.to_string(),
            fit,
            new,
            corner,
            c.note(comparison.recommended),
        ]);
    }
    let head = "\nCamera models: RMS of the fit and in pictures left out of it, 1σ in the worst corner of the picture\n";
    let splined = comparison.splined.as_ref().map(|s| paragraph(" ", &s.words())).unwrap_or_default();
    format!("{head}{}{}{splined}", table.render(), paragraph(" ", &comparison.why))
}

/// The sources of error, the most costly first.
fn sources(report: &Report) -> String {
    let Some(sources) = &report.sources else { return String::new() };
    let mut table = Table::new("lrl");
    // What does not matter is named, no more.
    let (costly, cheap): (Vec<_>, Vec<_>) = sources.cards.iter().partition(|c| c.level > Level::Good);
    for card in costly {
        table.row([card.title.clone(), card.cost(), card.text.clone()]);
    }
    if !cheap.is_empty() {
        let names: Vec<String> =
            cheap.iter().map(|c| format!("{} {}", c.title.to_lowercase(), c.cost())).collect();
        table.row(["Little".to_owned(), String::new(), format!("{}.", capital(&names.join("; ")))]);
    }
    let mut out = format!(
        "\nSources of error, px of the projection over 90 % of the picture (certain to {})\n{}",
        significant(sources.map_px, 2),
        table.render()
    );
    if let Some(words) = sources.cross_words() {
        out += &paragraph(" ", &format!("{words}."));
    }
    let broken: Vec<String> = sources
        .rules
        .iter()
        .filter(|r| !r.kept)
        .map(|r| format!("{} ({}): {}", r.text, r.value, r.word()))
        .collect();
    if !broken.is_empty() {
        out += &paragraph(" ", &format!("Rules of thumb. {}.", broken.join("; ")));
    }
    out
}

/// What to photograph next.
fn advice(report: &Report) -> String {
    let Some(advice) = &report.advice else { return String::new() };
    format!("\n{}", paragraph("Next", &format!("{} {}", advice.sentence, advice.promise)))
}

/// Findings, what is serious behind an exclamation mark.
fn list(findings: &[Finding]) -> String {
    let one = |f: &Finding| {
        let mark = if f.level > Level::Info { "!" } else { "i" };
        paragraph(mark, &format!("{}. {}", f.title, f.text))
    };
    let lines: String = findings.iter().map(one).collect();
    if lines.is_empty() { lines } else { format!("\n{lines}") }
}

fn warnings(report: &Report) -> String {
    let lines: String = report.warnings.iter().map(|w| paragraph("!", &capital(&w.words()))).collect();
    if lines.is_empty() { lines } else { format!("\n{lines}") }
}

/// The text as a sentence begins; names of parameters stay as they are.
fn capital(text: &str) -> String {
    let first = text.split([' ', ',']).next().unwrap_or_default();
    // A file name stays as it is.
    let is_file = first.contains(['/', '\\']) || first.trim_end_matches(':').contains('.');
    if is_file || Model::ALL.iter().any(|m| m.spec().index(first).is_some()) {
        return text.to_owned();
    }
    let mut chars = text.chars();
    chars.next().map_or_else(String::new, |c| c.to_uppercase().chain(chars).collect())
}
