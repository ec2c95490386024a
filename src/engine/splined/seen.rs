//! The corners of a view as the fit of a splined camera sees them.

use nalgebra::{Point3, Vector2, Vector3};

use super::Splined;
use crate::{
    lens::Lens as _,
    observation::Corner,
    pose::Pose,
    solution::{Calibration, View},
    surface::{Row, ViewRows, by_motion, usual_weights},
    target::Target,
};

/// The corners of a view.
pub(super) struct Seen {
    indices: Vec<u32>,
    /// Board points relative to their middle.
    points: Vec<Point3<f64>>,
    middle: Vector3<f64>,
    px: Vec<Vector2<f64>>,
    pub(super) weights: Vec<f64>,
}

fn middle(points: &[Point3<f64>]) -> Vector3<f64> {
    points.iter().map(|p| p.coords).sum::<Vector3<f64>>() / points.len() as f64
}

impl Seen {
    /// `None` where the camera does not see a corner.
    pub(super) fn new(calibration: &Calibration, view: &View, target: &Target) -> Option<Self> {
        let points: Option<Vec<Point3<f64>>> =
            view.indices.iter().map(|i| target.point_in_board(*i)).collect();
        let points = points.filter(|p| !p.is_empty())?;
        let middle = middle(&points);
        let px = points.iter().zip(&view.residuals_px).map(|(point, residual)| {
            Some(calibration.camera.project(&view.camera_from_board.apply(point))? + residual)
        });
        Some(Self {
            indices: view.indices.clone(),
            px: px.collect::<Option<_>>()?,
            points: points.iter().map(|p| p - middle).collect(),
            middle,
            weights: usual_weights(&view.weights, &view.residuals_px, calibration.sigma0_px),
        })
    }

    /// Corners that are worth the same; `None` where there is none, or one is not on the target.
    pub(super) fn of(target: &Target, corners: &[Corner]) -> Option<Self> {
        let points: Option<Vec<Point3<f64>>> =
            corners.iter().map(|c| target.point_in_board(c.index)).collect();
        let points = points.filter(|p| !p.is_empty())?;
        let middle = middle(&points);
        Some(Self {
            indices: corners.iter().map(|c| c.index).collect(),
            px: corners.iter().map(|c| c.px).collect(),
            points: points.iter().map(|p| p - middle).collect(),
            middle,
            weights: vec![1.0; corners.len()],
        })
    }

    /// The pose whose translation is the place of the middle of the corners.
    pub(super) fn centred(&self, pose: &Pose) -> Pose {
        Pose { translation: pose.rotation * self.middle + pose.translation, ..*pose }
    }

    /// Inverse of [`Seen::centred`].
    pub(super) fn uncentred(&self, pose: &Pose) -> Pose {
        Pose { translation: pose.translation - pose.rotation * self.middle, ..*pose }
    }

    /// Residuals at a pose (centred), px; `None` where the camera does not see a corner.
    pub(super) fn residuals(&self, camera: &Splined, pose: &Pose) -> Option<Vec<Vector2<f64>>> {
        let seen = self.points.iter().zip(&self.px);
        seen.map(|(point, px)| Some(px - camera.project_px(&pose.apply(point).coords)?)).collect()
    }

    /// Rows at a pose (centred), with the loss in the weights.
    pub(super) fn rows(&self, camera: &Splined, pose: &Pose, huber_px: f64) -> Option<ViewRows> {
        let rows: Option<Vec<Row>> = (0..self.points.len())
            .map(|i| {
                let place = pose.apply(&self.points[i]).coords;
                let there = camera.project(&place)?;
                let residual = self.px[i] - there.px;
                let weight =
                    self.weights[i] * (huber_px / (self.weights[i].sqrt() * residual.norm())).min(1.0);
                Some(Row {
                    index: self.indices[i],
                    seen_px: self.px[i],
                    patch: there.patch,
                    by_pose: by_motion(&there.by_point, &(place - pose.translation)),
                    residual,
                    weight,
                })
            })
            .collect();
        Some(ViewRows { rows: rows?, group: 0 })
    }
}
