//! Brown–Conrady with skew: [`super::brown`] on a sensor whose columns are not at right angles to its rows.
//!
//! ```text
//! u = fx xd + skew yd + cx        v = fy yd + cy
//! ```
//!
//! With fx ≠ fy this is every affine image of the distorted picture but a turn, which the pose takes: MATLAB's `cameraIntrinsics`
//! with `Skew`, Metashape's `b1 b2` (`b1 = fx − fy`, `b2 = skew`).

use nalgebra::{Vector2, Vector3};

use super::{
    Spec,
    at::{At, all, all_px, one, one_px},
    opencv,
    pinhole::params,
};

const SKEW: usize = 9;

/// The model's table.
pub static SPEC: Spec = Spec {
    name: "brown5skew",
    title: "Brown, 5 terms, skew",
    explained: "Sensors or scans whose rows and columns are not at right angles; other scales along them are fx and fy in every model",
    perspective: true,
    neutral: &[0.0; 6],
    params: params!("k1" "k2" "p1" "p2" "k3" "skew" in "px"),
    project: |p, x| one(at, p, x),
    project_px: |p, x| one_px(px, p, x),
    project_batch: |p, x, out| all(at, p, x, out),
    project_px_batch: |p, x, out| all_px(px, p, x, out),
    guess_ray,
    examples: &[
        &[533.0, 533.2, 342.3, 234.0, -0.2854, 0.064, 1.1e-3, -1.3e-4, 0.0, 0.0],
        &[1000.0, 980.0, 319.5, 239.5, -0.28, 0.10, 0.001, 0.002, 0.01, 6.5],
        &[400.0, 420.0, 320.0, 240.0, -0.3, 0.12, 0.0, 0.0, -0.02, -12.0],
    ],
    invalid: &[
        &[533.0, 533.2, 342.3, 234.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        &[533.0, 533.2, 342.3, 234.0, 0.0, 0.0, 0.0, 0.0, 0.0, f64::NAN],
    ],
};

/// Without skew first; then u moves by `skew yd`, and `yd` is v's derivative by fy.
#[inline(always)]
fn at(p: &[f64], point: [f64; 3]) -> At<10> {
    let plain: At<9> = opencv::at(p)(p, point);
    let share = p[SKEW] / p[1];
    let [mut by_u, mut by_v] = [[0.0; 10]; 2];
    by_u[..SKEW].copy_from_slice(&plain.by_params[0]);
    by_v[..SKEW].copy_from_slice(&plain.by_params[1]);
    let yd = by_v[1];
    for k in 4..SKEW {
        by_u[k] += share * by_v[k];
    }
    by_u[SKEW] = yd;
    let [du, dv] = plain.by_point;
    At {
        px: [plain.px[0] + p[SKEW] * yd, plain.px[1]],
        by_point: [[0, 1, 2].map(|k| du[k] + share * dv[k]), dv],
        by_params: [by_u, by_v],
    }
}

/// [`at`] without derivatives.
#[inline(always)]
fn px(p: &[f64], point: [f64; 3]) -> [f64; 2] {
    let [u, v] = opencv::px::<9>(p)(p, point);
    [u + p[SKEW] * ((v - p[3]) / p[1]), v]
}

/// The ray that the camera would have without its other terms.
fn guess_ray(p: &[f64], px: &Vector2<f64>) -> Vector3<f64> {
    let y = (px.y - p[3]) / p[1];
    Vector3::new((px.x - p[2] - p[SKEW] * y) / p[0], y, 1.0)
}
