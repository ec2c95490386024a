//! The steps of the refinement.

use nalgebra::{DMatrix, Rotation3, Vector3};
use std::ops::ControlFlow;

use super::{
    Limits, Problem, Refined, State,
    measure::{self, Sum, measure},
    normal::Normal,
    schur::Eliminated,
};
use crate::{
    Error, Result,
    camera::{LANES, Lanes},
    pose::Pose,
    solution::{Iteration, Termination},
};

const LARGEST_DAMPING: f64 = 1e12;
/// A way that does not end: so many accepted steps together lower the cost by less than this share of the variance of a coordinate. One
/// variance is a distance of one σ, so what lies further on differs by less than σ of what the corners do not determine.
const VALLEY: (usize, f64) = (5, 0.25);
/// Steps for which damping is not lowered after it was too low.
const PATIENCE: u32 = 3;

/// A refinement under way, with all the memory that it needs. Between two runs weights and loss may change ([`Descent::reweigh`]);
/// the number of views and of their corners, and what is free, stay.
pub(crate) struct Descent {
    /// Poses centred.
    at: State,
    /// |r|² there.
    squares: Vec<Lanes>,
    sum: Sum,
    /// The same one step on.
    next: State,
    next_squares: Vec<Lanes>,
    system: Normal,
    work: Eliminated,
    /// Whether `system` is that of `at`.
    fresh: bool,
    /// Largest coordinate observed, px: the scale of rounding.
    largest_px: f64,
    damping: Option<f64>,
    /// Relative decrease of the cost that the last accepted step promised.
    promise: Option<f64>,
    iterations: Vec<Iteration>,
}

impl Descent {
    /// # Errors
    /// [`Error::Degenerate`] where the start does not see its corners.
    pub(crate) fn new(problem: &Problem<'_>, start: &State) -> Result<Self> {
        let system = Normal::new(problem);
        let mut descent = Self {
            at: State { params: Vec::new(), poses: Vec::new() },
            squares: Vec::new(),
            sum: Sum::default(),
            next: State { params: Vec::new(), poses: Vec::new() },
            next_squares: Vec::new(),
            work: Eliminated::new(&system),
            system,
            fresh: false,
            largest_px: 0.0,
            damping: None,
            promise: None,
            iterations: Vec::new(),
        };
        descent.restart(problem, start)?;
        Ok(descent)
    }

    /// As [`Descent::new`] in the memory of an older one with the same model and the same parameters free.
    ///
    /// # Errors
    /// [`Error::Degenerate`] where the start does not see its corners.
    pub(crate) fn restart(&mut self, problem: &Problem<'_>, start: &State) -> Result<()> {
        self.system.resize(problem);
        self.work.resize(&self.system);
        for state in [&mut self.at, &mut self.next] {
            state.params.clone_from(&start.params);
            state.poses.clear();
            state.poses.extend(start.poses.iter().zip(problem.blocks).map(|(p, b)| b.centred(p)));
        }
        let mut largest = [0.0; LANES];
        for lanes in problem.blocks.iter().flat_map(|b| &b.observed).flatten() {
            for l in 0..LANES {
                largest[l] = if lanes[l].abs() > largest[l] { lanes[l].abs() } else { largest[l] };
            }
        }
        self.largest_px = largest.into_iter().fold(0.0, f64::max);
        self.fresh = false;
        (self.damping, self.promise) = (None, None);
        self.iterations.clear();
        self.sum = measure(problem, &self.at, &mut self.squares);
        if self.sum.cost.is_finite() {
            Ok(())
        } else {
            Err(Error::Degenerate("the start of the refinement does not see all corners".into()))
        }
    }

    /// Squared residuals of all corners at the best point met, block by block, each padded to whole chunks, px².
    pub(crate) fn squares(&self) -> &[Lanes] {
        &self.squares
    }

    /// Squares of the weighted residuals of all corners, px².
    pub(crate) fn weighted_squares(&self, problem: &Problem<'_>, to: &mut Vec<f64>) {
        to.clear();
        let mut rest = &self.squares[..];
        for block in problem.blocks {
            let (own, others) = rest.split_at(block.roots.len());
            let pairs = own.as_flattened().iter().zip(block.roots.as_flattened());
            to.extend(pairs.take(block.len()).map(|(square, root)| root * root * square));
            rest = others;
        }
    }

    /// To be called when weights or loss have changed.
    pub(crate) fn reweigh(&mut self, problem: &Problem<'_>) {
        self.sum = measure::weigh(problem, &self.squares);
        self.fresh = false;
    }

    /// Steps until convergence or a limit. Damping goes on where the last run left it.
    ///
    /// # Errors
    /// [`Error::Stopped`] where `report` breaks.
    pub(crate) fn run(
        &mut self,
        problem: &Problem<'_>,
        limits: Limits,
        report: &mut dyn FnMut() -> ControlFlow<()>,
    ) -> Result<Termination> {
        let mut damping = self.damping.unwrap_or(limits.damping);
        let mut termination = Termination::IterationLimit;
        let mut patience = 0u32;
        let mut before = Vec::new(); // costs before each accepted step
        let mut nearly = false; // the first step from the current point promised next to nothing
        for i in 0..limits.iterations {
            if report().is_break() {
                return Err(Error::Stopped);
            }
            let first = !self.fresh;
            if first {
                self.system.build(problem, &self.at);
                self.fresh = true;
            }
            let Some(step) = self.work.solve(&self.system, damping, None) else {
                if damping > LARGEST_DAMPING {
                    termination = Termination::Stuck;
                    break;
                }
                self.record(damping, false);
                damping *= 10.0;
                continue;
            };
            if first {
                if step.gradient_rms <= f64::EPSILON * f64::EPSILON * self.sum.cost {
                    termination = Termination::GradientConverged;
                    break;
                }
                // Steps that are left together, should each gain what this one promises, do not get there.
                let left = (limits.iterations - i) as f64 * step.predicted;
                if limits.enough.is_some_and(|enough| self.sum.cost - left > enough) {
                    break;
                }
                nearly = step.predicted <= limits.tolerance.max(1e-11) * self.sum.cost;
            }
            self.move_by_step(problem);
            let trial = measure(problem, &self.next, &mut self.next_squares);
            let accepted = trial.cost <= self.sum.cost;
            let gain = (self.sum.cost - trial.cost) / step.predicted;
            if accepted {
                let promise = step.predicted / self.sum.cost;
                std::mem::swap(&mut self.at, &mut self.next);
                std::mem::swap(&mut self.squares, &mut self.next_squares);
                before.push(self.sum.cost);
                (self.sum, self.fresh) = (trial, false);
                self.record(damping, true);
                // What the next step would promise, if steps go on to shrink as they did. Huber's loss hardly lets them shrink by
                // more than ten, which is a hundred in what they promise.
                let rate = self.promise.replace(promise).map_or(1.0, |before| promise / before);
                let next = promise * rate.clamp(1e-2, 1.0);
                if promise.min(next) <= limits.tolerance && damping <= 1e-2 {
                    termination = Termination::CostConverged;
                    break;
                }
                if step.largest_px <= f64::EPSILON * self.largest_px {
                    termination = Termination::StepConverged;
                    break;
                }
                if before.len() >= VALLEY.0 {
                    let gained = before[before.len() - VALLEY.0] - self.sum.cost;
                    // Steps that shrink by a quarter or more each arrive by themselves: then the last has a tenth of the five at most.
                    let last = before[before.len() - 1] - self.sum.cost;
                    if last > 0.1 * gained
                        && gained < VALLEY.1 * self.sum.cost / (2 * self.sum.corners) as f64
                    {
                        termination = Termination::CostConverged;
                        break;
                    }
                    if limits.enough.is_some_and(|enough| self.sum.cost < enough) {
                        break;
                    }
                }
                damping = match gain > 0.5 {
                    true if patience > 0 => damping,
                    true => (damping * 0.1).max(1e-14),
                    false => damping * 2.0,
                };
                patience = patience.saturating_sub(1);
            } else {
                self.record(damping, false);
                if nearly || step.largest_px <= f64::EPSILON * self.largest_px {
                    // What an undamped step promised is below what rounding lets the sum resolve: this is the optimum, by its
                    // gradient. The rejected step is not taken.
                    termination = Termination::GradientConverged;
                    break;
                }
                patience = if before.len() < VALLEY.0 { 0 } else { PATIENCE };
                damping *= 10.0;
                if damping > LARGEST_DAMPING {
                    termination = Termination::Stuck;
                    break;
                }
            }
        }
        self.damping = Some(damping);
        Ok(termination)
    }

    /// [`super::along`] from there.
    pub(super) fn along(mut self, problem: &Problem<'_>, slot: usize, by: f64) -> Option<State> {
        self.system.build(problem, &self.at);
        self.work.solve(&self.system, 0.0, Some((slot, by)))?;
        self.move_by_step(problem);
        std::mem::swap(&mut self.at, &mut self.next);
        Some(State { poses: self.poses(problem).collect(), params: self.at.params })
    }

    /// The best point met.
    pub(crate) fn refined(self, problem: &Problem<'_>, termination: Termination) -> Refined {
        Refined {
            state: State { poses: self.poses(problem).collect(), params: self.at.params },
            cost: self.sum.cost,
            termination,
            iterations: self.iterations,
        }
    }

    /// The parameters of the model there.
    pub(crate) fn params(&self) -> &[f64] {
        &self.at.params
    }

    /// Relative decrease of the cost that the last accepted step promised.
    pub(crate) const fn promise(&self) -> Option<f64> {
        self.promise
    }

    /// [`super::information`] there.
    pub(crate) fn information(&mut self, problem: &Problem<'_>) -> Option<DMatrix<f64>> {
        let plain = Problem { huber_px: None, single_precision: false, ..*problem };
        self.fresh = false;
        self.system.build(&plain, &self.at);
        self.work.information(&self.system)
    }

    /// The poses of the best point met.
    pub(crate) fn poses(&self, problem: &Problem<'_>) -> impl Iterator<Item = Pose> {
        self.at.poses.iter().zip(problem.blocks).map(|(p, b)| {
            let mut pose = *p;
            pose.rotation.renormalize();
            b.uncentred(&pose)
        })
    }

    fn record(&mut self, damping: f64, accepted: bool) {
        self.iterations.push(Iteration { cost: self.sum.cost, rms_px: self.sum.rms_px(), damping, accepted });
    }

    fn move_by_step(&mut self, problem: &Problem<'_>) {
        for (i, (to, from)) in self.next.params.iter_mut().zip(&self.at.params).enumerate() {
            *to = *from + problem.free.slot(i).map_or(0.0, |slot| self.work.intrinsics[slot]);
        }
        for ((to, from), d) in self.next.poses.iter_mut().zip(&self.at.poses).zip(&self.work.poses) {
            *to = Pose {
                rotation: Rotation3::from_scaled_axis(Vector3::new(d[0], d[1], d[2])) * from.rotation,
                translation: from.translation + Vector3::new(d[3], d[4], d[5]),
            };
        }
    }
}
