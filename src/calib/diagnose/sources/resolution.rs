//! Pixels that are too coarse.

use super::{Card, Facts, Show, beyond};
use crate::calib::{number::significant, stats::quantile};

/// What the pixel grid does to edges that run along it, px: the floor of every corner.
const GRID_PX: f64 = 0.004;
/// Scatter of corners on small squares beside that on large ones from which it is one.
const LARGER: f64 = 1.15;

pub(super) fn card(facts: &Facts<'_>) -> Card {
    let capture = facts.capture;
    let sigma0 = capture.calibration.sigma0_px.max(f64::MIN_POSITIVE);
    let squares = squares_px(facts);
    let mut sizes: Vec<f64> = squares.iter().map(|s| s.0).collect();
    sizes.sort_by(f64::total_cmp);
    let middle = quantile(&sizes, 0.5);
    let scatter = |large: bool| {
        let own = squares.iter().filter(|s| (s.0 >= middle) == large).map(|s| s.1);
        let (sum, n) = own.fold((0.0, 0usize), |(sum, n), v| (sum + v, n + 1));
        (sum / n.max(1) as f64).sqrt()
    };
    let [small, large] = [scatter(false), scatter(true)];
    let all = ((small * small + large * large) / 2.0).sqrt();
    let coarse =
        if small > LARGER * large && all > 0.0 { capture.sigma_px * beyond(1.0, large / all) } else { 0.0 };
    let cost = coarse.max(capture.sigma_px * (GRID_PX / sigma0).min(1.0));
    let camera = &capture.calibration.camera;
    let [w, h] = camera.size_px.map(f64::from);
    let degrees = (1.0 / camera.intrinsics()[0]).atan().to_degrees();
    let says = if coarse > 0.0 {
        format!(
            "corners on the smaller half of them err by {} times those on the larger",
            significant(small / large, 2)
        )
    } else {
        "corners on small ones err no more than on large ones".to_owned()
    };
    let text = format!(
        "Squares of {middle:.0} px (median), {} megapixels, {}° a pixel: {says}.",
        significant(w * h * 1e-6, 2),
        significant(degrees, 2)
    );
    Card {
        px: cost,
        text,
        show: Show::Errors,
        remedy: None,
        advice: "Larger squares, or a sensor with more pixels".to_owned(),
    }
}

/// Distance to the nearest other corner of the board, and square of the error, of each used corner, px.
pub(super) fn squares_px(facts: &Facts<'_>) -> Vec<(f64, f64)> {
    let mut list = Vec::new();
    for (view, seen) in facts.capture.calibration.views.iter().zip(&facts.capture.fixed.views) {
        for (j, px) in seen.observed.iter().enumerate() {
            // Neighbours have neighbouring indices, or are a row away: the nearest of all is one of them.
            let others = seen.observed.iter().enumerate().filter(|(k, _)| *k != j);
            let nearest = others.map(|(_, other)| (px - other).norm_squared()).fold(f64::INFINITY, f64::min);
            if nearest.is_finite() && !view.outliers.contains(&view.indices[j]) {
                list.push((nearest.sqrt(), view.residuals_px[j].norm_squared() / 2.0));
            }
        }
    }
    list
}
