//! The pinhole camera: `u = fx · X/Z + cx`, `v = fy · Y/Z + cy`.

use nalgebra::{Matrix2x3, Vector2, Vector3};

use super::{Batch, LANES, Lanes, MAX_PARAMS, Param, Projection, Spec, at::batch};

/// `fx fy cx cy`, the head of every model's list.
pub(super) const INTRINSICS: [Param; 4] = [
    Param { name: "fx", unit: "px" },
    Param { name: "fy", unit: "px" },
    Param { name: "cx", unit: "px" },
    Param { name: "cy", unit: "px" },
];

/// A model's parameters: [`INTRINSICS`], then coefficients by name.
macro_rules! params {
    ($($name:literal $(in $unit:literal)?)*) => {
        &[
            $crate::camera::pinhole::INTRINSICS[0],
            $crate::camera::pinhole::INTRINSICS[1],
            $crate::camera::pinhole::INTRINSICS[2],
            $crate::camera::pinhole::INTRINSICS[3],
            $($crate::camera::Param { name: $name, unit: concat!("" $(, $unit)?) }),*
        ]
    };
}
pub(super) use params;

/// The model's table.
pub static SPEC: Spec = Spec {
    name: "pinhole",
    title: "Pinhole, no distortion",
    explained: "Pictures without distortion: rendered, or straightened already",
    perspective: true,
    neutral: &[],
    params: &INTRINSICS,
    project,
    project_px,
    project_batch: |p, x, out| batch(project_batch, p, x, out),
    project_px_batch: |p, x, out| batch(project_px_batch, p, x, out),
    guess_ray,
    examples: &[&[500.0, 510.0, 319.5, 239.5], &[1200.0, 1190.0, 300.25, 260.75]],
    invalid: &[&[0.0, 500.0, 320.0, 240.0], &[500.0, f64::NAN, 320.0, 240.0], &[500.0, 500.0, 320.0]],
};

fn project_px(p: &[f64], point: &Vector3<f64>) -> Option<Vector2<f64>> {
    (point.z > 0.0)
        .then(|| Vector2::new(p[0] * (point.x / point.z) + p[2], p[1] * (point.y / point.z) + p[3]))
}

fn project(p: &[f64], point: &Vector3<f64>) -> Option<Projection> {
    let px = project_px(p, point)?;
    let iz = 1.0 / point.z;
    let (x, y) = (point.x * iz, point.y * iz);
    let by_point = Matrix2x3::new(p[0] * iz, 0.0, -p[0] * x * iz, 0.0, p[1] * iz, -p[1] * y * iz);
    let mut by_params = [Vector2::zeros(); MAX_PARAMS];
    by_params[0].x = x;
    by_params[1].y = y;
    by_params[2].x = 1.0;
    by_params[3].y = 1.0;
    Some(Projection { px, by_point, by_params })
}

#[inline(always)]
fn project_batch(p: &[f64], point: &[Lanes; 3], out: &mut Batch) {
    let (fx, fy, cx, cy) = (p[0], p[1], p[2], p[3]);
    for l in 0..LANES {
        let z = point[2][l];
        let iz = if z > 0.0 { 1.0 / z } else { f64::NAN };
        let (x, y) = (point[0][l] * iz, point[1][l] * iz);
        out.px[0][l] = fx * x + cx;
        out.px[1][l] = fy * y + cy;
        out.by_point[0][0][l] = fx * iz;
        out.by_point[0][2][l] = -fx * x * iz;
        out.by_point[1][1][l] = fy * iz;
        out.by_point[1][2][l] = -fy * y * iz;
        out.by_params[0][0][l] = x;
        out.by_params[0][2][l] = 1.0;
        out.by_params[1][1][l] = y;
        out.by_params[1][3][l] = 1.0;
    }
}

#[inline(always)]
fn project_px_batch(p: &[f64], point: &[Lanes; 3], out: &mut [Lanes; 2]) {
    let (fx, fy, cx, cy) = (p[0], p[1], p[2], p[3]);
    for l in 0..LANES {
        let z = point[2][l];
        let iz = if z > 0.0 { 1.0 / z } else { f64::NAN };
        out[0][l] = fx * (point[0][l] * iz) + cx;
        out[1][l] = fy * (point[1][l] * iz) + cy;
    }
}

/// The ray that a camera without distortion would have.
pub(super) fn guess_ray(p: &[f64], px: &Vector2<f64>) -> Vector3<f64> {
    Vector3::new((px.x - p[2]) / p[0], (px.y - p[3]) / p[1], 1.0)
}
