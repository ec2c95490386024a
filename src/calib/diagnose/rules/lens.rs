//! What the solution says about the lens model.

use nalgebra::Vector2;

use super::{Facts, Finding, Level, Remedy, Show, finding, sentence};
use crate::calib::{
    number::{significant, with_sigma},
    solution::Warning,
    stats::indistinct,
};

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

/// Lenses that see this much bend it: an ordinary one shows it by more than [`STRAIGHT`].
const WIDE_DEG: f64 = 55.0;
/// Largest displacement of a picture without distortion, as a share of its diagonal: ten times less than lenses of phones and webcams have.
const STRAIGHT: f64 = 0.001;
/// How far out corners must be to tell, as a share of the half diagonal: distortion grows with the third power.
const OUT: f64 = 0.7;

/// Whether the camera corrects its pictures itself.
pub(super) fn straightened(facts: &Facts<'_>) -> Option<Finding> {
    let camera = &facts.solution?.camera;
    let [fx, fy, cx, cy] = camera.intrinsics();
    let [w, h] = camera.size_px.map(f64::from);
    let half = 0.5 * w.hypot(h);
    let fov_deg = 2.0 * (half / (0.5 * (fx + fy))).atan().to_degrees();
    if camera.params.len() == 4 || fov_deg < WIDE_DEG {
        return None;
    }
    let (mut out, mut most) = (0.0f64, 0.0f64);
    for px in facts.report.corners_px() {
        let ray = camera.unproject(&px)?;
        let straight = Vector2::new(fx * ray.x / ray.z + cx, fy * ray.y / ray.z + cy);
        out = out.max((px - Vector2::new(cx, cy)).norm());
        most = most.max((px - straight).norm());
    }
    if out < OUT * half || most > STRAIGHT * 2.0 * half {
        return None;
    }
    let text = format!(
        "Of {fov_deg:.0}° the lens moves no corner by more than {} px, which hardly any lens does: the camera corrects its pictures, or they were \
         rendered. The calibration holds for pictures that are corrected in the same way; switch that off, or never change it.",
        significant(most, 2)
    );
    let title = "The pictures seem to be straightened already";
    Some(finding("straightened", Level::Info, title, text, Show::Lens, None))
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
