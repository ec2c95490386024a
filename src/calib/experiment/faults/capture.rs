//! A capture by projection: a camera, boards all over its view, noise.

use std::ops::ControlFlow;

use nalgebra::{Point3, UnitQuaternion, Vector2, Vector3};
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use super::plant::{Planted, Strength};
use crate::calib::{
    calibrate::{CameraSetup, Loss, Options, Problem, calibrate},
    camera::{Camera, Model},
    diagnose::faults,
    observation::{Corner, FrameId, Observation},
    pose::Pose,
    report::{FrameReport, FrameState, Report, Settings},
    solution::Calibration,
    target::{BoardSize, Target, Unit},
};

const BOARD: BoardSize = BoardSize { cols: 9, rows: 6 };
const SIZE_PX: [u32; 2] = [1280, 960];

/// Where a corner is and in which picture, as a fault sees it.
pub(super) struct Spot {
    pub(super) view: usize,
    pub(super) views: usize,
    /// On the board, its middle 0 and half its longer side 1.
    pub(super) flat: [f64; 2],
}

/// What all pictures of a capture share.
pub(super) struct Capture {
    truth: Camera,
    target: Target,
    poses: Vec<Pose>,
    noise: Vec<Vec<Vector2<f64>>>,
    noise_px: f64,
    seed: u64,
}

impl Capture {
    /// `None` where a seed leads to a camera that sees too few boards.
    pub(super) fn new(seed: u64) -> Option<Self> {
        let mut random = Pcg64::seed_from_u64(seed);
        let mut draw = |a: f64, b: f64| random.random_range(a..b);
        let [w, h] = SIZE_PX.map(f64::from);
        let f = draw(0.65, 1.4) * w;
        // A barrel that fades with the angle of view, and what mounting leaves.
        let k1 = draw(-0.3, -0.05);
        let params = vec![
            f,
            f * draw(0.999, 1.001),
            w / 2.0 + draw(-15.0, 15.0),
            h / 2.0 + draw(-15.0, 15.0),
            k1,
            draw(0.2, 0.5) * k1 * k1,
            draw(-1e-3, 1e-3),
            draw(-1e-3, 1e-3),
            0.0,
        ];
        let truth = Camera::new(Model::Brown5, SIZE_PX, params).ok()?;
        let target = Target::checkerboard(BOARD, 25.0);
        let views = draw(14.0, 26.0) as usize;
        let noise_px = draw(0.05, 0.2);
        let mut poses = Vec::new();
        for _ in 0..50 * views {
            let px = Vector2::new(draw(0.0, w), draw(0.0, h));
            let place = draw(250.0, 600.0) * f / 900.0;
            let turn = Vector3::new(draw(-0.7, 0.7), draw(-0.7, 0.7), draw(-3.1, 3.1));
            let Some(ray) = truth.unproject(&px) else { continue };
            let Some(sight) = UnitQuaternion::rotation_between(&Vector3::z(), &ray) else { continue };
            let rotation = (sight * UnitQuaternion::from_scaled_axis(turn)).to_rotation_matrix();
            let translation = ray * place - rotation * target.center_in_board().coords;
            let pose = Pose { rotation, translation };
            if seen(&truth, &target, &pose).iter().flatten().count() >= 20 {
                poses.push(pose);
            }
            if poses.len() == views {
                break;
            }
        }
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let noise = poses
            .iter()
            .map(|_| (0..BOARD.len()).map(|_| Vector2::new(normal(), normal()) * noise_px).collect());
        let noise = noise.collect();
        (poses.len() == views).then_some(Self { truth, target, poses, noise, noise_px, seed })
    }

    /// The pictures with a fault; without noise where `noisy` is false.
    fn problem(&self, strength: Option<&Strength>, noisy: bool) -> Problem {
        let views = self.poses.len();
        let observations = self.poses.iter().enumerate().map(|(view, pose)| {
            let places = seen(&self.truth, &self.target, pose);
            let corner = |index: usize| {
                places[index]?;
                let point = self.target.point_in_board(index as u32)?;
                let flat = (point - self.target.center_in_board()) / 100.0;
                let spot = Spot { view, views, flat: [flat.x, flat.y] };
                let px = match strength {
                    Some(strength) => strength.project(&self.truth, pose, &point, &spot)?,
                    None => self.truth.project(&pose.apply(&point))?,
                };
                // What a fault moves out of the picture is not seen.
                shown(&self.truth, &px).then_some(())?;
                let noise = if noisy { self.noise[view][index] } else { Vector2::zeros() };
                Some(Corner { index: index as u32, px: px + noise, sigma_px: self.noise_px })
            };
            let corners = (0..BOARD.len()).filter_map(corner).collect();
            Observation { camera: 0, frame: FrameId(view as u32), corners }
        });
        let setup = CameraSetup {
            size_px: SIZE_PX,
            model: Model::Brown5,
            start: Some(self.truth.clone()),
            focal_hint_px: None,
        };
        let options = Options { multi_start: false, ..Options::default() };
        Problem {
            cameras: vec![setup],
            target: self.target.clone(),
            observations: observations.collect(),
            options,
        }
    }

    /// What is named first in the pictures with a fault; the fault itself only where its picture is right. Empty for nothing, `None` where
    /// the capture cannot be calibrated.
    pub(super) fn named(&self, fault: Option<(&Planted, &Strength)>) -> Option<String> {
        let (planted, strength) = fault.unzip();
        let problem = self.problem(strength, true);
        let calibration = solved(&problem)?;
        let report = self.report(&problem, &calibration);
        let all = faults::of_calibration(&report, &calibration, &self.target);
        let first = all.into_iter().find(|f| f.found);
        Some(first.map_or_else(String::new, |fault| {
            let about = strength.and_then(Strength::picture);
            match about {
                Some(view)
                    if planted.is_some_and(|p| p.code == fault.code) && !fault.frames.contains(&view) =>
                {
                    format!("{} elsewhere", fault.code)
                }
                _ => fault.code,
            }
        }))
    }

    fn report(&self, problem: &Problem, calibration: &Calibration) -> Report {
        let frames = problem.observations.iter().map(|o| {
            let mut frame = FrameReport::new(format!("{}.png", o.frame.0));
            (frame.state, frame.found, frame.corners) = (FrameState::Full, true, o.corners.clone());
            frame
        });
        let settings = Settings { board: Some(BOARD), square: 25.0, unit: Unit::Mm, ..Settings::default() };
        let mut report = Report::new(settings, Vec::new(), frames.collect(), Vec::new());
        report.calibrated(calibration, &self.target);
        report
    }

    /// The fault, as strong as moves the map by `times` its uncertainty without noise; `None` where it does not at its largest.
    pub(super) fn strength(&self, planted: &Planted, times: f64) -> Option<Strength> {
        let clean = solved(&self.problem(None, true))?;
        let map = faults::MapOf::new(&clean, &self.target)?;
        let mut value = planted.least;
        // Of one picture from the answer to a small fault: a strong one would not be believed.
        for _ in 0..if planted.alone { 1 } else { 3 } {
            let tried = planted.drawn(self.seed, value);
            let mut problem = self.problem(Some(&tried), false);
            problem.options.loss = Loss::Linear;
            let moved = map.between(&tried.true_camera(&self.truth), &solved(&problem)?.camera)?;
            value = (value * times * map.sigma_px() / moved.max(1e-9)).min(planted.most);
        }
        (value < planted.most).then(|| planted.drawn(self.seed, value))
    }
}

fn solved(problem: &Problem) -> Option<Calibration> {
    calibrate(problem, &mut |_| ControlFlow::Continue(())).ok()
}

/// Whether a picture shows a place with some room about it.
fn shown(camera: &Camera, px: &Vector2<f64>) -> bool {
    let [w, h] = camera.size_px.map(f64::from);
    px.x > 8.0 && px.y > 8.0 && px.x < w - 9.0 && px.y < h - 9.0
}

/// Places of the corners of a board, as far as the picture shows them.
fn seen(camera: &Camera, target: &Target, pose: &Pose) -> Vec<Option<Vector2<f64>>> {
    let place = |point: Point3<f64>| {
        let place = pose.apply(&point);
        let px = camera.project(&place)?;
        // Beyond the fold of the lens's own polynomial nothing is seen.
        camera.unproject(&px).filter(|ray| ray.angle(&place.coords) < 1e-6)?;
        shown(camera, &px).then_some(px)
    };
    target.points_in_board().into_iter().map(place).collect()
}
