//! When each picture was taken: the abscissa of what drifts.

use crate::calib::{compare::date, order, report::Report, solution::Calibration};

/// The views in time.
pub(super) struct When {
    /// Of each view, from −1 for the first to 0 for the last.
    pub(super) at: Vec<f64>,
    /// The views, the first first.
    pub(super) order: Vec<usize>,
    /// Whether all files say when; otherwise the order in which they were given stands for the time.
    by_time: bool,
}

impl When {
    pub(super) fn new(report: &Report, calibration: &Calibration) -> Self {
        let frames = calibration.views.iter().map(|v| report.frames.get(v.frame.0 as usize));
        let days: Option<Vec<f64>> = frames.map(|f| date::days(f?.taken.as_deref()?)).collect();
        Self::of(days, calibration.views.len())
    }

    /// By days since 1970, where all are known and not all are the same.
    fn of(days: Option<Vec<f64>>, views: usize) -> Self {
        let span = |list: &[f64]| {
            let [first, last] =
                list.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], d| [a.min(*d), b.max(*d)]);
            (last, last - first)
        };
        let days = days.filter(|list| span(list).1 > 0.0);
        let by_time = days.is_some();
        let days = days.unwrap_or_else(|| (0..views).map(|i| i as f64).collect());
        let (last, length) = span(&days);
        let at: Vec<f64> = days.iter().map(|d| (d - last) / length.max(f64::MIN_POSITIVE)).collect();
        let mut order: Vec<usize> = (0..views).collect();
        order::by(&mut order, |i| [at[*i]]);
        Self { at, order, by_time }
    }

    /// What the time is, for the evidence.
    pub(super) const fn words(&self) -> &'static str {
        if self.by_time { "by the times of capture" } else { "by the order of the pictures" }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_where_all_have_one_and_otherwise_the_order() {
        let timed = When::of(Some(vec![10.0, 12.0, 10.5]), 3);
        assert_eq!(
            (timed.at.as_slice(), timed.order.as_slice()),
            ([-1.0, 0.0, -0.75].as_slice(), [0, 2, 1].as_slice())
        );
        assert_eq!(timed.words(), "by the times of capture");
        for none in [None, Some(vec![10.0; 3])] {
            let ordered = When::of(none, 3);
            assert_eq!(
                (ordered.at.as_slice(), ordered.order.as_slice()),
                ([-1.0, -0.5, 0.0].as_slice(), [0, 1, 2].as_slice())
            );
            assert_eq!(ordered.words(), "by the order of the pictures");
        }
    }
}
