//! Surveyed points, flat and not: exact data give the exact camera, noise what σ says, and what determines nothing is refused.

use nalgebra::{Point3, Vector2, Vector3};
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64;
use std::ops::ControlFlow;

use super::{CameraSetup, Loss, Options, Problem, Weights, calibrate, mirrored, pose_of};
use crate::{
    Error, Result,
    camera::{Camera, Model},
    observation::{Corner, FrameId, Observation},
    pose::Pose,
    solution::Calibration,
    target::{PointSet, Target},
};

const PINHOLE: [f64; 4] = [900.0, 910.0, 330.0, 250.0];
const BROWN: [f64; 9] = [620.0, 624.0, 330.0, 236.0, -0.25, 0.08, 1e-3, -5e-4, -0.01];
const KB4: [f64; 8] = [190.0, 190.5, 322.0, 238.0, 0.02, -0.006, 0.002, -4e-4];

fn camera(model: Model, params: &[f64]) -> Camera {
    Camera::new(model, [640, 480], params.to_vec()).unwrap()
}

fn points(list: impl IntoIterator<Item = Point3<f64>>) -> Target {
    let named = list.into_iter().enumerate().map(|(i, p)| (format!("p{i}"), p)).collect();
    Target::Points { points: PointSet::new(named).unwrap() }
}

/// Irregular points in a box of 300 x 220 and so deep.
fn cloud(n: usize, depth: f64, seed: u64) -> Vec<Point3<f64>> {
    let mut random = Pcg64::seed_from_u64(seed);
    let mut draw = |a: f64| random.random_range(-0.5 * a..0.5 * a);
    (0..n)
        .map(|_| Point3::new(draw(300.0), draw(220.0), if depth > 0.0 { draw(depth) } else { 0.0 }))
        .collect()
}

/// Views of a thing about the origin from so far.
fn views(n: usize, far: f64, seed: u64) -> Vec<Pose> {
    let mut random = Pcg64::seed_from_u64(seed);
    let mut draw = |a: f64| random.random_range(-a..a);
    (0..n)
        .map(|_| {
            let place = Vector3::new(draw(0.15 * far), draw(0.1 * far), far * (1.0 + draw(0.2)));
            Pose::from_euler_deg([draw(40.0), draw(40.0), draw(180.0)], place)
        })
        .collect()
}

/// Exact places of the points that are in the picture.
fn problem(camera: &Camera, target: Target, poses: &[Pose]) -> Problem {
    let [w, h] = camera.size_px.map(f64::from);
    let corner = |index: usize, p: &Point3<f64>, pose: &Pose| {
        let px = camera.project(&pose.apply(p))?;
        let inside = px.x > 0.0 && px.y > 0.0 && px.x < w - 1.0 && px.y < h - 1.0;
        inside.then_some(Corner { index: index as u32, px, sigma_px: 0.1 })
    };
    let seen = target.points_in_board();
    let observation = |(i, pose): (usize, &Pose)| Observation {
        camera: 0,
        frame: FrameId(i as u32),
        corners: seen.iter().enumerate().filter_map(|(k, p)| corner(k, p, pose)).collect(),
    };
    Problem {
        cameras: vec![CameraSetup {
            size_px: camera.size_px,
            model: camera.model,
            start: None,
            focal_hint_px: None,
        }],
        observations: poses.iter().enumerate().map(observation).collect(),
        target,
        options: Options { loss: Loss::Linear, weights: Weights::None, ..Options::default() },
    }
}

fn noisy(mut problem: Problem, sigma_px: f64, seed: u64) -> Problem {
    let mut random = Pcg64::seed_from_u64(seed);
    let normal = Normal::new(0.0, sigma_px).unwrap();
    for corner in problem.observations.iter_mut().flat_map(|o| &mut o.corners) {
        corner.px += Vector2::new(normal.sample(&mut random), normal.sample(&mut random));
    }
    problem
}

fn run(problem: &Problem) -> Result<Calibration> {
    calibrate(problem, &mut |_| ControlFlow::Continue(()))
}

fn assert_exact(truth: &Camera, problem: &Problem, poses: &[Pose], what: &str) {
    let got = run(problem).unwrap_or_else(|e| panic!("{what}: {e}"));
    assert!(got.set_aside.is_empty(), "{what}: {:?}", got.set_aside);
    for (a, b) in got.camera.params.iter().zip(&truth.params) {
        let off = (a - b).abs();
        assert!(off <= 1e-9 * b.abs().max(1.0), "{what}: {off:e} {:?} {:e}", got.camera.params, got.rms_px);
    }
    for (view, pose) in got.views.iter().zip(poses) {
        assert!((view.camera_from_board.matrix() - pose.matrix()).norm() < 1e-9, "{what}");
    }
}

#[test]
fn one_view_of_a_rig_gives_a_pinhole() {
    let truth = camera(Model::Pinhole, &PINHOLE);
    for seed in 0..6 {
        for (n, depth) in [(8, 150.0), (30, 80.0), (60, 300.0)] {
            let poses = views(1, 900.0, seed);
            let problem = problem(&truth, points(cloud(n, depth, seed)), &poses);
            assert_exact(&truth, &problem, &poses, &format!("{seed}: {n} points, {depth} deep"));
        }
    }
}

#[test]
fn several_views_give_every_lens() {
    for (model, params, far) in [(Model::Brown5, &BROWN[..], 420.0), (Model::Kb4, &KB4[..], 230.0)] {
        let truth = camera(model, params);
        for seed in 0..3 {
            let poses = views(6, far, seed);
            let mut problem = problem(&truth, points(cloud(60, 160.0, seed)), &poses);
            assert_exact(&truth, &problem, &poses, &format!("{model} {seed}"));
            problem.options = Options::default();
            assert_exact(&truth, &problem, &poses, &format!("{model} {seed}, defaults"));
        }
    }
}

#[test]
fn a_room_around_a_fisheye_is_enough() {
    let truth = camera(Model::Kb4, &KB4);
    // Points on all sides, beyond 90° too; one picture, and a frame far from its origin.
    let mut random = Pcg64::seed_from_u64(5);
    let mut draw = || random.random_range(-1.0..1.0);
    let shift = Vector3::new(4e5, -2e5, 1e3);
    let room: Vec<_> =
        (0..150).map(|_| Point3::new(2e3 * draw(), 2e3 * draw(), 900.0 * draw()) + shift).collect();
    let pose = Pose::from_euler_deg([12.0, -8.0, 30.0], Vector3::zeros());
    let pose = Pose { translation: -(pose.rotation * shift), ..pose };
    let problem = problem(&truth, points(room), &[pose]);
    assert!(problem.observations[0].corners.len() > 60);
    let got = run(&problem).unwrap();
    for (a, b) in got.camera.params.iter().zip(&truth.params) {
        assert!((a - b).abs() <= 1e-8 * b.abs().max(1.0), "{:?}", got.camera.params);
    }
}

#[test]
fn a_plane_anywhere_is_a_board() {
    let truth = camera(Model::Brown5, &BROWN);
    let poses = views(8, 420.0, 3);
    let board = Target::checkerboard("9x6".parse().unwrap(), 30.0);
    let turn = Pose::from_euler_deg([35.0, -50.0, 70.0], Vector3::new(1200.0, -300.0, 80.0));
    let turned = points(board.points_in_board().iter().map(|p| turn.apply(p)));
    assert!(!turned.is_solid());
    // The middle of the board to where the thing was.
    let center = Pose { translation: -board.center_in_board().coords, ..Pose::identity() };
    let on_board: Vec<Pose> = poses.iter().map(|p| *p * center).collect();
    let of_board = problem(&truth, board, &on_board);
    let same = Problem { target: turned, ..of_board.clone() };
    let (a, b) = (run(&of_board).unwrap(), run(&same).unwrap());
    for ((a, b), truth) in a.camera.params.iter().zip(&b.camera.params).zip(&truth.params) {
        assert!((a - b).abs() <= 1e-9 * a.abs().max(1.0) && (b - truth).abs() <= 1e-9 * b.abs().max(1.0));
    }
    for (a, b) in a.views.iter().zip(&b.views) {
        let moved = b.camera_from_board * turn;
        assert!((a.camera_from_board.matrix() - moved.matrix()).norm() < 1e-9);
        assert!((a.camera_from_board.translation - moved.translation).norm() < 1e-6);
        let (tilt, other) = (
            crate::stats::stance(&a.camera_from_board, &of_board.target),
            crate::stats::stance(&b.camera_from_board, &same.target),
        );
        assert!(
            (tilt.tilt_rad - other.tilt_rad).abs() < 1e-9 && (tilt.distance - other.distance).abs() < 20.0
        );
    }
}

#[test]
fn noise_does_what_sigma_says() {
    for (model, params, far, n) in [
        (Model::Pinhole, &PINHOLE[..], 900.0, 1),
        (Model::Brown5, &BROWN[..], 420.0, 6),
        (Model::Kb4, &KB4[..], 230.0, 6),
    ] {
        let truth = camera(model, params);
        let mut most = 0.0f64;
        for seed in 0..5 {
            let exact = problem(&truth, points(cloud(80, 200.0, seed)), &views(n, far, seed));
            let got = run(&noisy(exact, 0.3, 100 + seed)).unwrap();
            for ((a, b), sigma) in got.camera.params.iter().zip(&truth.params).zip(&got.sigma) {
                most = most.max((a - b).abs() / sigma.unwrap());
            }
        }
        println!("{model}: at most {most:.2} σ");
        assert!(most < 3.5, "{model}: {most} σ");
    }
}

/// A relief that hardly shows must never give a camera that is sure and wrong.
#[test]
fn nearly_flat_points_are_refused_or_right() {
    let truth = camera(Model::Pinhole, &PINHOLE);
    let (mut refused, mut right) = (0, 0);
    for seed in 0..8 {
        for depth in [0.0, 1e-3, 0.1, 1.0, 5.0, 15.0, 40.0] {
            for noise in [0.05, 0.3, 1.0] {
                let exact = problem(&truth, points(cloud(40, depth, seed)), &views(1, 900.0, seed));
                match run(&noisy(exact, noise, seed)) {
                    Err(Error::Degenerate(_)) => refused += 1,
                    Err(Error::TooFewViews { need: 2, got: 1 }) if depth < 0.2 => refused += 1,
                    Err(e) => panic!("{depth} deep, noise {noise}: {e}"),
                    Ok(got) => {
                        right += 1;
                        for ((a, b), sigma) in got.camera.params.iter().zip(&truth.params).zip(&got.sigma) {
                            let off = (a - b) / sigma.unwrap();
                            assert!(
                                off.abs() < 4.5,
                                "{depth} deep, noise {noise}: {off} σ, {:?}",
                                got.camera.params
                            );
                        }
                    }
                }
            }
        }
    }
    println!("{refused} refused, {right} right");
    assert!(refused > 40 && right > 20, "{refused} refused, {right} right");
}

#[test]
fn bad_sets_say_why() {
    let truth = camera(Model::Pinhole, &PINHOLE);
    let rig = cloud(30, 150.0, 1);
    let poses = views(4, 900.0, 1);
    let good = problem(&truth, points(rig.clone()), &poses);
    // A flat thing in one view.
    let flat = problem(&truth, points(cloud(30, 0.0, 1)), &poses[..1]);
    assert_eq!(run(&flat), Err(Error::TooFewViews { need: 2, got: 1 }));
    // Five points alone determine no camera.
    let mut few = good.clone();
    few.observations[2].corners.truncate(5);
    few.observations = vec![few.observations[2].clone()];
    assert!(matches!(run(&few), Err(Error::TooFewCorners { got: 5, .. })), "{:?}", run(&few));
    // A wrong name or two do not lead it astray.
    let mut swapped = good.clone();
    swapped.options = Options::default();
    let corners = &mut swapped.observations[0].corners;
    let other = corners[7].px;
    corners[7].px = corners[19].px;
    corners[19].px = other;
    let got = run(&swapped).unwrap();
    assert!((got.camera.params[0] - 900.0).abs() < 0.5, "{:?}", got.camera.params);
    // Shuffled names are no camera.
    let mut shuffled = good;
    for o in &mut shuffled.observations {
        let px: Vec<_> = o.corners.iter().map(|c| c.px).collect();
        let n = px.len();
        o.corners.iter_mut().enumerate().for_each(|(i, c)| c.px = px[(7 * i + 3) % n]);
    }
    let error = run(&shuffled).unwrap_err().to_string();
    assert!(
        error.contains("names right") || error.contains("target") || error.contains("determine"),
        "{error}"
    );
}

#[test]
fn mirrored_points_are_told() {
    for (model, params, far) in [
        (Model::Pinhole, &PINHOLE[..], 900.0),
        (Model::Brown5, &BROWN[..], 420.0),
        (Model::Kb4, &KB4[..], 230.0),
    ] {
        let truth = camera(model, params);
        let rig = cloud(40, 160.0, 2);
        let good = problem(&truth, points(rig.clone()), &views(5, far, 2));
        let wrong = noisy(Problem { target: points(rig.iter().map(mirrored::reflect)), ..good }, 0.2, 1);
        let error = run(&wrong).unwrap_err().to_string();
        assert!(error.contains("mirrored") && error.contains("sign"), "{model}: {error}");
        let error = pose_of(&truth, &wrong.target, &wrong.observations[0].corners).unwrap_err().to_string();
        assert!(error.contains("mirrored"), "{model}: {error}");
    }
}

#[test]
fn poses_of_points_in_space() {
    for (model, params, far) in [(Model::Brown5, &BROWN[..], 420.0), (Model::Kb4, &KB4[..], 230.0)] {
        let truth = camera(model, params);
        for (seed, depth) in [(1, 150.0), (2, 30.0), (3, 3.0), (4, 0.0)] {
            let turn = Pose::from_euler_deg([20.0, 60.0, 10.0], Vector3::new(30.0, 500.0, -70.0));
            let poses: Vec<Pose> = views(6, far, seed).into_iter().map(|p| p * turn.inverse()).collect();
            let target = points(cloud(40, depth, seed).iter().map(|p| turn.apply(p)));
            let problem = problem(&truth, target, &poses);
            for (o, pose) in problem.observations.iter().zip(&poses) {
                let (got, residuals) = pose_of(&truth, &problem.target, &o.corners).unwrap();
                assert!((got.matrix() - pose.matrix()).norm() < 1e-9, "{model} {depth}: {got:?} {pose:?}");
                assert!(residuals.iter().all(|r| r.norm() < 1e-8), "{model} {depth}");
            }
            if depth >= 30.0 {
                let (five, _) =
                    pose_of(&truth, &problem.target, &problem.observations[0].corners[..5]).unwrap();
                assert!((five.matrix() - poses[0].matrix()).norm() < 1e-8, "{model} {depth}: {five:?}");
            }
        }
    }
}

#[test]
fn pictures_of_few_points_are_used() {
    for (model, params, far) in [(Model::Brown5, &BROWN[..], 420.0), (Model::Kb4, &KB4[..], 230.0)] {
        let truth = camera(model, params);
        let poses = views(8, far, 4);
        let mut problem = problem(&truth, points(cloud(60, 160.0, 4)), &poses);
        problem.observations[1].corners.truncate(4);
        problem.observations[6].corners.truncate(5);
        assert_exact(&truth, &problem, &poses, &format!("{model}"));
    }
}

/// A third of the corners of two pictures are somewhere else.
#[test]
fn wrong_corners_do_not_cost_a_picture_of_a_fisheye() {
    let truth = camera(Model::Kb4, &KB4);
    let board = Target::checkerboard("9x6".parse().unwrap(), 30.0);
    let center = Pose { translation: -board.center_in_board().coords, ..Pose::identity() };
    for seed in 0..6 {
        let poses: Vec<Pose> = views(10, 170.0, seed).into_iter().map(|p| p * center).collect();
        let mut problem = noisy(problem(&truth, board.clone(), &poses), 0.1, seed);
        problem.options = Options::default();
        let mut random = Pcg64::seed_from_u64(seed);
        for view in [2, 7] {
            for corner in problem.observations[view].corners.iter_mut().step_by(3) {
                corner.px.x = random.random_range(100.0..540.0);
                corner.px.y = random.random_range(100.0..380.0);
            }
        }
        let got = run(&problem).unwrap();
        println!("{seed}: {:?} {:?}", got.set_aside, got.camera.params);
        assert!(got.set_aside.is_empty(), "{seed}: {:?}", got.set_aside);
        for ((a, b), sigma) in got.camera.params.iter().zip(&truth.params).zip(&got.sigma) {
            assert!((a - b).abs() < 4.5 * sigma.unwrap(), "{seed}: {:?}", got.camera.params);
        }
        for view in [2, 7] {
            let wrong = problem.observations[view].corners.len().div_ceil(3);
            assert!(got.views[view].outliers.len() + 3 >= wrong, "{seed}: {:?}", got.views[view].outliers);
        }
    }
}
