//! A flat board that faces the camera tells focal length from distance hardly, and not where the optical axis is.

use nalgebra::Matrix3;

use super::{Card, Facts, Remedy, Show};
use crate::calib::{diagnose::faults::linear::covariance, number::significant, zhang};

/// Tilt below which a picture says next to nothing about the focal length, degrees: the source document's rule.
pub(super) const LEAST_TILT_DEG: f64 = 15.0;
/// Height of the same points on a thing that is not flat, in half sides of the board.
const RELIEF: f64 = 0.3;

pub(super) fn card(facts: &Facts<'_>) -> Card {
    let capture = facts.capture;
    let calibration = capture.calibration;
    if capture.target.is_solid() {
        let text = "The target is not flat: each picture tells focal length from distance.".to_owned();
        return Card { px: 0.0, text, show: Show::Diversity, remedy: None, advice: String::new() };
    }
    // The same pictures of a thing with depth.
    let lifted: Vec<_> = calibration
        .views
        .iter()
        .zip(&capture.fixed.views)
        .map(|(view, seen)| {
            let up = |(j, p): (usize, &nalgebra::Point3<f64>)| {
                let side = if j % 2 == 0 { 1.0 } else { -1.0 };
                (p + capture.fixed.normal * (side * RELIEF * capture.fixed.half), seen.weights[j])
            };
            (view.camera_from_board, seen.points.iter().enumerate().map(up).collect())
        })
        .collect();
    let cost = facts.beyond(covariance(&calibration.camera, &capture.fixed, &lifted).as_ref());
    let tilts: Vec<f64> = capture.report.included().filter_map(|f| f.tilt_rad.map(f64::to_degrees)).collect();
    let flat = tilts.iter().filter(|t| **t < LEAST_TILT_DEG).count();
    let [fx, fy, cx, cy] = calibration.camera.intrinsics();
    let k = Matrix3::new(fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0);
    let homographies: Vec<Matrix3<f64>> = calibration
        .views
        .iter()
        .map(|v| {
            let pose = &v.camera_from_board;
            let r = pose.rotation.matrix();
            k * Matrix3::from_columns(&[r.column(0).into(), r.column(1).into(), pose.translation])
        })
        .collect();
    let singular = zhang::closed_form(&homographies, calibration.camera.size_px, true).singular_values;
    let text = format!(
        "{flat} of {} boards are tilted by less than {LEAST_TILT_DEG:.0}°; the weakest direction of Zhang's system has {} of its strongest. The same pictures of an object with depth would be this much more certain.",
        tilts.len(),
        significant(singular[3], 2)
    );
    Card {
        px: cost,
        text,
        show: Show::Diversity,
        remedy: Some(Remedy::AddPictures),
        advice: "Tilt the board by 30 to 45°".to_owned(),
    }
}
