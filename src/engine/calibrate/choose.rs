//! Which of several models: the simplest one that the others do not beat significantly.

use crate::solution::Calibration;

/// Value of F beyond which more parameters are believed: exceeded by chance once in a thousand for five of them.
const F_LIMIT: f64 = 4.1;

/// Position of the model to use among calibrations of the same observations, simplest first; `None` for none.
///
/// Two models are compared by the F test of nested models, on the squared residuals of the corners that the larger one does not
/// call outliers: what it cannot explain, the smaller cannot either.
pub fn simplest_sufficient(calibrations: &[Calibration]) -> Option<usize> {
    let mut best = 0;
    for i in 1..calibrations.len() {
        if significantly_better(&calibrations[best], &calibrations[i]) {
            best = i;
        }
    }
    (!calibrations.is_empty()).then_some(best)
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
