use std::ops::ControlFlow;

use nalgebra::Vector2;
use rand::SeedableRng;
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64;

use super::*;
use crate::calib::{
    calibrate::{CameraSetup, Options, Problem, calibrate},
    camera::{Camera, Model},
    observation::{Corner, FrameId, Observation},
    synth::Scene,
    uncertainty::Range,
};

/// Noise of the corners, px per coordinate.
const NOISE_PX: f64 = 0.05;

/// The seed scene's camera and board.
struct World {
    scene: Scene,
    random: Pcg64,
}

impl World {
    fn new(seed: u64) -> Self {
        Self { scene: Scene::seed(), random: Pcg64::seed_from_u64(seed) }
    }

    fn target(&self) -> Target {
        self.scene.board.target()
    }

    /// What the true camera sees of the board at a pose, with noise.
    fn look(&mut self, pose: &Pose, frame: u32) -> Observation {
        let normal = Normal::new(0.0, NOISE_PX).unwrap();
        let camera: &Camera = &self.scene.camera;
        let [w, h] = camera.size_px.map(f64::from);
        let points = self.target().points_in_board();
        let seen = points.iter().map(|p| camera.project(&pose.apply(p)).unwrap());
        let inside = |px: &Vector2<f64>| px.x > 0.0 && px.y > 0.0 && px.x < w - 1.0 && px.y < h - 1.0;
        let seen: Vec<_> = (0..).zip(seen).filter(|(_, px)| inside(px)).collect();
        let mut noisy = |px: Vector2<f64>| px + Vector2::from_fn(|_, _| normal.sample(&mut self.random));
        let corners = seen.into_iter().map(|(index, px)| Corner { index, px: noisy(px), sigma_px: NOISE_PX });
        Observation { camera: 0, frame: FrameId(frame), corners: corners.collect() }
    }

    fn problem(&mut self, views: &[usize]) -> Problem {
        let poses: Vec<Pose> = views.iter().map(|v| self.scene.camera_from_board(*v).unwrap()).collect();
        let observations = (0..).zip(&poses).map(|(i, pose)| self.look(pose, i)).collect();
        Problem {
            observations,
            cameras: vec![CameraSetup {
                size_px: self.scene.camera.size_px,
                model: Model::Brown5,
                start: None,
                focal_hint_px: None,
            }],
            target: self.target(),
            options: Options { multi_start: false, ..Options::default() },
        }
    }
}

fn solve(problem: &Problem) -> Calibration {
    calibrate(problem, &mut |_| ControlFlow::Continue(())).unwrap()
}

fn asked(calibration: &Calibration, target: &Target, goal: &str) -> Advice {
    advise(calibration, target, Unit::Mm, goal.parse().unwrap())
}

/// The pictures that are asked for, taken one after the other by the true camera: each brings what was expected of it, and none is
/// needed after the goal.
#[test]
fn pictures_that_were_asked_for_bring_what_was_promised() {
    for (views, goal) in [
        (&[0, 1, 3, 5][..], "0.2px"),
        (&[0, 1, 2, 3, 4, 5, 6, 7], "0.1px"),
        (&[1, 3, 5], "0.05px,mean"),
        (&[1, 3, 5, 9], "0.02px,centre"),
    ] {
        let mut world = World::new(1);
        let mut problem = world.problem(views);
        let target = world.target();
        let mut calibration = solve(&problem);
        let mut advice = asked(&calibration, &target, goal);
        let promised = advice.pictures;
        let mut taken = 0;
        while let Some(next) = advice.next {
            println!("{goal}: {} {}", advice.sentence, advice.promise);
            assert_eq!(advice.state, State::Next);
            let after = advice.after.unwrap();
            problem.observations.push(world.look(&next.camera_from_board, 100 + taken));
            taken += 1;
            calibration = solve(&problem);
            let range = Range::At(advice.range.unwrap());
            let found = Figures::of(&uncertainty::of(&calibration, &target, range));
            let figures = |f: &Figures| [f.center_px, f.worst_corner_px, f.mean_px];
            let all = [&advice.before.unwrap(), &after, &found].map(figures);
            println!("   {all:.4?}");
            for k in 0..3 {
                // Where the camera that was planned with folds, nothing was promised.
                let [Some(before), Some(after), Some(found)] = all.map(|f| f[k]) else { continue };
                let off = (after - found).abs() / (before - found).abs().max(0.1 * before);
                println!("   {:.0} % of the gain off", 100.0 * off);
                assert!(off < 0.3, "{before} {after} {found}");
            }
            advice = asked(&calibration, &target, goal);
            assert!(taken < 20);
        }
        assert_eq!((advice.state, advice.pictures), (State::Enough, Some(0)));
        println!("{promised:?} promised, {taken} taken");
        let taken = taken as usize;
        assert!(promised.is_none_or(|n| n.abs_diff(taken) <= 1 + taken / 3));
    }
}

/// Whatever is asked for can be done: all of the board in the picture, seen from its front.
#[test]
fn what_is_asked_for_can_be_done() {
    let mut world = World::new(2);
    let calibration = solve(&world.problem(&[0, 1, 2, 3, 4, 5, 6, 7, 8]));
    let target = world.target();
    let studio = Studio::new(&calibration, &target).unwrap();
    let mut n = 0;
    for hold in studio.all() {
        let Some(pose) = studio.pose(&hold) else { continue };
        n += 1;
        let stance = stats::stance(&pose, &target);
        assert!((stance.tilt_rad.to_degrees() - hold.tilt_deg).abs() < 1e-9);
        assert!((stance.distance / studio.usual - hold.times).abs() < 1e-9);
        assert_eq!(world.look(&pose, 0).corners.len(), 54, "{hold:?}");
        // The side that is said to be away is away.
        let side = Vector2::from({
            let (sin, cos) = hold.away_deg.to_radians().sin_cos();
            [cos, sin]
        });
        let center = pose.apply(&target.center_in_board()).coords;
        let deepest = target
            .points_in_board()
            .iter()
            .map(|p| pose.apply(p).coords - center)
            .max_by(|a, b| a.z.total_cmp(&b.z));
        assert!(hold.tilt_deg == 0.0 || deepest.unwrap().xy().dot(&side) > 0.0, "{hold:?}");
    }
    println!("{n} of {} poses", studio.all().count());
    assert!(n > 300);
}

#[test]
fn says_enough_and_says_what_it_cannot_know() {
    let mut world = World::new(3);
    let calibration = solve(&world.problem(&(0..15).collect::<Vec<_>>()));
    let target = world.target();
    let advice = asked(&calibration, &target, "20px");
    assert_eq!((advice.state, advice.pictures, advice.next), (State::Enough, Some(0), None));
    assert_eq!(advice.promise, "The goal is reached: ±3.3 px of ±20 px in the worst corner.");
    let first = Advice::first(Goal::default());
    assert_eq!(first.state, State::Unknown);
    assert!(first.sentence.starts_with("Photograph the whole board"), "{}", first.sentence);
    // What is read back is what was written.
    for advice in [advice, first, asked(&calibration, &target, "1mm@2m")] {
        let json = serde_json::to_string(&advice).unwrap();
        assert_eq!(serde_json::from_str::<Advice>(&json).unwrap().sentence, advice.sentence, "{json}");
    }
}
