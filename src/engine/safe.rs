//! Where in the picture a calibration can be relied on: where corners were, the projection is known, and the model does not fold.
//!
//! A pixel is **unsafe** where the model has no ray for it, where 1σ of the projection (at the boards' distance) is above a thousandth
//! of the picture's diagonal, or where no corner lies within a tenth of the diagonal: there the model extrapolates, whatever its σ says.
//! The rest is bounded by a polygon, as other programs keep it (mrcal's `valid_intrinsics_region`).

mod outline;
mod shown;

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

use super::{
    camera::Camera,
    number::{percent, significant},
    uncertainty::Uncertainty,
};
pub use shown::{Shown, widest_alpha};

/// Largest σ that is safe, in diagonals of the picture.
const LIMIT: f64 = 1e-3;
/// Farthest from a corner that is safe, in diagonals of the picture.
const FAR: f64 = 0.1;
/// Cells of the sampling along the longer side of the picture.
const CELLS: f64 = 48.0;

/// The part of the picture that a calibration supports.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SafeRegion {
    /// Its border: `[x, y]` px, the last joins the first; empty where nothing is safe.
    pub polygon_px: Vec<[f64; 2]>,
    /// Its share of the picture's area.
    pub fraction: f64,
    /// Largest σ in it, px.
    pub limit_px: f64,
    /// Farthest from a corner in it, px.
    pub far_px: f64,
}

impl SafeRegion {
    /// Of a calibrated camera, by its corners and its certainty over the picture.
    pub fn new(camera: &Camera, corners_px: &[Vector2<f64>], uncertainty: &Uncertainty) -> Self {
        let [w, h] = camera.size_px.map(f64::from);
        let diagonal = w.hypot(h);
        let (limit_px, far_px) = (LIMIT * diagonal, FAR * diagonal);
        let (sigma_log, corners) =
            (SigmaLog::new(uncertainty, [w, h]), Near::new(corners_px, [w, h], far_px));
        // How far beyond the bounds: up to 0 is safe.
        let beyond = |px: &Vector2<f64>| {
            if camera.unproject(px).is_none() {
                return 1.0;
            }
            let uncertain = sigma_log.at(px) - limit_px.ln();
            if uncertain >= 1.0 {
                return 1.0;
            }
            uncertain.max(corners.distance(px) / far_px - 1.0).clamp(-1.0, 1.0)
        };
        let polygon_px = outline::of([w, h], CELLS, beyond);
        let fraction = (area(&polygon_px).abs() / (w * h)).min(1.0);
        Self { polygon_px, fraction, limit_px, far_px }
    }
}

impl SafeRegion {
    /// In words: `71 % of the picture (σ at most 0.80 px, a corner within 80 px)`.
    pub fn words(&self) -> String {
        format!(
            "{} of the picture (σ at most {} px, a corner within {:.0} px)",
            percent(self.fraction),
            significant(self.limit_px, 2),
            self.far_px
        )
    }
}

/// Whether a polygon holds a point (even–odd rule).
pub fn contains(polygon: &[[f64; 2]], px: &Vector2<f64>) -> bool {
    let mut inside = false;
    for (k, [bx, by]) in polygon.iter().enumerate() {
        let [ax, ay] = polygon[(k + polygon.len() - 1) % polygon.len()];
        if (ay > px.y) != (*by > px.y) && px.x < ax + (px.y - ay) / (by - ay) * (bx - ax) {
            inside = !inside;
        }
    }
    inside
}

/// A polygon within the picture of `[width, height]` px: its parts beyond the border are cut off (Sutherland and Hodgman, 1974).
pub fn clipped(polygon: &[[f64; 2]], size_px: [u32; 2]) -> Vec<[f64; 2]> {
    let mut rest = polygon.to_vec();
    for axis in 0..2 {
        let high = f64::from(size_px[axis]) - 0.5;
        for (edge, sign) in [(-0.5, 1.0), (high, -1.0)] {
            let depth = |p: &[f64; 2]| sign * (p[axis] - edge);
            let list = std::mem::take(&mut rest);
            for (k, b) in list.iter().enumerate() {
                let a = &list[(k + list.len() - 1) % list.len()];
                let (da, db) = (depth(a), depth(b));
                if (da >= 0.0) != (db >= 0.0) {
                    let t = da / (da - db);
                    rest.push([a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])]);
                }
                if db >= 0.0 {
                    rest.push(*b);
                }
            }
        }
    }
    rest
}

/// Area of a polygon, positive where its points go around clockwise on the screen.
fn area(polygon: &[[f64; 2]]) -> f64 {
    let next = |k: usize| polygon[(k + 1) % polygon.len()];
    0.5 * polygon.iter().enumerate().map(|(k, [x, y])| x * next(k)[1] - next(k)[0] * y).sum::<f64>()
}

/// Corners by the square cell that they lie in, as large as what is still near: only neighbouring cells need to be looked through.
struct Near {
    cell_px: f64,
    /// Columns and rows; what lies beyond the picture is in the outermost.
    size: [usize; 2],
    cells: Vec<Vec<Vector2<f64>>>,
}

impl Near {
    fn new(corners_px: &[Vector2<f64>], picture: [f64; 2], cell_px: f64) -> Self {
        let size = picture.map(|n| (n / cell_px) as usize + 1);
        let mut near = Self { cell_px, size, cells: vec![Vec::new(); size[0] * size[1]] };
        for corner in corners_px {
            let [i, j] = near.cell(corner);
            near.cells[j * size[0] + i].push(*corner);
        }
        near
    }

    fn cell(&self, px: &Vector2<f64>) -> [usize; 2] {
        std::array::from_fn(|axis| ((px[axis] / self.cell_px) as usize).min(self.size[axis] - 1))
    }

    /// Distance of the nearest corner, px; of those farther than two cells, some larger number.
    fn distance(&self, px: &Vector2<f64>) -> f64 {
        let [columns, rows] = self.size;
        let [i, j] = self.cell(px);
        let mut least = f64::INFINITY;
        for row in j.saturating_sub(2)..(j + 3).min(rows) {
            for corners in &self.cells[row * columns..][i.saturating_sub(2)..(i + 3).min(columns)] {
                least = corners.iter().fold(least, |least, corner| least.min((corner - px).norm_squared()));
            }
        }
        least.sqrt()
    }
}

/// ln σ where there is no σ.
const NONE: f64 = 50.0;

/// ln σ over the picture.
struct SigmaLog {
    /// Of the middles of the cells, row by row.
    grid: Vec<f64>,
    cells: [usize; 2],
    size: [f64; 2],
}

impl SigmaLog {
    fn new(uncertainty: &Uncertainty, size: [f64; 2]) -> Self {
        let rows = &uncertainty.grid_px;
        let log = |v: &Option<f64>| v.map_or(NONE, |v| v.max(f64::MIN_POSITIVE).ln());
        let cells = [rows.first().map_or(0, Vec::len), rows.len()];
        Self { grid: rows.iter().flatten().map(log).collect(), cells, size }
    }

    /// At a pixel, linear between the middles of the cells and beyond them.
    fn at(&self, px: &Vector2<f64>) -> f64 {
        let value = |i: usize, j: usize| {
            let [columns, rows] = self.cells;
            let k = j.min(rows.saturating_sub(1)) * columns + i.min(columns.saturating_sub(1));
            self.grid.get(k).copied().unwrap_or(NONE)
        };
        let place = |v: f64, axis: usize| {
            let n = self.cells[axis];
            let x = (v + 0.5) / self.size[axis] * n as f64 - 0.5;
            let low = x.floor().clamp(0.0, (n.max(2) - 2) as f64);
            (low as usize, x - low)
        };
        let ((i, s), (j, t)) = (place(px.x, 0), place(px.y, 1));
        let along = |j: usize| (1.0 - s) * value(i, j) + s * value(i + 1, j);
        (1.0 - t) * along(j) + t * along(j + 1)
    }
}

#[cfg(test)]
mod tests;
