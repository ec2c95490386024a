//! What a straightened picture shows.

use nalgebra::{Vector2, Vector3};
use serde::{Deserialize, Serialize};

use super::{Projection, Rect, region, window};
use crate::{Error, Result, camera::Camera, lens::Lens};

/// What is wanted of straightened pictures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Framing {
    /// How directions are laid out.
    pub projection: Projection,
    /// How much of the photograph is shown, 0..=1 (see [`View::new`]); not used where `fov_rad` is given.
    pub alpha: f64,
    /// Horizontal field of view, rad, about the optical axis; pixels that the photograph does not show are black.
    pub fov_rad: Option<f64>,
}

impl Framing {
    /// A flat picture.
    pub const fn flat(alpha: f64) -> Self {
        Self { projection: Projection::Perspective, alpha, fov_rad: None }
    }
}

/// The pixels of straightened pictures: `u = fx x + cx, v = fy y + cy` with `(x, y)` from the [`Projection`].
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// How directions are laid out.
    pub projection: Projection,
    /// `[width, height]`, px.
    pub size_px: [u32; 2],
    /// `fx fy cx cy`, px.
    pub intrinsics: [f64; 4],
}

impl View {
    /// The view of pictures as large as the photograph.
    ///
    /// α = 0 shows the largest view in which every pixel is valid, α = 1 the smallest that holds all pixels of the photograph that
    /// the projection can show; between them the edges of the view move linearly, so that the view grows with α and never jumps.
    /// Both come from the border of the photograph, traced pixel by pixel and unprojected; where the model folds, the border of
    /// what can be unprojected takes its place, so no view reaches beyond it. A field of view that is given takes the place of α.
    ///
    /// # Errors
    /// [`Error::Invalid`] for α outside of 0 to 1, a field of view that the projection cannot show, and a camera that is not valid;
    /// [`Error::Degenerate`] where no pixel has a ray.
    pub fn new(camera: &dyn Lens, framing: &Framing) -> Result<Self> {
        let Framing { projection, alpha, fov_rad } = *framing;
        if !(0.0..=1.0).contains(&alpha) {
            return Err(Error::Invalid(format!("alpha is {alpha}: give a number from 0 to 1")));
        }
        camera.validate()?;
        let intrinsics = match fov_rad {
            Some(fov) => about_the_axis(camera, projection.half_width(fov)?),
            None => window::intrinsics(camera, projection, &region::trace(camera, projection)?, alpha)?,
        };
        Ok(Self { projection, size_px: camera.size_px(), intrinsics })
    }

    /// The ray that a position of the picture shows, not normalised; `None` beyond what the projection shows.
    pub fn ray(&self, u: f64, v: f64) -> Option<Vector3<f64>> {
        let [fx, fy, cx, cy] = self.intrinsics;
        self.projection.ray(&Vector2::new((u - cx) / fx, (v - cy) / fy))
    }

    /// Where the picture shows a ray, px, inside of it or not; `None` where the projection has no such point.
    pub fn pixel(&self, ray: &Vector3<f64>) -> Option<Vector2<f64>> {
        let [fx, fy, cx, cy] = self.intrinsics;
        let point = (self.projection.spec().point)(ray)?;
        Some(Vector2::new(fx * point.x + cx, fy * point.y + cy))
    }

    /// The camera that would have taken such pictures; `None` where no model has this projection.
    pub fn camera(&self) -> Option<Camera> {
        let (model, rest) = self.projection.spec().model?;
        Camera::new(model, self.size_px, [&self.intrinsics[..], rest].concat()).ok()
    }

    /// The view of the pictures cut to a rectangle.
    pub(super) fn cropped(&self, rect: Rect) -> Self {
        let [fx, fy, cx, cy] = self.intrinsics;
        Self {
            projection: self.projection,
            size_px: [rect.width, rect.height],
            intrinsics: [fx, fy, cx - f64::from(rect.x), cy - f64::from(rect.y)],
        }
    }
}

/// `fx fy cx cy` of a picture about the optical axis, as wide as `2 · half` focal lengths from edge to edge.
fn about_the_axis(camera: &dyn Lens, half: f64) -> [f64; 4] {
    let [fx, fy, _, _] = camera.intrinsics();
    let [w, h] = camera.size_px().map(f64::from);
    let f = 0.5 * w / half;
    [f, f * fy / fx, 0.5 * (w - 1.0), 0.5 * (h - 1.0)]
}
