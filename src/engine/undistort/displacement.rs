//! How far the lens moves what it shows.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::{Error, Result, camera::Camera};

/// The displacement field of a camera on its pixel grid.
///
/// At the pixel where a camera of the same focal lengths and principal point but without distortion would show a ray, it says
/// how far away the real camera shows it: real − ideal (what `cv2.initUndistortRectifyMap` with an unchanged camera matrix
/// gives, minus the pixel grid). Barrel distortion points to the middle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Displacement {
    /// Pixels between nodes; the last node of a row or column lies on the last pixel.
    pub step_px: u32,
    /// `[columns, rows]` of nodes.
    pub nodes: [usize; 2],
    /// Pixel of each node column and each node row.
    pub at_px: [Vec<u32>; 2],
    /// `[Δx, Δy]` of each node, row-major, px; `None` beyond the fold of the model.
    pub field: Vec<Option<[f32; 2]>>,
    /// Largest magnitude over the nodes and all border pixels, px.
    pub largest_px: f64,
    /// The same in per cent of the picture's diagonal √(w² + h²).
    pub largest_percent: f64,
    /// The pixel where it is.
    pub largest_at: [u32; 2],
}

/// Measures the field on every `step_px`-th pixel and on all border pixels.
///
/// # Errors
/// [`Error::Invalid`] for a camera that is not valid.
pub fn displacement(camera: &Camera, step_px: u32) -> Result<Displacement> {
    camera.validate()?;
    if step_px == 0 {
        return Err(Error::Invalid("the step of the displacement field is 0: give at least 1 px".to_owned()));
    }
    let [fx, fy, cx, cy] = camera.intrinsics();
    let [w, h] = camera.size_px;
    let corner = |u: u32, v: u32| ((f64::from(u) - cx) / fx).hypot((f64::from(v) - cy) / fy);
    let view = [corner(0, 0), corner(w - 1, 0), corner(0, h - 1), corner(w - 1, h - 1)]
        .into_iter()
        .fold(0.0, f64::max);
    let fold = super::reach::fold_within(camera, view.atan());
    let limit = if fold < std::f64::consts::FRAC_PI_2 { fold.tan() } else { f64::INFINITY };
    let moved = |u: u32, v: u32| -> Option<[f64; 2]> {
        let (x, y) = ((f64::from(u) - cx) / fx, (f64::from(v) - cy) / fy);
        if x.hypot(y) > limit {
            return None;
        }
        let px = (camera.spec().project_px)(&camera.params, &Vector3::new(x, y, 1.0))?;
        Some([px.x - f64::from(u), px.y - f64::from(v)])
    };
    let mut largest = (0.0, [0, 0]);
    let mut consider = |u: u32, v: u32, d: Option<[f64; 2]>| {
        if let Some([dx, dy]) = d
            && dx.hypot(dy) > largest.0
        {
            largest = (dx.hypot(dy), [u, v]);
        }
    };
    let at_px = [w, h].map(|n| {
        let mut at: Vec<u32> = (0..n).step_by(step_px as usize).collect();
        if at.last() != Some(&(n - 1)) {
            at.push(n - 1);
        }
        at
    });
    let mut field = Vec::with_capacity(at_px[0].len() * at_px[1].len());
    for &v in &at_px[1] {
        for &u in &at_px[0] {
            let d = moved(u, v);
            consider(u, v, d);
            field.push(d.map(|d| d.map(|c| c as f32)));
        }
    }
    for u in 0..w {
        consider(u, 0, moved(u, 0));
        consider(u, h - 1, moved(u, h - 1));
    }
    for v in 0..h {
        consider(0, v, moved(0, v));
        consider(w - 1, v, moved(w - 1, v));
    }
    let diagonal = f64::from(w).hypot(f64::from(h));
    Ok(Displacement {
        step_px,
        nodes: [at_px[0].len(), at_px[1].len()],
        at_px,
        field,
        largest_px: largest.0,
        largest_percent: 100.0 * largest.0 / diagonal,
        largest_at: largest.1,
    })
}
