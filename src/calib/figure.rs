//! Figures of the evidence, as SVG with text that stays text; photographs and maps are embedded as PNG.
//!
//! Every function takes plain data and answers a [`Panel`]; panels are set side by side or below each other and
//! written with [`Panel::svg`]. The same panels serve the experiment, the report and the window's export. Colours are
//! perceptually uniform (viridis, cividis) where they stand for numbers, and readable by colour-blind people.

mod axes;
mod errors;
mod maps;
mod overlay;
mod series;
mod svg;

pub use errors::{Bar, THRESHOLD_PX, cumulative, error_bars, error_versus, histogram};
pub use maps::{Grid, Scale, coverage_density, coverage_points, map};
pub use overlay::{Pair, before_after, contact_sheet, corner_order, reprojection};
pub use series::{Point, series};
pub use svg::Panel;

/// Colours of the figures.
pub(crate) mod color {
    /// Text.
    pub(crate) const INK: &str = "#1f2933";
    /// Secondary text and axes.
    pub(crate) const MUTED: &str = "#5b6770";
    /// Grid lines.
    pub(crate) const GRID: &str = "#e3e7ea";
    /// Data.
    pub(crate) const BLUE: &str = "#2c6fad";
    /// Overall values.
    pub(crate) const GREEN: &str = "#1b8a5a";
    /// Thresholds.
    pub(crate) const ORANGE: &str = "#d97706";
    /// Errors.
    pub(crate) const RED: &str = "#d02f2f";
}

#[cfg(test)]
mod tests;
