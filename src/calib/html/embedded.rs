//! What a page holds beside what it shows: the JSON of its report.

use super::page;
use crate::calib::report::Report;

/// What stands before the JSON in a page.
pub(super) const OPEN: &str = "<script type=\"application/json\" id=\"report\">";
/// What stands behind it.
const CLOSE: &str = "</script>";

/// The JSON of the report that a page of ours holds; `None` for every other text.
pub fn embedded(text: &str) -> Option<&str> {
    let start = text.trim_start_matches('\u{feff}').trim_start();
    if !start.get(..9).is_some_and(|head| head.eq_ignore_ascii_case("<!doctype")) {
        return None;
    }
    let (_, rest) = text.split_once(OPEN)?;
    Some(rest.split_once(CLOSE)?.0.trim())
}

/// Whether a page shows what its report says: all its words are those of [`page`]. Figures are left out, because other processors may
/// round a place in them differently. `None` where another version wrote it, whose words may be others.
pub fn is_as_written(text: &str, report: &Report) -> Option<bool> {
    let same = report.version == env!("CARGO_PKG_VERSION");
    same.then(|| words(text) == words(&page(report)))
}

/// A page without its figures, with one kind of line end.
fn words(page: &str) -> String {
    let mut out = String::with_capacity(page.len());
    let mut rest = page.trim_start_matches('\u{feff}');
    while let Some((before, figure)) = rest.split_once("<svg") {
        out += before;
        rest = figure.split_once("</svg>").map_or("", |(_, after)| after);
    }
    out += rest;
    out.replace('\r', "").trim().to_owned()
}
