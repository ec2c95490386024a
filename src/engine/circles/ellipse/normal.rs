//! Normal equations of the fit: scaled to a diagonal of ones, parameters held or free.

use nalgebra::{SMatrix, SVector};

use super::{
    Start,
    model::{Model, pixels},
};
use crate::image::{Plane, Sample};

/// Parameters: centre, W₁₁ W₁₂ W₂₂, ln t, i, o, h.
pub(super) const N: usize = 10;
/// Blur of a picture that is not blurred: the pixel's own, px.
pub(super) const SHARPEST: f64 = 0.289;
pub(super) type Step = SVector<f64, N>;

/// The normal equations of a model.
pub(super) struct Sums {
    /// Lower triangle.
    normal: [[f64; N]; N],
    right: [f64; N],
    pub(super) rss: f64,
    pub(super) n: usize,
}

impl Sums {
    pub(super) fn of<T: Sample>(picture: &Plane<T>, m: &Model, start: &Start, stride: usize) -> Self {
        let (mut normal, mut right, mut rss, mut n) = ([[0.0; N]; N], [0.0; N], 0.0, 0);
        pixels(picture, m, start.px, start.reach, stride, |p| {
            for a in 0..N {
                for b in 0..=a {
                    normal[a][b] += p.by[a] * p.by[b];
                }
                right[a] += p.by[a] * p.residual;
            }
            rss += p.residual * p.residual;
            n += 1;
        });
        Self { normal, right, rss, n }
    }

    pub(super) fn mean(&self) -> f64 {
        self.rss / self.n.max(1) as f64
    }

    /// Gauss–Newton's step with the diagonal raised by `damping`; `free`: x, y, shape, blur, levels, light.
    pub(super) fn step(&self, m: &Model, free: [bool; 6], damping: f64) -> Option<Step> {
        if self.n < 2 * N {
            return None;
        }
        let mut held = [0, 1, 2, 2, 2, 3, 4, 4, 5, 5].map(|k: usize| !free[k]);
        let step = self.solve(&held, damping)?;
        // An active bound: the blur is taken out of the system, not cut afterwards.
        if m.t <= SHARPEST * 1.0001 && step[5] < 0.0 {
            held[5] = true;
            return self.solve(&held, damping);
        }
        Some(step)
    }

    /// Solves for the parameters that are not held; the others do not move.
    fn solve(&self, held: &[bool; N], damping: f64) -> Option<Step> {
        let (a, scale) = self.scaled(held, damping)?;
        let b = Step::from_fn(|k, _| if held[k] { 0.0 } else { self.right[k] * scale[k] });
        Some(a.cholesky()?.solve(&b).component_mul(&scale))
    }

    /// The normal matrix with a diagonal of ones, and the scale of each parameter.
    pub(super) fn scaled(&self, held: &[bool; N], damping: f64) -> Option<(SMatrix<f64, N, N>, Step)> {
        let scale = Step::from_fn(|k, _| if held[k] { 1.0 } else { 1.0 / self.normal[k][k].sqrt() });
        if !scale.iter().all(|s| s.is_finite()) {
            return None;
        }
        let a = SMatrix::from_fn(|r, c| match (r == c, held[r] || held[c]) {
            (true, true) => 1.0,
            (true, false) => 1.0 + 1e-10 + damping,
            (false, true) => 0.0,
            (false, false) => self.normal[r.max(c)][r.min(c)] * scale[r] * scale[c],
        });
        Some((a, scale))
    }
}
