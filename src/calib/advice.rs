//! What to photograph next: the pose of the board that would lower the uncertainty of the projection most.
//!
//! A picture that was not taken yet has no residuals, but it has derivatives: at a pose of the board each corner would tell something
//! about the intrinsics, as much as corners have told so far on average. That information, the pose itself eliminated, is added to
//! that of the pictures there are ([`Scatter::with`]); what the uncertainty would be then is known before the picture is.
//!
//! Tried are places in the picture × distances × tilts to all sides × rolls, at which the whole board is seen, no farther and no nearer
//! than is likely to be sharp, its points far enough from each other to be found. The best is that with the least
//!
//! ```text
//! Σ ln(1 + σ²/g²)     over the places that the goal g is about
//! ```
//!
//! which asks for ratios where σ is far from the goal and for nothing where it is reached. While the focal length is hardly known, places at
//! infinity count too: at the boards' own distance a wrong focal length and wrong distances make each other good, and nobody would ask
//! for tilt. Then the next best, given the first, and so on
//! until the goal is reached: so many pictures are still to be taken.
//!
//! E. Olson et al., "AprilCal: Assisted and repeatable camera calibration", IROS 2013; S. Peng and P. Sturm, "Calibration Wizard",
//! ICCV 2019 (next poses by the covariance of the intrinsics).

mod goal;
mod hold;
mod words;

pub use goal::{Figure, Goal, Tolerance};

use std::iter::repeat;

use nalgebra::{Vector2, Vector3};
use serde::{Deserialize, Serialize};

use super::{
    Error,
    camera::Camera,
    diagnose::UNSURE_FOCAL,
    number::significant,
    order,
    pose::Pose,
    solution::Calibration,
    stats::{self, Stance},
    target::{Target, Unit},
    uncertainty::{self, Probe, Scatter, Seen, Uncertainty},
};
use hold::{Hold, Studio};

/// Most pictures that are planned ahead.
pub const MOST_PICTURES: usize = 30;
/// Corners of a board that are looked at while poses are compared.
const SAMPLE: usize = 30;
/// Gain of the best picture below which there is nothing to gain: a thousandth of the variance.
const NOTHING: f64 = 1e-3;

/// How things stand.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum State {
    /// Nothing is known to plan from.
    Unknown,
    /// The goal is reached.
    Enough,
    /// A picture would help.
    Next,
    /// The goal is not reached, and no picture would help.
    Stuck,
}

/// Figures of an uncertainty, px; `None` where one has no answer.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Figures {
    /// In the middle of the picture.
    pub center_px: Option<f64>,
    /// In the worst of its corners.
    pub worst_corner_px: Option<f64>,
    /// The mean over it.
    pub mean_px: Option<f64>,
}

impl Figures {
    fn of(uncertainty: &Uncertainty) -> Self {
        Self {
            center_px: uncertainty.center_px,
            worst_corner_px: uncertainty.worst_corner_px,
            mean_px: uncertainty.mean_px(),
        }
    }
}

impl Figure {
    /// Its value among these, px.
    pub const fn of_figures(self, figures: &Figures) -> Option<f64> {
        match self {
            Self::Corner => figures.worst_corner_px,
            Self::Mean => figures.mean_px,
            Self::Centre => figures.center_px,
        }
    }
}

/// The picture to take.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Next {
    /// Where the board would be.
    pub camera_from_board: Pose,
    /// The same as people say it; the distance in the unit of the square.
    #[serde(flatten)]
    pub stance: Stance,
}

/// What to photograph next, and what it would bring.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Advice {
    /// What is aimed at.
    pub goal: Goal,
    /// The σ of the projection that it allows, px; `None` where there is no camera to tell.
    pub goal_px: Option<f64>,
    /// How things stand.
    pub state: State,
    /// What to do, in a sentence.
    pub sentence: String,
    /// What it brings and how much is still to do, in a sentence or two.
    pub promise: String,
    /// Distance of the points that the figures are of, in the unit of the square; `None` at infinity, or without a camera.
    pub range: Option<f64>,
    /// The uncertainty now.
    pub before: Option<Figures>,
    /// The uncertainty that is expected with the next picture.
    pub after: Option<Figures>,
    /// σ of the focal length fx now, and as expected with the next picture, px; `None` where it is held.
    pub focal_px: Option<[f64; 2]>,
    /// Pictures to the goal, the next one included; `None` where there would be more than [`MOST_PICTURES`], where they cannot be told
    /// because the figure has no answer now, and where none help.
    pub pictures: Option<usize>,
    /// The picture to take.
    pub next: Option<Next>,
}

impl Advice {
    /// Without a calibration: pictures that always help.
    pub fn first(goal: Goal) -> Self {
        let mut advice = Self {
            goal,
            goal_px: None,
            state: State::Unknown,
            sentence: words::FIRST.to_owned(),
            promise: String::new(),
            range: None,
            before: None,
            after: None,
            focal_px: None,
            pictures: None,
            next: None,
        };
        advice.promise = words::promise(&advice);
        advice
    }

    /// Where planning failed: the reason takes the place of the promise.
    pub fn failed(goal: Goal, error: &Error) -> Self {
        let sentence = "What to photograph next could not be planned.".to_owned();
        Self { sentence, promise: error.to_string(), ..Self::first(goal) }
    }

    /// The goal in words: `±1.0 px in the worst corner`.
    pub fn goal_words(&self) -> String {
        let size = match (self.goal.tolerance, self.goal_px) {
            (Tolerance::Px(px), _) => format!("±{px} px"),
            (_, Some(px)) => format!("±{} px ({})", significant(px, 2), self.goal),
            (_, None) => self.goal.to_string(),
        };
        format!("{size} {}", self.goal.figure.words())
    }
}

/// The uncertainty that is expected after one more picture, with the board at this pose: its points in the picture count. Of points at
/// this distance, in the unit of the square; `None` is infinity. Beside it σ of the focal length fx, px; `None` where that is held. No answer
/// where fewer than four points are seen.
pub fn expected(
    calibration: &Calibration,
    target: &Target,
    pose: &Pose,
    range: Option<f64>,
) -> Option<(Uncertainty, Option<f64>)> {
    let scatter = Scatter::new(calibration, target)?;
    let camera = &calibration.camera;
    let [w, h] = camera.size_px.map(f64::from);
    let points: Vec<Vector3<f64>> = target
        .points_in_board()
        .iter()
        .map(|p| pose.apply(p))
        .filter_map(|p| {
            let px = camera.project(&p)?;
            (px.x >= -0.5 && px.y >= -0.5 && px.x <= w - 0.5 && px.y <= h - 0.5).then_some(p.coords)
        })
        .collect();
    if points.len() < 4 {
        return None;
    }
    let seen = scatter.seen(camera, &points, &mut repeat(usual_weight(calibration)))?;
    let with = scatter.with(&seen)?;
    Some((with.over(camera, range), with.sigma_of(0)))
}

/// Mean weight of a corner.
fn usual_weight(calibration: &Calibration) -> f64 {
    let all = calibration.views.iter().flat_map(|v| &v.weights);
    let (n, sum) = all.fold((0.0, 0.0), |(n, sum), w| (n + 1.0, sum + w));
    if n > 0.0 { sum / n } else { 1.0 }
}

/// What to photograph next. `target` is the board of the calibration, `unit` that of its lengths.
///
/// Cost: some thousand poses of a board, whatever the number of pictures.
pub fn advise(calibration: &Calibration, target: &Target, unit: Unit, goal: Goal) -> Advice {
    let camera = &calibration.camera;
    let goal_px = goal.px(camera);
    let mut advice = Advice { goal_px: Some(goal_px), ..Advice::first(goal) };
    let Some(scatter) = Scatter::new(calibration, target) else { return advice };
    let range = uncertainty::distance(calibration, target, goal.range(unit));
    let now = scatter.over(camera, range);
    advice.range = range;
    advice.before = Some(Figures::of(&now));
    let reached = |px: Option<f64>| px.is_some_and(|px| px <= goal_px);
    if reached(goal.figure.of(&now)) {
        advice.state = State::Enough;
        advice.sentence = "No more pictures are needed.".to_owned();
        advice.pictures = Some(0);
        advice.promise = words::promise(&advice);
        return advice;
    }
    if let Some(studio) = Studio::new(calibration, target) {
        let search = Search::new(&scatter, camera, usual_weight(calibration), &goal, range);
        search.plan(&studio, &mut advice, target, unit);
    }
    advice.promise = words::promise(&advice);
    advice
}

/// Of these poses of the board the one whose picture would bring most, and its place in the list.
pub fn best_of(
    calibration: &Calibration,
    target: &Target,
    unit: Unit,
    goal: &Goal,
    poses: &[Pose],
) -> Option<usize> {
    let scatter = Scatter::new(calibration, target)?;
    let range = uncertainty::distance(calibration, target, goal.range(unit));
    let search = Search::new(&scatter, &calibration.camera, usual_weight(calibration), goal, range);
    let lack = |pose: &Pose| {
        let points = target.points_in_board().iter().map(|p| pose.apply(p).coords).collect::<Vec<_>>();
        let seen = scatter.seen(&calibration.camera, &points, &mut repeat(search.weight))?;
        Some(search.lack(&scatter.with(&seen)?))
    };
    let all = poses.iter().enumerate().filter_map(|(i, pose)| Some((lack(pose)?, i)));
    all.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, i)| i)
}

/// A pose with what it would tell.
struct Candidate {
    hold: Hold,
    pose: Pose,
    seen: Seen,
}

/// Whether the focal length is hardly known.
fn is_unsure(scatter: &Scatter, camera: &Camera) -> bool {
    scatter.sigma_of(0).is_some_and(|sigma| sigma > UNSURE_FOCAL * camera.params[0])
}

/// Everything that poses are judged by.
struct Search<'a> {
    scatter: &'a Scatter,
    camera: &'a Camera,
    /// Weight of a corner of the whole board.
    weight: f64,
    goal: &'a Goal,
    goal_px: f64,
    range: Option<f64>,
    /// Places that the figure is made of.
    figure: Vec<Probe>,
    /// Whether all of them have an answer.
    is_whole: bool,
    /// Places that poses are judged at.
    places: Vec<Probe>,
}

impl<'a> Search<'a> {
    fn new(
        scatter: &'a Scatter,
        camera: &'a Camera,
        weight: f64,
        goal: &'a Goal,
        range: Option<f64>,
    ) -> Self {
        let [corners, center, cells] = uncertainty::places(camera.size_px);
        let probes = |places: &mut dyn Iterator<Item = &Vector2<f64>>| -> Vec<Option<Probe>> {
            places.map(|px| scatter.probe(camera, px, range)).collect()
        };
        // Every fifth cell each way is enough to judge poses by.
        let some = |from: usize| {
            cells.iter().skip(from).step_by(5).flat_map(move |row| row.iter().skip(from).step_by(5))
        };
        let figure = match goal.figure {
            Figure::Corner => probes(&mut corners.iter().flatten()),
            Figure::Centre => probes(&mut center.iter().flatten()),
            Figure::Mean => probes(&mut cells.iter().flatten()),
        };
        // A corner in which the model has no answer stands for the place nearest to it that has one.
        let middle = center[0][0];
        let inwards = |px: &Vector2<f64>| {
            let place = |step: i32| middle + (px - middle) * (1.0 - 0.05 * f64::from(step));
            (0..20).find_map(|step| scatter.probe(camera, &place(step), range))
        };
        let mut places: Vec<Option<Probe>> = match goal.figure {
            Figure::Corner => corners.iter().flatten().map(inwards).collect(),
            Figure::Centre => figure.clone(),
            Figure::Mean => probes(&mut some(2)),
        };
        if is_unsure(scatter, camera) {
            places.extend(some(2).map(|px| scatter.probe(camera, px, None)));
        }
        Self {
            weight,
            goal,
            goal_px: goal.px(camera),
            range,
            is_whole: figure.iter().all(Option::is_some),
            figure: figure.into_iter().flatten().collect(),
            places: places.into_iter().flatten().collect(),
            scatter,
            camera,
        }
    }

    /// What remains to be gained.
    fn lack(&self, scatter: &Scatter) -> f64 {
        let variance = |p: &Probe| scatter.sigma_px(p).unwrap_or(f64::INFINITY).powi(2);
        self.places.iter().map(|p| (variance(p) / self.goal_px.powi(2)).ln_1p()).sum()
    }

    /// The figure of the goal, px.
    fn figure_px(&self, scatter: &Scatter) -> Option<f64> {
        let all = || self.figure.iter().map(|p| scatter.sigma_px(p).unwrap_or(f64::INFINITY));
        let value = match self.goal.figure {
            Figure::Mean => all().sum::<f64>() / self.figure.len().max(1) as f64,
            Figure::Corner | Figure::Centre => all().fold(0.0, f64::max),
        };
        (self.is_whole && value.is_finite()).then_some(value)
    }

    /// With as many of its points as are asked for.
    fn candidate(&self, studio: &Studio<'_>, hold: Hold, sample: usize) -> Option<Candidate> {
        let pose = studio.pose(&hold)?;
        let points = &studio.points;
        let n = sample.min(points.len());
        let some = (0..n).filter_map(|i| points.get((2 * i + 1) * points.len() / (2 * n)));
        let in_camera: Vec<Vector3<f64>> = some.map(|p| pose.apply(p).coords).collect();
        let weight = self.weight * points.len() as f64 / n as f64;
        Some(Candidate { hold, pose, seen: self.scatter.seen(self.camera, &in_camera, &mut repeat(weight))? })
    }

    fn plan(&self, studio: &Studio<'_>, advice: &mut Advice, target: &Target, unit: Unit) {
        let all: Vec<Candidate> =
            studio.all().filter_map(|hold| self.candidate(studio, hold, SAMPLE)).collect();
        let lack = self.lack(self.scatter);
        let gain = |scatter: &Scatter, lack: f64, c: &Candidate| {
            scatter.with(&c.seen).map_or(0.0, |with| lack - self.lack(&with))
        };
        let mut queue: Vec<(f64, usize)> =
            all.iter().enumerate().map(|(i, c)| (gain(self.scatter, lack, c), i)).collect();
        order::by(&mut queue, |(gain, _)| [-gain]);
        let Some(&(best, at)) = queue.first() else { return };
        if best <= NOTHING {
            advice.state = State::Stuck;
            advice.sentence = "The goal is beyond this board and these pictures.".to_owned();
            return;
        }
        // Between the poses of the coarse grid.
        let mut best = (best, self.candidate(studio, all[at].hold, SAMPLE));
        for _ in 0..3 {
            let Some(hold) = best.1.as_ref().map(|c| c.hold) else { break };
            for hold in studio.beside(&hold) {
                if let Some(candidate) = self.candidate(studio, hold, SAMPLE) {
                    let gain = gain(self.scatter, lack, &candidate);
                    if gain > best.0 {
                        best = (gain, Some(candidate));
                    }
                }
            }
            if best.1.as_ref().is_some_and(|c| c.hold == hold) {
                break;
            }
        }
        let Some(first) = best.1.and_then(|c| self.candidate(studio, c.hold, usize::MAX)) else { return };
        let Some(after) = self.scatter.with(&first.seen) else { return };
        let focal = [self.scatter, &after].map(|scatter| scatter.sigma_of(0));
        advice.focal_px = focal[0].zip(focal[1]).map(<[f64; 2]>::from);
        let stance = stats::stance(&first.pose, target);
        advice.state = State::Next;
        advice.sentence = words::hold(&first.hold, stance.distance, unit);
        advice.after = Some(Figures::of(&after.over(self.camera, self.range)));
        advice.next = Some(Next { camera_from_board: first.pose, stance });
        advice.pictures = self.rest(after, &mut queue, &all);
    }

    /// Pictures to the goal, the first included: always the best next one. A gain never grows by other pictures to speak of, so only those
    /// poses are judged again whose last gain is larger than the best (M. Minoux, "Accelerated greedy algorithms", 1978).
    fn rest(&self, mut scatter: Scatter, queue: &mut [(f64, usize)], all: &[Candidate]) -> Option<usize> {
        for n in 1..=MOST_PICTURES {
            if self.figure_px(&scatter)? <= self.goal_px {
                return Some(n);
            }
            let lack = self.lack(&scatter);
            let mut best: Option<(f64, usize, Scatter)> = None;
            for (gain, at) in queue.iter_mut() {
                if best.as_ref().is_some_and(|best| best.0 >= *gain) {
                    break;
                }
                if let Some(with) = scatter.with(&all[*at].seen) {
                    *gain = lack - self.lack(&with);
                    if best.as_ref().is_none_or(|best| *gain > best.0) {
                        best = Some((*gain, *at, with));
                    }
                }
            }
            let (gain, _, with) = best?;
            if gain <= NOTHING {
                return None;
            }
            scatter = with;
            order::by(queue, |(gain, _)| [-gain]);
        }
        None
    }
}

#[cfg(test)]
mod tests;
