//! The squares of a checkerboard, and their mean over a small parallelogram: exact area integration.

use super::{Levels, polygon::Polygon};
use crate::target::BoardSize;

/// A parallelogram that touches more cells than this is simply grey.
const MAX_CELLS: i32 = 400;

/// Grey values of the board's plane. Coordinates are in squares from corner 0.
pub(super) struct Squares {
    /// Squares along x and y run over −1..cols and −1..rows.
    size: [i32; 2],
    margin: f64,
    levels: Levels,
}

/// Position among the lines of one axis: squares are −1..size, the margin −2 and size, outside −3 and size + 1.
type Cell = i32;

impl Squares {
    /// A board of so many inner corners with a white border of `margin` squares.
    pub(super) const fn new(size: BoardSize, margin: f64, levels: Levels) -> Self {
        Self { size: [size.cols as i32, size.rows as i32], margin, levels }
    }

    /// Smallest and largest x and y of the board with its border.
    pub(super) fn ends(&self) -> [[f64; 2]; 2] {
        self.size.map(|n| [-1.0 - self.margin, f64::from(n) + self.margin])
    }

    /// Grey value of a point.
    pub(super) fn at(&self, b: [f64; 2]) -> f32 {
        self.level([self.cell(0, b[0]), self.cell(1, b[1])])
    }

    /// The grey value of the pixel with the map `center + j·[−½, ½]²` where no line comes near it (a tenth of a pixel is
    /// left for the curvature of the map).
    pub(super) fn uniform(&self, center: [f64; 2], j: [[f64; 2]; 2]) -> Option<f32> {
        let cells = |k: usize| {
            let reach = 0.6 * (j[k][0].abs() + j[k][1].abs());
            [self.cell(k, center[k] - reach), self.cell(k, center[k] + reach)]
        };
        let ([i, i2], [k, k2]) = (cells(0), cells(1));
        (i == i2 && k == k2).then(|| self.level([i, k]))
    }

    /// Mean over the parallelogram `center + j·[−½, ½]²`, where `j[axis]` are the derivatives of one board coordinate.
    pub(super) fn mean(&self, center: [f64; 2], j: [[f64; 2]; 2]) -> f32 {
        let reach = j.map(|d| 0.5 * (d[0].abs() + d[1].abs()));
        let range = [0, 1].map(|k| [self.cell(k, center[k] - reach[k]), self.cell(k, center[k] + reach[k])]);
        let [nx, ny] = range.map(|[lo, hi]| hi - lo + 1);
        if nx == 1 && ny == 1 {
            return self.level([range[0][0], range[1][0]]);
        }
        let area = (j[0][0] * j[1][1] - j[0][1] * j[1][0]).abs();
        if nx.saturating_mul(ny) > MAX_CELLS || area < 1e-12 * reach[0] * reach[1] {
            return 0.5 * (f32::from(self.levels.black) + f32::from(self.levels.white));
        }
        let whole = Polygon::parallelogram(center, j);
        let mut sum = 0.0;
        for i in range[0][0]..=range[0][1] {
            let strip = whole.between(0, self.start(0, i), self.start(0, i + 1));
            for k in range[1][0]..=range[1][1] {
                let piece = strip.between(1, self.start(1, k), self.start(1, k + 1));
                sum += piece.area() * f64::from(self.level([i, k]));
            }
        }
        (sum / area) as f32
    }

    fn cell(&self, axis: usize, x: f64) -> Cell {
        let n = self.size[axis];
        if x < -1.0 {
            if x < -1.0 - self.margin { -3 } else { -2 }
        } else if x >= f64::from(n) {
            if x >= f64::from(n) + self.margin { n + 1 } else { n }
        } else {
            x.floor() as i32
        }
    }

    /// Where a cell begins.
    fn start(&self, axis: usize, cell: Cell) -> f64 {
        let n = self.size[axis];
        match cell {
            c if c <= -3 => f64::NEG_INFINITY,
            -2 => -1.0 - self.margin,
            c if c <= n => f64::from(c),
            c if c == n + 1 => f64::from(n) + self.margin,
            _ => f64::INFINITY,
        }
    }

    fn level(&self, cell: [Cell; 2]) -> f32 {
        let l = &self.levels;
        let outside = |k: usize| cell[k] < -2 || cell[k] > self.size[k];
        let margin = |k: usize| cell[k] == -2 || cell[k] == self.size[k];
        // The outer corner square that corner 0 touches is black.
        f32::from(if outside(0) || outside(1) {
            l.background
        } else if margin(0) || margin(1) || (cell[0] + cell[1]) % 2 != 0 {
            l.white
        } else {
            l.black
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synth::Scene;

    fn pattern(margin: f64) -> Squares {
        let board = Scene::seed().board;
        Squares::new(board.size, margin, board.levels)
    }

    #[test]
    fn the_pattern_begins_black_and_ends_in_margin_and_background() {
        let p = pattern(0.5);
        for (at, level) in [
            ([-0.5, -0.5], 0.0),
            ([0.5, 0.5], 0.0),
            ([0.5, -0.5], 255.0),
            ([8.5, -0.5], 255.0),
            ([8.5, 5.5], 255.0),
            ([-0.5, 5.5], 0.0),
            ([-1.2, 2.0], 255.0),
            ([-1.6, 2.0], 160.0),
            ([3.0, 6.7], 160.0),
        ] {
            assert_eq!(p.at(at), level, "{at:?}");
        }
        assert_eq!(pattern(0.0).at([-1.2, 2.0]), 160.0);
    }

    #[test]
    fn means_agree_with_dense_sampling() {
        let p = pattern(0.3);
        let maps = [[[0.7, 0.2], [-0.3, 0.5]], [[0.02, 0.011], [-0.013, 0.019]], [[2.1, -1.7], [0.6, 1.9]]];
        for j in maps {
            for center in [[0.003, -0.004], [4.51, 2.98], [-1.0, 3.3], [9.2, 6.27], [-1.31, -1.29]] {
                let n = 1000;
                let mut sum = 0.0;
                for v in 0..n {
                    for u in 0..n {
                        let [u, v] = [u, v].map(|i| (f64::from(i) + 0.5) / f64::from(n) - 0.5);
                        sum += f64::from(p.at([0, 1].map(|k| center[k] + j[k][0] * u + j[k][1] * v)));
                    }
                }
                let sampled = sum / f64::from(n * n);
                let error = f64::from(p.mean(center, j)) - sampled;
                assert!(error.abs() < 0.15, "{center:?} {j:?}: {error}");
            }
        }
    }
}
