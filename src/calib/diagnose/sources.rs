//! The seven sources of calibration error of the source document's Table V, measured: one card each, all in px of the projection map
//! ([`map`](super::map)), so that they rank.
//!
//! Random errors are compared with what would be otherwise: the same camera with its boards elsewhere, with depth, with less noise. The
//! covariance of each is known without a picture, and the cost of a source is √(σ² − σ²otherwise). Systematic ones are the faults that
//! the residuals show ([`faults`]).

mod checklist;
mod conditioning;
mod corners;
mod cross;
mod degeneracy;
mod diversity;
mod environment;
mod lens;
mod resolution;

use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};
use std::ops::ControlFlow;

use super::{
    Level, Remedy, Show,
    faults::{self, Capture, Fault},
};
use crate::calib::{number::significant, report::Report, solution::Calibration, target::Target};
pub use checklist::Rule;
pub use cross::CrossValidation;
pub(super) use environment::{advice, show};

/// One source of error.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Source {
    /// Stable machine-readable name.
    pub code: String,
    /// As in Table V.
    pub title: String,
    /// What it costs: RMS error of the projection map, px.
    pub px: f64,
    /// How serious that is.
    pub level: Level,
    /// One sentence of evidence.
    pub text: String,
    /// Where the evidence is.
    pub show: Show,
    /// What helps, where the program can do it.
    pub remedy: Option<Remedy>,
    /// What helps, in words.
    pub advice: String,
}

/// All that was measured.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sources {
    /// 1σ of the projection map, px: RMS over the nine tenths of the picture that are known best.
    pub map_px: f64,
    /// The seven, the most costly first.
    pub cards: Vec<Source>,
    /// The source document's rules, and whether they are needed here.
    pub rules: Vec<Rule>,
    /// Every fault that was tried, those found first.
    pub faults: Vec<Fault>,
    /// How the answer changes with the pictures; none where there are too few.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cross_validation: Option<CrossValidation>,
}

/// Certainty, or error, that nobody notices, px.
const NOTHING_PX: f64 = 0.1;
/// That matters to measurements, px.
const MATTERS_PX: f64 = 0.3;
/// Beyond which a place is a guess, px.
const GUESS_PX: f64 = 1.0;

/// What cards are made from.
struct Facts<'a> {
    capture: &'a Capture<'a>,
    faults: &'a [Fault],
}

/// A card before its rank.
struct Card {
    px: f64,
    text: String,
    show: Show,
    remedy: Option<Remedy>,
    advice: String,
}

/// A source of Table V.
struct Kind {
    code: &'static str,
    title: &'static str,
    measure: fn(&Facts<'_>) -> Card,
}

/// In the order of Table V.
const KINDS: [Kind; 7] = [
    Kind { code: "corners", title: "Corner detection and localisation", measure: corners::card },
    Kind { code: "diversity", title: "Insufficient view diversity", measure: diversity::card },
    Kind { code: "lens_model", title: "Distortion model incompleteness", measure: lens::card },
    Kind { code: "degeneracy", title: "Planar target degeneracy", measure: degeneracy::card },
    Kind { code: "resolution", title: "Image resolution and quantisation", measure: resolution::card },
    Kind { code: "conditioning", title: "Numerical conditioning", measure: conditioning::card },
    Kind { code: "environment", title: "Environmental and physical factors", measure: environment::card },
];

/// Measures all sources; `None` where the boards do not determine the camera, there are more pictures than can be looked at, or `report`
/// breaks.
pub fn of(
    report: &Report,
    calibration: &Calibration,
    target: &Target,
    tick: &mut dyn FnMut(f32) -> ControlFlow<()>,
) -> Option<Sources> {
    let capture = Capture::new(report, calibration, target)?;
    let mut at = |part: f32| if tick(part).is_break() { None } else { Some(()) };
    at(0.0)?;
    let faults = faults::of(&capture);
    let facts = Facts { capture: &capture, faults: &faults };
    let mut cards = Vec::with_capacity(KINDS.len());
    for (k, kind) in KINDS.iter().enumerate() {
        at(0.4 + 0.05 * k as f32)?;
        let Card { px, text, show, remedy, advice } = (kind.measure)(&facts);
        let px = if px.is_finite() { px.max(0.0) } else { 0.0 };
        let (code, title) = (kind.code.to_owned(), kind.title.to_owned());
        cards.push(Source { code, title, px, level: level(px), text, show, remedy, advice });
    }
    let rules = checklist::rules(&capture, &cards);
    crate::calib::order::by(&mut cards, |card| [-card.px]);
    at(0.8)?;
    let cross_validation = cross::of(&capture);
    Some(Sources { map_px: capture.sigma_px, cards, rules, faults, cross_validation })
}

fn level(px: f64) -> Level {
    match px {
        px if px < NOTHING_PX => Level::Good,
        px if px < MATTERS_PX => Level::Info,
        px if px < GUESS_PX => Level::Warn,
        _ => Level::Bad,
    }
}

impl Facts<'_> {
    /// What a scatter costs beside another that could be had, px.
    fn beyond(&self, otherwise: Option<&DMatrix<f64>>) -> f64 {
        let sigma0 = self.capture.calibration.sigma0_px;
        let other = otherwise.and_then(|unit| self.capture.map.scatters(&(unit * sigma0.powi(2))));
        other.map_or(0.0, |other| beyond(self.capture.sigma_px, other))
    }

    fn found(&self, code: &str) -> Option<&Fault> {
        self.faults.iter().find(|f| f.found && f.code == code)
    }
}

/// The part of a scatter that another does not have.
fn beyond(sigma: f64, other: f64) -> f64 {
    (sigma * sigma - other * other).max(0.0).sqrt()
}

fn px(value: f64) -> String {
    if value < 0.001 { "less than 0.001 px".to_owned() } else { format!("{} px", significant(value, 2)) }
}

impl Sources {
    /// What the parts of the pictures say about each other, in one sentence.
    pub fn cross_words(&self) -> Option<String> {
        let c = self.cross_validation.as_ref()?;
        Some(format!(
            "Two halves of {} poses differ by {} ({} by chance); leaving out a fifth moves the projection by {}; error in pictures left out {}, in those fitted {}",
            c.poses,
            px(c.halves_px),
            px(c.halves_by_chance_px),
            px(c.folds_px),
            px(c.held_out_px),
            px(c.fitted_px)
        ))
    }
}

impl Rule {
    /// Whether it is kept, or need not be, in a word.
    pub const fn word(&self) -> &'static str {
        match (self.kept, self.needless) {
            (true, _) => "kept",
            (false, true) => "not needed: σ is small without",
            (false, false) => "not kept",
        }
    }
}

impl Source {
    /// What it costs, in words.
    pub fn cost(&self) -> String {
        px(self.px)
    }
}
