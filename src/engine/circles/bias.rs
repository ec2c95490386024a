//! The picture of a circle's centre is not the centre of the circle's picture.
//!
//! Perspective shifts the centre of the ellipse away from the projected centre (J. Heikkilä, "Geometric camera calibration
//! using circular control points", PAMI 22(10), 2000), distortion bends the outline besides. The shift grows with the square
//! of the radius; it is the same in every picture from a place, so it moves the camera, not the residuals. [`offset`] computes
//! it for what [`super::detect`] measures: the ellipse nearest to the outline, in the mean of squared distances along it.
//! Fitting, correcting and fitting again converges at once, since the shift hardly depends on what the correction changes.

use nalgebra::{Matrix5, Point2, Point3, Vector2, Vector5};

use super::{CircleBoard, Grid, basis::median};
use crate::{camera::Camera, observation::Observation, pose::Pose};

/// Points of the outline.
const POINTS: usize = 48;
/// Most steps to the nearest ellipse.
const STEPS: usize = 12;

/// Where the centre of a circle is measured minus where it is, px: `center_in_board` and `radius` in the board's plane, in the
/// unit of the pose. `None` where the camera does not see the whole circle.
pub fn offset(
    camera: &Camera,
    camera_from_board: &Pose,
    center_in_board: &Point2<f64>,
    radius: f64,
) -> Option<Vector2<f64>> {
    let project = |x: f64, y: f64| camera.project(&camera_from_board.apply(&Point3::new(x, y, 0.0)));
    let center = project(center_in_board.x, center_in_board.y)?;
    let mut outline = Vec::with_capacity(POINTS);
    for k in 0..POINTS {
        let (s, c) = (std::f64::consts::TAU * k as f64 / POINTS as f64).sin_cos();
        // Relative to the centre, so that small shifts keep their digits.
        outline.push(project(center_in_board.x + radius * c, center_in_board.y + radius * s)? - center);
    }
    nearest_ellipse(&outline)
}

/// Centre of the ellipse with the smallest mean of squared distances from an outline, by first order in the distance.
fn nearest_ellipse(outline: &[Vector2<f64>]) -> Option<Vector2<f64>> {
    let n = outline.len();
    let mean: Vector2<f64> = outline.iter().sum::<Vector2<f64>>() / n.max(1) as f64;
    let mut q = [0.0; 3];
    for p in outline {
        let d = p - mean;
        for (q, v) in q.iter_mut().zip([d.x * d.x, d.x * d.y, d.y * d.y]) {
            *q += 2.0 * v / n as f64;
        }
    }
    let mut w = super::ellipse::root(q)?;
    let mut c = mean;
    for _ in 0..STEPS {
        let (mut normal, mut right) = (Matrix5::zeros(), Vector5::zeros());
        for (k, p) in outline.iter().enumerate() {
            let along = (outline[(k + 1) % n] - outline[(k + n - 1) % n]).norm();
            let u = p - c;
            let v = Vector2::new(w[0] * u.x + w[1] * u.y, w[2] * u.y);
            let rho = v.norm();
            let v = v / rho;
            let g = Vector2::new(w[0] * v.x, w[1] * v.x + w[2] * v.y);
            let steep = g.norm();
            let by = Vector5::new(-g.x, -g.y, v.x * u.x, v.x * u.y, v.y * u.y) / steep;
            normal += by * by.transpose() * along;
            right -= by * (along * (rho - 1.0) / steep);
        }
        // W is of the order of one over the radius: scaled to a diagonal of ones.
        let scale = normal.diagonal().map(|v: f64| 1.0 / v.sqrt());
        let scaled = Matrix5::from_fn(|r, k| normal[(r, k)] * scale[r] * scale[k]);
        let d = scaled.cholesky()?.solve(&right.component_mul(&scale)).component_mul(&scale);
        c += Vector2::new(d[0], d[1]);
        for k in 0..3 {
            w[k] += d[2 + k];
        }
        if !(w[0] > 0.0 && w[2] > 0.0 && c.iter().all(|v| v.is_finite())) {
            return None;
        }
        if d[0].hypot(d[1]) < 1e-12 / w[0].max(w[2]) {
            break;
        }
    }
    Some(c)
}

/// Observations with their places moved to the projected centres of the circles, for the cameras and poses that are known.
///
/// `camera_from_board` holds the pose of each observation, `points_in_board` the circles' centres by index ([`CircleBoard::points`]),
/// `radius` is in their unit. What has no pose or no point, and circles that the camera does not see, stay as they are.
pub fn corrected(
    observations: &[Observation],
    cameras: &[Camera],
    camera_from_board: &[Pose],
    points_in_board: &[Point3<f64>],
    radius: f64,
) -> Vec<Observation> {
    let mut all = observations.to_vec();
    for (observation, pose) in all.iter_mut().zip(camera_from_board) {
        let Some(camera) = cameras.get(observation.camera) else { continue };
        for corner in &mut observation.corners {
            let Some(point) = points_in_board.get(corner.index as usize) else { continue };
            if let Some(shift) = offset(camera, pose, &point.xy(), radius) {
                corner.px -= shift;
            }
        }
    }
    all
}

/// Radius of the circles of a board, in spacings ([`CircleBoard::points`] with spacing 1): the median over the pictures of what
/// the ellipses say. `None` of no picture.
pub fn radius_of(grids: &[&Grid], board: CircleBoard) -> Option<f64> {
    median(grids.iter().map(|g| g.radius).collect()).map(|r| r * board.pitch())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Model;
    use nalgebra::{Matrix3, Vector3};

    fn pose() -> Pose {
        Pose::from_euler_deg([35.0, -30.0, 20.0], Vector3::new(-40.0, 20.0, 300.0))
    }

    #[test]
    fn without_distortion_it_is_the_centre_of_the_conic() {
        let camera = Camera::new(Model::Pinhole, [640, 480], vec![500.0, 510.0, 320.0, 240.0]).unwrap();
        let (m, t) = (pose().rotation, pose().translation);
        let k = Matrix3::new(500.0, 0.0, 320.0, 0.0, 510.0, 240.0, 0.0, 0.0, 1.0);
        for (x, y, r) in [(0.0, 0.0, 8.0), (90.0, 60.0, 20.0), (50.0, -30.0, 1.0)] {
            let at = m.matrix() * Vector3::new(x, y, 0.0) + t;
            let h = k * Matrix3::from_columns(&[m.matrix().column(0) * r, m.matrix().column(1) * r, at]);
            // The dual conic of the unit circle: H diag(1, 1, −1) Hᵀ; its last column is the centre.
            let dual = h * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, -1.0)) * h.transpose();
            let center = Vector2::new(dual[(0, 2)], dual[(1, 2)]) / dual[(2, 2)];
            let want = center - camera.project(&at.into()).unwrap();
            let got = offset(&camera, &pose(), &Point2::new(x, y), r).unwrap();
            assert!((got - want).norm() < 1e-9, "{r}: {got} {want}");
        }
    }

    #[test]
    fn it_grows_with_the_square_of_the_radius_and_vanishes_where_nothing_is_seen() {
        let camera = Camera::new(
            Model::Brown5,
            [640, 480],
            vec![400.0, 400.0, 320.0, 240.0, -0.3, 0.12, 0.0, 0.0, -0.02],
        )
        .unwrap();
        let at = |r| offset(&camera, &pose(), &Point2::new(120.0, 80.0), r).unwrap().norm();
        assert!((at(4.0) / at(2.0) - 4.0).abs() < 0.02, "{} {}", at(4.0), at(2.0));
        let behind = Pose::from_euler_deg([0.0; 3], Vector3::new(0.0, 0.0, -5.0));
        assert_eq!(offset(&camera, &behind, &Point2::origin(), 1.0), None);
    }
}
