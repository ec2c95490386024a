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
use plant::{PLANTED, Planted};

/// Multiples of the map's uncertainty by which a fault moves it.
pub const STRENGTHS: [f64; 3] = [1.0, 3.0, 10.0];
/// Shares that must be named right at the middle and the largest strength, and that may be named among the clean ones.
pub const REQUIRED: [f64; 3] = [0.70, 0.95, 0.02];

/// Captures that are drawn at most, for each that is judged.
const MOST_DRAWN: u64 = 50;

/// How often what was named; an empty name for nothing.
type Counts = BTreeMap<String, usize>;

/// What was found.
#[derive(Clone, Debug, Default)]
pub struct Study {
    clean: Counts,
    planted: Vec<Shown>,
    seed: u64,
}

/// What was found of one fault, by strength.
#[derive(Clone, Debug, Default)]
struct Shown {
    code: &'static str,
    counts: [Counts; STRENGTHS.len()],
    /// Captures passed over, in which the fault at its largest does not move the map so far.
    weak: [usize; STRENGTHS.len()],
}

/// Judges captures: `captures` of each fault at each strength and ten times as many clean ones. `step` is called before each fault and may
/// stop it: what was found until then is the answer. Two seeds have no capture in common.
pub fn run(captures: usize, seed: u64, step: &mut dyn FnMut(&str) -> ControlFlow<()>) -> Study {
    let mut study = Study { seed, ..Study::default() };
    if step("clean captures").is_break() {
        return study;
    }
    let first = seed.wrapping_mul(100_000_000);
    study.clean = clean(10 * captures, first);
    for (number, planted) in PLANTED.iter().enumerate() {
        if step(planted.code).is_break() {
            return study;
        }
        let first = first.wrapping_add(1_000_000 * (number as u64 + 1));
        let mut shown = Shown { code: planted.code, ..Shown::default() };
        for (k, times) in STRENGTHS.iter().enumerate() {
            (shown.counts[k], shown.weak[k]) = judged(planted, *times, captures, first);
        }
        study.planted.push(shown);
    }
    study
}

/// What is found in captures without a fault.
fn clean(captures: usize, first: u64) -> Counts {
    let mut counts = Counts::new();
    for named in (first..).filter_map(Capture::new).filter_map(|c| c.named(None)).take(captures) {
        *counts.entry(named).or_default() += 1;
    }
    counts
}

/// What is found in captures with a fault that moves the map by `times` its uncertainty, and how many were passed over until there were so
/// many, because it does not at its largest.
fn judged(planted: &Planted, times: f64, captures: usize, first: u64) -> (Counts, usize) {
    let (mut counts, mut weak, mut left) = (Counts::new(), 0, captures);
    let mut drawn = (first..first + MOST_DRAWN * captures as u64).filter_map(Capture::new);
    while left > 0
        && let Some(capture) = drawn.next()
    {
        let Some(strength) = capture.strength(planted, times) else {
            weak += 1;
            continue;
        };
        let named = capture.named(Some((planted, &strength))).unwrap_or_default();
        *counts.entry(named).or_default() += 1;
        left -= 1;
    }
    (counts, weak)
}

impl Study {
    /// Whether the requirements are met.
    pub fn holds(&self) -> bool {
        let alarms = 1.0 - share(&self.clean, "");
        alarms <= REQUIRED[2]
            && self.planted.iter().all(|Shown { code, counts, .. }| {
                share(&counts[1], code) >= REQUIRED[0] && share(&counts[2], code) >= REQUIRED[1]
            })
    }

    /// The page.
    pub fn markdown(&self) -> String {
        let all = |counts: &Counts| counts.values().sum::<usize>();
        let clean = all(&self.clean);
        let each = self.planted.first().map_or(0, |p| all(&p.counts[0]));
        let mut page = format!(
            "# Are faults named?\n\n\
             Made by `straightedge experiment --faults --captures {each} --out docs`; do not edit.\n\n\
             Captures by random cameras and poses, corners projected, with normal noise (seed {}); thresholds were chosen on other seeds, which\n\
             have no capture in common with it. Each has one planted fault, as strong as moves the projection map by 1, 3 or 10 times its\n\
             uncertainty without noise. A capture in which the fault does not reach that within the bounds of what can happen (a principal point\n\
             60 px away, a zoom of 30 %, …) is *passed over* and another drawn: at its largest it is weaker there. *Right* is the share in which\n\
             the first finding is that fault (of a single picture: in that picture). Required: {:.0} % at 10, {:.0} % at 3, and at most {:.0} % of\n\
             clean captures with a finding.\n\n\
             Clean: {} of {clean} with a finding ({:.1} %){}\n\n\
             | planted | right at 1 | at 3 | at 10 | otherwise, at 3 | at 10 | passed over, at 3 | at 10 |\n|---|---|---|---|---|---|---|---|\n",
            self.seed,
            100.0 * REQUIRED[1],
            100.0 * REQUIRED[0],
            100.0 * REQUIRED[2],
            clean - self.clean.get("").copied().unwrap_or(0),
            100.0 * (1.0 - share(&self.clean, "")),
            others(&self.clean, "").map_or_else(String::new, |o| format!(": {o}")),
        );
        for Shown { code, counts, weak } in &self.planted {
            let right: Vec<String> =
                counts.iter().map(|c| format!("{:.0} %", 100.0 * share(c, code))).collect();
            let wrong = |k: usize| others(&counts[k], code).unwrap_or_default();
            let _ = writeln!(
                page,
                "| {} | {} | {} | {} | {} | {} |",
                code,
                right.join(" | "),
                wrong(1),
                wrong(2),
                weak[1],
                weak[2]
            );
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strong_faults_are_named_and_clean_captures_are_not_blamed() {
        let right = |p: &Planted| share(&judged(p, 10.0, 3, 7_000_000).0, p.code);
        let shares: Vec<_> = PLANTED.iter().map(|p| (p.code, right(p))).collect();
        let mean = shares.iter().map(|s| s.1).sum::<f64>() / shares.len() as f64;
        assert!(mean > 0.85, "{mean}: {shares:?}");
        assert_eq!(clean(12, 8_000_000), Counts::from([(String::new(), 12)]));
    }
}
