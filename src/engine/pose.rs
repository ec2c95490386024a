//! Rigid transforms: `a_from_b` maps a point in frame b to frame a.

use nalgebra::{Matrix3, Point3, Rotation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

/// A rigid transform `x_in_a = R · x_in_b + t`. Serialised as OpenCV's rotation vector and translation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "Wire", into = "Wire")]
pub struct Pose {
    /// Rotation matrix.
    pub rotation: Rotation3<f64>,
    /// Translation, in the board's unit.
    pub translation: Vector3<f64>,
}

#[derive(Clone, Copy, Serialize, Deserialize)]
struct Wire {
    rvec_rad: [f64; 3],
    tvec: [f64; 3],
}

impl From<Wire> for Pose {
    fn from(w: Wire) -> Self {
        Self::from_rvec_tvec(w.rvec_rad.into(), w.tvec.into())
    }
}

impl From<Pose> for Wire {
    fn from(p: Pose) -> Self {
        Self { rvec_rad: p.rvec().into(), tvec: p.translation.into() }
    }
}

impl Pose {
    /// No motion.
    pub fn identity() -> Self {
        Self { rotation: Rotation3::identity(), translation: Vector3::zeros() }
    }

    /// From a rotation vector (axis · angle, rad; Rodrigues) and a translation: OpenCV's `rvec`, `tvec`.
    pub fn from_rvec_tvec(rvec: Vector3<f64>, tvec: Vector3<f64>) -> Self {
        Self { rotation: Rotation3::from_scaled_axis(rvec), translation: tvec }
    }

    /// Rotation vector (axis · angle, rad), |angle| ≤ π; accurate near 0 and near π.
    pub fn rvec(&self) -> Vector3<f64> {
        UnitQuaternion::from_rotation_matrix(&self.rotation).scaled_axis()
    }

    /// From Euler angles in degrees, `R = Rz(αz) · Ry(αy) · Rx(αx)` (Eq. 3 of the source document), and a translation.
    pub fn from_euler_deg(angles_deg: [f64; 3], translation: Vector3<f64>) -> Self {
        let [x, y, z] = angles_deg.map(f64::to_radians);
        Self { rotation: Rotation3::from_euler_angles(x, y, z), translation }
    }

    /// Euler angles `[αx, αy, αz]` in degrees with `R = Rz · Ry · Rx`; at αy = ±90° αx is 0.
    pub fn euler_deg(&self) -> [f64; 3] {
        let (x, y, z) = self.rotation.euler_angles();
        [x, y, z].map(f64::to_degrees)
    }

    /// The transformed point.
    pub fn apply(&self, point: &Point3<f64>) -> Point3<f64> {
        self.rotation * point + self.translation
    }

    /// `b_from_a`.
    pub fn inverse(&self) -> Self {
        let rotation = self.rotation.inverse();
        Self { rotation, translation: -(rotation * self.translation) }
    }

    /// Rotation as a matrix.
    pub fn matrix(&self) -> &Matrix3<f64> {
        self.rotation.matrix()
    }

    /// Angle between the board's normal and the optical axis, rad, in 0..=π/2 for a board that is seen from its front.
    pub fn tilt_rad(&self) -> f64 {
        let m = self.matrix();
        m[(0, 2)].hypot(m[(1, 2)]).atan2(m[(2, 2)])
    }

    /// Rotation of the board about the optical axis, `atan2(R21, R11)`, rad.
    pub fn roll_rad(&self) -> f64 {
        let m = self.matrix();
        m[(1, 0)].atan2(m[(0, 0)])
    }
}

impl std::ops::Mul for Pose {
    type Output = Self;

    /// `a_from_b * b_from_c = a_from_c`.
    fn mul(self, other: Self) -> Self {
        Self {
            rotation: self.rotation * other.rotation,
            translation: self.rotation * other.translation + self.translation,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn euler_angles_are_rz_ry_rx() {
        let p = Pose::from_euler_deg([20.0, -15.0, 5.0], Vector3::zeros());
        let axis = |a: Vector3<f64>, deg: f64| Rotation3::from_scaled_axis(a * deg.to_radians());
        let r = axis(Vector3::z(), 5.0) * axis(Vector3::y(), -15.0) * axis(Vector3::x(), 20.0);
        assert!((p.matrix() - r.matrix()).norm() < 1e-15);
        for (a, b) in p.euler_deg().iter().zip([20.0, -15.0, 5.0]) {
            assert!((a - b).abs() < 1e-12);
        }
    }

    #[test]
    fn rotation_vectors_survive_near_zero_and_near_pi() {
        for angle in [0.0, 1e-12, 1e-6, 0.5, 3.0, PI - 1e-7] {
            let rvec = Vector3::new(0.6, -0.48, 0.64) * angle;
            let back = Pose::from_rvec_tvec(rvec, Vector3::zeros()).rvec();
            assert!(
                (back - rvec).norm() < 1e-14 * (1.0 + 1e7 * angle / PI).min(1e3),
                "{angle}: {:e}",
                (back - rvec).norm()
            );
        }
    }

    #[test]
    fn composition_and_inverse() {
        let a = Pose::from_euler_deg([10.0, 20.0, 30.0], Vector3::new(1.0, 2.0, 3.0));
        let b = Pose::from_euler_deg([-5.0, 40.0, 7.0], Vector3::new(-4.0, 0.5, 9.0));
        let x = Point3::new(0.3, -0.7, 2.0);
        assert!(((a * b).apply(&x) - a.apply(&b.apply(&x))).norm() < 1e-14);
        assert!((a.inverse().apply(&a.apply(&x)) - x).norm() < 1e-14);
    }

    #[test]
    fn tilt_and_roll_of_known_poses() {
        let tilt = |a| Pose::from_euler_deg(a, Vector3::z()).tilt_rad().to_degrees();
        assert!(
            (tilt([25.0, 0.0, 40.0]) - 25.0).abs() < 1e-12 && (tilt([0.0, -30.0, 0.0]) - 30.0).abs() < 1e-12
        );
        assert!(
            (Pose::from_euler_deg([25.0, 0.0, 40.0], Vector3::z()).roll_rad().to_degrees() - 40.0).abs()
                < 1e-12
        );
    }
}
