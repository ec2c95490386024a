//! Pictures that were taken with another focal length: zoom, focus, temperature.

use super::{Alternative, Capture, Hypothesis, Words, column::Column, linear::Term, rms, size};

/// Fewest views before and after a step.
const APART: usize = 2;
/// Fewest views of a drift.
const DRIFTING: usize = 5;

fn percent(value: f64) -> (String, f64) {
    let percent = 100.0 * value;
    (format!("{} {}", size(percent, "%"), if percent > 0.0 { "longer" } else { "shorter" }), percent)
}

fn words(title: String, size: String, value: f64) -> Words {
    Words { title, size, value, unit: "%".to_owned() }
}

/// One picture with another zoom.
pub(super) const ONE_PICTURE: Hypothesis = Hypothesis {
    code: "zoomed_picture",
    alternatives: |capture| {
        let one = |i| Alternative { terms: vec![capture.alone(Column::Focal, i)], views: vec![i] };
        (0..capture.views()).map(one).collect()
    },
    words: |capture, best| {
        let (size, value) = percent(best.theta[0]);
        let name = capture.name(best.alternative);
        words(format!("{name} has another zoom or focus"), format!("a focal length {size}"), value)
    },
};

/// All pictures before one; the camera is that of the last.
pub(super) const STEP: Hypothesis = Hypothesis {
    code: "zoom_step",
    alternatives: |capture| {
        let n = capture.views();
        let step = |k: usize| {
            let [before, after] = [&capture.when.order[..k], &capture.when.order[k..]];
            let mut factors = vec![0.0; n];
            before.iter().for_each(|i| factors[*i] = -1.0);
            Alternative { terms: vec![Term { column: Column::Focal, factors }], views: after.to_vec() }
        };
        (APART..(n + 1).saturating_sub(APART)).map(step).collect()
    },
    words: |capture, best| {
        let (size, value) = percent(best.theta[0]);
        let name = capture.name(best.views[0]);
        words(
            format!("Zoom or focus changed before {name}"),
            format!("a focal length {size} from there on, {}", capture.when.words()),
            value,
        )
    },
};

/// A focal length that goes up or down from the first picture to the last.
pub(super) const DRIFT: Hypothesis = Hypothesis {
    code: "focal_drift",
    alternatives: |capture| {
        if capture.views() < DRIFTING {
            return Vec::new();
        }
        Alternative::of_all(vec![capture.growing(Column::Focal)])
    },
    words: |capture, best| {
        let (size, value) = percent(best.theta[0]);
        words(
            "The focal length drifted".to_owned(),
            format!("{size} at the last picture than at the first, {}", capture.when.words()),
            value,
        )
    },
};

/// A focal length of its own for each picture: an autofocus that was left on.
pub(super) const EACH: Hypothesis = Hypothesis {
    code: "focus_varies",
    alternatives: |capture: &Capture<'_>| {
        if capture.views() < DRIFTING {
            return Vec::new();
        }
        // What all share is the camera's.
        Alternative::of_all((1..capture.views()).map(|i| capture.alone(Column::Focal, i)).collect())
    },
    words: |_, best| {
        let mean = best.theta.iter().sum::<f64>() / (best.theta.len() + 1) as f64;
        let mut own: Vec<f64> = best.theta.iter().map(|v| v - mean).collect();
        own.push(-mean);
        let value = 100.0 * rms(&own);
        words(
            "Each picture was focused anew".to_owned(),
            format!("focal lengths scatter by {}", size(value, "%")),
            value,
        )
    },
};
