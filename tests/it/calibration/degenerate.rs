//! Sets that cannot determine a camera are refused with the reason; never a plausible number.

use super::{Scene, add_noise, board_at, plain, random_poses, run};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use std::ops::ControlFlow;
use straightedge::calib::{
    Error,
    calibrate::{Options, Problem, calibrate, parse_fixes},
    camera::Model,
    pose::Pose,
};

const PARAMS: [f64; 9] = [1000.0, 1000.0, 400.0, 300.0, -0.28, 0.1, 1e-3, 2e-3, 0.0];

fn scene(poses: Vec<Pose>) -> Scene {
    Scene::new(Model::Brown5, [800, 600], &PARAMS, poses)
}

/// Without noise and with several levels of it, for both losses.
fn assert_refused(poses: &[Pose], fix: &str, what: &str) {
    for noise in [0.0, 0.01, 0.1, 0.5] {
        for seed in 0..3 {
            for options in [plain(), Options::default()] {
                let fixed = parse_fixes(fix).unwrap();
                let mut problem = scene(poses.to_vec()).problem(Options { fixed, ..options });
                add_noise(&mut problem, noise, seed);
                match run(&problem) {
                    Err(Error::Degenerate(_) | Error::TooFewViews { .. } | Error::TooFewCorners { .. }) => {}
                    Err(e) => panic!("{what}: {e}"),
                    Ok(c) => panic!(
                        "{what}, noise {noise}, seed {seed}: {:?} ± {:?}, RMS {}",
                        c.camera.params, c.sigma, c.rms_px
                    ),
                }
            }
        }
    }
}

fn frontal(n: usize) -> Vec<Pose> {
    let n = n as f64;
    (0..n as usize)
        .map(|i| {
            let t = i as f64 / n;
            board_at(
                [60.0 * (7.0 * t).sin(), 40.0 * (9.0 * t).cos(), 500.0 + 300.0 * t],
                [0.0, 0.0, 160.0 * t],
            )
        })
        .collect()
}

#[test]
fn all_frontal() {
    assert_refused(&frontal(3), "", "3 frontal");
    assert_refused(&frontal(12), "", "12 frontal");
    assert_refused(&frontal(12), "fx=fy,cx,cy,k3", "12 frontal, fixed");
    let Err(Error::Degenerate(text)) = run(&scene(frontal(12)).problem(plain())) else { panic!() };
    assert!(text.contains("parallel") && text.contains("tilt"), "{text}");
}

#[test]
fn all_parallel_though_tilted() {
    let poses: Vec<Pose> = (0..8)
        .map(|i| {
            let t = f64::from(i) / 8.0;
            let roll = Pose::from_euler_deg([0.0, 0.0, 120.0 * t], Default::default());
            let mut pose = Pose::from_euler_deg([25.0, 15.0, 0.0], Default::default()) * roll;
            pose.translation = [100.0 * t - 90.0, 60.0 - 120.0 * t, 500.0 + 200.0 * t].into();
            pose
        })
        .collect();
    assert_refused(&poses, "", "parallel");
}

#[test]
fn one_view_and_its_copies() {
    let pose = board_at([0.0, 0.0, 600.0], [20.0, 25.0, 5.0]);
    assert_refused(&[pose], "", "one view");
    // Exact copies count once; a camera on a tripod gives noisy ones.
    assert_refused(&[pose; 6], "", "copies");
    let mut problem = scene(vec![pose; 6]).problem(plain());
    problem.observations.truncate(6);
    assert_eq!(run(&problem), Err(Error::TooFewViews { need: 2, got: 1 }));
}

#[test]
fn tilted_about_one_axis_by_little() {
    let poses: Vec<Pose> =
        (0..6).map(|i| board_at([0.0, 0.0, 600.0], [0.3 * f64::from(i), 0.0, 0.0])).collect();
    assert_refused(&poses, "", "hardly tilted");
}

/// Terms that stand for each other bend the valley, so that a refinement with the focal length held does not arrive: that it ends at a
/// larger cost excludes nothing.
#[test]
fn a_rich_model_of_hardly_tilted_boards_is_refused_or_sure() {
    let mut refused = 0;
    for seed in 0..12u64 {
        let mut random = Pcg64::seed_from_u64(seed);
        let mut draw = |a: f64| random.random_range(-a..a);
        let mut pose = || {
            let place = [draw(60.0), draw(40.0), 600.0 + draw(80.0)];
            board_at(place, [draw(2.0), draw(2.0), draw(90.0)])
        };
        let mut problem = scene((0..6).map(|_| pose()).collect()).problem(Options::default());
        problem.cameras[0].model = Model::Rational;
        add_noise(&mut problem, 0.3, seed);
        match run(&problem) {
            Err(Error::Degenerate(_)) => refused += 1,
            Err(e) => panic!("{seed}: {e}"),
            Ok(c) => {
                let share = c.sigma[0].unwrap() / c.camera.params[0];
                assert!(share < 0.1, "{seed}: {:?} ± {share}", c.camera.params);
            }
        }
    }
    assert!(refused > 6, "{refused}");
}

#[test]
fn too_little_to_work_on() {
    let good = scene(random_poses(6, 1000.0, [800, 600], 1)).problem(plain());
    let with = |change: &dyn Fn(&mut Problem)| {
        let mut problem = good.clone();
        change(&mut problem);
        run(&problem)
    };
    assert!(run(&good).is_ok());
    assert!(matches!(with(&|p| p.observations.clear()), Err(Error::TooFewViews { need: 2, got: 0 })));
    let few = with(&|p| p.observations.iter_mut().for_each(|o| o.corners.truncate(3)));
    assert!(matches!(few, Err(Error::Degenerate(_))), "{few:?}");
    // A row of corners each; four corners each are fewer than the unknowns.
    let rows = with(&|p| p.observations.iter_mut().for_each(|o| o.corners.retain(|c| c.index < 9)));
    assert!(matches!(rows, Err(Error::Degenerate(ref t)) if t.contains("line")), "{rows:?}");
    let four = with(&|p| {
        p.observations.iter_mut().for_each(|o| o.corners.retain(|c| [0, 8, 45, 53].contains(&c.index)));
        p.observations.truncate(3);
    });
    assert!(matches!(four, Err(Error::TooFewCorners { .. })), "{four:?}");
    assert!(matches!(with(&|p| p.cameras.clear()), Err(Error::Invalid(_))));
    assert!(matches!(with(&|p| p.cameras[0].size_px = [0, 600]), Err(Error::Invalid(_))));
    // What is wrong with one picture never costs the rest.
    let one_bad = with(&|p| {
        p.observations[0].corners[7].px.x = f64::NAN;
        p.observations[1].corners[7].index = 4000;
    })
    .unwrap();
    assert_eq!((one_bad.views.len(), one_bad.set_aside.len()), (4, 2));
    let all_at_one_point = with(&|p| {
        p.observations.iter_mut().flat_map(|o| &mut o.corners).for_each(|c| c.px.fill(5.0));
    });
    assert!(all_at_one_point.is_err());
}

#[test]
fn a_stopped_calibration_has_no_result() {
    let problem = scene(random_poses(6, 1000.0, [800, 600], 1)).problem(plain());
    for after in [0, 3, 12] {
        let mut asked = 0;
        let result = calibrate(&problem, &mut |share| {
            assert!((0.0..=1.0).contains(&share));
            asked += 1;
            if asked > after { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        assert_eq!(result, Err(Error::Stopped), "{after}");
    }
}
