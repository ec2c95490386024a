//! Exact corners give the exact camera.

use super::{Scene, plain, random_poses, run};
use straightedge::calib::{
    calibrate::{Options, parse_fixes, pose_of},
    camera::Model,
    pose::Pose,
    synth,
};

fn assert_exact(scene: &Scene, options: Options, what: &str) {
    let got = run(&scene.problem(options)).unwrap_or_else(|e| panic!("{what}: {e}"));
    assert!(got.termination.converged(), "{what}: {:?}", got.termination);
    assert!(got.set_aside.is_empty(), "{what}: {:?}", got.set_aside);
    for (i, truth) in scene.camera.params.iter().enumerate() {
        let error = (got.camera.params[i] - truth).abs();
        assert!(
            error <= 1e-9 * truth.abs().max(1.0),
            "{what}: {} off by {error:e}, RMS {:e}, {:?}, {} iterations",
            scene.camera.spec().params[i].name,
            got.rms_px,
            got.termination,
            got.iterations.len()
        );
    }
}

#[test]
fn the_seed_scene() {
    let seed = synth::Scene::seed();
    let poses: Vec<Pose> = (0..15).map(|i| seed.camera_from_board(i).unwrap()).collect();
    let scene = Scene::new(seed.camera.model, seed.camera.size_px, &seed.camera.params, poses);
    for options in [plain(), Options::default()] {
        assert_exact(&scene, options, "seed");
    }
}

#[test]
fn lenses_of_many_kinds() {
    let lenses: [(&str, [u32; 2], &[f64]); 7] = [
        ("webcam", [640, 480], &[533.0, 533.2, 342.3, 234.0, -0.2854, 0.064, 1.1e-3, -1.3e-4, 0.0]),
        ("wide", [1280, 720], &[640.0, 641.0, 650.0, 352.0, -0.3, 0.12, 5e-4, -2e-4, -0.02]),
        ("very wide", [752, 480], &[465.0, 464.0, 367.0, 249.0, -0.29, 0.08, -2e-4, 4e-4, -0.01]),
        ("phone", [4032, 3024], &[3100.0, 3102.0, 2010.0, 1500.0, 0.12, -0.31, 1e-3, 2e-3, 0.2]),
        ("tele", [1920, 1080], &[6200.0, 6210.0, 950.0, 545.0, -0.1, 0.8, 1e-4, 2e-4, 0.0]),
        ("anamorphic", [800, 600], &[900.0, 600.0, 380.0, 310.0, -0.1, 0.05, 0.0, 0.0, 0.0]),
        ("off centre", [800, 600], &[800.0, 800.0, 520.0, 180.0, -0.1, 0.05, 1e-3, 0.0, 0.0]),
    ];
    for (name, size, params) in lenses {
        for seed in 0..4 {
            let poses = random_poses(12, params[0], size, seed);
            let scene = Scene::new(Model::Brown5, size, params, poses);
            assert_exact(&scene, plain(), &format!("{name} {seed}"));
            assert_exact(&scene, Options::default(), &format!("{name} {seed} defaults"));
        }
    }
    for seed in 0..4 {
        let params = [900.0, 910.0, 330.0, 250.0];
        let scene = Scene::new(Model::Pinhole, [640, 480], &params, random_poses(4, 900.0, [640, 480], seed));
        assert_exact(&scene, plain(), &format!("pinhole {seed}"));
    }
}

#[test]
fn a_skew_is_recovered() {
    for skew in [0.0, 4.0, -15.0] {
        let params = [900.0, 880.0, 410.0, 290.0, -0.2, 0.1, 1e-3, -5e-4, 0.02, skew];
        let scene =
            Scene::new(Model::Brown5Skew, [800, 600], &params, random_poses(10, 900.0, [800, 600], 4));
        assert_exact(&scene, plain(), &format!("skew {skew}"));
        assert_exact(&scene, Options::default(), &format!("skew {skew}, defaults"));
        let fixed = parse_fixes("skew=0").unwrap();
        let held = run(&scene.problem(Options { fixed, ..plain() })).unwrap();
        assert_eq!(held.rms_px < 1e-6, skew == 0.0, "{} without skew {skew}", held.rms_px);
    }
}

#[test]
fn constraints_that_hold_in_truth_change_nothing() {
    let params = [700.0, 700.0, 399.5, 299.5, -0.2, 0.1, 0.0, 0.0, 0.0];
    let scene = Scene::new(Model::Brown5, [800, 600], &params, random_poses(8, 700.0, [800, 600], 5));
    for fix in
        ["fx=fy", "cx,cy", "k3", "p1,p2", "fx=fy,cx,cy,k3,p1,p2", "fx=700", "fx=fy,fy=700", "k1=-0.2,k2=0.1"]
    {
        let options = Options { fixed: parse_fixes(fix).unwrap(), ..plain() };
        assert_exact(&scene, options.clone(), fix);
        let got = run(&scene.problem(options)).unwrap();
        assert_eq!(got.free.len(), got.covariance.nrows());
        assert_eq!(got.sigma[8].is_none(), fix.contains("k3"), "{fix}");
    }
}

#[test]
fn one_view_suffices_where_the_rest_is_fixed() {
    let params = [700.0, 700.0, 399.5, 299.5, -0.2, 0.0, 0.0, 0.0, 0.0];
    let poses = vec![super::board_at([20.0, 10.0, 300.0], [35.0, -20.0, 10.0])];
    let scene = Scene::new(Model::Brown5, [800, 600], &params, poses);
    let fixed = parse_fixes("fx=fy,cx,cy,k2,p1,p2,k3").unwrap();
    assert_exact(&scene, Options { fixed, ..plain() }, "one view");
}

#[test]
fn poses_of_a_known_camera() {
    let params = [465.0, 464.0, 367.0, 249.0, -0.29, 0.08, -2e-4, 4e-4, -0.01];
    let scene = Scene::new(Model::Brown5, [752, 480], &params, random_poses(40, 465.0, [752, 480], 3));
    let problem = scene.problem(plain());
    for (observation, truth) in problem.observations.iter().zip(&scene.poses) {
        let (pose, residuals) = pose_of(&scene.camera, &problem.target, &observation.corners).unwrap();
        assert!((pose.matrix() - truth.matrix()).norm() < 1e-10, "{pose:?} {truth:?}");
        assert!((pose.translation - truth.translation).norm() < 1e-7);
        assert!(residuals.len() == observation.corners.len() && residuals.iter().all(|r| r.norm() < 1e-9));
    }
    let corners = &problem.observations[0].corners;
    assert!(pose_of(&scene.camera, &problem.target, &corners[..3]).is_err());
    assert!(pose_of(&scene.camera, &problem.target, &corners[..5]).is_err(), "a row is a line");
}
