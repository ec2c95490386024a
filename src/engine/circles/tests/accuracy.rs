//! Centres against the truth: errors, predicted deviations, the shift by perspective and distortion.

use nalgebra::{Point2, Vector2, Vector3};

use super::render::Shot;
use crate::{
    camera::{Camera, Model},
    circles::{CircleBoard, Kind, bias, detect},
    pose::Pose,
    target::BoardSize,
};

/// A lens of 80° that bends strongly.
fn camera() -> Camera {
    Camera::new(Model::Brown5, [640, 480], vec![400.0, 400.0, 322.3, 238.6, -0.3, 0.12, 1e-3, -1e-3, -0.02])
        .unwrap()
}

pub(super) fn shot(euler_deg: [f64; 3], distance: f64) -> Shot {
    let board = CircleBoard { kind: Kind::Symmetric, size: BoardSize { cols: 9, rows: 6 } };
    // The board's middle on the axis, whatever the rotation.
    let pose = Pose::from_euler_deg(euler_deg, Vector3::zeros());
    let middle = pose.rotation * Vector3::new(4.0, 2.5, 0.0);
    let camera_from_board = Pose { translation: Vector3::new(0.3, -0.2, distance) - middle, ..pose };
    Shot {
        camera: camera(),
        camera_from_board,
        board,
        radius: 0.3,
        levels: [30.0, 210.0],
        blur_px: 0.7,
        noise: 0.0,
        slope: 0.0,
        missing: Vec::new(),
        clutter: 0,
        seed: 5,
    }
}

/// Errors of the found places after correction, with the predicted deviations; `correct` or not.
fn errors(shot: &Shot, correct: bool) -> Vec<(Vector2<f64>, f64)> {
    let found = detect(&shot.picture());
    let grid = found.grid.unwrap_or_else(|| panic!("{} {:?}", found.why, shot.camera_from_board));
    let assigned = grid.assign(shot.board).unwrap();
    let (truth, points) = (shot.centers(), shot.board.points(1.0));
    // The order may be the turned one: the board looks the same.
    let n = shot.board.len() as u32 - 1;
    let turned = (assigned.corners[0].px - truth[assigned.corners[0].index as usize]).norm() > 5.0;
    let of = |i: u32| if turned { n - i } else { i } as usize;
    let shift = |i: usize| {
        let at = Point2::new(points[i].x, points[i].y);
        if correct {
            bias::offset(&shot.camera, &shot.camera_from_board, &at, shot.radius).unwrap()
        } else {
            Vector2::zeros()
        }
    };
    assigned.corners.iter().map(|c| (c.px - shift(of(c.index)) - truth[of(c.index)], c.sigma_px)).collect()
}

fn rms(errors: &[(Vector2<f64>, f64)]) -> f64 {
    (errors.iter().map(|e| e.0.norm_squared()).sum::<f64>() / errors.len() as f64).sqrt()
}

pub(super) const POSES: [([f64; 3], f64); 5] = [
    ([0.0, 0.0, 0.0], 9.0),
    ([30.0, 0.0, 10.0], 9.0),
    ([0.0, -45.0, 30.0], 8.0),
    ([25.0, 25.0, 100.0], 12.0),
    ([-40.0, 20.0, -15.0], 20.0),
];

#[test]
fn centres_are_right_under_every_degradation() {
    for (name, bound, change) in [
        ("clean", 0.01, (|_: &mut Shot| ()) as fn(&mut Shot)),
        ("sharp", 0.02, |s| s.blur_px = 0.0),
        ("blur 2", 0.01, |s| s.blur_px = 2.0),
        ("noise 2", 0.03, |s| s.noise = 2.0),
        ("noise 5", 0.05, |s| s.noise = 5.0),
        ("noise 10", 0.1, |s| s.noise = 10.0),
        ("slope", 0.01, |s| s.slope = 0.8),
        ("slope, noise 5", 0.08, |s| (s.slope, s.noise) = (0.8, 5.0)),
        ("light on dark", 0.01, |s| s.levels = [210.0, 30.0]),
        ("contrast 20", 0.05, |s| s.levels = [100.0, 120.0]),
        ("small dots", 0.03, |s| s.radius = 0.15),
    ] {
        let (mut plain, mut good, mut wide) = (Vec::new(), Vec::new(), 0.0);
        for (euler, distance) in POSES {
            let mut s = shot(euler, distance);
            change(&mut s);
            plain.extend(errors(&s, false));
            let e = errors(&s, true);
            wide += e.iter().map(|e| (e.0.norm() / e.1).powi(2)).sum::<f64>();
            good.extend(e);
        }
        let ratio = (wide / (2.0 * good.len() as f64)).sqrt();
        let worst = good.iter().map(|e| e.0.norm()).fold(0.0, f64::max);
        println!(
            "{name:15} {:3} dots, RMS {:.4} largest {worst:.3} px, error / sigma {ratio:.2}; uncorrected {:.4}",
            good.len(),
            rms(&good),
            rms(&plain)
        );
        assert!(rms(&good) < bound, "{name}: {}", rms(&good));
    }
}

#[test]
fn predicted_deviations_agree_with_the_scatter() {
    for (noise, radius) in [(3.0, 0.3), (8.0, 0.3), (4.0, 0.15)] {
        let (mut sum, mut n) = (Vector2::zeros(), 0.0);
        for seed in 0..6 {
            let s = Shot { noise, radius, seed, ..shot([30.0, 20.0, 10.0], 9.0) };
            for (e, sigma) in errors(&s, true) {
                sum += e.component_mul(&e) / (sigma * sigma);
                n += 1.0;
            }
        }
        let ratio = sum.map(|v: f64| (v / n).sqrt());
        println!("noise {noise} radius {radius}: error / sigma {:.3} {:.3} of {n} dots", ratio.x, ratio.y);
        assert!(((sum.x + sum.y) / (2.0 * n) - 1.0).abs() < 0.2, "{ratio}");
    }
}
