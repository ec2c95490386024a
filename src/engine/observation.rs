//! What was seen in a picture: corners with their indices on the board.

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

/// Identifies an input picture; never reused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct FrameId(pub u32);

/// A feature of the target found in a picture.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Corner {
    /// `row · columns + column` over the full board.
    pub index: u32,
    /// Position, px; `(0, 0)` is the centre of the first pixel.
    pub px: Vector2<f64>,
    /// Predicted standard deviation per axis, px: √(trace of the 2×2 covariance / 2).
    pub sigma_px: f64,
}

impl Corner {
    /// Whether it lies farther outside a picture of `[width, height]` px than what is found at its border may.
    pub fn is_outside(&self, size_px: [u32; 2]) -> bool {
        let size = size_px.map(f64::from);
        (0..2).any(|k| self.px[k] < -1.0 - 0.01 * size[k] || self.px[k] > 1.01 * size[k])
    }
}

/// The corners of one target in one frame; a part of the board is normal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Observation {
    /// Index into [`crate::calibrate::Problem::cameras`].
    pub camera: usize,
    /// The picture.
    pub frame: FrameId,
    /// In ascending order of index, each index at most once.
    pub corners: Vec<Corner>,
}
