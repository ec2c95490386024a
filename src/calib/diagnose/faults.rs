//! What may have gone wrong while the pictures were taken, each tried as a few more unknowns of the least-squares problem.
//!
//! A fault leaves a fingerprint: the residuals fall when the unknowns that describe it are let in, and by no less than chance would have
//! it. Each hypothesis ([`HYPOTHESES`], one file each) is a set of columns beside the Jacobian, with all intrinsics and poses free
//! ([`linear`]). Its evidence is the fall of the weighted squares in units of the noise, x ~ χ² with as many degrees of freedom m as
//! unknowns are determined,
//!
//! ```text
//! surprise = −2 ln P(χ²ₘ > x) − 2 ln(alternatives · hypotheses),    P(by chance) ≤ exp(−surprise/2)
//! ```
//!
//! corrected for all that was tried (Bonferroni). Where each picture may have values of its own, x is the fall for their scatter, one
//! width ([`Linear::scatter_likelihood`]): so many free values would hide it. The noise is what is left *with* the
//! hypothesis, and as smooth displacements see it: corners of one picture err alike, and then everything smooth is more likely than
//! white noise says. The most likely hypothesis is taken in, and the others are tried again beside it. A fault must also move the
//! projection map, or it is not worth a word, though it is taken in like the others: what it explains would hide them.
//!
//! The score test: C. R. Rao, "Large sample tests of statistical hypotheses", Proc. Camb. Phil. Soc. 44, 1948.

mod board;
mod column;
mod lens;
pub(super) mod linear;
mod motion;
mod outsider;
mod when;
mod zoom;

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

use super::map::Map;
use crate::calib::{
    camera::Camera, number::significant, report::Report, solution::Calibration, stats::ln_chi2_above,
    target::Target,
};
use column::Column;
use linear::{At, Fit, Fixed, Linear, Term};
use when::When;

/// A hypothesis and what the pictures say about it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fault {
    /// Stable machine-readable name.
    pub code: String,
    /// Whether it is beyond chance and moves the projection.
    pub found: bool,
    /// What is, in a few words.
    pub title: String,
    /// How large it is, in words.
    pub size: String,
    /// How large it is, in `unit`.
    pub value: f64,
    /// `%`, `px`, or that of the square.
    pub unit: String,
    /// Unknowns that describe it.
    pub unknowns: usize,
    /// Fall of the squares in units of the noise; as many as there are unknowns by chance.
    pub gain: f64,
    /// −2 ln of the chance, corrected for all that was tried.
    pub surprise: f64,
    /// RMS of the errors that it explains, px.
    pub explains_px: f64,
    /// How far the projection moves when it is let in, beyond what chance would move it then, px.
    pub moves_px: f64,
    /// Pictures that it is about, by their positions; empty where it is about all.
    pub frames: Vec<usize>,
}

/// Surprise from which a fault is none by chance, −2 ln 0.001: once in a thousand captures, if their errors were normal. Those of real
/// pictures are not, and a finding that is none costs more than one that is missed.
const SURPRISING: f64 = 13.82;
/// Share of the map's uncertainty by which a fault must move it…
const NOTABLE: f64 = 0.3;
/// …and the least that is worth a word, px.
const NOTABLE_PX: f64 = 0.003;
/// Fall of the squares, in units of the noise, that a hypothesis must bring for each of its unknowns to be preferred to another.
const PENALTY: f64 = 2.5;
/// Gain for each of its unknowns from which such a hypothesis is believed.
const OF_EACH_GAIN: f64 = 3.0;
/// Faults that are found at most.
const MOST: usize = 3;
/// Rounds of refinement with what was found.
const ROUNDS: usize = 2;
/// Views that are looked at, at most: the time grows with them, and more say nothing new.
const MOST_VIEWS: usize = 300;

/// A way in which a fault may have happened: its unknowns, and the views that it is about.
pub(super) struct Alternative {
    terms: Vec<Term>,
    views: Vec<usize>,
}

impl Alternative {
    /// About all views.
    fn of_all(terms: Vec<Term>) -> Vec<Self> {
        vec![Self { terms, views: Vec::new() }]
    }
}

/// What a hypothesis says when it is the best.
struct Words {
    title: String,
    size: String,
    value: f64,
    unit: String,
}

/// Something that may have gone wrong.
struct Hypothesis {
    code: &'static str,
    alternatives: fn(&Capture<'_>) -> Vec<Alternative>,
    words: fn(&Capture<'_>, &Best) -> Words,
}

/// All of them.
const HYPOTHESES: &[Hypothesis] = &[
    board::BOWED,
    board::ASPECT,
    zoom::ONE_PICTURE,
    zoom::STEP,
    zoom::DRIFT,
    zoom::EACH,
    motion::CENTRE_DRIFT,
    motion::SHIFTED,
    motion::ROWS,
    lens::MORE_TERMS,
    outsider::ONE_PICTURE,
];

/// What a capture is to the hypotheses.
pub(super) struct Capture<'a> {
    pub(super) report: &'a Report,
    pub(super) calibration: &'a Calibration,
    pub(super) target: &'a Target,
    pub(super) fixed: Fixed,
    pub(super) map: Map,
    /// Scatter of the map, px.
    pub(super) sigma_px: f64,
    when: When,
}

/// The best alternative of a hypothesis.
#[derive(Clone)]
struct Best {
    alternative: usize,
    alternatives: usize,
    terms: Vec<Term>,
    views: Vec<usize>,
    /// Values of `terms`.
    theta: Vec<f64>,
    fit: Fit,
    unknowns: usize,
    /// Fall of the squares, px².
    fall: f64,
    /// Where each picture has values of its own: twice the logarithm of the likelihood of their scatter.
    scatter: Option<f64>,
    /// How far the map moves, and how far beyond chance, px.
    moved_px: f64,
    moves_px: f64,
}

impl Best {
    /// Fall of the squares in units of the noise.
    fn gain(&self) -> f64 {
        self.fall / self.fit.noise
    }

    fn surprise(&self) -> f64 {
        // A width cannot be below 0: half of the chances.
        let own = self
            .scatter
            .map_or_else(|| surprise(self.gain(), self.unknowns), |l| surprise(l, 1) + 2.0 * 2f64.ln());
        own - 2.0 * ((self.alternatives * HYPOTHESES.len()) as f64).ln()
    }

    /// Whether it has two unknowns for each picture. (A focal length for each is not so easily satisfied: a board that bends displaces its
    /// corners by squares of their places, as a shift behind the lens does, and not in proportion to them.)
    fn is_of_each(&self) -> bool {
        let views = self.terms.first().map_or(0, |t| t.factors.len());
        self.views.is_empty() && self.terms.iter().all(Term::is_alone) && self.terms.len() + 2 >= 2 * views
    }

    /// To compare hypotheses that all are beyond chance: the fall for the same noise, less for each unknown (H. Akaike, 1974, who takes
    /// 2; which alternative it is counts as one).
    fn rank(&self, noise: f64) -> f64 {
        if let Some(likelihood) = self.scatter {
            return likelihood * self.fit.noise / noise - PENALTY;
        }
        self.fall / noise - PENALTY * (self.unknowns + usize::from(self.alternatives > 1)) as f64
    }
}

impl<'a> Capture<'a> {
    /// `None` where the boards do not determine the camera, or there are too many views to look at.
    pub(super) fn new(report: &'a Report, calibration: &'a Calibration, target: &'a Target) -> Option<Self> {
        if calibration.views.len() > MOST_VIEWS || calibration.free.is_empty() {
            return None;
        }
        let fixed = Fixed::new(calibration, target)?;
        let map = Map::new(calibration, target, &fixed.slots)?;
        let sigma_px = map.scatters(&calibration.covariance)?;
        let when = When::new(report, calibration);
        Some(Self { report, calibration, target, fixed, map, sigma_px, when })
    }

    fn views(&self) -> usize {
        self.calibration.views.len()
    }

    fn start(&self) -> At {
        At {
            camera: self.calibration.camera.clone(),
            poses: self.calibration.views.iter().map(|v| v.camera_from_board).collect(),
            theta: Vec::new(),
        }
    }

    /// A term for all views.
    fn everywhere(&self, column: Column) -> Term {
        Term { column, factors: vec![1.0; self.views()] }
    }

    /// A term for one view.
    fn alone(&self, column: Column, view: usize) -> Term {
        let mut factors = vec![0.0; self.views()];
        factors[view] = 1.0;
        Term { column, factors }
    }

    /// A term that grows with time by 1 in all, from the first picture to the last, which has the camera's own value: that of today.
    fn growing(&self, column: Column) -> Term {
        Term { column, factors: self.when.at.clone() }
    }

    /// The name of the picture of a view.
    fn name(&self, view: usize) -> &str {
        let position = self.calibration.views[view].frame.0 as usize;
        self.report.frames.get(position).map_or("a picture", |f| f.stem())
    }

    fn positions(&self, views: &[usize]) -> Vec<usize> {
        views.iter().map(|v| self.calibration.views[*v].frame.0 as usize).collect()
    }

    /// How far the map moves with the terms in: what belongs to the camera displaces it too.
    fn moves_px(&self, terms: &[Term], fit: &Fit) -> f64 {
        let camera = &self.calibration.camera;
        let centre = [camera.params[2], camera.params[3]];
        let of_lens = |px: &Vector2<f64>| {
            let all = terms.iter().zip(&fit.theta).filter(|(t, _)| Column::LENS.contains(&t.column.index()));
            all.map(|(t, v)| t.column.in_picture_at(px, centre, camera.size_px) * *v).sum()
        };
        self.map.moves(&fit.intrinsics, &of_lens)
    }

    /// The best alternative of a hypothesis beside terms that are in; `known` is their fit.
    fn best(&self, linear: &Linear<'_>, hypothesis: &Hypothesis, base: &[Term], known: &Fit) -> Option<Best> {
        let list = (hypothesis.alternatives)(self);
        let alternatives = list.len();
        let fits = list.into_iter().enumerate().filter_map(|(alternative, a)| {
            let terms = [base, &a.terms].concat();
            let fit = linear.fit(&terms)?;
            let unknowns = fit.rank.checked_sub(known.rank).filter(|m| *m > 0)?;
            let (fall, theta) = (known.left - fit.left, fit.theta[base.len()..].to_vec());
            Some(Best {
                alternative,
                alternatives,
                terms: a.terms,
                views: a.views,
                theta,
                fit,
                unknowns,
                fall,
                scatter: None,
                moved_px: 0.0,
                moves_px: 0.0,
            })
        });
        let mut best = fits.max_by(|a, b| a.fall.total_cmp(&b.fall))?;
        if best.views.is_empty() && best.terms.iter().all(Term::is_alone) {
            best.scatter = linear.scatter_likelihood(base, &best.terms, &best.theta, best.fit.noise);
        }
        // Beside what is in already.
        let mut alone = best.fit.clone();
        alone.intrinsics -= &known.intrinsics;
        alone.theta.iter_mut().zip(&known.theta).for_each(|(v, before)| *v -= before);
        best.moved_px = self.moves_px(&[base, &best.terms].concat(), &alone);
        // Terms that hardly show scatter, and move the camera by chance: that is no effect.
        let still = |_: &Vector2<f64>| Vector2::zeros();
        let own = best.fit.scatter.row_iter().skip(base.len());
        let chance: f64 = own.map(|row| self.map.moves(&row.transpose(), &still).powi(2)).sum();
        // What belongs to the lens makes good what the intrinsics do.
        let of_lens = best.terms.iter().any(|t| Column::LENS.contains(&t.column.index()));
        let chance = if of_lens { 0.0 } else { best.fit.noise * chance };
        best.moves_px = (best.moved_px.powi(2) - chance).max(0.0).sqrt();
        Some(best)
    }

    /// The same after a few more steps with it in, where the first was linear.
    fn refined(&self, base: &[Term], known: &Fit, best: &mut Best) -> Option<()> {
        let terms = [base, &best.terms].concat();
        let mut at = self.start();
        at.theta = vec![0.0; terms.len()];
        let mut fit = best.fit.clone();
        let mut linear = Linear::new(&self.fixed, &at, &terms)?;
        for _ in 0..ROUNDS {
            at = linear.step(&at, &terms, &fit);
            linear = Linear::new(&self.fixed, &at, &terms)?;
            fit = linear.fit(&terms)?;
        }
        // What explains leaves less noise; where the steps ran away it is more.
        if fit.noise < known.noise && known.left - fit.left > 0.5 * best.fall {
            let fall = known.left - fit.left;
            best.scatter = best.scatter.map(|l| l * fall / best.fall * best.fit.noise / fit.noise);
            best.fall = fall;
            best.theta =
                at.theta[base.len()..].iter().zip(&fit.theta[base.len()..]).map(|(a, b)| a + b).collect();
            best.fit.noise = fit.noise;
        }
        Some(())
    }

    /// Whether what is beyond chance is large enough to be believed: boards that give way, each in its own manner, look a little like
    /// anything that may differ from picture to picture.
    fn is_believed(&self, best: &Best) -> bool {
        !best.is_of_each() || best.gain() >= OF_EACH_GAIN * best.unknowns as f64
    }

    /// Whether it moves the projection by more than nobody notices.
    fn matters(&self, best: &Best) -> bool {
        best.moved_px > (NOTABLE * self.sigma_px).max(NOTABLE_PX)
    }

    fn fault(&self, hypothesis: &Hypothesis, best: &Best, found: bool) -> Fault {
        let Words { title, size, value, unit } = (hypothesis.words)(self, best);
        let corners: usize = self.calibration.views.iter().map(|v| v.indices.len()).sum();
        Fault {
            code: hypothesis.code.to_owned(),
            found,
            title,
            size,
            value,
            unit,
            unknowns: best.unknowns,
            gain: best.gain(),
            surprise: best.surprise(),
            explains_px: (best.fall.max(0.0) / corners.max(1) as f64).sqrt(),
            moves_px: best.moves_px,
            frames: self.positions(&best.views),
        }
    }
}

/// −2 ln P(χ² > x) with `m` degrees of freedom.
fn surprise(x: f64, m: usize) -> f64 {
    -2.0 * ln_chi2_above(x, m)
}

/// Every hypothesis with what the pictures say about it: those found first, in the order of their evidence, then the others.
pub(super) fn of(capture: &Capture<'_>) -> Vec<Fault> {
    let mut list = outsider::set_aside(capture);
    list.extend(fitted(capture).unwrap_or_default());
    list
}

fn fitted(capture: &Capture<'_>) -> Option<Vec<Fault>> {
    let linear = Linear::new(&capture.fixed, &capture.start(), &[])?;
    let (mut base, mut list) = (Vec::new(), Vec::<Fault>::new());
    loop {
        let known = linear.fit(&base)?;
        let rest = HYPOTHESES.iter().filter(|h| !list.iter().any(|f| f.code == h.code));
        let mut tried: Vec<(&Hypothesis, Best)> =
            rest.filter_map(|h| Some((h, capture.best(&linear, h, &base, &known)?))).collect();
        let mut likely: Vec<usize> =
            (0..tried.len()).filter(|k| tried[*k].1.surprise() > SURPRISING).collect();
        if list.iter().filter(|f| f.found).count() == MOST {
            likely.clear();
        }
        for k in &likely {
            capture.refined(&base, &known, &mut tried[*k].1);
        }
        let noise = likely.iter().map(|k| tried[*k].1.fit.noise).fold(f64::INFINITY, f64::min);
        let rank = |k: &usize| tried[*k].1.rank(noise);
        // The best explanation must be believed: the next best would be a wrong one.
        let best = likely.into_iter().max_by(|a, b| rank(a).total_cmp(&rank(b)));
        let Some(next) = best.filter(|k| capture.is_believed(&tried[*k].1)) else {
            let (mut all, quiet): (Vec<Fault>, Vec<Fault>) = list.into_iter().partition(|f| f.found);
            all.extend(quiet);
            all.extend(tried.iter().map(|(h, best)| capture.fault(h, best, false)));
            return Some(all);
        };
        // What does not matter is there nevertheless, and would hide what does.
        let (hypothesis, best) = tried.swap_remove(next);
        list.push(capture.fault(hypothesis, &best, capture.matters(&best)));
        base.extend(best.terms);
    }
}

/// A size with its unit.
fn size(value: f64, unit: &str) -> String {
    format!("{} {unit}", significant(value.abs(), 2))
}

/// Root of the mean square.
fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

/// Every hypothesis about a calibration that is in a report, in the order of [`Report::sources`](crate::calib::report::Report); empty where
/// there is nothing to tell.
pub fn of_calibration(report: &Report, calibration: &Calibration, target: &Target) -> Vec<Fault> {
    Capture::new(report, calibration, target).map(|c| of(&c)).unwrap_or_default()
}

/// The projection map of a calibration, to measure others by.
pub struct MapOf {
    map: Map,
    sigma_px: f64,
}

impl MapOf {
    /// `None` where the boards do not determine it.
    pub fn new(calibration: &Calibration, target: &Target) -> Option<Self> {
        let fixed = Fixed::new(calibration, target)?;
        let map = Map::new(calibration, target, &fixed.slots)?;
        let sigma_px = map.scatters(&calibration.covariance)?;
        Some(Self { map, sigma_px })
    }

    /// Its scatter, px.
    pub const fn sigma_px(&self) -> f64 {
        self.sigma_px
    }

    /// How far the maps of two cameras are apart, px.
    pub fn between(&self, from: &Camera, to: &Camera) -> Option<f64> {
        self.map.between(from, to)
    }
}
