//! Undistortion: from a photograph to the picture that a camera without distortion would have taken.
//!
//! For wide lenses the picture may instead be laid out by another [`Projection`]. It has the size of the photograph in pixels, and
//! focal lengths that keep the ratio `fy / fx` of the camera, so that what is square stays square. Which part of the scene it shows
//! is chosen by α or by a field of view ([`View::new`]).
//!
//! A pixel of the output is **valid** where its ray is not beyond the fold of the model ([`Camera::fold_rad`]) nor further off the
//! axis than the projection shows ([`MAX_ANGLE_RAD`] in a flat picture), and meets the photograph within the centres of its outermost
//! pixels, so that nothing is extrapolated. Pixels that are not valid are black, and transparent where the photograph has an alpha
//! channel.

mod crop;
mod curves;
mod displacement;
mod map;
pub mod projection;
mod reach;
mod region;
pub(crate) mod remap;
mod view;
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
pub use projection::Projection;
pub use reach::{Reach, reach, warnings};
pub use view::{Framing, View};

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

/// The pinhole camera of undistorted pictures: the [`View`] of a flat picture.
///
/// OpenCV's `getOptimalNewCameraMatrix` differs in two ways: it stretches x and y on their own, and its view for α = 0 is
/// bounded by a 9 × 9 grid of points.
///
/// # Errors
/// As [`View::new`].
pub fn new_camera(camera: &dyn Lens, alpha: f64) -> Result<Camera> {
    let view = View::new(camera, &Framing::flat(alpha))?;
    Camera::new(Model::Pinhole, view.size_px, view.intrinsics.to_vec())
}

/// The largest rectangle of an undistorted picture in which every pixel is valid; `None` where none is.
pub fn largest_valid(map: &Map) -> Option<Rect> {
    crop::largest(map)
}

/// Everything that undistorts photographs of one camera; made once, used for many.
#[derive(Clone, Debug)]
pub struct Straightener {
    /// What the results show, with their size.
    pub view: View,
    /// Where each of their pixels comes from.
    pub map: Map,
    /// What to know about the model; see [`warnings`].
    pub warnings: Vec<Warning>,
}

impl Straightener {
    /// Chooses the view ([`View::new`]) and, where asked, cuts it to its largest valid rectangle.
    ///
    /// # Errors
    /// As [`View::new`].
    pub fn new(camera: &dyn Lens, framing: &Framing, crop: bool) -> Result<Self> {
        let mut view = View::new(camera, framing)?;
        let mut map = Map::of_view(camera, &view)?;
        if crop && let Some(rect) = largest_valid(&map) {
            view = view.cropped(rect);
            map = Map::of_view(camera, &view)?;
        }
        Ok(Self { view, map, warnings: warnings(camera, framing.projection) })
    }

    /// Computes all positions once, for many photographs to come ([`Map::keep`]).
    pub fn keep(&mut self) {
        self.map.keep();
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
/// As [`View::new`] and [`Map::remap`].
pub fn straighten(
    photo: &Photo,
    camera: &dyn Lens,
    framing: &Framing,
    crop: bool,
    interpolation: Interpolation,
) -> Result<Photo> {
    Straightener::new(camera, framing, crop)?.run(photo, interpolation)
}

#[cfg(test)]
mod tests;
