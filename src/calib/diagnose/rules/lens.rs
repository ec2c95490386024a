//! What the solution says about the lens model.

use super::{Facts, Finding, Level, Remedy, Show, finding, sentence};
use crate::calib::{number::with_sigma, solution::Warning, stats::indistinct};

fn warning<'a>(facts: &Facts<'a>, code: &str) -> Option<&'a Warning> {
    facts.report.warnings.iter().find(|w| w.code == code)
}

pub(super) fn not_converged(facts: &Facts<'_>) -> Option<Finding> {
    let text = sentence(&warning(facts, "not_converged")?.text);
    Some(finding("not_converged", Level::Bad, "The solution was not reached", text, Show::Errors, None))
}

pub(super) fn absurd_focal(facts: &Facts<'_>) -> Option<Finding> {
    let text = sentence(&warning(facts, "focal_absurd")?.text);
    Some(finding("focal_absurd", Level::Bad, "No lens has this focal length", text, Show::Diversity, None))
}

pub(super) fn folds(facts: &Facts<'_>) -> Option<Finding> {
    let text = sentence(&warning(facts, "model_folds")?.text);
    let k3_is_free = facts.solution.is_some_and(|s| s.sigma.get("k3").is_some_and(Option::is_some));
    let remedy = k3_is_free.then(|| Remedy::Hold(vec!["k3".to_owned()]));
    let title = "Part of the picture cannot be straightened";
    Some(finding("model_folds", Level::Warn, title, text, Show::Lens, remedy))
}

pub(super) fn not_determined(facts: &Facts<'_>) -> Option<Finding> {
    let solution = facts.solution?;
    let camera = &solution.camera;
    let unsure = indistinct(&camera.params, &solution.covariance, 4);
    let names: Vec<String> = unsure.iter().map(|i| camera.spec().params[*i].name.to_owned()).collect();
    let (title, text) = match unsure[..] {
        [] => return None,
        [i] => {
            let [value, sigma] = with_sigma(camera.params[i], solution.covariance[(i, i)].sqrt());
            let title = format!("{} is not determined: {value} ± {sigma}", names[0]);
            (title, "Smaller than twice its σ; holding it costs nothing.")
        }
        _ => {
            let title = format!("{} are not determined", names.join(", "));
            (title, "Together no larger than chance lets expect; holding them costs nothing.")
        }
    };
    Some(finding("not_determined", Level::Info, title, text, Show::Certainty, Some(Remedy::Hold(names))))
}
