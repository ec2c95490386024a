//! Checkerboard detection: from grey values to corners with indices.
//!
//! [`detect`] depends on the picture alone: it finds the grid of corners whatever the size of the board. Giving the corners
//! their indices on a board ([`Grid::assign`]) and finding the size of the board from a set of grids ([`board_of`]) are
//! cheap and come after it, so a new board size never costs a new detection.

mod assign;
mod bridge;
mod complete;
mod dots;
mod ends;
pub mod gradient;
mod grow;
pub(crate) mod pyramid;
mod reason;
pub(crate) mod response;
pub(crate) mod saddle;
mod search;
pub(crate) mod sheet;
pub mod strip;

use std::{fmt, str::FromStr};

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

use super::{Error, Result, image::Gray};
pub use assign::{Assigned, BoardChoice, board_of};
pub use dots::dots_of;
use gradient::Window;

/// How corners are refined below the pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(into = "String", try_from = "String")]
pub enum Refinement {
    /// Maximum likelihood on strips along the edges ([`strip`]).
    #[default]
    Strip,
    /// Orthogonality of gradients ([`gradient`]), an ablation.
    Gradient(Window),
    /// None: corners stay where the response has its peak, an ablation.
    Off,
}

impl fmt::Display for Refinement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Strip => f.write_str("strip"),
            Self::Gradient(Window::Half(half)) => write!(f, "gradient{half}"),
            Self::Gradient(Window::Adaptive) => f.write_str("gradient"),
            Self::Off => f.write_str("off"),
        }
    }
}

impl FromStr for Refinement {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let wrong = || {
            Error::Invalid(format!(
                "\"{text}\" is not a refinement: choose strip, gradient, gradient11 (half-window 1 to 99) or off"
            ))
        };
        match text.trim().to_lowercase().as_str() {
            "strip" => Ok(Self::Strip),
            "off" => Ok(Self::Off),
            other => match other.strip_prefix("gradient").ok_or_else(wrong)? {
                "" => Ok(Self::Gradient(Window::Adaptive)),
                half => match half.parse() {
                    Ok(half @ 1..=99) => Ok(Self::Gradient(Window::Half(half))),
                    _ => Err(wrong()),
                },
            },
        }
    }
}

impl From<Refinement> for String {
    fn from(refinement: Refinement) -> Self {
        refinement.to_string()
    }
}

impl TryFrom<String> for Refinement {
    type Error = Error;

    fn try_from(text: String) -> Result<Self> {
        text.parse()
    }
}

/// How to detect. The defaults are the best that is known; everything else is an ablation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Options {
    /// Refinement below the pixel.
    pub refinement: Refinement,
    /// Width of a Gaussian that smooths the picture before everything else, px; 0 for none.
    pub presmooth_px: f64,
}

/// What was found in a picture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Detection {
    /// The largest grid of checkerboard corners; `None` where there is none.
    pub grid: Option<Grid>,
    /// Why there is no grid, in words that help; empty where there is one.
    pub why: String,
    /// Whether another grid of fewer corners was seen, apart from this one.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub passed_over: bool,
    /// How the board was lit and sharp.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub light: Option<Light>,
}

/// Light and sharpness of a board in a picture: medians over its corners, in grey levels of 8 bits.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Light {
    /// Black squares.
    pub black: f64,
    /// White squares.
    pub white: f64,
    /// σ of the Gaussian blur of the edges, without the pixel, px.
    pub blur_px: f64,
    /// σ of what the fit of the corners leaves: noise, and what the fit does not know.
    pub noise: f64,
}

/// Corners of a checkerboard on a grid of unknown size and place on the board.
///
/// Cells run right-handed as the board does (never mirrored): columns to rows turns as x to y does in the picture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Grid {
    /// Columns and rows of cells that hold a corner: `0..size`.
    pub size: [u32; 2],
    /// Corners, ascending by row, then column; cells may be missing.
    pub corners: Vec<GridCorner>,
    /// Whether the square before cell (0, 0), at its −column −row side, is black.
    pub black_first: bool,
    /// Whether the board was seen to end beyond the first column, last column, first row, last row.
    pub ends: [bool; 4],
    /// Squares with a dot of the other colour in their middle, by the cell of their first corner.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub dots: Vec<[u32; 2]>,
}

/// A corner of a [`Grid`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct GridCorner {
    /// `[column, row]` in the grid.
    pub cell: [u32; 2],
    /// Position, px.
    pub px: Vector2<f64>,
    /// Predicted standard deviation per axis, px: √(trace of the 2×2 covariance / 2).
    pub sigma_px: f64,
}

/// Finds the largest grid of checkerboard corners in a picture, whatever the size of the board.
pub fn detect(picture: &Gray, options: &Options) -> Detection {
    if options.presmooth_px > 0.0 {
        let smooth = match picture {
            Gray::U8(p) => Gray::U8(gradient::smooth(p, options.presmooth_px)),
            Gray::U16(p) => Gray::U16(gradient::smooth(p, options.presmooth_px)),
        };
        return detect(&smooth, &Options { presmooth_px: 0.0, ..*options });
    }
    match picture {
        Gray::U8(p) => search::search(p, picture, options.refinement),
        Gray::U16(p) => search::search(p, picture, options.refinement),
    }
}

#[cfg(test)]
mod tests;
