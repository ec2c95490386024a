//! Residuals, cost and the blocks of the normal matrix, in lanes.

use nalgebra::Vector2;

use super::{Problem, State, block::Block};
use crate::calib::{
    camera::{Batch, LANES, Lanes, MAX_PARAMS},
    pose::Pose,
};

/// Six of the pose, the residual, the intrinsics, one of padding to an even number.
pub(super) const MAX_COLUMNS: usize = 6 + 1 + MAX_PARAMS + 1;
const RESIDUAL: usize = 6;
const INTRINSICS: usize = 7;

/// The blocks of one view.
#[derive(Clone, Debug, Default)]
pub(super) struct ViewBlocks {
    /// `JpᵀJp`, lower triangle.
    pub v: [[f64; 6]; 6],
    /// `Jpᵀr`.
    pub g: [f64; 6],
    pub corners: usize,
}

/// The normal equations before damping.
pub(super) struct Normal {
    /// Number of free intrinsics.
    pub free: usize,
    /// `Σ JbᵀJb`, lower triangle.
    pub u: [[f64; MAX_PARAMS]; MAX_PARAMS],
    /// `Σ Jbᵀr`.
    pub gu: [f64; MAX_PARAMS],
    pub views: Vec<ViewBlocks>,
    /// `JbᵀJp`: one row of six for each view and free parameter.
    pub w: Vec<[f64; 6]>,
    pub corners: usize,
    columns: [Vec<Column>; 2],
    rows: Vec<Rows>,
}

/// An active column of the intrinsics: parameter of the model and its place among the free ones.
#[derive(Clone, Copy)]
struct Column {
    param: usize,
    slot: usize,
}

/// Weighted columns of [`LANES`] corners: of u, of v.
#[derive(Clone)]
struct Rows([[Lanes; MAX_COLUMNS]; 2]);

/// Sums over all corners.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sum {
    /// Σ ρ(w |r|²).
    pub cost: f64,
    /// Σ |r|².
    pub squares: f64,
    pub corners: usize,
    /// Largest coordinate seen, px: the scale of rounding.
    pub largest_px: f64,
}

impl Sum {
    pub(super) fn rms_px(&self) -> f64 {
        (self.squares / self.corners.max(1) as f64).sqrt()
    }
}

impl Normal {
    pub(super) fn new(problem: &Problem<'_>) -> Self {
        let n = problem.spec.params.len();
        // u never depends on fy, cy (1, 3), v never on fx, cx (0, 2).
        let columns = [[1, 3], [0, 2]].map(|absent| {
            (0..n)
                .filter(|i| !absent.contains(i))
                .filter_map(|param| Some(Column { param, slot: problem.free.slot(param)? }))
                .collect()
        });
        let chunks = problem.blocks.iter().map(|b| b.points.len()).max().unwrap_or(0);
        let views = problem.blocks.len();
        Self {
            free: problem.free.len(),
            u: [[0.0; MAX_PARAMS]; MAX_PARAMS],
            gu: [0.0; MAX_PARAMS],
            views: vec![ViewBlocks::default(); views],
            w: vec![[0.0; 6]; views * problem.free.len()],
            corners: problem.blocks.iter().map(Block::len).sum(),
            columns,
            rows: vec![Rows([[[0.0; LANES]; MAX_COLUMNS]; 2]); chunks],
        }
    }

    /// Fills all blocks at a point (poses centred).
    pub(super) fn build(&mut self, problem: &Problem<'_>, at: &State) {
        self.u = [[0.0; MAX_PARAMS]; MAX_PARAMS];
        self.gu = [0.0; MAX_PARAMS];
        let mut batch = Batch::ZERO;
        for (i, (block, pose)) in problem.blocks.iter().zip(&at.poses).enumerate() {
            for c in 0..block.points.len() {
                linearise(problem, &at.params, block, pose, c, &mut batch, &self.columns, &mut self.rows[c]);
            }
            self.views[i] = ViewBlocks { corners: block.len(), ..ViewBlocks::default() };
            let p = self.free;
            self.w[i * p..(i + 1) * p].fill([0.0; 6]);
            for side in 0..2 {
                self.add(i, side, block.points.len());
            }
        }
    }

    /// Adds the products of one side's columns to the blocks of view `i`.
    fn add(&mut self, i: usize, side: usize, chunks: usize) {
        let columns = &self.columns[side];
        let n = INTRINSICS + columns.len();
        let rows = &self.rows[..chunks];
        let view = &mut self.views[i];
        let w = &mut self.w[i * self.free..(i + 1) * self.free];
        for a in (0..n).step_by(2) {
            for b in (0..=a).step_by(2) {
                let t = products(rows, side, a, b);
                for (r, row) in (a..n.min(a + 2)).zip(&t) {
                    for (c, &value) in (b..=r.min(b + 1)).zip(row) {
                        match (r, c) {
                            (..RESIDUAL, _) => view.v[r][c] += value,
                            (RESIDUAL, ..RESIDUAL) => view.g[c] += value,
                            (RESIDUAL, _) => {}
                            (_, ..RESIDUAL) => w[columns[r - INTRINSICS].slot][c] += value,
                            (_, RESIDUAL) => self.gu[columns[r - INTRINSICS].slot] += value,
                            _ => {
                                let (x, y) = (columns[r - INTRINSICS].slot, columns[c - INTRINSICS].slot);
                                // Two columns that share one value contribute their product twice.
                                let twice = if x == y && r != c { 2.0 } else { 1.0 };
                                self.u[x.max(y)][x.min(y)] += twice * value;
                            }
                        }
                    }
                }
            }
        }
    }
}

/// Products of columns a, a+1 with columns b, b+1, summed over all corners.
#[inline(always)]
fn products(rows: &[Rows], side: usize, a: usize, b: usize) -> [[f64; 2]; 2] {
    const HALF: usize = LANES / 2;
    let mut sum = [[[0.0; HALF]; 2]; 2];
    for Rows(row) in rows {
        let row = &row[side];
        let (x, y) = ([&row[a], &row[a + 1]], [&row[b], &row[b + 1]]);
        for h in [0, HALF] {
            for i in 0..2 {
                for j in 0..2 {
                    for l in 0..HALF {
                        sum[i][j][l] += x[i][h + l] * y[j][h + l];
                    }
                }
            }
        }
    }
    sum.map(|r| r.map(|s| (s[0] + s[2]) + (s[1] + s[3])))
}

/// `R x` and `R x + t` of one chunk.
#[inline(always)]
fn transform(pose: &Pose, points: &[Lanes; 3]) -> ([Lanes; 3], [Lanes; 3]) {
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

/// Weighted residuals and columns of one chunk.
fn linearise(
    problem: &Problem<'_>,
    params: &[f64],
    block: &Block,
    pose: &Pose,
    chunk: usize,
    batch: &mut Batch,
    columns: &[Vec<Column>; 2],
    Rows(rows): &mut Rows,
) {
    let (q, placed) = transform(pose, &block.points[chunk]);
    (problem.spec.project_batch)(params, &placed, batch);
    let observed = &block.observed[chunk];
    let root = &block.roots[chunk];
    let mut r = [[0.0; LANES]; 2];
    for side in 0..2 {
        for l in 0..LANES {
            r[side][l] = observed[side][l] - batch.px[side][l];
        }
    }
    let (mut scale, mut pull) = (*root, *root); // of Jacobian and residual: √w in the matrix; w in the gradient = scale · pull
    if let Some(k) = problem.huber_px {
        for l in 0..LANES {
            let e = root[l] * (r[0][l] * r[0][l] + r[1][l] * r[1][l]).sqrt();
            let w = k / e.max(k);
            let half = if e > k { 0.5 * w } else { 1.0 };
            scale[l] = root[l] * half.sqrt();
            pull[l] = root[l] * w / half.sqrt();
        }
    }
    for side in 0..2 {
        let by = &batch.by_point[side];
        let row = &mut rows[side];
        for l in 0..LANES {
            // ∂(R x)/∂ω = −[q]ₓ, q = R x.
            let (dx, dy, dz) = (scale[l] * by[0][l], scale[l] * by[1][l], scale[l] * by[2][l]);
            row[0][l] = dz * q[1][l] - dy * q[2][l];
            row[1][l] = dx * q[2][l] - dz * q[0][l];
            row[2][l] = dy * q[0][l] - dx * q[1][l];
            row[3][l] = dx;
            row[4][l] = dy;
            row[5][l] = dz;
            row[RESIDUAL][l] = pull[l] * r[side][l];
        }
        for (to, column) in row[INTRINSICS..].iter_mut().zip(&columns[side]) {
            let from = &batch.by_params[side][column.param];
            for l in 0..LANES {
                to[l] = scale[l] * from[l];
            }
        }
        if problem.single_precision {
            for value in row.iter_mut().flatten() {
                *value = f64::from(*value as f32);
            }
        }
    }
}

/// The sums at a point (poses centred); the cost is infinite or NaN where a corner is not visible.
pub(super) fn cost(problem: &Problem<'_>, at: &State) -> Sum {
    let mut total = Sum::default();
    if at.params[0] <= 0.0 || at.params[1] <= 0.0 {
        return Sum { cost: f64::INFINITY, ..total };
    }
    let mut px = [[0.0; LANES]; 2];
    for (block, pose) in problem.blocks.iter().zip(&at.poses) {
        let (mut cost, mut squares, mut largest) = ([0.0; LANES], [0.0; LANES], [0.0f64; LANES]);
        for ((points, observed), root) in block.points.iter().zip(&block.observed).zip(&block.roots) {
            let (_, placed) = transform(pose, points);
            (problem.spec.project_px_batch)(&at.params, &placed, &mut px);
            for l in 0..LANES {
                let (du, dv) = (observed[0][l] - px[0][l], observed[1][l] - px[1][l]);
                let square = du * du + dv * dv;
                let weighted = root[l] * root[l] * square;
                let real = if root[l] > 0.0 { 1.0 } else { 0.0 };
                squares[l] += real * square;
                largest[l] = largest[l].max(observed[0][l].abs()).max(observed[1][l].abs());
                cost[l] += match problem.huber_px {
                    Some(k) if weighted > k * k => 2.0 * k * weighted.sqrt() - k * k,
                    _ => weighted,
                };
            }
        }
        total.cost += cost.iter().sum::<f64>();
        total.squares += squares.iter().sum::<f64>();
        total.largest_px = largest.iter().copied().fold(total.largest_px, f64::max);
        total.corners += block.len();
    }
    total
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
