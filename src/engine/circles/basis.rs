//! The axes of a lattice as the board has them.
//!
//! Any two steps span a lattice; under tilt the growing may have taken a diagonal for a row. The dots are circles on the board,
//! so their ellipses are the board's metric in the picture. In it the shortest basis (Lagrange's reduction of a quadratic
//! form) of a square lattice is its rows and columns, and it must be orthogonal with equal lengths.

use nalgebra::{Matrix2, Vector2};

use super::ellipse::Dot;
use crate::detect::sheet::{Sheet, add, guess};

/// Largest cosine between rows and columns on the board, and largest ratio of their spacings.
const SQUARE: [f64; 2] = [0.12, 1.12];

/// A lattice's shape on its board, in radii of the dots.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shape {
    /// Spacing of neighbours over the radius of a dot.
    pub(super) spacing: f64,
    /// Whether rows and columns are orthogonal and equally spaced.
    pub(super) is_square: bool,
}

/// Gives the lattice the axes of the board; `None` where its shape cannot be measured.
pub(super) fn straighten(dots: &Sheet<Dot>) -> Option<(Sheet<Dot>, Shape)> {
    let gram = gram(dots)?;
    let basis = reduced(gram)?;
    let g = basis.transpose() * gram * basis;
    let (a, b, c) = (g[(0, 0)].sqrt(), g[(0, 1)], g[(1, 1)].sqrt());
    let mut shape = Shape {
        spacing: (a * c).sqrt(),
        is_square: (b / (a * c)).abs() < SQUARE[0] && a.max(c) / a.min(c) < SQUARE[1],
    };
    // Cells transform against their basis; the determinant is 1.
    let [p, q, r, s] = [basis[(0, 0)], basis[(0, 1)], basis[(1, 0)], basis[(1, 1)]].map(|v| v as i32);
    let mut out = Sheet::new();
    for (cell, dot) in dots.iter() {
        out.set([s * cell[0] - q * cell[1], p * cell[1] - r * cell[0]], dot);
    }
    shape.spacing = spacing(&out).unwrap_or(shape.spacing);
    Some((out, shape))
}

/// Median distance of neighbours in radii, each the geometric mean of what its two dots say: perspective cancels to first
/// order.
fn spacing(dots: &Sheet<Dot>) -> Option<f64> {
    let edges = dots.iter().flat_map(|(cell, dot)| {
        [[1, 0], [0, 1]].into_iter().filter_map(move |step| {
            let next = dots.get(add(cell, step))?;
            let d = next.px - dot.px;
            Some((product(&dot, d, d) * product(&next, d, d)).powf(0.25))
        })
    });
    median(edges.collect())
}

/// Product of two steps in the metric in which the dot is a circle of radius 1.
fn product(dot: &Dot, p: Vector2<f64>, q: Vector2<f64>) -> f64 {
    let [a, b, c] = dot.ellipse;
    (c * p.x * q.x - b * (p.x * q.y + p.y * q.x) + a * p.y * q.y) / (a * c - b * b)
}

/// Median products of the steps in the metric of the dots.
fn gram(dots: &Sheet<Dot>) -> Option<Matrix2<f64>> {
    let mut lists = [Vec::new(), Vec::new(), Vec::new()];
    for (cell, dot) in dots.iter() {
        let Some(g) = guess(dots, cell, |d| d.px) else { continue };
        let [u, v] = g.uv;
        for (list, (p, q)) in lists.iter_mut().zip([(u, u), (u, v), (v, v)]) {
            list.push(product(&dot, p, q));
        }
    }
    let [a, b, c] = lists.map(median);
    Some(Matrix2::new(a?, b?, b?, c?))
}

pub(super) fn median(mut list: Vec<f64>) -> Option<f64> {
    list.retain(|v| v.is_finite());
    let middle = list.len() / 2;
    (!list.is_empty()).then(|| *list.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// The shortest basis with determinant 1, whole numbers in columns.
fn reduced(gram: Matrix2<f64>) -> Option<Matrix2<f64>> {
    let (mut p, mut q) = (Vector2::new(1.0, 0.0), Vector2::new(0.0, 1.0));
    let product = |a: Vector2<f64>, b: Vector2<f64>| a.dot(&(gram * b));
    for _ in 0..32 {
        if product(p, p) > product(q, q) {
            (p, q) = (q, -p);
        }
        let short = product(p, p);
        if short <= 0.0 || !short.is_finite() {
            return None;
        }
        let steps = (product(p, q) / short).round();
        if steps == 0.0 {
            return Some(Matrix2::from_columns(&[p, q]));
        }
        q -= p * steps;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sheared_basis_is_straightened() {
        for shear in [-3.0, -1.0, 0.0, 1.0, 2.0] {
            // Steps (1, 0) and (shear, 1) of a square lattice of 3 radii.
            let gram = Matrix2::new(9.0, 9.0 * shear, 9.0 * shear, 9.0 * (shear * shear + 1.0));
            let basis = reduced(gram).unwrap();
            let g = basis.transpose() * gram * basis;
            assert!((g - Matrix2::identity() * 9.0).norm() < 1e-12, "{shear}: {g}");
            assert!((basis.determinant() - 1.0).abs() < 1e-12);
        }
        assert!(reduced(Matrix2::zeros()).is_none());
    }
}
