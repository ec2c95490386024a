//! What to photograph next, on photographs.

use nalgebra::{Point3, Vector2};
use rand::SeedableRng as _;
use rand_distr::{Distribution as _, Normal};
use rand_pcg::Pcg64;
use straightedge::calib::{
    advice::{self, State, advise, expected},
    camera::Model,
    observation::{Corner, FrameId, Observation},
    refine::{self, Free, block::Block},
    solution::{Calibration, View},
    target::{Target, Unit},
    uncertainty::{self, Range},
};

use crate::influence::{problem, solve};

/// Three pictures whose boards nearly face the camera: a strongly tilted one is asked for, and one that is there brings what is expected
/// of its pose.
#[test]
fn three_boards_that_face_the_camera_want_tilt() {
    let Some((report, whole)) = problem("opencv_left", Model::Brown5) else { return };
    let position = |name: &str| report.frames.iter().position(|f| f.name() == name).unwrap() as u32;
    let mut few = whole.clone();
    let mut frames = ["left01.jpg", "left04.jpg", "left07.jpg"].map(position).to_vec();
    few.observations.retain(|o| frames.contains(&o.frame.0));
    let before = solve(&few);
    let start = std::time::Instant::now();
    let advice = advise(&before, &whole.target, Unit::Squares, advice::Goal::default());
    println!("{} {} {:?}", advice.sentence, advice.promise, start.elapsed());
    assert_eq!(advice.state, State::Next);
    assert!(advice.next.unwrap().stance.tilt_rad.to_degrees() >= 30.0);

    let left02 = position("left02.jpg");
    let all = solve(&whole);
    let pose = all.views.iter().find(|v| v.frame.0 == left02).unwrap().camera_from_board;
    let three = frames.clone();
    frames.push(left02);
    few.observations = whole.observations.iter().filter(|o| frames.contains(&o.frame.0)).cloned().collect();
    let after = solve(&few);
    let range = uncertainty::distance(&before, &whole.target, Range::Boards);
    let (promised, focal) = expected(&before, &whole.target, &pose, range).unwrap();
    // What is promised is about points as far away as the boards, and so is what is found: by a focal length that is 6 % off they were
    // believed to be 6 % farther.
    let [now, found] = [&before, &after].map(|c| uncertainty::of(c, &whole.target, Range::Boards));
    // The lens of three such pictures folds within the picture: no corner is promised anything, the focal length is.
    assert!(now.worst_corner_px.is_none() && promised.worst_corner_px.is_none());
    for (name, now, promised, found) in [
        ("σ of fx", before.sigma[0], focal, after.sigma[0]),
        ("centre", now.center_px, promised.center_px, found.center_px),
    ] {
        println!("{name}: {now:?} becomes {promised:?} as promised, {found:?} as found");
        let (now, promised, found) = (now.unwrap(), promised.unwrap(), found.unwrap());
        let off = ((now - promised) / (now - found)).ln().abs();
        assert!(off < 1.3f64.ln(), "{name}: {off}");
    }
    // Over the rest of the picture half of the places differ by more than 30 %, and nobody could know it: the derivatives are those of a camera
    // that is 30 px off. At the camera of the four pictures the same three promise what the fourth brings, everywhere.
    // Of what remains σ₀, which three pictures tell to some 4 %, has 2 %, and robust weights less than 1 %.
    let there = at_camera_of(&after, &before, &three, &whole.target);
    let pose = after.views.iter().find(|v| v.frame.0 == left02).unwrap().camera_from_board;
    let (promised, _) = expected(&there, &whole.target, &pose, range).unwrap();
    let found = uncertainty::of(&after, &whole.target, Range::At(range.unwrap()));
    let ratios = || {
        let pairs = promised.grid_px.iter().flatten().zip(found.grid_px.iter().flatten());
        pairs.map(|(a, b)| a.unwrap() / b.unwrap())
    };
    let (low, high) = ratios().fold((f64::INFINITY, 0.0f64), |(l, h), r| (l.min(r), h.max(r)));
    println!(
        "promised over found at the camera of four: {low:.3} to {high:.3} over {} places",
        ratios().count()
    );
    assert!(low > 1.0 / 1.3 && high < 1.3, "{low} {high}");
}

/// Three pictures that leave the focal length open, and the picture that is asked for of them, as the camera of all pictures would see it:
/// what is promised in words, in the worst corner or of the focal length, comes true within 30 %. It is meant to at 2 σ, 19 times in 20; all
/// of 95 promises do.
#[test]
fn what_weak_sets_are_promised_is_kept() {
    let mut random = Pcg64::seed_from_u64(1);
    let (mut kept, mut promised) = (0, 0);
    for set in ["opencv_left", "opencv_right"] {
        let Some((_, whole)) = problem(set, Model::Brown5) else { return };
        let truth = solve(&whole);
        let noise = Normal::new(0.0, truth.rms_px / 2f64.sqrt()).unwrap();
        let sigma_px = whole.observations[0].corners[0].sigma_px;
        let n = whole.observations.len();
        let triples = (0..n).flat_map(|a| (0..a).flat_map(move |b| (0..b).map(move |c| [a, b, c])));
        for triple in triples {
            let mut few = whole.clone();
            few.observations = triple.map(|i| whole.observations[i].clone()).to_vec();
            let before = solve(&few);
            let [now, f] = [before.sigma[0].unwrap(), before.camera.params[0]];
            if now < 0.004 * f {
                continue;
            }
            let advice = advise(&before, &whole.target, Unit::Squares, advice::Goal::default());
            let pose = advice.next.unwrap().camera_from_board;
            let [w, h] = truth.camera.size_px.map(f64::from);
            let points = whole.target.points_in_board();
            let corner = |(index, p): (u32, &Point3<f64>)| {
                let px = truth.camera.project(&pose.apply(p))?;
                let inside = px.x > 0.0 && px.y > 0.0 && px.x < w - 1.0 && px.y < h - 1.0;
                let px = px + Vector2::from_fn(|_, _| noise.sample(&mut random));
                inside.then_some(Corner { index, px, sigma_px })
            };
            let corners = (0..).zip(&points).filter_map(corner).collect();
            few.observations.push(Observation { camera: 0, frame: FrameId(99), corners });
            let after = solve(&few);
            let found = uncertainty::of(&after, &whole.target, Range::At(advice.range.unwrap()));
            let figures = if advice.promise.contains("in the worst corner becomes") {
                let [now, then] = [advice.before, advice.after].map(|f| f.unwrap().worst_corner_px.unwrap());
                [now, then, found.worst_corner_px.unwrap_or(f64::INFINITY)]
            } else if advice.promise.contains("the focal length, known to") {
                [now, advice.focal_px.unwrap()[1], after.sigma[0].unwrap()]
            } else {
                continue;
            };
            let off = ((figures[0] - figures[1]) / (figures[0] - figures[2])).ln().abs();
            promised += 1;
            // A loss in place of a gain has no logarithm, and is not kept either.
            if off < 1.3f64.ln() {
                kept += 1;
            } else {
                println!("{set} {triple:?}: {figures:.2?}: {}", advice.promise);
            }
        }
    }
    println!("{kept} of {promised} promises kept");
    assert!(promised >= 20 && 20 * kept >= 19 * promised, "{kept} of {promised}");
}

/// The pictures `frames` of `of` as if the camera and the poses of `at` had been found from them.
fn at_camera_of(at: &Calibration, of: &Calibration, frames: &[u32], target: &Target) -> Calibration {
    let view = |frame: &u32| {
        let find = |c: &Calibration| c.views.iter().find(|v| v.frame.0 == *frame).unwrap().clone();
        View { camera_from_board: find(at).camera_from_board, ..find(of) }
    };
    let views: Vec<View> = frames.iter().map(view).collect();
    let block = |view: &View| {
        let points: Vec<_> = view.indices.iter().map(|i| target.point_in_board(*i).unwrap()).collect();
        let mut block = Block::new(&points, &vec![Vector2::zeros(); points.len()]);
        block.set_weights(view.weights.iter().copied());
        block
    };
    let blocks: Vec<Block> = views.iter().map(block).collect();
    let free = Free::of(at);
    let problem = refine::Problem {
        spec: at.camera.spec(),
        free: &free,
        blocks: &blocks,
        huber_px: None,
        single_precision: false,
    };
    let poses = views.iter().map(|v| v.camera_from_board).collect();
    let state = refine::State { params: at.camera.params.clone(), poses };
    let information = refine::information(&problem, &state).unwrap();
    let covariance = information.cholesky().unwrap().inverse() * of.sigma0_px.powi(2);
    Calibration { camera: at.camera.clone(), views, covariance, ..of.clone() }
}
