//! Undistortion: from a photograph to the picture that a camera without distortion would have taken.
//!
//! The output camera is a pinhole of the same size in pixels, whose focal lengths keep the ratio `fy / fx` of the camera, so
//! that what is square stays square. Which part of the scene it shows is chosen by α ([`new_camera`]).
//!
//! A pixel of the output is **valid** where its ray is not beyond the fold of the model ([`Camera::fold_rad`]) nor more than
//! [`MAX_ANGLE_RAD`] off the axis, and meets the photograph within the centres of its outermost pixels, so that nothing is
//! extrapolated. Pixels that are not valid are black, and transparent where the photograph has an alpha channel.

mod crop;
mod displacement;
mod map;
mod reach;
mod region;
mod remap;
mod window;

use std::str::FromStr;

use serde::{Deserialize, Serialize};

use super::{
    Error, Result,
    camera::{Camera, Model},
    image::Photo,
    lens::Lens,
    solution::Warning,
};

pub use displacement::{Displacement, displacement};
pub use map::Map;
pub use reach::{Reach, reach, warnings};

/// Rays further off the optical axis are left out: a flat picture stretches them by more than 1/cos² = 33.
pub const MAX_ANGLE_RAD: f64 = 80.0 / 180.0 * std::f64::consts::PI;

/// How values between pixels are found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Interpolation {
    /// From 2 × 2 pixels: fast, softens a little.
    Bilinear,
    /// Windowed sinc over 6 × 6 pixels (a = 3): sharp, may ring beside strong edges.
    #[default]
    Lanczos,
}

impl FromStr for Interpolation {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        match text {
            "bilinear" => Ok(Self::Bilinear),
            "lanczos" => Ok(Self::Lanczos),
            _ => {
                Err(Error::Invalid(format!("\"{text}\" is not an interpolation: choose bilinear or lanczos")))
            }
        }
    }
}

/// A rectangle of whole pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Rect {
    /// First column.
    pub x: u32,
    /// First row.
    pub y: u32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

/// The camera of undistorted pictures.
///
/// α = 0 shows the largest view in which every pixel is valid, α = 1 the smallest that holds all pixels of the photograph that
/// can be shown; between them the edges of the view move linearly, so that the view grows with α and never jumps. Both come
/// from the border of the photograph, traced pixel by pixel and unprojected; where the model folds, the border of what can be
/// unprojected takes its place, so no view reaches beyond it.
///
/// OpenCV's `getOptimalNewCameraMatrix` differs in two ways: it stretches x and y on their own, and its view for α = 0 is
/// bounded by a 9 × 9 grid of points.
///
/// # Errors
/// [`Error::Invalid`] for α outside of 0 to 1 and for a camera that is not valid; [`Error::Degenerate`] where no pixel has a
/// ray.
pub fn new_camera(camera: &dyn Lens, alpha: f64) -> Result<Camera> {
    if !(0.0..=1.0).contains(&alpha) {
        return Err(Error::Invalid(format!("alpha is {alpha}: give a number from 0 to 1")));
    }
    camera.validate()?;
    let region = region::trace(camera)?;
    let intrinsics = window::intrinsics(camera, &region, alpha)?;
    Camera::new(Model::Pinhole, camera.size_px(), intrinsics.to_vec())
}

/// The largest rectangle of an undistorted picture in which every pixel is valid; `None` where none is.
pub fn largest_valid(map: &Map) -> Option<Rect> {
    crop::largest(map)
}

/// Everything that undistorts photographs of one camera; made once, used for many.
#[derive(Clone, Debug)]
pub struct Straightener {
    /// The pinhole camera of the results, with their size.
    pub camera: Camera,
    /// Where each of their pixels comes from.
    pub map: Map,
    /// What to know about the model; see [`warnings`].
    pub warnings: Vec<Warning>,
}

impl Straightener {
    /// Chooses the view by α ([`new_camera`]) and, where asked, cuts it to its largest valid rectangle.
    ///
    /// # Errors
    /// As [`new_camera`].
    pub fn new(camera: &dyn Lens, alpha: f64, crop: bool) -> Result<Self> {
        let mut target = new_camera(camera, alpha)?;
        let mut map = Map::new(camera, &target)?;
        if crop && let Some(rect) = largest_valid(&map) {
            target = cropped(&target, rect);
            map = Map::new(camera, &target)?;
        }
        Ok(Self { camera: target, map, warnings: warnings(camera) })
    }

    /// Undistorts one photograph.
    ///
    /// # Errors
    /// [`Error::Invalid`] where its size is not the camera's.
    pub fn run(&self, photo: &Photo, interpolation: Interpolation) -> Result<Photo> {
        self.map.remap(photo, interpolation)
    }
}

/// Undistorts one photograph; for many of one camera make a [`Straightener`].
///
/// # Errors
/// As [`new_camera`] and [`Map::remap`].
pub fn straighten(
    photo: &Photo,
    camera: &dyn Lens,
    alpha: f64,
    crop: bool,
    interpolation: Interpolation,
) -> Result<Photo> {
    Straightener::new(camera, alpha, crop)?.run(photo, interpolation)
}

fn cropped(camera: &Camera, rect: Rect) -> Camera {
    let mut out = camera.clone();
    out.size_px = [rect.width, rect.height];
    out.params[2] -= f64::from(rect.x);
    out.params[3] -= f64::from(rect.y);
    out
}

#[cfg(test)]
mod tests;
