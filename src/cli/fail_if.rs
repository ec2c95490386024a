//! `--fail-if 'rms>0.5,uncertainty>1'`: conditions under which a calibration counts as failed.

use std::str::FromStr;

use crate::calib::{Error, Result, report::Report};

/// A figure that can be limited.
#[derive(Debug)]
struct Figure {
    name: &'static str,
    /// What it is, for help and messages.
    what: &'static str,
    unit: &'static str,
    of: fn(&Report) -> Option<f64>,
}

/// All figures.
const FIGURES: &[Figure] = &[
    Figure {
        name: "rms",
        what: "RMS of the residuals",
        unit: " px",
        of: |r| Some(r.solution.as_ref()?.rms_px),
    },
    Figure {
        name: "p95",
        what: "95th percentile of the errors",
        unit: " px",
        of: |r| Some(r.solution.as_ref()?.stats.p95),
    },
    Figure { name: "max", what: "largest error", unit: " px", of: |r| Some(r.solution.as_ref()?.stats.max) },
    Figure {
        name: "uncertainty",
        what: "uncertainty of the projection in the worst corner of the picture",
        unit: " px",
        of: |r| r.solution.as_ref()?.uncertainty.worst_corner_px,
    },
    Figure {
        name: "images",
        what: "number of pictures that were used",
        unit: "",
        of: |r| Some(r.included().count() as f64),
    },
    Figure {
        name: "corners",
        what: "number of corners that were used",
        unit: "",
        of: |r| Some(r.included().map(|f| f.corners.len()).sum::<usize>() as f64),
    },
    Figure {
        name: "coverage",
        what: "share of the picture's cells with a corner",
        unit: "",
        of: |r| Some(r.solution.as_ref()?.coverage.cells_fraction),
    },
    Figure { name: "warnings", what: "number of warnings", unit: "", of: |r| Some(r.warnings.len() as f64) },
];

/// One condition: `rms>0.5`.
#[derive(Clone, Copy, Debug)]
struct Condition {
    figure: &'static Figure,
    above: bool,
    limit: f64,
}

/// Conditions separated by commas; any one that holds is a failure.
#[derive(Clone, Debug)]
pub(super) struct FailIf(Vec<Condition>);

impl FailIf {
    /// The reasons why a calibration counts as failed; empty where it passes. A figure that is not known fails.
    pub(super) fn reasons(&self, report: &Report) -> Vec<String> {
        self.0.iter().filter_map(|c| c.reason(report)).collect()
    }
}

impl Condition {
    fn reason(&self, report: &Report) -> Option<String> {
        let Self { figure, above, limit } = self;
        let sign = if *above { '>' } else { '<' };
        let rule = format!("{}{sign}{limit}", figure.name);
        match (figure.of)(report) {
            None => Some(format!("{rule}: the {} is not known", figure.what)),
            Some(v) if v.is_nan() || (if *above { v > *limit } else { v < *limit }) => {
                Some(format!("{rule}: the {} is {}{}", figure.what, shown(v), figure.unit))
            }
            Some(_) => None,
        }
    }
}

fn shown(value: f64) -> String {
    if value.fract() == 0.0 { format!("{value}") } else { format!("{value:.4}") }
}

impl FromStr for FailIf {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let condition = |item: &str| {
            let wrong = || {
                let names: Vec<_> = FIGURES.iter().map(|f| f.name).collect();
                Error::Invalid(format!(
                    "\"{}\" is not a condition: write NAME>NUMBER or NAME<NUMBER with one of {}, for example rms>0.5",
                    item.trim(),
                    names.join(", ")
                ))
            };
            let (name, limit) = item.split_once(['>', '<']).ok_or_else(wrong)?;
            let name = name.trim().to_lowercase();
            let figure = FIGURES.iter().find(|f| f.name == name).ok_or_else(wrong)?;
            let limit = limit.trim().parse().ok().filter(|v: &f64| v.is_finite()).ok_or_else(wrong)?;
            Ok(Condition { figure, above: item.contains('>'), limit })
        };
        let list: Vec<Condition> =
            text.split(',').filter(|t| !t.trim().is_empty()).map(condition).collect::<Result<_>>()?;
        if list.is_empty() {
            return Err(Error::Invalid("--fail-if needs a condition, for example rms>0.5".to_owned()));
        }
        Ok(Self(list))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calib::report::Settings;

    #[test]
    fn the_grammar_of_conditions() {
        let list: FailIf = "rms>0.5, Uncertainty > 1,images<10".parse().unwrap();
        let told: Vec<_> = list.0.iter().map(|c| (c.figure.name, c.above, c.limit)).collect();
        assert_eq!(told, [("rms", true, 0.5), ("uncertainty", true, 1.0), ("images", false, 10.0)]);
        for text in ["", ",", "rms", "rms>", "rms=1", "rms>nan", "noise>1", ">1", "rms>1>2"] {
            assert!(text.parse::<FailIf>().is_err(), "{text}");
        }
        let error = "noise>1".parse::<FailIf>().unwrap_err().to_string();
        assert!(FIGURES.iter().all(|f| error.contains(f.name)), "{error}");
    }

    #[test]
    fn what_is_not_known_fails() {
        let report = Report::new(Settings::default(), Vec::new(), Vec::new(), Vec::new());
        let reasons = "rms>100,images<1,warnings>0".parse::<FailIf>().unwrap().reasons(&report);
        assert_eq!(
            reasons,
            [
                "rms>100: the RMS of the residuals is not known",
                "images<1: the number of pictures that were used is 0"
            ]
        );
    }
}
