//! The direct linear transform for points that are not in one plane: the whole projection of a view, and the pose of known rays.
//!
//! `w (u, v, 1)ᵀ = P (x, y, z, 1)ᵀ`, 11 unknowns, two equations a point: six points that are not coplanar determine P, and with
//! it camera and pose. Points are first moved and scaled to unit spread along each of their principal axes, pixels to a mean
//! distance of √2, so that `Σ p pᵀ = n I` and the rows of P follow from the third, which is an eigenvector of a 4×4 matrix
//! (the reduction of [`super::homography`]).
//!
//! R. Hartley, A. Zisserman, *Multiple View Geometry*, 2nd ed., §7.1, §7.2, §6.2.4 (the camera from P).

use nalgebra::{
    DMatrix, DVector, Matrix3, Matrix3x4, Matrix4, Point3, Rotation3, SymmetricEigen, Vector2, Vector3,
    Vector4,
};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::{order, pose::Pose, spread::Spread};

/// Points that determine a projection.
pub const POINTS: usize = 6;

/// A projection and the pairs that support it.
#[derive(Clone, Debug)]
pub struct Fit {
    /// Picture from board up to scale; depths are positive on the whole.
    pub matrix: Matrix3x4<f64>,
    /// Whether each pair was used.
    pub inliers: Vec<bool>,
    /// Median distance of the pairs from it, px.
    pub median_px: f64,
}

impl Fit {
    /// `[fx, fy, cx, cy]`, px, of the camera whose skew is left away; `None` where there is none.
    pub fn intrinsics(&self) -> Option<[f64; 4]> {
        // K Kᵀ, K = [fx s cx; 0 fy cy; 0 0 1].
        let m = self.matrix.fixed_columns::<3>(0).into_owned();
        let a = m * m.transpose() / m.row(2).norm_squared();
        let (cx, cy) = (a[(0, 2)], a[(1, 2)]);
        let fy = (a[(1, 1)] - cy * cy).sqrt();
        let skew = (a[(0, 1)] - cx * cy) / fy;
        let fx = (a[(0, 0)] - cx * cx - skew * skew).sqrt();
        let k = [fx, fy, cx, cy];
        (k.iter().all(|x| x.is_finite()) && fx > 0.0 && fy > 0.0).then_some(k)
    }

    /// Whether the points are mirrored: no rotation makes the picture that they are said to have.
    pub fn is_mirrored(&self) -> bool {
        self.matrix.fixed_columns::<3>(0).determinant() < 0.0
    }

    fn apply(matrix: &Matrix3x4<f64>, p: &Point3<f64>) -> Vector2<f64> {
        let q = matrix * p.to_homogeneous();
        Vector2::new(q.x / q.z, q.y / q.z)
    }
}

/// Fits the projection `px ≈ P board`; with `ransac` it looks for a consensus where the plain fit leaves gross errors. `None` for
/// fewer than [`POINTS`] pairs and where they do not determine it.
pub fn fit(board: &[Point3<f64>], px: &[Vector2<f64>], ransac: bool) -> Option<Fit> {
    const SAMPLES: usize = 128;
    let n = board.len().min(px.len());
    let (board, px) = (&board[..n], &px[..n]);
    let errors = |matrix: &Matrix3x4<f64>| -> Vec<f64> {
        let error = |(b, i): (&Point3<f64>, &Vector2<f64>)| (Fit::apply(matrix, b) - i).norm();
        board.iter().zip(px).map(error).map(|e| if e.is_finite() { e } else { f64::MAX }).collect()
    };
    let of = |chosen: &[usize]| {
        let (b, i): (Vec<_>, Vec<_>) = chosen.iter().map(|&k| (board[k], px[k])).unzip();
        solve(&b, &i)
    };
    let mut inliers = vec![true; n];
    let mut matrix = solve(board, px)?;
    // A lens may bend the picture by this.
    let bent = 0.02 * px.iter().map(|p| (p - px[0]).norm()).fold(0.0, f64::max);
    if ransac && n > POINTS && errors(&matrix).iter().any(|e| *e > bent) {
        let mut random = Pcg64Mcg::seed_from_u64(n as u64);
        let mut least = median(errors(&matrix));
        for _ in 0..SAMPLES {
            let mut all: Vec<usize> = (0..n).collect();
            for k in 0..POINTS {
                all.swap(k, random.random_range(k..n));
            }
            let Some(candidate) = of(&all[..POINTS]) else { continue };
            let error = median(errors(&candidate));
            if error < least {
                (matrix, least) = (candidate, error);
            }
        }
        for _ in 0..2 {
            let e = errors(&matrix);
            let limit = (5.0 * median(e.clone())).max(bent);
            inliers = e.iter().map(|e| *e <= limit).collect();
            let kept: Vec<usize> = (0..n).filter(|i| inliers[*i]).collect();
            matrix = of(&kept)?;
        }
    }
    Some(Fit { median_px: median(errors(&matrix)), matrix, inliers })
}

fn median(mut values: Vec<f64>) -> f64 {
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// Points at unit spread along their axes about the origin, and the 4×4 matrix that took them there; `None` where they are in a plane.
fn whitened(board: &[Point3<f64>]) -> Option<(Vec<Vector4<f64>>, Matrix4<f64>)> {
    let Spread { board_from_axes, sizes } = Spread::of(board)?;
    if board.len() < POINTS || sizes[2] <= 1e-7 * sizes[0] {
        return None;
    }
    let scale = Matrix4::from_diagonal(&Vector4::new(1.0 / sizes[0], 1.0 / sizes[1], 1.0 / sizes[2], 1.0));
    let back = board_from_axes.inverse();
    let mut to = Matrix4::identity();
    to.fixed_view_mut::<3, 3>(0, 0).copy_from(back.matrix());
    to.fixed_view_mut::<3, 1>(0, 3).copy_from(&back.translation);
    let points = board.iter().map(|p| scale * back.apply(p).to_homogeneous()).collect();
    Some((points, scale * to))
}

fn solve(board: &[Point3<f64>], px: &[Vector2<f64>]) -> Option<Matrix3x4<f64>> {
    let (points, to_unit) = whitened(board)?;
    let n = points.len() as f64;
    let middle = px.iter().sum::<Vector2<f64>>() / n;
    let scale = std::f64::consts::SQRT_2 * n / px.iter().map(|p| (p - middle).norm()).sum::<f64>();
    let (mut u, mut v, mut q) = (Matrix4::zeros(), Matrix4::zeros(), Matrix4::zeros());
    for (p, px) in points.iter().zip(px) {
        let (i, pp) = ((px - middle) * scale, p * p.transpose());
        u += pp * i.x;
        v += pp * i.y;
        q += pp * i.norm_squared();
    }
    let (u, v) = (u / n, v / n);
    let reduced = q / n - u * u - v * v;
    if !reduced.iter().all(|x| x.is_finite()) {
        return None;
    }
    let eigen = SymmetricEigen::new(reduced);
    let mut by_size = [0, 1, 2, 3];
    order::by(&mut by_size, |i| [eigen.eigenvalues[*i]]);
    // Points and camera on a twisted cubic leave a second solution.
    if eigen.eigenvalues[by_size[1]] <= 1e-12 * eigen.eigenvalues[by_size[3]] {
        return None;
    }
    let third = eigen.eigenvectors.column(by_size[0]).into_owned();
    // The middle of the points is in front.
    let third = if third.w < 0.0 { -third } else { third };
    let (first, second) = (u * third / scale + third * middle.x, v * third / scale + third * middle.y);
    let rows = Matrix3x4::from_rows(&[first.transpose(), second.transpose(), third.transpose()]);
    let matrix = rows * to_unit;
    matrix.iter().all(|x| x.is_finite()).then_some(matrix)
}

/// What rays say linearly of the pose of points that are not in one plane.
#[derive(Clone, Copy, Debug)]
pub struct Linear {
    /// `camera_from_board`.
    pub pose: Pose,
    /// Whether the points are mirrored: then the pose is only the best that a rotation can do.
    pub mirrored: bool,
    /// RMS angle between the rays and where the matrix that fits best sends the points, rad.
    pub rms_rad: f64,
}

/// The pose from the rays (any length, any direction) under which points are seen; for lenses beyond 180° too.
///
/// Linear in `[R t]`, which takes each point onto its ray: `ray × [R t] (x, y, z, 1) = 0`; then the nearest rotation, and the
/// translation once more for that. `None` for fewer than [`POINTS`] points, or where they do not determine it.
pub fn pose(board: &[Point3<f64>], rays: &[Vector3<f64>]) -> Option<Linear> {
    let (points, to_unit) = whitened(board)?;
    let rays: Vec<Vector3<f64>> = rays.iter().map(|r| r.try_normalize(0.0)).collect::<Option<_>>()?;
    let mut system = DMatrix::<f64>::zeros(12, 12);
    let mut guess = DVector::<f64>::zeros(12);
    for (p, d) in points.iter().zip(&rays) {
        let across = Matrix3::identity() - d * d.transpose();
        for (j, k) in (0..4).flat_map(|j| (0..4).map(move |k| (j, k))) {
            let mut to = system.fixed_view_mut::<3, 3>(3 * j, 3 * k);
            to += across * (p[j] * p[k]);
        }
        for j in 0..4 {
            let mut to = guess.fixed_rows_mut::<3>(3 * j);
            to += d * p[j];
        }
    }
    let n = points.len() as f64;
    let mut values: Vec<f64> = system.clone().symmetric_eigenvalues().iter().copied().collect();
    values.sort_by(f64::total_cmp);
    if values[1].is_nan() || values[1] <= 1e-12 * n {
        return None;
    }
    // Inverse iteration; the shift keeps exact data from being singular.
    for i in 0..12 {
        system[(i, i)] += 1e-13 * n;
    }
    let factor = system.cholesky()?;
    let mut m = guess.normalize();
    for _ in 0..30 {
        m = factor.solve(&m).normalize();
    }
    let m = Matrix3x4::from_column_slice(m.as_slice());
    let m = if points.iter().zip(&rays).map(|(p, d)| d.dot(&(m * p)).signum()).sum::<f64>() < 0.0 {
        -m
    } else {
        m
    };
    let off = points.iter().zip(&rays).map(|(p, d)| (m * p).cross(d).norm().atan2((m * p).dot(d)).powi(2));
    let rms_rad = (off.sum::<f64>() / n).sqrt();
    let linear = (m * to_unit).fixed_columns::<3>(0).into_owned();
    let mirrored = linear.determinant() < 0.0;
    let rotation = nearest_rotation(&linear)?;
    // Σ (I − d dᵀ)(R x + t) = 0.
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for (x, d) in board.iter().zip(&rays) {
        let across = Matrix3::identity() - d * d.transpose();
        normal += across;
        right -= across * (rotation * x.coords);
    }
    let pose = Pose { rotation, translation: normal.cholesky()?.solve(&right) };
    pose.matrix().iter().chain(&pose.translation).all(|x| x.is_finite()).then_some(Linear {
        pose,
        mirrored,
        rms_rad,
    })
}

/// The rotation nearest to a matrix, by Newton's iteration for the polar decomposition `R ← (R + R⁻ᵀ)/2` (N. Higham, *Functions of
/// Matrices*, §8.3); where the matrix mirrors, its third row gives way to the other two.
fn nearest_rotation(m: &Matrix3<f64>) -> Option<Rotation3<f64>> {
    let mut r = *m;
    if r.determinant() <= 0.0 {
        let (x, y) = (m.row(0).transpose(), m.row(1).transpose());
        r.set_row(2, &(x.cross(&y) / (x.norm() * y.norm()).sqrt()).transpose());
    }
    r /= r.determinant().cbrt();
    for _ in 0..60 {
        let next = (r + r.try_inverse()?.transpose()) * 0.5;
        let moved = (next - r).norm();
        r = next;
        if moved < 1e-14 {
            break;
        }
    }
    Some(Rotation3::from_matrix_unchecked(r)).filter(|r| r.matrix().iter().all(|x| x.is_finite()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two walls at right angles, 30 cm wide, in mm.
    fn rig() -> Vec<Point3<f64>> {
        (0..40)
            .map(|i| {
                let (a, b) = (f64::from(i / 2 % 5) * 60.0, f64::from(i / 10) * 60.0);
                if i % 2 == 0 { Point3::new(a, b, 0.0) } else { Point3::new(0.0, b, 30.0 + a) }
            })
            .collect()
    }

    fn pose_of_rig() -> Pose {
        Pose::from_euler_deg([25.0, 40.0, 10.0], Vector3::new(-90.0, -100.0, 900.0))
    }

    fn seen(points: &[Point3<f64>]) -> Vec<Vector2<f64>> {
        let at = |p: &Point3<f64>| {
            let q = pose_of_rig().apply(p);
            Vector2::new(800.0 * q.x / q.z + 330.0, 780.0 * q.y / q.z + 250.0)
        };
        points.iter().map(at).collect()
    }

    #[test]
    fn one_view_gives_the_camera() {
        let mut px = seen(&rig());
        let near = |fit: &Fit| {
            let k = fit.intrinsics().unwrap();
            k.iter().zip([800.0, 780.0, 330.0, 250.0]).all(|(a, b)| (a - b).abs() < 1e-7)
        };
        let exact = fit(&rig(), &px, true).unwrap();
        assert!(near(&exact) && !exact.is_mirrored() && exact.inliers.iter().all(|i| *i));
        // A few wrong ones are found.
        for i in [3, 17, 22] {
            px[i] += Vector2::new(150.0, -90.0);
        }
        let spoiled = fit(&rig(), &px, true).unwrap();
        assert!(near(&spoiled) && (0..40).all(|i| spoiled.inliers[i] != [3, 17, 22].contains(&i)));
        assert!(!near(&fit(&rig(), &px, false).unwrap()));
    }

    #[test]
    fn mirrored_points_are_known() {
        let mirrored: Vec<_> = rig().iter().map(|p| Point3::new(p.x, p.y, -p.z)).collect();
        assert!(fit(&mirrored, &seen(&rig()), true).unwrap().is_mirrored());
        let rays: Vec<_> = rig().iter().map(|p| pose_of_rig().apply(p).coords).collect();
        assert!(pose(&mirrored, &rays).unwrap().mirrored);
    }

    #[test]
    fn rays_in_all_directions_give_the_pose() {
        // A room around the camera.
        let around = Pose::from_euler_deg([15.0, 70.0, -20.0], Vector3::new(-60.0, -100.0, -80.0));
        for truth in [around, pose_of_rig()] {
            let rays: Vec<_> = rig().iter().map(|p| truth.apply(p).coords * 3.0).collect();
            let got = pose(&rig(), &rays).unwrap();
            assert!(!got.mirrored && got.rms_rad < 1e-9, "{got:?}");
            assert!((got.pose.matrix() - truth.matrix()).norm() < 1e-8, "{got:?}");
            assert!((got.pose.translation - truth.translation).norm() < 1e-5, "{got:?}");
        }
    }

    #[test]
    fn planes_and_few_points_have_none() {
        let flat: Vec<_> = rig().iter().map(|p| Point3::new(p.x, p.y, 0.2 * p.x - p.y)).collect();
        let rays = |points: &[Point3<f64>]| -> Vec<_> {
            points.iter().map(|p| pose_of_rig().apply(p).coords).collect()
        };
        assert!(fit(&flat, &seen(&flat), true).is_none() && pose(&flat, &rays(&flat)).is_none());
        assert!(fit(&rig()[..5], &seen(&rig())[..5], true).is_none());
        assert!(pose(&rig()[..5], &rays(&rig())[..5]).is_none());
    }
}
