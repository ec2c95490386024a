//! The pose of a board in a picture of a known camera.

use nalgebra::{Matrix3, Rotation3, UnitVector3, Vector2, Vector3};
use std::ops::ControlFlow;

use crate::{
    Error, Result,
    camera::Camera,
    observation::Corner,
    pose::Pose,
    refine::{self, Free, Limits, State, block::Block},
    target::Target,
    zhang,
};

/// `camera_from_board` of one picture with the camera held, and the residuals (observed − projected, px) of its corners.
///
/// Starts from the rays of the corners ([`zhang::pose_from_rays`]). A plane seen from afar fits nearly as well when its normal is
/// mirrored about the line of sight, so both are refined and the better one is taken.
///
/// # Errors
/// [`Error::TooFewCorners`] below four, [`Error::Invalid`] for corners that are not on the board or not finite,
/// [`Error::Degenerate`] where corners lie on a line or no pose explains them.
pub fn pose_of(camera: &Camera, target: &Target, corners: &[Corner]) -> Result<(Pose, Vec<Vector2<f64>>)> {
    camera.validate()?;
    if corners.len() < 4 {
        return Err(Error::TooFewCorners { need: 4, got: corners.len() });
    }
    let (mut board, mut px) = (Vec::new(), Vec::new());
    let (mut plane, mut rays) = (Vec::new(), Vec::new());
    for corner in corners {
        let point = target.point_in_board(corner.index).ok_or_else(|| {
            Error::Invalid(format!("corner {} is not on a board of {} corners", corner.index, target.len()))
        })?;
        if !(corner.px.x.is_finite() && corner.px.y.is_finite()) {
            return Err(Error::Invalid(format!("corner {} has no finite position", corner.index)));
        }
        if let Some(ray) = camera.unproject(&corner.px) {
            plane.push([point.x, point.y]);
            rays.push(ray);
        }
        board.push(point);
        px.push(corner.px);
    }
    let none = || {
        Error::Degenerate(
            "no pose of the board explains these corners: they lie on a line, or camera and board do not belong together"
                .into(),
        )
    };
    let first = zhang::pose_from_rays(&plane, &rays).ok_or_else(none)?;
    let middle = plane.iter().map(|p| Vector2::from(*p)).sum::<Vector2<f64>>() / plane.len() as f64;
    let block = Block::new(&board, &px);
    let free = Free::none(camera.model);
    let problem = refine::Problem {
        spec: camera.spec(),
        free: &free,
        blocks: std::slice::from_ref(&block),
        huber_px: None,
        single_precision: false,
    };
    let refined = |pose: Pose| {
        let start = State { params: camera.params.clone(), poses: vec![pose] };
        refine::refine(&problem, &start, Limits::full(px.len()), &mut || ControlFlow::Continue(())).ok()
    };
    let best = [Some(first), mirrored(&first, &middle)]
        .into_iter()
        .flatten()
        .filter_map(refined)
        .min_by(|a, b| a.cost.total_cmp(&b.cost))
        .ok_or_else(none)?;
    Ok((best.state.poses[0], refine::residuals(&problem, &best.state, 0)))
}

/// The pose whose board normal is mirrored about the line of sight to `middle`, which stays where it is.
fn mirrored(pose: &Pose, middle: &Vector2<f64>) -> Option<Pose> {
    let center = pose.rotation * Vector3::new(middle.x, middle.y, 0.0) + pose.translation;
    let sight = UnitVector3::try_new(center, 1e-12)?;
    let about_sight =
        Rotation3::from_matrix_unchecked(2.0 * sight.into_inner() * sight.transpose() - Matrix3::identity());
    // Half a turn about the line of sight, half a turn of the board in its plane: depths are mirrored, the picture stays.
    let rotation =
        about_sight * pose.rotation * Rotation3::from_axis_angle(&Vector3::z_axis(), std::f64::consts::PI);
    Some(Pose { rotation, translation: center - rotation * Vector3::new(middle.x, middle.y, 0.0) })
}
