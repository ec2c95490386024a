//! Which of several models: the simplest one that the others do not beat significantly.

use crate::{camera::Model, solution::Calibration};

/// Value of F beyond which more parameters are believed: exceeded by chance once in a thousand for five of them.
const F_LIMIT: f64 = 4.1;

/// Standard errors by which a model of another kind must fit better in the mean picture.
const KIND_LIMIT: f64 = 3.0;
/// Share of the residuals that it must leave at most.
const KIND_SHARE: f64 = 0.95;
/// Focal length in picture widths below which a perspective model has a wide lens before it: 75° and more.
const WIDE: f64 = 0.65;
/// RMS from which a perspective model may be the wrong kind, px.
const STRAINED_PX: f64 = 0.5;

/// Position of the model to use among calibrations of the same observations, simplest first; `None` for none.
///
/// Two models are compared by the F test of nested models, on the squared residuals of the corners that the larger one does not
/// call outliers: what it cannot explain, the smaller cannot either. Models of which neither contains the other (a perspective and a
/// fisheye lens) are compared over the pictures, by the mean of their differences against its standard error (Q. H. Vuong,
/// "Likelihood ratio tests for model selection and non-nested hypotheses", Econometrica 57(2), 1989): corners of one picture share
/// their errors, pictures do not.
pub fn simplest_sufficient(calibrations: &[Calibration]) -> Option<usize> {
    let mut best = 0;
    for i in 1..calibrations.len() {
        let (now, next) = (&calibrations[best], &calibrations[i]);
        let nested = now.camera.spec().perspective == next.camera.spec().perspective;
        if if nested { significantly_better(now, next) } else { fits_other_kind(now, next) } {
            best = i;
        }
    }
    (!calibrations.is_empty()).then_some(best)
}

/// Whether a model is worth trying after the perspective ones that were: fisheye models are, where those are strained.
pub fn worth_trying(model: Model, before: &[Calibration]) -> bool {
    let Some(last) = before.iter().rfind(|c| c.camera.spec().perspective) else { return true };
    let width = f64::from(last.camera.size_px[0].max(last.camera.size_px[1]));
    model.spec().perspective
        || last.camera.params[0] < WIDE * width
        || last.rms_px > STRAINED_PX
        || last.warnings.iter().any(|w| w.code == "model_folds")
}

fn fits_other_kind(now: &Calibration, other: &Calibration) -> bool {
    if other.views.len() != now.views.len() {
        return other.views.len() > now.views.len();
    }
    let mut differences = Vec::with_capacity(now.views.len());
    let mut sums = [0.0, 0.0];
    for view in &now.views {
        let Some(same) = other.views.iter().find(|v| v.frame == view.frame) else { return false };
        // Lengths, not squares: outliers of either model must not decide.
        let [a, b] = [view, same].map(|v| v.residuals_px.iter().map(|r| r.norm()).sum::<f64>());
        sums = [sums[0] + a, sums[1] + b];
        differences.push((a - b) / view.residuals_px.len().max(1) as f64);
    }
    let n = differences.len() as f64;
    let mean = differences.iter().sum::<f64>() / n;
    let variance = differences.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
    sums[1] < KIND_SHARE * sums[0] && mean > KIND_LIMIT * (variance / n).sqrt()
}

fn significantly_better(small: &Calibration, large: &Calibration) -> bool {
    let more = large.free.len() as f64 - small.free.len() as f64;
    let (mut squares, mut n) = ([0.0, 0.0], 0.0);
    for view in &large.views {
        let Some(other) = small.views.iter().find(|v| v.frame == view.frame) else {
            // The simple model could not even hold the picture.
            return true;
        };
        for (index, residual) in view.indices.iter().zip(&view.residuals_px) {
            if view.outliers.contains(index) {
                continue;
            }
            let Some(at) = other.indices.iter().position(|i| i == index) else { continue };
            squares[0] += other.residuals_px[at].norm_squared();
            squares[1] += residual.norm_squared();
            n += 2.0;
        }
    }
    let freedom = n - large.free.len() as f64 - 6.0 * large.views.len() as f64;
    more > 0.0 && freedom > 0.0 && (squares[0] - squares[1]) / more > F_LIMIT * squares[1] / freedom
}
