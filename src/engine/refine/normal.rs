//! Residuals, cost and the blocks of the normal matrix, in lanes.

use nalgebra::Vector2;

use super::{Problem, State, block::Block};
use crate::{
    camera::{Batch, LANES, Lanes, MAX_PARAMS},
    pose::Pose,
};

/// Six of the pose, the residual, the intrinsics.
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
    /// Of u, of v.
    sides: [Side; 2],
}

/// What one coordinate of the picture contributes.
struct Side {
    /// The intrinsics that move it.
    columns: Vec<Column>,
    /// Number of columns with those of pose and residual, made even.
    width: usize,
    /// Weighted columns of one view: `width` for each [`LANES`] corners.
    rows: Vec<Lanes>,
    /// Products of columns `[a · width + b]`, `b ≤ a`, not yet summed over lanes. Those with a column of the pose are of one
    /// view, the others run over all views.
    products: Vec<[f64; HALF]>,
}

/// Lanes in which products are summed.
const HALF: usize = LANES / 2;

/// An active column of the intrinsics: parameter of the model and its place among the free ones.
#[derive(Clone, Copy)]
struct Column {
    param: usize,
    slot: usize,
}

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
        let chunks = problem.blocks.iter().map(|b| b.points.len()).max().unwrap_or(0);
        let views = problem.blocks.len();
        // u never depends on fy, cy (1, 3), v never on fx, cx (0, 2).
        let sides = [[1, 3], [0, 2]].map(|absent| {
            let free = (0..n).filter(|i| !absent.contains(i));
            let columns: Vec<_> =
                free.filter_map(|param| Some(Column { param, slot: problem.free.slot(param)? })).collect();
            let width = (INTRINSICS + columns.len()).next_multiple_of(2);
            let rows = vec![[0.0; LANES]; chunks * width];
            Side { columns, width, rows, products: vec![[0.0; HALF]; width * width] }
        });
        Self {
            free: problem.free.len(),
            u: [[0.0; MAX_PARAMS]; MAX_PARAMS],
            gu: [0.0; MAX_PARAMS],
            views: vec![ViewBlocks::default(); views],
            w: vec![[0.0; 6]; views * problem.free.len()],
            corners: problem.blocks.iter().map(Block::len).sum(),
            sides,
        }
    }

    /// Fills all blocks at a point (poses centred).
    pub(super) fn build(&mut self, problem: &Problem<'_>, at: &State) {
        let mut batch = Batch::ZERO;
        for side in &mut self.sides {
            side.products.fill([0.0; HALF]);
        }
        for (i, (block, pose)) in problem.blocks.iter().zip(&at.poses).enumerate() {
            let chunks = block.points.len();
            for chunk in 0..chunks {
                linearise(problem, &at.params, block, pose, chunk, &mut batch, &mut self.sides);
            }
            self.views[i] = ViewBlocks { corners: block.len(), ..ViewBlocks::default() };
            let w = &mut self.w[i * self.free..(i + 1) * self.free];
            w.fill([0.0; 6]);
            for side in &mut self.sides {
                side.multiply(chunks);
                side.add_pose(&mut self.views[i], w);
            }
        }
        self.u = [[0.0; MAX_PARAMS]; MAX_PARAMS];
        self.gu = [0.0; MAX_PARAMS];
        for side in &self.sides {
            side.add_intrinsics(&mut self.u, &mut self.gu);
        }
    }
}

impl Side {
    /// Products of all columns of one view, in tiles of 2 × 2.
    fn multiply(&mut self, chunks: usize) {
        let width = self.width;
        let rows = &self.rows[..chunks * width];
        for a in (0..width).step_by(2) {
            for b in (0..=a).step_by(2) {
                let place = |i: usize| (a + i) * width + b;
                let mut sum = [[[0.0; HALF]; 2]; 2];
                if b >= RESIDUAL {
                    for i in 0..2 {
                        sum[i].copy_from_slice(&self.products[place(i)..place(i) + 2]);
                    }
                }
                for row in rows.chunks_exact(width) {
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
                for i in 0..2 {
                    self.products[place(i)..place(i) + 2].copy_from_slice(&sum[i]);
                }
            }
        }
    }

    fn product(&self, a: usize, b: usize) -> f64 {
        let lanes = &self.products[a * self.width + b];
        (lanes[0] + lanes[2]) + (lanes[1] + lanes[3])
    }

    /// Adds what concerns the pose of the view multiplied last.
    fn add_pose(&self, view: &mut ViewBlocks, w: &mut [[f64; 6]]) {
        for a in 0..6 {
            for b in 0..=a {
                view.v[a][b] += self.product(a, b);
            }
            view.g[a] += self.product(RESIDUAL, a);
        }
        for (a, column) in self.columns.iter().enumerate() {
            for b in 0..6 {
                w[column.slot][b] += self.product(INTRINSICS + a, b);
            }
        }
    }

    /// Adds what concerns the intrinsics alone, of all views.
    fn add_intrinsics(&self, u: &mut [[f64; MAX_PARAMS]; MAX_PARAMS], gu: &mut [f64; MAX_PARAMS]) {
        for (a, x) in self.columns.iter().enumerate() {
            gu[x.slot] += self.product(INTRINSICS + a, RESIDUAL);
            for (b, y) in self.columns[..=a].iter().enumerate() {
                // Two columns that share one value contribute their product twice.
                let twice = if x.slot == y.slot && a != b { 2.0 } else { 1.0 };
                u[x.slot.max(y.slot)][x.slot.min(y.slot)] +=
                    twice * self.product(INTRINSICS + a, INTRINSICS + b);
            }
        }
    }
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
    sides: &mut [Side; 2],
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
            // Selected, not branched, so that all lanes go together.
            let (longer, half, double) = if e > k { (e, 0.5, 2.0) } else { (k, 1.0, 1.0) };
            let factor = (half * (k / longer)).sqrt();
            scale[l] *= factor;
            pull[l] *= double * factor;
        }
    }
    for (side, Side { columns, width, rows, .. }) in sides.iter_mut().enumerate() {
        let by = &batch.by_point[side];
        let (pose, intrinsics) = rows[chunk * *width..(chunk + 1) * *width].split_at_mut(INTRINSICS);
        let Some(row) = pose.first_chunk_mut::<INTRINSICS>() else { continue };
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
        for (to, column) in intrinsics.iter_mut().zip(columns.iter()) {
            let from = &batch.by_params[side][column.param];
            for l in 0..LANES {
                to[l] = scale[l] * from[l];
            }
        }
        if problem.single_precision {
            for value in pose.iter_mut().chain(intrinsics).flatten() {
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
