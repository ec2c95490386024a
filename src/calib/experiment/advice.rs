//! Whether advice saves pictures: captures that follow it beside captures by chance, from the same three pictures on.
//!
//! Corners are those that a true camera sees, with normal noise; after every picture the real solver calibrates from its closed form, and
//! the uncertainty that it reports decides when to stop.

use std::ops::ControlFlow;

use nalgebra::{Rotation3, Vector2, Vector3};
use rand::{RngExt as _, SeedableRng as _};
use rand_distr::{Distribution as _, StandardNormal};
use rand_pcg::Pcg64;

use crate::calib::{
    Error, Result,
    advice::{Goal, advise, best_of},
    calibrate::{CameraSetup, Options, Problem, calibrate},
    camera::{Camera, Model},
    observation::{Corner, FrameId, Observation},
    pose::Pose,
    solution::Calibration,
    stats,
    target::{BoardSize, Target, Unit},
    uncertainty::{self, Range},
};

/// Lenses that captures are made with: name, size of the pictures, fx fy cx cy k1 k2 p1 p2 k3.
const LENSES: [(&str, [u32; 2], [f64; 9]); 5] = [
    ("the document's", [800, 600], [1000.0, 1000.0, 400.0, 300.0, -0.28, 0.10, 0.001, 0.002, 0.0]),
    ("opencv_left's", [640, 480], [533.0, 533.1, 342.3, 233.9, -0.285, 0.064, 0.001, 0.0, 0.082]),
    ("wide", [1280, 720], [760.0, 758.0, 652.0, 351.0, -0.31, 0.11, 0.0, -0.0005, -0.018]),
    ("telephone", [2000, 1500], [1620.0, 1621.0, 990.0, 760.0, 0.12, -0.25, 0.0005, 0.0, 0.11]),
    ("long", [1024, 768], [2100.0, 2104.0, 520.0, 380.0, -0.12, 0.3, 0.0, 0.001, 0.0]),
];
/// Captures with each lens.
const SEEDS: u64 = 5;
/// Pictures to choose from.
const POOL: usize = 60;
/// Pictures that all captures begin with.
const FIRST: usize = 3;
/// Orders that chance is asked for.
const ORDERS: usize = 5;
/// Noise of the corners, px per coordinate.
const NOISE_PX: f64 = 0.1;
/// How much a person who follows the advice is off: angle, and share of the distance both across and along (1 σ).
const HAND: [f64; 2] = [0.087, 0.05];

/// The board of all captures.
const BOARD: Target = Target::checkerboard(BoardSize { cols: 9, rows: 6 }, 25.0);

/// Pictures that captures of one pool took after the common ones.
#[derive(Clone, Debug)]
pub struct Pool {
    /// Name of the lens.
    pub lens: &'static str,
    /// Of the pool.
    pub seed: u64,
    /// By chance, sorted; [`POOL`] where the goal was never reached.
    pub chance: Vec<usize>,
    /// Always the picture of the pool that was predicted to be the best.
    pub best: usize,
    /// Always the pose that was advised, as well as a hand can.
    pub hand: usize,
}

impl Pool {
    /// Median by chance.
    pub fn by_chance(&self) -> f64 {
        let all: Vec<f64> = self.chance.iter().map(|n| *n as f64).collect();
        stats::quantile(&all, 0.5)
    }
}

/// What is aimed at: what the program aims at unasked, and a goal that few pools can reach at all.
pub const GOALS: [&str; 2] = ["1px", "0.3px"];

/// Runs all captures, for each of the [`GOALS`]. `report` is told what comes next and may stop it.
///
/// # Errors
/// [`Error::Stopped`] where `report` breaks.
pub fn study(report: &mut dyn FnMut(&str) -> ControlFlow<()>) -> Result<Vec<Vec<Pool>>> {
    let of_goal = |text: &&str| {
        let goal: Goal = text.parse()?;
        let mut pools = Vec::new();
        for (lens, size_px, params) in LENSES {
            for seed in 0..SEEDS {
                if report(&format!("{text}, {lens} lens, pool {}", seed + 1)).is_break() {
                    return Err(Error::Stopped);
                }
                let camera = Camera::new(Model::Brown5, size_px, params.to_vec())?;
                pools.push(Capture::new(camera, goal, seed).pool(lens, seed));
            }
        }
        Ok(pools)
    };
    GOALS.iter().map(of_goal).collect()
}

/// One pool and how pictures are taken from it.
struct Capture {
    camera: Camera,
    goal: Goal,
    random: Pcg64,
    poses: Vec<Pose>,
    /// What is seen at each pose.
    seen: Vec<Vec<Corner>>,
}

impl Capture {
    fn new(camera: Camera, goal: Goal, seed: u64) -> Self {
        let mut new =
            Self { camera, goal, random: Pcg64::seed_from_u64(seed), poses: Vec::new(), seen: Vec::new() };
        while new.poses.len() < POOL {
            let pose = new.any_pose();
            if let Some(corners) = new.look(&pose) {
                new.poses.push(pose);
                new.seen.push(corners);
            }
        }
        new
    }

    fn uniform(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.random.random::<f64>()
    }

    fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.random)
    }

    /// As people hold boards: anywhere in the picture, tilted by up to 50° to any side, at all rolls, spanning a third of the picture to
    /// nearly all of it.
    fn any_pose(&mut self) -> Pose {
        let [w, h] = self.camera.size_px.map(f64::from);
        let [[x0, y0], [x1, y1]] = BOARD.extent();
        let f = self.camera.params[0];
        let distance = f * (x1 - x0).hypot(y1 - y0) / (w.hypot(h) * self.uniform(0.33, 0.9));
        let (side, turn) = (self.uniform(0.0, std::f64::consts::TAU), self.uniform(-3.1, 3.1));
        let axis = Vector3::new(side.cos(), side.sin(), 0.0) * self.uniform(0.0, 50f64.to_radians());
        let rotation = Rotation3::from_scaled_axis(axis) * Rotation3::from_scaled_axis(Vector3::z() * turn);
        let px = Vector2::new(self.uniform(0.0, w), self.uniform(0.0, h));
        let ray = self.camera.unproject(&px).unwrap_or_else(Vector3::z);
        Pose { rotation, translation: ray * distance - rotation * BOARD.center_in_board().coords }
    }

    /// The corners with noise; `None` where one is outside the picture.
    fn look(&mut self, pose: &Pose) -> Option<Vec<Corner>> {
        let [w, h] = self.camera.size_px.map(f64::from);
        let mut corners = Vec::new();
        for (index, point) in (0..).zip(BOARD.points_in_board()) {
            let there = pose.apply(&point);
            let px = self.camera.project(&there).filter(|_| there.z > 0.0)?;
            let is_inside = px.x > 4.0 && px.y > 4.0 && px.x < w - 5.0 && px.y < h - 5.0;
            let noise = Vector2::new(self.normal(), self.normal()) * NOISE_PX;
            corners.push(Corner { index, px: is_inside.then_some(px + noise)?, sigma_px: NOISE_PX });
        }
        Some(corners)
    }

    /// Adds pictures until the goal is reached; how many that were.
    fn take(
        &mut self,
        next: &mut dyn FnMut(&mut Self, Option<&Calibration>, usize) -> Option<Vec<Corner>>,
    ) -> usize {
        let mut taken: Vec<Vec<Corner>> = self.seen[..FIRST].to_vec();
        for n in 0..POOL - FIRST {
            let calibration = self.solve(&taken);
            if calibration.as_ref().is_some_and(|c| self.reached(c)) {
                return n;
            }
            match next(self, calibration.as_ref(), n) {
                Some(corners) => taken.push(corners),
                None => break,
            }
        }
        POOL
    }

    fn solve(&self, taken: &[Vec<Corner>]) -> Option<Calibration> {
        let observations = (0..).zip(taken).map(|(i, corners)| Observation {
            camera: 0,
            frame: FrameId(i),
            corners: corners.clone(),
        });
        let problem = Problem {
            observations: observations.collect(),
            cameras: vec![CameraSetup {
                size_px: self.camera.size_px,
                model: Model::Brown5,
                start: None,
                focal_hint_px: None,
            }],
            target: BOARD,
            options: Options { multi_start: false, ..Options::default() },
        };
        calibrate(&problem, &mut |_| ControlFlow::Continue(())).ok()
    }

    fn reached(&self, calibration: &Calibration) -> bool {
        let found = uncertainty::of(calibration, &BOARD, Range::Boards);
        self.goal.figure.of(&found).is_some_and(|px| px <= self.goal.px(&calibration.camera))
    }

    fn pool(mut self, lens: &'static str, seed: u64) -> Pool {
        let mut chance: Vec<f64> = (0..ORDERS).map(|_| self.by_chance() as f64).collect();
        chance.sort_by(f64::total_cmp);
        let chance = chance.into_iter().map(|n| n as usize).collect();
        let (best, hand) = (self.best(), self.hand());
        Pool { lens, seed, chance, best, hand }
    }

    fn by_chance(&mut self) -> usize {
        let mut order: Vec<usize> = (FIRST..POOL).collect();
        for i in (1..order.len()).rev() {
            order.swap(i, self.random.random_range(0..=i));
        }
        self.take(&mut |s, _, n| Some(s.seen[*order.get(n)?].clone()))
    }

    fn best(&mut self) -> usize {
        let mut left: Vec<usize> = (FIRST..POOL).collect();
        self.take(&mut |s, calibration, _| {
            let poses: Vec<Pose> = left.iter().map(|i| s.poses[*i]).collect();
            let best = calibration.and_then(|c| best_of(c, &BOARD, Unit::Mm, &s.goal, &poses));
            let at = left.remove(best.unwrap_or(0));
            Some(s.seen[at].clone())
        })
    }

    fn hand(&mut self) -> usize {
        self.take(&mut |s, calibration, _| {
            let next = calibration.and_then(|c| advise(c, &BOARD, Unit::Mm, s.goal).next);
            // Without advice, or where a hand misses the picture, again.
            (0..100).find_map(|_| {
                let Some(next) = next else {
                    let pose = s.any_pose();
                    return s.look(&pose);
                };
                let [angle, share] = HAND;
                let turn = Vector3::from_fn(|_, _| angle * s.normal());
                let shift = Vector3::from_fn(|_, _| share * next.stance.distance * s.normal());
                let middle = next.camera_from_board.apply(&BOARD.center_in_board()).coords + shift;
                let rotation = Rotation3::from_scaled_axis(turn) * next.camera_from_board.rotation;
                let translation = middle - rotation * BOARD.center_in_board().coords;
                s.look(&Pose { rotation, translation })
            })
        })
    }
}

/// The page.
pub fn page(studies: &[Vec<Pool>]) -> String {
    let mut page = format!(
        "# Does advice save pictures?\n\n\
         Made by `straightedge experiment --advice --out docs`; do not edit.\n\n\
         {} captures: {} lenses, {SEEDS} pools of {POOL} pictures each, a board of 9x6, {NOISE_PX} px of noise per coordinate. Boards are\n\
         anywhere in the picture and wholly inside, tilted by up to 50° to any side, at all rolls and distances. All captures of a pool\n\
         begin with the same {FIRST} pictures and end when the real solver's uncertainty in the worst corner of the picture is within the goal.\n\
         Counted are the pictures taken after the first {FIRST}.\n\n\
         * *Best of the pool*: always the picture that the advice's prediction calls the best.\n\
         * *By hand*: always the pose that is advised, missed by {:.0}° about each axis and by {:.0} % of the distance each way (1 σ).\n\
         * *By chance*: {ORDERS} random orders of the pool.\n\n\
         *Share* is the median over the pools of the pictures needed in those by chance (median order). Required for the first goal, which\n\
         is what the program aims at unasked: at most 0.50. The second can hardly be reached with the pictures of the pools, which\n\
         seldom come near the corners; then no choice helps, but asking for other pictures does.\n\n",
        LENSES.len() * SEEDS as usize,
        LENSES.len(),
        HAND[0].to_degrees(),
        100.0 * HAND[1],
    );
    page += "| goal | share, best of the pool | share, by hand |\n|---|---|---|\n";
    for (goal, pools) in GOALS.iter().zip(studies) {
        let share = |of: &dyn Fn(&Pool) -> usize| {
            let mut all: Vec<f64> = pools.iter().map(|p| of(p) as f64 / p.by_chance().max(1.0)).collect();
            all.sort_by(f64::total_cmp);
            stats::quantile(&all, 0.5)
        };
        page += &format!("| {goal} | {:.2} | {:.2} |\n", share(&|p| p.best), share(&|p| p.hand));
    }
    for (goal, pools) in GOALS.iter().zip(studies) {
        page += &format!(
            "\n## {goal}\n\n| lens | pool | best of the pool | by hand | by chance |\n|---|---|---|---|---|\n"
        );
        page.extend(pools.iter().map(row));
    }
    page
}

fn row(p: &Pool) -> String {
    let told = |n: usize| if n == POOL { format!("> {}", POOL - FIRST) } else { n.to_string() };
    let chance: Vec<String> = p.chance.iter().map(|n| told(*n)).collect();
    format!("| {} | {} | {} | {} | {} |\n", p.lens, p.seed + 1, told(p.best), told(p.hand), chance.join(", "))
}
