//! What the residuals say that went wrong: the faults of [`Sources`](super::super::sources::Sources), where those were asked for.

use super::{Facts, Finding, Level, Remedy, finding};
use crate::calib::{
    diagnose::{faults::Fault, sources},
    number::significant,
};

/// Explained errors from which a fault is more than worth knowing, px RMS.
const SERIOUS_PX: f64 = 0.3;
/// Movement of the projection from which it is, px.
const MOVES_PX: f64 = 0.3;

/// One for each fault that was found.
pub(super) fn all(facts: &Facts<'_>) -> Vec<Finding> {
    let Some(sources) = &facts.report.sources else { return Vec::new() };
    sources.faults.iter().filter(|f| f.found).map(|fault| one(facts, fault)).collect()
}

fn one(facts: &Facts<'_>, fault: &Fault) -> Finding {
    let alone = match &fault.frames[..] {
        [position] => facts.report.frames.get(*position),
        _ => None,
    };
    let aside = alone.is_some_and(|f| !f.included);
    let what = if fault.size.is_empty() { String::new() } else { format!("{}. ", capital(&fault.size)) };
    let text = if aside {
        format!("{what}It would be harmful: it contradicts all others and is set aside.")
    } else {
        let moves = if fault.moves_px < 0.001 {
            "no further than chance would".to_owned()
        } else {
            format!("by {} px", significant(fault.moves_px, 2))
        };
        format!(
            "{what}It explains {} px RMS of the errors and moves the projection {moves}. {}.",
            significant(fault.explains_px, 2),
            sources::advice(&fault.code)
        )
    };
    // One picture that is not as the others is harmful, whatever it does.
    let serious = alone.is_some() || fault.explains_px > SERIOUS_PX || fault.moves_px > MOVES_PX;
    let level = if serious { Level::Warn } else { Level::Info };
    let remedy =
        alone.filter(|f| f.included).map(|f| Remedy::SetAside(fault.frames.clone(), f.stem().to_owned()));
    finding(&fault.code, level, fault.title.clone(), text, sources::show(fault), remedy)
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map(|c| c.to_uppercase().chain(letters).collect()).unwrap_or_default()
}
