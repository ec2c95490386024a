//! Solves the damped normal equations by eliminating the poses.

use nalgebra::DMatrix;

use super::{
    cholesky,
    normal::{Normal, Six},
};
use crate::{camera::MAX_PARAMS, wide};

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
    /// Step of each pose `[ω, τ]`.
    pub poses: Vec<[f64; 6]>,
    /// Step of the free intrinsics.
    pub intrinsics: [f64; SIZE],
}

/// Free intrinsics and one more, in fours.
const SIZE: usize = (MAX_PARAMS + 1).next_multiple_of(4);

/// A matrix of the size of the intrinsics.
pub(super) type Reduced = [[f64; SIZE]; SIZE];

impl Eliminated {
    pub(super) fn new(system: &Normal) -> Self {
        let mut new = Self { factors: Vec::new(), poses: Vec::new(), intrinsics: [0.0; SIZE] };
        new.resize(system);
        new
    }

    /// Makes room for another system.
    pub(super) fn resize(&mut self, system: &Normal) {
        let n = system.views.len();
        self.factors.resize(n, [[0.0; 6]; 6]);
        self.poses.resize(n, [0.0; 6]);
    }

    /// `U − Σ W V⁻¹ Wᵀ`; `None` where a pose is not determined.
    pub(super) fn information(&mut self, system: &Normal) -> Option<DMatrix<f64>> {
        let reduced = self.eliminate(system, 0.0)?;
        let p = system.free;
        Some(DMatrix::from_fn(p, p, |i, j| reduced[i.max(j)][i.min(j)]))
    }

    /// Eliminates the poses; the reduced matrix, its lower triangle, with the reduced gradient in `self.intrinsics`.
    fn eliminate(&mut self, system: &Normal, damping: f64) -> Option<Reduced> {
        wide::run(Eliminate { to: self, system, damping })
    }

    /// The step for a damping, and for a free intrinsic that moves by a given amount, if any; `None` where the damped matrix is not
    /// positive definite.
    pub(super) fn solve(
        &mut self,
        system: &Normal,
        damping: f64,
        given: Option<(usize, f64)>,
    ) -> Option<Step> {
        let p = system.free;
        let mut s = self.eliminate(system, damping)?;
        if let Some((slot, by)) = given {
            // An observation of it that outweighs all others.
            let weight = 1e12 * system.u[slot][slot];
            s[slot][slot] += weight;
            self.intrinsics[slot] += weight * by;
        }
        if !cholesky::factor(&mut s, p) {
            return None;
        }
        cholesky::forward(&s, &mut self.intrinsics, p);
        cholesky::backward(&s, &mut self.intrinsics, p);
        self.intrinsics[p..].fill(0.0);
        let mut step = Step { predicted: 0.0, largest_px: 0.0, gradient_rms: 0.0 };
        let corners = system.corners as f64;
        for c in 0..p {
            step.count(self.intrinsics[c], system.gu[c], system.u[c][c], damping, corners);
        }
        wide::run(Poses { of: self, system, damping, step: &mut step });
        Some(step)
    }
}

/// [`Eliminated::eliminate`].
struct Eliminate<'a> {
    to: &'a mut Eliminated,
    system: &'a Normal,
    damping: f64,
}

impl wide::Kernel for Eliminate<'_> {
    type Output = Option<Reduced>;

    #[inline(always)]
    fn run(self) -> Option<Reduced> {
        let Self { to, system, damping } = self;
        let (p, fours) = (system.free, system.fours);
        let mut s = system.u;
        // The gradient is one more row.
        s[p][..p].copy_from_slice(&system.gu[..p]);
        for c in 0..p {
            s[c][c] += damping * system.u[c][c];
        }
        let mut room = [Six::default(); SIZE / 4];
        let w = &mut room[..fours]; // L⁻¹ [Wᵀ g]
        for (i, (view, l)) in system.views.iter().zip(to.factors.iter_mut()).enumerate() {
            *l = view.v;
            for k in 0..6 {
                l[k][k] += damping * view.v[k][k];
            }
            if !cholesky::factor(l, 6) {
                return None;
            }
            for (to, from) in w.iter_mut().zip(system.w(i)) {
                let mut rows = *from;
                for i in 0..6 {
                    for k in 0..i {
                        for c in 0..4 {
                            rows[i][c] -= l[i][k] * rows[k][c];
                        }
                    }
                    for c in 0..4 {
                        rows[i][c] *= l[i][i];
                    }
                }
                *to = rows;
            }
            for (a, left) in w.iter().enumerate() {
                for (b, right) in w[..=a].iter().enumerate() {
                    for (i, row) in s[4 * a..4 * a + 4].iter_mut().enumerate() {
                        for c in 0..4 {
                            let mut sum = 0.0;
                            for k in 0..6 {
                                sum += left[k][i] * right[k][c];
                            }
                            row[4 * b + c] -= sum;
                        }
                    }
                }
            }
        }
        to.intrinsics = s[p];
        Some(s)
    }
}

/// The steps of the poses that follow from that of the intrinsics.
struct Poses<'a> {
    of: &'a mut Eliminated,
    system: &'a Normal,
    damping: f64,
    step: &'a mut Step,
}

impl wide::Kernel for Poses<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { of: Eliminated { factors, poses, intrinsics }, system, damping, step } = self;
        let p = system.free;
        // The gradient's own column counts once, the other way round.
        let mut by = *intrinsics;
        by[p] = -1.0;
        for (i, ((view, l), d)) in system.views.iter().zip(factors).zip(poses).enumerate() {
            for k in 0..6 {
                let mut sum = [0.0; 4];
                for (w, by) in system.w(i).iter().zip(by.as_chunks::<4>().0) {
                    for c in 0..4 {
                        sum[c] -= w[k][c] * by[c];
                    }
                }
                d[k] = (sum[0] + sum[2]) + (sum[1] + sum[3]);
            }
            cholesky::forward(l, d, 6);
            cholesky::backward(l, d, 6);
            let g = &system.w(i)[p / 4];
            for k in 0..6 {
                step.count(d[k], g[k][p % 4], view.v[k][k], damping, view.corners as f64);
            }
        }
    }
}

impl Step {
    #[inline(always)]
    fn count(&mut self, delta: f64, gradient: f64, diagonal: f64, damping: f64, corners: f64) {
        // With (H + λD) δ = g: cost(0) − model(δ) = 2 δᵀg − δᵀHδ = δᵀg + λ δᵀDδ.
        self.predicted += delta * gradient + damping * diagonal * delta * delta;
        self.largest_px = self.largest_px.max(delta.abs() * (diagonal / corners).sqrt());
        self.gradient_rms = self.gradient_rms.max(gradient * gradient / diagonal);
    }
}
