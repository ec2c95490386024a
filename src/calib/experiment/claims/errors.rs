//! Claims about the residuals.

use super::{Claim, Judgement};
use crate::calib::{
    Result,
    experiment::{
        document::{MEAN_PX, P95_PX, RMS_PX, STD_PX, TILT_EXCESS_PX, VIEW_1_PX, VIEW_10_PX},
        evidence::{EXACT, EXACT_ITS, Evidence, NEAR_PX, SHUFFLES, pattern},
        pipeline::ViewNumbers,
    },
    stats::{spatial::Moran, trend},
};

pub(super) const CLAIMS: &[Claim] = &[
    Claim { id: "rms", section: "V-D", says: "RMS 0.4832 px: below 0.5 px", judge: rms },
    Claim {
        id: "table_iv",
        section: "V-D",
        says: "Table IV: mean 0.4651, standard deviation 0.1438, RMS 0.4832 px",
        judge: table_iv,
    },
    Claim {
        id: "p95",
        section: "V-D",
        says: "95 % of the corners below 0.72 px, all below 1 px",
        judge: p95,
    },
    Claim { id: "tilt_trend", section: "V-E", says: "the error grows with the tilt", judge: tilt_trend },
    Claim {
        id: "extremes",
        section: "V-E",
        says: "view 1 (frontal) has the smallest error, view 10 the largest: 0.38 to 0.61 px",
        judge: extremes,
    },
    Claim {
        id: "steep_views",
        section: "VI-A",
        says: "views 10 and 11 exceed the frontal view by about 0.2 px",
        judge: steep_views,
    },
    Claim {
        id: "no_pattern",
        section: "V-E",
        says: "no spatial pattern in the residuals",
        judge: no_pattern,
    },
];

fn rms(e: &Evidence) -> Result<Judgement> {
    let rms = |i: usize| e.runs[i].calibration.rms_px;
    let because = format!(
        "By the same method and from the same poses, exact edges instead of vertices on whole pixels divide it by {:.1}, and better corners by {:.0}: it \
         is the error of the renderer, and says nothing about the calibration.",
        rms(0) / rms(EXACT_ITS),
        rms(0) / rms(EXACT)
    );
    Judgement::by_run(e, because, |run| {
        let rms = run.calibration.rms_px;
        Ok((format!("{rms:.4} px"), rms < 0.5))
    })
}

fn table_iv(_: &Evidence) -> Result<Judgement> {
    let implied = MEAN_PX.hypot(STD_PX);
    let because =
        format!("rms² = mean² + std², so these mean and deviation imply {implied:.4} px, not {RMS_PX}.");
    Ok(Judgement::plain((implied - RMS_PX).abs() < 2e-4, because))
}

fn p95(e: &Evidence) -> Result<Judgement> {
    Judgement::by_run(e, "", |run| {
        let s = run.errors();
        Ok((format!("{:.4}, largest {:.4} px", s.p95, s.max), s.p95 < P95_PX + 5e-4 && s.max < 1.0))
    })
}

fn tilt_trend(e: &Evidence) -> Result<Judgement> {
    let because = "Slope of each view's mean error over its tilt with its 95 % interval, and the correlation. A trend is one whose \
                   interval excludes zero.";
    Judgement::by_run(e, because, |run| {
        let points: Vec<_> = run.view_numbers().iter().map(|v| (v.tilt_deg, v.mean_px)).collect();
        Ok(trend(&points).map_or_else(
            || ("too few views".to_owned(), false),
            |t| {
                let [slope, low, high] = [t.slope, t.slope_ci95[0], t.slope_ci95[1]].map(|s| 10.0 * s);
                let text =
                    format!("{slope:+.4} ({low:+.4} … {high:+.4}) px per 10°, r = {:+.2}", t.correlation);
                (text, t.is_significant() && t.slope > 0.0)
            },
        ))
    })
}

/// Mean errors by view number.
fn mean_of(views: &[ViewNumbers], view: usize) -> f64 {
    views.iter().find(|v| v.view == view).map_or(f64::NAN, |v| v.mean_px)
}

fn extremes(e: &Evidence) -> Result<Judgement> {
    let because = format!("The document: {VIEW_1_PX} px (view 1) to {VIEW_10_PX} px (view 10).");
    Judgement::by_run(e, because, |run| {
        let mut views = run.view_numbers();
        views.sort_by(|a, b| a.mean_px.total_cmp(&b.mean_px));
        let (Some(least), Some(most)) = (views.first(), views.last()) else {
            return Ok((String::new(), false));
        };
        let text = format!(
            "{:.4} (view {}) … {:.4} px (view {})",
            least.mean_px, least.view, most.mean_px, most.view
        );
        Ok((text, least.view == 1 && most.view == 10))
    })
}

fn steep_views(e: &Evidence) -> Result<Judgement> {
    Judgement::by_run(e, "Mean error of view 10 and of view 11, minus that of view 1.", |run| {
        let views = run.view_numbers();
        let more = [10, 11].map(|v| mean_of(&views, v) - mean_of(&views, 1));
        let near = more.iter().all(|m| (m - TILT_EXCESS_PX).abs() < 0.05);
        Ok((format!("{:+.4}, {:+.4} px", more[0], more[1]), near))
    })
}

fn no_pattern(e: &Evidence) -> Result<Judgement> {
    let say = |m: &Moran| format!("I = {:+.3}, z = {:+.1}, p = {:.3}", m.index, m.z, m.p);
    let control = e.models.iter().find(|m| m.terms == "k1 k2").and_then(|m| m.pattern.as_ref());
    let control = control.map_or_else(String::new, |m| {
        format!(
            " On the exact pictures without p1 and p2 it gives {}: so it sees what a missing term leaves.",
            say(m)
        )
    });
    let because = format!(
        "Moran's I between residuals of different views that lie within {NEAR_PX} px of each other in the picture: what they share there is \
         the lens. Its chance p comes from {SHUFFLES} seeded shuffles within the views; a pattern is p < 0.01.{control}"
    );
    Judgement::by_run(e, because, |run| {
        let found = pattern(run);
        Ok((found.as_ref().map_or_else(String::new, say), found.is_some_and(|m| !m.is_significant())))
    })
}
