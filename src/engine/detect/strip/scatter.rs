//! How sure a corner is, by how the rows of its strips scatter.
//!
//! The normal equations alone, `σ̂² A⁻¹`, hold for white noise of one strength. Pictures have other noise: black and white cut it off
//! at both ends of the range, so that pixels on the edge, which give the place, have more of it than those beside it; shot noise
//! and JPEG change it from place to place; and an edge whose profile is not quite a Gaussian leaves residuals that move nothing. So
//!
//! ```text
//! Σ = A⁻¹ B A⁻¹,    B = Σ_v t_v t_vᵀ,    t_v = Σ_u ∂I/∂o · residual
//! ```
//!
//! with the rows of a strip as clusters (P. Huber 1967; H. White 1980; K.-Y. Liang & S. Zeger 1986). A strip has few rows, so the
//! factor that this makes of `σ̂²` is drawn towards the usual one of the board.

use nalgebra::Matrix2;

use super::Fit;

/// Fewest rows whose scatter tells anything.
const FEWEST_ROWS: f64 = 6.0;
/// Rows that the usual factor of the board counts for beside the own ones of an edge.
const ROWS_OF_BOARD: f64 = 100.0;

/// Sums over the rows of a strip that do not see the other edge: near the crossing, what the model has wrong is the same on both
/// sides of the corner and moves nothing.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Rows {
    /// Σ 1, Σ v, Σ v².
    moments: [f64; 3],
    /// Σ t, Σ v t.
    scores: [f64; 2],
    /// Σ t², Σ v t², Σ v² t².
    seen: [f64; 3],
    /// Σ i, Σ v i, Σ v² i, i = Σ_u (∂I/∂o)²: what white noise of variance 1 would make of `seen`.
    expected: [f64; 3],
}

impl Rows {
    /// Adds row `v` with its score t and its information i.
    pub(super) fn add(&mut self, v: f32, score: f32, information: f32) {
        let [v, t, i] = [v, score, information].map(f64::from);
        let (vv, tt) = (v * v, t * t);
        let add = |to: &mut [f64; 3], x: f64| {
            to[0] += x;
            to[1] += v * x;
            to[2] += vv * x;
        };
        add(&mut self.moments, 1.0);
        add(&mut self.seen, tt);
        add(&mut self.expected, i);
        self.scores[0] += t;
        self.scores[1] += v * t;
    }

    /// Variance of the noise as far as it moves the combination `c` of place and slope, and the rows that tell it.
    pub(super) fn variance(&self, c: [f64; 2]) -> Option<(f64, f64)> {
        let ([n, v, vv], [a, b]) = (self.moments, self.scores);
        if n < FEWEST_ROWS {
            return None;
        }
        // the step takes a line in v out of the scores, and two of them fit every line
        let line = (vv * a * a - 2.0 * v * a * b + n * b * b) / (n * vv - v * v);
        let left = (1.0 - line / self.seen[0]).max(0.0) * n / (n - 2.0);
        let of = |s: &[f64; 3]| c[0] * c[0] * s[0] + 2.0 * c[0] * c[1] * s[1] + c[1] * c[1] * s[2];
        let variance = left * of(&self.seen) / of(&self.expected);
        variance.is_finite().then_some((variance, n))
    }
}

/// What the covariance of a corner is made of.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scatter {
    /// Covariance of the places of both edges along u under white noise of variance 1: 00, 01, 11.
    pub(super) unit: [f64; 3],
    /// Variance of the residuals.
    pub(super) white: f64,
    /// Variance of the noise of either edge by its rows, and their number.
    pub(super) rows: [Option<(f64, f64)>; 2],
    /// Corner from the places of both edges.
    pub(super) corner_from_places: Matrix2<f64>,
}

impl Scatter {
    /// Covariance of the corner, px², where the noise of edge k is `factor[k]` times the variance of the residuals.
    fn covariance(&self, factor: [f64; 2]) -> Matrix2<f64> {
        let [a, b] = factor.map(f64::sqrt);
        let [xx, xy, yy] = self.unit;
        let places = Matrix2::new(a * a * xx, a * b * xy, a * b * xy, b * b * yy) * self.white;
        self.corner_from_places * places * self.corner_from_places.transpose()
    }

    /// Covariance of the corner if the noise is white.
    pub(super) fn plain(&self) -> Matrix2<f64> {
        self.covariance([1.0; 2])
    }

    /// Covariance of the corner in a board of these [`usual`] factors.
    pub(super) fn beside(&self, usual: [f64; 2], least: f64) -> Matrix2<f64> {
        self.covariance([0, 1].map(|k| {
            let (variance, n) = self.rows[k].unwrap_or_default();
            towards(variance / self.white, n, usual[k]).max(least / self.white)
        }))
    }
}

/// What `n` rows say of a factor, drawn towards the usual one of the board.
pub(super) fn towards(factor: f64, n: f64, usual: f64) -> f64 {
    (factor * n + usual * ROWS_OF_BOARD) / (n + ROWS_OF_BOARD)
}

/// The usual factors of a board, the medians over its corners of what the rows say of either edge.
pub(super) fn usual(corners: &[Option<(Fit, Scatter)>]) -> [f64; 2] {
    [0, 1].map(|k| {
        let mut list: Vec<f64> =
            corners.iter().flatten().filter_map(|(_, c)| Some(c.rows[k]?.0 / c.white)).collect();
        list.sort_by(f64::total_cmp);
        list.get(list.len() / 2).copied().unwrap_or(1.0)
    })
}
