//! One point at a time: a model that is written once for a single point serves the tables of [`super::Spec`] from here.

use nalgebra::{Matrix2x3, Vector2, Vector3};

use super::{Batch, LANES, Lanes, MAX_PARAMS, Projection};
use crate::wide;

/// What a model with `N` parameters computes for a point; `px` is NaN where it cannot see it.
pub(super) struct At<const N: usize> {
    /// Where the point appears, px.
    pub(super) px: [f64; 2],
    /// ∂px / ∂point in the camera frame.
    pub(super) by_point: [[f64; 3]; 2],
    /// ∂px / ∂parameter.
    pub(super) by_params: [[f64; N]; 2],
}

impl<const N: usize> At<N> {
    /// From normalised, distorted coordinates `(a, b)`: `u = fx a + cx`, `v = fy b + cy`. `by_rest` are their derivatives by what
    /// follows `fx fy cx cy`.
    #[inline(always)]
    pub(super) fn scaled(
        p: &[f64],
        [a, b]: [f64; 2],
        [a_by, b_by]: [[f64; 3]; 2],
        by_rest: impl Fn(usize) -> [f64; 2],
    ) -> Self {
        let [fx, fy, cx, cy] = [p[0], p[1], p[2], p[3]];
        let mut by_params = [[0.0; N]; 2];
        by_params[0][0] = a;
        by_params[0][2] = 1.0;
        by_params[1][1] = b;
        by_params[1][3] = 1.0;
        for k in 4..N {
            let [da, db] = by_rest(k - 4);
            by_params[0][k] = fx * da;
            by_params[1][k] = fy * db;
        }
        Self {
            px: [fx * a + cx, fy * b + cy],
            by_point: [a_by.map(|d| fx * d), b_by.map(|d| fy * d)],
            by_params,
        }
    }
}

/// [`super::Spec::project`].
#[cfg_attr(target_arch = "wasm32", inline(never))]
#[cfg_attr(not(target_arch = "wasm32"), inline(always))]
pub(super) fn one<const N: usize>(
    at: impl Fn(&[f64], [f64; 3]) -> At<N>,
    p: &[f64],
    point: &Vector3<f64>,
) -> Option<Projection> {
    let at = at(p, (*point).into());
    let [u, v] = at.px;
    if !(u.is_finite() && v.is_finite()) {
        return None;
    }
    let [a, b] = at.by_point;
    let mut by_params = [Vector2::zeros(); MAX_PARAMS];
    for (k, to) in by_params.iter_mut().enumerate().take(N) {
        *to = Vector2::new(at.by_params[0][k], at.by_params[1][k]);
    }
    Some(Projection {
        px: Vector2::new(u, v),
        by_point: Matrix2x3::new(a[0], a[1], a[2], b[0], b[1], b[2]),
        by_params,
    })
}

/// [`super::Spec::project_px`].
#[cfg_attr(target_arch = "wasm32", inline(never))]
#[cfg_attr(not(target_arch = "wasm32"), inline(always))]
pub(super) fn one_px(
    px: impl Fn(&[f64], [f64; 3]) -> [f64; 2],
    p: &[f64],
    point: &Vector3<f64>,
) -> Option<Vector2<f64>> {
    let [u, v] = px(p, (*point).into());
    (u.is_finite() && v.is_finite()).then(|| Vector2::new(u, v))
}

/// A function over a batch, for [`wide::run`].
struct Batched<'a, F, T> {
    f: F,
    p: &'a [f64],
    points: &'a [Lanes; 3],
    out: &'a mut T,
}

impl<F: Fn(&[f64], &[Lanes; 3], &mut T), T> wide::Kernel for Batched<'_, F, T> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        (self.f)(self.p, self.points, self.out);
    }
}

/// Runs a function over a batch in wide registers; `f` is `#[inline(always)]`.
#[inline(always)]
pub(super) fn batch<T>(f: impl Fn(&[f64], &[Lanes; 3], &mut T), p: &[f64], points: &[Lanes; 3], out: &mut T) {
    wide::run(Batched { f, p, points, out });
}

/// A function of one point over a batch, for [`wide::run`].
struct Each<'a, F, T> {
    f: F,
    p: &'a [f64],
    points: &'a [Lanes; 3],
    out: &'a mut T,
}

impl<const N: usize, F: Fn(&[f64], [f64; 3]) -> At<N>> wide::Kernel for Each<'_, F, Batch> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { f, p, points, out } = self;
        for l in 0..LANES {
            let at = f(p, [points[0][l], points[1][l], points[2][l]]);
            for side in 0..2 {
                out.px[side][l] = at.px[side];
                for k in 0..3 {
                    out.by_point[side][k][l] = at.by_point[side][k];
                }
                for k in 0..N {
                    // What is zero in every model is never written.
                    if k != 1 - side && k != 3 - side {
                        out.by_params[side][k][l] = at.by_params[side][k];
                    }
                }
            }
        }
    }
}

impl<F: Fn(&[f64], [f64; 3]) -> [f64; 2]> wide::Kernel for Each<'_, F, [Lanes; 2]> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { f, p, points, out } = self;
        for l in 0..LANES {
            let [u, v] = f(p, [points[0][l], points[1][l], points[2][l]]);
            (out[0][l], out[1][l]) = (u, v);
        }
    }
}

/// [`super::Spec::project_batch`].
#[inline(always)]
pub(super) fn all<const N: usize>(
    at: impl Fn(&[f64], [f64; 3]) -> At<N> + Copy,
    p: &[f64],
    points: &[Lanes; 3],
    out: &mut Batch,
) {
    if cfg!(target_arch = "wasm32") {
        return one_by_one(|point| one(at, p, point), N, points, out);
    }
    wide::run(Each { f: at, p, points, out });
}

/// [`super::Spec::project_px_batch`].
#[inline(always)]
pub(super) fn all_px(
    px: impl Fn(&[f64], [f64; 3]) -> [f64; 2] + Copy,
    p: &[f64],
    points: &[Lanes; 3],
    out: &mut [Lanes; 2],
) {
    if !cfg!(target_arch = "wasm32") {
        return wide::run(Each { f: px, p, points, out });
    }
    for l in 0..LANES {
        let point = Vector3::new(points[0][l], points[1][l], points[2][l]);
        let [u, v] = one_px(px, p, &point).map_or([f64::NAN; 2], Into::into);
        (out[0][l], out[1][l]) = (u, v);
    }
}

/// [`all`] in little code: eight copies of every model's body would be a twentieth of the page's program.
fn one_by_one(
    project: impl Fn(&Vector3<f64>) -> Option<Projection>,
    params: usize,
    points: &[Lanes; 3],
    out: &mut Batch,
) {
    for l in 0..LANES {
        let Some(at) = project(&Vector3::new(points[0][l], points[1][l], points[2][l])) else {
            (out.px[0][l], out.px[1][l]) = (f64::NAN, f64::NAN);
            continue;
        };
        for side in 0..2 {
            out.px[side][l] = at.px[side];
            for k in 0..3 {
                out.by_point[side][k][l] = at.by_point[(side, k)];
            }
            for k in (0..params).filter(|&k| k != 1 - side && k != 3 - side) {
                out.by_params[side][k][l] = at.by_params[k][side];
            }
        }
    }
}
