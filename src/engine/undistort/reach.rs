//! Up to where a model can be inverted.

use nalgebra::{Vector2, Vector3};
use serde::{Deserialize, Serialize};

use super::{MAX_ANGLE_RAD, Projection};
use crate::{lens::Lens, solution::Warning};

/// Up to where a camera can be undistorted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Reach {
    /// Largest angle from the optical axis at which the model does not fold, rad.
    pub angle_rad: f64,
    /// Radius of that angle in the photograph, px from the principal point, the smallest over all directions; `None` where the
    /// model sees nothing there (it does not fold).
    pub radius_px: Option<f64>,
    /// Share of the photograph's pixels beyond it, 0 to 1.
    pub beyond: f64,
    /// Share of the photograph's pixels that look more than [`MAX_ANGLE_RAD`] off the axis, 0 to 1.
    pub too_wide: f64,
}

/// Measures the reach on a grid over the photograph.
pub fn reach(camera: &dyn Lens) -> Reach {
    const GRID: u32 = 48;
    let fold = camera.fold_rad();
    let [_, _, cx, cy] = camera.intrinsics();
    let centre = Vector2::new(cx, cy);
    let radius = (0..72)
        .filter_map(|i| {
            let (sin, cos) = (std::f64::consts::TAU * f64::from(i) / 72.0).sin_cos();
            let ray = Vector3::new(cos * fold.sin(), sin * fold.sin(), fold.cos());
            Some((camera.project_px(&ray)? - centre).norm())
        })
        .fold(f64::INFINITY, f64::min);
    let [w, h] = camera.size_px().map(f64::from);
    let (mut beyond, mut wide, mut all) = (0, 0, 0);
    for j in 0..GRID {
        for i in 0..GRID {
            let [a, b] = [i, j].map(|k| (f64::from(k) + 0.5) / f64::from(GRID));
            let ray = camera.unproject(&Vector2::new(a * w - 0.5, b * h - 0.5));
            all += 1;
            match ray {
                None => beyond += 1,
                Some(ray) => wide += i32::from(ray.x.hypot(ray.y).atan2(ray.z) > MAX_ANGLE_RAD),
            }
        }
    }
    Reach {
        angle_rad: fold,
        radius_px: radius.is_finite().then_some(radius),
        beyond: f64::from(beyond) / f64::from(all),
        too_wide: f64::from(wide) / f64::from(all),
    }
}

/// What someone who undistorts with this camera should know: `model_folds`, and of flat pictures `view_limited`.
pub fn warnings(camera: &dyn Lens, projection: Projection) -> Vec<Warning> {
    let reach = reach(camera);
    let mut warnings = Vec::new();
    if reach.beyond > 0.0 {
        let at = reach.radius_px.map(|r| format!(", {r:.0} px from the principal point")).unwrap_or_default();
        warnings.push(Warning::new(
            "model_folds",
            format!(
                "the model turns back at {:.1}° off the axis{at}: {} of the photograph lies beyond and cannot be \
                 undistorted. Fix k3 (--fix k3), or add pictures with the board near the corners",
                reach.angle_rad.to_degrees(),
                percent(reach.beyond)
            ),
        ));
    }
    if reach.too_wide > 0.0 && projection == Projection::Perspective {
        warnings.push(Warning::new(
            "view_limited",
            format!(
                "{} of the photograph looks more than {:.0}° off the axis and is left out: a flat picture cannot show it, an equidistant, stereographic or cylindrical one can",
                percent(reach.too_wide),
                MAX_ANGLE_RAD.to_degrees()
            ),
        ));
    }
    warnings
}

fn percent(share: f64) -> String {
    if share < 0.01 { "less than 1 %".to_owned() } else { format!("{:.0} %", 100.0 * share) }
}

/// The largest angle off the axis that a picture may show without meeting the fold, rad, where it shows rays up to `view_rad`; infinite
/// where there is no fold in view.
pub(super) fn fold_within(camera: &dyn Lens, view_rad: f64) -> f64 {
    // The sign of the expansion is that of a polynomial of low degree: a fold does not hide between 32 steps.
    const AZIMUTHS: i32 = 24;
    const STEPS: i32 = 32;
    let grows = |azimuth: i32, step: i32| {
        let (sin, cos) = (std::f64::consts::TAU * f64::from(azimuth) / f64::from(AZIMUTHS)).sin_cos();
        let (r, z) = (view_rad * f64::from(step) / f64::from(STEPS)).sin_cos();
        camera.expansion(&Vector3::new(cos * r, sin * r, z)).is_some_and(|d| d > 0.0)
    };
    if (0..AZIMUTHS).all(|a| (1..=STEPS).all(|s| grows(a, s))) {
        return f64::INFINITY;
    }
    camera.fold_rad()
}
