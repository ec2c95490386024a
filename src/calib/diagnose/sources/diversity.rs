//! Boards that all stood alike.

use nalgebra::{UnitQuaternion, Vector2, Vector3};

use super::{Card, Facts, Remedy, Show, px};
use crate::calib::{
    diagnose::faults::{Capture, linear::covariance},
    pose::Pose,
};

/// Share of the picture that a board spans.
const SPAN: f64 = 0.5;
/// Tilt of a well-placed board, degrees.
const TILT_DEG: f64 = 35.0;

pub(super) fn card(facts: &Facts<'_>) -> Card {
    let capture = facts.capture;
    let cost = facts.beyond(spread(capture, capture.calibration.views.len()).as_ref());
    let stances = || capture.report.included();
    let most = |of: &dyn Fn(&crate::calib::report::FrameReport) -> Option<f64>| {
        stances().filter_map(of).fold(0.0, f64::max)
    };
    let tilt = most(&|f| f.tilt_rad).to_degrees();
    let far = most(&|f| f.distance);
    let near = stances().filter_map(|f| f.distance).fold(f64::INFINITY, f64::min);
    let cells = capture.report.solution.as_ref().map_or(0.0, |s| s.coverage.cells_fraction);
    let text = format!(
        "Tilts to {tilt:.0}°, distances 1 : {:.1}, {:.0} % of the cells with a corner; as many well-spread pictures would be certain to {}.",
        far / near.max(f64::MIN_POSITIVE),
        100.0 * cells,
        px((capture.sigma_px.powi(2) - cost * cost).max(0.0).sqrt())
    );
    Card {
        px: cost,
        text,
        show: Show::Diversity,
        remedy: Some(Remedy::AddPictures),
        advice: "Tilt to all sides, turn the board, fill the corners of the picture".to_owned(),
    }
}

/// Covariance, for σ₀ = 1, of `n` boards all over the picture, tilted to all sides, turned, at two distances.
pub(super) fn spread(capture: &Capture<'_>, n: usize) -> Option<nalgebra::DMatrix<f64>> {
    let camera = &capture.calibration.camera;
    let [w, h] = camera.size_px.map(f64::from);
    let target = capture.target;
    let [[x0, y0], [x1, y1]] = target.extent();
    let side = (x1 - x0).max(y1 - y0);
    let points = target.points_in_board();
    let f = camera.intrinsics()[0];
    let mut views = Vec::with_capacity(n);
    for i in 0..4 * n {
        // Quasi-random, so that any number is spread evenly (van der Corput, Halton).
        let [u, v, a, b] = [2, 3, 5, 7].map(|base| halton(i + 1, base));
        let at = Vector2::new((0.05 + 0.9 * u) * w, (0.05 + 0.9 * v) * h);
        let Some(ray) = camera.unproject(&at) else { continue };
        let Some(sight) = UnitQuaternion::rotation_between(&Vector3::z(), &ray) else { continue };
        let (sin, cos) = (a * std::f64::consts::TAU).sin_cos();
        let tilt = UnitQuaternion::from_scaled_axis(Vector3::new(cos, sin, 0.0) * TILT_DEG.to_radians());
        let roll = UnitQuaternion::from_scaled_axis(Vector3::z() * (b - 0.5) * std::f64::consts::PI);
        let rotation = (sight * tilt * roll).to_rotation_matrix();
        let away = f * side / (SPAN * w) * if i % 2 == 0 { 0.8 } else { 1.2 };
        let pose = Pose { rotation, translation: ray * away - rotation * target.center_in_board().coords };
        let seen: Vec<_> = points
            .iter()
            .filter(|p| {
                camera
                    .project(&pose.apply(p))
                    .is_some_and(|px| (0.0..w).contains(&px.x) && (0.0..h).contains(&px.y))
            })
            .map(|p| (*p, 1.0))
            .collect();
        if seen.len() >= points.len().min(12) {
            views.push((pose, seen));
        }
        if views.len() == n {
            break;
        }
    }
    if views.len() < n { None } else { covariance(camera, &capture.fixed, &views) }
}

/// The radical inverse of a number.
fn halton(mut i: usize, base: usize) -> f64 {
    let (mut share, mut value) = (1.0, 0.0);
    while i > 0 {
        share /= base as f64;
        value += share * (i % base) as f64;
        i /= base;
    }
    value
}
