//! From observations to what the solver works on; what cannot be used is set aside with a reason.

use nalgebra::{Matrix3, Point3, Vector2};
use std::{collections::BTreeMap, ops::ControlFlow};

use super::{Options, Precision, Problem, robust::median};
use crate::{
    camera::{Model, Spec},
    homography,
    observation::{FrameId, Observation},
    pose::Pose,
    refine::{self, Descent, Free, Limits, State, block::Block},
    zhang,
};

/// A usable view.
#[derive(Clone, Debug)]
pub(super) struct Seen {
    pub(super) frame: FrameId,
    pub(super) indices: Vec<u32>,
    pub(super) board: Vec<Point3<f64>>,
    pub(super) px: Vec<Vector2<f64>>,
    pub(super) sigma_px: Vec<f64>,
    /// Picture from board.
    pub(super) homography: Matrix3<f64>,
    /// Robust size of what the homography leaves, px.
    pub(super) bent_px: f64,
}

impl Seen {
    pub(super) fn block(&self) -> Block {
        Block::new(&self.board, &self.px)
    }

    /// Middle of the seen corners on the board.
    pub(super) fn middle(&self) -> [f64; 2] {
        let n = self.board.len() as f64;
        [0, 1].map(|k| self.board.iter().map(|p| p[k]).sum::<f64>() / n)
    }
}

/// Splits the observations into usable views and those set aside.
pub(super) fn prepare(problem: &Problem) -> (Vec<Seen>, Vec<(FrameId, String)>) {
    let (mut views, mut aside): (Vec<Seen>, Vec<_>) = (Vec::new(), Vec::new());
    let mut by_first_corner = BTreeMap::<[u64; 2], Vec<usize>>::new();
    let points = problem.target.points_in_board();
    for observation in &problem.observations {
        match view(problem, &points, observation) {
            Err(why) => aside.push((observation.frame, why)),
            Ok(seen) => {
                let alike = by_first_corner.entry(seen.px[0].map(f64::to_bits).into()).or_default();
                let is_same = |v: &&Seen| v.indices == seen.indices && v.px == seen.px;
                if let Some(first) = alike.iter().map(|i| &views[*i]).find(is_same) {
                    let first = first.frame.0;
                    let why =
                        format!("the same corners as in frame {first}: the same photograph counts once");
                    aside.push((seen.frame, why));
                } else {
                    alike.push(views.len());
                    views.push(seen);
                }
            }
        }
    }
    (views, aside)
}

fn view(problem: &Problem, points: &[Point3<f64>], observation: &Observation) -> Result<Seen, String> {
    let size = problem.cameras.first().map_or([0; 2], |c| c.size_px).map(f64::from);
    let corners = &observation.corners;
    if corners.len() < 4 {
        return Err(format!("{} corners: at least 4 are needed", corners.len()));
    }
    if observation.camera != 0 {
        return Err(format!("it names camera {}, which is not given", observation.camera));
    }
    let single = problem.options.precision == Precision::F32;
    let mut seen = Seen {
        frame: observation.frame,
        indices: corners.iter().map(|c| c.index).collect(),
        board: Vec::with_capacity(corners.len()),
        px: Vec::with_capacity(corners.len()),
        sigma_px: corners.iter().map(|c| c.sigma_px).collect(),
        homography: Matrix3::identity(),
        bent_px: 0.0,
    };
    for corner in corners {
        let Some(point) = points.get(corner.index as usize).copied() else {
            return Err(format!(
                "corner {} is not on a board of {} corners: is the board size right?",
                corner.index,
                points.len()
            ));
        };
        if !(corner.px.x.is_finite() && corner.px.y.is_finite()) {
            return Err(format!("corner {} has no finite position", corner.index));
        }
        if (0..2).any(|k| corner.px[k] < -1.0 - 0.01 * size[k] || corner.px[k] > 1.01 * size[k]) {
            return Err(format!(
                "corner {} lies at {:.1}, {:.1}, outside a picture of {} x {} px: is it from a camera of another size?",
                corner.index, corner.px.x, corner.px.y, size[0], size[1]
            ));
        }
        seen.board.push(point);
        seen.px.push(if single { corner.px.map(|x| f64::from(x as f32)) } else { corner.px });
    }
    if let Some(pair) = seen.indices.windows(2).find(|p| p[0] >= p[1]) {
        return Err(format!("corner {} is given twice or out of order", pair[1]));
    }
    let plane: Vec<_> = seen.board.iter().map(|p| Vector2::new(p.x, p.y)).collect();
    let Some(fit) = homography::fit(&plane, &seen.px, homography_options(&problem.options)) else {
        return Err("its corners lie on a line or in a point: a board must be seen in two directions".into());
    };
    let mut errors: Vec<f64> =
        plane.iter().zip(&seen.px).map(|(b, p)| (homography::apply(&fit.matrix, b) - p).norm()).collect();
    seen.bent_px = median(&mut errors);
    let extent = seen.px.iter().map(|p| (p - seen.px[0]).norm()).fold(0.0, f64::max);
    // No lens bends a board by a sixth of its size; corners in a wrong order do.
    if seen.bent_px.is_nan() || seen.bent_px > 0.15 * extent {
        return Err(format!(
            "its corners do not form the board ({:.0} px off a flat grid that is {extent:.0} px wide)",
            seen.bent_px
        ));
    }
    seen.homography = fit.matrix;
    Ok(seen)
}

/// The linear pose of a view: from its homography, or where the model is no perspective one from its rays.
pub(super) fn first_pose(view: &Seen, spec: &Spec, params: &[f64]) -> Option<Pose> {
    if spec.perspective {
        let k = [params[0], params[1], params[2], params[3]];
        return zhang::pose(&view.homography, k, view.middle());
    }
    let (mut plane, mut rays) = (Vec::new(), Vec::new());
    for (board, px) in view.board.iter().zip(&view.px) {
        // As the model guesses it: exact, or without its small terms.
        let ray = (spec.guess_ray)(params, px);
        if ray.iter().all(|x| x.is_finite()) {
            plane.push([board.x, board.y]);
            rays.push(ray);
        }
    }
    zhang::pose_from_rays(&plane, &rays)
}

/// The pose of a view and a few steps with the camera held; `None` where none sees the corners.
///
/// `memory` is kept from view to view.
pub(super) fn pose(
    view: &Seen,
    model: Model,
    params: &[f64],
    memory: &mut Option<Descent>,
) -> Option<(Block, Pose)> {
    let block = view.block();
    let pose = first_pose(view, model.spec(), params)?;
    let free = Free::none(model);
    let start = State { params: params.to_vec(), poses: vec![pose] };
    let limits = Limits { iterations: 2, tolerance: 1e-3, damping: 1e-6 };
    let problem = alone(&block, model, &free);
    let descent = match memory {
        Some(descent) => {
            descent.restart(&problem, &start).ok()?;
            descent
        }
        None => memory.insert(Descent::new(&problem, &start).ok()?),
    };
    descent.run(&problem, limits, &mut || ControlFlow::Continue(())).ok()?;
    let pose = descent.poses(&problem).next()?;
    Some((block, pose))
}

/// Residuals of one view, px.
pub(super) fn residuals(block: &Block, model: Model, params: &[f64], pose: &Pose) -> Vec<Vector2<f64>> {
    let free = Free::none(model);
    refine::residuals(&alone(block, model, &free), &State { params: params.to_vec(), poses: vec![*pose] }, 0)
}

fn alone<'a>(block: &'a Block, model: Model, free: &'a Free) -> refine::Problem<'a> {
    refine::Problem {
        spec: model.spec(),
        free,
        blocks: std::slice::from_ref(block),
        huber_px: None,
        single_precision: false,
    }
}

pub(super) fn homography_options(options: &Options) -> homography::Options {
    homography::Options {
        normalise: options.normalise,
        ransac: options.ransac,
        single_precision: options.precision == Precision::F32,
    }
}
