//! Printable boards: PDF and SVG at true scale, with a ruler to check the printer and, in words, what is printed.
//!
//! Of a checkerboard the top-left square is black: where columns + rows is odd, corner 0 is the inner corner that it touches.

mod design;
mod kind;
mod page;
mod pdf;
mod sheet;
mod svg;

use super::Result;

pub use design::Design;
pub use kind::Kind;
pub use page::{Page, Text};
pub use sheet::Sheet;

/// Largest edge of a board, mm.
const MAX_MM: f64 = 5000.0;

/// A PDF of the board at true scale, one page: the smallest usual paper that fits, else one of the board's own size.
///
/// # Errors
/// As [`Page::new`].
pub fn pdf(sheet: &Sheet) -> Result<Vec<u8>> {
    Ok(pdf::write(&Page::new(sheet)?))
}

/// An SVG of the board at true scale (its `width` and `height` are in mm).
///
/// # Errors
/// As [`Page::new`].
pub fn svg(sheet: &Sheet) -> Result<String> {
    Ok(svg::write(&Page::new(sheet)?))
}
