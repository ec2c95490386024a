//! Which parameters cannot be told from zero, all of them together.

use nalgebra::{DMatrix, DVector};

use super::chi2_below;

/// The probability within ±2 σ of one normal deviation: beyond it a value counts as told from zero.
const TOLD: f64 = 0.9545;

/// Positions of the parameters that cannot be told from zero: each lies within 2 σ of it, and all of them together are within
/// what that means for their number (χ² of their joint covariance). Where two stand for one another, each alone is uncertain
/// but not both: then the surer one is kept.
///
/// Parameters before `first` and those with a variance of zero, which were held, are never named.
pub fn indistinct(values: &[f64], covariance: &DMatrix<f64>, first: usize) -> Vec<usize> {
    let in_sigma = |i: usize| values[i].abs() / covariance[(i, i)].sqrt();
    let mut list: Vec<usize> = (first..values.len().min(covariance.nrows()))
        .filter(|&i| covariance[(i, i)] > 0.0 && in_sigma(i) < 2.0)
        .collect();
    while !list.is_empty() {
        let v = DVector::from_iterator(list.len(), list.iter().map(|&i| values[i]));
        let c = DMatrix::from_fn(list.len(), list.len(), |i, j| covariance[(list[i], list[j])]);
        let distance = c.cholesky().map_or(f64::INFINITY, |c| v.dot(&c.solve(&v)));
        if chi2_below(distance, list.len()) < TOLD {
            break;
        }
        let surest = (0..list.len()).max_by(|a, b| in_sigma(list[*a]).total_cmp(&in_sigma(list[*b])));
        list.remove(surest.unwrap_or(0));
    }
    list
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_that_stand_for_one_another_are_not_both_free() {
        // Each within 1.5 σ of zero, their sum 15 σ from it.
        let c = DMatrix::from_row_slice(3, 3, &[1.0, 0.0, 0.0, 0.0, 1.0, -0.98, 0.0, -0.98, 1.0]);
        assert_eq!(indistinct(&[0.1, 1.5, 1.4], &c, 0), [0, 2]);
        assert_eq!(indistinct(&[0.1, 1.5, -1.4], &c, 0), [0, 1, 2]);
        assert_eq!(indistinct(&[3.0, 0.5, 0.5], &DMatrix::identity(3, 3), 0), [1, 2]);
        assert_eq!(indistinct(&[0.0, 0.5, 0.5], &DMatrix::identity(3, 3), 2), [2]);
        assert!(indistinct(&[0.0; 3], &DMatrix::zeros(3, 3), 0).is_empty());
    }
}
