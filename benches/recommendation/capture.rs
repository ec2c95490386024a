//! Captures by lenses of every kind: what a model is recommended for.

use nalgebra::{UnitQuaternion, Vector2, Vector3};
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64;
use straightedge::calib::{
    Result,
    calibrate::{CameraSetup, Options, Problem, pose_of},
    camera::{Camera, Model},
    observation::{Corner, FrameId, Observation},
    pose::Pose,
    target::Target,
};

/// Noise of a corner per axis, px.
pub(super) const NOISE_PX: f64 = 0.1;

/// Lenses with pictures of 1280 × 960: 40° to 200°.
pub(super) const LENSES: [(Model, &[f64]); 11] = [
    (Model::Pinhole, &[1500.0, 1502.0, 640.0, 478.0]),
    (Model::Radial1, &[1100.0, 1099.0, 645.0, 470.0, -0.12]),
    (Model::Radial2, &[1700.0, 1700.0, 630.0, 490.0, -0.25, 0.3]),
    (Model::Brown4, &[1050.0, 1052.0, 650.0, 482.0, -0.28, 0.09, 2e-3, -1e-3]),
    (Model::Brown5, &[900.0, 901.0, 633.0, 484.0, -0.31, 0.13, 6e-4, -1.1e-3, -0.03]),
    (Model::Rational, &[640.0, 641.0, 640.0, 475.0, 0.6, 0.08, 3e-4, -2e-4, 0.002, 0.95, 0.22, 0.01]),
    (
        Model::ThinPrism,
        &[1000.0, 1001.0, 641.0, 483.0, -0.2, 0.06, 1e-3, 5e-4, 0.0, 0.0, 0.0, 0.0, 4e-3, -1e-3, -5e-3, 2e-3],
    ),
    (Model::Eucm, &[420.0, 421.0, 638.0, 481.0, 0.62, 1.1]),
    (Model::Ds, &[360.0, 361.0, 642.0, 477.0, -0.18, 0.59]),
    (Model::Kb4, &[380.0, 381.0, 641.0, 479.0, -0.02, 0.01, -6e-3, 8e-4]),
    (Model::Kb4, &[300.0, 300.5, 637.0, 476.0, 0.06, -0.02, 4e-3, -7e-4]),
];

/// The true camera.
pub(super) fn camera((model, params): (Model, &[f64])) -> Camera {
    Camera { model, size_px: [1280, 960], params: params.to_vec() }
}

/// Noisy pictures of a 9x6 board all over the view, turned up to 45° from the line of sight; seeded.
pub(super) fn problem(camera: &Camera, views: usize, seed: u64) -> Problem {
    let mut random = Pcg64::seed_from_u64(seed);
    let noise = Normal::new(0.0, NOISE_PX).expect("the deviation is positive");
    let target = Target::checkerboard("9x6".parse().expect("a size"), 25.0);
    let [w, h] = camera.size_px.map(f64::from);
    let mut observations = Vec::new();
    for _ in 0..100 * views {
        let mut draw = |a: f64, b: f64| random.random_range(a..b);
        let px = Vector2::new(draw(0.0, w), draw(0.0, h));
        let place = draw(250.0, 700.0) * (camera.params[0] / 900.0).max(0.6);
        let turn = Vector3::new(draw(-0.8, 0.8), draw(-0.8, 0.8), draw(-3.1, 3.1));
        let Some(ray) = camera.unproject(&px) else { continue };
        let Some(sight) = UnitQuaternion::rotation_between(&Vector3::z(), &ray) else { continue };
        let rotation = (sight * UnitQuaternion::from_scaled_axis(turn)).to_rotation_matrix();
        let pose = Pose { rotation, translation: ray * place - rotation * Vector3::new(100.0, 62.5, 0.0) };
        let corners: Vec<Corner> = (0..54)
            .filter_map(|index| {
                let point = pose.apply(&target.point_in_board(index)?);
                let px = camera.project(&point)?;
                // Beyond the fold of the lens's own polynomial nothing is seen.
                camera.unproject(&px).filter(|ray| ray.angle(&point.coords) < 1e-6)?;
                let inside = px.x > 2.0 && px.y > 2.0 && px.x < w - 3.0 && px.y < h - 3.0;
                let px = px + Vector2::new(noise.sample(&mut random), noise.sample(&mut random));
                inside.then_some(Corner { index, px, sigma_px: NOISE_PX })
            })
            .collect();
        if corners.len() >= 20 {
            let frame = FrameId(observations.len() as u32);
            observations.push(Observation { camera: 0, frame, corners });
        }
        if observations.len() == views {
            break;
        }
    }
    let setup =
        CameraSetup { size_px: camera.size_px, model: camera.model, start: None, focal_hint_px: None };
    Problem { cameras: vec![setup], target, observations, options: Options::default() }
}

/// √(Σ|r|²/N) of the pictures of another capture with a camera held, px.
pub(super) fn error_px(camera: &Camera, other: &Problem) -> Result<f64> {
    let (mut sum, mut n) = (0.0, 0usize);
    for observation in &other.observations {
        let (_, residuals) = pose_of(camera, &other.target, &observation.corners)?;
        sum += residuals.iter().map(|r| r.norm_squared()).sum::<f64>();
        n += residuals.len();
    }
    Ok((sum / n as f64).sqrt())
}
