//! Figures 2 to 8 of the document, from the measurements.

use super::{
    document::RMS_PX,
    evidence::{COLUMNS, EXACT, Evidence},
    pipeline::Run,
};
use crate::calib::{
    Result,
    figure::{self, Bar, Grid, Pair, Panel, Scale},
    image::{Gray, Photo, Samples},
    undistort::{self, Framing, Interpolation, Straightener},
};

/// A figure to be written.
#[derive(Clone, Debug)]
pub struct Figure {
    /// File name.
    pub file: String,
    /// What it shows.
    pub caption: String,
    /// The drawing.
    pub panel: Panel,
}

/// Views that Figure 3 shows, from 0.
const ORDERED: [usize; 6] = [0, 1, 4, 7, 9, 14];
/// Views that Figure 5 shows, from 0.
const OVERLAID: [usize; 4] = [0, 9, 10, 14];
/// Views that Figure 7 shows, from 0.
const STRAIGHTENED: [usize; 3] = [0, 9, 14];
/// By how much residuals are drawn longer in Figure 5.
const CRUDE_TIMES: f64 = 60.0;
/// The same with the exact renderer.
const EXACT_TIMES: f64 = 3000.0;
/// Error that the document calls acceptable, px.
const THRESHOLD_PX: f64 = 1.0;

/// All figures, in the order of the document.
///
/// # Errors
/// Those of the undistortion.
pub fn all(e: &Evidence) -> Result<Vec<Figure>> {
    let exact = &e.runs[EXACT];
    let figure = |file: &str, caption: String, panel| Figure { file: file.to_owned(), caption, panel };
    let crude = |i: usize| format!("{}: renderer of the document", COLUMNS[i]);
    Ok(vec![
        figure("figure_2.svg", "Figure 2: the pictures, exact renderer.".to_owned(), contact_sheet(exact)),
        figure(
            "figure_3.svg",
            "Figure 3: corners in the order of their indices; the first is ringed.".to_owned(),
            corner_order(exact),
        ),
        figure("figure_4_crude.svg", format!("Figure 4, {}.", crude(0)), errors(&e.runs[0])),
        figure("figure_4.svg", "Figure 4, exact renderer, Straightedge.".to_owned(), errors(exact)),
        figure(
            "figure_tilt.svg",
            format!("Mean error of each view over its tilt: {}; {}.", COLUMNS[0], COLUMNS[EXACT]),
            Panel::beside(&[tilt(&e.runs[0], COLUMNS[0]), tilt(exact, COLUMNS[EXACT])]),
        ),
        figure(
            "figure_5_crude.svg",
            format!(
                "Figure 5, {}: green found, blue projected, red the residual, {CRUDE_TIMES} times as long.",
                crude(0)
            ),
            overlays(&e.runs[0], CRUDE_TIMES),
        ),
        figure(
            "figure_5.svg",
            format!("Figure 5, exact renderer, Straightedge; residuals {EXACT_TIMES} times as long."),
            overlays(exact, EXACT_TIMES),
        ),
        figure(
            "figure_6.svg",
            "Figure 6: places of the corners and their density.".to_owned(),
            coverage(exact),
        ),
        figure("figure_7.svg", "Figure 7: as taken and undistorted, α = 1.".to_owned(), undistorted(exact)?),
        figure(
            "figure_8.svg",
            "Figure 8: displacement by the lens: Δx, Δy, length.".to_owned(),
            displacement(exact)?,
        ),
        figure(
            "figure_uncertainty.svg",
            format!(
                "Projection uncertainty, 1σ: with the exact renderer, and at the document's RMS of {RMS_PX} px with the same corners."
            ),
            uncertainty(e),
        ),
    ])
}

fn name(run: &Run, view: usize) -> String {
    let pose = run.setup.scene.poses.get(view).map_or("", |p| &p.description);
    format!("{}: {pose}", view + 1)
}

fn contact_sheet(run: &Run) -> Panel {
    let named: Vec<_> = run.pictures.iter().enumerate().map(|(i, p)| (name(run, i), p)).collect();
    figure::contact_sheet(&named, 5)
}

fn corner_order(run: &Run) -> Panel {
    let size = run.setup.scene.board.size;
    let one = |&view: &usize| {
        let (picture, seen) = (run.pictures.get(view)?, run.seen.get(view)?);
        Some(figure::corner_order(picture, size, &seen.corners, &name(run, view)))
    };
    Panel::grid(&ORDERED.iter().filter_map(one).collect::<Vec<_>>(), 3)
}

fn errors(run: &Run) -> Panel {
    let bar = |v: &super::pipeline::ViewNumbers| Bar {
        name: v.view.to_string(),
        mean_px: v.mean_px,
        max_px: v.max_px,
    };
    let bars: Vec<Bar> = run.view_numbers().iter().map(bar).collect();
    let all = run.residuals_px();
    Panel::beside(&[
        figure::error_bars(&bars, run.calibration.rms_px, THRESHOLD_PX),
        figure::histogram(&all),
        figure::cumulative(&all, run.errors().p95),
    ])
}

fn tilt(run: &Run, title: &str) -> Panel {
    let points: Vec<_> =
        run.view_numbers().iter().map(|v| (v.tilt_deg, v.mean_px, v.view.to_string())).collect();
    figure::error_versus(&points, title, "Tilt, °", "Mean error, px")
}

fn overlays(run: &Run, times: f64) -> Panel {
    let one = |&view: &usize| {
        let picture = run.pictures.get(view)?;
        let placed = run.placed();
        let pairs: Vec<Pair> = placed
            .iter()
            .filter(|p| p.view == view)
            .map(|p| Pair { detected_px: p.px, projected_px: p.px - p.residual_px })
            .collect();
        Some(figure::reprojection(picture, &pairs, times, &name(run, view)))
    };
    Panel::grid(&OVERLAID.iter().filter_map(one).collect::<Vec<_>>(), 2)
}

fn coverage(run: &Run) -> Panel {
    let (points, size) = (run.points_px(), run.setup.scene.camera.size_px);
    Panel::beside(&[figure::coverage_points(&points, size, &[]), figure::coverage_density(&points, size, 20)])
}

fn undistorted(run: &Run) -> Result<Panel> {
    let straightener = Straightener::new(run.camera(), &Framing::flat(1.0), false)?;
    let mut rows = Vec::new();
    for view in STRAIGHTENED {
        let Some(before) = run.pictures.get(view) else { continue };
        let photo = Photo {
            width: before.width(),
            height: before.height(),
            channels: 1,
            samples: Samples::U8(before.data().to_vec()),
        };
        let after = match straightener.run(&photo, Interpolation::Lanczos)?.gray() {
            Gray::U8(plane) => plane,
            Gray::U16(plane) => plane.map(|v| (v >> 8) as u8),
        };
        rows.push(figure::before_after(before, &after, &name(run, view)));
    }
    Ok(Panel::stacked(&rows))
}

fn displacement(run: &Run) -> Result<Panel> {
    let d = undistort::displacement(run.camera(), 10)?;
    let size = run.camera().size_px;
    let grid = |f: fn([f32; 2]) -> f32| Grid {
        columns: d.nodes[0],
        rows: d.nodes[1],
        values: d.field.iter().map(|v| v.map_or(f64::NAN, |v| f64::from(f(v)))).collect(),
    };
    Ok(Panel::beside(&[
        figure::map("Δx", "px", &grid(|v| v[0]), size, Scale::Diverging),
        figure::map("Δy", "px", &grid(|v| v[1]), size, Scale::Diverging),
        figure::map("Length", "px", &grid(|v| v[0].hypot(v[1])), size, Scale::Sequential),
    ]))
}

fn uncertainty(e: &Evidence) -> Panel {
    let map = |run: &Run, title: &str, scale: f64| {
        let grid = run.uncertainty().grid_px;
        let values: Vec<f64> = grid.iter().flatten().map(|v| v.map_or(f64::NAN, |v| v * scale)).collect();
        let grid = Grid { columns: values.len() / grid.len().max(1), rows: grid.len(), values };
        figure::map(title, "1σ, px", &grid, run.camera().size_px, Scale::Logarithmic)
    };
    let its = &e.runs[super::evidence::EXACT_ITS];
    Panel::beside(&[
        map(&e.runs[EXACT], "Exact renderer, Straightedge", 1.0),
        map(its, "At the document's RMS", RMS_PX / its.calibration.rms_px),
    ])
}
