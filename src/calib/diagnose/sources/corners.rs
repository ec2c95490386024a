//! Corners are not where they were found.

use super::{Card, Facts, Remedy, Show, px};
use crate::calib::number::significant;

pub(super) fn card(facts: &Facts<'_>) -> Card {
    let capture = facts.capture;
    let sigma0 = capture.calibration.sigma0_px;
    let used = capture.report.included().flat_map(|f| &f.corners).map(|c| c.sigma_px * c.sigma_px);
    let (sum, n) = used.filter(|s| s.is_finite()).fold((0.0, 0usize), |(s, n), v| (s + v, n + 1));
    let predicted = (sum / n.max(1) as f64).sqrt();
    // What the corners' own σ do not explain is another source's.
    let own = if predicted > 0.0 { predicted.min(sigma0) } else { sigma0 };
    let cost = capture.sigma_px * own / sigma0.max(f64::MIN_POSITIVE);
    let [found, expected] = [sigma0, predicted].map(|v| significant(v, 2));
    let text = if predicted <= 0.0 {
        format!(
            "Corners scatter by {found} px in each coordinate, which makes the projection uncertain by {}.",
            px(cost)
        )
    } else if sigma0 > 1.3 * predicted {
        format!(
            "Corners miss by {found} px where noise and contrast of the pictures explain {expected} px: the rest is no noise."
        )
    } else {
        format!("Corners scatter by {found} px; noise and contrast of the pictures let expect {expected} px.")
    };
    Card {
        px: cost,
        text,
        show: Show::Errors,
        remedy: Some(Remedy::AddPictures),
        advice: "More light, a steadier camera, more pictures".to_owned(),
    }
}
