//! Random poses by the rules of the source document's Section IV-B.

use nalgebra::{Point3, Vector2, Vector3};
use rand::RngExt;

use super::{Board, ScenePose, random, surface::Surface};
use crate::{Error, Result, camera::Camera, pose::Pose};

/// Largest tilt about either axis, degrees (angular diversity).
const TILT_DEG: f64 = 25.0;
/// Largest in-plane rotation, degrees (Section III-C).
const ROLL_DEG: f64 = 30.0;
/// Distances relative to the nominal one; the document's 550 … 640 mm are 0.92 … 1.07 of 600 mm.
const DISTANCE: [f64; 2] = [0.9, 1.1];
/// Share of the picture that a frontal board spans at the nominal distance; the document's is 500 of 800 px.
const SPAN: f64 = 0.625;
/// Free border around the board, px.
const BORDER_PX: f64 = 4.0;
/// Effect number of the stream of random numbers.
const STREAM: u64 = 100;

/// Draws `n` poses: tilts to ±25° about both axes, rolls to ±30°, distances that vary by ±10 % about one at which the
/// board spans 5/8 of the picture, and a random place with the whole board inside. Pose `i` depends on `seed` and
/// `i` alone.
///
/// # Errors
/// [`Error::Invalid`] where the camera or the board is refused, or the board cannot be placed inside the picture.
pub fn random(n: usize, camera: &Camera, board: &Board, seed: u64) -> Result<Vec<ScenePose>> {
    camera.validate()?;
    (0..n).map(|i| one(i, camera, board, seed)).collect()
}

fn one(i: usize, camera: &Camera, board: &Board, seed: u64) -> Result<ScenePose> {
    let mut rng = random::stream(seed, i, STREAM);
    let mut uniform = |lo: f64, hi: f64| lo + (hi - lo) * rng.random::<f64>();
    let angles_deg = [TILT_DEG, TILT_DEG, ROLL_DEG].map(|a| uniform(-a, a));
    let [fx, fy, ..] = camera.intrinsics();
    let [w, h] = camera.size_px.map(f64::from);
    let ends = board.extent_squares();
    let size = ends.map(|[lo, hi]| (hi - lo) * board.square);
    let nominal = (fx * size[0] / (SPAN * w)).max(fy * size[1] / (SPAN * h));
    let mut distance = nominal * uniform(DISTANCE[0], DISTANCE[1]);
    let center =
        Vector3::new((ends[0][0] + ends[0][1]) / 2.0, (ends[1][0] + ends[1][1]) / 2.0, 0.0) * board.square;
    let rotation = Pose::from_euler_deg(angles_deg, Vector3::zeros()).rotation;
    // The place may be anywhere in the picture at first and is drawn ever closer to the middle; a board that does not
    // fit there either moves away.
    for attempt in 0..400 {
        let reach = 0.5 * (1.0 - f64::from(attempt % 100) / 100.0);
        let px = Vector2::new(
            (w - 1.0) / 2.0 + w * uniform(-reach, reach),
            (h - 1.0) / 2.0 + h * uniform(-reach, reach),
        );
        if let Some(ray) = camera.unproject(&px).filter(|r| r.z > 0.1) {
            let translation = ray * (distance / ray.z) - rotation * center;
            let pose = Pose { rotation, translation };
            if inside(camera, board, &pose) {
                let translation = translation - rotation * board.corner0_in_origin();
                let description = format!("Random pose {}", i + 1);
                return Ok(ScenePose { angles_deg, translation: translation.into(), description });
            }
        }
        if attempt % 100 == 99 {
            distance *= 1.15;
        }
    }
    Err(Error::Invalid(format!(
        "no place was found for random pose {} of a {} board in a picture of {w} x {h} px: check the camera",
        i + 1,
        board.size
    )))
}

/// Whether the printed board, margin included, lies inside the picture; its outline is checked at 9 points a side.
fn inside(camera: &Camera, board: &Board, camera_from_board: &Pose) -> bool {
    let [w, h] = camera.size_px.map(f64::from);
    let surface = Surface::new(board, 0.0);
    let [[x0, x1], [y0, y1]] = board.extent_squares();
    (0..=8).all(|i| {
        let t = f64::from(i) / 8.0;
        let (x, y) = (x0 + t * (x1 - x0), y0 + t * (y1 - y0));
        [(x, y0), (x, y1), (x0, y), (x1, y)].into_iter().all(|(x, y)| {
            let p: Point3<f64> = surface.lift(x * board.square, y * board.square);
            camera.project(&camera_from_board.apply(&p)).is_some_and(|p| {
                p.x > BORDER_PX && p.x < w - 1.0 - BORDER_PX && p.y > BORDER_PX && p.y < h - 1.0 - BORDER_PX
            })
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synth::{Origin, Scene};

    #[test]
    fn random_poses_obey_the_rules() {
        for origin in [Origin::Outer, Origin::FirstInner] {
            let mut scene = Scene::seed();
            scene.board.origin = origin;
            scene.poses = random(60, &scene.camera, &scene.board, 7).unwrap();
            scene.validate().unwrap();
            let mut spread = [[f64::MAX, f64::MIN]; 3];
            for (view, p) in scene.poses.iter().enumerate() {
                for (k, limit) in [25.0, 25.0, 30.0].into_iter().enumerate() {
                    assert!(p.angles_deg[k].abs() <= limit);
                    spread[k] = [spread[k][0].min(p.angles_deg[k]), spread[k][1].max(p.angles_deg[k])];
                }
                let truth = &scene.truth().frames[view];
                assert_eq!(truth.corners.len(), 54);
                let xs: Vec<f64> = truth.corners.iter().map(|c| c.1).collect();
                let width =
                    xs.iter().fold(f64::MIN, |a, &b| a.max(b)) - xs.iter().fold(f64::MAX, |a, &b| a.min(b));
                assert!(width > 250.0, "view {view} spans only {width} px");
            }
            assert!(spread.iter().all(|[lo, hi]| *lo < -20.0 && *hi > 20.0), "{spread:?}");
        }
    }

    #[test]
    fn poses_depend_on_seed_and_number_alone() {
        let s = Scene::seed();
        let draw = |n, seed| random(n, &s.camera, &s.board, seed).unwrap();
        assert_eq!(draw(3, 1)[..], draw(9, 1)[..3]);
        assert_ne!(draw(3, 1), draw(3, 2));
    }

    #[test]
    fn impossible_requests_are_answered() {
        let mut s = Scene::seed();
        s.camera.size_px = [6, 6];
        assert!(random(1, &s.camera, &s.board, 0).is_err());
        s.camera.params[0] = f64::NAN;
        assert!(random(1, &s.camera, &s.board, 0).is_err());
    }
}
