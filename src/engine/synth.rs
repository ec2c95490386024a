//! Synthetic scenes with exactly known truth.
//!
//! A [`Scene`] is a camera, a checkerboard, poses and degradations. [`Renderer`] turns one of its views into a grey
//! picture; [`Scene::truth`] says where every corner is. Both follow from the same camera model, so whatever a
//! detection or a calibration of the pictures gets wrong is its own error.
//!
//! * **Exact** ([`Method::Exact`]): each pixel is the mean of the board over its area. Pixels are mapped *back*
//!   through the lens onto the board, so edges bend with the distortion; in pixels that an edge crosses, the covered
//!   area is computed, not sampled. The picture agrees with the truth to better than 0.001 px.
//! * **Crude** ([`Method::Crude`]): the source document's way, polygons whose vertices are cut to whole pixels. Its
//!   corners are wrong by up to a pixel; it is kept to show where the document's residuals come from.
//!
//! Boards of markers and circles are drawn exactly, too ([`Print`]), one picture at a time.
//!
//! Degradations ([`Degrade`]) are seeded: one stream of random numbers per seed, view and effect, so a view is the
//! same alone or in a set, and one effect does not change another.

mod coverage;
mod crude;
pub mod degrade;
mod filter;
mod polygon;
pub mod poses;
mod print;
mod random;
mod rays;
pub mod render;
pub mod scene;
mod shapes;
mod surface;
pub mod truth;

pub use degrade::Degrade;
pub use print::Print;
pub use render::Renderer;
pub use scene::{Board, Cut, Levels, Method, Origin, Scene, ScenePose};
pub use truth::{Truth, TruthFrame};

use super::{Error, Result, image::Plane};

/// Renders one view; for several views of a scene [`Renderer`] computes the rays of the pixels once.
///
/// # Errors
/// [`Error::Invalid`] where the scene fails [`Scene::validate`] or has no such view.
pub fn render(scene: &Scene, view: usize) -> Result<Plane<u8>> {
    Renderer::new(scene)?.render(view)
}

/// Encodes a picture as PNG: one grey channel, or three equal ones where `color` is asked for (the source document
/// works on three).
///
/// # Errors
/// [`Error::Invalid`] where the picture is empty.
pub fn png(picture: &Plane<u8>, color: bool) -> Result<Vec<u8>> {
    use image::{ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};
    let [w, h] = [picture.width() as u32, picture.height() as u32];
    let mut bytes = Vec::new();
    let encoder = PngEncoder::new(&mut bytes);
    let written = if color {
        let rgb: Vec<u8> = picture.data().iter().flat_map(|&v| [v; 3]).collect();
        encoder.write_image(&rgb, w, h, ExtendedColorType::Rgb8)
    } else {
        encoder.write_image(picture.data(), w, h, ExtendedColorType::L8)
    };
    written
        .map_err(|e| Error::Invalid(format!("a picture of {w} x {h} px cannot be written as PNG: {e}")))?;
    Ok(bytes)
}

#[cfg(test)]
mod tests;
