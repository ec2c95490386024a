//! The blocks of the normal matrix, in lanes.

use super::{Problem, State, block::Block, measure::transform, schur::Reduced};
use crate::{
    camera::{Batch, LANES, Lanes, MAX_PARAMS},
    pose::Pose,
    wide,
};

/// Six of the pose, the residual, the intrinsics.
const RESIDUAL: usize = 6;
const INTRINSICS: usize = 7;

/// The blocks of one view.
#[derive(Clone, Debug, Default)]
pub(super) struct ViewBlocks {
    /// `JpᵀJp`, lower triangle.
    pub v: [[f64; 6]; 6],
    pub corners: usize,
}

/// The normal equations before damping.
pub(super) struct Normal {
    /// Number of free intrinsics.
    pub free: usize,
    /// `Σ JbᵀJb`, lower triangle.
    pub u: Reduced,
    /// `Σ Jbᵀr`.
    pub gu: [f64; MAX_PARAMS],
    pub views: Vec<ViewBlocks>,
    /// `JpᵀJb` of each view: a column for each free parameter, then `Jpᵀr`.
    pub w: Vec<Six>,
    /// [`Six`] of one view: columns of `w` in fours.
    pub fours: usize,
    pub corners: usize,
    batch: Box<Batch>,
    /// Of u, of v.
    sides: [Side; 2],
}

/// Four columns of a matrix of six rows.
pub(super) type Six = [[f64; 4]; 6];

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

impl Normal {
    pub(super) fn new(problem: &Problem<'_>) -> Self {
        let n = problem.spec.params.len();
        // u never depends on fy, cy (1, 3), v never on fx, cx (0, 2).
        let sides = [[1, 3], [0, 2]].map(|absent| {
            let free = (0..n).filter(|i| !absent.contains(i));
            let columns: Vec<_> =
                free.filter_map(|param| Some(Column { param, slot: problem.free.slot(param)? })).collect();
            let width = (INTRINSICS + columns.len()).next_multiple_of(2);
            Side { columns, width, rows: Vec::new(), products: vec![[0.0; HALF]; width * width] }
        });
        let mut new = Self {
            free: problem.free.len(),
            u: Reduced::default(),
            gu: [0.0; MAX_PARAMS],
            views: Vec::new(),
            w: Vec::new(),
            fours: (problem.free.len() + 1).div_ceil(4),
            corners: 0,
            batch: Box::new(Batch::ZERO),
            sides,
        };
        new.resize(problem);
        new
    }

    /// Makes room for other views.
    pub(super) fn resize(&mut self, problem: &Problem<'_>) {
        let chunks = problem.blocks.iter().map(|b| b.points.len()).max().unwrap_or(0);
        for side in &mut self.sides {
            side.rows.resize(chunks * side.width, [0.0; LANES]);
        }
        self.views.resize(problem.blocks.len(), ViewBlocks::default());
        self.w.resize(problem.blocks.len() * self.fours, Six::default());
        self.corners = problem.blocks.iter().map(Block::len).sum();
    }

    /// Fills all blocks at a point (poses centred).
    pub(super) fn build(&mut self, problem: &Problem<'_>, at: &State) {
        wide::run(Build { system: self, problem, at });
    }

    /// Columns of the matrix `w` of view `i`.
    #[inline(always)]
    pub(super) fn w(&self, i: usize) -> &[Six] {
        &self.w[i * self.fours..(i + 1) * self.fours]
    }
}

/// [`Normal::build`].
struct Build<'a, 'p> {
    system: &'a mut Normal,
    problem: &'a Problem<'p>,
    at: &'a State,
}

impl wide::Kernel for Build<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Normal { free, u, gu, views, w, fours, batch, sides, .. } = self.system;
        let (problem, at) = (self.problem, self.at);
        for side in sides.iter_mut() {
            side.products.fill([0.0; HALF]);
        }
        for (i, (block, pose)) in problem.blocks.iter().zip(&at.poses).enumerate() {
            let chunks = block.points.len();
            for chunk in 0..chunks {
                linearise(problem, &at.params, block, pose, chunk, batch, sides);
            }
            views[i] = ViewBlocks { corners: block.len(), ..ViewBlocks::default() };
            let w = &mut w[i * *fours..(i + 1) * *fours];
            w.fill(Six::default());
            for side in sides.iter_mut() {
                side.multiply(chunks);
                side.add_pose(&mut views[i], w, *free);
            }
        }
        *u = Reduced::default();
        *gu = [0.0; MAX_PARAMS];
        for side in sides.iter() {
            side.add_intrinsics(u, gu);
        }
    }
}

impl Side {
    /// Products of all columns of one view, in tiles of 2 × 2.
    #[inline(always)]
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

    #[inline(always)]
    fn product(&self, a: usize, b: usize) -> f64 {
        let lanes = &self.products[a * self.width + b];
        (lanes[0] + lanes[2]) + (lanes[1] + lanes[3])
    }

    /// Adds what concerns the pose of the view multiplied last.
    #[inline(always)]
    fn add_pose(&self, view: &mut ViewBlocks, w: &mut [Six], free: usize) {
        for a in 0..6 {
            for b in 0..=a {
                view.v[a][b] += self.product(a, b);
            }
            w[free / 4][a][free % 4] += self.product(RESIDUAL, a);
        }
        for (a, column) in self.columns.iter().enumerate() {
            for b in 0..6 {
                w[column.slot / 4][b][column.slot % 4] += self.product(INTRINSICS + a, b);
            }
        }
    }

    /// Adds what concerns the intrinsics alone, of all views.
    fn add_intrinsics(&self, u: &mut Reduced, gu: &mut [f64; MAX_PARAMS]) {
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

/// Weighted residuals and columns of one chunk.
#[inline(always)]
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
        let mut longest = 0.0f64;
        let mut e = [0.0; LANES];
        for l in 0..LANES {
            e[l] = root[l] * root[l] * (r[0][l] * r[0][l] + r[1][l] * r[1][l]);
            longest = if e[l] > longest { e[l] } else { longest };
        }
        for l in 0..if longest > k * k { LANES } else { 0 } {
            let e = e[l].sqrt();
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
