//! Wrong corners, bad pictures, unequal corners, hard starts.

use super::{Scene, add_noise, plain, random_poses, run};
use nalgebra::Vector2;
use std::ops::ControlFlow;
use straightedge::calib::{
    Error,
    calibrate::{CameraSetup, Options, Precision, Weights, calibrate},
    camera::{Camera, Model},
    observation::FrameId,
    stats,
};

const PARAMS: [f64; 9] = [700.0, 702.0, 405.0, 295.0, -0.25, 0.1, 1e-3, -5e-4, -0.02];

fn scene(views: usize, seed: u64) -> Scene {
    Scene::new(Model::Brown5, [800, 600], &PARAMS, random_poses(views, 700.0, [800, 600], seed))
}

fn worst_in_sigma(got: &straightedge::calib::solution::Calibration, truth: &Camera) -> f64 {
    let all = stats::compare(got, truth).unwrap();
    all.iter().filter_map(|c| c.in_sigma).fold(0.0, f64::max)
}

#[test]
fn wrong_corners_are_listed_and_do_no_harm() {
    let scene = scene(12, 1);
    let mut problem = scene.problem(Options::default());
    add_noise(&mut problem, 0.1, 1);
    let wrong = [(0, 3), (0, 9), (4, 20), (7, 11), (11, 5)];
    for (view, corner) in wrong {
        problem.observations[view].corners[corner].px += Vector2::new(6.0, -4.0);
    }
    let got = run(&problem).unwrap();
    for (i, view) in got.views.iter().enumerate() {
        let listed: Vec<_> =
            wrong.iter().filter(|w| w.0 == i).map(|w| problem.observations[i].corners[w.1].index).collect();
        assert_eq!(view.outliers, listed, "view {i}");
    }
    assert!(worst_in_sigma(&got, &scene.camera) < 4.0);
    assert!(got.rms_inliers_px < 0.16 && got.rms_px > 0.4 && got.set_aside.is_empty());
    let pulled = run(&super::Problem { options: plain(), ..problem }).unwrap();
    // Least squares is pulled and blames more corners, but never overlooks a wrong one.
    for (view, corner) in wrong {
        let index = pulled.views[view].indices[corner];
        assert!(pulled.views[view].outliers.contains(&index), "{view} {index}");
    }
}

/// Also where the solver tries something that may fail: a rival start, a set without the picture that contradicts it.
#[test]
fn a_stop_is_never_a_result() {
    let scene = scene(10, 2);
    let mut problem = scene.problem(Options::default());
    problem.observations[3].corners.iter_mut().for_each(|c| c.px.x = 400.0 + 0.8 * (c.px.x - 400.0));
    let mut steps = 0;
    let whole = calibrate(&problem, &mut |_| {
        steps += 1;
        ControlFlow::Continue(())
    });
    assert!(whole.is_ok_and(|c| c.set_aside.len() == 1) && steps > 10);
    for stop in 1..=steps {
        let mut step = 0;
        let stopped = calibrate(&problem, &mut |_| {
            step += 1;
            if step == stop { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        assert_eq!(stopped.err(), Some(Error::Stopped), "step {stop} of {steps}");
    }
}

#[test]
fn a_bad_picture_is_set_aside_by_name() {
    let scene = scene(10, 2);
    let clean = scene.problem(Options::default());
    // From another zoom; with corners in disorder.
    let zoomed = Camera {
        params: vec![1000.0, 1000.0, 405.0, 295.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        ..scene.camera.clone()
    };
    let other = Scene { camera: zoomed, poses: scene.poses.clone() }.problem(Options::default());
    for options in [plain(), Options::default()] {
        let mut problem = clean.clone();
        problem.options = options;
        problem.observations[3] = other.observations[3].clone();
        let n = problem.observations[6].corners.len();
        let px: Vec<_> = problem.observations[6].corners.iter().map(|c| c.px).collect();
        for (i, corner) in problem.observations[6].corners.iter_mut().enumerate() {
            corner.px = px[(i * 7) % n];
        }
        add_noise(&mut problem, 0.1, 2);
        let got = run(&problem).unwrap();
        let mut names: Vec<_> = got.set_aside.iter().map(|s| s.0).collect();
        names.sort();
        assert_eq!(names, [FrameId(3), FrameId(6)], "{:?}", got.set_aside);
        assert!(worst_in_sigma(&got, &scene.camera) < 4.5);
    }
}

#[test]
fn a_hard_picture_is_kept() {
    for seed in 0..6 {
        let mut problem = scene(8, seed).problem(Options::default());
        add_noise(&mut problem, 0.05, seed);
        // Twenty times the noise of the others: blurred, but right.
        let mut blurred = problem.clone();
        add_noise(&mut blurred, 1.0, seed + 100);
        problem.observations[5] = blurred.observations[5].clone();
        for options in [plain(), Options::default()] {
            problem.options = options;
            let got = run(&problem).unwrap();
            assert!(got.set_aside.is_empty() && got.views.len() == 8, "{seed}: {:?}", got.set_aside);
        }
    }
}

#[test]
fn unequal_corners_are_weighted() {
    let scene = scene(12, 3);
    let mut errors = [0.0, 0.0];
    for seed in 0..40 {
        let mut problem = scene.problem(Options::default());
        let mut poor = problem.clone();
        add_noise(&mut problem, 0.03, seed);
        add_noise(&mut poor, 0.6, seed + 50);
        for view in (0..12).step_by(2) {
            problem.observations[view] = poor.observations[view].clone();
        }
        for (i, weights) in [Weights::Sigma, Weights::None].into_iter().enumerate() {
            problem.options.weights = weights;
            let got = run(&problem).unwrap();
            println!(
                "{weights} {:+.3} ± {:.3} {} iterations {:?}",
                got.camera.params[0] - 700.0,
                got.sigma[0].unwrap(),
                got.iterations.len(),
                got.views.iter().map(|v| (v.rms_px * 1000.0) as i32).collect::<Vec<_>>()
            );
            errors[i] += (got.camera.params[0] - PARAMS[0]).powi(2);
            if weights == Weights::Sigma {
                assert!(worst_in_sigma(&got, &scene.camera) < 4.5, "{seed}");
            }
        }
    }
    assert!(2.5 * errors[0] < errors[1], "{errors:?}");
}

#[test]
fn wide_angles_need_several_starts() {
    // Like a real set of AprilGrids: 752 x 480, near boards, strong barrel, poses that hide the focal length.
    let params = [465.0, 464.5, 367.0, 249.0, -0.29, 0.08, -2e-4, 4e-4, -0.01];
    for seed in 0..20 {
        let poses = random_poses(5, 465.0, [752, 480], 100 + seed);
        let scene = Scene::new(Model::Brown5, [752, 480], &params, poses);
        for options in [plain(), Options::default()] {
            let mut problem = scene.problem(options);
            add_noise(&mut problem, 0.1, seed);
            let got = run(&problem).unwrap();
            assert!(
                (got.camera.params[0] / 465.0 - 1.0).abs() < 0.02,
                "{seed}: {:?} {:?}",
                got.camera.params,
                got.starts
            );
            assert!(got.starts.tried >= 4 && got.starts.agreeing >= 1);
        }
    }
}

#[test]
fn starts_from_a_camera_and_from_a_hint() {
    let scene = scene(8, 4);
    let mut problem = scene.problem(plain());
    let setup =
        |start, focal_hint_px| vec![CameraSetup { start, focal_hint_px, ..problem.cameras[0].clone() }];
    let (given, hinted) = (setup(Some(scene.camera.clone()), None), setup(None, Some(690.0)));
    for (cameras, name) in [(given, "given"), (hinted, "EXIF")] {
        problem.cameras = cameras;
        let got = run(&problem).unwrap();
        assert!(got.starts.list.iter().any(|s| s.name == name), "{:?}", got.starts);
        assert!((got.camera.params[0] - PARAMS[0]).abs() < 1e-6);
        problem.options.multi_start = false;
        assert!((run(&problem).unwrap().camera.params[0] - PARAMS[0]).abs() < 1e-6);
        problem.options.multi_start = true;
    }
}

#[test]
fn ablations_run() {
    let mut problem = scene(10, 5).problem(plain());
    let exact = run(&problem).unwrap();
    problem.options = Options { normalise: false, ransac: false, ..plain() };
    let crude = run(&problem).unwrap();
    assert!((crude.camera.params[0] - PARAMS[0]).abs() < 1e-6, "the refinement forgets its start");
    problem.options = Options { precision: Precision::F32, ..plain() };
    let single = run(&problem).unwrap();
    let error = (single.camera.params[0] - PARAMS[0]).abs();
    assert!(error > 1e-7 && error < 1e-2 && exact.rms_px < 1e-9 && single.rms_px > 1e-6, "{error:e}");
}

#[test]
fn results_repeat_bit_for_bit() {
    let mut problem = scene(10, 6).problem(Options::default());
    add_noise(&mut problem, 0.1, 6);
    assert_eq!(run(&problem).unwrap(), run(&problem).unwrap());
}

#[test]
fn a_folding_model_is_named() {
    // Corners in the middle only, with noise: the polynomial is free to fold outside.
    let params = [700.0, 700.0, 400.0, 300.0, -0.4, 0.0, 0.0, 0.0, 0.0];
    let scene = Scene::new(Model::Brown5, [1600, 1200], &params, random_poses(10, 700.0, [800, 600], 7));
    let mut problem = scene.problem(plain());
    add_noise(&mut problem, 0.2, 7);
    let got = run(&problem).unwrap();
    assert!(got.warnings.iter().any(|w| w.code == "model_folds"), "{:?}", got.warnings);
}
