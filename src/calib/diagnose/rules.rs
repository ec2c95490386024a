//! One function for each thing that can be wrong; adding one is a line in [`RULES`].

mod capture;
mod errors;
mod faults;
mod lens;

use super::{Facts, Finding, Level, Remedy, Show};
use crate::calib::{order, solution::Warning};

/// Answers with a finding where something is to be said.
type Rule = fn(&Facts<'_>) -> Option<Finding>;

/// All of them; of equal level the earlier comes first.
const RULES: &[Rule] = &[
    capture::no_camera,
    lens::not_converged,
    lens::absurd_focal,
    capture::few_views,
    capture::facing,
    lens::folds,
    capture::no_corner,
    errors::misfit,
    errors::harmful,
    errors::loud_picture,
    errors::bent_board,
    errors::lens_pattern,
    errors::picture_pattern,
    lens::straightened,
    lens::not_determined,
    errors::outliers,
    capture::set_aside,
];

/// Warnings that a rule says.
const SAID: &[&str] = &["unobservable", "model_folds", "not_converged", "focal_absurd"];

/// What all rules find, the worst first, then warnings of other parts in their own words.
pub(super) fn all(facts: &Facts<'_>) -> Vec<Finding> {
    let others = facts.report.warnings.iter().filter(|w| !SAID.contains(&w.code.as_str()));
    let mut list = faults::all(facts);
    list.extend(RULES.iter().filter_map(|rule| rule(facts)).chain(others.map(as_finding)));
    order::by(&mut list, |f| [-f64::from(f.level as u8)]);
    list
}

fn as_finding(warning: &Warning) -> Finding {
    let title = sentence(&warning.code.replace('_', " ")).trim_end_matches('.').to_owned();
    finding(&warning.code, Level::Info, title, sentence(&warning.words()), Show::Pictures, None)
}

fn finding(
    code: &str,
    level: Level,
    title: impl Into<String>,
    text: impl Into<String>,
    show: Show,
    remedy: Option<Remedy>,
) -> Finding {
    Finding { code: code.to_owned(), level, title: title.into(), text: text.into(), show, remedy }
}

/// With a capital and a full stop.
fn sentence(text: &str) -> String {
    let mut letters = text.chars();
    let first = letters.next().map(|c| c.to_uppercase().collect::<String>()).unwrap_or_default();
    let rest = letters.as_str();
    if rest.ends_with(['.', '!', '?']) { first + rest } else { first + rest + "." }
}
