//! The splined camera that explains all corners best, with all poses free.
//!
//! It starts from the camera with few parameters that was calibrated from the same corners, and stays with it where no corner says
//! otherwise: with the deviation `d` of each control point from it, in px, the sum that is minimised is
//!
//! ```text
//! Σ ρ(w |r|²) + a Σ (second differences of d)² + b Σ |d|²
//! ```
//!
//! ρ is Huber's loss, `w` the weight of the corner in the calibration. `a` is weak beside the corners' own information and only
//! decides between control points that few corners move; `b` is weaker still, and holds what boards cannot tell: a turn of the
//! camera. Gauss–Newton with halved steps; the poses are eliminated view by view.

use std::ops::ControlFlow;

use nalgebra::{Rotation3, Vector2, Vector6};

use super::{Layout, Splined, seen::Seen};
use crate::{
    Error, Result,
    pose::Pose,
    solution::Calibration,
    stats::quantile,
    surface::{System, ViewRows, penalty},
    target::Target,
};

/// Strength of the bending and of the pull to the start, in units of the information about a usual control point.
const BEND: f64 = 0.1;
const PULL: f64 = 1e-5;
/// Sum of weights from which a control point counts as known: the worth of one corner in the middle of its reach.
const ENOUGH: f64 = 0.5;
/// Threshold of Huber's loss in robust standard deviations of one coordinate.
const HUBER: f64 = 2.5;
/// Median length of a two-dimensional standard normal vector.
const MEDIAN_LENGTH: f64 = 1.177_410_022_515_474_7;
/// Scale below which the loss stays quadratic, px; as in the calibration.
const FLOOR_PX: f64 = 0.015;
/// Steps in which the scale of the loss follows the residuals; then it stands still.
const SETTLING: usize = 4;
const MOST_STEPS: usize = 40;
/// Most control points that are fitted: their normal matrix has the square of twice their number.
const MOST_KNOTS: usize = 2500;
/// Relative decrease of the sum below which it stands still.
const TOLERANCE: f64 = 1e-10;

/// The fitted camera with its poses.
#[derive(Clone, Debug)]
pub struct Fitted {
    /// The camera.
    pub camera: Splined,
    /// `camera_from_board` of each view, in the order of the calibration's.
    pub poses: Vec<Pose>,
    /// Observed − projected of each corner of each view, px.
    pub residuals_px: Vec<Vec<Vector2<f64>>>,
    /// √(Σ|r|²/N) over all corners, px.
    pub rms_px: f64,
    /// Steps taken.
    pub steps: usize,
    /// Whether the sum stands still.
    pub converged: bool,
}

/// Fits a splined camera to the corners of a calibration. `report` is asked before each step whether to go on.
///
/// `target` is the board of the calibration.
///
/// # Errors
/// [`Error::Degenerate`] where the corners do not determine it, [`Error::Invalid`] for a layout that is not possible,
/// [`Error::Stopped`] where `report` breaks.
pub fn fit(
    calibration: &Calibration,
    target: &Target,
    layout: Layout,
    report: &mut dyn FnMut() -> ControlFlow<()>,
) -> Result<Fitted> {
    let [columns, rows] = layout.knots;
    if columns.saturating_mul(rows) > MOST_KNOTS {
        return Err(Error::Invalid(format!(
            "{columns} x {rows} control points: at most {MOST_KNOTS} can be fitted"
        )));
    }
    let start = Splined::following(&calibration.camera, layout)?;
    let views: Option<Vec<Seen>> =
        calibration.views.iter().map(|view| Seen::new(calibration, view, target)).collect();
    let views = views.filter(|v| !v.is_empty()).ok_or_else(undetermined)?;
    let poses = calibration.views.iter().zip(&views).map(|(v, seen)| seen.centred(&v.camera_from_board));
    Solver::new(&start, &views).run(poses.collect(), report)
}

fn undetermined() -> Error {
    Error::Degenerate(
        "the corners do not determine a splined camera: add pictures with the board all over the picture"
            .to_owned(),
    )
}

/// A point in the space of unknowns.
#[derive(Clone)]
struct State {
    /// Deviation of each control point from the start, px.
    deviation: Vec<Vector2<f64>>,
    /// Centred.
    poses: Vec<Pose>,
}

struct Solver<'a> {
    start: &'a Splined,
    views: &'a [Seen],
    slots: Vec<Option<usize>>,
}

impl<'a> Solver<'a> {
    fn new(start: &'a Splined, views: &'a [Seen]) -> Self {
        Self { start, views, slots: (0..start.surface.len()).map(Some).collect() }
    }

    fn camera(&self, deviation: &[Vector2<f64>]) -> Splined {
        let [fx, fy, ..] = self.start.core;
        let moved = self.start.surface.iter().zip(deviation);
        Splined {
            surface: moved.map(|([x, y], d)| [x + d.x / fx, y + d.y / fy]).collect(),
            ..self.start.clone()
        }
    }

    fn run(&self, poses: Vec<Pose>, report: &mut dyn FnMut() -> ControlFlow<()>) -> Result<Fitted> {
        let free = self.slots.len();
        let mut at = State { deviation: vec![Vector2::zeros(); free], poses };
        let penalty = penalty(self.start.layout.knots, &self.slots, free, BEND, PULL);
        let mut stiffness = None;
        let mut huber_px = f64::INFINITY;
        let (mut steps, mut converged) = (0, false);
        while steps < MOST_STEPS && !converged {
            if report().is_break() {
                return Err(Error::Stopped);
            }
            let camera = self.camera(&at.deviation);
            if steps < SETTLING {
                huber_px = HUBER * self.scale(&camera, &at.poses).ok_or_else(undetermined)?;
            }
            let rows: Option<Vec<ViewRows>> =
                self.views.iter().zip(&at.poses).map(|(v, pose)| v.rows(&camera, pose, huber_px)).collect();
            let mut rows = rows.ok_or_else(undetermined)?;
            // The unknown is the whole deviation, so what it explains already is added back.
            for row in rows.iter_mut().flat_map(|v| &mut v.rows) {
                for part in row.patch.parts() {
                    row.residual += at.deviation[part.at] * part.weight;
                }
            }
            let mut system = System::zero(free);
            rows.iter().for_each(|view| system.add(view, &self.slots));
            let stiffness = *stiffness.get_or_insert_with(|| system.scale());
            let values = system.solve(&penalty, stiffness).ok_or_else(undetermined)?;
            let (pairs, _) = values.as_slice().as_chunks::<2>();
            let wanted: Vec<Vector2<f64>> = pairs.iter().map(|p| Vector2::from(*p)).collect();
            let motions: Option<Vec<Vector6<f64>>> = rows.iter().map(|view| motion(view, &wanted)).collect();
            let motions = motions.ok_or_else(undetermined)?;
            let cost = |state: &State| {
                let own = penalty_of(&penalty, &state.deviation) * stiffness;
                self.cost(state, huber_px).map(|c| c + own).filter(|c| c.is_finite())
            };
            let now = cost(&at).ok_or_else(undetermined)?;
            let mut better = None;
            for halvings in 0..10 {
                let next = moved(&at, &wanted, &motions, 0.5f64.powi(halvings));
                if let Some(sum) = cost(&next).filter(|sum| *sum <= now) {
                    better = Some((next, sum));
                    break;
                }
            }
            steps += 1;
            let Some((next, sum)) = better else {
                // What is promised is below what rounding lets the sum resolve.
                converged = steps > SETTLING;
                if !converged {
                    continue;
                }
                break;
            };
            converged = steps > SETTLING && now - sum <= TOLERANCE * now;
            at = next;
        }
        self.finish(&at, steps, converged)
    }

    fn finish(&self, at: &State, steps: usize, converged: bool) -> Result<Fitted> {
        let mut camera = self.camera(&at.deviation);
        let mut sums = vec![0.0; camera.surface.len()];
        let (mut residuals_px, mut squares, mut count) = (Vec::new(), 0.0, 0usize);
        for (view, pose) in self.views.iter().zip(&at.poses) {
            let rows = view.rows(&camera, pose, f64::INFINITY).ok_or_else(undetermined)?.rows;
            for part in rows.iter().flat_map(|r| r.patch.parts()) {
                sums[part.at] += part.weight;
            }
            squares += rows.iter().map(|r| r.residual.norm_squared()).sum::<f64>();
            count += rows.len();
            residuals_px.push(rows.iter().map(|r| r.residual).collect());
        }
        camera.known = sums.iter().map(|s| *s >= ENOUGH).collect();
        let poses = self.views.iter().zip(&at.poses).map(|(view, pose)| {
            let mut pose = *pose;
            pose.rotation.renormalize();
            view.uncentred(&pose)
        });
        Ok(Fitted {
            camera,
            poses: poses.collect(),
            residuals_px,
            rms_px: (squares / count.max(1) as f64).sqrt(),
            steps,
            converged,
        })
    }

    /// Robust σ of one coordinate of a corner of weight 1, px.
    fn scale(&self, camera: &Splined, poses: &[Pose]) -> Option<f64> {
        let mut lengths = Vec::new();
        for (view, pose) in self.views.iter().zip(poses) {
            let residuals = view.residuals(camera, pose)?;
            lengths.extend(residuals.iter().zip(&view.weights).map(|(r, w)| w.sqrt() * r.norm()));
        }
        lengths.sort_by(f64::total_cmp);
        Some((quantile(&lengths, 0.5) / MEDIAN_LENGTH).max(FLOOR_PX))
    }

    /// Σ ρ(w |r|²); `None` where a corner is not seen.
    fn cost(&self, state: &State, huber_px: f64) -> Option<f64> {
        let camera = self.camera(&state.deviation);
        let mut sum = 0.0;
        for (view, pose) in self.views.iter().zip(&state.poses) {
            for (r, w) in view.residuals(&camera, pose)?.iter().zip(&view.weights) {
                let e = w.sqrt() * r.norm();
                sum += if e > huber_px { huber_px * (2.0 * e - huber_px) } else { e * e };
            }
        }
        Some(sum)
    }
}

/// How a pose moves once the control points deviate as wanted.
fn motion(view: &ViewRows, wanted: &[Vector2<f64>]) -> Option<Vector6<f64>> {
    let left: Vec<Vector2<f64>> = view
        .rows
        .iter()
        .map(|row| row.patch.parts().iter().fold(row.residual, |r, part| r - wanted[part.at] * part.weight))
        .collect();
    view.motion(&left)
}

/// A share of the way.
fn moved(at: &State, wanted: &[Vector2<f64>], motions: &[Vector6<f64>], share: f64) -> State {
    let poses = at.poses.iter().zip(motions).map(|(pose, m)| Pose {
        rotation: Rotation3::from_scaled_axis(m.fixed_rows::<3>(0) * share) * pose.rotation,
        translation: pose.translation + m.fixed_rows::<3>(3) * share,
    });
    State {
        deviation: at.deviation.iter().zip(wanted).map(|(d, w)| d + (w - d) * share).collect(),
        poses: poses.collect(),
    }
}

/// `Σ dᵀ P d` over both coordinates, from the lower triangle.
fn penalty_of(penalty: &nalgebra::DMatrix<f64>, deviation: &[Vector2<f64>]) -> f64 {
    let mut sum = 0.0;
    for j in 0..penalty.ncols() {
        for i in j..penalty.nrows() {
            let p = penalty[(i, j)];
            if p != 0.0 {
                sum += if i == j { p } else { 2.0 * p } * deviation[i].dot(&deviation[j]);
            }
        }
    }
    sum
}
