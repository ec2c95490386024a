//! Pictures of one pose count once, with their corners averaged: copies and bursts bring no new pose, and their common errors do not
//! average out. What does average out, the scatter between them, is measured.

use std::ops::ControlFlow;

use nalgebra::Vector2;

use crate::calib::{
    Error, Result,
    bursts::repeated,
    calibrate::{Problem, calibrate, pose_of},
    number::counted,
    observation::{Corner, FrameId},
    report::Report,
    solution::{Calibration, View, Warning},
};

/// Code of the warning.
const REPEATED: &str = "repeated_pose";

/// A set in which each burst is one picture, its first, with the members of each.
pub(super) struct Averaged {
    problem: Problem,
    bursts: Vec<Vec<FrameId>>,
}

/// The calibration with each burst as one picture; as it is where there is none, or the bursts alone do not determine the camera.
///
/// # Errors
/// [`Error::Stopped`] where `tick` breaks.
pub(super) fn once(
    problem: &Problem,
    calibration: Calibration,
    tick: &mut dyn FnMut(f32) -> ControlFlow<()>,
) -> Result<(Calibration, Option<Averaged>)> {
    let Some(averaged) = averaged(problem, &calibration) else { return Ok((calibration, None)) };
    match calibrate(&averaged.problem, tick) {
        Ok(again) => Ok((again, Some(averaged))),
        Err(Error::Stopped) => Err(Error::Stopped),
        Err(_) => Ok((calibration, None)),
    }
}

/// `None` where no pose was photographed twice. Corners are averaged as residuals, each picture with its own pose, so that a hand that
/// trembled does no harm.
fn averaged(problem: &Problem, calibration: &Calibration) -> Option<Averaged> {
    let camera = &calibration.camera;
    let seen: Vec<(&View, Vec<(u32, Vector2<f64>)>)> = calibration
        .views
        .iter()
        .filter_map(|view| {
            let observation = problem.observations.iter().find(|o| o.frame == view.frame)?;
            Some((view, crate::calib::bursts::corners(observation)))
        })
        .collect();
    let pictures: Vec<_> = seen.iter().map(|s| s.1.clone()).collect();
    let group = repeated(&pictures, camera.size_px);
    let count = group.iter().max().map_or(0, |last| last + 1);
    if count == group.len() {
        return None;
    }
    let mut problem = problem.clone();
    problem.cameras.iter_mut().for_each(|c| (c.model, c.start) = (camera.model, Some(camera.clone())));
    let mut bursts = Vec::new();
    for g in 0..count {
        let members: Vec<&View> =
            seen.iter().zip(&group).filter(|(_, k)| **k == g).map(|(s, _)| s.0).collect();
        let [first, _, ..] = members[..] else { continue };
        let frames: Vec<FrameId> = members.iter().map(|v| v.frame).collect();
        let corners =
            |frame: FrameId| problem.observations.iter().find(|o| o.frame == frame).map(|o| &o.corners);
        let mean: Option<Vec<Corner>> = first
            .indices
            .iter()
            .map(|index| {
                let place = first.camera_from_board.apply(&problem.target.point_in_board(*index)?);
                let own = members.iter().filter_map(|view| {
                    let at = view.indices.iter().position(|i| i == index)?;
                    let corner = corners(view.frame)?.iter().find(|c| c.index == *index)?;
                    Some((view.residuals_px[at], corner.sigma_px))
                });
                let own: Vec<(Vector2<f64>, f64)> = own.collect();
                let n = own.len() as f64;
                let residual = own.iter().map(|o| o.0).sum::<Vector2<f64>>() / n;
                let scatter = own.iter().map(|o| (o.0 - residual).norm_squared()).sum::<f64>()
                    / (2.0 * (n - 1.0).max(1.0));
                let variance = own.iter().map(|o| o.1 * o.1).sum::<f64>() / n;
                // What they share stays; what they do not falls with their number.
                let sigma_px = (variance - scatter * (1.0 - 1.0 / n)).max(variance / n).sqrt();
                Some(Corner { index: *index, px: camera.project(&place)? + residual, sigma_px })
            })
            .collect();
        let Some(mean) = mean else { continue };
        problem.observations.retain(|o| o.frame == frames[0] || !frames.contains(&o.frame));
        if let Some(observation) = problem.observations.iter_mut().find(|o| o.frame == frames[0]) {
            observation.corners = mean;
        }
        bursts.push(frames);
    }
    (!bursts.is_empty()).then_some(Averaged { problem, bursts })
}

impl Averaged {
    /// Says of every member how it fits by itself, and that it counts with the others.
    ///
    /// # Errors
    /// Those of [`pose_of`], which found them before.
    pub(super) fn told(&self, all: &Problem, calibration: &Calibration, report: &mut Report) -> Result<()> {
        let camera = &calibration.camera;
        let mut extra = 0;
        for frames in &self.bursts {
            let aside = !calibration.views.iter().any(|v| v.frame == frames[0]);
            let Some(name) = report.frames.get(frames[0].0 as usize).map(|f| f.file.clone()) else {
                continue;
            };
            for frame in frames.iter().filter(|_| !aside) {
                let Some(observation) = all.observations.iter().find(|o| o.frame == *frame) else { continue };
                let (pose, residuals_px) = pose_of(camera, &all.target, &observation.corners)?;
                let outliers =
                    calibration.views.iter().find(|v| v.frame == frames[0]).map(|v| v.outliers.clone());
                report.burst_member(
                    *frame,
                    &all.target,
                    pose,
                    &residuals_px,
                    outliers.unwrap_or_default(),
                    &name,
                );
                extra += usize::from(*frame != frames[0]);
            }
        }
        if extra > 0 {
            report.fits_again();
            // Of a report that is solved again it is told already.
            report.warnings.retain(|w| w.code != REPEATED);
            report.warnings.push(Warning::new(
                REPEATED,
                format!(
                    "{} the pose of another: each burst counts as one picture, its corners averaged",
                    if extra == 1 {
                        "1 picture repeats".to_owned()
                    } else {
                        format!("{} repeat", counted(extra, "picture"))
                    }
                ),
            ));
        }
        Ok(())
    }
}
