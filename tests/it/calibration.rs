//! Calibration against OpenCV's answers for the same corners, and against exact truth.

use nalgebra::Vector2;
use serde::Deserialize;
use std::ops::ControlFlow;
use straightedge::calib::{
    Result,
    calibrate::{CameraSetup, Loss, Options, Problem, Weights, calibrate, parse_fixes},
    camera::Model,
    observation::{Corner, FrameId, Observation},
    solution::Calibration,
    target::Target,
};

/// `tests/golden/calibration_*.json`, made by `benches/golden_calibration.py`.
#[derive(Deserialize)]
struct Golden {
    size_px: [u32; 2],
    board: String,
    square: f64,
    answers: Vec<Answer>,
    views: Vec<GoldenView>,
}

#[derive(Deserialize)]
struct Answer {
    fix: String,
    rms_px: f64,
    params: Vec<f64>,
    sigma: Vec<f64>,
    view_rms_px: Vec<f64>,
}

#[derive(Deserialize)]
struct GoldenView {
    corners: Vec<[f32; 2]>,
}

fn golden(name: &str) -> Golden {
    let path = format!("{}/tests/golden/calibration_{name}.json", env!("CARGO_MANIFEST_DIR"));
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

impl Golden {
    fn problem(&self, options: Options) -> Problem {
        let corner = |(i, p): (usize, &[f32; 2])| Corner {
            index: i as u32,
            px: Vector2::from(*p).cast(),
            sigma_px: 0.1,
        };
        Problem {
            cameras: vec![CameraSetup {
                size_px: self.size_px,
                model: Model::Brown5,
                start: None,
                focal_hint_px: None,
            }],
            target: Target::checkerboard(self.board.parse().unwrap(), self.square),
            observations: (0..self.views.len())
                .map(|v| Observation {
                    camera: 0,
                    frame: FrameId(v as u32),
                    corners: self.views[v].corners.iter().enumerate().map(corner).collect(),
                })
                .collect(),
            options,
        }
    }
}

fn plain() -> Options {
    Options { loss: Loss::Linear, weights: Weights::None, ..Options::default() }
}

fn run(problem: &Problem) -> Result<Calibration> {
    calibrate(problem, &mut |_| ControlFlow::Continue(()))
}

const SETS: [&str; 4] = ["opencv_left", "opencv_right", "udacity_lane", "learning_opencv_phone"];

#[test]
fn opencvs_corners_give_opencvs_answer() {
    for name in SETS {
        let golden = golden(name);
        for answer in &golden.answers {
            let options = Options { fixed: parse_fixes(&answer.fix).unwrap(), ..plain() };
            let got = run(&golden.problem(options)).unwrap();
            let at = format!("{name} --fix {}", answer.fix);
            let rms = got.rms_px - answer.rms_px;
            assert!(rms.abs() < 1e-6, "{at}: RMS differs by {rms:e}");
            assert!(got.termination.converged(), "{at}: {:?}", got.termination);
            for i in 0..9 {
                let Some(sigma) = got.sigma[i] else {
                    assert!(answer.sigma[i] == 0.0, "{at}");
                    continue;
                };
                let shift = (got.camera.params[i] - answer.params[i]) / sigma;
                let relative = sigma / answer.sigma[i] - 1.0;
                println!("{at} {i}: {shift:+.1e} sigma, sigma {relative:+.1e}");
                assert!(shift.abs() < 1e-4, "{at}: parameter {i} is {shift:e} sigma away");
                // OpenCV gives fy of a fixed aspect ratio no sigma.
                if answer.sigma[i] != 0.0 {
                    assert!(relative.abs() < 1e-4, "{at}: sigma of parameter {i} differs by {relative:e}");
                }
            }
            for (view, rms) in got.views.iter().zip(&answer.view_rms_px) {
                assert!((view.rms_px - rms).abs() < 1e-5, "{at}: {} {rms}", view.rms_px);
            }
        }
    }
}

#[test]
fn defaults_are_at_least_as_good() {
    for name in SETS {
        let golden = golden(name);
        let got = run(&golden.problem(Options::default())).unwrap();
        println!(
            "{name}: {:.4} ({:.4} inliers {}) OpenCV {:.4} f {:.2} ± {:.2} {:?} {:?} {} iterations, {:?}",
            got.rms_px,
            got.rms_inliers_px,
            got.views.iter().map(|v| v.outliers.len()).sum::<usize>(),
            golden.answers[0].rms_px,
            got.camera.params[0],
            got.sigma[0].unwrap(),
            got.termination,
            got.starts,
            got.iterations.len(),
            got.warnings,
        );
        // The plain RMS is OpenCV's own goal, so it can only be larger under another loss: by the wrong corners alone
        // (findChessboardCorners + cornerSubPix left ten of them in opencv_right).
        assert!(got.rms_px < 1.07 * golden.answers[0].rms_px && got.set_aside.is_empty());
        assert!(got.rms_inliers_px <= golden.answers[0].rms_px && got.termination.converged());
    }
}
