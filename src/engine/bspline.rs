//! Uniform cubic B-splines over a rectangular grid of control points.
//!
//! Control point `k` of a row stands at the index coordinate `k`. A value between them is made of the four nearest in each
//! direction, so it is known from 1 to `count − 2`; there the surface has continuous second derivatives, and the weights are never
//! negative and sum to 1.
//!
//! C. de Boor, *A Practical Guide to Splines*, 1978, chapter IX.

/// Fewest control points in a direction.
pub const FEWEST: usize = 4;

/// Weights of the four control points around a place in one direction, and their derivatives by the index coordinate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weights {
    /// Index of the first of the four.
    pub first: usize,
    /// How much each counts.
    pub value: [f64; 4],
    /// ∂`value`/∂coordinate.
    pub slope: [f64; 4],
}

impl Weights {
    /// At an index coordinate among `count` control points; beyond the ends those of the end, without a slope.
    pub fn new(coordinate: f64, count: usize) -> Self {
        let count = count.max(FEWEST);
        let s = if coordinate.is_nan() { 1.0 } else { coordinate.clamp(1.0, (count - 2) as f64) };
        let cell = (s as usize).min(count - 3);
        let t = s - cell as f64;
        let (t2, u) = (t * t, 1.0 - t);
        let within = if s == coordinate { 1.0 } else { 0.0 };
        Self {
            first: cell - 1,
            value: [
                u * u * u / 6.0,
                (4.0 + t2 * (3.0 * t - 6.0)) / 6.0,
                (1.0 + 3.0 * t + 3.0 * t2 * u) / 6.0,
                t2 * t / 6.0,
            ],
            slope: [-0.5 * u * u, t * (1.5 * t - 2.0), 0.5 + t - 1.5 * t2, 0.5 * t2].map(|d| within * d),
        }
    }
}

/// The sixteen control points around a place of a grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Patch {
    /// Position of the first one in row-major order.
    first: usize,
    columns: usize,
    along: [Weights; 2],
}

/// A control point's part in a value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Part {
    /// Its position in row-major order.
    pub at: usize,
    /// How much it counts.
    pub weight: f64,
    /// ∂`weight`/∂index coordinates `[x, y]`.
    pub slope: [f64; 2],
}

impl Patch {
    /// At index coordinates `[x, y]` of a grid of `[columns, rows]` control points; beyond its ends that of the end.
    pub fn new(coordinates: [f64; 2], count: [usize; 2]) -> Self {
        let along = [0, 1].map(|k| Weights::new(coordinates[k], count[k]));
        let columns = count[0].max(FEWEST);
        Self { first: along[1].first * columns + along[0].first, columns, along }
    }

    /// The parts of the sixteen, row by row.
    pub fn parts(&self) -> [Part; 16] {
        let [x, y] = &self.along;
        std::array::from_fn(|k| {
            let (i, j) = (k % 4, k / 4);
            Part {
                at: self.first + j * self.columns + i,
                weight: x.value[i] * y.value[j],
                slope: [x.slope[i] * y.value[j], x.value[i] * y.slope[j]],
            }
        })
    }

    /// The value of a grid of pairs; zero where the grid lacks a control point.
    pub fn value(&self, grid: &[[f64; 2]]) -> [f64; 2] {
        let [x, y] = &self.along;
        let mut sum = [0.0; 2];
        for (j, wy) in y.value.iter().enumerate() {
            let from = self.first + j * self.columns;
            let Some(row) = grid.get(from..from + 4) else { return [0.0; 2] };
            for (point, wx) in row.iter().zip(&x.value) {
                sum[0] += wx * wy * point[0];
                sum[1] += wx * wy * point[1];
            }
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn straight_lines_are_kept_and_weights_sum_to_one() {
        for s in [1.0, 1.25, 2.0, 3.9, 5.0, 6.0] {
            let w = Weights::new(s, 8);
            let line: f64 = (0..4).map(|k| w.value[k] * (w.first + k) as f64).sum();
            let slope: f64 = (0..4).map(|k| w.slope[k] * (w.first + k) as f64).sum();
            assert!((w.value.iter().sum::<f64>() - 1.0).abs() < 1e-15, "{s}");
            assert!((line - s).abs() < 1e-14 && (slope - 1.0).abs() < 1e-14, "{s}: {line} {slope}");
        }
        // Beyond the ends it is the end, and flat.
        for (beyond, end) in [(-3.0, 1.0), (f64::NAN, 1.0), (99.0, 6.0)] {
            assert_eq!(Weights::new(beyond, 8).value, Weights::new(end, 8).value);
            assert!(Weights::new(beyond, 8).slope.iter().all(|d| *d == 0.0));
        }
    }

    #[test]
    fn slopes_agree_with_central_differences_across_cells() {
        let h = 1e-6;
        for s in [1.3, 2.0, 2.7, 3.0] {
            let at = |s| {
                let w = Weights::new(s, 8);
                (0..4).map(|k| w.value[k] * ((w.first + k) as f64).powi(3)).sum::<f64>()
            };
            let w = Weights::new(s, 8);
            let slope: f64 = (0..4).map(|k| w.slope[k] * ((w.first + k) as f64).powi(3)).sum();
            assert!((slope - (at(s + h) - at(s - h)) / (2.0 * h)).abs() < 1e-8, "{s}");
        }
    }

    #[test]
    fn patches_take_their_own_sixteen() {
        let count = [6, 5];
        let grid: Vec<[f64; 2]> = (0..30).map(|k| [f64::from(k % 6), f64::from(k / 6)]).collect();
        for at in [[1.0, 1.0], [2.4, 1.7], [4.0, 3.0]] {
            let patch = Patch::new(at, count);
            let value = patch.value(&grid);
            assert!((0..2).all(|k| (value[k] - at[k]).abs() < 1e-14), "{at:?} {value:?}");
            let sum: f64 = patch.parts().iter().map(|p| p.weight * grid[p.at][1]).sum();
            assert!((sum - at[1]).abs() < 1e-14);
            let slope: f64 = patch.parts().iter().map(|p| p.slope[0] * grid[p.at][0]).sum();
            assert!((slope - 1.0).abs() < 1e-13);
        }
        assert_eq!(Patch::new([2.0, 2.0], count).value(&grid[..3]), [0.0; 2]);
    }
}
