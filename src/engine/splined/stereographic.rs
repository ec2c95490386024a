//! The stereographic projection: the whole sphere but one point, angles kept.

use nalgebra::{Matrix2x3, RowVector3, Vector2, Vector3};

/// `u = 2 p_xy / (|p| + p_z)` with its derivatives by the point; `None` straight behind the camera and for no direction.
pub(super) fn project(point: &Vector3<f64>) -> Option<(Vector2<f64>, Matrix2x3<f64>)> {
    let length = point.norm();
    let down = length + point.z;
    if !(length.is_finite() && down > 1e-12 * length) {
        return None;
    }
    let u = point.xy() * (2.0 / down);
    let by_down = (point / length + Vector3::z()).transpose();
    let row = |k: usize| {
        let mut row: RowVector3<f64> = by_down * -u[k];
        row[k] += 2.0;
        row / down
    };
    Some((u, Matrix2x3::from_rows(&[row(0), row(1)])))
}

/// Unit ray of a stereographic place.
pub(super) fn ray(u: &Vector2<f64>) -> Vector3<f64> {
    let quarter = 0.25 * u.norm_squared();
    Vector3::new(u.x, u.y, 1.0 - quarter) / (1.0 + quarter)
}
