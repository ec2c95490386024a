//! Extended unified camera model, `alpha beta`: an ellipsoid and a pinhole.
//!
//! ```text
//! d = √(β (X² + Y²) + Z²), n = α d + (1 − α) Z,  u = fx X/n + cx, v = fy Y/n + cy
//! ```
//!
//! B. Khomutenko, G. Garcia, P. Martinet, "An enhanced unified camera model", IEEE RA-L 1(1), 2016. It sees `Z > −w d` with
//! `w = α/(1 − α)` for α ≤ ½, else `(1 − α)/α`.

use nalgebra::{Vector2, Vector3};

use super::{
    Spec,
    at::{At, all, all_px, one, one_px},
    pinhole::params,
};

/// The model's table.
pub static SPEC: Spec = Spec {
    name: "eucm",
    title: "Fisheye, EUCM",
    explained: "Wide and fisheye lenses with two numbers and an exact inverse",
    perspective: false,
    neutral: &[0.5, 1.0],
    params: params!("alpha" "beta"),
    project: |p, x| one(at, p, x),
    project_px: |p, x| one_px(px, p, x),
    project_batch: |p, x, out| all(at, p, x, out),
    project_px_batch: |p, x, out| all_px(px, p, x, out),
    guess_ray,
    examples: &[&[230.0, 231.0, 319.5, 239.5, 0.6, 1.1], &[500.0, 500.0, 310.0, 250.0, 0.3, 0.9]],
    invalid: &[&[230.0, 231.0, f64::INFINITY, 239.5, 0.6, 1.1]],
};

/// `d` and `1/n`, NaN where nothing is seen.
#[inline(always)]
fn ellipsoid(p: &[f64], [x, y, z]: [f64; 3]) -> [f64; 2] {
    let [alpha, beta] = [p[4], p[5]];
    let d = (beta * (x * x + y * y) + z * z).sqrt();
    let w = if alpha <= 0.5 { alpha / (1.0 - alpha) } else { (1.0 - alpha) / alpha };
    let n = alpha * d + (1.0 - alpha) * z;
    [d, if z > -w * d && n > 0.0 { 1.0 / n } else { f64::NAN }]
}

#[inline(always)]
fn px(p: &[f64], point: [f64; 3]) -> [f64; 2] {
    let [_, inverse] = ellipsoid(p, point);
    [p[0] * point[0] * inverse + p[2], p[1] * point[1] * inverse + p[3]]
}

#[inline(always)]
fn at(p: &[f64], point: [f64; 3]) -> At<6> {
    let [alpha, beta] = [p[4], p[5]];
    let [d, inverse] = ellipsoid(p, point);
    let [x, y, z] = point;
    let n_by = [alpha * beta * x / d, alpha * beta * y / d, alpha * z / d + 1.0 - alpha];
    let (a, b) = (x * inverse, y * inverse);
    let by = |own: [f64; 3], a: f64| [0, 1, 2].map(|k| (own[k] - a * n_by[k]) * inverse);
    let by_terms = [d - z, 0.5 * alpha * (x * x + y * y) / d];
    At::scaled(p, [a, b], [by([1.0, 0.0, 0.0], a), by([0.0, 1.0, 0.0], b)], |k| {
        let dn = by_terms[k] * inverse;
        [-a * dn, -b * dn]
    })
}

/// The exact inverse.
fn guess_ray(p: &[f64], px: &Vector2<f64>) -> Vector3<f64> {
    let [alpha, beta] = [p[4], p[5]];
    let (a, b) = ((px.x - p[2]) / p[0], (px.y - p[3]) / p[1]);
    let r2 = a * a + b * b;
    let root = (1.0 - (2.0 * alpha - 1.0) * beta * r2).max(0.0).sqrt();
    Vector3::new(a, b, (1.0 - beta * alpha * alpha * r2) / (alpha * root + 1.0 - alpha))
}
