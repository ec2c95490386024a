//! Tables of the page.

use std::fmt::Write as _;

use nalgebra::DMatrix;

use super::text::escape;
use crate::calib::{
    calibrate::Comparison,
    diagnose::{self, sources::Sources},
    influence::Role,
    number::{degrees, percent, significant, with_sigma},
    report::{FrameReport, Report, Solution},
    target::Target,
};

/// Rows of name and value.
fn pairs(rows: &[(&str, String)]) -> String {
    let rows: Vec<String> = rows
        .iter()
        .map(|(name, value)| format!("<tr><th>{name}</th><td>{}</td></tr>\n", escape(value)))
        .collect();
    format!("<table><tbody>\n{}</tbody></table>\n", rows.concat())
}

/// What is behind the verdict, the worst first.
pub(super) fn findings(report: &Report) -> String {
    let list = diagnose::findings(report);
    if list.is_empty() {
        return String::new();
    }
    let mut out = "<ul class=\"findings\">\n".to_owned();
    for f in &list {
        let _ = writeln!(
            out,
            "<li class=\"{}\"><strong>{}.</strong> {} <code class=\"muted\">{}</code></li>",
            super::tone(f.level),
            escape(f.title.trim_end_matches('.')),
            escape(&f.text),
            escape(&f.code)
        );
    }
    out + "</ul>\n"
}

/// What to photograph next.
pub(super) fn advice(report: &Report) -> String {
    let Some(advice) = &report.advice else { return String::new() };
    format!(
        "<p><b>Next:</b> {} <span class=\"muted\">{}</span></p>\n",
        escape(&advice.sentence),
        escape(&advice.promise)
    )
}

/// Parameters with σ, and beside the truth where it is known.
pub(super) fn camera(solution: &Solution) -> String {
    let known = !solution.truth.is_empty();
    let mut out =
        "<table><thead><tr><th></th><th>value</th><th>± σ</th><th></th><th class=\"n\">σ relative</th>"
            .to_owned();
    if known {
        out += "<th class=\"n\">truth</th><th class=\"n\">difference</th><th class=\"n\">relative</th><th class=\"n\">in σ</th>";
    }
    out += "</tr></thead><tbody>\n";
    let camera = &solution.camera;
    let shown = camera.spec().params.iter().zip(&camera.params).map(|(param, value)| {
        let sigma = solution.sigma.get(param.name).copied().flatten();
        sigma.map_or_else(|| [value.to_string(), "fixed".to_owned()], |sigma| with_sigma(*value, sigma))
    });
    let (values, sigmas): (Vec<String>, Vec<String>) = shown.map(|[value, sigma]| (value, sigma)).unzip();
    let (values, sigmas) = (point_below_point(&values), point_below_point(&sigmas));
    for (i, (param, value)) in camera.spec().params.iter().zip(&camera.params).enumerate() {
        let (value_text, sigma_text) = (&values[i], &sigmas[i]);
        let sigma = solution.sigma.get(param.name).copied().flatten();
        let relative = sigma
            .filter(|_| *value != 0.0)
            .map_or(String::new(), |s| format!("{} %", significant(100.0 * s / value.abs(), 2)));
        let _ = write!(
            out,
            "<tr><th>{}</th><td>{value_text}</td><td>{sigma_text}</td><td>{}</td><td class=\"n\">{relative}</td>",
            param.name, param.unit
        );
        if let Some(c) = solution.truth.iter().find(|c| c.name == param.name) {
            let relative = c.relative.map_or(String::new(), |r| format!("{} %", significant(100.0 * r, 2)));
            let in_sigma = c.in_sigma.map_or(String::new(), |s| format!("{s:.1}"));
            let _ = write!(
                out,
                "<td class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"n\">{relative}</td><td class=\"n\">{in_sigma}</td>",
                c.truth,
                significant(c.absolute, 2)
            );
        }
        out += "</tr>\n";
    }
    out + "</tbody></table>\n"
}

/// Numbers with blanks as wide as a digit before them, so that their points stand in one column.
fn point_below_point(numbers: &[String]) -> Vec<String> {
    let before = |text: &String| text.find(['.', 'f']).unwrap_or(text.len());
    let room = numbers.iter().map(before).max().unwrap_or(0);
    numbers.iter().map(|text| format!("{}{text}", "\u{2007}".repeat(room - before(text)))).collect()
}

pub(super) fn certainty(report: &Report, solution: &Solution) -> String {
    let px = |v: Option<f64>| v.map_or("unknown".to_owned(), |v| format!("{} px", significant(v, 2)));
    let u = &solution.uncertainty;
    let mut rows = vec![(
        "Certainty of the projection",
        format!(
            "{} in the middle, {} in the worst corner (1 σ{})",
            px(u.center_px),
            px(u.worst_corner_px),
            u.range.map_or(String::new(), |r| format!(
                ", at {} {}",
                significant(r, 3),
                report.settings.unit.name()
            ))
        ),
    )];
    if let Some(far) = &solution.uncertainty_far {
        let text = format!(
            "{} in the middle, {} in the worst corner (1 σ)",
            px(far.center_px),
            px(far.worst_corner_px)
        );
        rows.push(("The same of points far away", text));
    }
    if let Some(region) = &solution.safe_region {
        rows.push(("Safe region", region.words()));
    }
    if let Some(map) = &solution.residual_map {
        rows.push(("Residual map", map.to_string()));
    }
    if let Some(t) = &solution.truth_corners {
        rows.push((
            "Corners against truth",
            format!(
                "rms {} px, p95 {} px, largest {} px",
                significant(t.rms, 3),
                significant(t.p95, 3),
                significant(t.max, 3)
            ),
        ));
    }
    pairs(&rows)
}

pub(super) fn errors(report: &Report, solution: &Solution) -> String {
    let s = &solution.stats;
    let outliers: usize = report.included().map(|f| f.outliers.len()).sum();
    let px = |v: f64| format!("{} px", significant(v, 4));
    let left = pairs(&[
        ("RMS", px(solution.rms_px)),
        ("RMS per coordinate", px(solution.rms_per_coordinate_px)),
        ("RMS without outliers", px(solution.rms_inliers_px)),
        ("σ of a coordinate", px(solution.sigma0_px)),
        ("Corners, outliers", format!("{}, {outliers}", s.n)),
    ]);
    let right = pairs(&[
        ("Mean", px(s.mean)),
        ("Median", px(s.median)),
        ("95th percentile", px(s.p95)),
        ("Largest, smallest", format!("{}, {}", px(s.max), px(s.min))),
        ("Standard deviation", px(s.std)),
    ]);
    format!("<div class=\"side\"><div>{left}</div><div>{right}</div></div>\n")
}

pub(super) fn coverage(solution: &Solution) -> String {
    let c = &solution.coverage;
    format!(
        "<p>Corners span {} of the width and {} of the height; their hull is {} of the picture, and {:.0} of 100 cells hold one.</p>\n",
        percent(c.width_fraction),
        percent(c.height_fraction),
        percent(c.hull_fraction),
        100.0 * c.cells_fraction
    )
}

pub(super) fn pictures(report: &Report) -> String {
    let unit = escape(report.settings.unit.name());
    let mut out = format!(
        "<div class=\"wide\"><table><thead><tr><th></th><th>picture</th><th>board</th><th class=\"n\">corners</th><th class=\"n\">outliers</th>\
         <th class=\"n\">RMS, px</th><th class=\"n\">max, px</th><th class=\"n\">moves, px</th><th class=\"n\">tilt, °</th><th class=\"n\">roll, °</th>\
         <th class=\"n\">distance, {unit}</th><th></th></tr></thead><tbody>\n"
    );
    let worst = report.included().filter_map(|f| f.rms_px).fold(0.0, f64::max);
    let mut number = 0;
    for f in &report.frames {
        number += u32::from(f.included);
        out += &picture(f, number, worst);
    }
    out + "</tbody></table></div>\n"
}

fn picture(f: &FrameReport, number: u32, worst: f64) -> String {
    let shown = |v: Option<f64>, how: &dyn Fn(f64) -> String| v.map_or(String::new(), how);
    let share = f.rms_px.filter(|_| worst > 0.0).map_or(0.0, |v| 100.0 * v / worst);
    let count = |n: usize| if n == 0 { String::new() } else { n.to_string() };
    let role = f.influence.filter(|i| i.role != Role::Fine).map_or("", |i| i.role.name());
    let words: Vec<&str> = [f.why.as_str(), role]
        .into_iter()
        .chain(f.notes.iter().map(String::as_str))
        .filter(|t| !t.is_empty())
        .collect();
    let order = if f.order_is_a_choice { " *" } else { "" };
    format!(
        "<tr{}><td class=\"n\">{}</td><td title=\"{}\">{}</td><td>{}{order}</td><td class=\"n\">{}</td><td class=\"n\">{}</td>\
         <td class=\"n bar\" style=\"--share:{share:.0}%\">{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td>\
         <td class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"why\">{}</td></tr>\n",
        if f.included { "" } else { " class=\"out\"" },
        if f.included { number.to_string() } else { String::new() },
        escape(&f.file),
        escape(f.name()),
        f.state.name(),
        count(f.corners.len()),
        count(f.outliers.len()),
        shown(f.rms_px, &|v| significant(v, 3)),
        shown(f.max_px, &|v| significant(v, 3)),
        shown(f.influence.map(|i| i.moves_px), &|v| significant(v, 2)),
        shown(f.tilt_rad, &degrees),
        shown(f.roll_rad, &degrees),
        shown(f.distance, &|v| significant(v, 4)),
        escape(&words.join("; "))
    )
}

pub(super) fn groups(report: &Report) -> String {
    let mut out = "<table><thead><tr><th>camera</th><th class=\"n\">pictures</th><th class=\"n\">with a board</th><th></th></tr></thead><tbody>\n".to_owned();
    for g in &report.groups {
        let _ = writeln!(
            out,
            "<tr><td>{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"why\">{}</td></tr>",
            escape(&g.name),
            g.images,
            g.found,
            if g.reason.is_empty() { "calibrated here".to_owned() } else { escape(&g.reason) }
        );
    }
    out + "</tbody></table>\n"
}

/// What the calibration may err by, the document's rules, and every fault that was tried.
pub(super) fn sources(sources: &Sources) -> String {
    let mut out = format!(
        "<p class=\"muted\">px of the projection map, RMS over the nine tenths of the picture that are known best; certain to {} px there.</p>\n\
         <table><thead><tr><th>source</th><th class=\"n\">px</th><th></th><th>what helps</th></tr></thead><tbody>\n",
        significant(sources.map_px, 2)
    );
    for card in &sources.cards {
        let _ = writeln!(
            out,
            "<tr><td>{}</td><td class=\"n\">{}</td><td class=\"why\">{}</td><td class=\"why\">{}</td></tr>",
            escape(&card.title),
            significant(card.px, 2),
            escape(&card.text),
            escape(&card.advice)
        );
    }
    out += "</tbody></table>\n";
    if let Some(words) = sources.cross_words() {
        let _ = writeln!(out, "<p>{}.</p>", escape(&words));
    }
    out += "<h3>Rules of thumb</h3>\n<table><tbody>\n";
    for rule in &sources.rules {
        let _ = writeln!(
            out,
            "<tr><td>{}</td><td class=\"n\">{}</td><td>{}</td></tr>",
            escape(&rule.text),
            escape(&rule.value),
            rule.word()
        );
    }
    out += "</tbody></table>\n<h3>Faults that were tried</h3>\n<table><thead><tr><th>fault</th><th>size</th><th class=\"n\">unknowns</th>\
            <th class=\"n\">fall of the squares, in noise</th><th class=\"n\">moves, px</th><th></th></tr></thead><tbody>\n";
    for f in &sources.faults {
        let _ = writeln!(
            out,
            "<tr><td>{}</td><td>{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td><td>{}</td></tr>",
            escape(&f.title),
            escape(&f.size),
            f.unknowns,
            significant(f.gain, 3),
            significant(f.moves_px, 2),
            if f.found { "found" } else { "no more than chance" }
        );
    }
    out + "</tbody></table>\n"
}

pub(super) fn models(comparison: &Comparison) -> String {
    let mut out = "<table><thead><tr><th>model</th><th class=\"n\">free</th><th class=\"n\">fit px</th><th class=\"n\">new pictures px</th>\
                   <th class=\"n\">worst corner ± px</th><th></th></tr></thead><tbody>\n"
        .to_owned();
    let px = |v: Option<f64>| v.map_or("–".to_owned(), |v| significant(v, 3));
    for c in &comparison.candidates {
        let [fit, new, corner] = [Some(c.rms_px), c.held_out_px, c.worst_corner_px].map(px);
        let _ = writeln!(
            out,
            "<tr><td>{}</td><td class=\"n\">{}</td><td class=\"n\">{fit}</td><td class=\"n\">{new}</td><td class=\"n\">{corner}</td>\
             <td class=\"why\">{}</td></tr>",
            escape(c.model.spec().title),
            c.free,
            escape(&c.note(comparison.recommended))
        );
    }
    let about = "RMS of the fit to all pictures and in pictures left out of the fit; 1σ of the projection in the worst corner of the picture.";
    let splined = comparison.splined.as_ref().map(|s| format!("<p>{}.</p>\n", escape(&s.words())));
    format!(
        "{out}</tbody></table>\n<p class=\"muted\">{about}</p>\n<p>{}</p>\n{}",
        escape(&comparison.why),
        splined.unwrap_or_default()
    )
}

pub(super) fn covariance(solution: &Solution) -> String {
    let names: Vec<&str> = solution.sigma.iter().map(|(name, _)| name).collect();
    let params = solution.camera.spec().params.iter();
    let with_units: Vec<String> =
        params.map(|p| format!("{} {}", p.name, p.unit).trim().to_owned()).collect();
    let c = &solution.covariance;
    let correlation =
        DMatrix::from_fn(c.nrows(), c.ncols(), |i, j| c[(i, j)] / (c[(i, i)] * c[(j, j)]).sqrt());
    let plain =
        matrix(&names, c, &|v| (if v == 0.0 { "0".to_owned() } else { format!("{v:.3e}") }, String::new()));
    let coloured = matrix(&names, &correlation, &|v| {
        if v.is_finite() {
            let color = if v < 0.0 { "208,47,47" } else { "44,111,173" };
            (format!("{v:.3}"), format!(" style=\"background:rgba({color},{:.2})\"", 0.6 * v.abs().min(1.0)))
        } else {
            ("fixed".to_owned(), String::new())
        }
    });
    format!(
        "<h3>Correlation</h3>\n{coloured}<h3>Covariance</h3>\n<p class=\"muted\">In this order: {}; units are the products of the parameters' units. \
         The uncertainty of all poses is in it (marginalised); zero where a parameter was fixed.</p>\n{plain}",
        escape(&with_units.join(", "))
    )
}

fn matrix(names: &[&str], m: &DMatrix<f64>, cell: &dyn Fn(f64) -> (String, String)) -> String {
    let head: Vec<String> = names.iter().map(|n| format!("<th>{}</th>", escape(n))).collect();
    let mut out = format!(
        "<div class=\"wide\"><table class=\"matrix\"><thead><tr><th></th>{}</tr></thead><tbody>\n",
        head.concat()
    );
    for (i, name) in names.iter().enumerate().take(m.nrows()) {
        let _ = write!(out, "<tr><th>{}</th>", escape(name));
        for j in 0..m.ncols() {
            let (text, style) = cell(m[(i, j)]);
            let _ = write!(out, "<td{style}>{text}</td>");
        }
        out += "</tr>\n";
    }
    out + "</tbody></table></div>\n"
}

pub(super) fn convergence(solution: &Solution) -> String {
    let px = |v: Option<f64>| v.map_or("none".to_owned(), |v| format!("{} px", significant(v, 4)));
    let mut out = format!(
        "<p>Zhang's closed form reached {}; the refinement stopped after {} steps: <code>{}</code>. {} of {} starts agree.</p>\n",
        px(solution.closed_form.rms_px),
        solution.iterations,
        escape(&serde_json::to_string(&solution.termination).unwrap_or_default().replace('"', "")),
        solution.starts.agreeing,
        solution.starts.tried
    );
    out += "<div class=\"side\"><div><table><thead><tr><th>start</th><th class=\"n\">focal length, px</th><th class=\"n\">RMS reached</th></tr></thead><tbody>\n";
    for s in &solution.starts.list {
        let _ = writeln!(
            out,
            "<tr><td>{}</td><td class=\"n\">{:.1}</td><td class=\"n\">{}</td></tr>",
            escape(&s.name),
            s.focal_px,
            px(s.rms_px)
        );
    }
    out += "</tbody></table></div>\n<div><table><thead><tr><th class=\"n\">step</th><th class=\"n\">RMS, px</th><th class=\"n\">cost</th><th class=\"n\">damping</th><th></th></tr></thead><tbody>\n";
    for (i, s) in solution.steps.iter().enumerate() {
        let _ = writeln!(
            out,
            "<tr><td class=\"n\">{}</td><td class=\"n\">{:.6}</td><td class=\"n\">{:.6e}</td><td class=\"n\">{:.1e}</td><td>{}</td></tr>",
            i + 1,
            s.rms_px,
            s.cost,
            s.damping,
            if s.accepted { "" } else { "rejected" }
        );
    }
    out + "</tbody></table></div></div>\n"
}

pub(super) fn settings(report: &Report) -> String {
    let s = &report.settings;
    let yes = |b: bool| if b { "yes" } else { "no" }.to_owned();
    let word = |v: serde_json::Result<String>| v.unwrap_or_default().replace('"', "");
    let board = match &s.target {
        Some(target) => target.words(),
        None => s.board.map_or("not known".to_owned(), |b| b.to_string()),
    };
    let fixed = s.fixed.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ");
    let or_none = |t: &Option<String>| t.clone().unwrap_or_else(|| "none".to_owned());
    let left = pairs(&[
        (
            "Board, inner corners",
            format!("{board}{}", if s.board_is_found { ", found from the pictures" } else { "" }),
        ),
        match s.target {
            Some(Target::Points { .. }) => ("Unit", s.unit.name().to_owned()),
            _ => ("Square", format!("{} {}", s.square, s.unit.name())),
        },
        ("Pictures", s.images.to_string()),
        ("Camera model", s.model.spec().title.to_owned()),
        ("Fixed", if fixed.is_empty() { "nothing".to_owned() } else { fixed }),
        ("Start", or_none(&s.start)),
        ("Corner file", or_none(&s.corners)),
        ("Truth file", or_none(&s.truth)),
    ]);
    let t = &report.timing_ms;
    let right = pairs(&[
        ("Loss", word(serde_json::to_string(&s.loss))),
        ("Weights", word(serde_json::to_string(&s.weights))),
        ("Refinement of corners", s.refinement.to_string()),
        ("Smoothing before", format!("{} px", s.presmooth_px)),
        ("Solver", s.solver.clone()),
        ("Most steps", s.max_iterations.to_string()),
        ("Several starts", yes(s.multi_start)),
        ("Normalised points", yes(s.normalise)),
        ("Robust homographies", yes(s.ransac)),
        ("Precision", word(serde_json::to_string(&s.precision))),
        (
            "Time",
            format!(
                "{:.2} s; reading {:.2} s and detection {:.2} s summed over the pictures, calibration {:.2} s",
                t.total / 1e3,
                t.read / 1e3,
                t.detect / 1e3,
                t.calibrate / 1e3
            ),
        ),
    ]);
    format!("<div class=\"side\"><div>{left}</div><div>{right}</div></div>\n")
}
