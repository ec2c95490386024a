//! Where the refinement begins: several guesses of the camera, tried on a thinned set of views and corners.
//!
//! A wrong start can end in a wrong minimum (a real set of wide-angle pictures goes to a focal length five times too long
//! from the middle of the usual range), so guesses over the whole range of lenses are refined on at most [`VIEWS`] views ×
//! [`CORNERS`] corners, whatever the size of the problem, and the best goes on to the full refinement. Least squares comes
//! first, because a robust loss is slow from far away; where several guesses meet, the robust refinement is done once.

use nalgebra::{Matrix3, Vector2};
use std::ops::ControlFlow;

use super::{
    CameraSetup, Options, Problem,
    options::Constraints,
    prepare::{Seen, first_pose},
    robust, unless_stopped,
};
use crate::{
    Error, Result,
    camera::{Camera, LANES, Model},
    order,
    refine::{self, Limits, Refined, State, block::Block},
    solution::{ClosedForm, Start, Starts},
    zhang,
};

const VIEWS: usize = 8;
const CORNERS: usize = 16;
const ROUGH: Limits = Limits { iterations: 14, tolerance: 1e-2, damping: 1e-3, enough: None };
const FINE: Limits = Limits { iterations: 20, tolerance: 1e-3, damping: 1e-6, enough: None };
/// Focal lengths that are tried, in picture widths, from fisheye to tele; neighbours are not tried one after the other.
pub(super) const FOCALS: [f64; 5] = [0.6, 1.8, 0.35, 4.0, 1.0];
/// The same for lenses that need not be perspective ones: 0.25 widths are 230° over the picture, and less where the circle is smaller.
pub(super) const FISHEYE_FOCALS: [f64; 5] = [0.35, 0.6, 0.25, 1.8, 1.0];
/// Of these at least so many are tried…
const BLIND: usize = 2;
/// …and the others not, where so many guesses of all kinds met at the best optimum.
const ENOUGH: usize = 4;

/// A guess of all parameters.
struct Guess {
    name: String,
    params: Vec<f64>,
}

/// What the starts found.
pub(super) struct Chosen {
    /// Best parameters.
    pub(super) params: Vec<f64>,
    /// Other optima that fit nearly as well, best first.
    pub(super) rivals: Vec<Vec<f64>>,
    pub(super) starts: Starts,
    pub(super) closed_form: ClosedForm,
    /// Singular values of Zhang's system.
    pub(super) singular_values: [f64; 5],
}

/// Tries all starts.
pub(super) fn choose(
    problem: &Problem,
    views: &[Seen],
    constraints: &Constraints,
    report: &mut dyn FnMut() -> ControlFlow<()>,
) -> Result<Chosen> {
    let setup = &problem.cameras[0];
    let linear = linear(problem, views);
    let guesses = guesses(problem, constraints, &linear);
    let closed_form = closed_form(problem, views, &linear);
    let chosen = diverse(views);
    // One view of a solid thing may be all there is.
    let corners =
        if views.iter().any(|v| v.plane.is_solid()) { CORNERS * VIEWS / chosen.len() } else { CORNERS };
    let blocks: Vec<Block> = chosen.iter().map(|&i| thinned(&views[i], corners)).collect();
    let bent = views.iter().map(|v| v.bent_px).fold(0.0, f64::max);
    let plain = refine::Problem {
        spec: setup.model.spec(),
        free: &constraints.free,
        blocks: &blocks,
        huber_px: None,
        single_precision: false,
    };
    // Generous: it only has to keep one bad picture from ruling the choice.
    let robust = refine::Problem { huber_px: Some(3.0 * bent.max(0.3)), ..plain };
    let mut tried: Vec<(Start, Option<(Vec<f64>, f64)>)> = Vec::new();
    let mut met: Vec<(Refined, Option<Refined>)> = Vec::new();
    let spared = guesses.len().saturating_sub(FOCALS.len() - BLIND);
    for (i, Guess { name, params }) in guesses.into_iter().enumerate() {
        let costs = tried.iter().filter_map(|(_, r)| Some(r.as_ref()?.1));
        let least = costs.clone().fold(f64::INFINITY, f64::min);
        if i >= spared && costs.filter(|c| *c <= least).count() >= ENOUGH {
            break;
        }
        let mut start = Start { name, focal_px: params[0], rms_px: None };
        let poses: Option<Vec<_>> =
            chosen.iter().map(|&i| first_pose(&views[i], setup.model.spec(), &params)).collect();
        let rough = match poses {
            Some(poses) => attempt(&plain, &State { params, poses }, ROUGH, report)?,
            None => None,
        };
        let Some(rough) = rough else {
            tried.push((start, None));
            continue;
        };
        let place = match met.iter().position(|(other, _)| meets(&rough, other)) {
            Some(place) => place,
            None => {
                let fine = attempt(&robust, &rough.state, FINE, report)?;
                met.push((rough, fine));
                met.len() - 1
            }
        };
        let fine = met[place].1.as_ref();
        start.rms_px = fine.and_then(|r| Some(r.iterations.last()?.rms_px));
        tried.push((start, fine.map(|r| (r.state.params.clone(), r.cost))));
    }
    let best = tried
        .iter()
        .filter_map(|(_, r)| r.as_ref())
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .cloned()
        .ok_or_else(|| {
            Error::Degenerate(
                "no start of the refinement sees the board: check the board size and that all pictures are from one camera"
                    .into(),
            )
        })?;
    let near = |p: &[f64]| (0..2).all(|i| (p[i] / best.0[i] - 1.0).abs() < 0.05);
    let agreeing = tried.iter().filter(|t| t.1.as_ref().is_some_and(|(p, _)| near(p))).count();
    let mut rivals: Vec<(Vec<f64>, f64)> = tried
        .iter()
        .filter_map(|t| t.1.clone())
        .filter(|(p, cost)| !near(p) && *cost < 2.0 * best.1)
        .collect();
    order::by(&mut rivals, |r| [r.1]);
    Ok(Chosen {
        params: best.0,
        rivals: rivals.into_iter().map(|r| r.0).take(2).collect(),
        starts: Starts { tried: tried.len(), agreeing, list: tried.into_iter().map(|t| t.0).collect() },
        closed_form,
        singular_values: linear.singular_values,
    })
}

/// The problem of Brown's five terms, where the model has those and more: what the others can say is little beside it, and the way
/// from nothing is long for them, because numerator and denominator of a ratio nearly stand for each other. `None` for other models,
/// and where what is fixed is not among the five.
pub(super) fn simpler(problem: &Problem) -> Option<(Problem, Constraints)> {
    let setup = problem.cameras.first()?;
    let [simple, model] = [Model::Brown5, setup.model].map(|m| m.spec().params);
    if model.len() <= simple.len() || !model.starts_with(simple) || setup.start.is_some() {
        return None;
    }
    let Options { fixed, .. } = &problem.options;
    let simple = CameraSetup { model: Model::Brown5, ..setup.clone() };
    let constraints =
        Constraints::new(fixed, simple.model, simple.size_px, None, simple.focal_hint_px).ok()?;
    let problem = Problem {
        cameras: vec![simple],
        target: problem.target.clone(),
        observations: Vec::new(),
        options: problem.options.clone(),
    };
    Some((problem, constraints))
}

impl Chosen {
    /// The same for a model that continues the parameters of the one it was chosen for.
    pub(super) fn continue_to(&mut self, model: Model, constraints: &Constraints) {
        let neutral = model.spec().neutral;
        let extend = |params: &mut Vec<f64>| params.extend(&neutral[params.len() - 4..]);
        for params in self.rivals.iter_mut().chain([&mut self.params]) {
            extend(params);
            constraints.apply(params);
        }
        if let Some(camera) = &mut self.closed_form.camera {
            camera.model = model;
            extend(&mut camera.params);
        }
    }
}

/// Refines; `None` where the start does not see the board.
fn attempt(
    problem: &refine::Problem<'_>,
    start: &State,
    limits: Limits,
    report: &mut dyn FnMut() -> ControlFlow<()>,
) -> Result<Option<Refined>> {
    unless_stopped(refine::refine(problem, start, limits, report))
}

/// Whether two rough refinements are on their way to the same optimum.
fn meets(a: &Refined, b: &Refined) -> bool {
    (a.cost / b.cost - 1.0).abs() < 0.05
        && (0..2).all(|i| (a.state.params[i] / b.state.params[i] - 1.0).abs() < 0.02)
}

/// The camera in closed form: from the projections of solid things, as the median over the views, or from homographies.
fn linear(problem: &Problem, views: &[Seen]) -> zhang::ClosedForm {
    let setup = &problem.cameras[0];
    let (solid, flat): (Vec<&Seen>, Vec<&Seen>) = views.iter().partition(|v| v.plane.is_solid());
    let homographies: Vec<Matrix3<f64>> = flat.iter().filter_map(|v| v.homography).collect();
    let of_planes = zhang::closed_form(&homographies, setup.size_px, problem.options.normalise);
    let each: Vec<[f64; 4]> = solid.iter().filter_map(|v| v.projection.as_ref()?.intrinsics()).collect();
    if each.is_empty() {
        return of_planes;
    }
    let k = [0, 1, 2, 3].map(|i| robust::median(&mut each.iter().map(|k| k[i]).collect::<Vec<_>>()));
    zhang::ClosedForm { intrinsics: Some(k), centred_focal_px: Some((k[0] * k[1]).sqrt()), ..of_planes }
}

fn guesses(problem: &Problem, constraints: &Constraints, linear: &zhang::ClosedForm) -> Vec<Guess> {
    let setup = &problem.cameras[0];
    let spec = setup.model.spec();
    let [w, h] = setup.size_px.map(f64::from);
    let mut list = Vec::new();
    let mut add = |name: &str, k: [f64; 4]| {
        let mut params = [&k[..], spec.neutral].concat();
        constraints.apply(&mut params);
        list.push(Guess { name: name.to_owned(), params });
    };
    let centred = |f: f64| [f, f, (w - 1.0) / 2.0, (h - 1.0) / 2.0];
    if let Some(camera) = &setup.start {
        add("given", camera.intrinsics());
    }
    let sane = |f: f64| f.is_finite() && f > 0.05 * w && f < 50.0 * w;
    match linear.intrinsics {
        Some(k) if sane(k[0]) && sane(k[1]) && k[2].abs() < 3.0 * w && k[3].abs() < 3.0 * h => {
            add("closed form", k);
        }
        _ => {}
    }
    let Options { multi_start, .. } = problem.options;
    if let Some(f) = linear.centred_focal_px.filter(|f| sane(*f)) {
        add("closed form, centred", centred(f));
    }
    if let Some(f) = setup.focal_hint_px.filter(|f| sane(*f)) {
        add("EXIF", centred(f));
    }
    if multi_start {
        for f in if spec.perspective { FOCALS } else { FISHEYE_FOCALS } {
            add(&format!("{f} widths"), centred(f * w));
        }
    }
    if !multi_start {
        // The first one is taken: this only where there is no other.
        add("1 width", centred(w));
    }
    // Distortion of a given camera comes along where the models share the name.
    if let Some(camera) = &setup.start {
        for (name, value) in camera.distortion() {
            if let Some(i) = spec.index(name) {
                list[0].params[i] = value;
            }
        }
        constraints.apply(&mut list[0].params);
    }
    if !multi_start {
        list.truncate(1);
    }
    // With all focal lengths held every guess is the same.
    if constraints.free.slot(0).is_none() && constraints.free.slot(1).is_none() {
        list.truncate(1);
    }
    list
}

/// The closed form as a value, with the RMS of its camera and poses.
fn closed_form(problem: &Problem, views: &[Seen], linear: &zhang::ClosedForm) -> ClosedForm {
    let setup = &problem.cameras[0];
    let Some(k) = linear.intrinsics else { return ClosedForm { camera: None, rms_px: None } };
    let params = [&k[..], setup.model.spec().neutral].concat();
    let camera = Camera { model: setup.model, size_px: setup.size_px, params };
    let (mut sum, mut count) = (0.0, 0usize);
    for view in views {
        let Some(pose) = first_pose(view, Model::Pinhole.spec(), &k) else { continue };
        let mut at = [[0.0; LANES]; 2];
        for (board, px) in view.board.chunks(LANES).zip(view.px.chunks(LANES)) {
            let mut points = [[0.0; LANES]; 3];
            for (l, point) in board.iter().enumerate() {
                [points[0][l], points[1][l], points[2][l]] = pose.apply(point).into();
            }
            (camera.spec().project_px_batch)(&camera.params, &points, &mut at);
            for (l, px) in px.iter().enumerate() {
                let square = (px - Vector2::new(at[0][l], at[1][l])).norm_squared();
                if square.is_finite() {
                    sum += square;
                    count += 1;
                }
            }
        }
    }
    ClosedForm { rms_px: (count > 0).then(|| (sum / count as f64).sqrt()), camera: Some(camera) }
}

/// Views of a large set from which a refinement of all may begin; `None` for a small one. What they leave is a tenth of what
/// [`choose`] leaves, and a step over all views costs more than they do.
pub(super) fn some(views: &[Seen]) -> Option<Vec<Seen>> {
    const SOME: usize = 64;
    let every = views.len() / SOME;
    (every >= 8).then(|| views.iter().step_by(every).cloned().collect())
}

/// At most [`VIEWS`] views that differ most in their perspective: farthest-point sampling.
fn diverse(views: &[Seen]) -> Vec<usize> {
    if views.len() <= VIEWS {
        return (0..views.len()).collect();
    }
    // Things that are not flat show their perspective in each view.
    if views.iter().any(|v| v.plane.is_solid()) {
        return (0..VIEWS).map(|i| i * views.len() / VIEWS).collect();
    }
    // How the depth changes over the seen part of the board, per picture direction it is seen in.
    let key: Vec<Vector2<f64>> = views
        .iter()
        .map(|v| {
            let (h, [x, y]) = (v.homography.unwrap_or_default(), v.middle());
            let depth = h[(2, 0)] * x + h[(2, 1)] * y + h[(2, 2)];
            let extent = v.board.iter().map(|p| (p - v.board[0]).norm()).fold(0.0, f64::max);
            let jacobian = nalgebra::Matrix2::from_fn(|r, c| {
                h[(r, c)] - (h[(r, 0)] * x + h[(r, 1)] * y + h[(r, 2)]) / depth * h[(2, c)]
            });
            let depth_change = Vector2::new(h[(2, 0)], h[(2, 1)]) * (extent / depth);
            // Direction in the picture in which the depth grows.
            let direction = jacobian.tr_mul(&Vector2::x()).dot(&depth_change);
            let other = jacobian.tr_mul(&Vector2::y()).dot(&depth_change);
            Vector2::new(direction, other).try_normalize(0.0).unwrap_or_default() * depth_change.norm()
        })
        .collect();
    let mut distance = vec![f64::INFINITY; views.len()];
    let mut chosen = Vec::with_capacity(VIEWS);
    let mut next = 0;
    for _ in 0..VIEWS {
        chosen.push(next);
        for (d, k) in distance.iter_mut().zip(&key) {
            *d = d.min((k - key[next]).norm());
        }
        next = distance.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1)).map_or(0, |m| m.0);
    }
    order::by(&mut chosen, |i| [*i as f64]);
    chosen
}

/// At most so many corners, spread over the board by the golden ratio.
fn thinned(view: &Seen, corners: usize) -> Block {
    let n = view.px.len();
    if n <= corners {
        return view.block();
    }
    let mut chosen: Vec<usize> =
        (0..corners).map(|i| ((i as f64 * 0.618_033_988_749_895).fract() * n as f64) as usize).collect();
    order::by(&mut chosen, |i| [*i as f64]);
    chosen.dedup();
    let board: Vec<_> = chosen.iter().map(|i| view.board[*i]).collect();
    let px: Vec<_> = chosen.iter().map(|i| view.px[*i]).collect();
    Block::new(&board, &px)
}
