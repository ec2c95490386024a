//! A lens that bends in another way than its model.

use super::{Card, Facts, Remedy, Show, px};
use crate::calib::{camera::Model, number::counted, stats::indistinct};

pub(super) fn card(facts: &Facts<'_>) -> Card {
    let calibration = facts.capture.calibration;
    let model = calibration.camera.model;
    if let Some(fault) = facts.found("lens_model") {
        let larger = calibration.camera.spec().perspective
            && !matches!(model, Model::Rational | Model::ThinPrism | Model::Tilted);
        return Card {
            px: fault.moves_px,
            text: format!(
                "{} more terms explain {} RMS of the errors, {:.0} times what chance would.",
                fault.unknowns,
                px(fault.explains_px),
                fault.gain / fault.unknowns.max(1) as f64
            ),
            show: Show::Field,
            remedy: larger.then_some(Remedy::Model(Model::Rational)),
            advice: "A model with more terms".to_owned(),
        };
    }
    let (cost, names) = overfit(facts);
    let text = if names.is_empty() {
        "More terms explain no more than chance lets expect, and each that is there can be told from zero."
            .to_owned()
    } else {
        format!(
            "More terms explain no more than chance lets expect; {} ({}) cannot be told from zero and {} certainty.",
            counted(names.len(), "term"),
            names.join(", "),
            if names.len() == 1 { "costs" } else { "cost" }
        )
    };
    let remedy = (!names.is_empty()).then_some(Remedy::Hold(names));
    Card {
        px: cost,
        text,
        show: Show::Field,
        remedy,
        advice: "Hold what the pictures do not tell".to_owned(),
    }
}

/// What terms that cannot be told from zero cost, px, and their names.
fn overfit(facts: &Facts<'_>) -> (f64, Vec<String>) {
    let calibration = facts.capture.calibration;
    let all = calibration.covariance_of_all();
    let unsure = indistinct(&calibration.camera.params, &all, 4);
    let slots: Vec<usize> =
        unsure.iter().filter_map(|k| calibration.free.iter().position(|f| f == k)).collect();
    let names = unsure.iter().map(|i| calibration.camera.spec().params[*i].name.to_owned()).collect();
    let Some(mut held) = calibration.covariance.clone().cholesky().map(|c| c.inverse()) else {
        return (0.0, names);
    };
    for &slot in &slots {
        // Held: as good as known.
        held[(slot, slot)] *= 1e9;
    }
    let held = held.cholesky().map(|c| c.inverse()).and_then(|c| facts.capture.map.scatters(&c));
    (held.map_or(0.0, |other| super::beyond(facts.capture.sigma_px, other)), names)
}
