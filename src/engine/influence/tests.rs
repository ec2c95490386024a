use rand::SeedableRng as _;
use rand_distr::{Distribution as _, StandardNormal};

use super::*;
use crate::{
    calibrate::{Options, Problem, calibrate},
    synth::Scene,
    uncertainty::tests::problem as noisy,
};

fn seeded(seed: u64) -> Problem {
    let views: Vec<usize> = (0..Scene::seed().poses.len()).collect();
    noisy(&views, Options { multi_start: false, ..Options::default() }, seed)
}

/// The seed scene with noise; `spoil` moves a corner of a view.
fn problem(spoil: impl Fn(usize, u32, Vector2<f64>) -> Vector2<f64>) -> Problem {
    let mut problem = seeded(3);
    for (view, observation) in problem.observations.iter_mut().enumerate() {
        observation.corners.iter_mut().for_each(|c| c.px = spoil(view, c.index, c.px));
    }
    problem
}

fn solve(problem: &Problem) -> Calibration {
    calibrate(problem, &mut |_| ControlFlow::Continue(())).unwrap()
}

fn influences(problem: &Problem) -> (Calibration, Vec<Influence>) {
    let calibration = solve(problem);
    let list = of(&calibration, &problem.target, Loss::Huber, &mut |_| ControlFlow::Continue(())).unwrap();
    (calibration, list.into_iter().map(Option::unwrap).collect())
}

/// The same figures from a calibration of its own for every view that is left out.
#[test]
fn is_that_of_a_solve_without_the_view() {
    let problem = problem(|_, _, px| px);
    let (calibration, list) = influences(&problem);
    let set = Set::new(&calibration, &problem.target, Loss::Huber).unwrap();
    let quick = left_out(&calibration, &problem.target, Loss::Huber);
    for (i, found) in list.iter().enumerate() {
        let mut rest = problem.clone();
        rest.observations.remove(i);
        let alone = solve(&rest);
        let way = |to: &Camera| displacement(&calibration.camera, to, &set.pixels, &set.weights);
        let quick = quick[i].as_ref().unwrap();
        let off =
            way(&alone.camera).iter().zip(way(quick)).zip(&set.weights).fold([0.0, 0.0], |s, ((a, b), w)| {
                [s[0] + w * (a.unwrap() - b.unwrap()).norm_squared(), s[1] + w]
            });
        let off = (off[0] / off[1]).sqrt();
        assert!(off < (0.05 * found.moves_px).max(0.002), "view {i}: {off} px off a move of {found:?}");
    }
}

/// Pictures that differ by nothing but noise move the camera as chance does, and none of them is called harmful.
///
/// Without view i the solution is off by a draw from Cov₋ᵢ − Cov. Squares of such ways are on average those of draws from that covariance;
/// each scatters by at most √2 of itself (one direction that outweighs all others), the mean of 150 by 0.12, that of 16 draws for each
/// of them by 0.03.
#[test]
fn of_good_pictures_is_chance() {
    const DRAWS: usize = 16;
    let mut random = rand_pcg::Pcg64::seed_from_u64(1);
    let (mut moves, mut draws) = (0.0, 0.0);
    for seed in 0..10 {
        let problem = seeded(seed);
        let (calibration, list) = influences(&problem);
        let set = Set::new(&calibration, &problem.target, Loss::Huber).unwrap();
        assert!(list.iter().all(|v| !matches!(v.role, Role::Harmful | Role::HarmlessOutlier)), "{list:?}");
        for (i, found) in list.iter().enumerate() {
            let rest = set.scatter.without(&set.seen(i).unwrap()).unwrap();
            let by_chance = (rest.intrinsics() - set.scatter.intrinsics()).symmetric_eigen();
            let scale = found.by_chance_px.powi(-2);
            moves += scale * found.moves_px.powi(2);
            for _ in 0..DRAWS {
                let step = by_chance.eigenvalues.map(|v| {
                    let normal: f64 = StandardNormal.sample(&mut random);
                    v.max(0.0).sqrt() * normal
                });
                let mut camera = calibration.camera.clone();
                for (to, by) in camera.params.iter_mut().zip((&by_chance.eigenvectors * step).iter()) {
                    *to += by;
                }
                draws += scale * mean_square(&set, &camera) / DRAWS as f64;
            }
        }
    }
    println!("squares are {:.3} of those by chance", moves / draws);
    assert!((moves / draws - 1.0).abs() < 3.0 * 0.12, "{moves} {draws}");
}

/// How far the projection moves to this camera, px².
fn mean_square(set: &Set<'_>, to: &Camera) -> f64 {
    let moved = displaced(&set.rays, (to, None), &set.pixels, &set.weights);
    let sums = moved.iter().zip(&set.weights).filter_map(|(by, w)| Some((w * (*by)?.norm_squared(), *w)));
    let (squares, total) = sums.fold((0.0, 0.0), |sum, term| (sum.0 + term.0, sum.1 + term.1));
    squares / total
}

/// A picture that is stretched contradicts all others, though its own error says little of it.
#[test]
fn names_the_picture_that_pulls() {
    let (_, list) =
        influences(&problem(|view, _, px| if view == 3 { Vector2::new(px.x * 1.004, px.y) } else { px }));
    assert_eq!(list[3].role, Role::Harmful, "{list:?}");
    assert_eq!(list.iter().filter(|v| v.role == Role::Harmful).count(), 1, "{list:?}");
}

/// A picture with more noise than the others is an outlier that does no harm.
#[test]
fn tells_harmless_outliers() {
    let wild = |view, index: u32, px: Vector2<f64>| {
        let by = if view == 3 { 0.6 * f64::from(index % 3) - 0.6 } else { 0.0 };
        px + Vector2::new(by, -by)
    };
    let (calibration, list) = influences(&problem(wild));
    assert!(calibration.views[3].rms_px > 0.3);
    assert_eq!(list[3].role, Role::HarmlessOutlier, "{list:?}");
}

#[test]
fn a_turned_camera_is_the_same() {
    let camera = Scene::seed().camera;
    let pixels: Vec<_> = (0..12).map(|i| Vector2::new(60.0 * f64::from(i), 50.0 * f64::from(i))).collect();
    let weights = vec![1.0; pixels.len()];
    let still = displacement(&camera, &camera, &pixels, &weights);
    assert!(still.iter().all(|d| d.unwrap().norm() < 1e-9));
    let mut other = camera.clone();
    other.params[2] += 0.5;
    // A shifted principal point is nearly a turn: what is left is far smaller than the shift.
    let turned = displacement(&camera, &other, &pixels, &weights);
    assert!(turned.iter().all(|d| d.unwrap().norm() < 0.2), "{turned:?}");
    other.params[0] *= 1.01;
    let longer = displacement(&camera, &other, &pixels, &weights);
    assert!(longer.iter().any(|d| d.unwrap().norm() > 1.0));
}

#[test]
fn of_a_held_camera_is_none_and_can_be_stopped() {
    let mut problem = problem(|_, _, px| px);
    let calibration = solve(&problem);
    assert!(of(&calibration, &problem.target, Loss::Huber, &mut |_| ControlFlow::Break(())).is_none());
    problem.observations.truncate(1);
    let names = calibration.camera.spec().params.iter().map(|p| p.name).collect::<Vec<_>>().join(",");
    problem.options.fixed = crate::calibrate::parse_fixes(&names).unwrap();
    problem.cameras[0].start = Some(calibration.camera);
    let held = solve(&problem);
    let list = of(&held, &problem.target, Loss::Huber, &mut |_| ControlFlow::Continue(())).unwrap();
    assert_eq!(list.len(), 1);
    assert!(list[0].is_none_or(|v| v.moves_px < 1e-9), "{list:?}");
}
