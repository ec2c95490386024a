//! The detector on rendered boards with exactly known corners, and on pictures without a board.

use std::collections::BTreeMap;

use nalgebra::Vector3;

use super::*;
use crate::{
    image::Plane,
    pose::Pose,
    synth::{self, Renderer, Scene},
    target::BoardSize,
};

fn size(text: &str) -> BoardSize {
    text.parse().unwrap()
}

/// The source document's scene with a white margin and a degradation.
fn scene(degrade: &str) -> Scene {
    let mut scene = Scene { degrade: degrade.parse().unwrap(), seed: 7, ..Scene::seed() };
    scene.board.margin = 0.5;
    scene
}

fn find(picture: Plane<u8>) -> Detection {
    detect(&Gray::U8(picture), &Options::default())
}

/// Distances of found corners from the truth, px.
fn errors(scene: &Scene, view: usize, found: &Assigned) -> Vec<f64> {
    let truth = scene.corners_px(view);
    found.corners.iter().map(|c| (truth[c.index as usize].unwrap() - c.px).norm()).collect()
}

fn rms(errors: &[f64]) -> f64 {
    (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt()
}

#[test]
fn every_view_of_the_document_is_found_whole_with_its_indices() {
    for (degrade, bound) in [
        ("", 0.01),
        ("noise=10", 0.05),
        ("blur=2", 0.02),
        ("motion=5", 0.05),
        ("light=0.6,vignette=0.4", 0.05),
        ("contrast=0.3,noise=2", 0.06),
        ("jpeg=40", 0.05),
    ] {
        let scene = scene(degrade);
        let renderer = Renderer::new(&scene).unwrap();
        let mut all = Vec::new();
        for view in 0..scene.poses.len() {
            let found = find(renderer.render(view).unwrap());
            let grid = found.grid.unwrap_or_else(|| panic!("{degrade} view {view}: {}", found.why));
            let assigned = grid.assign(size("9x6"), &[]).unwrap();
            assert!(assigned.full && !assigned.order_is_a_choice, "{degrade} view {view}");
            all.extend(errors(&scene, view, &assigned));
        }
        let worst = all.iter().fold(0.0f64, |m, e| m.max(*e));
        println!("{degrade}: RMS {:.4} largest {worst:.3}", rms(&all));
        assert!(rms(&all) < bound && worst < 10.0 * bound, "{degrade}: {} {worst}", rms(&all));
    }
}

#[test]
fn parts_of_boards_are_used_with_the_right_indices() {
    let mut scene = scene("noise=2");
    let mut used = 0;
    for shift in [[150.0, 0.0], [-150.0, 30.0], [0.0, 110.0], [20.0, -110.0], [120.0, 90.0], [-130.0, -80.0]]
    {
        for pose in &mut scene.poses {
            pose.translation[0] += shift[0];
            pose.translation[1] += shift[1];
        }
        let renderer = Renderer::new(&scene).unwrap();
        for view in [0, 3, 7, 9, 12] {
            let Some(grid) = find(renderer.render(view).unwrap()).grid else { continue };
            if let Ok(part) = grid.assign(size("9x6"), &[]) {
                let e = errors(&scene, view, &part);
                assert!(e.iter().all(|e| *e < 0.2), "{shift:?} view {view}: {e:?}");
                used += usize::from(!part.full);
            }
        }
        for pose in &mut scene.poses {
            pose.translation[0] -= shift[0];
            pose.translation[1] -= shift[1];
        }
    }
    println!("{used} parts of 30 boards used");
    assert!(used >= 12, "{used}");
}

#[test]
fn hidden_corners_are_missing_not_wrong() {
    let scene = scene("occlusion=0.15,noise=3");
    let renderer = Renderer::new(&scene).unwrap();
    let mut missing = 0;
    for view in 0..6 {
        let grid = find(renderer.render(view).unwrap()).grid.unwrap();
        if let Ok(part) = grid.assign(size("9x6"), &[]) {
            let e = errors(&scene, view, &part);
            // An edge of the occluder through a corner's strips moves it a little.
            assert!(e.iter().all(|e| *e < 1.0), "view {view}: {e:?}");
            missing += 54 - part.corners.len();
        }
    }
    assert!(missing > 6, "{missing}");
}

/// The index of the corner of a scene that a corner of a grid is, by its place.
fn index_of(truth: &[Option<Vector2<f64>>], px: Vector2<f64>) -> Option<usize> {
    truth.iter().position(|t| t.is_some_and(|t| (t - px).norm() < 3.0))
}

#[test]
fn what_lies_over_a_board_is_not_taken_for_its_end() {
    let (mut used, mut ends) = (0, 0);
    for seed in 0..3 {
        let scene = Scene { seed, ..scene("occlusion=0.3,noise=2") };
        let renderer = Renderer::new(&scene).unwrap();
        for view in 0..scene.poses.len() {
            let truth = scene.corners_px(view);
            let Some(grid) = find(renderer.render(view).unwrap()).grid else { continue };
            for side in (0..4).filter(|side| grid.ends[*side]) {
                let k = side / 2;
                let last = if side % 2 == 0 { 0 } else { grid.size[k] - 1 };
                let line = grid.corners.iter().filter(|c| c.cell[k] == last);
                let indices: Vec<usize> = line.filter_map(|c| index_of(&truth, c.px)).collect();
                let all = |of: fn(usize) -> usize, at: [usize; 2]| {
                    at.iter().any(|at| indices.iter().all(|i| of(*i) == *at))
                };
                assert!(
                    all(|i| i % 9, [0, 8]) || all(|i| i / 9, [0, 5]),
                    "seed {seed} view {view} side {side}"
                );
                ends += 1;
            }
            if let Ok(part) = grid.assign(size("9x6"), &[]) {
                assert!(errors(&scene, view, &part).iter().all(|e| *e < 1.0), "seed {seed} view {view}");
                used += 1;
            }
        }
    }
    println!("{used} of 45 boards used, {ends} ends seen");
    assert!(used >= 40 && ends >= 120, "{used} {ends}");
}

#[test]
fn both_sides_of_a_board_that_is_cut_in_two_are_used() {
    let scene = scene("noise=2");
    let renderer = Renderer::new(&scene).unwrap();
    for view in 0..scene.poses.len() {
        let truth = scene.corners_px(view);
        // A bar from top to bottom over the columns 4 and 5.
        let ends =
            [truth[4].unwrap().x, truth[4 + 45].unwrap().x, truth[5].unwrap().x, truth[5 + 45].unwrap().x];
        let (left, right) =
            (ends.iter().copied().fold(f64::MAX, f64::min), ends.iter().copied().fold(0.0, f64::max));
        let mut picture = renderer.render(view).unwrap();
        for y in 0..picture.height() {
            picture.row_mut(y)[left as usize - 4..right as usize + 4].fill(70);
        }
        let grid = find(picture).grid.unwrap();
        let part = grid.assign(size("9x6"), &[]).unwrap_or_else(|why| panic!("view {view}: {why}"));
        assert!(errors(&scene, view, &part).iter().all(|e| *e < 1.0), "view {view}");
        let column = |c: u32| part.corners.iter().filter(|k| k.index % 9 == c).count();
        assert!(column(0) == 6 && column(8) == 6, "view {view}: {} corners", part.corners.len());
    }
}

#[test]
fn sigma_is_true_whatever_the_noise() {
    for (degrade, low, high) in [
        // Black and white cut half of it off beside the edges; in some views all edges run along the pixels.
        ("noise=10", 0.9, 1.15),
        ("blur=2,noise=5", 0.9, 1.1),
        ("contrast=0.3,noise=5", 0.9, 1.1),
        ("shot=8", 0.8, 1.2),
        ("jpeg=40", 0.6, 1.6),
    ] {
        let scene = scene(degrade);
        let renderer = Renderer::new(&scene).unwrap();
        let (mut sum, mut n) = (0.0, 0.0);
        for view in 0..scene.poses.len() {
            let truth = scene.corners_px(view);
            let found = find(renderer.render(view).unwrap()).grid.unwrap().assign(size("9x6"), &[]).unwrap();
            for c in &found.corners {
                sum += (truth[c.index as usize].unwrap() - c.px).norm_squared()
                    / (2.0 * c.sigma_px * c.sigma_px);
                n += 1.0;
            }
        }
        let std = f64::sqrt(sum / n);
        println!("{degrade}: std of error/σ {std:.3}");
        assert!((low..high).contains(&std), "{degrade}: {std}");
    }
}

#[test]
fn what_is_no_board_is_refused_with_a_reason() {
    let wave =
        |x: usize, y: usize| (127.0 + 100.0 * ((x as f64) / 7.0).sin() * ((y as f64) / 9.0).cos()) as u8;
    let pictures: [(&str, Plane<u8>); 7] = [
        ("flat", Plane::from_fn(300, 200, |_, _| 128)),
        ("stripes", Plane::from_fn(300, 200, |x, _| if x / 12 % 2 == 0 { 20 } else { 230 })),
        (
            "dots",
            Plane::from_fn(300, 200, |x, y| {
                let (dx, dy) = ((x % 24) as i32 - 12, (y % 24) as i32 - 12);
                if dx * dx + dy * dy < 49 { 20 } else { 230 }
            }),
        ),
        ("windows", Plane::from_fn(300, 200, |x, y| if x % 30 < 22 && y % 40 < 30 { 40 } else { 200 })),
        ("tiles", Plane::from_fn(300, 200, |x, y| if x % 25 < 3 || y % 25 < 3 { 60 } else { 220 })),
        ("tiny", Plane::from_fn(9, 7, |x, y| ((x + y) % 2 * 255) as u8)),
        ("one pixel", Plane::new(1, 1)),
    ];
    for (name, picture) in pictures {
        let found = find(picture);
        assert!(found.grid.is_none() && !found.why.is_empty(), "{name}: {found:?}");
    }
    assert!(detect(&Gray::U16(Plane::new(0, 0)), &Options::default()).grid.is_none());
    // Waves cross as squares do, softly: whatever is said, nothing panics.
    let _ = find(Plane::from_fn(300, 200, wave));
}

#[test]
fn depth_and_rotation_do_not_matter() {
    let scene = scene("");
    let picture = synth::render(&scene, 7).unwrap();
    let by_index = |picture: Gray| -> BTreeMap<u32, Vector2<f64>> {
        let assigned = detect(&picture, &Options::default()).grid.unwrap().assign(size("9x6"), &[]).unwrap();
        assigned.corners.iter().map(|c| (c.index, c.px)).collect()
    };
    let plain = by_index(Gray::U8(picture.clone()));
    // Twelve bits within sixteen.
    let deep = by_index(Gray::U16(picture.map(|v| 300 + 16 * u16::from(v))));
    let (w, h) = (picture.width(), picture.height());
    let turned = by_index(Gray::U8(Plane::from_fn(h, w, |x, y| picture.at(y, h - 1 - x))));
    assert_eq!((plain.len(), deep.len(), turned.len()), (54, 54, 54));
    for (index, px) in &plain {
        assert!((deep[index] - px).norm() < 1e-3, "{index}");
        let back = Vector2::new(turned[index].y, h as f64 - 1.0 - turned[index].x);
        assert!((back - px).norm() < 5e-3, "{index}: {back} {px}");
    }
}

#[test]
fn ablations_are_less_exact() {
    let scene = scene("noise=5");
    let picture = Gray::U8(synth::render(&scene, 1).unwrap());
    let error = |text: &str, presmooth_px: f64| {
        let options = Options { refinement: text.parse().unwrap(), presmooth_px };
        let assigned = detect(&picture, &options).grid.unwrap().assign(size("9x6"), &[]).unwrap();
        rms(&errors(&scene, 1, &assigned))
    };
    let [strip, adaptive, seven, off] = ["strip", "gradient", "gradient7", "off"].map(|t| error(t, 0.0));
    println!("strip {strip:.4} gradient {adaptive:.4} gradient7 {seven:.4} off {off:.3}");
    assert!(strip < 0.5 * adaptive && strip < 0.5 * seven && adaptive < off && seven < off && off > 0.2);
    assert!(error("strip", 0.5) < 0.05);
}

#[test]
fn the_words_of_refinement() {
    for text in ["strip", "gradient", "gradient11", "off"] {
        assert_eq!(text.parse::<Refinement>().unwrap().to_string(), text);
    }
    for text in ["", "gradient0", "gradient100", "subpix", "gradient-3"] {
        assert!(text.parse::<Refinement>().is_err(), "{text}");
    }
}

#[test]
fn pictures_of_any_shape_are_searched() {
    for (width, height) in [
        (0, 0),
        (1, 1),
        (1, 20_000),
        (20_000, 1),
        (2, 800_000),
        (1_500_000, 1),
        (3, 500_000),
        (700_000, 7),
        (30, 30),
    ] {
        let striped = Plane::from_fn(width, height, |x, y| if (x / 9 + y / 9) % 2 == 0 { 20 } else { 220 });
        for presmooth_px in [0.0, 1.0] {
            let options = Options { presmooth_px, ..Options::default() };
            let found = detect(&Gray::U8(striped.clone()), &options);
            assert!(found.grid.is_none() && !found.why.is_empty(), "{width}x{height}");
        }
    }
}

#[test]
fn of_two_boards_the_larger_is_taken_and_the_other_is_told() {
    let large = scene("noise=2");
    let mut small = large.clone();
    small.board.size = size("7x5");
    let [left, right] = [&large, &small].map(|s| Renderer::new(s).unwrap().render(0).unwrap());
    assert!(!find(left.clone()).passed_over);
    let (w, h) = (left.width(), left.height());
    let beside = |a: &Plane<u8>, b: &Plane<u8>| {
        let rows = (0..h).flat_map(|y| [a, b].map(|p| p.data()[y * w..(y + 1) * w].to_vec()).concat());
        find(Plane::from_vec(2 * w, h, rows.collect()).unwrap())
    };
    for found in [beside(&left, &right), beside(&right, &left)] {
        let grid = found.grid.unwrap();
        assert_eq!((grid.size, grid.corners.len(), found.passed_over), ([9, 6], 54, true));
    }
}

/// Squares with a dot on the radon checkerboard of OpenCV's `gen_pattern.py` (15 x 10 squares), by their first corner.
const RADON: [[u32; 2]; 3] = [[6, 3], [6, 4], [7, 4]];

/// Boards of OpenCV's radon kind, whole and in part, either way round.
fn radon(board: &str) -> Scene {
    let mut scene = scene("blur=0.7,noise=3");
    scene.board.size = size(board);
    let [[x0, x1], [y0, y1]] = scene.board.extent_squares();
    let half = [x1 - x0 - 1.0, y1 - y0 - 1.0].map(|squares| 0.5 * squares * scene.board.square);
    let pose = |[x, y, z]: [f64; 3], [tilt, turn, roll]: [f64; 3]| {
        let turned = Pose::from_euler_deg([tilt, turn, roll], Vector3::zeros());
        let place = Vector3::new(x, y, z) - turned.rotation * Vector3::new(half[0], half[1], 0.0);
        let angles_deg = [tilt, turn, roll];
        synth::ScenePose { angles_deg, translation: place.into(), description: String::new() }
    };
    scene.poses = [0.0, 180.0]
        .into_iter()
        .flat_map(|roll| {
            let whole =
                [pose([0.0, 0.0, 850.0], [10.0, -15.0, roll]), pose([0.0, 10.0, 900.0], [-20.0, 5.0, roll])];
            let part = [
                pose([0.0, 0.0, 380.0], [5.0, 10.0, roll]),
                pose([60.0, 30.0, 420.0], [-15.0, 10.0, roll + 20.0]),
                pose([-50.0, 20.0, 400.0], [15.0, -10.0, roll - 80.0]),
            ];
            whole.into_iter().chain(part)
        })
        .collect();
    scene
}

fn dotted(scene: &Scene, view: usize) -> Plane<u8> {
    const PARTS: i32 = 4;
    let light = Renderer::new(scene).unwrap().light(view).unwrap();
    let at = crate::screen::tests::places(scene, view);
    let (w, h) = (light.width(), light.height());
    let sum = f32::from(scene.board.levels.black) + f32::from(scene.board.levels.white);
    let light = Plane::from_fn(w, h, |x, y| {
        let [p, across, down] = [at.at(x, y), at.at((x + 1).min(w - 1), y), at.at(x, (y + 1).min(h - 1))];
        let mut covered = 0;
        for i in 0..PARTS * PARTS {
            let [u, v] = [i % PARTS, i / PARTS].map(|k| (k as f32 + 0.5) / PARTS as f32 - 0.5);
            let [a, b] = [0, 1].map(|k| p[k] + (across[k] - p[k]) * u + (down[k] - p[k]) * v);
            let is_in = |[c, r]: &[u32; 2]| (a - *c as f32 - 0.5).hypot(b - *r as f32 - 0.5) < 0.17;
            covered += i32::from(RADON.iter().any(is_in));
        }
        let share = covered as f32 / (PARTS * PARTS) as f32;
        light.at(x, y) * (1.0 - share) + (sum - light.at(x, y)) * share
    });
    scene.degrade.apply(light, scene, view).unwrap()
}

#[test]
fn dots_tell_which_part_of_a_board_is_seen() {
    for board in ["14x9", "14x8"] {
        let scene = radon(board);
        let b = size(board);
        let grids: Vec<Grid> =
            (0..scene.poses.len()).map(|view| find(dotted(&scene, view)).grid.unwrap()).collect();
        let dots = dots_of(&grids.iter().collect::<Vec<_>>(), b);
        // Columns + rows of 14x8 are even: it has two orders, of which the other has the first list.
        let turned = board == "14x8";
        assert_eq!(dots, if turned { vec![[5, 2], [6, 2], [6, 3]] } else { RADON.to_vec() });
        let (mut whole, mut parts) = (0, 0);
        for (view, grid) in grids.iter().enumerate() {
            let mut found = grid.assign(b, &dots).unwrap_or_else(|why| panic!("{board} view {view}: {why}"));
            assert!(!found.order_is_a_choice, "{board} view {view}");
            if turned {
                found.corners.iter_mut().for_each(|c| c.index = b.len() as u32 - 1 - c.index);
            }
            assert!(errors(&scene, view, &found).iter().all(|e| *e < 0.3), "{board} view {view}");
            whole += usize::from(found.full);
            parts += usize::from(!found.full && grid.assign(b, &[]).is_err());
        }
        assert!(whole == 4 && parts >= 4, "{board}: {whole} whole, {parts} parts that only the dots place");
    }
}
