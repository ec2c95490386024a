//! Kannala–Brandt with four terms ("equidistant", "fisheye", `kb4`): read and written, but no camera model here.
//!
//! J. Kannala, S. S. Brandt, "A generic camera model and calibration method for conventional, wide-angle, and fish-eye
//! lenses", IEEE TPAMI 28(8), 2006. Parameters `fx fy cx cy k1 k2 k3 k4`, as in OpenCV's `fisheye`, ROS, Kalibr, COLMAP and
//! Basalt.

use nalgebra::{Vector2, Vector3};

use super::refit;
use crate::calib::{
    Error, Result,
    camera::{Camera, Model},
};

/// Largest angle from the optical axis that is looked for, rad.
const WIDEST: f64 = std::f64::consts::PI;

/// `θd = θ (1 + k1 θ² + k2 θ⁴ + k3 θ⁶ + k4 θ⁸)`.
fn bent(p: &[f64], theta: f64) -> f64 {
    let t2 = theta * theta;
    theta * (1.0 + t2 * (p[4] + t2 * (p[5] + t2 * (p[6] + t2 * p[7]))))
}

/// Where a direction appears, px; `θ = atan2(√(x² + y²), z)`.
pub(super) fn project(p: &[f64], ray: &Vector3<f64>) -> Vector2<f64> {
    let rho = ray.x.hypot(ray.y);
    if rho == 0.0 {
        return Vector2::new(p[2], p[3]);
    }
    let scale = bent(p, rho.atan2(ray.z)) / rho;
    Vector2::new(p[0] * scale * ray.x + p[2], p[1] * scale * ray.y + p[3])
}

/// Unit ray of a pixel; `None` where the lens folds before it.
fn unproject(p: &[f64], px: &Vector2<f64>) -> Option<Vector3<f64>> {
    const STEPS: i32 = 256;
    let (x, y) = ((px.x - p[2]) / p[0], (px.y - p[3]) / p[1]);
    let radius = x.hypot(y);
    if radius == 0.0 {
        return Some(Vector3::z());
    }
    // The first crossing on the branch that starts at the axis and grows, then bisection.
    let (mut low, mut high) = (0.0, None);
    for i in 1..=STEPS {
        let theta = WIDEST * f64::from(i) / f64::from(STEPS);
        let at = bent(p, theta);
        if at >= radius {
            high = Some(theta);
            break;
        }
        if at.is_nan() || at <= bent(p, low) {
            break;
        }
        low = theta;
    }
    let mut high = high?;
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if bent(p, middle) < radius { low = middle } else { high = middle }
    }
    let theta = 0.5 * (low + high);
    let side = theta.sin() / radius;
    Some(Vector3::new(side * x, side * y, theta.cos()))
}

/// `kb4` that follows a camera best, with the error.
///
/// # Errors
/// As [`refit::fit`].
pub(super) fn from_camera(camera: &Camera) -> Result<(Vec<f64>, refit::FitError)> {
    let [fx, fy, cx, cy] = camera.intrinsics();
    // tan θ = θ + θ³/3 + …: where the fit starts.
    let start = [fx, fy, cx, cy, camera.get("k1").unwrap_or(0.0) + 1.0 / 3.0, 0.0, 0.0, 0.0];
    refit::fit(camera.size_px, &|px| camera.unproject(px), &start, &|p, ray| Some(project(p, ray)))
}

/// The Brown–Conrady camera that follows the lens best, and a note with the error.
///
/// # Errors
/// [`Error::Unsupported`] where the lens sees too wide for it, as [`refit::fit`].
pub(super) fn into_camera(size_px: [u32; 2], p: &[f64; 8]) -> Result<(Camera, String)> {
    let too_wide = |why: &str| {
        Error::Unsupported(format!(
            "the Kannala–Brandt (fisheye, equidistant) model is read by a refit to Brown's k1 k2 p1 p2 k3, but {why}: calibrate this lens with brown5, or crop the picture"
        ))
    };
    let ray_of = |px: &Vector2<f64>| unproject(p, px);
    let corners = super::grid(size_px, [2, 2]);
    if corners.map(|px| ray_of(&px)).any(|ray| ray.is_none_or(|r| r.z <= 0.0)) {
        return Err(too_wide("the picture reaches beyond 90° from the optical axis"));
    }
    let spec = Model::Brown5.spec();
    let start = [p[0], p[1], p[2], p[3], p[4] - 1.0 / 3.0, 0.0, 0.0, 0.0, 0.0];
    let (params, error) = refit::fit(size_px, &ray_of, &start, &|q, ray| (spec.project_px)(q, ray))
        .map_err(|e| too_wide(&e.to_string()))?;
    let camera = Camera::new(Model::Brown5, size_px, params)?;
    let folds = |px| ray_of(&px).and_then(|ray| camera.expansion(&ray)).is_none_or(|d| d <= 0.0);
    if super::grid(size_px, super::CHECK_GRID).any(folds) {
        return Err(too_wide("the best fit folds inside the picture"));
    }
    let note =
        format!("Kannala–Brandt (fisheye, equidistant) terms: brown5 was fitted over the picture, {error}");
    Ok((camera, note))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_and_pixels_are_inverse() {
        let p = [300.0, 301.0, 319.5, 239.5, -0.02, 0.01, -0.003, 0.0004];
        for px in super::super::grid([640, 480], [9, 7]) {
            let ray = unproject(&p, &px).unwrap();
            assert!((project(&p, &ray) - px).norm() < 1e-9 && (ray.norm() - 1.0).abs() < 1e-12, "{px}");
        }
    }

    #[test]
    fn moderate_lenses_are_refitted_and_wide_ones_refused() {
        let (camera, note) =
            into_camera([640, 480], &[500.0, 501.0, 319.5, 239.5, 0.1, -0.05, 0.01, 0.0]).unwrap();
        assert!((camera.params[0] - 500.0).abs() < 10.0 && note.contains("largest error"), "{note}");
        let wide = into_camera([640, 480], &[150.0, 150.0, 319.5, 239.5, 0.0, 0.0, 0.0, 0.0]).unwrap_err();
        assert!(wide.to_string().contains("beyond 90°"), "{wide}");
        // A lens whose terms fold before the corners of the picture.
        assert!(into_camera([640, 480], &[300.0, 300.0, 319.5, 239.5, -2.0, 0.0, 0.0, 0.0]).is_err());
    }
}
