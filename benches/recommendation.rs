//! Whether the recommended model is the right one: `cargo bench --bench recommendation` recommends one for captures by lenses of every
//! kind and writes `docs/recommendation.md`.
#![allow(clippy::expect_used, clippy::print_stdout, reason = "a study reports and fails loudly")]

#[path = "recommendation/capture.rs"]
mod capture;

use std::{collections::BTreeMap, fmt::Write as _, ops::ControlFlow};

use straightedge::calib::{
    calibrate::{CANDIDATES, calibrate, compare},
    camera::Model,
};

const SEEDS: u64 = 5;
const VIEWS: usize = 20;
/// Fresh pictures that a camera is asked about.
const FRESH: usize = 100;

fn main() {
    let mut page = format!(
        "# Is the recommended model the right one?\n\n\
         Made by `cargo bench --bench recommendation`; do not edit.\n\n\
         {VIEWS} pictures of a 9x6 board by a lens of each kind (1280 x 960 px, noise {} px, seeds 0 to {}), without a hint. *Right* means the\n\
         lens's own model, *as good* another one whose error in {FRESH} fresh pictures is at most 1 % larger than that of the own model\n\
         calibrated from the same pictures. Required: 95 % right or as good.\n\n\
         | lens | right | as good | worse | largest error to the own model's | recommended |\n|---|---|---|---|---|---|\n",
        capture::NOISE_PX,
        SEEDS - 1
    );
    let (mut good, mut all) = (0, 0);
    for (k, lens) in capture::LENSES.into_iter().enumerate() {
        let truth = capture::camera(lens);
        let (mut counts, mut chosen, mut largest) = ([0; 3], BTreeMap::<String, u32>::new(), 0.0f64);
        for seed in 0..SEEDS {
            let seed = 1000 * k as u64 + seed;
            let problem = capture::problem(&truth, VIEWS, seed);
            let fresh = capture::problem(&truth, FRESH, seed + 500);
            let recommended = compare(&problem, &CANDIDATES, &mut |_| ControlFlow::Continue(()));
            let model = recommended.as_ref().map(|c| c.recommended).ok();
            *chosen.entry(model.map_or("none".to_owned(), |m| m.to_string())).or_default() += 1;
            let error = |model: Model| {
                let mut problem = problem.clone();
                problem.cameras[0].model = model;
                let fitted = calibrate(&problem, &mut |_| ControlFlow::Continue(())).ok()?;
                capture::error_px(&fitted.camera, &fresh).ok()
            };
            // Where the own model, overstretched, cannot even see all fresh pictures, any that does is better.
            let ratio = match (model.and_then(error), error(truth.model)) {
                (Some(chosen), Some(own)) => chosen / own,
                (Some(_), None) => 0.0,
                (None, _) => f64::INFINITY,
            };
            println!("{truth:?} {seed}: {model:?} {ratio:.4}");
            largest = largest.max(ratio);
            let verdict = if model == Some(truth.model) {
                0
            } else if ratio <= 1.01 {
                1
            } else {
                2
            };
            counts[verdict] += 1;
        }
        let words: Vec<String> = chosen.iter().map(|(name, n)| format!("{name} {n}")).collect();
        let [right, as_good, worse] = counts;
        let focal = truth.params[0];
        let _ = writeln!(
            page,
            "| {}, f {focal} px | {right} | {as_good} | {worse} | {largest:.4} | {} |",
            truth.model,
            words.join(", ")
        );
        good += right + as_good;
        all += right + as_good + worse;
    }
    let _ = write!(
        page,
        "\n{good} of {all} ({:.1} %) are right or as good.\n",
        100.0 * f64::from(good) / f64::from(all)
    );
    println!("{page}");
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/recommendation.md");
    std::fs::write(path, page).expect("docs/recommendation.md can be written");
}
