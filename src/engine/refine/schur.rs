//! Solves the damped normal equations by eliminating the poses.

use super::{Problem, cholesky, normal::Normal};
use crate::camera::MAX_PARAMS;

/// What a step promises.
pub(super) struct Step {
    /// Decrease of the cost that the quadratic model predicts.
    pub predicted: f64,
    /// Largest movement that one unknown's change alone causes, RMS over the corners it moves, px.
    pub largest_px: f64,
    /// Largest `g²/diag`: decrease that moving one unknown alone would bring.
    pub gradient_rms: f64,
}

/// The factors of the eliminated poses and the step; allocated once.
pub(super) struct Eliminated {
    factors: Vec<[[f64; 6]; 6]>,
    /// `L⁻¹ Wᵀ`, one row of six for each view and free parameter.
    w: Vec<[f64; 6]>,
    /// `L⁻¹ g`, then the step of each pose `[ω, τ]`.
    pub poses: Vec<[f64; 6]>,
    /// Step of the free intrinsics.
    pub intrinsics: [f64; MAX_PARAMS],
}

type Reduced = [[f64; MAX_PARAMS]; MAX_PARAMS];

impl Eliminated {
    pub(super) fn new(problem: &Problem<'_>) -> Self {
        let n = problem.blocks.len();
        Self {
            factors: vec![[[0.0; 6]; 6]; n],
            w: vec![[0.0; 6]; n * problem.free.len()],
            poses: vec![[0.0; 6]; n],
            intrinsics: [0.0; MAX_PARAMS],
        }
    }

    /// Eliminates the poses; the reduced matrix, its lower triangle, with the reduced gradient in `self.intrinsics`.
    pub(super) fn eliminate(&mut self, system: &Normal, damping: f64) -> Option<Reduced> {
        let p = system.free;
        let mut s = system.u;
        let mut g = system.gu;
        for c in 0..p {
            s[c][c] += damping * system.u[c][c];
        }
        for (i, view) in system.views.iter().enumerate() {
            let l = &mut self.factors[i];
            *l = view.v;
            for k in 0..6 {
                l[k][k] += damping * view.v[k][k];
            }
            if !cholesky::factor(l, 6) {
                return None;
            }
            let y = &mut self.poses[i];
            *y = view.g;
            cholesky::forward(l, y, 6);
            let w = &mut self.w[i * p..(i + 1) * p];
            w.copy_from_slice(&system.w[i * p..(i + 1) * p]);
            for c in 0..p {
                cholesky::forward(l, &mut w[c], 6);
                g[c] -= (0..6).map(|k| w[c][k] * y[k]).sum::<f64>();
                for d in 0..=c {
                    s[c][d] -= (0..6).map(|k| w[c][k] * w[d][k]).sum::<f64>();
                }
            }
        }
        self.intrinsics = g;
        Some(s)
    }

    /// The step for a damping; `None` where the damped matrix is not positive definite.
    pub(super) fn solve(&mut self, system: &Normal, damping: f64) -> Option<Step> {
        let p = system.free;
        let mut s = self.eliminate(system, damping)?;
        if !cholesky::factor(&mut s, p) {
            return None;
        }
        cholesky::forward(&s, &mut self.intrinsics, p);
        cholesky::backward(&s, &mut self.intrinsics, p);
        let mut step = Step { predicted: 0.0, largest_px: 0.0, gradient_rms: 0.0 };
        let corners = system.corners as f64;
        for c in 0..p {
            step.count(self.intrinsics[c], system.gu[c], system.u[c][c], damping, corners);
        }
        for (i, view) in system.views.iter().enumerate() {
            let d = &mut self.poses[i];
            for c in 0..p {
                for k in 0..6 {
                    d[k] -= self.w[i * p + c][k] * self.intrinsics[c];
                }
            }
            cholesky::backward(&self.factors[i], d, 6);
            for k in 0..6 {
                step.count(d[k], view.g[k], view.v[k][k], damping, view.corners as f64);
            }
        }
        Some(step)
    }
}

impl Step {
    fn count(&mut self, delta: f64, gradient: f64, diagonal: f64, damping: f64, corners: f64) {
        // With (H + λD) δ = g: cost(0) − model(δ) = 2 δᵀg − δᵀHδ = δᵀg + λ δᵀDδ.
        self.predicted += delta * gradient + damping * diagonal * delta * delta;
        self.largest_px = self.largest_px.max(delta.abs() * (diagonal / corners).sqrt());
        self.gradient_rms = self.gradient_rms.max(gradient * gradient / diagonal);
    }
}
