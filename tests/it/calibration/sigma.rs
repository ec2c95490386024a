//! σ is what repeated noise does to the parameters; the long study is `cargo bench --bench sigma`.

use super::{Scene, add_noise, plain, run};
use straightedge::calib::{
    calibrate::{Loss, Options, Weights},
    synth,
};

#[test]
fn sigma_agrees_with_the_scatter() {
    const SOLVES: usize = 300;
    let seed = synth::Scene::seed();
    let poses = (0..15).map(|i| seed.camera_from_board(i).unwrap()).collect();
    let scene = Scene::new(seed.camera.model, seed.camera.size_px, &seed.camera.params, poses);
    for (loss, weights) in [
        (Loss::Linear, Weights::None),
        (Loss::Huber, Weights::None),
        (Loss::Linear, Weights::Sigma),
        (Loss::Huber, Weights::Sigma),
    ] {
        let (mut squares, mut covered) = ([0.0; 9], 0);
        for solve in 0..SOLVES {
            let mut problem = scene.problem(Options { loss, weights, multi_start: false, ..plain() });
            add_noise(&mut problem, 0.05, solve as u64);
            if weights == Weights::Sigma {
                // Every other picture is five times worse, and says so.
                let mut poor = scene.problem(plain());
                add_noise(&mut poor, 0.25, (SOLVES + solve) as u64);
                for view in (0..15).step_by(2) {
                    problem.observations[view] = poor.observations[view].clone();
                }
            }
            let got = run(&problem).unwrap();
            for i in 0..9 {
                let in_sigma = (got.camera.params[i] - scene.camera.params[i]) / got.sigma[i].unwrap();
                squares[i] += in_sigma * in_sigma / SOLVES as f64;
                covered += usize::from(in_sigma.abs() < 1.96);
            }
        }
        // 300 solves know a standard deviation to 4 %.
        let ratios = squares.map(f64::sqrt);
        println!("{loss} {weights}: {ratios:.3?}");
        assert!(ratios.iter().all(|r| (0.85..1.15).contains(r)), "{loss}, {weights}: {ratios:?}");
        let share = covered as f64 / (9 * SOLVES) as f64;
        assert!((0.93..0.97).contains(&share), "{loss}, {weights}: {share}");
    }
}
