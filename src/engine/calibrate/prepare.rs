//! From observations to what the solver works on; what cannot be used is set aside with a reason.

use nalgebra::{Matrix3, Point3, Vector2, Vector3};
use std::{collections::BTreeMap, ops::ControlFlow};

use super::{
    Options, Precision, Problem,
    robust::median,
    start::{FISHEYE_FOCALS, FOCALS},
};
use crate::{
    camera::{Model, Spec},
    dlt, homography,
    observation::{FrameId, Observation},
    p3p::{self, Consensus},
    pose::Pose,
    refine::{self, Descent, Free, Limits, State, block::Block},
    spread::Plane,
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
    /// The plane that the corners are in or near.
    pub(super) plane: Plane,
    /// Picture from that plane; `None` only for solid things.
    pub(super) homography: Option<Matrix3<f64>>,
    /// Picture from board, where the corners are not in a plane.
    pub(super) projection: Option<dlt::Fit>,
    /// Robust size of what the homography, or of a solid thing the projection, leaves, px.
    pub(super) bent_px: f64,
}

impl Seen {
    pub(super) fn block(&self) -> Block {
        Block::new(&self.board, &self.px)
    }

    /// Middle of the seen corners on their plane.
    pub(super) fn middle(&self) -> [f64; 2] {
        let n = self.board.len() as f64;
        (self.plane.flattened(&self.board).sum::<Vector2<f64>>() / n).into()
    }

    /// Distance of the first corner from the farthest, px.
    fn extent_px(&self) -> f64 {
        self.px.iter().map(|p| (p - self.px[0]).norm()).fold(0.0, f64::max)
    }

    /// The pose that the homography gives for `[fx, fy, cx, cy]`.
    fn pose_of_plane(&self, k: [f64; 4]) -> Option<Pose> {
        let camera_from_plane = zhang::pose(self.homography.as_ref()?, k, self.middle())?;
        Some(self.plane.camera_from_board(camera_from_plane))
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
    let size = problem.cameras.first().map_or([0; 2], |c| c.size_px);
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
        plane: Plane { board_from_plane: Pose::identity(), relief: 0.0 },
        homography: None,
        projection: None,
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
        if corner.is_outside(size) {
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
    seen.plane = Plane::of(&seen.board)
        .ok_or("its points are not finite, or not in a plane in a browser: use the command line")?;
    let plane: Vec<_> = seen.plane.flattened(&seen.board).collect();
    let extent = seen.extent_px();
    let flat = homography::fit(&plane, &seen.px, homography_options(&problem.options));
    if seen.plane.is_uneven() {
        seen.projection = dlt::fit(&seen.board, &seen.px, problem.options.ransac);
    }
    if seen.plane.is_solid() {
        seen.homography = flat.map(|fit| fit.matrix);
        seen.bent_px = solid_misfit(problem, &seen).ok_or("its points do not determine its pose")?;
    } else {
        let Some(fit) = flat else {
            return Err(
                "its corners lie on a line or in a point: a board must be seen in two directions".into()
            );
        };
        let mut errors: Vec<f64> =
            plane.iter().zip(&seen.px).map(|(b, p)| (homography::apply(&fit.matrix, b) - p).norm()).collect();
        seen.bent_px = median(&mut errors);
        seen.homography = Some(fit.matrix);
    }
    // No lens bends a board by a sixth of its size; corners in a wrong order do.
    if seen.bent_px.is_nan() || seen.bent_px > 0.15 * extent {
        return Err(if seen.plane.is_solid() {
            format!(
                "its points do not form the target ({:.0} px off, in a view that is {extent:.0} px wide): are their names right?",
                seen.bent_px
            )
        } else {
            format!(
                "its corners do not form the board ({:.0} px off a flat grid that is {extent:.0} px wide)",
                seen.bent_px
            )
        });
    }
    Ok(seen)
}

/// How far the points of a solid thing are from where the best lens without terms of its own sees them, px: whatever its focal length
/// for a perspective one, at the best of a few for others.
fn solid_misfit(problem: &Problem, seen: &Seen) -> Option<f64> {
    let setup = problem.cameras.first()?;
    let spec = setup.model.spec();
    let few = seen.board.len() < dlt::POINTS;
    if spec.perspective && !few {
        return Some(seen.projection.as_ref()?.median_px);
    }
    let [w, h] = setup.size_px.map(f64::from);
    let misfit = |share: f64| {
        let f = share * w;
        let params = [&[f, f, (w - 1.0) / 2.0, (h - 1.0) / 2.0], spec.neutral].concat();
        Some(
            f * if few {
                seen.consensus(spec, &params)?.typical_rad
            } else {
                seen.linear(spec, &params)?.rms_rad
            },
        )
    };
    let focals = if spec.perspective { FOCALS } else { FISHEYE_FOCALS };
    focals.into_iter().filter_map(misfit).reduce(f64::min)
}

impl Seen {
    /// Rays of the corners without the model's terms; none where it has none.
    fn rays(&self, spec: &Spec, params: &[f64]) -> impl Iterator<Item = Vector3<f64>> {
        let ray = |px: &Vector2<f64>| match spec.perspective {
            true => Vector3::new((px.x - params[2]) / params[0], (px.y - params[3]) / params[1], 1.0),
            // As the model guesses it: exact, or without its small terms.
            false => (spec.guess_ray)(params, px),
        };
        self.px.iter().map(ray)
    }

    /// What the rays of a solid thing say of its pose.
    fn linear(&self, spec: &Spec, params: &[f64]) -> Option<dlt::Linear> {
        let used = |i: usize| !spec.perspective || self.projection.as_ref().is_none_or(|p| p.inliers[i]);
        let (board, rays): (Vec<_>, Vec<_>) = self
            .board
            .iter()
            .zip(self.rays(spec, params))
            .enumerate()
            .filter(|(i, (_, ray))| used(*i) && ray.iter().all(|x| x.is_finite()))
            .map(|(_, pair)| pair)
            .unzip();
        dlt::pose(&board, &rays)
    }

    /// The pose that most corners agree on, whatever the others say.
    fn consensus(&self, spec: &Spec, params: &[f64]) -> Option<Consensus> {
        let unit = |(board, ray): (&Point3<f64>, Vector3<f64>)| Some((*board, ray.try_normalize(0.0)?));
        let (board, rays): (Vec<_>, Vec<_>) =
            self.board.iter().zip(self.rays(spec, params)).filter_map(unit).unzip();
        p3p::consensus(&board, &rays)
    }

    /// Median distance of the corners from where a camera sees them, px; those that it does not see are infinitely far.
    fn misfit_px(&self, spec: &Spec, params: &[f64], pose: &Pose) -> f64 {
        let error = |(board, px): (&Point3<f64>, &Vector2<f64>)| {
            (spec.project_px)(params, &pose.apply(board).coords).map_or(f64::INFINITY, |p| (p - px).norm())
        };
        median(&mut self.board.iter().zip(&self.px).map(error).collect::<Vec<_>>())
    }

    /// Whether one view tells of its points that they are mirrored.
    pub(super) fn is_mirrored(&self) -> bool {
        self.plane.is_solid() && self.projection.as_ref().is_some_and(dlt::Fit::is_mirrored)
    }
}

/// The linear pose of a view: from its homography, or where the model is no perspective one from its rays. Where the corners are not in
/// a plane, from these in space if that explains them better.
pub(super) fn first_pose(view: &Seen, spec: &Spec, params: &[f64]) -> Option<Pose> {
    let flat = flat_pose(view, spec, params);
    if !view.plane.is_uneven() {
        return flat;
    }
    let misfit = |pose: &Pose| view.misfit_px(spec, params, pose);
    let solid = view.linear(spec, params).map(|l| l.pose);
    let solid = solid.or_else(|| Some(view.consensus(spec, params)?.pose));
    [solid, flat].into_iter().flatten().min_by(|a, b| misfit(a).total_cmp(&misfit(b)))
}

fn flat_pose(view: &Seen, spec: &Spec, params: &[f64]) -> Option<Pose> {
    if spec.perspective {
        return view.pose_of_plane([params[0], params[1], params[2], params[3]]);
    }
    let (plane, rays): (Vec<[f64; 2]>, Vec<_>) = view
        .plane
        .flattened(&view.board)
        .zip(view.rays(spec, params))
        .filter(|(_, ray)| ray.iter().all(|x| x.is_finite()))
        .map(|(p, ray)| ([p.x, p.y], ray))
        .unzip();
    zhang::pose_from_rays(&plane, &rays).map(|pose| view.plane.camera_from_board(pose))
}

/// A lens may bend the picture of a board by this share of it.
const BENT: f64 = 0.02;

/// [`first_pose`]; where there is none, or most corners contradict it, the pose that most of them agree on, and the threshold of a loss
/// that stands up to the others, px. A homography has looked for agreement already.
fn agreed_pose(view: &Seen, spec: &Spec, params: &[f64]) -> Option<(Pose, Option<f64>)> {
    let bent_px = BENT * view.extent_px();
    let misfit = |pose: &Pose| view.misfit_px(spec, params, pose);
    let first = first_pose(view, spec, params);
    match first {
        Some(pose) if spec.perspective || misfit(&pose) <= bent_px => Some((pose, None)),
        _ => {
            let agreed = view.consensus(spec, params).map(|c| c.pose);
            let better =
                [first, agreed].into_iter().flatten().min_by(|a, b| misfit(a).total_cmp(&misfit(b)))?;
            Some((better, Some(bent_px)))
        }
    }
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
    let (pose, huber_px) = agreed_pose(view, model.spec(), params)?;
    let free = Free::none(model);
    let start = State { params: params.to_vec(), poses: vec![pose] };
    let limits = Limits { iterations: 2, tolerance: 1e-3, damping: 1e-6, enough: None };
    let problem = refine::Problem { huber_px, ..alone(&block, model, &free) };
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
