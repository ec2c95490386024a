//! Zhang's closed form: intrinsics from homographies, poses from homographies and intrinsics.
//!
//! With `B = K⁻ᵀ K⁻¹` (no skew: five numbers up to scale) the first two columns of each homography obey `h₁ᵀ B h₂ = 0` and
//! `h₁ᵀ B h₁ = h₂ᵀ B h₂`: two linear equations a view. The singular values of the stacked system tell whether the views
//! determine B: the second smallest vanishes where they do not (parallel boards, one view).
//!
//! Z. Zhang, "A flexible new technique for camera calibration", PAMI 22(11), 2000, §3.1, App. B.

use nalgebra::{Matrix3, Matrix3x2, Matrix5, Rotation3, SMatrix, SymmetricEigen, Vector3, Vector5};

use super::{order, pose::Pose};

/// What the homographies alone say about the camera.
#[derive(Clone, Debug)]
pub struct ClosedForm {
    /// `[fx, fy, cx, cy]`, px; `None` where B is not positive definite.
    pub intrinsics: Option<[f64; 4]>,
    /// The same with the principal point in the middle of the picture and fx = fy: survives poor sets.
    pub centred_focal_px: Option<f64>,
    /// Singular values of the stacked system, largest first, relative to the largest.
    pub singular_values: [f64; 5],
}

/// Solves Zhang's system for homographies `picture from board` of a picture of `size_px`. `normalise` shifts and scales
/// pixels so that the picture spans about ±1.
pub fn closed_form(homographies: &[Matrix3<f64>], size_px: [u32; 2], normalise: bool) -> ClosedForm {
    let [width, height] = size_px.map(f64::from);
    let middle = [(width - 1.0) / 2.0, (height - 1.0) / 2.0];
    let (shift, scale) = if normalise { (middle, 2.0 / (width + height)) } else { ([0.0; 2], 1.0) };
    let mut system = Matrix5::zeros();
    let (mut num, mut den) = (0.0, 0.0);
    for h in homographies {
        let unit = |shift: [f64; 2], scale: f64| {
            let [a, b] = [0, 1].map(|c| {
                let z = h[(2, c)];
                Vector3::new((h[(0, c)] - shift[0] * z) * scale, (h[(1, c)] - shift[1] * z) * scale, z)
            });
            let size = 0.5 * (a.norm() + b.norm());
            (a / size, b / size)
        };
        let (a, b) = unit(shift, scale);
        let v = |a: &Vector3<f64>, b: &Vector3<f64>| {
            Vector5::new(a.x * b.x, a.y * b.y, a.x * b.z + a.z * b.x, a.y * b.z + a.z * b.y, a.z * b.z)
        };
        for row in [v(&a, &b), v(&a, &a) - v(&b, &b)] {
            system += row * row.transpose();
        }
        // Principal point known, one focal length: (xy part) / f² + z part = 0 for both equations.
        let (a, b) = unit(middle, 2.0 / (width + height));
        for (p, q) in [
            (a.x * b.x + a.y * b.y, a.z * b.z),
            (a.xy().norm_squared() - b.xy().norm_squared(), a.z * a.z - b.z * b.z),
        ] {
            num += p * p;
            den -= p * q;
        }
    }
    let f = (num / den).sqrt() * (width + height) / 2.0;
    let eigen = SymmetricEigen::new(system);
    let mut order = [0, 1, 2, 3, 4];
    order::by(&mut order, |i| [-eigen.eigenvalues[*i]]);
    let largest = eigen.eigenvalues[order[0]].max(f64::MIN_POSITIVE);
    let b = eigen.eigenvectors.column(order[4]);
    ClosedForm {
        intrinsics: intrinsics(b.as_slice(), shift, scale),
        centred_focal_px: (f.is_finite() && f > 0.0).then_some(f),
        singular_values: order.map(|i| (eigen.eigenvalues[i].max(0.0) / largest).sqrt()),
    }
}

/// `[fx, fy, cx, cy]` from `[B11, B22, B13, B23, B33]`.
fn intrinsics(b: &[f64], shift: [f64; 2], scale: f64) -> Option<[f64; 4]> {
    let (cx, cy) = (-b[2] / b[0], -b[3] / b[1]);
    let lambda = b[4] - b[2] * b[2] / b[0] - b[3] * b[3] / b[1];
    let (fx, fy) = ((lambda / b[0]).sqrt(), (lambda / b[1]).sqrt());
    let k = [fx / scale, fy / scale, cx / scale + shift[0], cy / scale + shift[1]];
    (k.iter().all(|x| x.is_finite()) && fx > 0.0 && fy > 0.0).then_some(k)
}

/// `camera_from_board` from a homography and `[fx, fy, cx, cy]`; the board is in front of the camera where `h` is positive
/// at `middle` (a point of the board plane).
///
/// The first two columns of `K⁻¹ H` are turned by equal angles until they are at right angles. `None` where numbers vanish.
pub fn pose(h: &Matrix3<f64>, [fx, fy, cx, cy]: [f64; 4], middle: [f64; 2]) -> Option<Pose> {
    let column = |c: usize| {
        let z = h[(2, c)];
        Vector3::new((h[(0, c)] - cx * z) / fx, (h[(1, c)] - cy * z) / fy, z)
    };
    let (a, b, t) = (column(0), column(1), column(2));
    let depth = a.z * middle[0] + b.z * middle[1] + t.z;
    let scale = 2.0 / (a.norm() + b.norm()) * if depth < 0.0 { -1.0 } else { 1.0 };
    let (sum, difference) = (a.normalize() + b.normalize(), a.normalize() - b.normalize());
    let (sum, difference) = (sum.try_normalize(1e-9)?, difference.try_normalize(1e-9)?);
    let half = std::f64::consts::FRAC_1_SQRT_2 * scale.signum();
    let (r1, r2) = ((sum + difference) * half, (sum - difference) * half);
    let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[r1, r2, r1.cross(&r2)]));
    let pose = Pose { rotation, translation: t * scale };
    (pose.matrix().iter().chain(&pose.translation).all(|x| x.is_finite())).then_some(pose)
}

/// `camera_from_board` from the rays (any length, any direction) under which points `[x, y]` of the board plane are seen; for
/// lenses beyond 180° too, where there is no homography to a picture.
///
/// Linear in the matrix `[r1 r2 t]`, which takes each point onto its ray: `ray × [r1 r2 t] (x, y, 1) = 0`. `None` for fewer than
/// four points, or where they do not determine it.
pub fn pose_from_rays(plane: &[[f64; 2]], rays: &[Vector3<f64>]) -> Option<Pose> {
    let n = plane.len().min(rays.len());
    if n < 4 {
        return None;
    }
    // The board is moved and scaled to about ±1, or the columns would differ by orders of magnitude.
    let middle = [0, 1].map(|k| plane.iter().map(|p| p[k]).sum::<f64>() / n as f64);
    let extent = plane.iter().map(|p| (p[0] - middle[0]).hypot(p[1] - middle[1])).fold(0.0, f64::max);
    let mut system = SMatrix::<f64, 9, 9>::zeros();
    for (p, ray) in plane.iter().zip(rays) {
        let d = ray.try_normalize(0.0)?;
        let q = [(p[0] - middle[0]) / extent, (p[1] - middle[1]) / extent, 1.0];
        // The cross product as a matrix: two of its three rows are independent, all three weigh directions alike.
        let cross = d.cross_matrix();
        let a = SMatrix::<f64, 3, 9>::from_fn(|r, c| cross[(r, c % 3)] * q[c / 3]);
        system += a.transpose() * a;
    }
    let eigen = SymmetricEigen::new(system);
    let least = eigen.eigenvalues.imin();
    // Points on a line leave a family of matrices.
    let mut values: Vec<f64> = eigen.eigenvalues.iter().copied().collect();
    values.sort_by(f64::total_cmp);
    if values[1] <= 1e-13 * values[8] {
        return None;
    }
    let h = Matrix3::from_column_slice(eigen.eigenvectors.column(least).as_slice());
    let ahead: f64 = plane
        .iter()
        .zip(rays)
        .map(|(p, ray)| {
            let q = Vector3::new((p[0] - middle[0]) / extent, (p[1] - middle[1]) / extent, 1.0);
            ray.dot(&(h * q)).signum()
        })
        .sum();
    let h = if ahead < 0.0 { -h } else { h };
    let (a, b, t) = (h.column(0).into_owned(), h.column(1).into_owned(), h.column(2).into_owned());
    let scale = 2.0 / (a.norm() + b.norm());
    // The nearest two columns at right angles.
    let svd = Matrix3x2::from_columns(&[a * scale, b * scale]).svd(true, true);
    let r = svd.u? * svd.v_t?;
    let (r1, r2) = (r.column(0).into_owned(), r.column(1).into_owned());
    let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[r1, r2, r1.cross(&r2)]));
    let translation = t * (scale * extent) - rotation * Vector3::new(middle[0], middle[1], 0.0);
    let pose = Pose { rotation, translation };
    (pose.matrix().iter().chain(&pose.translation).all(|x| x.is_finite())).then_some(pose)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    fn homography(k: &Matrix3<f64>, pose: &Pose) -> Matrix3<f64> {
        let m = pose.matrix();
        k * Matrix3::from_columns(&[m.column(0).into(), m.column(1).into(), pose.translation])
    }

    fn k() -> Matrix3<f64> {
        Matrix3::new(800.0, 0.0, 330.0, 0.0, 780.0, 250.0, 0.0, 0.0, 1.0)
    }

    #[test]
    fn exact_homographies_give_camera_and_poses() {
        let angles = [[20.0, 5.0, 0.0], [-15.0, 25.0, 10.0], [3.0, -30.0, -40.0], [0.0, 0.0, 15.0]];
        let poses = angles.map(|a| Pose::from_euler_deg(a, Vector3::new(-100.0, -60.0, 700.0)));
        let hs: Vec<_> = poses.iter().map(|p| homography(&k(), p) * 1e-3).collect();
        for normalise in [true, false] {
            let got = closed_form(&hs, [640, 480], normalise).intrinsics.unwrap();
            for (a, b) in got.iter().zip([800.0, 780.0, 330.0, 250.0]) {
                assert!((a - b).abs() < if normalise { 1e-8 } else { 1e-2 }, "{normalise} {got:?}");
            }
        }
        for (h, p) in hs.iter().zip(&poses) {
            let got = pose(h, [800.0, 780.0, 330.0, 250.0], [100.0, 60.0]).unwrap();
            assert!((got.matrix() - p.matrix()).norm() < 1e-12, "{got:?}");
            assert!((got.translation - p.translation).norm() < 1e-9);
        }
    }

    #[test]
    fn rays_in_all_directions_give_the_pose() {
        // A board that reaches from before the camera to behind it.
        let truth = Pose::from_euler_deg([10.0, 80.0, 5.0], Vector3::new(300.0, -60.0, 250.0));
        let plane: Vec<[f64; 2]> =
            (0..54).map(|i| [f64::from(i % 9) * 60.0, f64::from(i / 9) * 60.0]).collect();
        let rays: Vec<_> = plane
            .iter()
            .map(|p| truth.apply(&nalgebra::Point3::new(p[0], p[1], 0.0)).coords.normalize())
            .collect();
        assert!(rays.iter().any(|r| r.z < 0.0) && rays.iter().any(|r| r.z > 0.0));
        let got = pose_from_rays(&plane, &rays).unwrap();
        assert!((got.matrix() - truth.matrix()).norm() < 1e-9, "{got:?}");
        assert!((got.translation - truth.translation).norm() < 1e-6, "{got:?}");
        assert!(pose_from_rays(&plane[..3], &rays[..3]).is_none());
    }

    #[test]
    fn parallel_boards_leave_a_second_solution() {
        let hs: Vec<_> = [[0.0, 600.0], [30.0, 700.0], [75.0, 800.0]]
            .iter()
            .map(|[roll, z]| {
                homography(&k(), &Pose::from_euler_deg([0.0, 0.0, *roll], Vector3::new(-10.0, -60.0, *z)))
            })
            .collect();
        assert!(closed_form(&hs, [640, 480], true).singular_values[3] < 1e-7);
    }
}
