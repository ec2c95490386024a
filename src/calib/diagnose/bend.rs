//! Whether the board was flat: heights of its corners that explain what is left of the errors.

use nalgebra::{Matrix3, Vector2, Vector3};

use super::Facts;
use crate::calib::{stats::chi2_below, target::Target};

/// A board whose corners do not lie in one plane.
pub(super) struct Bend {
    /// From the lowest to the highest corner, in the unit of the square.
    pub(super) height: f64,
    /// RMS of what the heights explain, px.
    pub(super) explained_px: f64,
}

/// Share of the squared errors that heights must explain to be worth a word.
const NOTABLE: f64 = 0.15;

/// The bend of the board; none where there is no sign of one.
///
/// One height for each corner of the board, the same in all pictures, is fitted to the residuals as they are:
/// hⱼ = Σ gᵢⱼ·rᵢⱼ / Σ gᵢⱼ², g = ∂px/∂height. The poses took what they could of a bend before, so the heights are a lower
/// bound. Under a flat board the squares explained follow χ² with as many degrees of freedom as there are heights.
pub(super) fn of(facts: &Facts<'_>) -> Option<Bend> {
    let solution = facts.solution?;
    // The heights of surveyed points are known.
    let target = facts.report.settings.target().filter(|t| !matches!(t, Target::Points { .. }))?;
    let mut sums: Vec<[f64; 2]> = Vec::new();
    let (mut total, mut count) = (0.0, 0usize);
    for (_, frame) in &facts.used {
        let pose = frame.camera_from_board()?;
        let normal: Vector3<f64> = pose.matrix() * Vector3::z();
        for (corner, r) in frame.corners.iter().zip(&frame.residuals_px) {
            let Some(point) = target.point_in_board(corner.index) else { continue };
            if frame.outliers.contains(&corner.index) {
                continue;
            }
            let place = pose.apply(&point).coords;
            let Some(projection) = (solution.camera.spec().project)(&solution.camera.params, &place) else {
                continue;
            };
            let (g, r) = (projection.by_point * normal, Vector2::from(*r));
            let j = corner.index as usize;
            sums.resize(sums.len().max(j + 1), [0.0; 2]);
            sums[j][0] += g.dot(&r);
            sums[j][1] += g.norm_squared();
            total += r.norm_squared();
            count += 1;
        }
    }
    let seen = || sums.iter().enumerate().filter(|(_, s)| s[1] > 0.0);
    let explained: f64 = seen().map(|(_, [gr, gg])| gr * gr / gg).sum();
    let heights = seen().count();
    let freedom = (2 * count).checked_sub(heights + 6 * facts.used.len()).filter(|n| *n > 0)?;
    let variance = (total - explained) / freedom as f64;
    let by_chance = variance <= 0.0 || chi2_below(explained / variance, heights) < 0.9999;
    if heights < 12 || by_chance || explained < NOTABLE * total {
        return None;
    }
    // What is left of a plane says nothing about the bend.
    let points: Vec<Vector3<f64>> = seen()
        .filter_map(|(j, [gr, gg])| {
            let p = target.point_in_board(j as u32)?;
            Some(Vector3::new(p.x, p.y, gr / gg))
        })
        .collect();
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for p in &points {
        let row = Vector3::new(p.x, p.y, 1.0);
        normal += row * row.transpose();
        right += row * p.z;
    }
    let plane = normal.cholesky()?.solve(&right);
    let off = points.iter().map(|p| p.z - plane.dot(&Vector3::new(p.x, p.y, 1.0)));
    let [low, high] =
        off.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], z| [low.min(z), high.max(z)]);
    Some(Bend { height: high - low, explained_px: (explained / count as f64).sqrt() })
}
