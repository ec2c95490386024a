//! Strip fit: sub-pixel checkerboard corners by maximum likelihood.
//!
//! # Model
//!
//! Near a corner, in pixels relative to a whole pixel, both edges are parabolas `u = o + p v + k v²/2` with
//! `(u, v) = (x, y)` for a steep edge and `(y, x)` for a flat one ([`edge`]), and the picture is
//!
//! ```text
//! I = M + A (P₁ P₂ + R P₁' P₂'),     x_k = (u − o_k − p_k v − k_k v²/2) / h_k,  limited to ±1
//! M = m + gᵀ(x, y),    A = a (1 + hᵀ(x, y)),    R = (n₁·n₂) sd₁ sd₂ / (h₁ h₂)
//! ```
//!
//! `P_k(x_k)` is the edge blurred by a Gaussian of width `s_k` and integrated over the pixel ([`profile`]). The corner of two
//! blurred edges is a bivariate normal distribution; a product alone is exact only at right angles, and the second term is
//! the first one of its Mehler series. A blur per edge covers motion.
//!
//! # Strips
//!
//! ∂I/∂o and ∂I/∂p vanish outside a narrow strip along each edge, so only its pixels are read: rows of 8, 16, … pixels
//! across the edge ([`gather`]). A strip may come nearer to the next corner than a square window could, which is where
//! the low noise comes from. 20 sums of products per strip give the normal equations of the eight unknowns
//! `o₁ p₁ s₁ o₂ p₂ s₂ m a` ([`normal`]); curvature k and the gradients g, h come from the neighbouring corners
//! ([`board_terms`]).
//!
//! # Stages
//!
//! 1. Coarse: a fixed wide blur; the first pass is linear in (a·δo, a·δp, m, a), so it needs neither levels nor polarity
//!    (variable projection, Golub & Pereyra 1973). Starts may be about 2–3 px off.
//! 2. Blur from the area under 1 − ((I − m)/a)².
//! 3. Up to three Gauss–Newton steps.
//! 4. Once per board: curvature and gradients.
//! 5. One scoring step with them, which from a consistent estimate reaches the efficiency of maximum likelihood
//!    (Le Cam's one-step estimator), and the covariance ([`scatter`]), plus a floor of (0.0007 px)² per axis for what residuals
//!    cannot show.
//!
//! A corner is accepted where the contrast exceeds the residuals and the covariance is small: the fit is a verifier too.

use nalgebra::{Matrix2, Vector2};

use crate::image::{Plane, Sample};

mod axes;
mod board_terms;
mod crossing;
mod edge;
mod gather;
mod lanes;
mod normal;
mod profile;
mod scatter;
pub(crate) mod side;
#[cfg(test)]
mod tests;

use crossing::Crossing;
use gather::Strip;
use normal::ROUNDING;
use scatter::Scatter;

/// Systematic error that no residual shows (terms of third order, the pixel's own shape), px per axis.
const FLOOR_PX: f64 = 0.0007;

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
///
/// The grid may be any part of a board: a missing neighbour shortens the arm on its side ([`Options::arm_rim`]), and a
/// corner with no neighbour along an axis takes the direction from those beside it. Rows of pixels that leave the picture
/// are left out. Starts that are not finite or that see no corner come back unchanged with `ok` false.
pub fn refine<T: Sample>(picture: &Plane<T>, starts: &[Start], options: &Options) -> Vec<Fit> {
    refine_with(picture, starts, &[], options)
}

/// What is known of the edges of a corner, in place of what its neighbours say.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arms {
    /// Directions towards +column and +row, at least 3 px long.
    pub along: [Vector2<f64>; 2],
    /// How far each edge runs before and after the corner, px.
    pub room_px: [[f64; 2]; 2],
    /// How far beside both edges there is nothing but their squares, px; pixels beyond are not looked at.
    pub clear_px: f64,
}

/// [`refine`] where corners need not lie on a checkerboard: `arms[i]`, where there is one, overrules the neighbours of start i for
/// direction and length of its edges. The neighbours still give curvature and gradients.
pub fn refine_with<T: Sample>(
    picture: &Plane<T>,
    starts: &[Start],
    arms: &[Option<Arms>],
    options: &Options,
) -> Vec<Fit> {
    let mut axes = axes::all(starts, options);
    let mut clear = vec![f32::INFINITY; axes.len()];
    for ((axes, clear), arms) in axes.iter_mut().zip(&mut clear).zip(arms) {
        if let Some(arms) = arms {
            (*axes, *clear) = (arms.axes(), arms.clear_px as f32);
        }
    }
    let mut strips = [Strip::new(), Strip::new()];
    let mut corners: Vec<Option<Crossing>> = axes
        .iter()
        .zip(starts)
        .zip(clear)
        .map(|((axes, start), clear)| {
            let mut corner = Crossing::new(start.px, axes.as_ref()?)?.with_clear(clear);
            corner.coarse(picture, options, &mut strips)?;
            corner.fine(picture, options, &mut strips)?;
            Some(corner)
        })
        .collect();
    if options.board_terms {
        board_terms::set(&mut corners, starts);
    }
    let scored: Vec<Option<(Fit, Scatter)>> =
        corners.iter_mut().map(|c| c.as_mut()?.score(picture, options, &mut strips)).collect();
    let usual = scatter::usual(&scored);
    let finish = |(start, scored): (&Start, &Option<(Fit, Scatter)>)| match scored {
        Some((fit, scatter)) => {
            let floor = Matrix2::identity() * (FLOOR_PX * FLOOR_PX);
            let cov = scatter.beside(usual, ROUNDING) + floor;
            Fit { cov_px2: [cov[(0, 0)], cov[(0, 1)], cov[(1, 1)]], ..*fit }
        }
        None => Fit::rejected(start),
    };
    starts.iter().zip(&scored).map(finish).collect()
}
