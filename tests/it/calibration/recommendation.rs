//! The recommended model errs as little on new pictures as the lens's own.

#[path = "../../../benches/recommendation/capture.rs"]
mod capture;

use std::ops::ControlFlow;

use super::{golden, plain, run};
use straightedge::calib::{
    Error,
    calibrate::{CANDIDATES, Options, compare},
    camera::Model,
};

#[test]
fn as_good_as_the_lenss_own() {
    for (k, lens) in capture::LENSES.into_iter().enumerate().filter(|(k, _)| [0, 4, 5, 9].contains(k)) {
        let truth = capture::camera(lens);
        let problem = capture::problem(&truth, 15, k as u64);
        let fresh = capture::problem(&truth, 40, 77);
        let got = compare(&problem, &CANDIDATES, &mut |_| ControlFlow::Continue(())).unwrap();
        let error = |model: Model| {
            let mut problem = problem.clone();
            problem.cameras[0].model = model;
            capture::error_px(&run(&problem).unwrap().camera, &fresh).unwrap()
        };
        let ratio = error(got.recommended) / error(truth.model);
        println!("{}: {} {ratio:.4}, {}", truth.model, got.recommended, got.why);
        for c in &got.candidates {
            println!("  {c:?}");
        }
        assert!(ratio < 1.01, "{}: {} errs {ratio} times as much", truth.model, got.recommended);
        // A model without its terms must lose, or the comparison says nothing.
        let least = got.candidates.iter().filter_map(|c| c.held_out_px).fold(f64::INFINITY, f64::min);
        let pinhole = got.candidates.iter().find(|c| c.model == Model::Pinhole);
        assert!(
            truth.model == Model::Pinhole
                || pinhole.is_none_or(|p| p.held_out_px.is_none_or(|e| e > 2.0 * least))
        );
    }
}

/// What some of the parts of the pictures do not determine by themselves may predict the others all the same; of models with the same
/// number of terms the one that errs less is taken.
#[test]
fn a_model_is_judged_by_what_it_predicts() {
    for (lens, seed, other) in [(6, 6001, Model::Brown4), (8, 8001, Model::Eucm)] {
        let truth = capture::camera(capture::LENSES[lens]);
        let problem = capture::problem(&truth, 20, seed);
        let got = compare(&problem, &[other, truth.model], &mut |_| ControlFlow::Continue(())).unwrap();
        assert_eq!(got.recommended, truth.model, "{:?}", got.candidates);
    }
}

#[test]
fn an_ordinary_webcam_needs_no_rational_model() {
    for name in ["opencv_left", "opencv_right"] {
        let problem = golden(name).problem(Options::default());
        let got = compare(&problem, &CANDIDATES, &mut |_| ControlFlow::Continue(())).unwrap();
        println!("{name}: {} {}", got.recommended, got.why);
        assert!(got.recommended.spec().params.len() <= 9, "{name}: {}", got.recommended);
    }
}

#[test]
fn copies_of_a_picture_are_no_new_pictures() {
    let truth = capture::camera(capture::LENSES[4]);
    let mut problem = capture::problem(&truth, 2, 5);
    for copy in 2..10 {
        let mut again = problem.observations[copy % 2].clone();
        again.frame.0 = copy as u32;
        problem.observations.push(again);
    }
    problem.options = plain();
    let got =
        compare(&problem, &[Model::Pinhole, Model::Radial1], &mut |_| ControlFlow::Continue(())).unwrap();
    assert_eq!(got.folds, 0);
    assert!(
        got.candidates.iter().all(|c| c.held_out_px.is_none()) && got.why.contains("too few"),
        "{}",
        got.why
    );
}

#[test]
fn a_stop_is_passed_on() {
    let truth = capture::camera(capture::LENSES[0]);
    let mut steps = 0;
    let mut stop = |_| {
        steps += 1;
        if steps > 40 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let got = compare(&capture::problem(&truth, 8, 1), &CANDIDATES, &mut stop);
    assert!(matches!(got, Err(Error::Stopped)));
}
