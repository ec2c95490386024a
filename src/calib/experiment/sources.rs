//! The document's Table V with numbers: on its own scene, one source of error at a time is made worse, and what that does to the camera
//! is measured against the truth, beside what [`diagnose::sources`] says without knowing it.
//!
//! Corners are projected and get normal noise; each case is repeated with other noise.
//!
//! [`diagnose::sources`]: crate::calib::diagnose::sources

use std::{fmt::Write as _, ops::ControlFlow};

use nalgebra::{Point3, Vector2};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use crate::calib::{
    calibrate::{CameraSetup, Options, Precision, Problem, calibrate},
    camera::{Camera, Model},
    diagnose::{faults::MapOf, sources},
    number::significant,
    observation::{Corner, FrameId, Observation},
    pose::Pose,
    report::{FrameReport, FrameState, Report, Settings},
    synth::Scene,
    target::Unit,
};

/// Noise of a corner in each coordinate, px: what photographs have.
const NOISE_PX: f64 = 0.1;
/// How often each case is repeated.
const REPEATS: u64 = 20;

/// What is photographed, and how.
struct Setup {
    camera: Camera,
    poses: Vec<Pose>,
    noise_px: f64,
    /// Height of the board in its middle, mm.
    bow: f64,
    /// Growth of the focal length from the first picture to the last, relative.
    drift: f64,
    options: Options,
}

/// One case of a source.
struct Case {
    source: &'static str,
    code: &'static str,
    name: &'static str,
    change: fn(&mut Setup),
}

const fn case(source: &'static str, code: &'static str, name: &'static str, change: fn(&mut Setup)) -> Case {
    Case { source, code, name, change }
}

/// Tilts of all boards, about their middles, by a factor.
fn tilted(setup: &mut Setup, by: f64) {
    let middle = Scene::seed().board.target().center_in_board();
    for pose in &mut setup.poses {
        let place = pose.apply(&middle);
        let [x, y, z] = pose.euler_deg();
        *pose = Pose::from_euler_deg([x * by, y * by, z], nalgebra::Vector3::zeros());
        pose.translation = place - pose.apply(&middle);
    }
}

/// Terms of a thin prism in the lens, which the model lacks.
fn prism(setup: &mut Setup, by: f64) {
    let mut params = vec![0.0; Model::ThinPrism.spec().params.len()];
    params[..9].copy_from_slice(&setup.camera.params);
    params[12..].copy_from_slice(&[by, -0.5 * by, -by, by]);
    setup.camera = Camera { model: Model::ThinPrism, size_px: setup.camera.size_px, params };
}

/// Another sensor behind the same lens.
fn sensor(setup: &mut Setup, by: f64) {
    let camera = &mut setup.camera;
    camera.size_px = camera.size_px.map(|n| (f64::from(n) * by) as u32);
    for (k, p) in camera.params[..4].iter_mut().enumerate() {
        // Centres of pixels are whole numbers, so the picture begins at −0.5.
        *p = if k < 2 { *p * by } else { (*p + 0.5) * by - 0.5 };
    }
}

const CORNERS: &str = "Corner detection and localisation";
const DIVERSITY: &str = "Insufficient view diversity";
const LENS: &str = "Distortion model incompleteness";
const DEGENERACY: &str = "Planar target degeneracy";
const RESOLUTION: &str = "Image resolution and quantisation";
const CONDITIONING: &str = "Numerical conditioning";
const ENVIRONMENT: &str = "Environmental and physical factors";

/// All cases, in the order of Table V.
const CASES: &[Case] = &[
    case("The scene as it is", "corners", "noise 0.1 px", |_| ()),
    case(CORNERS, "corners", "noise 0.03 px", |s| s.noise_px = 0.03),
    case(CORNERS, "corners", "noise 0.3 px", |s| s.noise_px = 0.3),
    case(DIVERSITY, "diversity", "8 pictures", |s| s.poses.truncate(8)),
    case(DIVERSITY, "diversity", "5 pictures", |s| s.poses.truncate(5)),
    case(LENS, "lens_model", "thin prism of 0.001", |s| prism(s, 1e-3)),
    case(LENS, "lens_model", "thin prism of 0.005", |s| prism(s, 5e-3)),
    case(DEGENERACY, "degeneracy", "half the tilt", |s| tilted(s, 0.5)),
    case(DEGENERACY, "degeneracy", "a quarter of the tilt", |s| tilted(s, 0.25)),
    case(RESOLUTION, "resolution", "half the pixels each way", |s| sensor(s, 0.5)),
    case(RESOLUTION, "resolution", "twice the pixels each way", |s| sensor(s, 2.0)),
    case(CONDITIONING, "conditioning", "single precision", |s| s.options.precision = Precision::F32),
    case(CONDITIONING, "conditioning", "points not normalised", |s| s.options.normalise = false),
    case(ENVIRONMENT, "environment", "board bowed by 0.5 mm", |s| s.bow = 0.5),
    case(ENVIRONMENT, "environment", "board bowed by 2 mm", |s| s.bow = 2.0),
    case(ENVIRONMENT, "environment", "focal length drifts by 0.2 %", |s| s.drift = 0.002),
    case(ENVIRONMENT, "environment", "focal length drifts by 1 %", |s| s.drift = 0.01),
];

/// Means of a case over its repeats.
struct Row {
    case: &'static Case,
    rms_px: f64,
    error_px: f64,
    sigma_px: f64,
    card_px: f64,
    solved: usize,
}

/// Measures all cases and writes the page; `step` is told which comes next and may stop it.
pub fn page(step: &mut dyn FnMut(&str) -> ControlFlow<()>) -> String {
    let mut out = format!(
        "# The seven sources of error, measured\n\n\
         Made by `straightedge experiment --sources --out docs`; do not edit.\n\n\
         The source document's Table V calls seven sources of error high, medium or low. Here each is made worse by itself on its own scene\n\
         (800 x 600 px, 15 pictures, noise of {NOISE_PX} px in each coordinate; {REPEATS} repeats with other noise). *Error* is how far the projection map is\n\
         from the true one, *σ* what the calibration says by itself about random errors, *card* what it says about this source: all are root\n\
         mean squares in px over the nine tenths of the picture that are known best.\n\n\
         | source | case | RMS of the fit | error | σ | card |\n|---|---|---|---|---|---|\n"
    );
    for case in CASES {
        if step(case.name).is_break() {
            break;
        }
        let row = measure(case);
        let px = |v: f64| significant((v / row.solved.max(1) as f64).sqrt(), 2);
        let _ = writeln!(
            out,
            "| {} | {} | {} | {} | {} | {} |",
            row.case.source,
            row.case.name,
            px(row.rms_px),
            px(row.error_px),
            px(row.sigma_px),
            px(row.card_px)
        );
        if row.solved < REPEATS as usize {
            let _ =
                writeln!(out, "| | {} of {REPEATS} were refused | | | | |", REPEATS as usize - row.solved);
        }
    }
    out
}

fn measure(case: &'static Case) -> Row {
    let mut row = Row { case, rms_px: 0.0, error_px: 0.0, sigma_px: 0.0, card_px: 0.0, solved: 0 };
    for seed in 0..REPEATS {
        let Some([rms, error, sigma, card]) = once(case, seed) else { continue };
        row.rms_px += rms * rms;
        row.error_px += error * error;
        row.sigma_px += sigma * sigma;
        row.card_px += card * card;
        row.solved += 1;
    }
    row
}

/// RMS of the fit, error of the map, its σ and the cost on the card, px.
fn once(case: &Case, seed: u64) -> Option<[f64; 4]> {
    let scene = Scene::seed();
    let target = scene.board.target();
    let mut setup = Setup {
        camera: scene.camera.clone(),
        poses: (0..scene.poses.len()).filter_map(|v| scene.camera_from_board(v)).collect(),
        noise_px: NOISE_PX,
        bow: 0.0,
        drift: 0.0,
        options: Options { multi_start: false, ..Options::default() },
    };
    (case.change)(&mut setup);
    let mut random = Pcg64::seed_from_u64(seed);
    let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
    let [w, h] = setup.camera.size_px.map(f64::from);
    let (middle, [[x0, _], [x1, _]]) = (target.center_in_board(), target.extent());
    let last = (setup.poses.len() - 1).max(1) as f64;
    let mut observations = Vec::new();
    for (view, pose) in setup.poses.iter().enumerate() {
        let mut camera = setup.camera.clone();
        camera.params[..2].iter_mut().for_each(|f| *f *= 1.0 + setup.drift * (view as f64 / last - 0.5));
        let mut corners = Vec::new();
        for (index, point) in target.points_in_board().into_iter().enumerate() {
            let off = (point - middle) / (0.5 * (x1 - x0));
            let lifted = Point3::new(point.x, point.y, setup.bow * (1.0 - off.x * off.x));
            let px =
                camera.project(&pose.apply(&lifted))? + Vector2::new(normal(), normal()) * setup.noise_px;
            if (0.0..w - 1.0).contains(&px.x) && (0.0..h - 1.0).contains(&px.y) {
                corners.push(Corner { index: index as u32, px, sigma_px: setup.noise_px });
            }
        }
        observations.push(Observation { camera: 0, frame: FrameId(view as u32), corners });
    }
    let cameras = vec![CameraSetup {
        size_px: setup.camera.size_px,
        model: Model::Brown5,
        start: None,
        focal_hint_px: None,
    }];
    let problem = Problem { cameras, target: target.clone(), observations, options: setup.options };
    let calibration = calibrate(&problem, &mut |_| ControlFlow::Continue(())).ok()?;
    let frames = problem.observations.iter().map(|o| {
        let mut frame = FrameReport::new(format!("{}.png", o.frame.0 + 1));
        (frame.state, frame.found, frame.corners) = (FrameState::Full, true, o.corners.clone());
        frame
    });
    let settings =
        Settings { board: target.grid(), square: scene.board.square, unit: Unit::Mm, ..Settings::default() };
    let mut report = Report::new(settings, Vec::new(), frames.collect(), Vec::new());
    report.calibrated(&calibration, &target);
    let sources = sources::of(&report, &calibration, &target, &mut |_| ControlFlow::Continue(()))?;
    let map = MapOf::new(&calibration, &target)?;
    let error = map.between(&setup.camera, &calibration.camera)?;
    let card = sources.cards.iter().find(|c| c.code == case.code)?;
    Some([calibration.rms_px, error, map.sigma_px(), card.px])
}
