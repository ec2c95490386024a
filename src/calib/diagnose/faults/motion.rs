//! Pictures that are not where the lens put them: drift, stabilisation, correction, rows that are read late.

use super::{Alternative, Capture, Hypothesis, Words, column::Column, rms, size};

/// Fewest views that tell a drift or a shift of each.
const LEAST: usize = 5;
const CENTRE: [Column; 2] = [Column::CentreX, Column::CentreY];

/// A principal point that goes somewhere from the first picture to the last.
pub(super) const CENTRE_DRIFT: Hypothesis = Hypothesis {
    code: "centre_drift",
    alternatives: |capture| {
        if capture.views() < LEAST {
            return Vec::new();
        }
        Alternative::of_all(CENTRE.map(|c| capture.growing(c)).to_vec())
    },
    words: |capture, best| {
        let value = best.theta.iter().fold(0.0f64, |sum, v| sum.hypot(*v));
        Words {
            title: "The principal point drifted".to_owned(),
            size: format!(
                "by {} from the first picture to the last, {}",
                size(value, "px"),
                capture.when.words()
            ),
            value,
            unit: "px".to_owned(),
        }
    },
};

/// A principal point of its own for each picture: cropped, corrected or stabilised by the camera.
pub(super) const SHIFTED: Hypothesis = Hypothesis {
    code: "shifted_pictures",
    alternatives: |capture| {
        if capture.views() < LEAST {
            return Vec::new();
        }
        // What all share is the camera's.
        Alternative::of_all((1..capture.views()).flat_map(|i| CENTRE.map(|c| capture.alone(c, i))).collect())
    },
    words: |_, best| {
        // As a scatter about their mean.
        let scatter = |k: usize| {
            let mut own: Vec<f64> = best.theta.iter().copied().skip(k).step_by(2).collect();
            own.push(0.0);
            let mean = own.iter().sum::<f64>() / own.len() as f64;
            own.iter_mut().for_each(|v| *v -= mean);
            rms(&own)
        };
        let value = scatter(0).hypot(scatter(1));
        Words {
            title: "The pictures were shifted after they were taken".to_owned(),
            size: format!("by {} RMS, each by itself, as a stabiliser does", size(value, "px")),
            value,
            unit: "px".to_owned(),
        }
    },
};

/// Rows that are read one after another while something moves.
pub(super) const ROWS: Hypothesis = Hypothesis {
    code: "rolling_shutter",
    alternatives: |capture: &Capture<'_>| {
        let both = [Column::RowsX, Column::RowsY];
        Alternative::of_all((0..capture.views()).flat_map(|i| both.map(|c| capture.alone(c, i))).collect())
    },
    words: |_, best| {
        let value = rms(&best.theta) * 2f64.sqrt();
        Words {
            title: "Something moved while rows were read".to_owned(),
            size: format!("by {} RMS from the first row to the last", size(value, "px")),
            value,
            unit: "px".to_owned(),
        }
    },
};
