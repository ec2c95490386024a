//! The synthetic twin of a capture: the same boards before the same camera, drawn anew, so that the truth is known.
//!
//! Every picture is rendered at its pose ([`super::synth`]) with the grey levels and the blur that its own corners were found to have
//! (`Light`, of checkerboards; those of an ordinary print where they are not known), and with as much noise as makes the detector predict
//! the same σ for its corners as in the photograph, as far as it does not hide the board: shot noise and JPEG are in that σ, too. The real
//! detector finds the corners, the real solver the camera, again and again with other noise. What a parameter is off on average is its
//! bias, how it varies its scatter, and both stand beside the σ that was predicted: from pictures to the camera, not only from corners.
//!
//! Whatever of a target is detected can be drawn: checkerboards, markers and circles, black on white. Of circles the solver's correction of
//! their centres is part of each run, as in the capture.
//!
//! What the twin does not have is what the noise of the pictures cannot explain: a board that is not flat, motion, a lens that is
//! not of the model. Where the σ of the capture is larger than that of its twin, that is the reason.

mod look;
mod outcome;

pub use outcome::{Outcome, Parameter, Place};

use std::ops::ControlFlow;

use nalgebra::{Point2, Point3, Vector2};

use super::{
    Error, Result,
    calibrate::{CameraSetup, Options, Problem},
    camera::Camera,
    circles::bias,
    detect::Light,
    image::Gray,
    observation::{Corner, FrameId, Observation},
    pose::Pose,
    report::{FrameReport, Report, Solution},
    stats,
    synth::{Degrade, Levels, Print},
    target::Target,
};

/// Grey levels of a print in ordinary light.
const LEVELS: Levels = Levels { black: 40, white: 215, background: 130 };
/// Width of the white border, squares, markers or spacings.
const MARGIN: f64 = 1.0;
/// Blur of a lens in focus with the pixels behind it, px.
const BLUR_PX: f64 = 0.6;
/// Noise of a picture in ordinary light, grey levels: what is tried first. What noise may be.
const NOISE: f64 = 4.0;
const NOISES: [f64; 2] = [0.05, 60.0];
/// How often the noise is adapted.
const ROUNDS: u64 = 2;
/// Share of the points that noise may hide; where it hides more it is lowered by this factor, so often at most.
const HIDDEN: f64 = 0.1;
const LOWER: f64 = 0.7;
const LOWERINGS: u64 = 6;

/// A capture that can be drawn again.
pub struct Twin {
    /// The true camera: that of the capture.
    camera: Camera,
    target: Target,
    options: Options,
    solution: Solution,
    views: Vec<View>,
}

/// A picture of the capture.
struct View {
    /// The true pose.
    camera_from_board: Pose,
    /// Indices of the points that were used.
    used: Vec<u32>,
    /// Median of their predicted σ, px.
    sigma_px: f64,
    /// Where it is known.
    light: Option<Light>,
}

impl View {
    /// `None` of a picture without a pose.
    fn of(frame: &FrameReport) -> Option<Self> {
        Some(Self {
            camera_from_board: frame.camera_from_board()?,
            used: frame.corners.iter().map(|c| c.index).collect(),
            sigma_px: median_sigma(&frame.corners),
            light: frame.light,
        })
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
    /// [`Error::Invalid`] where there is no calibration, and of known points, of which nobody knows how they look; those of [`Print::of`].
    pub fn of(report: &Report) -> Result<Self> {
        let (Some(solution), Some(target)) = (report.solution.clone(), report.settings.target()) else {
            return Err(Error::Invalid(
                "there is no calibration to make a twin of: calibrate first".to_owned(),
            ));
        };
        if matches!(target, Target::Points { .. }) {
            return Err(Error::Invalid(
                "a twin can be drawn of printed boards only: how known points look in a picture is not known"
                    .to_owned(),
            ));
        }
        let settings = &report.settings;
        let options = Options {
            fixed: settings.fixed.clone(),
            loss: settings.loss,
            weights: settings.weights,
            multi_start: false,
            ..Options::default()
        };
        let views = report.included().filter_map(View::of).collect();
        Print::of(&target, MARGIN, LEVELS)?;
        Ok(Self { camera: solution.camera.clone(), target, options, solution, views })
    }

    /// Number of pictures.
    pub fn pictures(&self) -> usize {
        self.views.len()
    }

    /// Draws a picture `runs` times with other noise and finds its corners. `report` gets the share that is done, and may stop it.
    ///
    /// # Errors
    /// [`Error::Stopped`] where `report` breaks; otherwise those of [`Print::light`].
    pub fn seen(
        &self,
        view: usize,
        runs: usize,
        report: &mut dyn FnMut(f32) -> ControlFlow<()>,
    ) -> Result<Seen> {
        let View { camera_from_board, used, sigma_px, light: known } =
            self.views.get(view).ok_or(Error::Stopped)?;
        let (levels, blur, mut noise) = match known {
            Some(known) => (levels(known), known.blur_px, known.noise.clamp(NOISES[0], NOISES[1])),
            None => (LEVELS, BLUR_PX, NOISE),
        };
        let light = Print::of(&self.target, MARGIN, levels)?.light(&self.camera, camera_from_board)?;
        let truth = self.places_px(view);
        let look = |noise: f64, seed: u64| -> Result<Vec<Corner>> {
            let degrade = Degrade { blur, noise, ..Degrade::default() };
            let picture = Gray::U8(degrade.expose(light.clone(), seed, view)?);
            Ok(look::at(&picture, &self.target, &truth, used))
        };
        let mut most = 0;
        for round in 0..ROUNDS {
            let corners = look(noise, u64::MAX - round)?;
            most = most.max(corners.len());
            let found = median_sigma(&corners);
            if found > 0.0 && *sigma_px > 0.0 {
                noise = (noise * sigma_px / found).clamp(NOISES[0], NOISES[1]);
            }
        }
        // Where σ has other reasons, so much noise may hide the board.
        for round in ROUNDS..ROUNDS + LOWERINGS {
            if look(noise, u64::MAX - round)?.len() as f64 >= (1.0 - HIDDEN) * most as f64 {
                break;
            }
            noise *= LOWER;
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

    /// Where each point of a view is to be measured, by index, px: the projected point, and of a circle the centre of what is seen of it.
    fn places_px(&self, view: usize) -> Vec<Option<Vector2<f64>>> {
        let Some(View { camera_from_board: pose, .. }) = self.views.get(view) else { return Vec::new() };
        let place = |point: &Point3<f64>| {
            let px = self.camera.project(&pose.apply(point))?;
            match self.target {
                Target::Circles { radius, .. } => {
                    Some(px + bias::offset(&self.camera, pose, &Point2::new(point.x, point.y), radius)?)
                }
                _ => Some(px),
            }
        };
        self.target.points_in_board().iter().map(place).collect()
    }

    /// What one run is calibrated from.
    fn problem(&self, seen: &[Seen], run: usize) -> Problem {
        let observations = (0..).zip(seen).filter_map(|(frame, seen)| {
            let corners = seen.corners.get(run)?.clone();
            (!corners.is_empty()).then_some(Observation { camera: 0, frame: FrameId(frame), corners })
        });
        let camera = &self.camera;
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
            target: self.target.clone(),
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

#[cfg(test)]
mod tests;
