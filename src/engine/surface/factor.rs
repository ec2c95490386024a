//! Cholesky factors of matrices of a thousand unknowns.
//!
//! Row by row, each number is a product of two rows of the factor: they lie side by side in memory and are summed in lanes. What
//! is zero before the first entry of a row stays zero, and is left out.

use nalgebra::{DMatrix, DVector};

use crate::{camera::LANES, wide};

/// Solves `matrix x = right` by the Cholesky factor of its lower triangle; `None` where it is not positive definite.
pub(crate) fn solve(matrix: &DMatrix<f64>, right: &DVector<f64>) -> Option<DVector<f64>> {
    wide::run(Solve { matrix, right })
}

/// [`solve`].
struct Solve<'a> {
    matrix: &'a DMatrix<f64>,
    right: &'a DVector<f64>,
}

impl wide::Kernel for Solve<'_> {
    type Output = Option<DVector<f64>>;

    #[inline(always)]
    fn run(self) -> Option<DVector<f64>> {
        solved(self.matrix, self.right)
    }
}

#[inline(always)]
fn solved(matrix: &DMatrix<f64>, right: &DVector<f64>) -> Option<DVector<f64>> {
    let n = matrix.nrows();
    // Columns of the transpose are rows.
    let mut rows = matrix.transpose();
    let data = rows.as_mut_slice();
    let mut first = vec![0; n];
    for i in 0..n {
        let (above, below) = data.split_at_mut(i * n);
        let row = &mut below[..n];
        first[i] = row[..i].iter().position(|v| *v != 0.0).unwrap_or(i);
        for j in first[i]..i {
            let other = &above[j * n..j * n + n];
            let from = first[i].max(first[j]);
            if from < j {
                row[j] -= dot(&row[from..j], &other[from..j]);
            }
            row[j] /= other[j];
        }
        let diagonal = row[i];
        let left = diagonal - dot(&row[first[i]..i], &row[first[i]..i]);
        // A pivot that lost all digits is rounding, not information.
        if left.is_nan() || left <= 1e-15 * diagonal {
            return None;
        }
        row[i] = left.sqrt();
    }
    let mut x = right.clone();
    let values = x.as_mut_slice();
    for i in 0..n {
        let row = &data[i * n..i * n + n];
        values[i] = (values[i] - dot(&row[first[i]..i], &values[first[i]..i])) / row[i];
    }
    for i in (0..n).rev() {
        let row = &data[i * n..i * n + n];
        values[i] /= row[i];
        let value = values[i];
        for (v, l) in values[first[i]..i].iter_mut().zip(&row[first[i]..i]) {
            *v -= value * l;
        }
    }
    Some(x)
}

/// Σ aᵢ bᵢ, summed in a fixed order.
#[inline(always)]
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<LANES>(), b.as_chunks::<LANES>());
    let mut sums = [0.0; LANES];
    for (a, b) in a.iter().zip(b) {
        for l in 0..LANES {
            sums[l] += a[l] * b[l];
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
    ((sums[0] + sums[4]) + (sums[1] + sums[5])) + ((sums[2] + sums[6]) + (sums[3] + sums[7])) + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_solves_what_nalgebra_solves() {
        // Banded, with a dense corner, of a size that leaves a rest in every row.
        let n = 61;
        let mut a = DMatrix::from_fn(n, n, |i: usize, j: usize| {
            let near = i.abs_diff(j) < 7 || (i > 50 && j > 50);
            if near { ((i * j) as f64).sin() } else { 0.0 }
        });
        a = &a * a.transpose() + DMatrix::identity(n, n) * 0.1;
        let right = DVector::from_fn(n, |i, _| (i as f64).cos());
        let lower = a.lower_triangle();
        let x = solve(&lower, &right).unwrap();
        assert!((&a * &x - &right).norm() < 1e-9, "{:e}", (&a * &x - &right).norm());
        a[(40, 40)] = -1.0;
        assert!(solve(&a, &right).is_none());
        assert!(solve(&DMatrix::zeros(3, 3), &DVector::zeros(3)).is_none());
    }
}
