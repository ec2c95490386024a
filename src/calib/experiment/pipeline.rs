//! One way through the whole: pictures, corners, calibration, and what they are worth against the truth.

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};
use std::{ops::ControlFlow, rc::Rc};

use crate::calib::{
    Error, Result, calibrate,
    camera::Camera,
    detect,
    image::{Gray, Plane},
    observation::{Corner, FrameId, Observation},
    solution::{Calibration, View},
    stats::{self, Comparison, Coverage, ErrorStats, spatial::Placed},
    synth::{Renderer, Scene},
    uncertainty::{self, Range, Uncertainty},
};

/// How far wrong corners are moved, px.
pub const WRONG_PX: f64 = 20.0;

/// What is done.
#[derive(Clone, Debug, PartialEq)]
pub struct Setup {
    /// What is photographed.
    pub scene: Scene,
    /// Only so many views, from the first.
    pub views: usize,
    /// Every so many corners one is moved by [`WRONG_PX`], as if it were mistaken; 0 for none.
    pub wrong_every: usize,
    /// How corners are found.
    pub detect: detect::Options,
    /// How the camera is calibrated.
    pub calibrate: calibrate::Options,
}

impl Setup {
    /// All views of a scene, with the options that are best.
    pub fn new(scene: Scene) -> Self {
        let views = scene.poses.len();
        Self {
            scene,
            views,
            wrong_every: 0,
            detect: detect::Options::default(),
            calibrate: calibrate::Options::default(),
        }
    }
}

/// What came of it.
#[derive(Clone, Debug)]
pub struct Run {
    /// What was done.
    pub setup: Setup,
    /// The pictures.
    pub pictures: Rc<Vec<Plane<u8>>>,
    /// What was found in them.
    pub seen: Rc<Vec<Seen>>,
    /// The camera.
    pub calibration: Calibration,
}

/// What was found in one picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Seen {
    /// Ascending by index; empty where no board was found.
    pub corners: Vec<Corner>,
    /// Whether all corners of the board are there.
    pub full: bool,
    /// Why nothing was found.
    pub why: String,
}

/// Renders, detects and calibrates; what several setups share is done once.
#[derive(Default)]
pub struct Bench {
    pictures: Vec<(Scene, Rc<Vec<Plane<u8>>>)>,
    seen: Vec<(Scene, detect::Options, Rc<Vec<Seen>>)>,
}

impl Bench {
    /// The pictures of a scene.
    ///
    /// # Errors
    /// [`Error::Invalid`] where the scene cannot be drawn.
    pub fn pictures(&mut self, scene: &Scene) -> Result<Rc<Vec<Plane<u8>>>> {
        if let Some((_, pictures)) = self.pictures.iter().find(|(s, _)| s == scene) {
            return Ok(Rc::clone(pictures));
        }
        let renderer = Renderer::new(scene)?;
        let pictures: Result<Vec<_>> = (0..scene.poses.len()).map(|view| renderer.render(view)).collect();
        let pictures = Rc::new(pictures?);
        self.pictures.push((scene.clone(), Rc::clone(&pictures)));
        Ok(pictures)
    }

    /// What is found in the pictures of a scene.
    ///
    /// # Errors
    /// As [`Bench::pictures`].
    pub fn seen(&mut self, scene: &Scene, options: detect::Options) -> Result<Rc<Vec<Seen>>> {
        if let Some((_, _, seen)) = self.seen.iter().find(|(s, o, _)| s == scene && *o == options) {
            return Ok(Rc::clone(seen));
        }
        let pictures = self.pictures(scene)?;
        let seen = Rc::new(pictures.iter().map(|p| look(p, scene, &options)).collect::<Vec<_>>());
        self.seen.push((scene.clone(), options, Rc::clone(&seen)));
        Ok(seen)
    }

    /// The whole way.
    ///
    /// # Errors
    /// As [`Bench::pictures`] and [`calibrate::calibrate`].
    pub fn run(&mut self, setup: Setup) -> Result<Run> {
        let pictures = self.pictures(&setup.scene)?;
        let seen = self.seen(&setup.scene, setup.detect)?;
        let mut count = 0usize;
        let mut spoiled = |corner: &Corner| {
            count += 1;
            let (sin, cos) = (count as f64).sin_cos();
            let wrong = setup.wrong_every > 0 && count.is_multiple_of(setup.wrong_every);
            Corner { px: corner.px + Vector2::new(cos, sin) * if wrong { WRONG_PX } else { 0.0 }, ..*corner }
        };
        let observation = |(view, seen): (usize, &Seen)| Observation {
            camera: 0,
            frame: FrameId(view as u32),
            corners: seen.corners.iter().map(&mut spoiled).collect(),
        };
        let with_board = seen.iter().enumerate().take(setup.views).filter(|(_, s)| !s.corners.is_empty());
        let problem = calibrate::Problem {
            cameras: vec![calibrate::CameraSetup {
                size_px: setup.scene.camera.size_px,
                model: setup.scene.camera.model,
                start: None,
                focal_hint_px: None,
            }],
            target: setup.scene.board.target(),
            observations: with_board.map(observation).collect(),
            options: setup.calibrate.clone(),
        };
        let calibration = calibrate::calibrate(&problem, &mut |_| ControlFlow::Continue(()))?;
        Ok(Run { setup, pictures, seen, calibration })
    }
}

/// Corners of one picture with their indices.
fn look(picture: &Plane<u8>, scene: &Scene, options: &detect::Options) -> Seen {
    let none = |why: String| Seen { corners: Vec::new(), full: false, why };
    let detection = detect::detect(&Gray::U8(picture.clone()), options);
    match detection.grid.map(|grid| grid.assign(scene.board.size, &[])) {
        Some(Ok(assigned)) => Seen { full: assigned.full, corners: assigned.corners, why: String::new() },
        Some(Err(why)) => none(why),
        None => none(detection.why),
    }
}

/// A view in numbers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ViewNumbers {
    /// From 1.
    pub view: usize,
    /// Corners used.
    pub corners: usize,
    /// Mean length of the residuals, px.
    pub mean_px: f64,
    /// Root of their mean square, px.
    pub rms_px: f64,
    /// Longest, px.
    pub max_px: f64,
    /// Angle between the board's normal and the optical axis, as found.
    pub tilt_deg: f64,
    /// Rotation about the optical axis, as found.
    pub roll_deg: f64,
    /// Distance of the board's middle, in the board's unit, as found.
    pub distance: f64,
}

impl Run {
    /// The views that were used, with their position in the scene.
    pub fn views(&self) -> impl Iterator<Item = (usize, &View)> {
        self.calibration.views.iter().map(|v| (v.frame.0 as usize, v))
    }

    /// Pictures in which the whole board was found.
    pub fn full(&self) -> usize {
        self.seen.iter().take(self.setup.views).filter(|s| s.full).count()
    }

    /// Corners that were used.
    pub fn corners(&self) -> usize {
        self.calibration.views.iter().map(|v| v.indices.len()).sum()
    }

    /// Lengths of all residuals, px.
    pub fn residuals_px(&self) -> Vec<f64> {
        self.calibration.views.iter().flat_map(|v| v.residuals_px.iter().map(Vector2::norm)).collect()
    }

    /// Their statistics: Table IV.
    pub fn errors(&self) -> ErrorStats {
        stats::errors(&self.residuals_px())
    }

    /// Found − true place of all corners found, px.
    pub fn mistakes_px(&self) -> Vec<Vector2<f64>> {
        let each = |(view, seen): (usize, &Seen)| {
            let truth = self.setup.scene.corners_px(view);
            let miss = |c: &Corner| Some(c.px - (*truth.get(c.index as usize)?)?);
            seen.corners.iter().filter_map(miss).collect::<Vec<_>>()
        };
        self.seen.iter().enumerate().take(self.setup.views).flat_map(each).collect()
    }

    /// Statistics of |found − true|, px.
    pub fn localisation(&self) -> ErrorStats {
        stats::errors(&self.mistakes_px().iter().map(Vector2::norm).collect::<Vec<_>>())
    }

    /// Places of the corners used, px.
    pub fn points_px(&self) -> Vec<Vector2<f64>> {
        self.placed().into_iter().map(|p| p.px).collect()
    }

    /// Residuals at their places.
    pub fn placed(&self) -> Vec<Placed> {
        let mut all = Vec::new();
        for (view, solved) in self.views() {
            let seen = &self.seen[view].corners;
            for (index, residual) in solved.indices.iter().zip(&solved.residuals_px) {
                if let Some(c) = seen.iter().find(|c| c.index == *index) {
                    all.push(Placed { px: c.px, view, residual_px: *residual });
                }
            }
        }
        all
    }

    /// Coverage of the picture.
    pub fn coverage(&self) -> Coverage {
        stats::coverage(&self.points_px(), self.setup.scene.camera.size_px)
    }

    /// Parameters beside the truth.
    ///
    /// # Errors
    /// As [`stats::compare`].
    pub fn comparison(&self) -> Result<Vec<Comparison>> {
        stats::compare(&self.calibration, &self.setup.scene.camera)
    }

    /// One parameter beside its truth.
    ///
    /// # Errors
    /// [`Error::Invalid`] where the model has no such parameter.
    pub fn parameter(&self, name: &str) -> Result<Comparison> {
        let wanted = self.comparison()?.into_iter().find(|c| c.name == name);
        wanted.ok_or_else(|| Error::Invalid(format!("the camera has no parameter {name}")))
    }

    /// The camera found.
    pub fn camera(&self) -> &Camera {
        &self.calibration.camera
    }

    /// How sure its projection is, at the distance of the boards.
    pub fn uncertainty(&self) -> Uncertainty {
        uncertainty::of(&self.calibration, &self.setup.scene.board.target(), Range::Boards)
    }

    /// Each view in numbers.
    pub fn view_numbers(&self) -> Vec<ViewNumbers> {
        let target = self.setup.scene.board.target();
        let numbers = |(view, solved): (usize, &View)| {
            let errors = stats::errors(&solved.residuals_px.iter().map(Vector2::norm).collect::<Vec<_>>());
            let stance = stats::stance(&solved.camera_from_board, &target);
            ViewNumbers {
                view: view + 1,
                corners: errors.n,
                mean_px: errors.mean,
                rms_px: errors.rms,
                max_px: errors.max,
                tilt_deg: stance.tilt_rad.to_degrees(),
                roll_deg: stance.roll_rad.to_degrees(),
                distance: stance.distance,
            }
        };
        self.views().map(numbers).collect()
    }
}
