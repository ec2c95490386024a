//! The board is not what it is said to be.

use nalgebra::{Matrix3, Vector3};

use super::{Alternative, Best, Capture, Hypothesis, Words, column::Column, size};
use crate::calib::target::Target;

/// A board that is bowed or twisted: heights s², st, t² over it.
pub(super) const BOWED: Hypothesis = Hypothesis {
    code: "bowed_board",
    alternatives: |capture| {
        // The heights of surveyed points are known.
        if matches!(capture.target, Target::Points { .. }) {
            return Vec::new();
        }
        Alternative::of_all(BOW.map(|c| capture.everywhere(c)).to_vec())
    },
    words: |capture, best| {
        let height = sagitta(capture, &best.theta);
        let unit = capture.report.settings.unit.name();
        // Curvature along the columns and the rows, and what twists.
        let [xx, xy, yy] = [0, 1, 2].map(|k| best.theta.get(k).copied().unwrap_or_default());
        let ratio = sides(capture);
        let (xy, yy) = (xy.abs() * ratio[0] * ratio[1], yy * ratio[1] * ratio[1]);
        let xx = xx * ratio[0] * ratio[0];
        let shape = if xy > xx.abs().max(yy.abs()) {
            "twisted"
        } else if xx * yy > 0.0 && xx.abs().min(yy.abs()) > 0.3 * xx.abs().max(yy.abs()) {
            "bowed like a bowl"
        } else if xx.abs() > yy.abs() {
            "bowed along its columns"
        } else {
            "bowed along its rows"
        };
        Words {
            title: "The board was not flat".to_owned(),
            size: format!("{shape} by {}", size(height, unit)),
            value: height,
            unit: unit.to_owned(),
        }
    },
};

const BOW: [Column; 3] = [Column::BowXx, Column::BowXy, Column::BowYy];

/// Half the sides in units of the longer one's.
fn sides(capture: &Capture<'_>) -> [f64; 2] {
    let [[x0, y0], [x1, y1]] = capture.target.extent();
    [x1 - x0, y1 - y0].map(|s| 0.5 * s / capture.fixed.half)
}

/// From the lowest to the highest corner above the plane that fits best.
fn sagitta(capture: &Capture<'_>, theta: &[f64]) -> f64 {
    let points = capture.target.points_in_board();
    let fixed = &capture.fixed;
    let heights: Vec<(Vector3<f64>, f64)> = points
        .iter()
        .map(|p| {
            let flat = (p - fixed.middle) / fixed.half;
            let z = BOW.iter().zip(theta).map(|(c, v)| c.height(&flat) * v).sum();
            (Vector3::new(flat.x, flat.y, 1.0), z)
        })
        .collect();
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for (row, z) in &heights {
        normal += row * row.transpose();
        right += row * *z;
    }
    let Some(plane) = normal.cholesky().map(|c| c.solve(&right)) else { return 0.0 };
    let off = heights.iter().map(|(row, z)| z - plane.dot(row));
    let [low, high] = off.fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], z| [l.min(z), h.max(z)]);
    (high - low).max(0.0)
}

/// Squares that are not square: a printer that stretches paper in one direction.
pub(super) const ASPECT: Hypothesis = Hypothesis {
    code: "board_aspect",
    alternatives: |capture| {
        if matches!(capture.target, Target::Points { .. }) {
            return Vec::new();
        }
        Alternative::of_all(vec![capture.everywhere(Column::Aspect)])
    },
    words: |_, best: &Best| {
        let percent = 100.0 * best.theta.first().copied().unwrap_or_default();
        let longer = if percent > 0.0 { "longer" } else { "shorter" };
        Words {
            title: "The squares of the board are not square".to_owned(),
            size: format!("{} {longer} along the rows than across them", size(percent, "%")),
            value: percent,
            unit: "%".to_owned(),
        }
    },
};
