//! How much of a straightened picture lies beyond the safe region.

use nalgebra::{Vector2, Vector3};

use super::contains;
use crate::{
    Result,
    lens::Lens,
    undistort::{Framing, View},
};

/// Steps along the longer side of the photograph with which α is sought.
const LATTICE: f64 = 64.0;
/// Halvings of α, to 1/64.
const HALVINGS: usize = 6;

/// What a straightened picture shows, in equal cells.
#[derive(Clone, Debug, PartialEq)]
pub struct Shown {
    /// Cells along x.
    pub columns: usize,
    /// Row by row: whether the photograph is safe there; `None` where nothing of it is shown.
    pub safe: Vec<Option<bool>>,
}

impl Shown {
    /// Looks up where the middles of the cells come from, of which there are `cells` along the longer side.
    pub fn new(lens: &dyn Lens, view: &View, polygon: &[[f64; 2]], cells: usize) -> Self {
        let [w, h] = view.size_px.map(f64::from);
        let [columns, rows] = [w, h].map(|n| (cells as f64 * n / w.max(h)).round().max(1.0) as usize);
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
/// Unsafe pixels of the photograph are looked for on a lattice from border to border, corners included.
///
/// # Errors
/// As [`View::new`].
pub fn widest_alpha(lens: &dyn Lens, framing: &Framing, polygon: &[[f64; 2]]) -> Result<Option<f64>> {
    let [w, h] = lens.size_px().map(f64::from);
    let steps = [w, h].map(|n| (LATTICE * n / w.max(h)).round().max(1.0));
    let nodes = (0..=steps[1] as u32).flat_map(|j| (0..=steps[0] as u32).map(move |i| [i, j].map(f64::from)));
    let places = nodes.map(|[i, j]| Vector2::new(i / steps[0] * (w - 1.0), j / steps[1] * (h - 1.0)));
    // Just inside of its own border everything is safe that is so beside it.
    let inwards = |px: &Vector2<f64>| px + (Vector2::new(w, h) * 0.5 - px) * 1e-6;
    let rays: Vec<Vector3<f64>> =
        places.filter(|px| !contains(polygon, &inwards(px))).filter_map(|px| lens.unproject(&px)).collect();
    let good = |alpha: f64| -> Result<bool> {
        let view = View::new(lens, &Framing { alpha, fov_rad: None, ..*framing })?;
        let shown = |px: Vector2<f64>| px.x > 0.0 && px.y > 0.0 && px.x < w - 1.0 && px.y < h - 1.0;
        Ok(!rays.iter().filter_map(|ray| view.pixel(ray)).any(shown))
    };
    if !good(0.0)? {
        return Ok(None);
    }
    if good(1.0)? {
        return Ok(Some(1.0));
    }
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        *(if good(middle)? { &mut low } else { &mut high }) = middle;
    }
    Ok(Some(low))
}
