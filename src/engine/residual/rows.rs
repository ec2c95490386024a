//! The corners of a calibration as rows of a least-squares problem.

use nalgebra::{Vector2, Vector3};

use super::grid::Grid;
use crate::{
    camera::Camera,
    solution::{Calibration, View},
    stats::quantile,
    surface::{Row, ViewRows, by_motion, usual_weights},
    target::Target,
};

/// Standard deviations of one coordinate beyond which a corner is not believed.
const OUTLIER: f64 = 5.0;
/// Median length of a two-dimensional standard normal vector.
const MEDIAN_LENGTH: f64 = 1.177_410_022_515_474_7;

/// All views whose corners the model sees.
pub(super) fn of(calibration: &Calibration, target: &Target, grid: &Grid) -> Vec<ViewRows> {
    let views = calibration.views.iter();
    views.filter_map(|view| of_view(&calibration.camera, view, target, grid)).collect()
}

fn of_view(camera: &Camera, view: &View, target: &Target, grid: &Grid) -> Option<ViewRows> {
    let points = view.points_in_camera(target)?;
    let middle = points.iter().sum::<Vector3<f64>>() / points.len() as f64;
    let rows: Option<Vec<Row>> = points
        .iter()
        .zip(&view.indices)
        .zip(view.residuals_px.iter().zip(&view.weights))
        .map(|((point, index), (residual, weight))| {
            let there = (camera.spec().project)(&camera.params, point)?;
            Some(Row {
                index: *index,
                seen_px: there.px + residual,
                patch: grid.patch(&there.px),
                by_pose: by_motion(&there.by_point, &(point - middle)),
                residual: *residual,
                weight: *weight,
            })
        })
        .collect();
    Some(ViewRows { rows: rows?, group: 0 })
}

/// Gives corners that the robust loss doubted and that a field fitted without their picture explains the usual weight of their
/// view, and none to those that are beyond it: from now on neither is judged by the model alone. `left` is what that field
/// leaves of each corner, px. Answers whether anything changed.
pub(super) fn believe_again(views: &mut [ViewRows], left: &[Vec<Vector2<f64>>], sigma0_px: f64) -> bool {
    let mut lengths: Vec<f64> = views
        .iter()
        .zip(left)
        .flat_map(|(v, l)| v.rows.iter().zip(l).map(|(row, r)| row.weight.sqrt() * r.norm()))
        .collect();
    lengths.sort_by(f64::total_cmp);
    let scale = quantile(&lengths, 0.5) / MEDIAN_LENGTH;
    let mut changed = false;
    for (view, left) in views.iter_mut().zip(left) {
        let weights: Vec<f64> = view.rows.iter().map(|r| r.weight).collect();
        let residuals: Vec<Vector2<f64>> = view.rows.iter().map(|r| r.residual).collect();
        let usual = usual_weights(&weights, &residuals, sigma0_px);
        for ((row, usual), left) in view.rows.iter_mut().zip(usual).zip(left) {
            if usual == row.weight {
                continue;
            }
            row.weight = if usual.sqrt() * left.norm() <= OUTLIER * scale { usual } else { 0.0 };
            changed = true;
        }
    }
    changed
}
