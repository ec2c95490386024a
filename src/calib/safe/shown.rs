//! How much of a straightened picture lies beyond the safe region.

use nalgebra::Vector2;

use super::contains;
use crate::calib::{
    Result,
    lens::Lens,
    undistort::{Framing, View},
};

/// Cells along the longer side of the straightened picture.
const CELLS: usize = 48;
/// Share of the shown pixels that may be unsafe: less than what the sampling can tell.
const NOTHING: f64 = 1e-3;

/// What a straightened picture shows, in equal cells.
#[derive(Clone, Debug, PartialEq)]
pub struct Shown {
    /// Cells along x.
    pub columns: usize,
    /// Row by row: whether the photograph is safe there; `None` where nothing of it is shown.
    pub safe: Vec<Option<bool>>,
}

impl Shown {
    /// Looks up where the middles of the cells come from.
    pub fn new(lens: &dyn Lens, view: &View, polygon: &[[f64; 2]]) -> Self {
        let [w, h] = view.size_px.map(f64::from);
        let [columns, rows] = [w, h].map(|n| (CELLS as f64 * n / w.max(h)).round().max(1.0) as usize);
        let [pw, ph] = lens.size_px().map(|n| f64::from(n) - 1.0);
        let fold = lens.fold_rad();
        let from = |u: f64, v: f64| -> Option<Vector2<f64>> {
            let ray = view.ray(u, v)?;
            let px = lens.project_px(&ray).filter(|_| ray.x.hypot(ray.y).atan2(ray.z) < fold)?;
            (px.x >= 0.0 && px.y >= 0.0 && px.x <= pw && px.y <= ph).then_some(px)
        };
        let middle = |i: usize, n: usize, size: f64| (i as f64 + 0.5) / n as f64 * size - 0.5;
        let cell = |k: usize| {
            let px = from(middle(k % columns, columns, w), middle(k / columns, rows, h))?;
            Some(contains(polygon, &px))
        };
        Self { columns, safe: (0..columns * rows).map(cell).collect() }
    }

    /// Share of the shown pixels that are not safe, 0..1.
    pub fn unsafe_fraction(&self) -> f64 {
        let shown = self.safe.iter().flatten().count();
        self.safe.iter().flatten().filter(|safe| !**safe).count() as f64 / shown.max(1) as f64
    }
}

/// The largest α with which a straightened picture shows nothing that is unsafe; `None` where even α = 0 does.
///
/// # Errors
/// As [`View::new`].
pub fn widest_alpha(lens: &dyn Lens, framing: &Framing, polygon: &[[f64; 2]]) -> Result<Option<f64>> {
    let good = |alpha: f64| -> Result<bool> {
        let view = View::new(lens, &Framing { alpha, fov_rad: None, ..*framing })?;
        Ok(Shown::new(lens, &view, polygon).unsafe_fraction() < NOTHING)
    };
    if !good(0.0)? {
        return Ok(None);
    }
    if good(1.0)? {
        return Ok(Some(1.0));
    }
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..7 {
        let middle = 0.5 * (low + high);
        *(if good(middle)? { &mut low } else { &mut high }) = middle;
    }
    Ok(Some(low))
}
