//! Which camera model: the simplest whose error on pictures that it was not fitted to is as small as any.
//!
//! The RMS of a fit falls with every term, whatever the lens. So every model is fitted several times, each time without a fold of
//! the pictures, and asked about those ([`folds`]: pictures of one pose are in one fold, or they would not be new to the model). The
//! pose of a board in a left-out picture is found with the camera held, so its residuals say what the camera cannot explain.
//!
//! M. Stone, "Cross-validatory choice and assessment of statistical predictions", J. R. Statist. Soc. B 36(2), 1974.

mod folds;
mod splined;

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};
use std::{collections::BTreeMap, ops::ControlFlow};

pub use splined::{COLUMNS, SplinedCandidate, splined};

use super::{Problem, as_given, calibrate, choose::worth_trying, pose_of};
use crate::{
    Error, Result,
    camera::Model,
    observation::{FrameId, Observation},
    order,
    solution::Calibration,
    target::Target,
    uncertainty,
};

/// Models that are compared where none is asked for, simplest first.
pub const CANDIDATES: [Model; 10] = [
    Model::Pinhole,
    Model::Radial1,
    Model::Radial2,
    Model::Brown4,
    Model::Brown5,
    Model::Rational,
    Model::ThinPrism,
    Model::Eucm,
    Model::Ds,
    Model::Kb4,
];

/// A model that errs by this factor more than the best on new pictures is as good, whatever the scatter.
const AS_GOOD: f64 = 1.0025;
/// Beyond this factor it is not as good, even where the pictures are too few to be sure.
const WORSE: f64 = 1.005;
/// A sound model may err by this factor more than one with something against it: else the latter is taken, with its warning.
const TOLERABLE: f64 = 1.1;
/// Share of the left-out pictures that a model must be able to answer about.
const EXPLAINED: f64 = 0.8;
/// Standard errors over the pictures from which a difference is one.
const SURE: f64 = 2.0;
/// Warnings that speak against a model, whatever its errors, in few words.
const ABSURD: [(&str, &str); 3] = [
    ("focal_absurd", "a focal length that no ordinary lens has"),
    ("model_folds", "folds inside the picture"),
    ("not_converged", "did not converge"),
];

/// How one model fares.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Candidate {
    /// The model.
    pub model: Model,
    /// Intrinsics that were estimated.
    pub free: usize,
    /// √(Σ|r|²/N) of the fit to all pictures, px.
    pub rms_px: f64,
    /// The same in pictures that were left out of the fit, over the corners that no model calls outliers, px; `None` where a part of the
    /// pictures does not determine the model.
    pub held_out_px: Option<f64>,
    /// 1σ of the projection in the worst corner of the picture at the distance of the boards, px ([`uncertainty`]).
    pub worst_corner_px: Option<f64>,
    /// Coefficients that cannot be told from zero.
    pub unobservable: Vec<String>,
    /// What speaks against it whatever its errors, in words; empty where nothing does.
    pub against: String,
}

impl Candidate {
    /// What is to be said beside its numbers; `recommended` is the model of [`Comparison::recommended`].
    pub fn note(&self, recommended: Model) -> String {
        match &self.against {
            _ if self.model == recommended => "recommended".to_owned(),
            against if !against.is_empty() => against.clone(),
            _ if self.unobservable.is_empty() => String::new(),
            _ => format!("{} not told from zero", self.unobservable.join(", ")),
        }
    }
}

/// Models side by side.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Comparison {
    /// Those that could be fitted, simplest first.
    pub candidates: Vec<Candidate>,
    /// The one to use.
    pub recommended: Model,
    /// Why, in one sentence.
    pub why: String,
    /// Into how many parts the pictures were divided.
    pub folds: usize,
    /// A splined camera beside the recommended model, where that was asked for ([`splined()`]) and could be fitted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub splined: Option<SplinedCandidate>,
}

/// A model's fit and its squared errors in left-out pictures: sum and number of corners by group of pictures.
struct Tried {
    calibration: Calibration,
    errors: Option<BTreeMap<usize, (f64, usize)>>,
}

impl Tried {
    fn held_out_px(&self) -> Option<f64> {
        let (sum, n) = self.errors.as_ref()?.values().fold((0.0, 0), |(s, n), e| (s + e.0, n + e.1));
        (n > 0).then(|| (sum / n as f64).sqrt())
    }

    fn against(&self) -> Option<&'static str> {
        let warnings = &self.calibration.warnings;
        ABSURD.iter().find(|(code, _)| warnings.iter().any(|w| w.code == *code)).map(|(_, words)| *words)
    }
}

/// Fits and judges `models`, simplest first. Fisheye models are left out where a perspective one leaves nothing to explain.
///
/// `tick` gets the share of the work done, 0..1, and may stop it. Cost: a calibration for each model and each of up to ten folds.
///
/// # Errors
/// The reason of the last model where none can be fitted; [`Error::Stopped`] where `tick` breaks.
pub fn compare(
    problem: &Problem,
    models: &[Model],
    tick: &mut dyn FnMut(f32) -> ControlFlow<()>,
) -> Result<Comparison> {
    let mut failure = Error::Invalid("no camera model was asked for".to_owned());
    let mut fits = Vec::new();
    let half = models.len().max(1) as f32 * 2.0;
    for (k, &model) in models.iter().enumerate() {
        if !worth_trying(model, &fits) {
            continue;
        }
        let mut share = |part: f32| tick((k as f32 + part) / half);
        match calibrate(&with(problem, model), &mut share) {
            Ok(calibration) => fits.push(calibration),
            Err(Error::Stopped) => return Err(Error::Stopped),
            Err(error) => failure = error,
        }
    }
    let Some(reference) = fits.iter().min_by(|a, b| a.rms_inliers_px.total_cmp(&b.rms_inliers_px)) else {
        return Err(failure);
    };
    let inliers = Inliers::of(reference);
    let parts = folds::of(&problem.observations, problem.cameras.first().map_or([0; 2], |c| c.size_px));
    let count = fits.len() as f32 * 2.0;
    let mut tried = Vec::with_capacity(fits.len());
    for (k, calibration) in fits.into_iter().enumerate() {
        let mut share = |part: f32| tick(0.5 + (k as f32 + part) / count);
        let errors =
            held_out(problem, &calibration, &parts, &inliers, &by_model(&problem.target), &mut share)?;
        tried.push(Tried { calibration, errors });
    }
    to_common_groups(&mut tried);
    let chosen = simplest_as_good(&tried);
    let recommended = tried[chosen].calibration.camera.model;
    Ok(Comparison {
        splined: None,
        recommended,
        why: why(&tried, chosen),
        folds: parts.folds.len(),
        candidates: tried.iter().map(|t| candidate(problem, t)).collect(),
    })
}

/// Models are compared on the same pictures: those that all can answer about.
fn to_common_groups(tried: &mut [Tried]) {
    let all = tried.iter().filter_map(|t| t.errors.as_ref());
    let groups = all.map(|errors| order::set(errors.keys().copied()));
    let Some(common) = groups.reduce(|a, b| &a & &b) else { return };
    for errors in tried.iter_mut().filter_map(|t| t.errors.as_mut()) {
        errors.retain(|group, _| common.contains(group));
    }
}

fn with(problem: &Problem, model: Model) -> Problem {
    let mut problem = problem.clone();
    problem.cameras.iter_mut().for_each(|c| c.model = model);
    problem
}

/// Corners that a calibration does not call outliers.
struct Inliers(BTreeMap<FrameId, Vec<u32>>);

impl Inliers {
    fn of(calibration: &Calibration) -> Self {
        let keep = |v: &crate::solution::View| {
            (v.frame, v.indices.iter().copied().filter(|i| !v.outliers.contains(i)).collect())
        };
        Self(calibration.views.iter().map(keep).collect())
    }

    fn squares(&self, observation: &Observation, residuals: &[Vector2<f64>]) -> (f64, usize) {
        let Some(kept) = self.0.get(&observation.frame) else { return (0.0, 0) };
        let all = observation.corners.iter().zip(residuals);
        all.filter(|(corner, _)| kept.contains(&corner.index))
            .fold((0.0, 0), |(sum, n), (_, r)| (sum + r.norm_squared(), n + 1))
    }
}

/// What is left (px) of the corners of pictures that a fit was not made from, each with its pose free; `None` where it cannot tell.
type Ask<'a> = &'a dyn Fn(&Calibration, &[&Observation]) -> Vec<Option<Vec<Vector2<f64>>>>;

/// [`Ask`] of the model that was fitted.
fn by_model(target: &Target) -> impl Fn(&Calibration, &[&Observation]) -> Vec<Option<Vec<Vector2<f64>>>> {
    move |fitted, left| {
        left.iter().map(|o| Some(pose_of(&fitted.camera, target, &o.corners).ok()?.1)).collect()
    }
}

/// Squared errors by group in the pictures that each fold leaves out; `None` where one cannot be fitted, or too many pictures lie beyond
/// the reach of its fits.
fn held_out(
    problem: &Problem,
    whole: &Calibration,
    parts: &folds::Folds,
    inliers: &Inliers,
    ask: Ask<'_>,
    tick: &mut dyn FnMut(f32) -> ControlFlow<()>,
) -> Result<Option<BTreeMap<usize, (f64, usize)>>> {
    let mut errors = BTreeMap::new();
    for (k, fold) in parts.folds.iter().enumerate() {
        let mut rest = with(problem, whole.camera.model);
        rest.observations = fold.fitted.iter().map(|&i| problem.observations[i].clone()).collect();
        rest.cameras.iter_mut().for_each(|c| c.start = Some(whole.camera.clone()));
        let mut share = |part: f32| tick((k as f32 + part) / parts.folds.len() as f32);
        // Whether pictures determine the model was asked of all of them; what a part makes of it shows in what it says of the others.
        let fitted = match as_given(&rest, false, &mut share) {
            Ok(fitted) => fitted,
            Err(Error::Stopped) => return Err(Error::Stopped),
            Err(_) => return Ok(None),
        };
        // A picture that the whole set could not use says nothing about a model.
        let left_out = fold.left_out.iter().map(|&i| (i, &problem.observations[i]));
        let (positions, left_out): (Vec<usize>, Vec<&Observation>) =
            left_out.filter(|(_, o)| inliers.0.contains_key(&o.frame)).unzip();
        for ((i, observation), residuals) in positions.into_iter().zip(&left_out).zip(ask(&fitted, &left_out))
        {
            // What lies beyond the reach of a fit tells nothing about its errors.
            let Some(residuals) = residuals else { continue };
            let (sum, n) = inliers.squares(observation, &residuals);
            let group = errors.entry(parts.group[i]).or_insert((0.0, 0));
            *group = (group.0 + sum, group.1 + n);
        }
    }
    let asked = parts.folds.iter().flat_map(|f| &f.left_out).map(|&i| parts.group[i]);
    let asked = order::set(asked).len() as f64;
    Ok((!errors.is_empty() && errors.len() as f64 >= EXPLAINED * asked).then_some(errors))
}

/// The simplest model that is as good as the best on new pictures, among those with nothing against them where one of these comes near;
/// where no model could be asked about new pictures, the first.
fn simplest_as_good(tried: &[Tried]) -> usize {
    let error = |i: usize| tried[i].held_out_px().unwrap_or(f64::INFINITY);
    let least = |of: &[usize]| of.iter().copied().min_by(|a, b| error(*a).total_cmp(&error(*b)));
    let all: Vec<usize> = (0..tried.len()).collect();
    let sound: Vec<usize> = all.iter().copied().filter(|&i| tried[i].against().is_none()).collect();
    let Some(best) = least(&all) else { return 0 };
    let (pool, best) = match least(&sound) {
        Some(least) if error(least) <= TOLERABLE * error(best) => (sound, least),
        _ => (all, best),
    };
    let as_good = |i: &usize| {
        error(*i) <= AS_GOOD * error(best)
            || error(*i) <= WORSE * error(best) && !surely_worse(&tried[*i], &tried[best])
    };
    let free = |i: &usize| tried[*i].calibration.free.len();
    let simpler = |a: &usize, b: &usize| free(a).cmp(&free(b)).then(error(*a).total_cmp(&error(*b)));
    pool.iter().copied().filter(as_good).min_by(simpler).unwrap_or(best)
}

/// Whether the mean squared error of a model is larger than another's by several standard errors over the groups of pictures.
fn surely_worse(a: &Tried, b: &Tried) -> bool {
    let (Some(of_a), Some(of_b)) = (&a.errors, &b.errors) else { return a.errors.is_none() };
    let mean = |e: &(f64, usize)| e.0 / e.1.max(1) as f64;
    let differences: Vec<f64> =
        of_a.iter().filter_map(|(group, e)| Some(mean(e) - mean(of_b.get(group)?))).collect();
    let n = differences.len() as f64;
    let average = differences.iter().sum::<f64>() / n;
    let variance = differences.iter().map(|d| (d - average).powi(2)).sum::<f64>() / (n - 1.0);
    average > SURE * (variance / n).sqrt()
}

fn candidate(problem: &Problem, tried: &Tried) -> Candidate {
    let fit = &tried.calibration;
    Candidate {
        model: fit.camera.model,
        free: fit.free.len(),
        rms_px: fit.rms_px,
        held_out_px: tried.held_out_px(),
        worst_corner_px: uncertainty::of(fit, &problem.target, uncertainty::Range::Boards).worst_corner_px,
        unobservable: fit.unobservable().into_iter().map(str::to_owned).collect(),
        against: tried.against().unwrap_or_default().to_owned(),
    }
}

/// Why the chosen one: what the next richer model would bring, or the simpler one cost.
fn why(tried: &[Tried], chosen: usize) -> String {
    let own = &tried[chosen];
    let title = |t: &Tried| t.calibration.camera.spec().title;
    let Some(error) = own.held_out_px() else {
        return format!(
            "{}: the pictures are too few to leave some out and ask a model about them",
            title(own)
        );
    };
    let mut text = format!("{} errs by {error:.3} px in pictures that it was not fitted to", title(own));
    let terms = |t: &Tried| t.calibration.free.len();
    if own.against().is_some() {
        text += ", which no sound model comes near; it is no good where the board never was";
    }
    let perspective = |t: &Tried| t.calibration.camera.spec().perspective;
    let others = || tried.iter().filter(|t| t.against().is_none() && perspective(t) == perspective(own));
    let asked = || others().filter_map(|t| Some((t, t.held_out_px()?)));
    if let Some((t, e)) = asked().filter(|(t, _)| terms(t) > terms(own)).max_by_key(|(t, _)| terms(t)) {
        let better = if e < error { "hardly better" } else { "no better" };
        text += &format!("; {} is {better} ({e:.3} px)", title(t));
        let unobservable = t.calibration.unobservable();
        if !unobservable.is_empty() {
            text += &format!(", with {} unobservable", unobservable.join(", "));
        }
    }
    if let Some((t, e)) = asked().filter(|(t, _)| terms(t) < terms(own)).max_by_key(|(t, _)| terms(t)) {
        text += &format!("; {} errs by {e:.3} px", title(t));
    }
    text
}
