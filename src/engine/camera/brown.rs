//! Brown–Conrady with three radial and two tangential terms, in OpenCV's order `k1 k2 p1 p2 k3`.
//!
//! With `x = X/Z`, `y = Y/Z`, `r² = x² + y²`, `c = 1 + k1 r² + k2 r⁴ + k3 r⁶`:
//!
//! ```text
//! xd = x c + 2 p1 x y + p2 (r² + 2 x²)        u = fx xd + cx
//! yd = y c + p1 (r² + 2 y²) + 2 p2 x y        v = fy yd + cy
//! ```
//!
//! D. C. Brown, "Decentering distortion of lenses", Photogrammetric Engineering 32(3), 1966, pp. 444–462.
//! It sees nothing at or behind Z = 0, and folds where the image of growing radii turns back
//! ([`super::Camera::fold_rad`]).

use nalgebra::{Matrix2, Matrix2x3, Vector2, Vector3};

use super::{
    Batch, LANES, Lanes, MAX_PARAMS, Projection, Spec,
    at::batch,
    pinhole::{self, params},
};

const K1: usize = 4;
const K2: usize = 5;
const P1: usize = 6;
const P2: usize = 7;
const K3: usize = 8;

/// The model's table.
pub static SPEC: Spec = Spec {
    name: "brown5",
    title: "Brown, 5 terms",
    explained: "Ordinary and wide lenses up to about 100°: what OpenCV, ROS and MATLAB use",
    perspective: true,
    neutral: &[0.0; 5],
    params: params!("k1" "k2" "p1" "p2" "k3"),
    project,
    project_px,
    project_batch: |p, x, out| batch(project_batch, p, x, out),
    project_px_batch: |p, x, out| batch(project_px_batch, p, x, out),
    guess_ray: pinhole::guess_ray,
    examples: &[
        &[533.0, 533.2, 342.3, 234.0, -0.2854, 0.064, 1.1e-3, -1.3e-4, 0.0],
        &[1000.0, 1000.0, 319.5, 239.5, -0.28, 0.10, 0.001, 0.002, 0.0],
        &[600.0, 590.0, 320.0, 240.0, 0.12, -0.05, -2e-3, 1e-3, 0.01],
        &[400.0, 400.0, 320.0, 240.0, -0.3, 0.12, 0.0, 0.0, -0.02],
    ],
    invalid: &[
        &[-533.0, 533.2, 342.3, 234.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        &[533.0, 533.2, 342.3, f64::INFINITY, 0.0, 0.0, 0.0, 0.0, 0.0],
        &[533.0, 533.2, 342.3, 234.0, f64::NAN, 0.0, 0.0, 0.0, 0.0],
    ],
};

fn distort(p: &[f64], x: f64, y: f64) -> (f64, f64) {
    let r2 = x * x + y * y;
    let c = 1.0 + r2 * (p[K1] + r2 * (p[K2] + r2 * p[K3]));
    (
        x * c + 2.0 * p[P1] * x * y + p[P2] * (r2 + 2.0 * x * x),
        y * c + p[P1] * (r2 + 2.0 * y * y) + 2.0 * p[P2] * x * y,
    )
}

fn project_px(p: &[f64], point: &Vector3<f64>) -> Option<Vector2<f64>> {
    if point.z <= 0.0 {
        return None;
    }
    let (xd, yd) = distort(p, point.x / point.z, point.y / point.z);
    Some(Vector2::new(p[0] * xd + p[2], p[1] * yd + p[3]))
}

fn project(p: &[f64], point: &Vector3<f64>) -> Option<Projection> {
    if point.z <= 0.0 {
        return None;
    }
    let (fx, fy) = (p[0], p[1]);
    let iz = 1.0 / point.z;
    let (x, y) = (point.x / point.z, point.y / point.z);
    let (xd, yd) = distort(p, x, y);
    let r2 = x * x + y * y;
    let c = 1.0 + r2 * (p[K1] + r2 * (p[K2] + r2 * p[K3]));
    let dc = p[K1] + r2 * (2.0 * p[K2] + 3.0 * p[K3] * r2); // ∂c/∂(r²)
    let cross = 2.0 * (x * y * dc + p[P1] * x + p[P2] * y);
    let by_xy = Matrix2::new(
        fx * (c + 2.0 * x * x * dc + 2.0 * p[P1] * y + 6.0 * p[P2] * x),
        fx * cross,
        fy * cross,
        fy * (c + 2.0 * y * y * dc + 6.0 * p[P1] * y + 2.0 * p[P2] * x),
    );
    let by_point = by_xy * Matrix2x3::new(iz, 0.0, -x * iz, 0.0, iz, -y * iz);
    let mut by_params = [Vector2::zeros(); MAX_PARAMS];
    by_params[0].x = xd;
    by_params[1].y = yd;
    by_params[2].x = 1.0;
    by_params[3].y = 1.0;
    by_params[K1] = Vector2::new(fx * x, fy * y) * r2;
    by_params[K2] = by_params[K1] * r2;
    by_params[K3] = by_params[K2] * r2;
    by_params[P1] = Vector2::new(fx * 2.0 * x * y, fy * (r2 + 2.0 * y * y));
    by_params[P2] = Vector2::new(fx * (r2 + 2.0 * x * x), fy * 2.0 * x * y);
    Some(Projection { px: Vector2::new(fx * xd + p[2], fy * yd + p[3]), by_point, by_params })
}

#[inline(always)]
fn project_batch(p: &[f64], point: &[Lanes; 3], out: &mut Batch) {
    let [fx, fy, cx, cy] = [p[0], p[1], p[2], p[3]];
    let [k1, k2, p1, p2, k3] = [p[K1], p[K2], p[P1], p[P2], p[K3]];
    let ([by_u, by_v], [u, v], [du, dv]) = (&mut out.by_params, &mut out.px, &mut out.by_point);
    for l in 0..LANES {
        let z = point[2][l];
        let iz = if z > 0.0 { 1.0 / z } else { f64::NAN };
        let (x, y) = (point[0][l] * iz, point[1][l] * iz);
        let (xx, yy, xy2) = (x * x, y * y, 2.0 * x * y);
        let r2 = xx + yy;
        let c = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        let dc = k1 + r2 * (2.0 * k2 + 3.0 * k3 * r2);
        let (tx, ty) = (r2 + 2.0 * xx, r2 + 2.0 * yy);
        let (xd, yd) = (x * c + p1 * xy2 + p2 * tx, y * c + p1 * ty + p2 * xy2);
        u[l] = fx * xd + cx;
        v[l] = fy * yd + cy;
        let cross = xy2 * dc + 2.0 * (p1 * x + p2 * y);
        let ux = fx * (c + 2.0 * xx * dc + 2.0 * p1 * y + 6.0 * p2 * x);
        let vy = fy * (c + 2.0 * yy * dc + 6.0 * p1 * y + 2.0 * p2 * x);
        let (uy, vx) = (fx * cross, fy * cross);
        (du[0][l], du[1][l], du[2][l]) = (ux * iz, uy * iz, -(ux * x + uy * y) * iz);
        (dv[0][l], dv[1][l], dv[2][l]) = (vx * iz, vy * iz, -(vx * x + vy * y) * iz);
        (by_u[0][l], by_u[2][l]) = (xd, 1.0);
        (by_v[1][l], by_v[3][l]) = (yd, 1.0);
        let (fxr, fyr) = (fx * x * r2, fy * y * r2);
        (by_u[K1][l], by_v[K1][l]) = (fxr, fyr);
        (by_u[K2][l], by_v[K2][l]) = (fxr * r2, fyr * r2);
        (by_u[K3][l], by_v[K3][l]) = (fxr * (r2 * r2), fyr * (r2 * r2));
        (by_u[P1][l], by_v[P1][l]) = (fx * xy2, fy * ty);
        (by_u[P2][l], by_v[P2][l]) = (fx * tx, fy * xy2);
    }
}

#[inline(always)]
fn project_px_batch(p: &[f64], point: &[Lanes; 3], out: &mut [Lanes; 2]) {
    let [fx, fy, cx, cy] = [p[0], p[1], p[2], p[3]];
    let [k1, k2, p1, p2, k3] = [p[K1], p[K2], p[P1], p[P2], p[K3]];
    for l in 0..LANES {
        let z = point[2][l];
        let iz = if z > 0.0 { 1.0 / z } else { f64::NAN };
        let (x, y) = (point[0][l] * iz, point[1][l] * iz);
        let (xx, yy, xy2) = (x * x, y * y, 2.0 * x * y);
        let r2 = xx + yy;
        let c = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        out[0][l] = fx * (x * c + p1 * xy2 + p2 * (r2 + 2.0 * xx)) + cx;
        out[1][l] = fy * (y * c + p1 * (r2 + 2.0 * yy) + p2 * xy2) + cy;
    }
}
