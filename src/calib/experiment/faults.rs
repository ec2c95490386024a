//! Whether faults are named: captures with one planted fault each, and clean ones, judged by [`diagnose::faults`].
//!
//! Nothing is rendered: corners are projected and get normal noise ([`capture`]). The strength of a fault is chosen for each capture so
//! that, without noise, it moves the projection map by a given multiple of the map's uncertainty ([`plant`]).
//!
//! [`diagnose::faults`]: crate::calib::diagnose::faults

mod capture;
mod plant;

use std::{collections::BTreeMap, fmt::Write as _, ops::ControlFlow};

use capture::Capture;
use plant::PLANTED;

/// Multiples of the map's uncertainty by which a fault moves it.
pub const STRENGTHS: [f64; 3] = [1.0, 3.0, 10.0];
/// Shares that must be named right at the middle and the largest strength, and that may be named among the clean ones.
pub const REQUIRED: [f64; 3] = [0.70, 0.95, 0.02];

/// How often what was named; an empty name for nothing.
type Counts = BTreeMap<String, usize>;

/// What was found.
#[derive(Clone, Debug, Default)]
pub struct Study {
    clean: Counts,
    /// By fault and strength.
    planted: Vec<(&'static str, [Counts; STRENGTHS.len()])>,
    seed: u64,
}

/// Judges captures: `captures` of each fault at each strength and ten times as many clean ones. `step` is called before each fault and may
/// stop it: what was found until then is the answer.
pub fn run(captures: usize, seed: u64, step: &mut dyn FnMut(&str) -> ControlFlow<()>) -> Study {
    let mut study = Study { seed, ..Study::default() };
    if step("clean captures").is_break() {
        return study;
    }
    for k in 0..10 * captures as u64 {
        let named = Capture::new(seed + k).and_then(|c| c.named(None, 0.0));
        *study.clean.entry(named.unwrap_or_default()).or_default() += 1;
    }
    for (number, planted) in PLANTED.iter().enumerate() {
        if step(planted.code).is_break() {
            return study;
        }
        let mut counts: [Counts; STRENGTHS.len()] = Default::default();
        for k in 0..captures as u64 {
            let Some(capture) = Capture::new(seed + 100_000 * (number as u64 + 1) + k) else { continue };
            for (strength, counts) in STRENGTHS.iter().zip(&mut counts) {
                let named = capture.named(Some(planted), *strength).unwrap_or_default();
                *counts.entry(named).or_default() += 1;
            }
        }
        study.planted.push((planted.code, counts));
    }
    study
}

impl Study {
    /// Whether the requirements are met.
    pub fn holds(&self) -> bool {
        let alarms = 1.0 - share(&self.clean, "");
        alarms <= REQUIRED[2]
            && self.planted.iter().all(|(code, counts)| {
                share(&counts[1], code) >= REQUIRED[0] && share(&counts[2], code) >= REQUIRED[1]
            })
    }

    /// The page.
    pub fn markdown(&self) -> String {
        let all = |counts: &Counts| counts.values().sum::<usize>();
        let clean = all(&self.clean);
        let each = self.planted.first().map_or(0, |p| all(&p.1[0]));
        let mut page = format!(
            "# Are faults named?\n\n\
             Made by `straightedge experiment --faults --captures {each} --out docs`; do not edit.\n\n\
             Captures by random cameras and poses, corners projected, with normal noise (seed {}); thresholds were chosen on other seeds. Each has\n\
             one planted fault, as strong as moves the projection map by 1, 3 or 10 times its uncertainty without noise. *Right* is the share in\n\
             which the first finding is that fault (of a single picture: in that picture). Required: {:.0} % at 10, {:.0} % at 3, and at most {:.0} % of\n\
             clean captures with a finding.\n\n\
             Clean: {} of {clean} with a finding ({:.1} %){}\n\n\
             | planted | right at 1 | at 3 | at 10 | otherwise, at 3 | at 10 |\n|---|---|---|---|---|---|\n",
            self.seed,
            100.0 * REQUIRED[1],
            100.0 * REQUIRED[0],
            100.0 * REQUIRED[2],
            clean - self.clean.get("").copied().unwrap_or(0),
            100.0 * (1.0 - share(&self.clean, "")),
            others(&self.clean, "").map_or_else(String::new, |o| format!(": {o}")),
        );
        for (code, counts) in &self.planted {
            let right: Vec<String> =
                counts.iter().map(|c| format!("{:.0} %", 100.0 * share(c, code))).collect();
            let wrong = |k: usize| others(&counts[k], code).unwrap_or_default();
            let _ = writeln!(page, "| {} | {} | {} | {} |", code, right.join(" | "), wrong(1), wrong(2));
        }
        let verdict = if self.holds() {
            "All figures are within the bounds."
        } else {
            "**Some figures are out of bounds.**"
        };
        let _ = write!(page, "\n{verdict}\n");
        page
    }
}

fn share(counts: &Counts, code: &str) -> f64 {
    let all: usize = counts.values().sum();
    counts.get(code).copied().unwrap_or(0) as f64 / all.max(1) as f64
}

/// What else was named, and how often.
fn others(counts: &Counts, right: &str) -> Option<String> {
    let list: Vec<String> = counts
        .iter()
        .filter(|(code, _)| *code != right)
        .map(|(code, n)| format!("{} {n}", if code.is_empty() { "nothing" } else { code }))
        .collect();
    (!list.is_empty()).then(|| list.join(", "))
}

/// For the tests: the share of captures in which a fault is named right.
#[cfg(test)]
fn right(code: &str, strength: f64, captures: u64, seed: u64) -> f64 {
    let planted = PLANTED.iter().find(|p| p.code == code);
    let named = (0..captures).filter(|k| {
        let named = Capture::new(seed + k).and_then(|c| c.named(planted, strength));
        named.unwrap_or_default() == if planted.is_some() { code } else { "" }
    });
    named.count() as f64 / captures as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strong_faults_are_named_and_clean_captures_are_not_blamed() {
        let shares: Vec<_> = PLANTED.iter().map(|p| (p.code, right(p.code, 10.0, 3, 7_000_000))).collect();
        let mean = shares.iter().map(|s| s.1).sum::<f64>() / shares.len() as f64;
        assert!(mean > 0.85, "{mean}: {shares:?}");
        assert_eq!(right("", 0.0, 12, 8_000_000), 1.0);
    }
}
