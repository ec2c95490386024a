//! The synthetic twin of a capture: the same boards before the same camera, drawn anew, so that the truth is known.
//!
//! Every picture is rendered at its pose ([`super::synth`]) with the grey levels and the blur that its own corners were found to have
//! (`Light`; those of an ordinary print where they are not known), and with as much noise as makes the detector predict the same σ for its
//! corners as in the photograph: shot noise and JPEG are in that σ, too. The real detector finds the corners, the real solver the camera, again and again with other noise. What a parameter is off
//! on average is its bias, how it varies its scatter, and both stand beside the σ that was predicted: from pictures to the camera, not only
//! from corners.
//!
//! What the twin does not have is what the noise of the pictures cannot explain: a board that is not flat, motion, a lens that is
//! not of the model. Where the σ of the capture is larger than that of its twin, that is the reason.

mod outcome;

pub use outcome::{Outcome, Parameter, Place};

use std::ops::ControlFlow;

use nalgebra::Vector2;

use super::{
    Error, Result,
    calibrate::{CameraSetup, Options, Problem},
    detect::{self, Light, detect},
    image::Gray,
    observation::{Corner, FrameId, Observation},
    pose::Pose,
    report::{FrameReport, Report, Solution},
    stats,
    synth::{Board, Degrade, Levels, Origin, Renderer, Scene, ScenePose},
    target::Target,
};

/// Grey levels of a print in ordinary light.
const LEVELS: Levels = Levels { black: 40, white: 215, background: 130 };
/// Width of the white border, squares.
const MARGIN: f64 = 1.0;
/// Blur of a lens in focus with the pixels behind it, px.
const BLUR_PX: f64 = 0.6;
/// Noise of a picture in ordinary light, grey levels: what is tried first. What noise may be.
const NOISE: f64 = 4.0;
const NOISES: [f64; 2] = [0.05, 60.0];
/// How often the noise is adapted.
const ROUNDS: usize = 2;

/// A capture that can be drawn again.
pub struct Twin {
    scene: Scene,
    options: Options,
    solution: Solution,
    views: Vec<View>,
}

/// A picture of the capture.
struct View {
    /// Indices of the corners that were used.
    used: Vec<u32>,
    /// Median of their predicted σ, px.
    sigma_px: f64,
    /// Where it is known.
    light: Option<Light>,
}

impl View {
    fn of(frame: &FrameReport) -> Self {
        Self {
            used: frame.corners.iter().map(|c| c.index).collect(),
            sigma_px: median_sigma(&frame.corners),
            light: frame.light,
        }
    }
}

/// What was seen of one picture.
#[derive(Clone, Debug)]
pub struct Seen {
    /// σ of the noise, grey levels.
    pub noise: f64,
    /// Corners of each run; empty where the board was not found.
    pub corners: Vec<Vec<Corner>>,
}

impl Twin {
    /// # Errors
    /// [`Error::Invalid`] where there is no calibration, or the board is no checkerboard.
    pub fn of(report: &Report) -> Result<Self> {
        let solution = report.solution.clone().ok_or_else(|| {
            Error::Invalid("there is no calibration to make a twin of: calibrate first".to_owned())
        })?;
        let settings = &report.settings;
        let (None, Some(size)) = (&settings.target, settings.board) else {
            return Err(Error::Invalid(
                "a twin can be drawn of checkerboards only: this calibration is of another target".to_owned(),
            ));
        };
        let views: Vec<(&FrameReport, Pose)> =
            report.included().filter_map(|f| Some((f, f.camera_from_board()?))).collect();
        let scene = Scene {
            camera: solution.camera.clone(),
            board: Board {
                size,
                square: settings.square,
                unit: settings.unit,
                margin: MARGIN,
                levels: LEVELS,
                origin: Origin::FirstInner,
            },
            poses: views.iter().map(|(f, pose)| placed(f, pose)).collect(),
            method: Default::default(),
            degrade: Degrade { blur: BLUR_PX, ..Degrade::default() },
            seed: 0,
            color: false,
        };
        scene.validate()?;
        let options = Options {
            fixed: settings.fixed.clone(),
            loss: settings.loss,
            weights: settings.weights,
            multi_start: false,
            ..Options::default()
        };
        Ok(Self { scene, options, solution, views: views.iter().map(|(f, _)| View::of(f)).collect() })
    }

    /// Number of pictures.
    pub fn pictures(&self) -> usize {
        self.views.len()
    }

    /// Draws a picture `runs` times with other noise and finds its corners. `report` gets the share that is done, and may stop it.
    ///
    /// # Errors
    /// [`Error::Stopped`] where `report` breaks; otherwise those of [`Renderer`].
    pub fn seen(
        &self,
        view: usize,
        runs: usize,
        report: &mut dyn FnMut(f32) -> ControlFlow<()>,
    ) -> Result<Seen> {
        let View { used, sigma_px, light: known } = self.views.get(view).ok_or(Error::Stopped)?;
        let mut scene = self.scene.clone();
        let mut noise = NOISE;
        if let Some(known) = known {
            scene.board.levels = levels(known);
            scene.degrade.blur = known.blur_px;
            noise = known.noise.clamp(NOISES[0], NOISES[1]);
        }
        let light = Renderer::new(&scene)?.light(view)?;
        let truth = scene.corners_px(view);
        let look = |noise: f64, seed: u64| -> Result<Vec<Corner>> {
            let scene = Scene { seed, poses: Vec::new(), ..scene.clone() };
            let degrade = Degrade { noise, ..scene.degrade.clone() };
            let picture = degrade.apply(light.clone(), &scene, view)?;
            Ok(named(&detect(&Gray::U8(picture), &detect::Options::default()), &truth, used))
        };
        for round in 0..ROUNDS as u64 {
            let found = median_sigma(&look(noise, u64::MAX - round)?);
            if found > 0.0 && *sigma_px > 0.0 {
                noise = (noise * sigma_px / found).clamp(NOISES[0], NOISES[1]);
            }
        }
        let mut corners = Vec::with_capacity(runs);
        for run in 0..runs {
            if report(run as f32 / runs as f32).is_break() {
                return Err(Error::Stopped);
            }
            corners.push(look(noise, run as u64)?);
        }
        Ok(Seen { noise, corners })
    }

    /// What the solver makes of it, for all pictures in order.
    ///
    /// # Errors
    /// [`Error::Stopped`] where `report` breaks; [`Error::Invalid`] where too few runs have a camera.
    pub fn outcome(&self, seen: &[Seen], report: &mut dyn FnMut(f32) -> ControlFlow<()>) -> Result<Outcome> {
        outcome::of(self, seen, report)
    }

    fn target(&self) -> Target {
        self.scene.board.target()
    }

    /// What one run is calibrated from.
    fn problem(&self, seen: &[Seen], run: usize) -> Problem {
        let observations = (0..).zip(seen).filter_map(|(frame, seen)| {
            let corners = seen.corners.get(run)?.clone();
            (!corners.is_empty()).then_some(Observation { camera: 0, frame: FrameId(frame), corners })
        });
        let camera = &self.scene.camera;
        // Held parameters are held where they are; nothing else is told.
        let start = (!self.options.fixed.is_empty()).then(|| camera.clone());
        Problem {
            observations: observations.collect(),
            cameras: vec![CameraSetup {
                size_px: camera.size_px,
                model: camera.model,
                start,
                focal_hint_px: None,
            }],
            target: self.target(),
            options: self.options.clone(),
        }
    }
}

/// All of it in one go: `runs` times all pictures, then the camera of each run. `report` gets the share that is done, and may stop it.
///
/// # Errors
/// Those of [`Twin::of`], [`Twin::seen`] and [`Twin::outcome`].
pub fn run(of: &Report, runs: usize, report: &mut dyn FnMut(f32) -> ControlFlow<()>) -> Result<Outcome> {
    /// Share of the time that the pictures take.
    const PICTURES: f32 = 0.9;
    let twin = Twin::of(of)?;
    let n = twin.pictures() as f32;
    let seen: Result<Vec<Seen>> = (0..twin.pictures())
        .map(|view| twin.seen(view, runs, &mut |part| report(PICTURES * (view as f32 + part) / n)))
        .collect();
    twin.outcome(&seen?, &mut |part| report(PICTURES + (1.0 - PICTURES) * part))
}

fn placed(frame: &FrameReport, pose: &Pose) -> ScenePose {
    ScenePose {
        angles_deg: pose.euler_deg(),
        translation: pose.translation.into(),
        description: frame.name().to_owned(),
    }
}

/// Grey levels of a board in this light, and half way between them beside it.
fn levels(light: &Light) -> Levels {
    let level = |v: f64| v.round().clamp(0.0, 255.0) as u8;
    let [black, white] = [light.black, light.white].map(level);
    Levels { black, white, background: level(0.5 * (light.black + light.white)) }
}

/// 0 where there is none.
fn median_sigma(corners: &[Corner]) -> f64 {
    let mut all: Vec<f64> = corners.iter().map(|c| c.sigma_px).filter(|s| s.is_finite()).collect();
    all.sort_by(f64::total_cmp);
    if all.is_empty() { 0.0 } else { stats::quantile(&all, 0.5) }
}

/// The corners that were found by the indices of the true ones that they are nearest to, of those that the photograph shows.
fn named(detection: &detect::Detection, truth: &[Option<Vector2<f64>>], used: &[u32]) -> Vec<Corner> {
    /// A corner farther from its true place is another one, px.
    const NEAR_PX: f64 = 2.0;
    let Some(grid) = &detection.grid else { return Vec::new() };
    let corner = |index: &u32| {
        let place = (*truth.get(*index as usize)?)?;
        let distance = |px: &Vector2<f64>| (px - place).norm();
        let nearest = grid.corners.iter().min_by(|a, b| distance(&a.px).total_cmp(&distance(&b.px)))?;
        let found = Corner { index: *index, px: nearest.px, sigma_px: nearest.sigma_px };
        (distance(&found.px) < NEAR_PX).then_some(found)
    };
    used.iter().filter_map(corner).collect()
}

#[cfg(test)]
mod tests;
