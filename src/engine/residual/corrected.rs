//! A camera with a displacement on top.

use std::sync::Arc;

use nalgebra::{Point3, Vector2, Vector3};

use super::Field;
use crate::{
    Result,
    camera::{Camera, Lanes},
    lens::Lens,
};

/// A camera whose points are seen where its field moves them.
///
/// The field is so flat that the lens folds where the camera does.
#[derive(Clone, Debug, PartialEq)]
pub struct Corrected {
    /// The camera.
    pub camera: Camera,
    /// What it misses.
    pub field: Field,
}

impl Lens for Corrected {
    fn size_px(&self) -> [u32; 2] {
        self.camera.size_px
    }

    fn intrinsics(&self) -> [f64; 4] {
        self.camera.intrinsics()
    }

    fn validate(&self) -> Result<()> {
        self.camera.validate()
    }

    fn project_px(&self, point: &Vector3<f64>) -> Option<Vector2<f64>> {
        self.camera.project(&Point3::from(*point)).map(|px| self.field.seen(&px))
    }

    fn project_px_batch(&self, points: &[Lanes; 3], out: &mut [Lanes; 2]) {
        (self.camera.spec().project_px_batch)(&self.camera.params, points, out);
        let [u, v] = out;
        for (u, v) in u.iter_mut().zip(v) {
            // NaN stays: the field of its place is that of an end, and finite.
            let moved = self.field.at(&Vector2::new(*u, *v));
            (*u, *v) = (*u + moved.x, *v + moved.y);
        }
    }

    fn unproject(&self, px: &Vector2<f64>) -> Option<Vector3<f64>> {
        self.camera.unproject(&self.field.modelled(px)?)
    }

    fn expansion(&self, ray: &Vector3<f64>) -> Option<f64> {
        self.camera.expansion(ray)
    }

    fn shared(&self) -> Arc<dyn Lens> {
        Arc::new(self.clone())
    }
}
