//! How far two calibrations would lie apart by chance: the covariance of the displacement between them.

use nalgebra::{DMatrix, Matrix2, Matrix2x3, Vector2, Vector3};

use super::{Chance, Side};
use crate::calib::stats;

/// Columns of square roots of the covariance of the displacement at all places: `G`, with `Cov(δ) = G Gᵀ`.
pub(super) struct Spread {
    /// Two rows for each place, a column for each parameter of the first and then of the second camera. Zero where a place is not seen.
    root: DMatrix<f64>,
    /// Columns of the first camera.
    first: usize,
    /// Whether a place is seen by both.
    seen: Vec<bool>,
}

impl Spread {
    /// `None` where the weighted places do not hold the rotation between the cameras.
    pub(super) fn new(a: &Side, b: &Side, pixels: &[Vector2<f64>], weights: &[f64]) -> Option<Self> {
        let count = |side: &Side| side.camera.params.len();
        let (first, all) = (count(a), count(a) + count(b));
        let mut by_params = DMatrix::zeros(2 * pixels.len(), all);
        let mut by_turn = DMatrix::zeros(2 * pixels.len(), 3);
        let mut seen = vec![false; pixels.len()];
        for (k, px) in pixels.iter().enumerate() {
            let Some(ray) = a.camera.unproject(px) else { continue };
            let here = (a.camera.spec().project)(&a.camera.params, &ray);
            let there = (b.camera.spec().project)(&b.camera.params, &ray);
            let (Some(here), Some(there)) = (here, there) else { continue };
            seen[k] = true;
            for i in 0..first {
                by_params.fixed_view_mut::<2, 1>(2 * k, i).copy_from(&-here.by_params[i]);
            }
            for i in first..all {
                by_params.fixed_view_mut::<2, 1>(2 * k, i).copy_from(&there.by_params[i - first]);
            }
            let turned: Matrix2x3<f64> = there.by_point * -Vector3::from(ray).cross_matrix();
            by_turn.fixed_view_mut::<2, 3>(2 * k, 0).copy_from(&turned);
        }
        // What the best rotation takes away.
        let mut weighted = by_turn.clone();
        for (k, w) in weights.iter().enumerate() {
            weighted.rows_mut(2 * k, 2).scale_mut(*w);
        }
        let normal = weighted.tr_mul(&by_turn).cholesky()?;
        let turns = normal.solve(&weighted.tr_mul(&by_params));
        by_params -= by_turn * turns;
        let mut root = DMatrix::zeros(2 * pixels.len(), all);
        for (from, side) in [(0, a), (first, b)] {
            if let Some(covariance) = &side.covariance {
                let by = by_params.columns(from, count(side)) * square_root(covariance);
                root.columns_mut(from, count(side)).copy_from(&by);
            }
        }
        Some(Self { root, first, seen })
    }

    /// 1σ at each place by one side alone, largest over directions, px.
    pub(super) fn sigma(&self, side: usize) -> Vec<f64> {
        let columns = if side == 0 { 0..self.first } else { self.first..self.root.ncols() };
        let at = |k: usize| {
            let part = self.root.view((2 * k, columns.start), (2, columns.len()));
            let covariance: Matrix2<f64> = Matrix2::from_fn(|i, j| part.row(i).dot(&part.row(j)));
            covariance.symmetric_eigenvalues().max().max(0.0).sqrt()
        };
        (0..self.seen.len()).map(|k| if self.seen[k] { at(k) } else { f64::NAN }).collect()
    }

    /// How much each place counts.
    pub(super) fn weights(&self) -> Vec<f64> {
        let variances: Vec<f64> =
            self.sigma(0).iter().zip(self.sigma(1)).map(|(a, b)| a * a + b * b).collect();
        let mut known: Vec<f64> = variances.iter().copied().filter(|v| v.is_finite()).collect();
        known.sort_by(f64::total_cmp);
        let usual = stats::quantile(&known, 0.5).max(f64::MIN_POSITIVE);
        variances.iter().map(|v| if v.is_finite() { usual / (v + usual) } else { 0.0 }).collect()
    }

    /// What chance lets expect of a displacement.
    pub(super) fn chance(&self, moved: &[Option<Vector2<f64>>], weights: &[f64]) -> Option<Chance> {
        let mut root = self.root.clone();
        let (mut total, mut squares) = (0.0, 0.0);
        for (k, w) in weights.iter().enumerate() {
            let by = moved[k].filter(|_| self.seen[k]);
            let w = if by.is_some() { *w } else { 0.0 };
            root.rows_mut(2 * k, 2).scale_mut(w.sqrt());
            squares += w * by.map_or(0.0, |d| d.norm_squared());
            total += w;
        }
        let by_chance = root.tr_mul(&root) / total;
        let (mean, variance) = (by_chance.trace(), 2.0 * by_chance.norm_squared());
        Chance::new(squares / total, mean, variance)
    }
}

/// `L` with `L Lᵀ` the matrix, which may be singular.
fn square_root(covariance: &DMatrix<f64>) -> DMatrix<f64> {
    // Parameters have scales from 10⁻⁶ to 10³: their σ is set to one first.
    let n = covariance.nrows();
    let scale: Vec<f64> = (0..n).map(|i| covariance[(i, i)].max(0.0).sqrt()).collect();
    let inverse = |s: f64| if s > 0.0 { s.recip() } else { 0.0 };
    let correlation =
        DMatrix::from_fn(n, n, |i, j| covariance[(i, j)] * inverse(scale[i]) * inverse(scale[j]));
    let eigen = correlation.symmetric_eigen();
    let mut root = eigen.eigenvectors;
    for i in 0..n {
        root.column_mut(i).scale_mut(eigen.eigenvalues[i].max(0.0).sqrt());
    }
    for i in 0..n {
        root.row_mut(i).scale_mut(scale[i]);
    }
    root
}
