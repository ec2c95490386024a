//! Figures of the report as files.

use std::sync::Arc;

use nalgebra::Vector2;

use crate::calib::{
    figure::{Bar, Panel, coverage_density, coverage_points, cumulative, error_bars, histogram},
    report::{Report, Solution},
};

/// Name of the file and how it is drawn.
type Figure = (&'static str, fn(&Report, &Solution) -> Panel);

const FIGURES: &[Figure] = &[
    ("errors_by_picture", |report, solution| {
        let bar = |(i, f): (usize, &crate::calib::report::FrameReport)| Bar {
            name: (i + 1).to_string(),
            mean_px: f.errors_px().sum::<f64>() / f.residuals_px.len().max(1) as f64,
            max_px: f.max_px.unwrap_or(0.0),
        };
        error_bars(&report.included().enumerate().map(bar).collect::<Vec<_>>(), solution.rms_px, 1.0)
    }),
    ("error_histogram", |report, _| histogram(&errors(report))),
    ("error_share", |report, solution| cumulative(&errors(report), solution.stats.p95)),
    ("corners", |report, solution| coverage_points(&corners(report), solution.camera.size_px)),
    ("density", |report, solution| coverage_density(&corners(report), solution.camera.size_px, 20)),
];

fn errors(report: &Report) -> Vec<f64> {
    report.included().flat_map(|f| f.errors_px()).collect()
}

fn corners(report: &Report) -> Vec<Vector2<f64>> {
    report.included().flat_map(|f| f.corners.iter().map(|c| c.px)).collect()
}

/// All figures: file names and SVG.
pub(super) fn all(report: &Report) -> Vec<(String, Arc<Vec<u8>>)> {
    let Some(solution) = &report.solution else { return Vec::new() };
    let file =
        |(name, draw): &Figure| (format!("{name}.svg"), Arc::new(draw(report, solution).svg().into_bytes()));
    FIGURES.iter().map(file).collect()
}
