//! Grids of circles: from grey values to dots with indices.
//!
//! [`detect`] depends on the picture alone: it finds the lattice of dots, dark on light or light on dark, whatever the size of the
//! board. What the lattice means on a board ([`Grid::assign`]) and which board a set of pictures shows ([`board_of`]) come
//! after it and are cheap.
//!
//! Both kinds of board are one square lattice: the rows of an asymmetric board are its diagonals ([`Kind`]).
//!
//! The picture of a circle is an ellipse whose centre is not the picture of the circle's centre; [`bias`] says by how much and
//! corrects it once the camera is known.

mod assign;
mod basis;
pub mod bias;
mod board;
mod choice;
mod complete;
mod ellipse;
mod lattice;
mod predict;
mod reason;
mod search;
mod spot;

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

use super::image::Gray;
pub use assign::Assigned;
pub use board::{CircleBoard, Kind};
pub use choice::{BoardChoice, board_of};

/// What was found in a picture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Detection {
    /// The largest lattice of dots; `None` where there is none.
    pub grid: Option<Grid>,
    /// Why there is no lattice, in words that help; empty where there is one.
    pub why: String,
}

/// Dots on a square lattice of unknown size and place on the board.
///
/// Cells run right-handed as the board does (never mirrored): columns to rows turns as x to y does in the picture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Grid {
    /// Columns and rows of cells that hold a dot: `0..size`.
    pub size: [u32; 2],
    /// Dots, ascending by row, then column; cells may be missing.
    pub dots: Vec<GridDot>,
    /// Cells beside dots that are in the picture and hold nothing but what lies between the dots: there is no dot on the board.
    pub blanks: Vec<[i32; 2]>,
    /// Whether the dots are darker than what is around them.
    pub dark: bool,
    /// Radius of a dot over the distance of neighbours on the lattice, median over the dots.
    pub radius: f64,
}

/// A dot of a [`Grid`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct GridDot {
    /// `[column, row]` in the lattice.
    pub cell: [u32; 2],
    /// Centre of the dot's ellipse, px.
    pub px: Vector2<f64>,
    /// Predicted standard deviation per axis, px: √(trace of the 2×2 covariance / 2).
    pub sigma_px: f64,
    /// The dot's ellipse `Q = [xx, xy, yy]`, px²: its boundary is `dᵀ Q⁻¹ d = 1` about the centre.
    pub ellipse: [f64; 3],
}

/// Finds the largest lattice of dots in a picture, whatever the size and kind of the board.
pub fn detect(picture: &Gray) -> Detection {
    match picture {
        Gray::U8(p) => search::search(p, picture),
        Gray::U16(p) => search::search(p, picture),
    }
}

#[cfg(test)]
mod tests;
