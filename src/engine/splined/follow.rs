//! From a camera with few parameters to the splined one that follows it.

use nalgebra::Vector2;

use super::{Layout, Splined, stereographic};
use crate::{
    Error, Result,
    camera::{Camera, refit::grid},
    surface::{System, penalty},
};

/// Places of the fit in each interval between control points.
const FINE: usize = 3;
/// Bending and pull to the own value of the border of what is seen, in units of the information about a usual control point: what
/// carries the surface on beyond the picture, and moves nothing within.
const BEND: f64 = 1e-9;
const PULL: f64 = 1e-13;

impl Layout {
    /// A grid of `columns` control points, their rows as far apart, that covers the picture of a camera.
    ///
    /// # Errors
    /// [`Error::Degenerate`] where the picture has no rays, [`Error::Invalid`] where the grid is not possible.
    pub fn covering(camera: &Camera, columns: usize) -> Result<Self> {
        let places = grid(camera.size_px, [33, 25]).filter_map(|px| camera.unproject(&px));
        let farthest = places
            .filter_map(|ray| Some(stereographic::project(&ray)?.0.abs()))
            .reduce(|a, b| a.sup(&b))
            .filter(|u| u.x > 0.0 && u.y > 0.0)
            .ok_or_else(|| Error::Degenerate("the camera sees no pixel of its picture".to_owned()))?;
        let fov_x_deg = (4.0 * (0.5 * farthest.x).atan().to_degrees()).ceil().clamp(1.0, 359.0) as u32;
        let columns_only = Self { knots: [columns.max(4), 4], fov_x_deg };
        let rows = ((2.0 * farthest.y * columns_only.per_u()).ceil() as usize).saturating_add(3);
        let layout = Self { knots: [columns, rows.max(4)], fov_x_deg };
        layout.validate()?;
        Ok(layout)
    }
}

impl Splined {
    /// The splined camera that follows another one over its picture; it counts as known everywhere.
    ///
    /// # Errors
    /// [`Error::Degenerate`] where the picture has no rays, [`Error::Invalid`] for a layout that is not possible.
    pub fn following(camera: &Camera, layout: Layout) -> Result<Self> {
        layout.validate()?;
        let core = camera.intrinsics();
        let [fx, fy, cx, cy] = core;
        let slots: Vec<Option<usize>> = (0..layout.knots[0] * layout.knots[1]).map(Some).collect();
        let mut system = System::zero(slots.len());
        // The pixels of a grid finer than the control points', and a little beyond the border.
        let [w, h] = camera.size_px.map(f64::from);
        let middle = Vector2::new(0.5 * (w - 1.0), 0.5 * (h - 1.0));
        let mut seen = 0;
        for px in grid(camera.size_px, layout.knots.map(|n| (FINE * n) as u32)) {
            let px = middle + (px - middle) * 1.02;
            let Some((u, _)) = camera.unproject(&px).and_then(|ray| stereographic::project(&ray)) else {
                continue;
            };
            if layout.holds(&u) {
                let delta = Vector2::new((px.x - cx) / fx, (px.y - cy) / fy) - u;
                system.add_place(&layout.patch(&u), &delta, &slots);
                seen += 1;
            }
        }
        let nothing =
            || Error::Degenerate("the camera sees too little of its picture to be followed".to_owned());
        if seen < 16 {
            return Err(nothing());
        }
        let penalty = penalty(layout.knots, &slots, slots.len(), BEND, PULL);
        let values = system.solve(&penalty, system.scale()).ok_or_else(nothing)?;
        let (pairs, _) = values.as_slice().as_chunks::<2>();
        Self::new(camera.size_px, layout, core, pairs.to_vec())
    }
}
