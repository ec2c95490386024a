//! The loss and the weights, estimated together with the solution.

use nalgebra::{DMatrix, Vector2};
use std::ops::ControlFlow;

use super::{Loss, Options, Weights, prepare::Seen};
use crate::{
    Result,
    camera::{LANES, Lanes},
    refine::{self, Descent, Limits, Refined, State, block::Block},
};

/// Threshold of Huber's loss in standard deviations of one coordinate.
const HUBER: f64 = 2.5;
/// √(2 ln 2): median of the length of a two-dimensional standard normal vector.
const MEDIAN_LENGTH: f64 = 1.177_410_022_515_474_7;
/// Corners are not believed beyond this, nor is any scale estimated below it, px: what the pixel grid does to edges that run
/// along it is up to 0.004 px on noise-free pictures, shared by whole views.
const FLOOR_PX: f64 = 3e-3;
/// Scale below which the loss stays quadratic, px: what exact pictures leave is the shape of pixels and lens, the same for
/// many corners. To call a part of it outliers would bias the camera and flatter its σ.
const LOSS_FLOOR_PX: f64 = 0.015;
/// Scale and weights are settled when they change by this share of the scale, which some 10⁵ corners would not tell better.
const STILL: f64 = 1e-3;
/// In standard deviations of one coordinate: an outlier. Normal noise goes there once in 270 000 corners.
pub(super) const OUTLIER: f64 = 5.0;

/// The optimum with its loss.
pub(super) struct Fitted {
    pub(super) refined: Refined,
    /// Of the free intrinsics, with the a-priori weights only ([`refine::information`]).
    pub(super) information: Option<DMatrix<f64>>,
    pub(super) blocks: Vec<Block>,
    pub(super) residuals: Vec<Vec<Vector2<f64>>>,
    /// Robust σ of one coordinate of a corner of weight 1, px.
    pub(super) scale_px: f64,
    pub(super) huber_px: Option<f64>,
}

/// Refines `blocks`, with the scale of the loss and the weights brought to agree with the residuals; `problem` is without them.
pub(super) fn fit(
    problem: &refine::Problem<'_>,
    mut blocks: Vec<Block>,
    views: &[Seen],
    start: &State,
    options: &Options,
    report: &mut dyn FnMut() -> ControlFlow<()>,
) -> Result<Fitted> {
    const ROUNDS: usize = 30;
    let robust = options.loss == Loss::Huber;
    let weighted = options.weights == Weights::Sigma && uneven(views);
    let mut huber_px = None;
    let mut scale_px = 0.0;
    let mut descent = Descent::new(&refine::Problem { blocks: &blocks, huber_px, ..*problem }, start)?;
    // The start is near already.
    let mut limits =
        Limits { iterations: options.max_iterations, tolerance: 0.1, damping: 1e-7, enough: None };
    if robust || weighted {
        // Rounds until scale and weights stand still. In most rounds one step is enough: the scale moves less than that.
        let variances: Vec<f64> = if weighted {
            views.iter().flat_map(|v| &v.sigma_px).map(|s| floored(*s).powi(2)).collect()
        } else {
            Vec::new()
        };
        let mut excess = f64::NAN;
        let mut squares = Vec::with_capacity(variances.len());
        for _ in 0..ROUNDS {
            let before = (scale_px, excess);
            if weighted {
                by_corner(&blocks, descent.squares(), &mut squares);
                excess = excess_variance(&variances, &mut squares);
                set_weights(&mut blocks, &variances, excess);
            }
            let now = refine::Problem { blocks: &blocks, huber_px, ..*problem };
            descent.weighted_squares(&now, &mut squares);
            scale_px = scale(median(&mut squares).sqrt());
            if robust {
                huber_px = Some(threshold(scale_px));
            }
            let now = refine::Problem { blocks: &blocks, huber_px, ..*problem };
            descent.reweigh(&now);
            let still = |a: f64, b: f64| (a - b).abs() <= STILL * scale_px;
            if still(before.0, scale_px) && (!weighted || still(before.1.sqrt(), excess.sqrt())) {
                break;
            }
            descent.run(&now, limits, report)?;
        }
    }
    let now = refine::Problem { blocks: &blocks, huber_px, ..*problem };
    limits.tolerance = Limits::full(views.iter().map(|v| v.px.len()).sum()).tolerance;
    let termination = descent.run(&now, limits, report)?;
    let information = descent.information(&now);
    let refined = descent.refined(&now, termination);
    let residuals = all_residuals(&now, &refined.state);
    if !robust {
        scale_px = scale(median_length(&blocks, &residuals));
    }
    Ok(Fitted { refined, information, residuals, scale_px, huber_px, blocks })
}

fn all_residuals(problem: &refine::Problem<'_>, state: &State) -> Vec<Vec<Vector2<f64>>> {
    (0..problem.blocks.len()).map(|i| refine::residuals(problem, state, i)).collect()
}

/// Values of all corners, without the padding.
fn by_corner(blocks: &[Block], padded: &[Lanes], to: &mut Vec<f64>) {
    to.clear();
    let mut rest = padded;
    for block in blocks {
        let (own, others) = rest.split_at(block.len().div_ceil(LANES));
        to.extend(&own.as_flattened()[..block.len()]);
        rest = others;
    }
}

/// Median length of the weighted residuals, px.
fn median_length(blocks: &[Block], residuals: &[Vec<Vector2<f64>>]) -> f64 {
    let squares = blocks
        .iter()
        .zip(residuals)
        .flat_map(|(b, r)| r.iter().enumerate().map(|(i, r)| b.weight(i) * r.norm_squared()));
    median(&mut squares.collect::<Vec<_>>()).sqrt()
}

/// Robust σ of one coordinate, from the median length of the weighted residuals, px.
fn scale(median_length: f64) -> f64 {
    (median_length / MEDIAN_LENGTH).max(FLOOR_PX)
}

fn threshold(scale_px: f64) -> f64 {
    HUBER * scale_px.max(LOSS_FLOOR_PX)
}

/// Threshold of Huber's loss that agrees with the squares of weighted residuals, which are used up, px.
pub(crate) fn huber_of_squares_px(squares: &mut [f64]) -> f64 {
    threshold(scale(median(squares).sqrt()))
}

/// Threshold of Huber's loss that agrees with weighted residuals, px.
pub(crate) fn huber_px(blocks: &[Block], residuals: &[Vec<Vector2<f64>>]) -> f64 {
    threshold(scale(median_length(blocks, residuals)))
}

/// Whether the corners' σ are usable and differ.
fn uneven(views: &[Seen]) -> bool {
    let all = || views.iter().flat_map(|v| &v.sigma_px);
    let first = all().next().copied().unwrap_or(0.0);
    all().all(|s| s.is_finite() && *s > 0.0) && all().any(|s| *s != first)
}

/// Variance per coordinate that the residuals show beyond the corners' own σ², px²: the typical normalised residual
/// becomes that of normal noise.
///
/// `squares` are the residuals', px², and are used up. Half of all corners have `r²/(σ² + excess) ≤ m²`, m the median length: so `excess` is the median of `r²/m² − σ²`.
fn excess_variance(variances: &[f64], squares: &mut [f64]) -> f64 {
    for (square, variance) in squares.iter_mut().zip(variances) {
        *square = *square / (MEDIAN_LENGTH * MEDIAN_LENGTH) - variance;
    }
    median(squares).max(0.0)
}

fn floored(sigma_px: f64) -> f64 {
    sigma_px.max(FLOOR_PX)
}

/// Weights `∝ 1/(σ² + excess)` with mean 1.
fn set_weights(blocks: &mut [Block], variances: &[f64], excess: f64) {
    let weights: Vec<f64> = variances.iter().map(|v| 1.0 / (v + excess)).collect();
    let mean = weights.iter().sum::<f64>() / weights.len().max(1) as f64;
    let mut rest = &weights[..];
    for block in blocks {
        let (own, others) = rest.split_at(block.len());
        block.set_weights(own.iter().map(|w| w / mean));
        rest = others;
    }
}

pub(super) fn median(values: &mut [f64]) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

impl Fitted {
    /// Final factor of each squared residual: a-priori weight × Huber's.
    pub(super) fn weight(&self, block: usize, corner: usize) -> f64 {
        let w = self.blocks[block].weight(corner);
        let e = w.sqrt() * self.residuals[block][corner].norm();
        w * self.huber_px.map_or(1.0, |k| k / e.max(k))
    }

    /// Whether a corner lies beyond [`OUTLIER`] robust standard deviations.
    pub(super) fn is_outlier(&self, block: usize, corner: usize) -> bool {
        let e = self.blocks[block].weight(corner).sqrt() * self.residuals[block][corner].norm();
        e > OUTLIER * self.scale_px.max(LOSS_FLOOR_PX)
    }

    /// σ of one coordinate of a corner of weight 1, a posteriori, px, for `freedom` = 2N − P.
    ///
    /// Least squares: `√(Σ w r²/(2N − P))`. Huber's loss: `√(Σ|ψ|²/(2N − P)) / mean ψ'` (P. Huber, Robust Statistics, 1981,
    /// §7.6), because the weights that the loss gives would count large residuals twice.
    pub(super) fn sigma0_px(&self, freedom: usize) -> f64 {
        let (mut squares, mut slope, mut count) = (0.0, 0.0, 0usize);
        for (block, residuals) in self.blocks.iter().zip(&self.residuals) {
            for (i, r) in residuals.iter().enumerate() {
                let e = block.weight(i).sqrt() * r.norm();
                let k = self.huber_px.unwrap_or(f64::INFINITY);
                squares += e.min(k).powi(2);
                // Mean of the two derivatives of ψ: along the residual and across it.
                slope += if e <= k { 1.0 } else { 0.5 * k / e };
                count += 1;
            }
        }
        (squares / freedom as f64).sqrt() * count as f64 / slope
    }
}

/// Covariance of the free intrinsics for σ₀ = 1, and the reciprocal condition of the information scaled to unit diagonal;
/// `None` where it is singular.
pub(super) fn covariance(information: &DMatrix<f64>) -> Option<(DMatrix<f64>, f64)> {
    let p = information.nrows();
    if p == 0 {
        return Some((DMatrix::zeros(0, 0), 1.0));
    }
    let scale: Vec<f64> = (0..p).map(|i| information[(i, i)].sqrt().recip()).collect();
    if !scale.iter().all(|s| s.is_finite()) {
        return None;
    }
    let scaled = DMatrix::from_fn(p, p, |i, j| information[(i, j)] * scale[i] * scale[j]);
    let eigen = scaled.clone().symmetric_eigenvalues();
    let (low, high) = eigen.iter().fold((f64::INFINITY, 0.0f64), |(l, h), e| (l.min(*e), h.max(*e)));
    if low.is_nan() || low <= 1e-14 * high {
        return None;
    }
    let inverse = scaled.cholesky()?.inverse();
    Some((DMatrix::from_fn(p, p, |i, j| inverse[(i, j)] * scale[i] * scale[j]), low / high))
}
