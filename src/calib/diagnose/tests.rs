use nalgebra::{Point3, Vector3};
use rand::SeedableRng;
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64;

use super::*;
use crate::calib::{
    calibrate::{CameraSetup, Options, Problem, calibrate},
    camera::Camera,
    observation::{Corner, FrameId, Observation},
    pose::Pose,
    report::{FrameReport, FrameState, Report, Settings},
    target::{BoardSize, Target},
};

const BOARD: BoardSize = BoardSize { cols: 9, rows: 6 };

/// How a board stands: angles in degrees, the place of its middle in px, its distance in mm.
type Stand = ([f64; 3], [f64; 2], f64);

/// A report over boards seen by a known camera with noise of 0.1 px; `bend` lifts the board in its middle, mm.
fn report(stands: &[Stand], bend: f64, spoil: impl Fn(usize, &mut Corner)) -> Report {
    through([-0.25, 0.08], stands, bend, spoil)
}

/// The same through a lens with these radial terms.
fn through([k1, k2]: [f64; 2], stands: &[Stand], bend: f64, spoil: impl Fn(usize, &mut Corner)) -> Report {
    let params = vec![600.0, 600.0, 319.5, 239.5, k1, k2, 0.0, 0.0, 0.0];
    let camera = Camera::new(Model::Brown5, [640, 480], params).unwrap();
    let target = Target::checkerboard(BOARD, 25.0);
    let noise = Normal::new(0.0, 0.1).unwrap();
    let mut random = Pcg64::seed_from_u64(3);
    let mut frames = Vec::new();
    for (k, (angles, middle, distance)) in stands.iter().enumerate() {
        let turn = Pose::from_euler_deg(*angles, Vector3::zeros());
        let to = Vector3::new((middle[0] - 319.5) / 600.0, (middle[1] - 239.5) / 600.0, 1.0) * *distance;
        let shift = to - turn.apply(&target.center_in_board()).coords;
        let pose = Pose::from_euler_deg(*angles, shift);
        let mut frame = FrameReport::new(format!("view{k}.png"));
        for index in 0..BOARD.len() as u32 {
            let p = target.point_in_board(index).unwrap();
            let [u, v] = [p.x / 200.0 - 0.5, p.y / 125.0 - 0.5];
            let lifted = Point3::new(p.x, p.y, bend * (1.0 - 2.0 * (u * u + v * v)));
            let Some(px) = camera.project(&pose.apply(&lifted)) else { continue };
            if (0.0..639.0).contains(&px.x) && (0.0..479.0).contains(&px.y) {
                let mut corner = Corner { index, px, sigma_px: 0.1 };
                corner.px.x += noise.sample(&mut random);
                corner.px.y += noise.sample(&mut random);
                spoil(k, &mut corner);
                frame.corners.push(corner);
            }
        }
        (frame.state, frame.found, frame.image_size_px) = (FrameState::Full, true, Some([640, 480]));
        frames.push(frame);
    }
    let observation = |(k, f): (usize, &FrameReport)| Observation {
        camera: 0,
        frame: FrameId(k as u32),
        corners: f.corners.clone(),
    };
    let problem = Problem {
        cameras: vec![CameraSetup {
            size_px: [640, 480],
            model: Model::Brown5,
            start: None,
            focal_hint_px: None,
        }],
        target: target.clone(),
        observations: frames.iter().enumerate().map(observation).collect(),
        options: Options::default(),
    };
    let settings = Settings { board: Some(BOARD), square: 25.0, ..Settings::default() };
    let mut report = Report::new(settings, Vec::new(), frames, Vec::new());
    match calibrate(&problem, &mut |_| std::ops::ControlFlow::Continue(())) {
        Ok(calibration) => report.calibrated(&calibration, &target),
        Err(error) => report.failed(&error),
    }
    report
}

/// Boards everywhere, tilted to all sides.
fn good() -> Vec<Stand> {
    let mut list = Vec::new();
    for (k, x) in [120.0, 320.0, 520.0].into_iter().enumerate() {
        for (j, y) in [120.0, 240.0, 360.0].into_iter().enumerate() {
            let sign = if (k + j) % 2 == 0 { 1.0 } else { -1.0 };
            list.push((
                [30.0 * sign, 25.0 * (k as f64 - 1.0), 40.0 * j as f64],
                [x, y],
                380.0 + 40.0 * (k as f64),
            ));
        }
    }
    for (angles, at) in [
        ([40.0, 0.0, 0.0], [320.0, 240.0]),
        ([0.0, 40.0, 90.0], [320.0, 240.0]),
        ([-35.0, 20.0, 10.0], [300.0, 230.0]),
    ] {
        list.push((angles, at, 260.0));
    }
    list
}

fn codes(report: &Report) -> Vec<String> {
    findings(report).into_iter().map(|f| f.code).collect()
}

#[test]
fn a_good_set_is_good() {
    let report = report(&good(), 0.0, |_, _| ());
    let verdict = verdict(&report);
    assert!(verdict.level <= Level::Warn, "{verdict:?}");
    assert_eq!(verdict.rms_alone, "excellent");
    let codes = codes(&report);
    for code in ["few_views", "frontal", "loud_picture", "lens_pattern", "board_pattern", "no_camera"] {
        assert!(!codes.iter().any(|c| c == code), "{codes:?}");
    }
}

#[test]
fn pictures_without_distortion_are_named() {
    let named = |terms: [f64; 2], stands: &[Stand]| {
        codes(&through(terms, stands, 0.0, |_, _| ())).contains(&"straightened".to_owned())
    };
    // What is left of a correction: half a pixel; an ordinary lens; corners in the middle only, where no lens bends.
    assert!(named([-0.003, 0.0], &good()));
    assert!(!named([-0.03, 0.0], &good()) && !named([-0.25, 0.08], &good()));
    let middle: Vec<Stand> = good().into_iter().map(|(a, _, d)| (a, [319.5, 239.5], 3.0 * d)).collect();
    assert!(!named([-0.25, 0.08], &middle));
}

#[test]
fn frontal_boards_are_not_trusted_whatever_their_rms() {
    let stands: Vec<Stand> = (0..3)
        .map(|k| ([6.0, 4.0 * f64::from(k), 0.0], [300.0 + 20.0 * f64::from(k), 240.0], 500.0))
        .collect();
    let report = report(&stands, 0.0, |_, _| ());
    assert_eq!(verdict(&report).level, Level::Bad, "{:?}", verdict(&report));
    if report.solution.is_some() {
        let codes = codes(&report);
        assert!(
            codes.contains(&"frontal".to_owned()) && codes.contains(&"few_views".to_owned()),
            "{codes:?}"
        );
    }
}

#[test]
fn an_empty_side_is_named() {
    let stands: Vec<Stand> =
        good().into_iter().map(|(a, [x, y], d)| (a, [430.0 + (x - 320.0) * 0.3, y], d * 1.5)).collect();
    let report = report(&stands, 0.0, |_, _| ());
    let list = findings(&report);
    let found = list.iter().find(|f| f.code == "no_corner").unwrap_or_else(|| panic!("{list:?}"));
    assert!(found.title.contains("left quarter"), "{}", found.title);
    assert_eq!(found.remedy, Some(Remedy::AddPictures));
}

#[test]
fn a_spoilt_picture_is_named_with_its_remedy() {
    let report = report(&good(), 0.0, |view, corner| {
        if view == 4 {
            let wobble = f64::from(corner.index * 7919 % 13) / 6.0 - 1.0;
            corner.px.x += 0.9 * wobble;
            corner.px.y -= 0.9 * wobble;
        }
    });
    let list = findings(&report);
    let loud = list.iter().find(|f| f.code == "loud_picture").unwrap_or_else(|| panic!("{list:?}"));
    assert_eq!(loud.show, Show::Picture(4));
    assert_eq!(loud.remedy.as_ref().map(Remedy::label), Some("Set aside view4".to_owned()));
}

#[test]
fn a_bent_board_is_seen_in_its_residuals() {
    let list = findings(&report(&good(), 3.0, |_, _| ()));
    let bent = list.iter().find(|f| f.code == "bent_board").unwrap_or_else(|| panic!("{list:?}"));
    // It is bent by 3 mm; the poses hide a part of that.
    let height: f64 = bent.text.split_whitespace().find_map(|w| w.parse().ok()).unwrap();
    assert!((0.3..=3.5).contains(&height), "{}", bent.text);
}

#[test]
fn a_large_error_counts_against_a_camera() {
    let far = |sigma: f64| {
        report(&good(), 0.0, move |view, corner| {
            let wobble = |k: u32| f64::from((corner.index * 31 + view as u32 * 17) * k % 101) / 29.0 - 1.74;
            corner.px.x += sigma * wobble(13);
            corner.px.y += sigma * wobble(29);
        })
    };
    let level = |sigma| verdict(&far(sigma)).level;
    assert_eq!((level(1.0), level(4.0)), (Level::Warn, Level::Bad));
    assert!(verdict(&far(1.0)).sentence.starts_with("Use with care"), "{:?}", verdict(&far(1.0)));
    assert!(findings(&far(4.0)).iter().any(|f| f.code == "misfit" && f.level == Level::Bad));
}

#[test]
fn number_and_tilt_reach_the_verdict() {
    let few: Vec<Stand> = good().into_iter().step_by(3).collect();
    assert_eq!(few.len(), 4);
    let few = verdict(&report(&few, 0.0, |_, _| ()));
    assert!(few.level >= Level::Warn, "{few:?}");
    let facing: Vec<Stand> =
        good().into_iter().map(|([a, b, c], at, d)| ([a * 0.4, b * 0.4, c], at, d * 0.8)).collect();
    let facing = verdict(&report(&facing, 0.0, |_, _| ()));
    assert!(facing.level >= Level::Warn, "{facing:?}");
}

#[test]
fn a_side_without_a_corner_reaches_the_verdict() {
    // A lens with two free terms is certain everywhere: nothing but the corners says that a quarter was never seen.
    let mut report = report(&good(), 0.0, |_, _| ());
    for frame in &mut report.frames {
        let keep: Vec<bool> = frame.corners.iter().map(|c| c.px.x > 170.0).collect();
        let mut kept = keep.iter();
        frame.corners.retain(|_| *kept.next().unwrap());
        let mut kept = keep.iter();
        frame.residuals_px.retain(|_| *kept.next().unwrap());
    }
    let solution = report.solution.as_mut().unwrap();
    solution.uncertainty.grid_px.iter_mut().flatten().for_each(|px| *px = Some(0.1));
    solution.uncertainty.worst_corner_px = Some(0.2);
    let verdict = verdict(&report);
    assert_eq!(verdict.level, Level::Warn);
    assert!(verdict.sentence.contains("unchecked in the left quarter"), "{verdict:?}");
}

#[test]
fn a_solution_that_was_not_reached_is_the_first_finding() {
    let mut report = report(&good(), 0.0, |_, _| ());
    report.solution.as_mut().unwrap().termination = crate::calib::solution::Termination::Stuck;
    report.warnings.push(crate::calib::solution::Warning::new("not_converged", "the refinement stopped"));
    assert_eq!(verdict(&report).level, Level::Bad);
    let first = &findings(&report)[0];
    assert_eq!((first.code.as_str(), first.level), ("not_converged", Level::Bad));
}

#[test]
fn without_a_camera_the_reason_is_the_verdict() {
    let report = report(&[], 0.0, |_, _| ());
    let verdict = verdict(&report);
    assert!(verdict.level == Level::Bad && verdict.sentence.starts_with("No camera from"), "{verdict:?}");
    assert_eq!(findings(&report)[0].level, Level::Bad);
    let nothing = Report::new(Settings::default(), Vec::new(), Vec::new(), Vec::new());
    assert_eq!(super::verdict(&nothing).level, Level::Info);
    assert!(findings(&nothing).is_empty());
}

#[test]
fn an_absurd_lens_is_not_trusted_whatever_the_rms() {
    let good = report(&good(), 0.0, |_, _| ());
    let mut large = good.clone();
    let solution = large.solution.as_mut().unwrap();
    solution.camera.params[5] = 9_700.0;
    let said = verdict(&large);
    assert!(said.level == Level::Bad && said.sentence.contains("absurd, k2 = 9700"), "{said:?}");
    assert_eq!(said.rms_alone, "excellent");
    // A long lens has large numbers that do next to nothing.
    let mut long = good.clone();
    let solution = long.solution.as_mut().unwrap();
    solution.camera.params[..2].fill(8000.0);
    solution.camera.params[4..6].copy_from_slice(&[-1.5, 60.0]);
    assert!(!verdict(&long).sentence.contains("absurd"), "{:?}", verdict(&long));
    let mut folded = good;
    folded.warnings.push(crate::calib::solution::Warning::new("model_folds", "it folds"));
    let said = verdict(&folded);
    assert!(said.level == Level::Bad && said.sentence.contains("folds inside the picture"), "{said:?}");
}
