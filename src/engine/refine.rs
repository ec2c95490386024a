//! Joint refinement of the intrinsics and all poses: Levenberg–Marquardt with analytic Jacobians and a Schur complement.
//!
//! The sum that is minimised is `Σ ρ(w |r|²)` over all corners, `r` = observed − projected, `w` the a-priori weight, ρ the
//! identity or Huber's function. With the intrinsics `b` (free parameters only) and six numbers a view the normal matrix is
//!
//! ```text
//! | U    W₁   W₂  … |   U = Σ JbᵀJb    intrinsics
//! | W₁ᵀ  V₁         |   V = JpᵀJp      one pose
//! | W₂ᵀ       V₂    |   W = JbᵀJp      between them
//! ```
//!
//! so each pose is eliminated by itself (6×6 Cholesky) and what remains, `U − Σ W V⁻¹ Wᵀ`, has the size of the intrinsics
//! whatever the number of views: time and memory grow linearly with them. The inverse of that matrix is the covariance of
//! the intrinsics with the poses taken into account.
//!
//! A pose moves by `R ← exp([ω]ₓ) R`, `t ← t + τ`, with `t` the place of the *middle of the view's corners*, where rotation
//! and translation are nearly uncorrelated. Damping is Marquardt's `λ · diag`; the undamped blocks are kept when only λ
//! changes. Sums run in a fixed order. No code here depends on the camera model: columns come from
//! [`Spec::project_batch`](crate::camera::Spec::project_batch).
//!
//! Huber's loss: a corner beyond the threshold k weighs `k/|r|` in the gradient and half of that in the normal matrix (its
//! true second derivative is `k/|r|` across the residual and 0 along it), which keeps convergence fast.
//!
//! B. Triggs et al., "Bundle Adjustment – A Modern Synthesis", 2000, §6.1; D. Marquardt, SIAM J. Appl. Math. 11, 1963.

pub mod block;
mod cholesky;
mod descent;
mod measure;
mod normal;
mod schur;

use nalgebra::DMatrix;
use std::ops::ControlFlow;

use super::{
    Result,
    camera::{Model, Spec},
    pose::Pose,
    solution::{Calibration, Iteration, Termination},
};
use block::Block;
pub(crate) use descent::Descent;
use normal::Normal;

/// Which intrinsics are free and which share one value.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Free {
    /// For each parameter of the model its position among the free ones; `None` where it is held.
    slots: Vec<Option<usize>>,
    count: usize,
}

impl Free {
    /// All parameters of a model are free.
    pub fn all(model: Model) -> Self {
        let count = model.spec().params.len();
        Self { slots: (0..count).map(Some).collect(), count }
    }

    /// No parameter is free: only poses move.
    pub fn none(model: Model) -> Self {
        Self { slots: vec![None; model.spec().params.len()], count: 0 }
    }

    /// Those of a calibration.
    pub fn of(calibration: &Calibration) -> Self {
        Self { slots: calibration.slots(), count: calibration.free.len() }
    }

    /// From the parameters that are held and pairs `[follower, leader]` that share one value.
    pub fn new(model: Model, held: &[usize], tied: &[[usize; 2]]) -> Self {
        let n = model.spec().params.len();
        // Each parameter's leader: the smallest index it is tied to, directly or through others.
        let mut leader: Vec<usize> = (0..n).collect();
        for &[a, b] in tied {
            let (la, lb) = (leader[a], leader[b]);
            for l in &mut leader {
                if *l == la || *l == lb {
                    *l = la.min(lb);
                }
            }
        }
        let mut slots = vec![None; n];
        let mut count = 0;
        for i in 0..n {
            let group_is_held = held.iter().any(|h| leader[*h] == leader[i]);
            if leader[i] == i && !group_is_held {
                slots[i] = Some(count);
                count += 1;
            } else if !group_is_held {
                slots[i] = slots[leader[i]];
            }
        }
        Self { slots, count }
    }

    /// The same with parameter `index` and whatever shares its value held.
    #[must_use]
    pub fn holding(&self, index: usize) -> Self {
        let gone = self.slot(index);
        let shift = |s: usize| match gone {
            Some(g) if s == g => None,
            Some(g) if s > g => Some(s - 1),
            _ => Some(s),
        };
        let slots = self.slots.iter().map(|s| s.and_then(shift)).collect();
        Self { slots, count: self.count - usize::from(gone.is_some()) }
    }

    /// Number of free values.
    pub const fn len(&self) -> usize {
        self.count
    }

    /// Whether nothing is free.
    pub const fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Position of parameter `index` among the free ones.
    pub fn slot(&self, index: usize) -> Option<usize> {
        self.slots.get(index).copied().flatten()
    }

    /// For each parameter the one whose value it shares, if that is another.
    pub fn tied_to(&self) -> Vec<Option<usize>> {
        let leaders = self.leaders();
        let leader = |i| self.slot(i).map(|s| leaders[s]).filter(|l| *l != i);
        (0..self.slots.len()).map(leader).collect()
    }

    /// For each free value the first parameter that takes it.
    pub fn leaders(&self) -> Vec<usize> {
        (0..self.count).filter_map(|s| self.slots.iter().position(|x| *x == Some(s))).collect()
    }
}

/// What is being refined.
pub struct Problem<'a> {
    /// The camera model.
    pub spec: &'static Spec,
    /// Which intrinsics move.
    pub free: &'a Free,
    /// The views.
    pub blocks: &'a [Block],
    /// Threshold of Huber's loss on the weighted residual, px; `None` for plain least squares.
    pub huber_px: Option<f64>,
    /// Round residuals and Jacobians to `f32` (an ablation).
    pub single_precision: bool,
}

/// A point in the space of unknowns.
#[derive(Clone, Debug)]
pub struct State {
    /// All parameters of the model.
    pub params: Vec<f64>,
    /// `camera_from_board` of each block.
    pub poses: Vec<Pose>,
}

/// When to stop.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Most steps, rejected ones included.
    pub iterations: usize,
    /// Converged when the predicted relative decrease of the cost is below this.
    pub tolerance: f64,
    /// Damping of the first step: small where the start is near the optimum.
    pub damping: f64,
    /// Ends as soon as it is sure whether the cost falls below this.
    pub enough: Option<f64>,
}

impl Limits {
    /// To the last digit that matters: a decrease of the cost by σ₀² is a distance of one σ, and the last step is shorter
    /// than 1e-4 σ of every parameter (rounding of the sum allows no less than 1e-14).
    pub fn full(corners: usize) -> Self {
        let tolerance = (1e-9 / (2 * corners.max(1)) as f64).max(1e-14);
        Self { iterations: 100, tolerance, damping: 1e-4, enough: None }
    }
}

/// Where the refinement arrived.
#[derive(Clone, Debug)]
pub struct Refined {
    /// The best point met.
    pub state: State,
    /// The sum that is minimised, there.
    pub cost: f64,
    /// Why it stopped.
    pub termination: Termination,
    /// Each step.
    pub iterations: Vec<Iteration>,
}

/// Refines from `start` until convergence or a limit. `report` is asked after each step whether to go on.
///
/// # Errors
/// [`Error::Degenerate`] where the start does not see its corners, [`Error::Stopped`] where `report` breaks.
///
/// [`Error::Degenerate`]: crate::Error::Degenerate
/// [`Error::Stopped`]: crate::Error::Stopped
pub fn refine(
    problem: &Problem<'_>,
    start: &State,
    limits: Limits,
    report: &mut dyn FnMut() -> ControlFlow<()>,
) -> Result<Refined> {
    let mut descent = Descent::new(problem, start)?;
    let termination = descent.run(problem, limits, report)?;
    Ok(descent.refined(problem, termination))
}

/// Where everything else fits best when the free intrinsic at `slot` moves by so much, as far as the linearised problem tells; `None`
/// where that is not determined.
pub(crate) fn along(problem: &Problem<'_>, from: &State, slot: usize, by: f64) -> Option<State> {
    Descent::new(problem, from).ok()?.along(problem, slot, by)
}

/// Information matrix `U − Σ W V⁻¹ Wᵀ` of the free intrinsics at `state`, with the a-priori weights only: its inverse
/// times σ₀² is their covariance. `None` where a pose is not determined.
pub fn information(problem: &Problem<'_>, state: &State) -> Option<DMatrix<f64>> {
    let plain = Problem { huber_px: None, ..*problem };
    let mut system = Normal::new(&plain);
    system.build(&plain, &centred(&plain, state));
    schur::Eliminated::new(&system).information(&system)
}

/// Residuals of every corner of block `index` at `state`, px.
pub fn residuals(problem: &Problem<'_>, state: &State, index: usize) -> Vec<nalgebra::Vector2<f64>> {
    let block = &problem.blocks[index];
    measure::residuals(problem, &state.params, &block.centred(&state.poses[index]), block)
}

fn centred(problem: &Problem<'_>, state: &State) -> State {
    let poses = state.poses.iter().zip(problem.blocks).map(|(p, b)| b.centred(p)).collect();
    State { params: state.params.clone(), poses }
}
