//! Whether σ is true: `cargo bench --bench sigma` solves 4000 re-noised problems from true poses and writes
//! `docs/sigma.md`.
#![allow(clippy::expect_used, clippy::print_stdout, reason = "a study reports and fails loudly")]

mod common;

use std::fmt::Write as _;

use nalgebra::{Matrix2, Point3, Vector2, Vector3};
use straightedge::calib::{
    calibrate::{Loss, Options, Weights},
    pose::Pose,
    solution::Calibration,
    synth::Scene,
    uncertainty::{self, Range},
};

const SOLVES: u64 = 4000;
const NOISE_PX: f64 = 0.1;

/// Sums over the solves for each intrinsic.
#[derive(Clone, Copy, Default)]
struct Sums {
    shift: f64,
    square: f64,
    sigma: f64,
    in_sigma: f64,
    covered: u32,
}

fn main() {
    let mut page = format!(
        "# Is σ true?\n\n\
         Made by `cargo bench --bench sigma`; do not edit.\n\n\
         The corners of a scene's true poses get new normal noise of {NOISE_PX} px per coordinate {SOLVES} times (seeds 0 to {}), and each\n\
         set is calibrated from its closed form. *Scatter* is the standard deviation of a parameter over the solves, *σ* the mean of\n\
         what the calibrations report. *Ratio* is the root mean square of (estimate − truth) / σ, each with the σ of its own solve, and\n\
         *covered* the share of solves whose interval ±1.96 σ holds the truth. {SOLVES} solves know a standard deviation to 1.1 % and a\n\
         coverage to 0.35 %. Required: ratio 0.90 to 1.10, covered 93 to 97 %.\n\n\
         The second table of each scene is the projection: where a point that the true camera sees at a pixel, at the boards' distance or\n\
         without end, appears in the found one, by the mean of the boards' frames (the gauge of `uncertainty`). *Scatter* is the root of\n\
         the largest eigenvalue of the second moments of that shift, *σ* the root mean square of what the calibrations report, *covered*\n\
         the share of solves whose 95 % ellipse holds the pixel.\n",
        SOLVES - 1
    );
    let random = common::random_scene(20, 7);
    let huber = Options { multi_start: false, weights: Weights::None, ..Options::default() };
    let linear = Options { loss: Loss::Linear, ..huber.clone() };
    let mut honest = true;
    for (title, scene, options) in [
        ("Seed scene, 15 poses, Huber's loss", Scene::seed(), huber.clone()),
        ("Seed scene, 15 poses, least squares", Scene::seed(), linear),
        ("20 random poses, Huber's loss", random, huber),
    ] {
        println!("{title}");
        honest &= study(&mut page, title, &scene, options);
    }
    let verdict =
        if honest { "All figures are within the bounds." } else { "**Some figures are out of bounds.**" };
    let _ = write!(page, "\n{verdict}\n");
    println!("{page}");
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/sigma.md");
    std::fs::write(path, page).expect("docs/sigma.md can be written");
}

/// Adds one table; whether all its figures are within the bounds.
fn study(page: &mut String, title: &str, scene: &Scene, options: Options) -> bool {
    let exact = common::problem(scene, NOISE_PX, options);
    let names = scene.camera.spec().params;
    let mut sums = vec![Sums::default(); names.len()];
    let mut places = Places::new(scene);
    for seed in 0..SOLVES {
        let mut problem = exact.clone();
        common::add_noise(&mut problem, seed);
        let got = common::run(&problem).expect("the scene determines the camera");
        places.add(&got, scene);
        for (i, sum) in sums.iter_mut().enumerate() {
            let (shift, sigma) = (got.camera.params[i] - scene.camera.params[i], got.sigma[i].expect("free"));
            sum.shift += shift;
            sum.square += shift * shift;
            sum.sigma += sigma;
            sum.in_sigma += (shift / sigma).powi(2);
            sum.covered += u32::from(shift.abs() < 1.96 * sigma);
        }
    }
    let n = SOLVES as f64;
    let _ = write!(
        page,
        "\n## {title}\n\n| | truth | scatter | σ | ratio | covered |\n|---|---|---|---|---|---|\n"
    );
    let mut honest = true;
    for ((param, truth), sum) in names.iter().zip(&scene.camera.params).zip(&sums) {
        let mean = sum.shift / n;
        let scatter = (sum.square / n - mean * mean).sqrt();
        let (ratio, covered) = ((sum.in_sigma / n).sqrt(), f64::from(sum.covered) / n);
        honest &= (0.9..=1.1).contains(&ratio) && (0.93..=0.97).contains(&covered);
        let _ = writeln!(
            page,
            "| {} | {truth} | {scatter:.3e} | {:.3e} | {ratio:.3} | {:.1} % |",
            param.name,
            sum.sigma / n,
            100.0 * covered
        );
    }
    honest & places.write(page, n)
}

/// What is beyond these 95 % of a normal distribution in the plane, in units of the covariance: −2 ln 0.05.
const ELLIPSE: f64 = 5.991_464_547;

/// Sums over the solves at a pixel.
#[derive(Clone, Copy, Default)]
struct Place {
    /// Second moments of the shift.
    moments: Matrix2<f64>,
    /// Squares of σ.
    variance: f64,
    /// Ellipses that hold the pixel.
    held: u32,
    /// Solves whose camera sees it; one that folds there has no answer, and says so.
    seen: u32,
}

/// The projection at 20 pixels and two ranges.
struct Places {
    poses: Vec<Pose>,
    pixels: Vec<Vector2<f64>>,
    /// For both ranges and each pixel.
    sums: [Vec<Place>; 2],
}

impl Places {
    fn new(scene: &Scene) -> Self {
        let [w, h] = scene.camera.size_px.map(f64::from);
        // The middles of 5 × 4 cells.
        let pixels: Vec<_> = (0..20)
            .map(|i| {
                Vector2::new(
                    w * f64::from(i % 5 * 2 + 1) / 10.0 - 0.5,
                    h * f64::from(i / 5 * 2 + 1) / 8.0 - 0.5,
                )
            })
            .collect();
        let pose = |view| scene.camera_from_board(view).expect("a pose of the scene");
        let sums = vec![Place::default(); pixels.len()];
        Self { poses: (0..scene.poses.len()).map(pose).collect(), pixels, sums: [sums.clone(), sums] }
    }

    fn add(&mut self, got: &Calibration, scene: &Scene) {
        let target = scene.board.target();
        let there = uncertainty::of(got, &target, Range::Boards).range.expect("boards have a distance");
        for (range, sums) in [there, 1e9].into_iter().zip(&mut self.sums) {
            let told = uncertainty::covariances(got, &target, Range::At(range), &self.pixels);
            for ((px, told), sum) in self.pixels.iter().zip(told).zip(sums) {
                let Some(told) = told else { continue };
                let point =
                    Point3::from(scene.camera.unproject(px).expect("the true camera sees it") * range);
                let back = |(view, pose): (&straightedge::calib::solution::View, &Pose)| {
                    view.camera_from_board.apply(&pose.inverse().apply(&point)).coords
                };
                let mean = got.views.iter().zip(&self.poses).map(back).sum::<Vector3<f64>>()
                    / self.poses.len() as f64;
                let Some(there) = got.camera.project(&mean.into()) else { continue };
                let shift = there - px;
                sum.seen += 1;
                sum.moments += shift * shift.transpose();
                sum.variance += told.symmetric_eigenvalues().max();
                let inverse = told.try_inverse().expect("σ is not zero");
                sum.held += u32::from((shift.transpose() * inverse * shift).x < ELLIPSE);
            }
        }
    }

    /// Adds the table; whether all its figures are within the bounds.
    fn write(&self, page: &mut String, n: f64) -> bool {
        let _ = write!(
            page,
            "\n| pixel | scatter at the boards | σ | ratio | covered | scatter at infinity | σ | ratio | covered |\n\
             |---|---|---|---|---|---|---|---|---|\n"
        );
        let mut honest = true;
        for (i, px) in self.pixels.iter().enumerate() {
            let _ = write!(page, "| {:.0}, {:.0} |", px.x, px.y);
            for place in self.sums.iter().map(|s| s[i]) {
                let seen = f64::from(place.seen.max(1));
                let scatter = (place.moments / seen).symmetric_eigenvalues().max().sqrt();
                // Those without an answer hold nothing.
                let (sigma, covered) = ((place.variance / seen).sqrt(), f64::from(place.held) / n);
                let ratio = scatter / sigma;
                honest &= (0.9..=1.1).contains(&ratio) && (0.93..=0.97).contains(&covered);
                let _ = write!(page, " {scatter:.4} | {sigma:.4} | {ratio:.3} | {:.1} % |", 100.0 * covered);
            }
            page.push('\n');
        }
        honest
    }
}
