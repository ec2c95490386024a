//! Points that were written down in a left-handed frame: no rotation brings them into a picture, so a camera that is forced onto
//! them is wrong.

use nalgebra::Point3;
use std::ops::ControlFlow;

use super::{Problem, as_given, prepare};
use crate::{
    Error, Result,
    solution::Calibration,
    target::{PointSet, Target},
};

/// How many times better the mirrored points must fit.
pub(super) const BETTER: f64 = 3.0;

/// What to say of such points.
pub(super) const REMEDY: &str = "the points are mirrored: their coordinates are left-handed, or one axis points the other way; \
     change the sign of one coordinate of all points";

/// A point with z the other way.
pub(super) fn reflect(p: &Point3<f64>) -> Point3<f64> {
    Point3::new(p.x, p.y, -p.z)
}

/// The same points with z the other way.
fn reflected(target: &Target) -> Option<Target> {
    let Target::Points { points } = target else { return None };
    let list = points.names().iter().cloned().zip(points.points().iter().map(reflect));
    Some(Target::Points { points: PointSet::new(list.collect()).ok()? })
}

/// The result, or where the views of a solid thing look mirrored and fit far better when it is reflected, that as the reason.
pub(super) fn checked(
    problem: &Problem,
    found: Result<Calibration>,
    report: &mut dyn FnMut(f32) -> ControlFlow<()>,
) -> Result<Calibration> {
    if found == Err(Error::Stopped) {
        return found;
    }
    let views = prepare::prepare(problem).0;
    let solid = views.iter().filter(|v| v.plane.is_solid()).count();
    let suspect = 2 * views.iter().filter(|v| v.is_mirrored()).count() > solid;
    // A fisheye's projection is no matrix, so its sign may deceive: what does not fit is suspected too.
    let width = problem.cameras.first().map_or(0, |c| c.size_px[0]);
    let misfits = match &found {
        Ok(fit) => fit.rms_px > 0.01 * f64::from(width),
        Err(_) => true,
    };
    if !(suspect || misfits) {
        return found;
    }
    let Some(target) = reflected(&problem.target) else { return found };
    match as_given(&Problem { target, ..problem.clone() }, true, report) {
        Err(Error::Stopped) => Err(Error::Stopped),
        Ok(other) if found.as_ref().map_or(true, |f| BETTER * other.rms_px < f.rms_px) => {
            Err(Error::Degenerate(REMEDY.to_owned()))
        }
        _ => found,
    }
}
