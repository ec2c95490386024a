//! How the pictures were taken.

use std::collections::BTreeMap;

use super::{super::facts::FLAT_DEG, Facts, Finding, Level, Remedy, Show, finding, sentence};
use crate::calib::{
    number::{counted, significant},
    order,
};

pub(super) fn no_camera(facts: &Facts<'_>) -> Option<Finding> {
    let error = facts.report.error.as_ref()?;
    let found = facts.report.frames.iter().filter(|f| f.found).count();
    let title = format!("{found} of {} show the board", counted(facts.report.frames.len(), "picture"));
    let add = Some(Remedy::AddPictures);
    Some(finding(&error.code, Level::Bad, title, sentence(&error.text), Show::Pictures, add))
}

pub(super) fn few_views(facts: &Facts<'_>) -> Option<Finding> {
    let n = facts.used.len();
    if facts.solution.is_none() || n >= 8 {
        return None;
    }
    let (level, title) = if n < 4 {
        (Level::Bad, format!("{} are too few", counted(n, "picture")))
    } else {
        (Level::Warn, format!("Only {}", counted(n, "picture")))
    };
    let text = "Each has to determine its own pose as well. Fifteen to twenty leave room for a bad one.";
    Some(finding("few_views", level, title, text, Show::Pictures, Some(Remedy::AddPictures)))
}

pub(super) fn facing(facts: &Facts<'_>) -> Option<Finding> {
    let most = facts.most_tilt_deg().filter(|most| *most < FLAT_DEG)?;
    let text = format!(
        "The strongest tilt is {most:.0}°. Only strong tilt tells focal length from distance: tip the board by 30 to 45°."
    );
    let level = if most < 15.0 { Level::Bad } else { Level::Warn };
    let title = "All boards face the camera";
    Some(finding("frontal", level, title, text, Show::Diversity, Some(Remedy::AddPictures)))
}

pub(super) fn no_corner(facts: &Facts<'_>) -> Option<Finding> {
    let (solution, [first, rest @ ..]) = (facts.solution?, &facts.empty[..]) else { return None };
    let grid = &solution.uncertainty.grid_px;
    let (rows, columns) = (grid.len(), grid.first().map_or(0, Vec::len));
    let place = |i: usize, n: usize| (i as f64 + 0.5) / n as f64;
    let cells = (0..rows).flat_map(|j| (0..columns).map(move |i| (i, j)));
    let mut values =
        cells.filter(|(i, j)| first.holds([place(*i, columns), place(*j, rows)])).map(|(i, j)| grid[j][i]);
    let worst = values.try_fold(0.0f64, |w, v| Some(w.max(v?)));
    let cost = worst
        .filter(|w| *w < 100.0)
        .map_or_else(|| "more than 100 px".to_owned(), |w| format!("±{} px", significant(w, 2)));
    let more = match rest.len() {
        0 => String::new(),
        1 => " One more such place.".to_owned(),
        n => format!(" {n} more such places."),
    };
    let text = format!("There the map is extrapolated, to {cost}.{more}");
    let title = format!("No corner {} of the picture", first.name);
    let harmless = worst.is_some_and(|w| w <= 1.0) && !first.is_quarter();
    let level = if harmless { Level::Info } else { Level::Warn };
    Some(finding("no_corner", level, title, text, Show::Corners, Some(Remedy::AddPictures)))
}

pub(super) fn set_aside(facts: &Facts<'_>) -> Option<Finding> {
    facts.solution?;
    let mut reasons: BTreeMap<&str, usize> = BTreeMap::new();
    for frame in facts.report.frames.iter().filter(|f| !f.included && !f.why.is_empty()) {
        *reasons.entry(frame.why.as_str()).or_default() += 1;
    }
    let n: usize = reasons.values().sum();
    let title = match n {
        0 => return None,
        1 => "1 picture is set aside".to_owned(),
        n => format!("{n} pictures are set aside"),
    };
    let mut list: Vec<(&str, usize)> = reasons.into_iter().collect();
    order::by(&mut list, |(_, n)| [-(*n as f64)]);
    let said: Vec<String> = list
        .iter()
        .take(2)
        .map(|(why, n)| if *n == 1 { (*why).to_owned() } else { format!("{n} × {why}") })
        .collect();
    let more = if list.len() > 2 { "; …" } else { "." };
    let text = format!("{}{more}", sentence(&said.join("; ")).trim_end_matches('.'));
    Some(finding("set_aside", Level::Info, title, text, Show::Pictures, None))
}
