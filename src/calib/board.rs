//! Printable boards: PDF and SVG at true scale, with a ruler to check the printer.
//!
//! The top-left square is black: where columns + rows is odd, corner 0 is the inner corner that it touches.

mod page;
mod pdf;
mod svg;

use std::{fmt, str::FromStr};

use super::{
    Error, Result,
    target::{BoardSize, Length},
};

pub use page::{Page, Text};

/// Largest edge of a board, mm.
const MAX_MM: f64 = 5000.0;

/// Kind of printed board.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Kind {
    /// Black and white squares.
    #[default]
    Checkerboard,
}

impl Kind {
    /// All kinds.
    pub const ALL: [Self; 1] = [Self::Checkerboard];

    /// Name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Checkerboard => "checkerboard",
        }
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Kind {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        Self::ALL.into_iter().find(|k| k.name().eq_ignore_ascii_case(text)).ok_or_else(|| {
            let names: Vec<_> = Self::ALL.iter().map(|k| k.name()).collect();
            Error::Invalid(format!("\"{text}\" is not a kind of board: choose one of {}", names.join(", ")))
        })
    }
}

/// A PDF of the board at true scale, one page: the smallest usual paper that fits, else one of the board's own size.
///
/// # Errors
/// [`Error::Invalid`] where the square has no physical unit or the board is too large.
pub fn pdf(kind: Kind, size: BoardSize, square: Length) -> Result<Vec<u8>> {
    Ok(pdf::write(&Page::new(kind, size, square)?))
}

/// An SVG of the board at true scale (its `width` and `height` are in mm).
///
/// # Errors
/// As [`pdf()`].
pub fn svg(kind: Kind, size: BoardSize, square: Length) -> Result<String> {
    Ok(svg::write(&Page::new(kind, size, square)?))
}
