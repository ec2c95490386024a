//! Whether σ is true: `cargo bench --bench sigma` solves 4000 re-noised problems from true poses and writes
//! `docs/sigma.md`.
#![allow(clippy::expect_used, clippy::print_stdout, reason = "a study reports and fails loudly")]

mod common;

use std::fmt::Write as _;

use straightedge::calib::{
    calibrate::{Loss, Options, Weights},
    synth::Scene,
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
         coverage to 0.35 %. Required: ratio 0.90 to 1.10, covered 93 to 97 %.\n",
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
    for seed in 0..SOLVES {
        let mut problem = exact.clone();
        common::add_noise(&mut problem, seed);
        let got = common::run(&problem).expect("the scene determines the camera");
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
    honest
}
