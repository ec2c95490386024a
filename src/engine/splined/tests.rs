use std::{f64::consts::PI, ops::ControlFlow};

use nalgebra::{Matrix3, Point3, Rotation3, Unit};
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64;

use super::*;
use crate::{
    calibrate::{CameraSetup, Options, Problem, splined},
    camera::{Camera, Model},
    observation::{Corner, FrameId, Observation},
    pose::Pose,
    solution::{Calibration, ClosedForm, Starts, Termination, View},
    target::Target,
};

const NOISE_PX: f64 = 0.05;
const GO_ON: fn() -> ControlFlow<()> = || ControlFlow::Continue(());

/// A grid with smooth surfaces that nothing else would make.
fn wavy(layout: Layout, size_px: [u32; 2], core: [f64; 4]) -> Splined {
    let [columns, rows] = layout.knots;
    let surface = (0..columns * rows).map(|k| {
        let (x, y) = ((k % columns) as f64, (k / columns) as f64);
        [0.02 * (0.9 * x + 0.3 * y).sin(), 0.02 * (0.5 * x - 0.8 * y).cos()]
    });
    Splined::new(size_px, layout, core, surface.collect()).unwrap()
}

fn examples() -> Vec<Splined> {
    let layout = |columns, rows, fov_x_deg| Layout { knots: [columns, rows], fov_x_deg };
    vec![
        wavy(layout(10, 8, 60), [640, 480], [650.0, 652.0, 320.0, 240.0]),
        wavy(layout(16, 12, 120), [640, 480], [310.0, 308.0, 315.0, 242.0]),
        wavy(layout(30, 20, 200), [1280, 960], [335.0, 336.0, 640.0, 480.0]),
    ]
}

fn rays(camera: &Splined) -> Vec<Vector3<f64>> {
    let [w, h] = camera.size_px.map(f64::from);
    let pixels = (0..11 * 9).map(|k| Vector2::new(w * f64::from(k % 11) / 10.0, h * f64::from(k / 11) / 8.0));
    let rays: Vec<_> = pixels.filter_map(|px| camera.unproject(&px)).collect();
    assert!(rays.len() > 50, "{} rays", rays.len());
    rays
}

#[test]
fn jacobians_agree_with_central_differences() {
    for camera in examples() {
        for ray in rays(&camera) {
            let point = ray * 3.7;
            let p = camera.project(&point).unwrap();
            assert!((p.px - camera.project_px(&point).unwrap()).norm() < 1e-12 * p.px.norm());
            let h = 1e-6;
            for k in 0..3 {
                let at = |h: f64| {
                    let mut q = point;
                    q[k] += h;
                    camera.project_px(&q).unwrap()
                };
                let d = (at(h) - at(-h)) / (2.0 * h);
                let error = (d - p.by_point.column(k)).norm();
                assert!(error < 1e-6 * (1.0 + d.norm()), "d{k}: {error:e}");
            }
            for part in p.patch.parts() {
                for k in 0..2 {
                    let at = |h: f64| {
                        let mut moved = camera.clone();
                        moved.surface[part.at][k] += h;
                        moved.project_px(&point).unwrap()
                    };
                    let d = (at(h) - at(-h)) / (2.0 * h);
                    let mut own = Vector2::zeros();
                    own[k] = camera.core[k] * part.weight;
                    assert!((d - own).norm() < 1e-6, "{d} {own}");
                }
            }
        }
    }
}

#[test]
fn unproject_inverts_project() {
    for camera in examples() {
        for ray in rays(&camera) {
            let px = camera.project_px(&(ray * 2.0)).unwrap();
            let back = camera.unproject(&px).unwrap();
            assert!((back - ray).norm() < 1e-12, "{:e}", (back - ray).norm());
            assert!(camera.supports(&ray) && camera.expansion(&ray).unwrap() > 0.0);
        }
        assert!(!camera.folds());
        assert!(camera.project(&-Vector3::z()).is_none() && camera.project(&Vector3::zeros()).is_none());
        // Far beyond the grid there is no ray.
        assert!(camera.unproject(&Vector2::new(1e5, 0.0)).is_none());
    }
}

#[test]
fn a_surface_that_folds_is_told_and_has_no_ray_there() {
    let mut camera = examples().remove(0);
    camera.surface[3 * 10 + 4] = [0.5, 0.0];
    assert!(camera.folds());
    let row: Vec<_> = (0..640).map(|x| camera.unproject(&Vector2::new(f64::from(x), 180.0))).collect();
    for (x, ray) in row.iter().enumerate() {
        if let Some(ray) = ray {
            assert!((camera.project_px(ray).unwrap() - Vector2::new(x as f64, 180.0)).norm() < 1e-6);
            assert!(camera.expansion(ray).unwrap() > 0.0);
        }
    }
}

#[test]
fn wrong_numbers_are_refused() {
    let (layout, core) = (Layout { knots: [4, 4], fov_x_deg: 60 }, [500.0, 500.0, 320.0, 240.0]);
    let new = |layout, core, n| Splined::new([640, 480], layout, core, vec![[0.0; 2]; n]);
    assert!(new(layout, core, 16).is_ok());
    assert!(new(layout, core, 15).is_err());
    assert!(new(layout, [0.0, 500.0, 320.0, 240.0], 16).is_err());
    assert!(new(layout, [f64::NAN, 500.0, 320.0, 240.0], 16).is_err());
    assert!(new(Layout { knots: [3, 4], ..layout }, core, 12).is_err());
    assert!(new(Layout { knots: [usize::MAX, 4], ..layout }, core, 16).is_err());
    assert!(new(Layout { fov_x_deg: 360, ..layout }, core, 16).is_err());
    assert!(Splined::new([0, 480], layout, core, vec![[0.0; 2]; 16]).is_err());
}

fn brown(f: f64, size_px: [u32; 2]) -> Camera {
    let [w, h] = size_px.map(f64::from);
    let params = vec![f, f * 1.001, 0.5 * w + 3.0, 0.5 * h - 4.0, -0.12, 0.02, 5e-4, -4e-4, 0.0];
    Camera::new(Model::Brown5, size_px, params).unwrap()
}

fn fisheye(f: f64, size_px: [u32; 2]) -> Camera {
    let [w, h] = size_px.map(f64::from);
    let params = vec![f, f * 1.001, 0.5 * w + 3.0, 0.5 * h - 4.0, 0.01, -0.002, 2e-4, 0.0];
    Camera::new(Model::Kb4, size_px, params).unwrap()
}

/// Lenses of 40°, 65°, 95° (perspective), 120°, 160° and 200° of horizontal field of view.
fn lenses() -> Vec<Camera> {
    let size = [1280, 960];
    vec![
        brown(1750.0, size),
        brown(990.0, size),
        brown(560.0, size),
        fisheye(600.0, size),
        fisheye(450.0, size),
        fisheye(365.0, size),
    ]
}

/// What no closed-form model holds: a bump and a ripple, px.
fn beyond(px: &Vector2<f64>) -> Vector2<f64> {
    let bump = (-(px - Vector2::new(800.0, 380.0)).norm_squared() / (2.0 * 130.0 * 130.0)).exp();
    Vector2::new(0.5 * bump + 0.15 * (px.y / 110.0).sin(), 0.15 * (px.x / 130.0).cos() - 0.3 * bump)
}

/// What the lens adds to its camera, px.
type Beyond = fn(&Vector2<f64>) -> Vector2<f64>;

/// Boards all over what the lens sees, as the solution of a calibration with its own camera; poses a little off.
fn seen_by(truth: &Camera, beyond: Beyond, boards: usize, noise_px: f64, seed: u64) -> (Calibration, Target) {
    let target = Target::checkerboard("9x7".parse().unwrap(), 1.0);
    let mut random = Pcg64::seed_from_u64(seed);
    let normal = Normal::new(0.0, 1.0).unwrap();
    let [w, h] = truth.size_px.map(f64::from);
    let mut views = Vec::new();
    while views.len() < boards {
        let at = Vector2::new(random.random_range(0.0..w), random.random_range(0.0..h));
        let Some(ray) = truth.unproject(&at) else { continue };
        // Facing the camera, tilted by up to 40° about any axis, turned by any angle.
        let facing = Rotation3::rotation_between(&Vector3::z(), &ray)
            .unwrap_or_else(|| Rotation3::from_axis_angle(&Vector3::x_axis(), PI));
        let axis = Unit::new_normalize(Vector3::new(
            random.random_range(-1.0..1.0),
            random.random_range(-1.0..1.0),
            0.01,
        ));
        let tilt = Rotation3::from_axis_angle(&axis, random.random_range(-0.7..0.7));
        let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), random.random_range(-PI..PI));
        let rotation = facing * tilt * turn;
        // The board is 0.35 to 0.55 of the picture's width wide in the middle.
        let distance = 8.0 * truth.params[0] / (w * random.random_range(0.35..0.55));
        let pose = Pose { rotation, translation: ray * distance - rotation * Vector3::new(4.0, 3.0, 0.0) };
        let off = Pose::from_rvec_tvec(
            Vector3::from_fn(|_, _| 3e-4 * normal.sample(&mut random)),
            Vector3::from_fn(|_, _| 2e-3 * normal.sample(&mut random)),
        );
        let found = off * pose;
        let (mut indices, mut residuals_px) = (Vec::new(), Vec::new());
        for index in 0..63 {
            let point = target.point_in_board(index).unwrap();
            let (Some(ideal), Some(there)) =
                (truth.project(&pose.apply(&point)), truth.project(&found.apply(&point)))
            else {
                continue;
            };
            // A fisheye's corner pixels see nothing.
            if !(ideal.x > 0.0 && ideal.y > 0.0 && ideal.x < w - 1.0 && ideal.y < h - 1.0) {
                continue;
            }
            let noise = Vector2::from_fn(|_, _| noise_px * normal.sample(&mut random));
            indices.push(index);
            residuals_px.push(ideal + beyond(&ideal) + noise - there);
        }
        if indices.len() < 24 {
            continue;
        }
        views.push(View {
            frame: FrameId(views.len() as u32),
            camera_from_board: found,
            weights: vec![1.0; indices.len()],
            outliers: Vec::new(),
            rms_px: 0.0,
            indices,
            residuals_px,
        });
    }
    let calibration = Calibration {
        camera: truth.clone(),
        views,
        sigma: Vec::new(),
        covariance: nalgebra::DMatrix::zeros(0, 0),
        free: Vec::new(),
        tied_to: Vec::new(),
        rms_px: 0.0,
        rms_inliers_px: 0.0,
        sigma0_px: 1.0,
        termination: Termination::CostConverged,
        iterations: Vec::new(),
        starts: Starts { tried: 1, agreeing: 1, list: Vec::new() },
        closed_form: ClosedForm { camera: None, rms_px: None },
        set_aside: Vec::new(),
        warnings: Vec::new(),
    };
    (calibration, target)
}

/// RMS distance from the true lens over supported pixels, px, without the turn of the camera that boards cannot show.
fn off_the_truth(lens: &Splined, truth: &Camera, beyond: Beyond) -> f64 {
    let [w, h] = truth.size_px.map(f64::from);
    let places = (0..32 * 24)
        .map(|k| Vector2::new(w * (f64::from(k % 32) + 0.5) / 32.0, h * (f64::from(k / 32) + 0.5) / 24.0));
    let seen: Vec<(Vector3<f64>, Vector2<f64>)> = places
        .filter_map(|px| Some((truth.unproject(&px)?, px + beyond(&px))))
        .filter(|(ray, _)| lens.supports(ray))
        .collect();
    assert!(seen.len() > 300, "{}", seen.len());
    let mut turn = Rotation3::identity();
    for _ in 0..4 {
        let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
        for (ray, px) in &seen {
            let turned = turn * ray;
            let p = lens.project(&turned).unwrap();
            let by = p.by_point * -turned.cross_matrix();
            normal += by.transpose() * by;
            right += by.transpose() * (px - p.px);
        }
        turn = Rotation3::from_scaled_axis(normal.cholesky().unwrap().solve(&right)) * turn;
    }
    let sum: f64 =
        seen.iter().map(|(ray, px)| (px - lens.project_px(&(turn * ray)).unwrap()).norm_squared()).sum();
    (sum / seen.len() as f64).sqrt()
}

#[test]
fn it_follows_a_camera_over_its_picture() {
    for camera in lenses() {
        let layout = Layout::covering(&camera, 30).unwrap();
        let splined = Splined::following(&camera, layout).unwrap();
        let mut worst = 0.0f64;
        for k in 0..40 * 30 {
            let px = Vector2::new(f64::from(k % 40) * 32.8, f64::from(k / 40) * 33.0);
            // The corners of a fisheye's picture see next to nothing.
            let Some(ray) = camera.unproject(&px).filter(|r| r.z > -0.5) else { continue };
            worst = worst.max((splined.project_px(&ray).unwrap() - px).norm());
        }
        println!("{}: {layout:?}, largest error {worst:.2e} px", camera.model);
        assert!(worst < 0.03 && !splined.folds(), "{worst:e}");
    }
}

#[test]
fn lenses_that_no_model_holds_are_fitted_to_the_noise() {
    for truth in lenses() {
        let (calibration, target) = seen_by(&truth, beyond, 60, NOISE_PX, 3);
        let layout = Layout::covering(&truth, 24).unwrap();
        let fitted = fit(&calibration, &target, layout, &mut GO_ON.clone()).unwrap();
        let before = off_the_truth(
            &Splined::following(&truth, layout)
                .map(|mut c| {
                    c.known.clone_from(&fitted.camera.known);
                    c
                })
                .unwrap(),
            &truth,
            beyond,
        );
        let after = off_the_truth(&fitted.camera, &truth, beyond);
        let corners: usize = calibration.views.iter().map(|v| v.indices.len()).sum();
        println!(
            "{} {layout:?}: {corners} corners, {} steps to {:.4} px; off the truth {before:.4}, fitted {after:.4} px; {:.0} % known",
            truth.model,
            fitted.steps,
            fitted.rms_px,
            100.0 * fitted.camera.supported_fraction()
        );
        assert!(fitted.converged && !fitted.camera.folds());
        assert!(fitted.rms_px < NOISE_PX * 2f64.sqrt(), "{}", fitted.rms_px);
        // A narrow view leaves more than a turn of the camera to the poses, so there only the residuals tell.
        let bound = if layout.fov_x_deg > 90 { (0.25 * before).min(0.8 * NOISE_PX) } else { 0.9 * before };
        assert!(after < bound, "{after} {before}");
        assert!(fitted.camera.supported_fraction() > 0.6);
    }
}

#[test]
fn exact_corners_of_a_splined_lens_give_it_back() {
    // The lens itself is a splined one, so nothing but rounding and the weak pull may be left.
    let truth = brown(990.0, [1280, 960]);
    let (calibration, target) = seen_by(&truth, |_| Vector2::zeros(), 60, 0.0, 5);
    let layout = Layout::covering(&truth, 20).unwrap();
    let fitted = fit(&calibration, &target, layout, &mut GO_ON.clone()).unwrap();
    let off = off_the_truth(&fitted.camera, &truth, |_| Vector2::zeros());
    println!("rms {:.1e} px, off the truth {off:.1e} px", fitted.rms_px);
    assert!(fitted.rms_px < 2e-3 && off < 2e-3);
    for (pose, view) in fitted.poses.iter().zip(&calibration.views) {
        assert!((pose.translation - view.camera_from_board.translation).norm() > 1e-6);
    }
}

#[test]
fn wrong_corners_do_not_bend_it_and_rays_without_data_are_told() {
    let truth = fisheye(450.0, [1280, 960]);
    let (mut calibration, target) = seen_by(&truth, beyond, 60, NOISE_PX, 7);
    // Boards in the right two thirds only, one corner in fifty 4 px off.
    for view in &mut calibration.views {
        let right: Vec<bool> = view
            .indices
            .iter()
            .map(|i| {
                let point: Point3<f64> = target.point_in_board(*i).unwrap();
                truth.project(&view.camera_from_board.apply(&point)).unwrap().x > 420.0
            })
            .collect();
        let keep = |k: &usize| right[*k];
        let kept: Vec<usize> = (0..right.len()).filter(keep).collect();
        view.indices = kept.iter().map(|k| view.indices[*k]).collect();
        view.residuals_px = kept.iter().map(|k| view.residuals_px[*k]).collect();
        view.weights = vec![1.0; kept.len()];
    }
    calibration.views.retain(|v| v.indices.len() >= 24);
    for (n, r) in calibration.views.iter_mut().flat_map(|v| &mut v.residuals_px).enumerate() {
        if n % 50 == 17 {
            *r += Vector2::new(4.0, -3.0);
        }
    }
    let layout = Layout::covering(&truth, 24).unwrap();
    let fitted = fit(&calibration, &target, layout, &mut GO_ON.clone()).unwrap();
    let off = off_the_truth(&fitted.camera, &truth, beyond);
    println!("{} views, {off:.4} px off the truth", calibration.views.len());
    assert!(off < 1.2 * NOISE_PX);
    let ray = |x: f64, y: f64| truth.unproject(&Vector2::new(x, y)).unwrap();
    assert!(fitted.camera.supports(&ray(800.0, 480.0)) && !fitted.camera.supports(&ray(200.0, 480.0)));
    assert!(!fitted.camera.supports(&-Vector3::z()));
    // A guess is still no nonsense: it stays with the camera that it came from.
    let there = fitted.camera.project_px(&ray(200.0, 480.0)).unwrap();
    assert!((there - Vector2::new(200.0, 480.0)).norm() < 3.0, "{there}");
}

#[test]
fn it_is_worth_having_where_the_model_leaves_something() {
    for (bend, worth_having) in
        [(beyond as fn(&Vector2<f64>) -> Vector2<f64>, true), (|_| Vector2::zeros(), false)]
    {
        let truth = brown(990.0, [1280, 960]);
        let (calibration, target) = seen_by(&truth, bend, 30, NOISE_PX, 3);
        let seen = |view: &View| {
            let corner = |(index, residual): (&u32, &Vector2<f64>)| {
                let point = target.point_in_board(*index)?;
                let px = truth.project(&view.camera_from_board.apply(&point))? + residual;
                Some(Corner { index: *index, px, sigma_px: NOISE_PX })
            };
            let corners = view.indices.iter().zip(&view.residuals_px).filter_map(corner).collect();
            Observation { camera: 0, frame: view.frame, corners }
        };
        let setup =
            CameraSetup { size_px: truth.size_px, model: Model::Brown5, start: None, focal_hint_px: None };
        let problem = Problem {
            cameras: vec![setup],
            observations: calibration.views.iter().map(seen).collect(),
            target: target.clone(),
            options: Options::default(),
        };
        let judged = splined(&problem, Model::Brown5, 12, &mut |_| ControlFlow::Continue(())).unwrap();
        println!("{judged:?}");
        assert_eq!(judged.worth_having, worth_having, "{}", judged.words());
        assert_eq!(judged.words().ends_with("not worth having"), !worth_having);
    }
}

#[test]
fn it_can_be_stopped_and_says_what_it_lacks() {
    let truth = brown(990.0, [1280, 960]);
    let (mut calibration, target) = seen_by(&truth, beyond, 6, NOISE_PX, 1);
    let layout = Layout::covering(&truth, 12).unwrap();
    let stopped = fit(&calibration, &target, layout, &mut || ControlFlow::Break(()));
    assert_eq!(stopped.unwrap_err(), Error::Stopped);
    assert!(Layout::covering(&truth, usize::MAX).is_err());
    let large = Layout { knots: [100, 60], ..layout };
    assert!(matches!(fit(&calibration, &target, large, &mut GO_ON.clone()), Err(Error::Invalid(_))));
    calibration.views.clear();
    let nothing = fit(&calibration, &target, layout, &mut GO_ON.clone());
    assert!(matches!(nothing, Err(Error::Degenerate(_))));
}
