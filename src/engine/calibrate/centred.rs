//! Centres of circles are not where their ellipses are: calibrated once more with what the camera says of the difference.

use std::{ops::ControlFlow, slice};

use super::{Problem, calibrate};
use crate::{Result, circles::bias::corrected, solution::Calibration, target::Target};

/// Rounds after which the places of circles stand still: the shift hardly depends on the camera.
const ROUNDS: usize = 2;

/// Of circles the calibration once more, with their measured places moved to the projected centres; of other boards as it is.
///
/// # Errors
/// Those of [`calibrate`].
pub fn centred(
    problem: &Problem,
    mut calibration: Calibration,
    tick: &mut dyn FnMut(f32) -> ControlFlow<()>,
) -> Result<Calibration> {
    let Target::Circles { radius, .. } = problem.target else { return Ok(calibration) };
    let points = problem.target.points_in_board();
    for _ in 0..ROUNDS {
        let camera = &calibration.camera;
        let mut again = problem.clone();
        again.cameras.iter_mut().for_each(|c| (c.model, c.start) = (camera.model, Some(camera.clone())));
        let poses: Vec<_> = problem
            .observations
            .iter()
            .filter_map(|o| calibration.views.iter().find(|v| v.frame == o.frame))
            .map(|v| v.camera_from_board)
            .collect();
        // Pictures that were set aside have no pose, and stay aside.
        again.observations.retain(|o| calibration.views.iter().any(|v| v.frame == o.frame));
        again.observations = corrected(&again.observations, slice::from_ref(camera), &poses, &points, radius);
        let next = calibrate(&again, tick)?;
        let aside = std::mem::take(&mut calibration.set_aside);
        calibration = Calibration { closed_form: calibration.closed_form, ..next };
        calibration.set_aside.extend(aside);
    }
    Ok(calibration)
}
