//! How sure the poses are: the rest of the covariance, which with that of the intrinsics is the whole.
//!
//! With Σ the covariance of the intrinsics and `Tᵢ = −Vᵢ⁻¹Wᵢᵀ` the answer of pose i to them ([`super`]),
//!
//! ```text
//! Cov(pᵢ, b) = Tᵢ Σ,    Cov(pᵢ) = σ₀² Vᵢ⁻¹ + Tᵢ Σ Tᵢᵀ,    Cov(pᵢ, pⱼ) = Tᵢ Σ Tⱼᵀ = Cov(pᵢ, b) Σ⁻¹ Cov(b, pⱼ)
//! ```
//!
//! each from the solver's motion about the middle of the corners to `rvec` and `tvec`: `δt = ω × (t − c) + τ`, and
//! `δrvec = J⁻¹(rvec) ω` with J the left Jacobian of the rotations (T. Barfoot, "State Estimation for Robotics", 2017, §7.1.3).

use nalgebra::{Matrix3, Matrix6, Matrix6xX, Vector3};
use serde::{Deserialize, Serialize};

use super::Blocks;
use crate::{
    solution::{Calibration, View},
    target::Target,
};

/// Covariance of a pose, in the order `rvec` (rad), `tvec` (the unit of the board).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PoseCovariance {
    /// 6 × 6: of the pose.
    pub pose: [[f64; 6]; 6],
    /// 6 × P: of the pose with all parameters of the camera in the model's order; zero where one was fixed, its partner's where it was
    /// tied.
    pub camera: [Vec<f64>; 6],
}

/// Of every view of a calibration; `None` where its corners do not determine a pose.
///
/// As the robust loss weighs the corners in the end, which is some 5 % too careful.
pub fn of_poses(calibration: &Calibration, target: &Target) -> Vec<Option<PoseCovariance>> {
    let slots = calibration.slots();
    calibration.views.iter().map(|view| one(calibration, target, &slots, view)).collect()
}

fn one(
    calibration: &Calibration,
    target: &Target,
    slots: &[Option<usize>],
    view: &View,
) -> Option<PoseCovariance> {
    let blocks = Blocks::of(calibration, target, slots, view)?;
    let v = blocks.v.cholesky()?;
    let pose = &view.camera_from_board;
    let mut to = Matrix6::identity();
    to.fixed_view_mut::<3, 3>(0, 0).copy_from(&left_jacobian_inverse(&pose.rvec()));
    to.fixed_view_mut::<3, 3>(3, 0).copy_from(&-(pose.translation - blocks.center).cross_matrix());
    let answer: Matrix6xX<f64> = to * -v.solve(&blocks.w);
    let with_free = &answer * &calibration.covariance;
    let own = to * v.inverse() * to.transpose() * calibration.sigma0_px.powi(2);
    let whole = own + &with_free * answer.transpose();
    let param = |row: usize| slots.iter().map(|slot| slot.map_or(0.0, |s| with_free[(row, s)])).collect();
    Some(PoseCovariance {
        pose: std::array::from_fn(|i| std::array::from_fn(|j| whole[(i, j)])),
        camera: std::array::from_fn(param),
    })
}

/// `J⁻¹(r)`, |r| ≤ π.
fn left_jacobian_inverse(r: &Vector3<f64>) -> Matrix3<f64> {
    let angle = r.norm();
    let cross = r.cross_matrix();
    // 1/φ² − cot(φ/2)/(2φ), by its series where that cancels.
    let square = if angle < 1e-3 {
        1.0 / 12.0 + angle * angle / 720.0
    } else {
        1.0 / (angle * angle) - 0.5 / (angle * (0.5 * angle).tan())
    };
    Matrix3::identity() - 0.5 * cross + square * cross * cross
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, Vector2};

    use super::*;
    use crate::{
        calibrate::{Loss, Options, Weights, calibrate, parse_fixes},
        pose::Pose,
        uncertainty::tests::problem,
    };
    use std::ops::ControlFlow;

    /// All blocks together are σ₀² (JᵀJ)⁻¹ of the whole problem, J by differences in rvec, tvec and the parameters.
    #[test]
    fn the_blocks_are_those_of_the_whole_problem() {
        const STEP: f64 = 1e-6;
        let options = Options {
            loss: Loss::Linear,
            weights: Weights::None,
            fixed: parse_fixes("k3").unwrap(),
            multi_start: false,
            ..Options::default()
        };
        let problem = problem(&[0, 3, 7, 9], options, 5);
        let found = calibrate(&problem, &mut |_| ControlFlow::Continue(())).unwrap();
        let (free, views) = (found.free.len(), found.views.len());
        let unknowns = free + 6 * views;
        let project = |i: usize, by: &dyn Fn(usize) -> f64| -> Vec<Vector2<f64>> {
            let mut camera = found.camera.clone();
            for (k, param) in found.free.iter().enumerate() {
                camera.params[*param] += by(k);
            }
            let view = &found.views[i];
            let moved = |k: usize| Vector3::from_fn(|row, _| by(free + 6 * i + 3 * k + row));
            let at = &view.camera_from_board;
            let pose = Pose::from_rvec_tvec(at.rvec() + moved(0), at.translation + moved(1));
            let points = view.indices.iter().map(|k| pose.apply(&problem.target.point_in_board(*k).unwrap()));
            points.map(|p| camera.project(&p).unwrap()).collect()
        };
        let corners: usize = found.views.iter().map(|v| v.indices.len()).sum();
        let mut jacobian = DMatrix::zeros(2 * corners, unknowns);
        for column in 0..unknowns {
            let mut row = 0;
            for i in 0..views {
                let side = |sign: f64| project(i, &|k| if k == column { sign * STEP } else { 0.0 });
                for (a, b) in side(1.0).iter().zip(side(-1.0)) {
                    for k in 0..2 {
                        jacobian[(row + k, column)] = (a[k] - b[k]) / (2.0 * STEP);
                    }
                    row += 2;
                }
            }
        }
        let whole =
            (jacobian.transpose() * &jacobian).cholesky().unwrap().inverse() * found.sigma0_px.powi(2);
        let list = of_poses(&found, &problem.target);
        let sigma = |k: usize| whole[(k, k)].sqrt();
        let near = |told: f64, i: usize, j: usize| {
            let off = (told - whole[(i, j)]).abs() / (sigma(i) * sigma(j));
            assert!(off < 1e-3, "{i} {j}: {told} beside {}", whole[(i, j)]);
        };
        for (i, one) in list.iter().enumerate() {
            let one = one.as_ref().unwrap();
            let row = |k: usize| free + 6 * i + k;
            for a in 0..6 {
                for b in 0..6 {
                    near(one.pose[a][b], row(a), row(b));
                }
                for (k, param) in found.free.iter().enumerate() {
                    near(one.camera[a][*param], row(a), k);
                }
                assert_eq!(one.camera[a][8], 0.0);
            }
        }
        // Of two pictures: through the camera alone.
        let part = |i: usize| {
            let rows = &list[i].as_ref().unwrap().camera;
            DMatrix::from_fn(6, free, |a, k| rows[a][found.free[k]])
        };
        let between = part(0) * found.covariance.clone().cholesky().unwrap().solve(&part(2).transpose());
        for a in 0..6 {
            for b in 0..6 {
                near(between[(a, b)], free + a, free + 12 + b);
            }
        }
    }
}
