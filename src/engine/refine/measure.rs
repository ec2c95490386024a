//! Residuals and their sums, in lanes.

use nalgebra::Vector2;

use super::{Problem, State, block::Block};
use crate::{
    camera::{LANES, Lanes},
    pose::Pose,
    wide,
};

/// Sums over all corners.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sum {
    /// Σ ρ(w |r|²); infinite or NaN where a corner is not visible.
    pub cost: f64,
    /// Σ |r|².
    pub squares: f64,
    pub corners: usize,
}

impl Sum {
    pub(super) fn rms_px(&self) -> f64 {
        (self.squares / self.corners.max(1) as f64).sqrt()
    }
}

/// `R x` and `R x + t` of one chunk.
#[inline(always)]
pub(super) fn transform(pose: &Pose, points: &[Lanes; 3]) -> ([Lanes; 3], [Lanes; 3]) {
    let (m, t) = (pose.matrix(), &pose.translation);
    let mut turned = [[0.0; LANES]; 3];
    let mut placed = [[0.0; LANES]; 3];
    for k in 0..3 {
        let (a, b, c) = (m[(k, 0)], m[(k, 1)], m[(k, 2)]);
        for l in 0..LANES {
            turned[k][l] = a * points[0][l] + b * points[1][l] + c * points[2][l];
            placed[k][l] = turned[k][l] + t[k];
        }
    }
    (turned, placed)
}

/// The sums at a point (poses centred), and |r|² of all corners, block by block, each padded to whole chunks.
pub(super) fn measure(problem: &Problem<'_>, at: &State, squares: &mut Vec<Lanes>) -> Sum {
    squares.resize(problem.blocks.iter().map(|b| b.points.len()).sum(), [0.0; LANES]);
    if at.params[0] <= 0.0 || at.params[1] <= 0.0 {
        return Sum { cost: f64::INFINITY, ..Sum::default() };
    }
    wide::run(Measure { problem, at, squares });
    weigh(problem, squares)
}

/// [`measure`] with the squared residuals at hand: where only the loss or the weights have changed.
pub(super) fn weigh(problem: &Problem<'_>, squares: &[Lanes]) -> Sum {
    wide::run(Weigh { problem, squares })
}

struct Measure<'a, 'p> {
    problem: &'a Problem<'p>,
    at: &'a State,
    squares: &'a mut [Lanes],
}

impl wide::Kernel for Measure<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let mut px = [[0.0; LANES]; 2];
        let mut squares = self.squares.iter_mut();
        for (block, pose) in self.problem.blocks.iter().zip(&self.at.poses) {
            for ((points, observed), square) in block.points.iter().zip(&block.observed).zip(&mut squares) {
                let (_, placed) = transform(pose, points);
                (self.problem.spec.project_px_batch)(&self.at.params, &placed, &mut px);
                for l in 0..LANES {
                    let (du, dv) = (observed[0][l] - px[0][l], observed[1][l] - px[1][l]);
                    square[l] = du * du + dv * dv;
                }
            }
        }
    }
}

struct Weigh<'a, 'p> {
    problem: &'a Problem<'p>,
    squares: &'a [Lanes],
}

impl wide::Kernel for Weigh<'_, '_> {
    type Output = Sum;

    #[inline(always)]
    fn run(self) -> Sum {
        let k = self.problem.huber_px.unwrap_or(f64::INFINITY);
        let mut total = Sum::default();
        let mut all = self.squares.iter();
        for block in self.problem.blocks {
            let (mut cost, mut squares) = ([0.0; LANES], [0.0; LANES]);
            for (root, square) in block.roots.iter().zip(&mut all) {
                let mut weighted = [0.0; LANES];
                let mut most = 0.0;
                for l in 0..LANES {
                    weighted[l] = root[l] * root[l] * square[l];
                    squares[l] += if root[l] > 0.0 { square[l] } else { 0.0 };
                    most = if weighted[l] > most { weighted[l] } else { most };
                }
                // Selected, not branched, so that all lanes go together.
                for l in 0..if most > k * k { LANES } else { 0 } {
                    let beyond = 2.0 * k * weighted[l].sqrt() - k * k;
                    weighted[l] = if weighted[l] > k * k { beyond } else { weighted[l] };
                }
                for l in 0..LANES {
                    cost[l] += weighted[l];
                }
            }
            total.cost += cost.iter().sum::<f64>();
            total.squares += squares.iter().sum::<f64>();
            total.corners += block.len();
        }
        total
    }
}

/// Observed − projected of each corner of a block (pose centred), px.
pub(super) fn residuals(
    problem: &Problem<'_>,
    params: &[f64],
    pose: &Pose,
    block: &Block,
) -> Vec<Vector2<f64>> {
    let mut px = [[0.0; LANES]; 2];
    let mut all = Vec::with_capacity(block.len());
    for (points, observed) in block.points.iter().zip(&block.observed) {
        (problem.spec.project_px_batch)(params, &transform(pose, points).1, &mut px);
        let n = LANES.min(block.len() - all.len());
        all.extend((0..n).map(|l| Vector2::new(observed[0][l] - px[0][l], observed[1][l] - px[1][l])));
    }
    all
}
