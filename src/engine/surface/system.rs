//! Normal equations of the knots, the poses eliminated.

use nalgebra::{DMatrix, DVector, Vector2};

use super::{factor, rows::ViewRows};
use crate::{bspline::Patch, order};

/// `Σ w BᵀB − …` and `Σ w Bᵀr − …` over some views; unknown `2 s + k` is coordinate k of the free knot s.
#[derive(Clone, Debug)]
pub(crate) struct System {
    matrix: DMatrix<f64>,
    right: DVector<f64>,
}

impl System {
    /// Of no view, for this number of free knots.
    pub(crate) fn zero(free: usize) -> Self {
        Self { matrix: DMatrix::zeros(2 * free, 2 * free), right: DVector::zeros(2 * free) }
    }

    /// Adds a view with its pose eliminated (Schur); nothing where its pose is not determined.
    pub(crate) fn add(&mut self, view: &ViewRows, slots: &[Option<usize>]) {
        let Some(information) = view.pose_information() else { return };
        let mut touched: Vec<usize> =
            view.rows.iter().flat_map(|r| r.patch.parts()).filter_map(|p| slots[p.at]).collect();
        order::by(&mut touched, |i| [*i as f64]);
        touched.dedup();
        let place = |slot: usize| touched.binary_search(&slot).ok();
        // Wᵀ = Σ w JᵀB, six rows; then L⁻¹ Wᵀ.
        let mut between = DMatrix::<f64>::zeros(6, 2 * touched.len());
        let mut gradient = DVector::<f64>::zeros(6);
        for row in view.rows.iter().filter(|r| r.weight > 0.0) {
            let parts = row.patch.parts().map(|p| (slots[p.at], p.weight));
            let by_pose = row.by_pose.transpose();
            gradient += by_pose * row.residual * row.weight;
            for (slot, a) in parts {
                let Some(slot) = slot else { continue };
                let a = a * row.weight;
                let Some(at) = place(slot) else { continue };
                for k in 0..2 {
                    self.right[2 * slot + k] += a * row.residual[k];
                    let mut column = between.column_mut(2 * at + k);
                    column.axpy(a, &by_pose.column(k), 1.0);
                }
                for (other, b) in parts {
                    if let Some(other) = other.filter(|other| *other <= slot) {
                        self.matrix[(2 * slot, 2 * other)] += a * b;
                        self.matrix[(2 * slot + 1, 2 * other + 1)] += a * b;
                    }
                }
            }
        }
        let l = information.l();
        if !l.solve_lower_triangular_mut(&mut between) || !l.solve_lower_triangular_mut(&mut gradient) {
            return;
        }
        let across = between.tr_mul(&between);
        let right = between.tr_mul(&gradient);
        for (i, a) in touched.iter().enumerate() {
            for p in 0..2 {
                self.right[2 * a + p] -= right[2 * i + p];
                for (j, b) in touched.iter().enumerate().take(i + 1) {
                    for q in 0..2 {
                        self.matrix[(2 * a + p, 2 * b + q)] -= across[(2 * i + p, 2 * j + q)];
                    }
                }
            }
        }
    }

    /// Adds a place where the surface shall have a value.
    pub(crate) fn add_place(&mut self, patch: &Patch, value: &Vector2<f64>, slots: &[Option<usize>]) {
        let parts = patch.parts().map(|p| (slots[p.at], p.weight));
        for (slot, a) in parts {
            let Some(slot) = slot else { continue };
            for k in 0..2 {
                self.right[2 * slot + k] += a * value[k];
            }
            for (other, b) in parts {
                if let Some(other) = other.filter(|other| *other <= slot) {
                    self.matrix[(2 * slot, 2 * other)] += a * b;
                    self.matrix[(2 * slot + 1, 2 * other + 1)] += a * b;
                }
            }
        }
    }

    /// This and another.
    pub(crate) fn add_all(&mut self, other: &Self) {
        self.matrix += &other.matrix;
        self.right += &other.right;
    }

    /// This without another that is part of it.
    pub(crate) fn without(&self, other: &Self) -> Self {
        Self { matrix: &self.matrix - &other.matrix, right: &self.right - &other.right }
    }

    /// Mean of the diagonal: the information about a usual knot.
    pub(crate) fn scale(&self) -> f64 {
        self.matrix.diagonal().mean()
    }

    /// The knots that minimise the sum with `penalty` (of one coordinate, lower triangle) times `factor`; `None` where they
    /// are not determined.
    pub(crate) fn solve(&self, penalty: &DMatrix<f64>, factor: f64) -> Option<DVector<f64>> {
        let mut matrix = self.matrix.clone();
        for j in 0..penalty.ncols() {
            for i in j..penalty.nrows() {
                let value = factor * penalty[(i, j)];
                matrix[(2 * i, 2 * j)] += value;
                matrix[(2 * i + 1, 2 * j + 1)] += value;
            }
        }
        factor::solve(&matrix, &self.right)
    }
}
