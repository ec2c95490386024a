//! One function for each thing that can be wrong; adding one is a line in [`RULES`].

use std::collections::BTreeMap;

use super::{Facts, Finding, Level, Remedy, Show};
use crate::calib::{
    number::{counted, significant, with_sigma},
    stats::quantile,
};

/// All of them.
pub(super) const RULES: &[fn(&Facts<'_>) -> Vec<Finding>] = &[
    no_camera,
    few_views,
    frontal,
    folds,
    no_corner,
    loud_picture,
    lens_pattern,
    board_pattern,
    not_determined,
    outliers,
    aside,
    others,
];

/// Warnings that have a rule of their own.
const SAID: [&str; 2] = ["unobservable", "model_folds"];

fn finding(
    code: &str,
    level: Level,
    title: String,
    text: String,
    show: Show,
    remedy: Option<Remedy>,
) -> Vec<Finding> {
    vec![Finding { code: code.to_owned(), level, title, text, show, remedy }]
}

fn no_camera(facts: &Facts<'_>) -> Vec<Finding> {
    let Some(error) = &facts.report.error else { return Vec::new() };
    let found = facts.report.frames.iter().filter(|f| f.found).count();
    let title = format!("{} of {} show the board", found, counted(facts.report.frames.len(), "picture"));
    finding(&error.code, Level::Bad, title, sentence(&error.text), Show::Pictures, Some(Remedy::AddPictures))
}

fn few_views(facts: &Facts<'_>) -> Vec<Finding> {
    let n = facts.used.len();
    if facts.solution.is_none() || n >= 8 {
        return Vec::new();
    }
    let (level, title) = if n < 4 {
        (Level::Bad, format!("{} are too few", counted(n, "picture")))
    } else {
        (Level::Warn, format!("Only {}", counted(n, "picture")))
    };
    let text =
        "Each has to determine its own pose as well. Fifteen to twenty leave room for a bad one.".to_owned();
    finding("few_views", level, title, text, Show::Pictures, Some(Remedy::AddPictures))
}

fn frontal(facts: &Facts<'_>) -> Vec<Finding> {
    let tilts: Vec<f64> = facts.used.iter().filter_map(|(_, f)| f.tilt_rad.map(f64::to_degrees)).collect();
    let most = tilts.iter().copied().fold(0.0, f64::max);
    if tilts.is_empty() || most >= 20.0 {
        return Vec::new();
    }
    let title = "All boards face the camera".to_owned();
    let text = format!(
        "The strongest tilt is {most:.0}°. Only strong tilt tells focal length from distance: tip the board by 30 to 45°."
    );
    let level = if most < 15.0 { Level::Bad } else { Level::Warn };
    finding("frontal", level, title, text, Show::Diversity, Some(Remedy::AddPictures))
}

fn folds(facts: &Facts<'_>) -> Vec<Finding> {
    let Some(warning) = facts.report.warnings.iter().find(|w| w.code == "model_folds") else {
        return Vec::new();
    };
    let held = facts.solution.is_some_and(|s| s.sigma.iter().any(|(n, v)| n == "k3" && v.is_some()));
    let remedy = held.then(|| Remedy::Hold(vec!["k3".to_owned()]));
    let title = "The lens model folds inside the picture".to_owned();
    finding("model_folds", Level::Warn, title, sentence(&warning.text), Show::Lens, remedy)
}

fn no_corner(facts: &Facts<'_>) -> Vec<Finding> {
    let (Some(solution), [first, rest @ ..]) = (facts.solution, &facts.empty[..]) else { return Vec::new() };
    let grid = &solution.uncertainty.grid_px;
    let (rows, columns) = (grid.len(), grid.first().map_or(0, Vec::len));
    let place = |i: usize, n: usize| (i as f64 + 0.5) / n as f64;
    let inside = (0..rows).flat_map(|j| (0..columns).map(move |i| (i, j)));
    let mut values =
        inside.filter(|(i, j)| first.holds([place(*i, columns), place(*j, rows)])).map(|(i, j)| grid[j][i]);
    let worst = values.try_fold(0.0f64, |w, v| Some(w.max(v?)));
    let cost = worst
        .filter(|w| *w < 100.0)
        .map_or_else(|| "more than 100 px".to_owned(), |w| format!("±{} px", significant(w, 2)));
    let more = if rest.is_empty() { String::new() } else { format!(" {} more such places.", rest.len()) };
    let text = format!("There the map is extrapolated, to {cost}.{more}");
    let title = format!("No corner {} of the picture", first.name);
    let level = if worst.is_some_and(|w| w <= 1.0) { Level::Info } else { Level::Warn };
    finding("no_corner", level, title, text, Show::Corners, Some(Remedy::AddPictures))
}

/// A picture whose error stands out from the others'.
fn loud_picture(facts: &Facts<'_>) -> Vec<Finding> {
    let mut means: Vec<f64> = facts.used.iter().map(|(_, f)| Facts::mean_px(f)).collect();
    means.sort_by(f64::total_cmp);
    if means.len() < 4 {
        return Vec::new();
    }
    let usual = quantile(&means, 0.5);
    let spread = (quantile(&means, 0.75) - quantile(&means, 0.25)).max(0.1 * usual);
    let loud = facts.used.iter().filter(|(_, f)| Facts::mean_px(f) > (usual + 5.0 * spread).max(1.8 * usual));
    let Some((position, frame)) = loud.max_by(|a, b| Facts::mean_px(a.1).total_cmp(&Facts::mean_px(b.1)))
    else {
        return Vec::new();
    };
    let name = stem(frame.name());
    let title = format!("{name} fits worse than the others");
    let text = format!(
        "Its mean error is {} px, usual is {} px. Look whether it is blurred or shows another board.",
        significant(Facts::mean_px(frame), 2),
        significant(usual, 2)
    );
    let remedy = Some(Remedy::SetAside(vec![*position], name.to_owned()));
    finding("loud_picture", Level::Warn, title, text, Show::Picture(*position), remedy)
}

/// Smallest Moran's I that is worth a word: significance alone comes with numbers.
const NOTABLE: f64 = 0.2;
/// RMS up to which a pattern of the board is only worth knowing, px.
const NOT_FLAT_PX: f64 = 0.3;

fn lens_pattern(facts: &Facts<'_>) -> Vec<Finding> {
    let Some(m) = facts.between.filter(|m| m.is_significant() && m.index > NOTABLE) else {
        return Vec::new();
    };
    let title = "The lens model does not explain everything".to_owned();
    let text = format!(
        "Errors of different pictures agree where they meet (correlation {:.2}): the lens bends in a way that this model cannot.",
        m.index
    );
    finding("lens_pattern", Level::Warn, title, text, Show::Field, None)
}

fn board_pattern(facts: &Facts<'_>) -> Vec<Finding> {
    let Some(m) = facts.within.filter(|m| m.is_significant() && m.index > 2.0 * NOTABLE) else {
        return Vec::new();
    };
    if facts.between.is_some_and(|b| b.is_significant() && b.index > 0.5 * m.index) {
        return Vec::new();
    }
    let rms = facts.solution.map_or(0.0, |s| s.rms_px);
    let title = if rms > NOT_FLAT_PX { "The board was not flat" } else { "The board was not quite flat" };
    let text = format!(
        "Neighbouring corners err alike (correlation {:.2}), each picture in its own way, by {} px RMS.",
        m.index,
        significant(rms, 2)
    );
    let level = if rms > NOT_FLAT_PX { Level::Warn } else { Level::Info };
    finding("board_pattern", level, title.to_owned(), text, Show::Field, None)
}

fn not_determined(facts: &Facts<'_>) -> Vec<Finding> {
    let Some(solution) = facts.solution else { return Vec::new() };
    let params = solution.camera.spec().params;
    let unsure: Vec<(&str, f64, f64)> = params
        .iter()
        .enumerate()
        .skip(4)
        .filter_map(|(i, p)| {
            let sigma = solution.sigma.iter().find(|(n, _)| *n == p.name).and_then(|(_, s)| *s)?;
            (solution.camera.params[i].abs() < 2.0 * sigma).then_some((
                p.name,
                solution.camera.params[i],
                sigma,
            ))
        })
        .collect();
    let names: Vec<String> = unsure.iter().map(|u| u.0.to_owned()).collect();
    let title = match &unsure[..] {
        [] => return Vec::new(),
        [(name, value, sigma)] => {
            let [value, sigma] = with_sigma(*value, *sigma);
            format!("{name} is not determined: {value} ± {sigma}")
        }
        _ => format!("{} are not determined", names.join(", ")),
    };
    let text = match names.len() {
        1 => "Smaller than twice its σ; holding it costs nothing.",
        _ => "Smaller than twice their σ; holding them costs nothing.",
    };
    finding("not_determined", Level::Info, title, text.to_owned(), Show::Certainty, Some(Remedy::Hold(names)))
}

fn outliers(facts: &Facts<'_>) -> Vec<Finding> {
    let n: usize = facts.used.iter().map(|(_, f)| f.outliers.len()).sum();
    let Some((position, _)) = facts.used.iter().max_by_key(|(_, f)| f.outliers.len()).filter(|_| n > 0)
    else {
        return Vec::new();
    };
    let title =
        if n == 1 { "1 corner is an outlier".to_owned() } else { format!("{n} corners are outliers") };
    let text =
        "They lie further off than the others let expect; the robust loss gives them next to no weight."
            .to_owned();
    finding("outliers", Level::Info, title, text, Show::Picture(*position), None)
}

fn aside(facts: &Facts<'_>) -> Vec<Finding> {
    let mut reasons: BTreeMap<&str, usize> = BTreeMap::new();
    for frame in facts.report.frames.iter().filter(|f| !f.included && !f.why.is_empty()) {
        *reasons.entry(frame.why.as_str()).or_default() += 1;
    }
    let n: usize = reasons.values().sum();
    if n == 0 || facts.solution.is_none() {
        return Vec::new();
    }
    let mut list: Vec<(&str, usize)> = reasons.into_iter().collect();
    list.sort_by_key(|(_, n)| std::cmp::Reverse(*n));
    let said: Vec<String> = list
        .iter()
        .take(2)
        .map(|(why, n)| if *n == 1 { (*why).to_owned() } else { format!("{n} × {why}") })
        .collect();
    let title =
        if n == 1 { "1 picture is set aside".to_owned() } else { format!("{n} pictures are set aside") };
    let more = if list.len() > 2 { "; …" } else { "." };
    finding(
        "set_aside",
        Level::Info,
        title,
        format!("{}{more}", sentence(&said.join("; ")).trim_end_matches('.')),
        Show::Pictures,
        None,
    )
}

/// Warnings of other parts, in their own words.
fn others(facts: &Facts<'_>) -> Vec<Finding> {
    let list = facts.report.warnings.iter().filter(|w| !SAID.contains(&w.code.as_str()));
    list.flat_map(|w| {
        let title = sentence(&w.code.replace('_', " ")).trim_end_matches('.').to_owned();
        finding(&w.code, Level::Info, title, sentence(&w.text), Show::Pictures, None)
    })
    .collect()
}

/// With a capital and a full stop.
fn sentence(text: &str) -> String {
    let mut letters = text.chars();
    let first = letters.next().map(|c| c.to_uppercase().collect::<String>()).unwrap_or_default();
    let rest = letters.as_str();
    if rest.ends_with(['.', '!', '?']) { first + rest } else { first + rest + "." }
}

fn stem(name: &str) -> &str {
    name.rsplit_once('.').map_or(name, |(stem, _)| stem)
}
