//! What the undistortion needs to know of a lens, whatever describes it.
//!
//! A [`Camera`] is a model with few parameters; [`crate::residual::Corrected`] is one with a displacement on top.

use std::{fmt, sync::Arc};

use nalgebra::{Point3, Vector2, Vector3};

use crate::{
    Result,
    camera::{Camera, Lanes},
};

/// A lens before a picture of a known size.
pub trait Lens: fmt::Debug + Send + Sync {
    /// `[width, height]` of the pictures, px.
    fn size_px(&self) -> [u32; 2];

    /// `[fx, fy, cx, cy]`, px: what it is near its axis.
    fn intrinsics(&self) -> [f64; 4];

    /// Checks numbers and ranges.
    ///
    /// # Errors
    /// [`crate::Error::Invalid`] with what is wrong.
    fn validate(&self) -> Result<()>;

    /// Where a point of the camera frame appears, px; `None` where the lens cannot see it.
    fn project_px(&self, point: &Vector3<f64>) -> Option<Vector2<f64>>;

    /// The same for [`crate::camera::LANES`] points at once; NaN where the lens cannot see a point.
    fn project_px_batch(&self, points: &[Lanes; 3], out: &mut [Lanes; 2]);

    /// Unit ray of a pixel; `None` where there is none.
    fn unproject(&self, px: &Vector2<f64>) -> Option<Vector3<f64>>;

    /// Determinant of ∂px/∂(two orthonormal directions beside the unit ray), px² per rad²; ≤ 0 where the image turns back, `None`
    /// where the lens cannot see the ray.
    fn expansion(&self, ray: &Vector3<f64>) -> Option<f64>;

    /// Angle from the optical axis up to which the image does not turn back, rad, in the worst direction; at most π.
    ///
    /// The image of rays further out turns back on itself: those pixels cannot be undistorted.
    fn fold_rad(&self) -> f64 {
        fold_rad(&|ray| self.expansion(ray))
    }

    /// A copy that others can hold.
    fn shared(&self) -> Arc<dyn Lens>;
}

/// [`Lens::fold_rad`] from [`Lens::expansion`].
pub(crate) fn fold_rad(expansion: &dyn Fn(&Vector3<f64>) -> Option<f64>) -> f64 {
    const AZIMUTHS: i32 = 72;
    const STEPS: i32 = 720;
    let mut limit = std::f64::consts::PI;
    for a in 0..AZIMUTHS {
        let (sin, cos) = (std::f64::consts::TAU * f64::from(a) / f64::from(AZIMUTHS)).sin_cos();
        let grows = |t: f64| {
            let ray = Vector3::new(cos * t.sin(), sin * t.sin(), t.cos());
            expansion(&ray).is_some_and(|d| d > 0.0)
        };
        let mut good = 0.0;
        for i in 1..=STEPS {
            let t = std::f64::consts::PI * f64::from(i) / f64::from(STEPS);
            if good >= limit {
                break;
            }
            if grows(t) {
                good = t;
                continue;
            }
            let mut bad = t;
            while bad - good > 1e-10 {
                let mid = 0.5 * (good + bad);
                if grows(mid) { good = mid } else { bad = mid }
            }
            limit = limit.min(good);
            break;
        }
    }
    limit
}

impl Lens for Camera {
    fn size_px(&self) -> [u32; 2] {
        self.size_px
    }

    fn intrinsics(&self) -> [f64; 4] {
        self.intrinsics()
    }

    fn validate(&self) -> Result<()> {
        self.validate()
    }

    fn project_px(&self, point: &Vector3<f64>) -> Option<Vector2<f64>> {
        self.project(&Point3::from(*point))
    }

    fn project_px_batch(&self, points: &[Lanes; 3], out: &mut [Lanes; 2]) {
        (self.spec().project_px_batch)(&self.params, points, out);
    }

    fn unproject(&self, px: &Vector2<f64>) -> Option<Vector3<f64>> {
        self.unproject(px)
    }

    fn expansion(&self, ray: &Vector3<f64>) -> Option<f64> {
        self.expansion(ray)
    }

    fn shared(&self) -> Arc<dyn Lens> {
        Arc::new(self.clone())
    }
}
