//! The document's tables, with its figures beside the measured ones, and a table as Markdown.

use super::{
    ablate::Effect,
    claims::Judged,
    document,
    evidence::{COLUMNS, EXACT, EXACT_ITS, Evidence},
};
use crate::calib::{Result, stats};

/// Rows of text under a header.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Table {
    /// What it shows.
    pub title: String,
    /// Names of the columns.
    pub header: Vec<String>,
    /// As long as the header, each.
    pub rows: Vec<Vec<String>>,
}

impl Table {
    fn new(title: &str, header: &[&str]) -> Self {
        let header = header.iter().map(|&h| h.to_owned()).collect();
        Self { title: title.to_owned(), header, rows: Vec::new() }
    }

    fn with_columns(title: &str, first: &[&str]) -> Self {
        Self::new(title, &[first, &COLUMNS].concat())
    }

    /// As Markdown, without the title.
    pub fn markdown(&self) -> String {
        let line = |cells: &[String]| format!("| {} |\n", cells.join(" | ").replace('\n', " "));
        let rule = format!("|{}\n", "---|".repeat(self.header.len()));
        line(&self.header) + &rule + &self.rows.iter().map(|r| line(r)).collect::<String>()
    }

    /// As text for a terminal, without the title: columns aligned, two spaces between.
    pub fn text(&self) -> String {
        let lines = || std::iter::once(&self.header).chain(&self.rows);
        let width = |i: usize| lines().filter_map(|l| l.get(i)).map(|c| c.chars().count()).max().unwrap_or(0);
        let widths: Vec<usize> = (0..self.header.len()).map(width).collect();
        let line = |cells: &Vec<String>| {
            let padded = cells.iter().zip(&widths).map(|(c, w)| format!("{c:w$}"));
            format!("  {}", padded.collect::<Vec<_>>().join("  ")).trim_end().to_owned() + "\n"
        };
        lines().map(line).collect()
    }
}

/// A positive number with two significant digits.
pub fn two_digits(value: f64) -> String {
    format!("{value:.*}", decimals(value))
}

/// Decimals that show two digits of a σ.
fn decimals(sigma: f64) -> usize {
    (1.0 - sigma.log10().floor()).clamp(0.0, 12.0) as usize
}

/// A value with its σ to two digits of σ: `999.98 ± 0.12`.
pub fn with_sigma(value: f64, sigma: Option<f64>) -> String {
    match sigma.filter(|s| *s > 0.0 && s.is_finite()) {
        None => format!("{value}"),
        Some(sigma) => {
            let decimals = decimals(sigma);
            format!("{value:.decimals$} ± {sigma:.decimals$}")
        }
    }
}

/// Table I with Eq. 5 and 6: parameters, true and estimated.
///
/// # Errors
/// As [`stats::compare`].
pub fn parameters(e: &Evidence) -> Result<Table> {
    let mut table =
        Table::with_columns("Table I, Eq. 5 and 6: parameters", &["", "true", "the document's estimate"]);
    let truth = &e.runs[EXACT].setup.scene.camera;
    for (i, name) in document::PARAMETERS.iter().enumerate() {
        let mut row = vec![
            (*name).to_owned(),
            format!("{}", truth.params[i]),
            format!("{:.*}", document::DECIMALS[i], document::ESTIMATE[i]),
        ];
        for run in &e.runs {
            row.push(with_sigma(run.camera().params[i], run.calibration.sigma[i]));
        }
        table.rows.push(row);
    }
    let mut row = vec!["largest error, σ".to_owned(), String::new(), String::new()];
    for run in &e.runs {
        let worst = run.comparison()?.iter().filter_map(|c| c.in_sigma).fold(0.0, f64::max);
        row.push(format!("{worst:.1}"));
    }
    table.rows.push(row);
    Ok(table)
}

/// Table II: poses, and the mean error of each view.
pub fn poses(e: &Evidence) -> Table {
    let first = ["view", "αx, αy, αz, °", "t, mm", "description", "tilt, °", "roll, °", "distance, mm"];
    let mut table = Table::with_columns("Table II: poses, with the mean error of each view, px", &first);
    let scene = &e.runs[EXACT].setup.scene;
    let truth = scene.truth();
    for (view, (pose, frame)) in scene.poses.iter().zip(&truth.frames).enumerate() {
        let stance = stats::stance(&frame.pose, &truth.target());
        let list = |v: [f64; 3]| v.map(|x| format!("{x}")).join(", ");
        let mut row = vec![
            format!("{}", view + 1),
            list(pose.angles_deg),
            list(pose.translation),
            pose.description.clone(),
            format!("{:.1}", stance.tilt_rad.to_degrees()),
            format!("{:.1}", stance.roll_rad.to_degrees()),
            format!("{:.0}", stance.distance),
        ];
        for run in &e.runs {
            let numbers = run.view_numbers().into_iter().find(|n| n.view == view + 1);
            row.push(numbers.map_or_else(|| "–".to_owned(), |n| format!("{:.4}", n.mean_px)));
        }
        table.rows.push(row);
    }
    table
}

/// Table III: settings.
pub fn settings(e: &Evidence) -> Table {
    let mut table =
        Table::new("Table III: settings", &["", "the document", "its method here", "Straightedge"]);
    let (its, ours) = (&e.runs[EXACT_ITS].setup, &e.runs[EXACT].setup);
    let scene = &ours.scene;
    let [w, h] = scene.camera.size_px;
    let (size, square) = (scene.board.size, scene.board.square);
    let corners = size.len();
    let n = scene.poses.len();
    let yes = |b: bool| if b { "yes" } else { "no" };
    let mut row = |name: &str, document: &str, its: String, ours: String| {
        table.rows.push(vec![name.to_owned(), document.to_owned(), its, ours]);
    };
    let mut both = |name: &str, document: &str, value: String| row(name, document, value.clone(), value);
    both("image resolution", "800×600 pixels", format!("{w}×{h} pixels"));
    both("calibration images", "15", format!("{n}"));
    both("inner corners per image", "9×6 = 54", format!("{}×{} = {corners}", size.cols, size.rows));
    both("total corner observations", "810", format!("{}", n * corners));
    both("square size", "30 mm", format!("{square} {}", scene.board.unit.name()));
    both("board origin", "first inner corner", "outer corner of the first square".to_owned());
    both("distortion model", "5-parameter radial–tangential", scene.camera.spec().title.to_owned());
    row(
        "detector",
        "findChessboardCorners",
        "ring response, grown grid".into(),
        "ring response, grown grid".into(),
    );
    let refinement = |s: &super::pipeline::Setup| s.detect.refinement.to_string();
    row(
        "sub-pixel refinement",
        "cornerSubPix, 11×11, 30 iterations, 0.001 px",
        refinement(its),
        refinement(ours),
    );
    let loss = |s: &super::pipeline::Setup| format!("{}, weights {}", s.calibrate.loss, s.calibrate.weights);
    row("solver", "Levenberg–Marquardt (OpenCV)", "Levenberg–Marquardt".into(), "Levenberg–Marquardt".into());
    row("loss", "linear", loss(its), loss(ours));
    let starts = |s: &super::pipeline::Setup| yes(s.calibrate.multi_start).to_owned();
    row("several starts", "no", starts(its), starts(ours));
    let precision = |s: &super::pipeline::Setup| s.calibrate.precision.to_string();
    row("arithmetic", "f64", precision(its), precision(ours));
    table
}

/// Table IV: statistics of the residuals, px.
pub fn statistics(e: &Evidence) -> Table {
    let mut table = Table::with_columns("Table IV: statistics of the residuals, px", &["", "the document"]);
    let all = e.runs.each_ref().map(super::pipeline::Run::errors);
    let rows: [(&str, f64, fn(&stats::ErrorStats) -> f64); 7] = [
        ("RMS", document::RMS_PX, |s| s.rms),
        ("mean", document::MEAN_PX, |s| s.mean),
        ("median", document::MEDIAN_PX, |s| s.median),
        ("largest", document::MAX_PX, |s| s.max),
        ("smallest", document::MIN_PX, |s| s.min),
        ("standard deviation", document::STD_PX, |s| s.std),
        ("95th percentile", document::P95_PX, |s| s.p95),
    ];
    for (name, its, of) in rows {
        let mut row = vec![name.to_owned(), format!("{its:.4}")];
        row.extend(all.iter().map(|s| format!("{:.4}", of(s))));
        table.rows.push(row);
    }
    let mut row =
        vec!["√(mean² + std²)".to_owned(), format!("{:.4}", document::MEAN_PX.hypot(document::STD_PX))];
    row.extend(all.iter().map(|s| format!("{:.4}", s.mean.hypot(s.std))));
    table.rows.push(row);
    let mut row = vec!["found − true corner, RMS".to_owned(), "–".to_owned()];
    row.extend(e.runs.iter().map(|r| format!("{:.4}", r.localisation().rms)));
    table.rows.push(row);
    table
}

/// Coverage, displacement and projection uncertainty.
///
/// # Errors
/// As [`Evidence::displacements`].
pub fn geometry(e: &Evidence) -> Result<Table> {
    let mut table = Table::with_columns("Coverage, distortion, certainty", &["", "the document"]);
    let (moved, _) = e.displacements()?;
    let mut row = |name: &str, document: &str, cells: [String; 4]| {
        table.rows.push([&[name.to_owned(), document.to_owned()][..], &cells].concat());
    };
    let coverage = e.runs.each_ref().map(super::pipeline::Run::coverage);
    let percent =
        |f: fn(&stats::Coverage) -> f64| coverage.each_ref().map(|c| format!("{:.1}", 100.0 * f(c)));
    row("width covered, %", "92", percent(|c| c.width_fraction));
    row("height covered, %", "88", percent(|c| c.height_fraction));
    row("hull, % of the area", "–", percent(|c| c.hull_fraction));
    row("cells of 10 × 10 hit, %", "–", percent(|c| c.cells_fraction));
    row("largest displacement, px", "18", moved.map(|m| format!("{:.1}", m[0])));
    row("the same, % of the diagonal", "3", moved.map(|m| format!("{:.1}", m[1])));
    let sure = e.runs.each_ref().map(super::pipeline::Run::uncertainty);
    let number = |v: Option<f64>| v.map_or_else(|| "none".to_owned(), |v| format!("{v:.4}"));
    row("projection uncertainty in the middle, px", "–", sure.each_ref().map(|u| number(u.center_px)));
    row(
        "projection uncertainty in the worst corner, px",
        "–",
        sure.each_ref().map(|u| number(u.worst_corner_px)),
    );
    Ok(table)
}

/// The claims.
pub fn claims(judged: &[Judged]) -> Table {
    let mut table = Table::with_columns("Claims", &["section", "the document says", "verdict"]);
    for claim in judged {
        let j = &claim.judgement;
        let mut row = vec![claim.section.clone(), claim.says.clone(), format!("**{}**", j.verdict)];
        row.extend((0..COLUMNS.len()).map(|i| j.columns.get(i).cloned().unwrap_or_else(|| "–".to_owned())));
        table.rows.push(row);
    }
    table
}

/// What refinement gains.
pub fn refinements(e: &Evidence) -> Table {
    let title =
        "Corner error by refinement: RMS of found − true, common shift removed, px (and the gain over none)";
    let mut table = Table::new(title, &["refinement", "crude, cut", "crude, rounded", "exact"]);
    let off = e.refinements.first().map_or([f64::NAN; 3], |r| r.rms_px);
    for r in &e.refinements {
        let mut row = vec![r.refinement.to_string()];
        row.extend(r.rms_px.iter().zip(off).map(|(rms, off)| format!("{rms:.4} ({:.1} ×)", off / rms)));
        table.rows.push(row);
    }
    table
}

/// The effects of one condition.
pub fn effects(all: &[Effect], condition: &str) -> Table {
    let header = [
        "",
        "",
        "boards",
        "RMS, px",
        "corner error RMS (p95), px",
        "closed form: fx error, px",
        "fx error, px (σ)",
        "cx error, px (σ)",
        "k1 error (σ)",
        "largest error, σ",
        "map error RMS, px",
        "uncertainty middle, corner, px",
    ];
    let mut table = Table::new(condition, &header);
    let mut group = "";
    for effect in all.iter().filter(|e| e.condition == condition) {
        let title = if effect.group == group { String::new() } else { effect.group.clone() };
        group = &effect.group;
        let mut row = vec![title, effect.name.clone()];
        match &effect.outcome {
            Err(why) => row.push(why.clone()),
            Ok(n) => {
                let miss = |name: &str| {
                    n.parameters.iter().find(|c| c.name == name).map_or_else(String::new, |c| {
                        format!("{:+.2$e} ({1:.1})", c.estimate - c.truth, c.in_sigma.unwrap_or(0.0), 1)
                    })
                };
                let px = |name: &str| {
                    n.parameters.iter().find(|c| c.name == name).map_or_else(String::new, |c| {
                        format!("{:+.3} ({:.1})", c.estimate - c.truth, c.in_sigma.unwrap_or(0.0))
                    })
                };
                let worst = n.parameters.iter().filter_map(|c| c.in_sigma).fold(0.0, f64::max);
                let number = |v: Option<f64>| v.map_or_else(|| "none".to_owned(), |v| format!("{v:.4}"));
                row.extend([
                    format!("{}/{}", n.full, n.pictures),
                    format!("{:.4}", n.rms_px),
                    format!("{:.4} ({:.4})", n.localisation_px.rms, n.localisation_px.p95),
                    n.closed_form_fx_px.map_or_else(|| "none".to_owned(), |d| format!("{d:+.1}")),
                    px("fx"),
                    px("cx"),
                    miss("k1"),
                    format!("{worst:.1}"),
                    number(n.map_px),
                    n.uncertainty_px.map(number).join(", "),
                ]);
            }
        }
        row.resize(header.len(), String::new());
        table.rows.push(row);
    }
    table
}
