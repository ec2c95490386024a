//! Whether chance explains a mean square.

use serde::Serialize;

use crate::calib::stats::chi2_below;

/// What chance explains less often than this is a difference.
pub const UNLIKELY: f64 = 0.01;

/// A mean square beside what chance lets expect of it; each as its root, px.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Chance {
    /// √ of the mean square, places weighted by their certainty.
    pub moved_px: f64,
    /// The same as chance makes it on average.
    pub expected_px: f64,
    /// What chance exceeds in one of a hundred cases ([`UNLIKELY`]).
    pub limit_px: f64,
    /// How often chance makes it as large.
    pub probability: f64,
}

impl Chance {
    /// Of a mean square that is by chance a weighted sum of χ² of this mean and variance; `None` where it has no spread.
    pub fn new(square: f64, mean: f64, variance: f64) -> Option<Self> {
        let good = mean > 0.0 && variance > 0.0 && square.is_finite() && variance.is_finite();
        let beyond = |square: f64| beyond(square, mean, variance);
        // The limit, by halving an interval that holds it.
        let limit = || {
            let (mut low, mut high) = (0.0, mean + 20.0 * (variance.sqrt() + mean));
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                *(if beyond(middle) > UNLIKELY { &mut low } else { &mut high }) = middle;
            }
            high
        };
        good.then(|| Self {
            moved_px: square.sqrt(),
            expected_px: mean.sqrt(),
            limit_px: limit().sqrt(),
            probability: beyond(square),
        })
    }
}

impl Chance {
    /// The probability: `p = 0.34`, or that it is small.
    pub fn words(&self) -> String {
        if self.probability < 0.001 { "p < 0.001".to_owned() } else { format!("p = {:.3}", self.probability) }
    }
}

/// Probability that g · χ²(h) exceeds `square`, with g and h from mean and variance; between whole h it is interpolated.
fn beyond(square: f64, mean: f64, variance: f64) -> f64 {
    let scale = variance / (2.0 * mean);
    let freedom = (mean / scale).max(1.0);
    let at = |n: usize| chi2_below(square / scale, n);
    let (whole, part) = (freedom.floor() as usize, freedom.fract());
    1.0 - ((1.0 - part) * at(whole) + part * at(whole + 1))
}
