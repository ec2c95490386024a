//! The pose of a camera whose rays are known, from three points, and from many of which some are wrong.
//!
//! Three unit rays `dᵢ` see three points: their distances λ obey `|λᵢ dᵢ − λⱼ dⱼ|² = aᵢⱼ`, three quadratic forms `λᵀ Mᵢⱼ λ = aᵢⱼ`. Two
//! combinations vanish at every solution, `D₁ = a₂₃ M₁₂ − a₁₂ M₂₃` and `D₂ = a₂₃ M₁₃ − a₁₃ M₂₃`. A root γ of the cubic `det(D₁ + γ D₂)`
//! makes a pair of planes of them, and in each plane a quadratic equation is left: at most four poses. Rays may point anywhere, so
//! lenses beyond 180° are served too.
//!
//! M. Persson, K. Nordberg, "Lambda Twist: An Accurate Fast Robust Perspective Three Point (P3P) Solver", ECCV 2018; P. Rousseeuw,
//! "Least median of squares regression", JASA 79, 1984.

use nalgebra::{Matrix3, Point3, Rotation3, SymmetricEigen, Vector3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::pose::Pose;

/// Points that determine a pose: three, and one to choose among their four solutions.
pub const POINTS: usize = 4;

/// All `camera_from_board` under which three points are seen along three unit rays, at most four; none where points or rays lie on a line.
pub fn solve(points: &[Point3<f64>; 3], rays: &[Vector3<f64>; 3]) -> Vec<Pose> {
    let mut poses = Vec::new();
    let Some(frame) = frame(points.map(|p| p.coords)) else { return poses };
    let [a12, a13, a23] = PAIRS.map(|[i, j]| (points[i] - points[j]).norm_squared());
    let [m12, m13, m23] = PAIRS.map(|[i, j]| form(rays, i, j));
    let (d1, d2) = (m12 * a23 - m23 * a12, m13 * a23 - m23 * a13);
    let (j1, j2) = (adjugate(&d1), adjugate(&d2));
    let cubic = [d1.determinant(), (j1 * d2).trace(), (j2 * d1).trace(), d2.determinant()];
    for gamma in real_roots(cubic) {
        // The distances lie in one of two planes, of which the matrix is the product.
        for normal in planes(&(d1 + d2 * gamma)) {
            let [p, q] = basis(&normal);
            let form = |a: &Vector3<f64>, b: &Vector3<f64>| a.dot(&(d2 * b));
            let (a, b, c) = (form(&q, &q), form(&p, &q), form(&p, &p));
            let root = (b * b - a * c).max(0.0).sqrt();
            // The sign avoids the difference of nearly equal numbers.
            let half = -(b + root.copysign(b));
            for direction in [p * a + q * half, p * half + q * c] {
                let square = direction.dot(&(m23 * direction));
                let lambda = direction * (a23 / square).sqrt().copysign(direction.sum());
                let Some(lambda) = polished(lambda, rays, [a12, a13, a23]) else { continue };
                let seen = [0, 1, 2].map(|i| rays[i] * lambda[i]);
                let Some(at) = self::frame(seen) else { continue };
                let rotation = Rotation3::from_matrix_unchecked(at * frame.transpose());
                let pose = Pose { rotation, translation: seen[0] - rotation * points[0].coords };
                let is_new = |p: &Pose| (p.matrix() - pose.matrix()).norm() > 1e-6;
                if poses.iter().all(is_new) {
                    poses.push(pose);
                }
            }
        }
        if !poses.is_empty() {
            break;
        }
    }
    poses
}

/// The sides of the triangle.
const PAIRS: [[usize; 2]; 3] = [[0, 1], [0, 2], [1, 2]];

/// `λᵀ M λ = |λᵢ dᵢ − λⱼ dⱼ|²`.
fn form(rays: &[Vector3<f64>; 3], i: usize, j: usize) -> Matrix3<f64> {
    let mut m = Matrix3::zeros();
    (m[(i, i)], m[(j, j)]) = (1.0, 1.0);
    let cos = rays[i].dot(&rays[j]);
    (m[(i, j)], m[(j, i)]) = (-cos, -cos);
    m
}

fn adjugate(m: &Matrix3<f64>) -> Matrix3<f64> {
    let row = |i: usize| m.row(i).transpose();
    Matrix3::from_columns(&[row(1).cross(&row(2)), row(2).cross(&row(0)), row(0).cross(&row(1))])
}

/// Real roots of `c₀ + c₁ x + c₂ x² + c₃ x³`.
fn real_roots([c0, c1, c2, c3]: [f64; 4]) -> Vec<f64> {
    let [b, c, d] = [c2 / c3, c1 / c3, c0 / c3];
    let shift = b / 3.0;
    let (p, q) = ((c - b * shift) / 3.0, shift * shift * shift + (d - c * shift) / 2.0);
    let discriminant = q * q + p * p * p;
    let mut roots = if discriminant > 0.0 {
        let u = -(q + discriminant.sqrt().copysign(q)).cbrt();
        vec![u - p / u - shift]
    } else {
        let size = (-p).max(0.0).sqrt();
        let angle = (-q / (size * size * size)).clamp(-1.0, 1.0).acos();
        [0.0, 1.0, 2.0]
            .map(|k| 2.0 * size * ((angle + k * std::f64::consts::TAU) / 3.0).cos() - shift)
            .to_vec()
    };
    for x in &mut roots {
        for _ in 0..2 {
            let step = (((*x + b) * *x + c) * *x + d) / ((3.0 * *x + 2.0 * b) * *x + c);
            *x -= if step.is_finite() { step } else { 0.0 };
        }
    }
    roots.retain(|x| x.is_finite());
    roots
}

/// Normals of the two planes whose product a singular matrix is; none where they are not real.
fn planes(m: &Matrix3<f64>) -> Vec<Vector3<f64>> {
    let eigen = SymmetricEigen::new(*m);
    let (low, high) = (eigen.eigenvalues.imin(), eigen.eigenvalues.imax());
    let (least, most) = (eigen.eigenvalues[low], eigen.eigenvalues[high]);
    if low == high || least > 0.0 || most < 0.0 {
        return Vec::new();
    }
    let a = eigen.eigenvectors.column(high) * most.sqrt();
    let b = eigen.eigenvectors.column(low) * (-least).sqrt();
    vec![a + b, a - b]
}

/// Two vectors at right angles in the plane through the origin with this normal.
fn basis(normal: &Vector3<f64>) -> [Vector3<f64>; 2] {
    let mut aside = Vector3::zeros();
    aside[normal.iamin()] = 1.0;
    let p = normal.cross(&aside).normalize();
    [p, normal.cross(&p).normalize()]
}

/// Newton's method on the three sides; `None` where a point would lie behind its ray.
fn polished(mut l: Vector3<f64>, rays: &[Vector3<f64>; 3], sides: [f64; 3]) -> Option<Vector3<f64>> {
    let mut miss = Vector3::zeros();
    for _ in 0..4 {
        let mut jacobian = Matrix3::zeros();
        for (row, [i, j]) in PAIRS.into_iter().enumerate() {
            let cos = rays[i].dot(&rays[j]);
            miss[row] = l[i] * l[i] + l[j] * l[j] - 2.0 * cos * l[i] * l[j] - sides[row];
            jacobian[(row, i)] = 2.0 * (l[i] - cos * l[j]);
            jacobian[(row, j)] = 2.0 * (l[j] - cos * l[i]);
        }
        l -= jacobian.try_inverse()? * miss;
    }
    // The last step was made from a place that was right already.
    let right = miss.amax() < 1e-9 * sides.into_iter().fold(0.0, f64::max);
    (right && l.iter().all(|l| *l > 0.0)).then_some(l)
}

/// A right-handed frame on a triangle; `None` where it is a line.
fn frame([a, b, c]: [Vector3<f64>; 3]) -> Option<Matrix3<f64>> {
    let along = (b - a).try_normalize(0.0)?;
    let normal = along.cross(&(c - a)).try_normalize(1e-9 * (c - a).norm())?;
    Some(Matrix3::from_columns(&[along, normal.cross(&along), normal]))
}

/// A pose and how well points agree with it.
#[derive(Clone, Debug)]
pub struct Consensus {
    /// `camera_from_board` of three of the points.
    pub pose: Pose,
    /// Angle between a point and its ray that half of the points do not exceed, at least [`POINTS`] of them, rad.
    pub typical_rad: f64,
}

/// The pose on which most points agree with the unit rays under which they are seen, whatever the others say: of poses of three points
/// the one with the least median angle. `None` below [`POINTS`] points, or where no three determine one.
pub fn consensus(points: &[Point3<f64>], rays: &[Vector3<f64>]) -> Option<Consensus> {
    // With half of the points wrong one sample in eight is right: all 64 are wrong once in 5000 sets.
    const SAMPLES: usize = 64;
    let n = points.len().min(rays.len());
    if n < POINTS {
        return None;
    }
    // Three agree in any case.
    let agreeing = (n / 2).max(POINTS - 1);
    let typical_rad = |pose: &Pose| {
        let angle = |(x, d): (&Point3<f64>, &Vector3<f64>)| {
            let q = pose.apply(x).coords;
            q.cross(d).norm().atan2(q.dot(d))
        };
        let mut angles: Vec<f64> = points.iter().zip(rays).map(angle).collect();
        *angles.select_nth_unstable_by(agreeing, f64::total_cmp).1
    };
    let mut random = Pcg64Mcg::seed_from_u64(n as u64);
    let mut all: Vec<usize> = (0..n).collect();
    let mut best: Option<Consensus> = None;
    for _ in 0..SAMPLES {
        for k in 0..3 {
            all.swap(k, random.random_range(k..n));
        }
        let pick = [all[0], all[1], all[2]];
        for pose in solve(&pick.map(|i| points[i]), &pick.map(|i| rays[i])) {
            let typical_rad = typical_rad(&pose);
            if best.as_ref().is_none_or(|b| typical_rad < b.typical_rad) {
                best = Some(Consensus { pose, typical_rad });
            }
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points of a thing and a camera near it, at random.
    struct Scene {
        points: Vec<Point3<f64>>,
        rays: Vec<Vector3<f64>>,
        truth: Pose,
    }

    fn scene(n: usize, flat: bool, seed: u64) -> Scene {
        let mut random = Pcg64Mcg::seed_from_u64(seed);
        let mut draw = |a: f64| random.random_range(-a..a);
        let points: Vec<_> = (0..n)
            .map(|_| Point3::new(draw(150.0), draw(100.0), if flat { 0.0 } else { draw(80.0) }))
            .collect();
        // Beside the camera too, and behind it: rays know no front.
        let place = Vector3::new(draw(300.0), draw(300.0), draw(300.0));
        let truth = Pose::from_euler_deg([draw(180.0), draw(80.0), draw(180.0)], place);
        let rays = points.iter().map(|p| truth.apply(p).coords.normalize()).collect();
        Scene { points, rays, truth }
    }

    fn off(a: &Pose, b: &Pose) -> f64 {
        (a.matrix() - b.matrix()).norm().max((a.translation - b.translation).norm() / 300.0)
    }

    #[test]
    fn one_of_the_poses_of_three_points_is_the_right_one() {
        let mut found = 0;
        for seed in 0..2000 {
            let Scene { points, rays, truth } = scene(3, false, seed);
            let poses = solve(&[points[0], points[1], points[2]], &[rays[0], rays[1], rays[2]]);
            assert!(poses.len() <= 4);
            for pose in &poses {
                for (p, d) in points.iter().zip(&rays) {
                    assert!(pose.apply(p).coords.normalize().dot(d) > 1.0 - 1e-9, "{seed}");
                }
            }
            found += usize::from(poses.iter().any(|p| off(p, &truth) < 1e-6));
        }
        // Two solutions that nearly meet are a double root, which has half of the digits.
        assert!(found >= 1990, "{found} of 2000");
    }

    #[test]
    fn points_on_a_line_have_no_pose() {
        let points = [0.0, 1.0, 2.0].map(|x| Point3::new(x, 2.0 * x, 5.0));
        let rays = points.map(|p| p.coords.normalize());
        assert!(solve(&points, &rays).is_empty());
    }

    #[test]
    fn four_points_give_the_pose_and_five_bear_a_wrong_one() {
        let (mut four, mut five) = (0, 0);
        for seed in 0..200 {
            let Scene { points, mut rays, truth } = scene(5, seed % 2 == 0, seed);
            let of_four = consensus(&points[..4], &rays[..4]).unwrap();
            four += usize::from(off(&of_four.pose, &truth) < 1e-6);
            rays[seed as usize % 5] = Vector3::new(0.3, -0.2, 1.0).normalize();
            let of_five = consensus(&points, &rays).unwrap();
            five += usize::from(off(&of_five.pose, &truth) < 1e-6);
        }
        assert!(four >= 196 && five >= 190, "{four} {five} of 200");
    }

    #[test]
    fn a_consensus_stands_up_to_wrong_points() {
        for seed in 0..50 {
            let Scene { points, mut rays, truth } = scene(54, seed % 2 == 0, seed);
            let wrong = |i: usize| (i * 7 + seed as usize) % 54 < 21;
            for i in (0..54).filter(|i| wrong(*i)) {
                rays[i] = (rays[(i + 11) % 54] + rays[i]).normalize();
            }
            let found = consensus(&points, &rays).unwrap();
            assert!(off(&found.pose, &truth) < 1e-6 && found.typical_rad < 1e-9, "{seed}");
        }
    }
}
