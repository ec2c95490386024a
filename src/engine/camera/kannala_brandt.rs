//! Kannala–Brandt with four terms `k1 k2 k3 k4`: fisheye lenses, beyond 180° too.
//!
//! With `ρ = √(X² + Y²)`, `θ = atan2(ρ, Z)`:
//!
//! ```text
//! θd = θ (1 + k1 θ² + k2 θ⁴ + k3 θ⁶ + k4 θ⁸)      u = fx θd X/ρ + cx, v = fy θd Y/ρ + cy
//! ```
//!
//! J. Kannala, S. S. Brandt, "A generic camera model and calibration method for conventional, wide-angle, and fish-eye
//! lenses", IEEE TPAMI 28(8), 2006; OpenCV's `fisheye`, the "equidistant" of ROS and Kalibr. Only the ray straight backwards is
//! not seen.

use nalgebra::{Vector2, Vector3};

use super::{
    Spec,
    at::{At, all, all_px, one, one_px},
    pinhole::params,
};

/// The model's table.
pub static SPEC: Spec = Spec {
    name: "kb4",
    title: "Fisheye, Kannala–Brandt",
    explained: "Fisheye and action cameras, also beyond 180°",
    perspective: false,
    neutral: &[0.0; 4],
    params: params!("k1" "k2" "k3" "k4"),
    project: |p, x| one(at, p, x),
    project_px: |p, x| one_px(px, p, x),
    project_batch: |p, x, out| all(at, p, x, out),
    project_px_batch: |p, x, out| all_px(px, p, x, out),
    guess_ray,
    examples: &[
        &[300.0, 301.0, 319.5, 239.5, -0.02, 0.01, -0.003, 0.0004],
        &[190.0, 190.5, 322.0, 241.0, 0.03, -0.02, 0.006, -0.001],
        &[600.0, 598.0, 310.0, 250.0, 0.33, 0.1, 0.0, 0.0],
    ],
    invalid: &[&[-300.0, 301.0, 319.5, 239.5, 0.0, 0.0, 0.0, 0.0]],
};

/// `ρ` below which the limit on the axis serves, as a share of the distance: there the quotients lose their digits.
const NEAR_AXIS: f64 = 1e-7;

/// `θd / ρ` and `θ`.
#[inline(always)]
fn bent(p: &[f64], [x, y, z]: [f64; 3]) -> [f64; 3] {
    let rho2 = x * x + y * y;
    let rho = rho2.sqrt();
    let theta = rho.atan2(z);
    let t2 = theta * theta;
    let grows = 1.0 + t2 * (p[4] + t2 * (p[5] + t2 * (p[6] + t2 * p[7])));
    let near = rho <= NEAR_AXIS * z.abs();
    let scale = match (near, z > 0.0) {
        (true, true) => 1.0 / z,
        (true, false) => f64::NAN,
        (false, _) => theta * grows / rho,
    };
    [scale, theta, rho]
}

#[inline(always)]
fn px(p: &[f64], point: [f64; 3]) -> [f64; 2] {
    let [scale, ..] = bent(p, point);
    [p[0] * scale * point[0] + p[2], p[1] * scale * point[1] + p[3]]
}

#[inline(always)]
fn at(p: &[f64], point: [f64; 3]) -> At<8> {
    let [scale, theta, rho] = bent(p, point);
    let [x, y, z] = point;
    let t2 = theta * theta;
    let slope = 1.0 + t2 * (3.0 * p[4] + t2 * (5.0 * p[5] + t2 * (7.0 * p[6] + t2 * 9.0 * p[7])));
    let d2 = rho * rho + z * z;
    // θ changes by z/d² along ρ and by −ρ/d² along z.
    let (along, by_z) = if rho <= NEAR_AXIS * z.abs() {
        (0.0, -1.0 / (z * z))
    } else {
        // (∂(θd/ρ)/∂ρ)/ρ
        ((slope * z / d2 - scale) / (rho * rho), -slope / d2)
    };
    let a = [scale + x * x * along, x * y * along, x * by_z];
    let b = [x * y * along, scale + y * y * along, y * by_z];
    let unit = if rho > 0.0 { theta / rho } else { 0.0 };
    At::scaled(p, [scale * x, scale * y], [a, b], |k| {
        let term = unit * t2.powi(k as i32 + 1);
        [term * x, term * y]
    })
}

/// As without terms, up to the backward ray.
fn guess_ray(p: &[f64], px: &Vector2<f64>) -> Vector3<f64> {
    let (a, b) = ((px.x - p[2]) / p[0], (px.y - p[3]) / p[1]);
    let wanted = a.hypot(b);
    if wanted == 0.0 {
        return Vector3::z();
    }
    // θd = wanted by bisection on the branch that starts on the axis: Newton from elsewhere may cross a fold.
    let bent = |t: f64| {
        let t2 = t * t;
        t * (1.0 + t2 * (p[4] + t2 * (p[5] + t2 * (p[6] + t2 * p[7]))))
    };
    let grows = |t: f64| {
        let t2 = t * t;
        1.0 + t2 * (3.0 * p[4] + t2 * (5.0 * p[5] + t2 * (7.0 * p[6] + t2 * 9.0 * p[7]))) > 0.0
    };
    // The branch ends at the first fold.
    const END: f64 = 3.1;
    let mut high = END;
    if !grows(END) {
        let first = (1..31).map(|i| 0.1 * f64::from(i)).find(|t| !grows(*t)).unwrap_or(END);
        let mut good = first - 0.1;
        high = first;
        for _ in 0..12 {
            let middle = 0.5 * (good + high);
            if grows(middle) { good = middle } else { high = middle }
        }
    }
    let mut low = 0.0;
    for _ in 0..30 {
        let middle = 0.5 * (low + high);
        if bent(middle) < wanted { low = middle } else { high = middle }
    }
    let theta = 0.5 * (low + high);
    let side = theta.sin() / wanted;
    Vector3::new(side * a, side * b, theta.cos())
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use crate::camera::{Camera, Model};

    #[test]
    fn every_ray_before_the_fold_is_found_from_its_pixel() {
        // It turns back at 120.0°, and beyond it passes the same radii again.
        let params = vec![150.0, 150.0, 399.5, 299.5, 0.0, 0.0, 0.0, -0.0003];
        let camera = Camera::new(Model::Kb4, [800, 600], params).unwrap();
        let fold = camera.fold_rad();
        assert!((fold.to_degrees() - 120.0).abs() < 0.1, "{}", fold.to_degrees());
        for i in 1..200 {
            let t = fold * f64::from(i) / 200.0;
            let ray = Vector3::new(0.6 * t.sin(), -0.8 * t.sin(), t.cos());
            let px = camera.project(&ray.into()).unwrap();
            let back = camera.unproject(&px);
            assert!(back.is_some_and(|b| (b - ray).norm() < 1e-9), "{}°: {back:?}", t.to_degrees());
        }
    }
}
