//! The pose of a board in a picture of a known camera.

use nalgebra::{Matrix3, Point3, Rotation3, UnitVector3, Vector2, Vector3};
use std::ops::ControlFlow;

use super::mirrored;
use crate::{
    Error, Result,
    camera::Camera,
    dlt,
    observation::Corner,
    p3p,
    pose::Pose,
    refine::{self, Free, Limits, State, block::Block},
    spread::Plane,
    target::Target,
    zhang,
};

/// `camera_from_board` of one picture with the camera held, and the residuals (observed − projected, px) of its corners.
///
/// Starts from the rays of the corners ([`zhang::pose_from_rays`]). A plane seen from afar fits nearly as well when its normal is
/// mirrored about the line of sight, so both are refined and the better one is taken. Points that are not in a plane have a start of
/// their own ([`dlt::pose`], below six [`p3p::consensus`]).
///
/// # Errors
/// [`Error::TooFewCorners`] below four, [`Error::Invalid`] for corners that are not on the board or not finite,
/// [`Error::Degenerate`] where corners lie on a line, no pose explains them, or the points are mirrored.
pub fn pose_of(camera: &Camera, target: &Target, corners: &[Corner]) -> Result<(Pose, Vec<Vector2<f64>>)> {
    camera.validate()?;
    if corners.len() < 4 {
        return Err(Error::TooFewCorners { need: 4, got: corners.len() });
    }
    let (mut board, mut px) = (Vec::new(), Vec::new());
    let (mut sighted, mut rays) = (Vec::new(), Vec::new());
    for corner in corners {
        let point = target.point_in_board(corner.index).ok_or_else(|| {
            Error::Invalid(format!("corner {} is not on a board of {} corners", corner.index, target.len()))
        })?;
        if !(corner.px.x.is_finite() && corner.px.y.is_finite()) {
            return Err(Error::Invalid(format!("corner {} has no finite position", corner.index)));
        }
        if let Some(ray) = camera.unproject(&corner.px) {
            sighted.push(point);
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
    let plane = Plane::of(&sighted).ok_or_else(none)?;
    let free = Free::none(camera.model);
    let refined = |board: &[Point3<f64>], pose: Pose| {
        let block = Block::new(board, &px);
        let problem = alone(camera, &free, &block);
        let start = State { params: camera.params.clone(), poses: vec![pose] };
        refine::refine(&problem, &start, Limits::full(px.len()), &mut || ControlFlow::Continue(())).ok()
    };
    let solid = if plane.is_uneven() { dlt::pose(&sighted, &rays) } else { None };
    let [first, second] = from_plane(&plane, &sighted, &rays);
    // Four or five points in space, or corners of which some are wrong.
    let lost = first.is_none() || plane.is_uneven() && solid.is_none();
    let agreed = if lost { p3p::consensus(&sighted, &rays) } else { None };
    let best = [first, second, solid.map(|s| s.pose), agreed.map(|a| a.pose)]
        .into_iter()
        .flatten()
        .filter_map(|pose| refined(&board, pose))
        .min_by(|a, b| a.cost.total_cmp(&b.cost))
        .ok_or_else(none)?;
    if plane.is_solid() && solid.is_some_and(|s| s.mirrored) {
        let reflect = |points: &[Point3<f64>]| -> Vec<_> { points.iter().map(mirrored::reflect).collect() };
        let other = dlt::pose(&reflect(&sighted), &rays).and_then(|s| refined(&reflect(&board), s.pose));
        if other.is_some_and(|o| mirrored::BETTER.powi(2) * o.cost < best.cost) {
            return Err(Error::Degenerate(mirrored::REMEDY.to_owned()));
        }
    }
    let block = Block::new(&board, &px);
    Ok((best.state.poses[0], refine::residuals(&alone(camera, &free, &block), &best.state, 0)))
}

/// One view of a camera that is held.
fn alone<'a>(camera: &Camera, free: &'a Free, block: &'a Block) -> refine::Problem<'a> {
    refine::Problem {
        spec: camera.spec(),
        free,
        blocks: std::slice::from_ref(block),
        huber_px: None,
        single_precision: false,
    }
}

/// The two poses of points in or near a plane.
fn from_plane(plane: &Plane, points: &[Point3<f64>], rays: &[Vector3<f64>]) -> [Option<Pose>; 2] {
    let flat: Vec<[f64; 2]> = plane.flattened(points).map(Into::into).collect();
    let Some(first) = zhang::pose_from_rays(&flat, rays) else { return [None; 2] };
    let middle = flat.iter().map(|p| Vector2::from(*p)).sum::<Vector2<f64>>() / flat.len() as f64;
    let second = turned_over(&first, &middle);
    [Some(first), second].map(|pose| pose.map(|pose| plane.camera_from_board(pose)))
}

/// The pose whose board normal is mirrored about the line of sight to `middle`, which stays where it is.
fn turned_over(pose: &Pose, middle: &Vector2<f64>) -> Option<Pose> {
    let center = pose.rotation * Vector3::new(middle.x, middle.y, 0.0) + pose.translation;
    let sight = UnitVector3::try_new(center, 1e-12)?;
    let about_sight =
        Rotation3::from_matrix_unchecked(2.0 * sight.into_inner() * sight.transpose() - Matrix3::identity());
    // Half a turn about the line of sight, half a turn of the board in its plane: depths are mirrored, the picture stays.
    let rotation =
        about_sight * pose.rotation * Rotation3::from_axis_angle(&Vector3::z_axis(), std::f64::consts::PI);
    Some(Pose { rotation, translation: center - rotation * Vector3::new(middle.x, middle.y, 0.0) })
}
