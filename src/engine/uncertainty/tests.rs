use nalgebra::{Matrix2, Point3, Vector2};
use rand::SeedableRng;
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64;
use std::ops::ControlFlow;

use super::*;
use crate::{
    calibrate::{CameraSetup, Loss, Options, Problem, calibrate, parse_fixes},
    camera::{Camera, Model},
    observation::{Corner, FrameId, Observation},
    pose::Pose,
    solution::View,
    synth::Scene,
};

/// Noise of the corners, px per coordinate.
const NOISE_PX: f64 = 0.05;

/// Views of the seed scene with noise.
pub(crate) fn problem(views: &[usize], options: Options, seed: u64) -> Problem {
    let scene = Scene::seed();
    let mut random = Pcg64::seed_from_u64(seed);
    let normal = Normal::new(0.0, NOISE_PX).unwrap();
    let mut noisy =
        |p: Vector2<f64>| p + Vector2::new(normal.sample(&mut random), normal.sample(&mut random));
    let observations = views.iter().map(|&view| Observation {
        camera: 0,
        frame: FrameId(view as u32),
        corners: (0..)
            .zip(scene.corners_px(view))
            .map(|(index, px)| Corner { index, px: noisy(px.unwrap()), sigma_px: NOISE_PX })
            .collect(),
    });
    Problem {
        observations: observations.collect(),
        cameras: vec![CameraSetup {
            size_px: scene.camera.size_px,
            model: Model::Brown5,
            start: None,
            focal_hint_px: None,
        }],
        target: scene.board.target(),
        options,
    }
}

fn solve(problem: &Problem) -> Calibration {
    calibrate(problem, &mut |_| ControlFlow::Continue(())).unwrap()
}

fn all() -> Vec<usize> {
    (0..15).collect()
}

fn options(loss: Loss, fixed: &str) -> Options {
    Options { loss, fixed: parse_fixes(fixed).unwrap(), multi_start: false, ..Options::default() }
}

/// Where a pixel goes: out along its ray by the true camera, into the true frames of the boards, back and in by the found ones.
fn through_the_boards(
    truth: (&Camera, &[Pose]),
    found: &Calibration,
    px: Vector2<f64>,
    range: f64,
) -> Vector2<f64> {
    let point = Point3::from(truth.0.unproject(&px).unwrap() * range);
    let back =
        |(view, pose): (&View, &Pose)| view.camera_from_board.apply(&pose.inverse().apply(&point)).coords;
    let mean = found.views.iter().zip(truth.1).map(back).sum::<Vector3<f64>>() / truth.1.len() as f64;
    found.camera.project(&mean.into()).unwrap()
}

#[test]
fn it_is_the_scatter_of_repeated_calibrations() {
    const SOLVES: usize = 300;
    let scene = Scene::seed();
    let poses: Vec<Pose> = all().into_iter().map(|v| scene.camera_from_board(v).unwrap()).collect();
    for (loss, fixed) in [(Loss::Huber, ""), (Loss::Linear, "fx=fy,k3")] {
        let found: Vec<Calibration> =
            (0..SOLVES).map(|s| solve(&problem(&all(), options(loss, fixed), s as u64))).collect();
        for distance in [600.0, 1500.0, 1e9] {
            for px in [[399.5, 299.5], [0.0, 0.0], [799.0, 300.0], [150.0, 420.0]].map(Vector2::from) {
                let mut scatter = Matrix2::zeros();
                let mut predicted = 0.0;
                for one in &found {
                    let d = through_the_boards((&scene.camera, &poses), one, px, distance) - px;
                    scatter += d * d.transpose() / SOLVES as f64;
                    let scatter = Scatter::new(one, &scene.board.target()).unwrap();
                    predicted += scatter.at(&one.camera, &px, Some(distance)).unwrap() / SOLVES as f64;
                }
                let measured = scatter.symmetric_eigenvalues().max().sqrt();
                println!("{loss} {fixed} {distance} {px:?}: {predicted:.4} px, scatter {measured:.4} px");
                // 300 solves know a standard deviation to 4 %; the larger of two eigenvalues is a little biased.
                assert!((0.88..1.14).contains(&(predicted / measured)));
            }
        }
    }
}

#[test]
fn fewer_views_are_less_sure() {
    let target = Scene::seed().board.target();
    let of = |views: &[usize]| {
        let mut got = solve(&problem(views, options(Loss::Linear, "k3"), 1));
        // For the same noise, not for the noise that each set seems to have.
        got.covariance *= (NOISE_PX / got.sigma0_px).powi(2);
        got.sigma0_px = NOISE_PX;
        of(&got, &target, Range::Boards)
    };
    let (many, few) = (of(&all()), of(&[0, 1, 2, 3, 5, 9]));
    assert_eq!((many.grid_px.len(), many.grid_px[0].len()), (15, 20));
    let cells = many.grid_px.iter().flatten().zip(few.grid_px.iter().flatten());
    let grown = cells.filter(|(a, b)| a.unwrap() < b.unwrap()).count();
    println!(
        "{grown} of 300 cells; {:?} {:?}",
        (many.center_px, many.worst_corner_px),
        (few.center_px, few.worst_corner_px)
    );
    assert!(grown > 280);
    assert!(many.center_px < few.center_px && many.worst_corner_px < few.worst_corner_px);
    assert!(many.center_px < many.worst_corner_px && (many.range.unwrap() - 600.0).abs() < 20.0);
    // The corners of the picture bound the cells.
    assert!(many.grid_px.iter().flatten().all(|v| v.unwrap() <= many.worst_corner_px.unwrap()));
}

#[test]
fn a_held_camera_is_sure() {
    let mut held = problem(&all(), options(Loss::Linear, "fx,fy,cx,cy,k1,k2,p1,p2,k3"), 1);
    held.cameras[0].start = Some(Scene::seed().camera);
    let sure = of(&solve(&held), &held.target, Range::Infinity);
    assert_eq!((sure.range, sure.center_px, sure.worst_corner_px), (None, Some(0.0), Some(0.0)));
    assert!(sure.grid_px.iter().flatten().all(|v| *v == Some(0.0)));
}

#[test]
fn there_is_no_answer_beyond_the_fold_nor_without_views() {
    let mut got = solve(&problem(&all(), options(Loss::Linear, ""), 1));
    let target = Scene::seed().board.target();
    let text = serde_json::to_string(&of(&got, &target, Range::Boards)).unwrap();
    assert_eq!(serde_json::from_str::<Uncertainty>(&text).unwrap(), of(&got, &target, Range::Boards));
    let whole = of(&got, &target, Range::Boards);
    // Folds at 330 px from the centre, beyond the boards.
    got.camera.params[4..].copy_from_slice(&[-3.0, 0.0, 0.0, 0.0, 0.0]);
    let folded = of(&got, &target, Range::Boards);
    assert_eq!((folded.worst_corner_px, folded.grid_px[0][0]), (None, None));
    assert!(folded.center_px.is_some() && whole.grid_px[0][0].is_some());
    assert!([0.0, -1.0, f64::NAN].iter().all(|r| of(&got, &target, Range::At(*r)).center_px.is_none()));
    got.views.clear();
    let none = of(&got, &target, Range::Infinity);
    assert!(none.center_px.is_none() && none.grid_px.iter().flatten().all(Option::is_none));
}
