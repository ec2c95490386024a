//! The report as one HTML file that needs nothing beside it: no script from elsewhere, no font, no picture.
//!
//! The whole JSON of the run is embedded, so the page alone can be checked and reproduced. Light, dark and printed.

mod embedded;
mod figures;
mod tables;
mod text;

use super::{
    diagnose::{self, Level},
    number::counted,
    report::Report,
};
pub use embedded::{embedded, is_as_written};
pub(super) use figures::{figure, row};
pub(super) use text::escape;

/// Writes the page.
pub fn page(report: &Report) -> String {
    let (level, verdict) = diagnose::summary(report);
    let title = report.solution.as_ref().map_or_else(
        || "Camera calibration".to_owned(),
        |s| {
            let [w, h] = s.camera.size_px;
            format!("Camera calibration: {}, {w} × {h} px", s.camera.spec().title)
        },
    );
    let mut body = format!(
        "<h1>{}</h1>\n<p class=\"muted\">{}</p>\n<p class=\"verdict {}\">{}</p>\n",
        escape(&title),
        escape(&subtitle(report)),
        tone(level),
        escape(&verdict)
    );
    if report.solution.is_some() {
        let alone = escape(&diagnose::verdict(report).rms_words());
        body += &format!("<p class=\"muted\">{alone}</p>\n");
    }
    body += &tables::advice(report);
    body += &tables::findings(report);
    if let Some(solution) = &report.solution {
        body += &section("Camera", &(tables::camera(solution) + &tables::certainty(report, solution)));
        body += &section("Errors", &(tables::errors(report, solution) + &figures::errors(report, solution)));
        body += &section("Coverage", &(tables::coverage(solution) + &figures::coverage(report, solution)));
        body += &section("Distortion", &figures::distortion(&solution.camera));
    }
    if let Some(sources) = &report.sources {
        body += &section("Sources of error", &tables::sources(sources));
    }
    if let Some(comparison) = &report.models {
        body += &section("Camera models", &tables::models(comparison));
    }
    body += &section("Pictures", &(figures::stance(report) + &tables::pictures(report)));
    if report.groups.len() > 1 {
        body += &section("Cameras", &tables::groups(report));
    }
    if let Some(solution) = &report.solution {
        body += &section("Covariance and correlation", &tables::covariance(solution));
        body += &section("How the solution was reached", &tables::convergence(solution));
    }
    body += &section("Settings", &tables::settings(report));
    body += &section("Conventions", text::CONVENTIONS);
    body += &section("All numbers", text::NUMBERS);
    // Inside a script only the end of the element matters; in JSON this is the same text.
    let json = report.to_json().replace('<', "\\u003c");
    document(
        &title,
        &report.version,
        &body,
        &format!("{}\n{json}</script>\n<script>{}</script>\n", embedded::OPEN, text::SAVE),
    )
}

/// A page that needs nothing beside it, in the style of all.
pub(super) fn document(title: &str, version: &str, body: &str, after: &str) -> String {
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta name=\"generator\" content=\"Straightedge {}\">\n<title>{}</title>\n<style>\n{}</style>\n</head>\n\
         <body>\n<main>\n{body}</main>\n{after}</body>\n</html>\n",
        escape(version),
        escape(title),
        include_str!("html/style.css"),
    )
}

pub(super) fn section(title: &str, content: &str) -> String {
    format!("<section>\n<h2>{title}</h2>\n{content}</section>\n")
}

fn subtitle(report: &Report) -> String {
    let s = &report.settings;
    let board = s.board_words().unwrap_or_else(|| "board of unknown size".to_owned());
    let used = report.included().count();
    let corners: usize = report.included().map(|f| f.corners.len()).sum();
    format!(
        "{} {}, {used} of {} used, {}, Straightedge {}",
        board,
        if s.board_is_found { "(found from the pictures)" } else { "(given)" },
        counted(report.frames.len(), "picture"),
        counted(corners, "corner"),
        report.version
    )
}

/// Colour of the verdict.
const fn tone(level: Level) -> &'static str {
    match level {
        Level::Good => "good",
        Level::Info | Level::Warn => "care",
        Level::Bad => "bad",
    }
}

#[cfg(test)]
mod tests;
