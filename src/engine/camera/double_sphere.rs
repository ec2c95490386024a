//! Double sphere, `xi alpha`: two unit spheres and a pinhole, fisheye lenses with a closed-form inverse.
//!
//! ```text
//! d1 = √(X² + Y² + Z²), Z1 = ξ d1 + Z, d2 = √(X² + Y² + Z1²), n = α d2 + (1 − α) Z1
//! u = fx X/n + cx, v = fy Y/n + cy
//! ```
//!
//! V. Usenko, N. Demmel, D. Cremers, "The double sphere camera model", 3DV 2018, eq. 40 to 52. It sees `Z > −w2 d1`.

use nalgebra::{Vector2, Vector3};

use super::{
    Spec,
    at::{At, all, all_px, one, one_px},
    pinhole::params,
};

/// The model's table.
pub static SPEC: Spec = Spec {
    name: "ds",
    title: "Fisheye, double sphere",
    explained: "Fisheye lenses with two numbers and an exact inverse: visual odometry",
    perspective: false,
    neutral: &[0.0, 0.5],
    params: params!("xi" "alpha"),
    project: |p, x| one(at, p, x),
    project_px: |p, x| one_px(px, p, x),
    project_batch: |p, x, out| all(at, p, x, out),
    project_px_batch: |p, x, out| all_px(px, p, x, out),
    guess_ray,
    examples: &[&[160.0, 160.5, 319.5, 239.5, -0.2, 0.58], &[400.0, 401.0, 310.0, 250.0, 0.3, 0.6]],
    invalid: &[&[160.0, 160.0, 319.5, 239.5, 0.0, f64::NAN]],
};

struct Spheres {
    d1: f64,
    z1: f64,
    d2: f64,
    /// `1/n`, NaN where nothing is seen.
    inverse: f64,
}

#[inline(always)]
fn spheres(p: &[f64], [x, y, z]: [f64; 3]) -> Spheres {
    let [xi, alpha] = [p[4], p[5]];
    let r2 = x * x + y * y;
    let d1 = (r2 + z * z).sqrt();
    let z1 = xi * d1 + z;
    let d2 = (r2 + z1 * z1).sqrt();
    let w1 = if alpha <= 0.5 { alpha / (1.0 - alpha) } else { (1.0 - alpha) / alpha };
    let w2 = (w1 + xi) / (2.0 * w1 * xi + xi * xi + 1.0).sqrt();
    let n = alpha * d2 + (1.0 - alpha) * z1;
    let inverse = if z > -w2 * d1 && n > 0.0 { 1.0 / n } else { f64::NAN };
    Spheres { d1, z1, d2, inverse }
}

#[inline(always)]
fn px(p: &[f64], point: [f64; 3]) -> [f64; 2] {
    let s = spheres(p, point);
    [p[0] * point[0] * s.inverse + p[2], p[1] * point[1] * s.inverse + p[3]]
}

#[inline(always)]
fn at(p: &[f64], point: [f64; 3]) -> At<6> {
    let [xi, alpha] = [p[4], p[5]];
    let Spheres { d1, z1, d2, inverse } = spheres(p, point);
    let [x, y, z] = point;
    let beta = 1.0 - alpha;
    // n by a coordinate: α ∂d2 + (1 − α) ∂z1.
    let n_by = |own: f64, z1_by: f64| alpha * (own + z1 * z1_by) / d2 + beta * z1_by;
    let (nx, ny) = (n_by(x, xi * x / d1), n_by(y, xi * y / d1));
    let nz = n_by(0.0, xi * z / d1 + 1.0);
    let (a, b) = (x * inverse, y * inverse);
    let by = |own: [f64; 3], a: f64| [0, 1, 2].map(|k| (own[k] - a * [nx, ny, nz][k]) * inverse);
    let n_by_xi = alpha * z1 * d1 / d2 + beta * d1;
    let n_by_alpha = d2 - z1;
    At::scaled(p, [a, b], [by([1.0, 0.0, 0.0], a), by([0.0, 1.0, 0.0], b)], |k| {
        let dn = [n_by_xi, n_by_alpha][k] * inverse;
        [-a * dn, -b * dn]
    })
}

/// The exact inverse, eq. 46 to 50.
fn guess_ray(p: &[f64], px: &Vector2<f64>) -> Vector3<f64> {
    let [xi, alpha] = [p[4], p[5]];
    let (a, b) = ((px.x - p[2]) / p[0], (px.y - p[3]) / p[1]);
    let r2 = a * a + b * b;
    let mz =
        (1.0 - alpha * alpha * r2) / (alpha * (1.0 - (2.0 * alpha - 1.0) * r2).max(0.0).sqrt() + 1.0 - alpha);
    let scale = (mz * xi + (mz * mz + (1.0 - xi * xi) * r2).max(0.0).sqrt()) / (mz * mz + r2);
    Vector3::new(scale * a, scale * b, scale * mz - xi)
}
