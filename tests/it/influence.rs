//! What a picture does to the camera, beside calibrations without it.

use std::{ops::ControlFlow, process::Command};

use nalgebra::Vector2;
use straightedge::calib::{
    calibrate::{CameraSetup, Loss, Options, Problem, calibrate},
    camera::Model,
    influence::{Role, displacement, left_out, of},
    observation::{FrameId, Observation},
    report::Report,
    solution::Calibration,
    uncertainty::{self, Range},
};

use crate::detection::data;

/// A set as the program finds its corners and calibrates this model; `None` where it is absent.
pub(super) fn problem(set: &str, model: Model) -> Option<(Report, Problem)> {
    let output = Command::new(env!("CARGO_BIN_EXE_straightedge"))
        .args(["calibrate", "--json", "--model", model.spec().name])
        .arg(data(set)?)
        .output()
        .unwrap();
    let report: Report = serde_json::from_slice(&output.stdout).unwrap();
    let used = report.frames.iter().enumerate().filter(|(_, f)| f.included);
    let observations = used
        .map(|(i, f)| Observation { camera: 0, frame: FrameId(i as u32), corners: f.corners.clone() })
        .collect();
    let camera = &report.solution.as_ref().unwrap().camera;
    let setup =
        CameraSetup { size_px: camera.size_px, model: camera.model, start: None, focal_hint_px: None };
    let target = report.settings.target().unwrap();
    let problem = Problem { cameras: vec![setup], target, observations, options: Options::default() };
    Some((report, problem))
}

pub(super) fn solve(problem: &Problem) -> Calibration {
    calibrate(problem, &mut |_| ControlFlow::Continue(())).unwrap()
}

#[test]
fn is_that_of_calibrations_without_the_picture() {
    for set in ["opencv_left", "opencv_right", "udacity_lane"] {
        let Some((_, problem)) = problem(set, Model::Brown5) else { continue };
        let whole = solve(&problem);
        let [w, h] = whole.camera.size_px.map(f64::from);
        let pixels: Vec<Vector2<f64>> = (0..130)
            .map(|k| [(f64::from(k % 13) + 0.5) / 13.0 * w, (f64::from(k / 13) + 0.5) / 10.0 * h])
            .map(Vector2::from)
            .collect();
        let sigma = uncertainty::at(&whole, &problem.target, Range::Infinity, &pixels);
        let weights: Vec<f64> = sigma.iter().map(|s| s.map_or(0.0, |s| 1.0 / (s * s))).collect();
        // Root of the weighted mean square.
        let length = |list: &[Option<Vector2<f64>>]| {
            let sums = list.iter().zip(&weights).filter_map(|(d, w)| Some((w * (*d)?.norm_squared(), *w)));
            let (squares, total) = sums.fold((0.0, 0.0), |s, t| (s.0 + t.0, s.1 + t.1));
            (squares / total).sqrt()
        };
        for (i, quick) in left_out(&whole, &problem.target, Loss::Huber).into_iter().enumerate() {
            let mut rest = problem.clone();
            rest.observations.retain(|o| o.frame != whole.views[i].frame);
            let way = |to| displacement(&whole.camera, to, &pixels, &weights);
            let (alone, quick) = (way(&solve(&rest).camera), way(&quick.unwrap()));
            let apart: Vec<_> = alone.iter().zip(&quick).map(|(a, b)| Some((*a)? - (*b)?)).collect();
            let (moves, off) = (length(&alone), length(&apart));
            println!("{set} {}: moves {moves:.4} px, {off:.4} px off", whole.views[i].frame.0);
            assert!(off <= (0.1 * moves).max(0.02), "{set} {i}: {off} px off");
        }
    }
}

/// Pictures that have nothing to do with the camera are named first.
#[test]
fn of_a_stretched_picture_is_harmful() {
    let Some((report, mut problem)) = problem("opencv_left", Model::Brown5) else { return };
    assert!(report.frames.iter().all(|f| f.influence.is_some_and(|i| i.role != Role::Harmful)));
    // Zoomed by 3 % about the middle of the picture.
    for corner in &mut problem.observations[4].corners {
        corner.px = Vector2::new(319.5, 239.5).lerp(&corner.px, 1.03);
    }
    let spoiled = solve(&problem);
    let list = of(&spoiled, &problem.target, Loss::Huber, &mut |_| ControlFlow::Continue(())).unwrap();
    let harmful: Vec<usize> =
        (0..list.len()).filter(|&i| list[i].is_some_and(|v| v.role == Role::Harmful)).collect();
    let furthest = (0..list.len())
        .max_by(|&a, &b| list[a].map(|v| v.moves_px).partial_cmp(&list[b].map(|v| v.moves_px)).unwrap());
    let set_aside = spoiled.set_aside.iter().any(|s| s.0 == problem.observations[4].frame);
    assert!(set_aside || (harmful.contains(&4) && furthest == Some(4)), "{harmful:?} {list:?}");
}
