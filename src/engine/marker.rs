//! Square markers, and the boards made of them.
//!
//! [`find`] depends on the picture alone. It gives every square that has the border of a marker with the bits inside
//! ([`Mark`]), whatever the dictionary, and every crossing of edges near them ([`Crossing`]), whatever the board. What they mean
//! is said without pixels: a [`dictionary::Dictionary`] names the bits, a [`board::MarkerBoard`] gives corners with indices, and
//! [`guess::guess`] finds the board of a set. So a new description of the board never costs a new detection.
//!
//! The order is: [`regions`] of one colour, of which the hull is a quadrangle ([`quads`]), whose sides are fitted below the
//! pixel ([`outline`]), and whose cells are [`read`]; then all [`sides`] once more as exactly as the pixels allow, and the [`crossings`]. Each is tried from the full picture to ever smaller ones,
//! where large and blurred markers are found. Both polarities are looked at: of an inverted print borders are white.

mod aprilgrid;
mod aruco_grid;
pub mod board;
mod charuco;
mod crossings;
pub mod dictionary;
pub mod guess;
mod ink;
mod links;
mod outline;
mod place;
mod quads;
mod read;
mod regions;
mod sides;

use std::borrow::Cow;

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

use super::{
    detect::pyramid::{eight_bits, halve, noise},
    image::{Gray, Plane, Sample},
    order,
};
pub use crossings::Crossing;
use dictionary::{Bits, Dictionary, Identity};
pub use ink::Black;
use outline::Outline;
use quads::{Quad, center, quad, side};

/// What one picture shows, whatever the board.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Sighting {
    /// Squares with the border and the cells of a marker, by row, then column of their middle.
    pub marks: Vec<Mark>,
    /// Places near the marks where four squares meet, by row, then column.
    pub crossings: Vec<Crossing>,
}

impl Sighting {
    /// The same from behind, left and right exchanged.
    #[must_use]
    pub fn mirrored(mut self) -> Self {
        for mark in &mut self.marks {
            mark.corners.iter_mut().for_each(|p| p.x = -p.x);
            for (a, b) in [(0, 1), (2, 3)] {
                mark.corners.swap(a, b);
                mark.sigma_px.swap(a, b);
            }
            mark.readings.iter_mut().for_each(|r| r.bits = r.bits.mirrored());
        }
        for crossing in &mut self.crossings {
            (crossing.px.x, crossing.black.x) = (-crossing.px.x, -crossing.black.x);
        }
        self
    }
}

/// A square that looks like a marker.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Mark {
    /// Crossings of its sides, clockwise as seen in the picture, px.
    pub corners: [Vector2<f64>; 4],
    /// Their predicted standard deviation per axis, px.
    pub sigma_px: [f64; 4],
    /// Printed white on black; the bits are as if it were not.
    pub inverted: bool,
    /// What its cells may say, one for each number of cells that fits; never empty.
    pub readings: Vec<Reading>,
}

/// The cells of a [`Mark`], read for one number of them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Reading {
    /// The code: x runs from corner 0 to corner 1.
    pub bits: Bits,
    /// Width of the black border, cells.
    pub border: u8,
    /// How far the cells lie from the threshold on average: 1 where all are as black or white as can be.
    pub clarity: f32,
    /// Bright minus dark at the outline, grey levels of eight bits.
    pub contrast: f32,
}

impl Mark {
    /// Which marker of a dictionary this is.
    pub fn identify(&self, dictionary: Dictionary) -> Option<Identity> {
        let best = self.readings.iter().filter_map(|r| dictionary.identify(r.bits));
        best.min_by_key(|i| i.errors)
    }

    /// Which marker of a dictionary this would be in a mirrored print (or behind glass, seen from behind).
    pub fn identify_mirrored(&self, dictionary: Dictionary) -> Option<Identity> {
        let best = self.readings.iter().filter_map(|r| dictionary.identify(r.bits.mirrored()));
        best.min_by_key(|i| i.errors)
    }

    /// Whether it was recognised with a border of so many cells.
    fn has_border(&self, dictionary: Dictionary, border: u8) -> bool {
        self.readings.iter().any(|r| r.border == border && dictionary.identify(r.bits).is_some())
    }

    /// Mean of the corners, px.
    pub fn center(&self) -> Vector2<f64> {
        center(&self.corners)
    }

    /// Root of the area, px.
    pub fn side_px(&self) -> f64 {
        side(&self.corners)
    }
}

/// Smallest contrast at an outline, grey levels of eight bits, and in deviations of the noise.
const CONTRAST: (f32, f32) = (10.0, 5.0);
/// Smallest level that is searched, px along its shorter side.
const SMALLEST_LEVEL: usize = 24;
/// How far the hull of a region may lie off the sides, px of its level.
const REACH: f64 = 2.6;
/// A side that was moved by more at its ends is fitted again, px.
const AGAIN: f64 = 1.5;
/// Places of two marks that are one: distance of the middles and ratio of the sides.
const SAME: (f64, f64) = (0.35, 1.35);

/// Finds markers, whatever their dictionary.
pub fn find(picture: &Gray) -> Sighting {
    match picture {
        Gray::U8(plane) => search(plane, picture),
        Gray::U16(plane) => search(plane, picture),
    }
}

fn search<T: Sample>(picture: &Plane<T>, gray: &Gray) -> Sighting {
    let mut levels = vec![eight_bits(gray)];
    while let Some(last) = levels.last()
        && last.width().min(last.height()) / 2 >= SMALLEST_LEVEL
    {
        levels.push(Cow::Owned(halve(last)));
    }
    let mut marks: Vec<Mark> = Vec::new();
    for k in 0..levels.len() {
        let contrast = CONTRAST.0.max(CONTRAST.1 * noise(&levels[k]));
        let scale = f64::from(1u32 << k);
        for quad in regions::regions(&levels[k], contrast as u8).iter().filter_map(quad) {
            let to_picture = |p: Vector2<f64>| p.map(|v| (v + 0.5) * scale - 0.5);
            let known = |m: &Mark| {
                let (a, b) = (m.side_px(), quad.side() * scale);
                (m.center() - to_picture(quad.center())).norm() < SAME.0 * a && a.max(b) < SAME.1 * a.min(b)
            };
            if !marks.iter().any(known)
                && let Some(mark) = mark(picture, &levels, k, &quad, contrast)
            {
                marks.push(mark);
            }
        }
    }
    order::by(&mut marks, |m| [m.center().y, m.center().x]);
    sides::sharpen(picture, &mut marks);
    let crossings = crossings::crossings(picture, &levels, &marks);
    Sighting { marks, crossings }
}

/// Looks at a quadrangle of level `k`: its sides there, its cells, then its sides in the picture.
fn mark<T: Sample>(
    picture: &Plane<T>,
    levels: &[Cow<'_, Plane<u8>>],
    k: usize,
    quad: &Quad,
    contrast: f32,
) -> Option<Mark> {
    let mut rough = Outline::fit(&*levels[k], &quad.corners, quad.dark, REACH)?;
    // Blur rounds corners off, so the first sides may be askew: again from where they meet.
    if (0..4).any(|i| (rough.corners[i] - quad.corners[i]).norm() > AGAIN) {
        rough = Outline::fit(&*levels[k], &rough.corners, quad.dark, REACH)?;
    }
    // Cells are read where they are a few pixels large: less noise, and no sample between two pixels.
    let rough_side = side(&rough.corners);
    let more = read::halvings(rough_side).min(levels.len() - 1 - k);
    let chart = scaled(&rough, k, k + more).chart()?;
    let sign = if quad.dark { 1.0 } else { -1.0 };
    let readings = read::read(&levels[k + more], &chart, sign, contrast);
    // What no dictionary has, right or mirrored, is no marker.
    if !readings.iter().any(|r| Dictionary::any_has(r.bits)) {
        return None;
    }
    let start = scaled(&rough, k, 0);
    let reach = if k == 0 { 1.5 } else { 0.35 * f64::from(1u32 << k) + 2.0 };
    let fine = Outline::fit(picture, &start.corners, quad.dark, reach.min(24.0)).unwrap_or(start);
    Some(Mark { corners: fine.corners, sigma_px: fine.sigma_px, inverted: !quad.dark, readings })
}

/// An outline of level `from` in level `to`.
fn scaled(outline: &Outline, from: usize, to: usize) -> Outline {
    let factor = f64::from(1u32 << from) / f64::from(1u32 << to);
    Outline {
        corners: outline.corners.map(|p| p.map(|v| (v + 0.5) * factor - 0.5)),
        sigma_px: outline.sigma_px.map(|s| s * factor),
        bulge: outline.bulge.map(|b| b * factor),
    }
}

#[cfg(test)]
mod tests;
