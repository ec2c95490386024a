//! What a splined camera leaves of a picture that it was not fitted to.

use nalgebra::{Rotation3, Vector2};

use super::{Splined, seen::Seen};
use crate::{observation::Corner, pose::Pose, target::Target};

/// Steps of the pose; from a camera that is nearly as good it needs three.
const STEPS: usize = 8;

/// Observed − projected of each corner, px, with the camera held and the pose (`camera_from_board`) free, from one nearby. `None`
/// where the camera does not see a corner, or the corners do not determine the pose.
pub fn residuals_of(
    camera: &Splined,
    target: &Target,
    corners: &[Corner],
    near: &Pose,
) -> Option<Vec<Vector2<f64>>> {
    let seen = Seen::of(target, corners)?;
    let mut pose = seen.centred(near);
    for _ in 0..STEPS {
        let rows = seen.rows(camera, &pose, f64::INFINITY)?;
        let left: Vec<_> = rows.rows.iter().map(|r| r.residual).collect();
        let motion = rows.motion(&left)?;
        pose.rotation = Rotation3::from_scaled_axis(motion.fixed_rows::<3>(0).into_owned()) * pose.rotation;
        pose.rotation.renormalize();
        pose.translation += motion.fixed_rows::<3>(3);
    }
    seen.residuals(camera, &pose)
}
