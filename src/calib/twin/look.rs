//! What the detector of a target sees of a picture of the twin.

use nalgebra::Vector2;

use crate::calib::{
    circles,
    detect::{self, detect},
    image::Gray,
    marker,
    observation::Corner,
    target::Target,
};

/// A corner farther from its true place is another one, px.
const NEAR_PX: f64 = 2.0;

/// The points that were found, of those that the photograph shows. Markers say which point is which. Checkerboards and many circle grids
/// look the same in several orders, so that their points are named by the true places that they are nearest to.
pub(super) fn at(
    picture: &Gray,
    target: &Target,
    truth: &[Option<Vector2<f64>>],
    used: &[u32],
) -> Vec<Corner> {
    let found: Vec<(Vector2<f64>, f64)> = match target {
        Target::Markers { board, .. } => {
            let mut corners = board.locate(&marker::find(picture)).corners;
            corners.retain(|c| used.contains(&c.index));
            return corners;
        }
        Target::Circles { board, .. } => {
            let grid = circles::detect(picture).grid;
            let assigned = grid.and_then(|grid| grid.assign(*board).ok());
            assigned.into_iter().flat_map(|a| a.corners).map(|c| (c.px, c.sigma_px)).collect()
        }
        Target::Checkerboard { .. } | Target::Points { .. } => {
            let grid = detect(picture, &detect::Options::default()).grid;
            grid.into_iter().flat_map(|g| g.corners).map(|c| (c.px, c.sigma_px)).collect()
        }
    };
    let corner = |index: &u32| {
        let place = (*truth.get(*index as usize)?)?;
        let distance = |px: &Vector2<f64>| (px - place).norm();
        let nearest = found.iter().min_by(|a, b| distance(&a.0).total_cmp(&distance(&b.0)))?;
        let found = Corner { index: *index, px: nearest.0, sigma_px: nearest.1 };
        (distance(&found.px) < NEAR_PX).then_some(found)
    };
    used.iter().filter_map(corner).collect()
}
