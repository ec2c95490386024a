//! STMaps: pictures that tell a compositing program where each of their pixels comes from.
//!
//! Red is s, green is t: the place in the source as a share of its width from the left and of its height from the *bottom*, so that
//! `s = (x + ½)/w` and `t = 1 − (y + ½)/h` for the pixel `(x, y)` counted from the centre of the top-left one. The *undistort* map has
//! the pixels of the straightened picture and points into the photograph, the *distort* map the other way: it puts the lens back on what
//! was added to the straightened picture. As EXR they are 32-bit floats, and go beyond 0 to 1 where the lens model does; as PNG they
//! have 16 bits, and end at 0 and 1. What comes from nowhere is (−1, −1), in a PNG (0, 0).
//!
//! Foundry, Nuke reference guide, "STMap".

mod exr;

use image::{ExtendedColorType, ImageEncoder as _, codecs::png::PngEncoder};
use nalgebra::Vector2;

use super::{
    Error, Result,
    lens::Lens,
    undistort::{Framing, Straightener, View},
};

/// What comes from nowhere.
const NOWHERE: [f32; 2] = [-1.0; 2];

/// Which way a map leads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    /// From the photograph to the straightened picture.
    Undistort,
    /// From the straightened picture back to the photograph.
    Distort,
}

impl Way {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Undistort, Self::Distort];

    /// Name in file names.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Undistort => "undistort",
            Self::Distort => "distort",
        }
    }
}

/// How a map is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Storage {
    /// OpenEXR, 32-bit floats, not compressed.
    Exr,
    /// PNG, 16 bits.
    Png,
}

/// A whole map as a file.
///
/// # Errors
/// Those of [`Straightener::new`] and [`file()`].
pub fn map(lens: &dyn Lens, framing: &Framing, way: Way, storage: Storage) -> Result<Vec<u8>> {
    let straight = Straightener::new(lens, framing, false)?;
    let maker = Maker { lens, straight: &straight };
    let rows: Vec<_> = (0..maker.size_px(way)[1]).map(|y| maker.row(way, y)).collect();
    file(&rows, storage)
}

/// Makes the maps of a camera.
#[derive(Clone, Copy, Debug)]
pub struct Maker<'a> {
    /// The lens of the photographs.
    pub lens: &'a dyn Lens,
    /// What straightens them.
    pub straight: &'a Straightener,
}

impl Maker<'_> {
    /// `[width, height]` of a map, px.
    pub fn size_px(&self, way: Way) -> [u32; 2] {
        match way {
            Way::Undistort => self.straight.view.size_px,
            Way::Distort => self.lens.size_px(),
        }
    }

    /// `[s, t]` of the pixels of a row, counted from the top.
    pub fn row(&self, way: Way, row: u32) -> Vec<[f32; 2]> {
        let [width, _] = self.size_px(way);
        let y = f64::from(row);
        let (from, size_px): (&dyn Fn(f64) -> Option<Vector2<f64>>, _) = match way {
            Way::Undistort => (&|x| self.straight.map.beyond(x, y), self.lens.size_px()),
            Way::Distort => (&|x| self.straightened(x, y), self.straight.view.size_px),
        };
        (0..width).map(|x| from(f64::from(x)).map_or(NOWHERE, |px| st(&px, size_px))).collect()
    }

    /// Where the straightened picture shows what the photograph shows at (x, y), px.
    fn straightened(&self, x: f64, y: f64) -> Option<Vector2<f64>> {
        let view: &View = &self.straight.view;
        let ray = self.lens.unproject(&Vector2::new(x, y))?;
        let angle_rad = ray.x.hypot(ray.y).atan2(ray.z);
        let px = view.pixel(&ray).filter(|_| angle_rad <= view.projection.spec().max_angle_rad)?;
        px.iter().all(|v| v.is_finite()).then_some(px)
    }
}

/// Shares of the width from the left and of the height from the bottom.
fn st(px: &Vector2<f64>, [w, h]: [u32; 2]) -> [f32; 2] {
    [((px.x + 0.5) / f64::from(w)) as f32, (1.0 - (px.y + 0.5) / f64::from(h)) as f32]
}

/// The file of a map from its rows, the uppermost first.
///
/// # Errors
/// [`Error::Invalid`] where the rows are not as long as the map is wide, or it cannot be encoded.
pub fn file(rows: &[Vec<[f32; 2]>], storage: Storage) -> Result<Vec<u8>> {
    let width = rows.first().map_or(0, Vec::len);
    if width == 0 || rows.iter().any(|r| r.len() != width) {
        return Err(Error::Invalid("the rows of a map must be as long as it is wide".to_owned()));
    }
    match storage {
        Storage::Exr => Ok(exr::write(rows, width)),
        Storage::Png => png(rows, width),
    }
}

fn png(rows: &[Vec<[f32; 2]>], width: usize) -> Result<Vec<u8>> {
    let level = |v: f32| (f64::from(v).clamp(0.0, 1.0) * 65535.0).round() as u16;
    // The encoder takes samples in the order of the machine.
    let samples: Vec<u8> = rows
        .iter()
        .flatten()
        .flat_map(|[s, t]| [level(*s), level(*t), 0].map(u16::to_ne_bytes))
        .flatten()
        .collect();
    let mut out = Vec::new();
    PngEncoder::new(&mut out)
        .write_image(&samples, width as u32, rows.len() as u32, ExtendedColorType::Rgb16)
        .map_err(|e| Error::Invalid(format!("the map cannot be written as PNG: {e}")))?;
    Ok(out)
}

#[cfg(test)]
mod tests;
