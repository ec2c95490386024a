use std::ops::ControlFlow;

use nalgebra::{Matrix3, Point3, Vector2, Vector3};
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64;

use super::*;
use crate::{
    calibrate::{CameraSetup, Options, Problem, calibrate},
    camera::{Camera, Model},
    lens::Lens,
    observation::{Corner, FrameId, Observation},
    pose::Pose,
    synth::{Scene, poses},
};

/// Noise of the corners, px per coordinate.
const NOISE_PX: f64 = 0.05;
const SIZE: [u32; 2] = [1280, 720];

fn camera() -> Camera {
    let params = vec![1000.0, 1001.0, 642.0, 355.0, -0.28, 0.1, 1e-3, -5e-4, 0.0];
    Camera::new(Model::Brown5, SIZE, params).unwrap()
}

/// 0.5 px at its summit, a tenth of that 240 px away: no closed-form model holds it.
fn bump(px: &Vector2<f64>) -> Vector2<f64> {
    let d2 = (px - Vector2::new(830.0, 290.0)).norm_squared();
    Vector2::new(0.45, -0.22) * (-d2 / (2.0 * 110.0 * 110.0)).exp()
}

/// A set of photographs: how often each board stands still, what the lens adds, and what share of corners is grossly wrong.
struct Set {
    boards: usize,
    repeats: usize,
    lens: fn(&Vector2<f64>) -> Vector2<f64>,
    wrong: f64,
    seed: u64,
}

const CLEAN: Set = Set { boards: 40, repeats: 1, lens: |_| Vector2::zeros(), wrong: 0.0, seed: 1 };

fn problem(set: &Set) -> Problem {
    let mut scene = Scene::seed();
    scene.camera = camera();
    scene.poses = poses::random(set.boards, &scene.camera, &scene.board, set.seed).unwrap();
    let target = scene.board.target();
    let mut random = Pcg64::seed_from_u64(set.seed);
    let normal = Normal::new(0.0, NOISE_PX).unwrap();
    let observations = (0..set.boards * set.repeats).map(|frame| {
        let pose = scene.camera_from_board(frame / set.repeats).unwrap();
        let corners = (0..54).filter_map(|index| {
            let ideal = scene.camera.project(&pose.apply(&target.point_in_board(index)?))?;
            let mut px = ideal + (set.lens)(&ideal);
            px += Vector2::new(normal.sample(&mut random), normal.sample(&mut random));
            if random.random::<f64>() < set.wrong {
                px += Vector2::new(random.random_range(-3.0..3.0), random.random_range(-3.0..3.0));
            }
            Some(Corner { index, px, sigma_px: NOISE_PX })
        });
        Observation { camera: 0, frame: FrameId(frame as u32), corners: corners.collect() }
    });
    Problem {
        observations: observations.collect(),
        cameras: vec![CameraSetup { size_px: SIZE, model: Model::Brown5, start: None, focal_hint_px: None }],
        target,
        options: Options { multi_start: false, ..Options::default() },
    }
}

fn solve(set: &Set) -> (Calibration, Target) {
    let problem = problem(set);
    (calibrate(&problem, &mut |_| ControlFlow::Continue(())).unwrap(), problem.target)
}

/// RMS and largest distance of a lens from the truth where a field has support, px, once the turn of the camera that boards cannot
/// show is taken out.
fn off_the_truth(lens: &dyn Lens, field: &Field) -> [f64; 2] {
    let truth = camera();
    let places = (0..64 * 36).map(|k| Vector2::new(f64::from(k % 64) * 20.0, f64::from(k / 64) * 20.0));
    let seen: Vec<(Vector3<f64>, Vector2<f64>)> = places
        .filter(|px| field.supports(px))
        .map(|px| (truth.unproject(&px).unwrap(), px + bump(&px)))
        .collect();
    assert!(seen.len() > 1200, "{}", seen.len());
    let mut turn = Pose::identity();
    for _ in 0..3 {
        let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
        for (ray, px) in &seen {
            let turned = turn.rotation * ray;
            let by =
                (truth.spec().project)(&truth.params, &turned).unwrap().by_point * -turned.cross_matrix();
            normal += by.transpose() * by;
            right += by.transpose() * (px - lens.project_px(&turned).unwrap());
        }
        let step = normal.cholesky().unwrap().solve(&right);
        turn = Pose::from_rvec_tvec(step, Vector3::zeros()) * turn;
    }
    let errors: Vec<f64> =
        seen.iter().map(|(ray, px)| (px - lens.project_px(&(turn.rotation * ray)).unwrap()).norm()).collect();
    let rms = (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt();
    [rms, errors.into_iter().fold(0.0, f64::max)]
}

#[test]
fn a_displacement_that_no_model_holds_is_found_to_the_noise() {
    let (calibration, target) = solve(&Set { lens: bump, ..CLEAN });
    let map = residual_map(&calibration, &target).unwrap();
    let field = map.field.clone().unwrap();
    let corrected = Corrected { camera: calibration.camera.clone(), field };
    let (field, camera) = (&corrected.field, &corrected.camera);
    let [before, after] = [off_the_truth(camera, field), off_the_truth(&corrected, field)];
    let outliers: usize = calibration.views.iter().map(|v| v.outliers.len()).sum();
    println!(
        "{map}\n{:?}; off the truth {before:.4?}, with the field {after:.4?}; {outliers} outliers",
        map.held_out
    );
    assert!(map.worth_having && map.held_out.standard_errors > 5.0);
    // A held-out picture has its own pose: 6 of 108 numbers.
    let noise = NOISE_PX * 2f64.sqrt() * (1.0 - 6.0 / 108.0f64).sqrt();
    assert!(map.held_out.without_px > 1.2 * noise, "{:?}", map.held_out);
    assert!((map.held_out.with_px / noise - 1.0).abs() < 0.05, "{:?} {noise}", map.held_out);
    // The residuals say little about what all poses together can take up, so the middle is as good as the noise, not all.
    assert!(before[0] > 0.2 && after[0] < 0.35 * before[0], "{before:?} {after:?}");
    assert!(after[1] < 0.4 * before[1], "{after:?}");
    // The robust loss took the summit for wrong corners.
    assert!(outliers > 0);
}

#[test]
fn a_camera_that_fits_needs_none() {
    for seed in 1..=8 {
        for wrong in [0.0, 0.01] {
            let (calibration, target) = solve(&Set { seed, wrong, ..CLEAN });
            let map = residual_map(&calibration, &target).unwrap();
            println!("{seed}: {map}, {:.1} standard errors", map.held_out.standard_errors);
            assert!(!map.worth_having && map.field.is_none(), "{seed} {wrong}: {map:?}");
            // It costs nothing either: the smoothing that was chosen leaves the pictures as they are.
            assert!(map.held_out.with_px < 1.01 * map.held_out.without_px, "{map:?}");
        }
    }
}

#[test]
fn pictures_that_show_the_same_are_one() {
    let (calibration, target) = solve(&Set { boards: 5, repeats: 4, ..CLEAN });
    let few = residual_map(&calibration, &target).unwrap_err();
    assert_eq!(few, Error::TooFewViews { need: FEWEST_GROUPS, got: 5 });
    let (calibration, target) = solve(&Set { boards: 7, repeats: 3, ..CLEAN });
    let map = residual_map(&calibration, &target).unwrap();
    assert_eq!((map.held_out.groups, map.held_out.folds), (7, 6));
}

#[test]
fn beyond_the_data_it_is_zero() {
    let (mut calibration, target) = solve(&Set { lens: bump, ..CLEAN });
    // Boards in the right half only.
    let in_half = |v: &crate::solution::View| {
        (0..54).all(|i| {
            let point = v.camera_from_board.apply(&target.point_in_board(i).unwrap());
            calibration.camera.project(&point).unwrap().x > 500.0
        })
    };
    let views: Vec<_> = calibration.views.iter().filter(|v| in_half(v)).cloned().collect();
    calibration.views = views;
    let map = residual_map(&calibration, &target).unwrap();
    println!("{} views: {map}", calibration.views.len());
    let field = map.field.unwrap();
    assert!(!field.supports(&Vector2::new(100.0, 300.0)) && field.supports(&Vector2::new(800.0, 300.0)));
    assert!(map.supported_fraction < 0.65, "{}", map.supported_fraction);
    for y in 0..72 {
        for x in 0..13 {
            let at = field.at(&Vector2::new(f64::from(x) * 10.0, f64::from(y) * 10.0));
            assert!(at.norm() < 1e-9, "{x} {y}: {at}");
        }
    }
}

#[test]
fn straight_lines_come_back_straight() {
    let (calibration, target) = solve(&Set { lens: bump, ..CLEAN });
    let field = residual_map(&calibration, &target).unwrap().field.unwrap();
    let corrected = Corrected { camera: calibration.camera.clone(), field };
    // Lines of the scene as the true lens shows them, straightened by either.
    let truth = camera();
    let line = |y: f64| (0..60).map(move |i| Point3::new(-0.5 + f64::from(i) / 60.0, y, 1.0));
    let bend = |lens: &dyn Lens| -> f64 {
        let mut worst = 0.0f64;
        for y in [-0.15, -0.06, 0.03] {
            let points: Vec<Vector2<f64>> = line(y)
                .map(|p| {
                    let px = truth.project(&p).unwrap();
                    let ray = lens.unproject(&(px + bump(&px))).unwrap();
                    ray.xy() / ray.z * 1000.0
                })
                .collect();
            let [first, last] = [points[0], points[59]];
            let along = (last - first).normalize();
            let off = points.iter().map(|p| (p - first).perp(&along));
            let (low, high) = off.fold((0.0f64, 0.0f64), |(l, h), o| (l.min(o), h.max(o)));
            worst = worst.max(high - low);
        }
        worst
    };
    let [without, with] = [bend(&calibration.camera), bend(&corrected)];
    println!("lines bend by {without:.4} px without, {with:.4} px with the field");
    assert!(without > 0.15 && with < 0.3 * without);
    // What is projected comes back.
    for px in [[100.0, 90.0], [830.0, 290.0], [1200.0, 700.0]].map(Vector2::from) {
        let ray = corrected.unproject(&px).unwrap();
        assert!((corrected.project_px(&ray).unwrap() - px).norm() < 1e-9);
    }
}

#[test]
fn the_answer_survives_serialisation() {
    for lens in [CLEAN.lens, bump] {
        let (calibration, target) = solve(&Set { lens, ..CLEAN });
        let map = residual_map(&calibration, &target).unwrap();
        let text = serde_json::to_string(&map).unwrap();
        assert_eq!(serde_json::from_str::<ResidualMap>(&text).unwrap(), map);
    }
}
