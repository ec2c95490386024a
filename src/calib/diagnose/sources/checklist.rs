//! The source document's rules for a capture, and whether they are needed here.

use serde::{Deserialize, Serialize};

use super::{NOTHING_PX, Source, degeneracy::LEAST_TILT_DEG};
use crate::calib::{diagnose::faults::Capture, number::significant, report::FrameReport, stats::quantile};

/// A rule of Section VI.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rule {
    /// What it asks for.
    pub text: String,
    /// What there is.
    pub value: String,
    /// Whether it is kept.
    pub kept: bool,
    /// Whether the uncertainty says that it need not be: the map is certain without.
    pub needless: bool,
}

pub(super) fn rules(capture: &Capture<'_>, cards: &[Source]) -> Vec<Rule> {
    let views: Vec<&FrameReport> = capture.report.included().collect();
    let most = |of: fn(&FrameReport) -> Option<f64>| {
        views.iter().filter_map(|f| of(f)).fold(0.0f64, |m, v| m.max(v.abs()))
    };
    let tilts: Vec<f64> = views.iter().filter_map(|f| f.tilt_rad.map(f64::to_degrees)).collect();
    let tilted = tilts.iter().filter(|t| **t >= LEAST_TILT_DEG).count();
    // A board looks the same after half a turn.
    let roll = most(|f| f.roll_rad.map(|r| r.sin().abs().asin())).to_degrees();
    let mut squares: Vec<f64> = capture
        .fixed
        .views
        .iter()
        .flat_map(|seen| seen.observed.windows(2).map(|pair| (pair[0] - pair[1]).norm()))
        .collect();
    squares.sort_by(f64::total_cmp);
    let square = quantile(&squares, 0.1);
    let [w, h] = capture.calibration.camera.size_px.map(f64::from);
    let megapixels = w * h * 1e-6;
    // Certain, and nothing systematic.
    let fine = capture.sigma_px < NOTHING_PX && cards.iter().all(|c| c.px < NOTHING_PX);
    let rule = |text: &str, value: String, kept: bool| Rule {
        text: text.to_owned(),
        value,
        kept,
        needless: fine && !kept,
    };
    vec![
        rule("At least 20 pictures", views.len().to_string(), views.len() >= 20),
        rule(
            "Every board tilted by 15° or more",
            format!("{tilted} of {}", tilts.len()),
            tilted == tilts.len(),
        ),
        rule("Boards turned by more than 30°", format!("{roll:.0}°"), roll > 30.0),
        rule("Squares of at least 20 px", format!("{square:.0} px"), square >= 20.0),
        rule("At least 2 megapixels", significant(megapixels, 2), megapixels >= 2.0),
    ]
}
