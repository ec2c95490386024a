//! Figures of the page.

use super::text::escape;
use crate::calib::{
    camera::Camera,
    figure::{
        Grid, Panel, Scale, THRESHOLD_PX, coverage_density, coverage_points, cumulative, error_bars,
        error_versus, histogram, map,
    },
    number::significant,
    report::{Report, Solution},
    undistort::{displacement, reach},
};

/// Cells of a map along the longer side of the picture.
const CELLS: u32 = 80;

/// A figure with its caption.
pub(in super::super) fn figure(panel: &Panel, caption: &str) -> String {
    // Inside HTML an SVG needs no name space.
    let svg = panel.svg().replace(" xmlns=\"http://www.w3.org/2000/svg\"", "");
    format!("<figure>\n{svg}<figcaption>{}</figcaption>\n</figure>\n", escape(caption))
}

pub(in super::super) fn row(figures: &[String]) -> String {
    format!("<div class=\"figures\">\n{}</div>\n", figures.concat())
}

pub(super) fn errors(report: &Report, solution: &Solution) -> String {
    let all = report.errors_px();
    row(&[
        figure(
            &error_bars(&report.bars(), solution.rms_px, THRESHOLD_PX),
            "Mean error of each picture used, in the order of the table below; whiskers end at the worst corner.",
        ),
        figure(&histogram(&all), "Errors of single corners."),
        figure(&cumulative(&all, solution.stats.p95), "Share of the corners below an error."),
    ])
}

pub(super) fn coverage(report: &Report, solution: &Solution) -> String {
    let size = solution.camera.size_px;
    let points = report.corners_px();
    row(&[
        figure(
            &coverage_points(&points, size),
            "Where corners were seen. What lies outside is extrapolated.",
        ),
        figure(&coverage_density(&points, size, 20), "Corners in each cell."),
        certainty(solution),
    ])
}

/// The map of the projection's certainty.
fn certainty(solution: &Solution) -> String {
    let rows = &solution.uncertainty.grid_px;
    let columns = rows.first().map_or(0, Vec::len);
    let values: Vec<f64> = rows.iter().flatten().map(|v| v.unwrap_or(f64::NAN)).collect();
    if columns == 0 || values.len() != columns * rows.len() {
        return String::new();
    }
    let grid = Grid { columns, rows: rows.len(), values };
    figure(
        &map("Uncertainty of the projection", "1 σ, px", &grid, solution.camera.size_px, Scale::Sequential),
        "By how much the projection would scatter if the calibration were repeated, at the boards' distance; grey where it is not determined.",
    )
}

pub(super) fn distortion(camera: &Camera) -> String {
    let size = camera.size_px;
    let step = (size[0].max(size[1]) / CELLS).max(1);
    let field = match displacement(camera, step) {
        Ok(field) => field,
        Err(error) => return format!("<p>{}</p>\n", escape(&error.to_string())),
    };
    let [columns, rows] = field.nodes;
    let grid = |f: &dyn Fn([f32; 2]) -> f64| Grid {
        columns,
        rows,
        values: field.field.iter().map(|d| d.map_or(f64::NAN, f)).collect(),
    };
    let maps = [
        ("Δx", grid(&|[x, _]| f64::from(x)), Scale::Diverging, "To the right positive."),
        ("Δy", grid(&|[_, y]| f64::from(y)), Scale::Diverging, "Downwards positive."),
        (
            "Magnitude",
            grid(&|[x, y]| f64::from(x).hypot(f64::from(y))),
            Scale::Sequential,
            "Length of the displacement.",
        ),
    ];
    let reach = reach(camera);
    let inverted = if reach.beyond > 0.0 {
        format!(
            "The model turns back at {:.1}° off the axis: {:.1} % of the picture lies beyond and cannot be undistorted.",
            reach.angle_rad.to_degrees(),
            100.0 * reach.beyond
        )
    } else {
        "The model can be inverted over the whole picture.".to_owned()
    };
    let [x, y] = field.largest_at;
    let figures: Vec<String> = maps
        .iter()
        .map(|(title, grid, scale, caption)| figure(&map(title, "px", grid, size, *scale), caption))
        .collect();
    format!(
        "<p>How far the lens moves what a camera without distortion would show. Largest: {}\u{a0}px at ({x}, {y}), {}\u{a0}% of the \
         diagonal. {inverted}</p>\n{}",
        significant(field.largest_px, 3),
        significant(field.largest_percent, 3),
        row(&figures)
    )
}

/// Error against tilt and distance of the board.
pub(super) fn stance(report: &Report) -> String {
    let points = |x: &dyn Fn(&crate::calib::report::FrameReport) -> Option<f64>| -> Vec<(f64, f64, String)> {
        report
            .included()
            .enumerate()
            .filter_map(|(i, f)| Some((x(f)?, f.rms_px?, (i + 1).to_string())))
            .collect()
    };
    let tilt = points(&|f| f.tilt_rad.map(f64::to_degrees));
    if tilt.is_empty() {
        return String::new();
    }
    let unit = report.settings.unit.name();
    let says = |trend: Option<crate::calib::stats::Trend>| match trend {
        Some(t) if t.is_significant() => {
            format!("The error changes with it (r = {:.2}, 95 % level).", t.correlation)
        }
        Some(t) => format!("No more than chance (r = {:.2}).", t.correlation),
        None => "Too few pictures for a trend.".to_owned(),
    };
    let trends = report.solution.as_ref().map(|s| s.trends).unwrap_or_default();
    row(&[
        figure(
            &error_versus(&tilt, "Error against tilt", "Tilt of the board, °", "RMS of the picture, px"),
            &says(trends.rms_by_tilt_rad),
        ),
        figure(
            &error_versus(
                &points(&|f| f.distance),
                "Error against distance",
                &format!("Distance of the board, {unit}"),
                "RMS of the picture, px",
            ),
            &says(trends.rms_by_distance),
        ),
    ])
}
