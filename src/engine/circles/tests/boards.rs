//! Whole and partial boards of both kinds and polarities, among clutter, through wide lenses; what is no board.

use std::collections::BTreeMap;

use nalgebra::{Point2, Vector2, Vector3};

use super::{accuracy::shot, render::Shot};
use crate::{
    camera::{Camera, Model},
    circles::{Assigned, CircleBoard, Kind, bias, board_of, detect},
    image::{Gray, Plane},
    pose::Pose,
    target::BoardSize,
};

fn board(kind: Kind, cols: u32, rows: u32) -> CircleBoard {
    CircleBoard { kind, size: BoardSize { cols, rows } }
}

/// A board seen with its middle at a place of the camera's frame, in spacings.
fn view(board: CircleBoard, euler_deg: [f64; 3], middle: [f64; 3]) -> Shot {
    let pose = Pose::from_euler_deg(euler_deg, Vector3::zeros());
    let [w, h] = board.extent().map(|v| f64::from(v - 1) / 2.0);
    let camera_from_board =
        Pose { translation: Vector3::from(middle) - pose.rotation * Vector3::new(w, h, 0.0), ..pose };
    Shot { board, camera_from_board, radius: 0.28 * board.pitch(), noise: 2.0, ..shot([0.0; 3], 9.0) }
}

/// Whether each place is where a circle of this index, in one of the board's orders, is.
fn right(shot: &Shot, found: &Assigned) -> bool {
    let (truth, points) = (shot.centers(), shot.board.points(1.0));
    let shift = |i: usize| bias::offset(&shot.camera, &shot.camera_from_board, &points[i].xy(), shot.radius);
    let measured = |i: u32| truth[i as usize] + shift(i as usize).unwrap_or_default();
    let [w, h] = shot.board.extent();
    let orders = (0..4).map(|turns| {
        let turned = |[x, y]: [i32; 2]| match turns {
            0 => [x, y],
            1 => [h - 1 - y, x],
            2 => [w - 1 - x, h - 1 - y],
            _ => [y, w - 1 - x],
        };
        found.corners.iter().all(|c| {
            shot.board
                .at(turned(shot.board.place(c.index)))
                .is_some_and(|i| (measured(i) - c.px).norm() < 0.3)
        })
    });
    let rights: Vec<bool> = orders.collect();
    // The plain order is right unless the order is a choice.
    rights[0] || (found.order_is_a_choice && rights.contains(&true))
}

#[test]
fn whole_boards_of_both_kinds_and_polarities() {
    for (b, middle) in [
        (board(Kind::Symmetric, 7, 5), 9.0),
        (board(Kind::Symmetric, 5, 5), 8.0),
        (board(Kind::Symmetric, 4, 3), 6.0),
        (board(Kind::Asymmetric, 4, 11), 13.0),
        (board(Kind::Asymmetric, 4, 10), 13.0),
        (board(Kind::Asymmetric, 3, 5), 7.0),
        (board(Kind::Asymmetric, 7, 6), 16.0),
    ] {
        for levels in [[30.0, 200.0], [220.0, 60.0]] {
            for euler in [
                [0.0, 0.0, 0.0],
                [0.0, 0.0, 45.0],
                [50.0, 10.0, 80.0],
                [-20.0, 55.0, -130.0],
                [10.0, -35.0, 180.0],
            ] {
                let s = Shot { levels, clutter: 12, ..view(b, euler, [0.2, -0.1, middle]) };
                let found = detect(&s.picture());
                let grid = found.grid.unwrap_or_else(|| panic!("{b} {levels:?} {euler:?}: {}", found.why));
                assert_eq!(grid.dark, levels[0] < levels[1]);
                let got = grid.assign(b).unwrap_or_else(|e| panic!("{b} {levels:?} {euler:?}: {e}"));
                assert!(
                    got.full && right(&s, &got),
                    "{b} {levels:?} {euler:?}: {} of {}",
                    got.corners.len(),
                    b.len()
                );
                assert_eq!(got.order_is_a_choice, b.rotations() > 1, "{b}");
                let choice = board_of(&[&grid]).unwrap();
                assert_eq!(
                    (choice.board, choice.seen_whole, choice.doubts.as_str()),
                    (b, 1, ""),
                    "{euler:?}"
                );
                let radius = bias::radius_of(&[&grid], b).unwrap() / s.radius;
                assert!((radius - 1.0).abs() < 0.03, "{b} {levels:?} {euler:?}: {radius}");
            }
        }
    }
}

#[test]
fn parts_have_the_right_indices_or_none() {
    let (mut used, mut all) = (0, 0);
    for b in [board(Kind::Symmetric, 9, 6), board(Kind::Asymmetric, 4, 11)] {
        for euler in [[10.0, 0.0, 0.0], [0.0, 25.0, 90.0], [-25.0, 20.0, 200.0]] {
            for shift in [[4.0, 0.0], [-4.0, 1.0], [0.0, 4.0], [1.0, -4.0], [5.0, 4.0], [-4.0, -3.0]] {
                let s = view(b, euler, [shift[0], shift[1], 9.0]);
                let Some(grid) = detect(&s.picture()).grid else { continue };
                all += 1;
                if let Ok(got) = grid.assign(b) {
                    assert!(right(&s, &got), "{b} {euler:?} {shift:?}");
                    used += usize::from(!got.full);
                }
            }
        }
    }
    println!("{used} of {all} parts used");
    assert!(used >= 8 && all >= 24, "{used} {all}");
}

#[test]
fn missing_dots_are_missing_and_shift_nothing() {
    for b in [board(Kind::Symmetric, 8, 6), board(Kind::Asymmetric, 5, 9)] {
        for missing in [vec![11, 12, 20], vec![0, 5, 30], vec![1, 17, 18, 19, 40]] {
            let n = missing.len();
            let s = Shot { missing, ..view(b, [20.0, -25.0, 15.0], [0.0, 0.0, 12.0]) };
            let grid = detect(&s.picture()).grid.unwrap();
            assert_eq!(grid.dots.len() + n, b.len(), "{b}");
            if let Ok(got) = grid.assign(b) {
                assert!(!got.full && right(&s, &got), "{b}");
            }
        }
    }
}

#[test]
fn a_lens_that_bends_like_a_fisheye() {
    // Equidistant up to 58° from the axis; it folds at 60°.
    let camera = Camera::new(
        Model::Brown5,
        [800, 800],
        vec![330.0, 330.0, 400.0, 400.0, -0.33, 0.135, 0.0, 0.0, -0.0205],
    )
    .unwrap();
    for b in [board(Kind::Symmetric, 11, 9), board(Kind::Asymmetric, 6, 13)] {
        for (euler, distance) in
            [([0.0, 0.0, 0.0], 5.3), ([25.0, 10.0, 30.0], 8.5), ([0.0, -35.0, 90.0], 9.5)]
        {
            let s = Shot { camera: camera.clone(), ..view(b, euler, [0.0, 0.0, distance]) };
            let grid = detect(&s.picture()).grid.unwrap();
            let got = grid.assign(b).unwrap();
            println!("{b} {euler:?}: {} of {}", got.corners.len(), b.len());
            assert!(right(&s, &got) && got.full, "{b} {euler:?}");
        }
    }
}

#[test]
fn dots_of_any_size_are_found() {
    for (size, f, distance, radius) in [
        ([640, 480], 400.0, 40.0, 0.3),
        ([640, 480], 400.0, 48.0, 0.3),
        ([1600, 1200], 1000.0, 4.6, 0.36),
        ([2400, 1800], 1500.0, 100.0, 0.25),
    ] {
        let params = vec![f, f, f64::from(size[0]) / 2.0, f64::from(size[1]) / 2.0];
        let camera = Camera::new(Model::Pinhole, size, params).unwrap();
        let b = board(Kind::Symmetric, 5, 4);
        let s = Shot { camera, radius, ..view(b, [10.0, 15.0, 5.0], [0.0, 0.0, distance]) };
        let found = detect(&s.picture());
        let diameter = 2.0 * radius * f / distance;
        let grid = found.grid.unwrap_or_else(|| panic!("{diameter:.1} px: {}", found.why));
        let got = grid.assign(b).unwrap();
        assert!(got.full && right(&s, &got), "{diameter:.1} px");
        println!("{diameter:.1} px across: sigma {:.4} px", got.corners[7].sigma_px);
    }
}

#[test]
fn depth_and_rotation_do_not_matter() {
    let s = view(board(Kind::Asymmetric, 4, 7), [20.0, 30.0, 10.0], [0.0, 0.0, 10.0]);
    let Gray::U8(p) = s.picture() else { panic!() };
    let places = |picture: &Gray| -> BTreeMap<u32, Vector2<f64>> {
        detect(picture)
            .grid
            .unwrap()
            .assign(s.board)
            .unwrap()
            .corners
            .iter()
            .map(|c| (c.index, c.px))
            .collect()
    };
    let plain = places(&Gray::U8(p.clone()));
    let deep = places(&Gray::U16(p.map(|v| 300 + 16 * u16::from(v))));
    let (w, h) = (p.width(), p.height());
    let turned = places(&Gray::U8(Plane::from_fn(h, w, |x, y| p.at(y, h - 1 - x))));
    assert_eq!((plain.len(), deep.len(), turned.len()), (28, 28, 28));
    for (i, px) in &plain {
        let back = Vector2::new(turned[i].y, h as f64 - 1.0 - turned[i].x);
        assert!((deep[i] - px).norm() < 2e-3 && (back - px).norm() < 5e-3, "{i}: {} {back} {px}", deep[i]);
    }
}

#[test]
fn a_mirrored_asymmetric_board_is_refused() {
    let s = view(board(Kind::Asymmetric, 4, 11), [0.0, 0.0, 0.0], [0.0, 0.0, 13.0]);
    let Gray::U8(p) = s.picture() else { panic!() };
    let w = p.width();
    let grid = detect(&Gray::U8(Plane::from_fn(w, p.height(), |x, y| p.at(w - 1 - x, y)))).grid.unwrap();
    // Its mirror image is the same board turned by half a turn: no picture can tell.
    let got = grid.assign(s.board).unwrap();
    assert!(got.full);
    assert!(grid.assign(board(Kind::Asymmetric, 4, 9)).is_err());
    let why = grid.assign(board(Kind::Symmetric, 7, 7)).unwrap_err();
    assert!(why.contains("asymmetric 4x11"), "{why}");
}

#[test]
fn what_is_no_board_of_circles() {
    let of = |inside: fn(f64, f64) -> bool| {
        Plane::from_fn(480, 360, move |x, y| {
            // Area-sampled, so that shapes are as round as they can be.
            let share = (0..16).filter(|k| {
                let (x, y) = (x as f64 + f64::from(k % 4) / 4.0, y as f64 + f64::from(k / 4) / 4.0);
                inside(x, y)
            });
            (220 - 12 * share.count()) as u8
        })
    };
    let pictures: [(&str, Plane<u8>); 6] = [
        ("squares", of(|x, y| (x % 30.0 - 15.0).abs() < 7.0 && (y % 30.0 - 15.0).abs() < 7.0)),
        ("small squares", of(|x, y| (x % 16.0 - 8.0).abs() < 3.5 && (y % 16.0 - 8.0).abs() < 3.5)),
        ("diamonds", of(|x, y| (x % 30.0 - 15.0).abs() + (y % 30.0 - 15.0).abs() < 9.0)),
        ("checkerboard", of(|x, y| (x % 40.0 < 20.0) == (y % 40.0 < 20.0))),
        (
            "hexagonal dots",
            of(|x, y| {
                let row = (y / 26.0).floor();
                ((x + 15.0 * (row % 2.0)) % 30.0 - 15.0).hypot(y % 26.0 - 13.0) < 8.0
            }),
        ),
        ("ellipses", of(|x, y| ((x % 30.0 - 15.0) / 10.0).hypot((y % 30.0 - 15.0) / 5.0) < 1.0)),
    ];
    for (name, picture) in pictures {
        let found = detect(&Gray::U8(picture));
        println!("{name}: {}", found.why);
        assert!(found.grid.is_none() && !found.why.is_empty(), "{name}: {found:?}");
    }
}

#[test]
fn pictures_of_any_shape_are_searched() {
    for (w, h) in [(0, 0), (1, 1), (1, 20_000), (20_000, 1), (3, 300_000), (700_000, 7), (30, 30)] {
        let picture = Plane::from_fn(w, h, |x, y| if (x / 5 + y / 5) % 2 == 0 { 20 } else { 220 });
        let found = detect(&Gray::U8(picture.clone()));
        assert!(found.grid.is_none() && !found.why.is_empty(), "{w}x{h}");
        assert!(detect(&Gray::U16(picture.map(u16::from))).grid.is_none());
    }
}

#[test]
fn corrected_observations_are_the_projected_centres() {
    use crate::observation::{FrameId, Observation};
    let s = Shot { noise: 0.0, ..view(board(Kind::Asymmetric, 4, 9), [0.0, -50.0, 20.0], [0.5, 0.0, 9.0]) };
    let got = detect(&s.picture()).grid.unwrap().assign(s.board).unwrap();
    let seen = [Observation { camera: 0, frame: FrameId(0), corners: got.corners }];
    let (cameras, points) = ([s.camera.clone()], s.board.points(1.0));
    let fixed = bias::corrected(&seen, &cameras, &[s.camera_from_board], &points, s.radius);
    let truth = s.centers();
    let rms = |o: &Observation| {
        let sum: f64 = o.corners.iter().map(|c| (c.px - truth[c.index as usize]).norm_squared()).sum();
        (sum / o.corners.len() as f64).sqrt()
    };
    println!("uncorrected {:.3}, corrected {:.4} px", rms(&seen[0]), rms(&fixed[0]));
    assert!(rms(&seen[0]) > 0.05 && rms(&fixed[0]) < 0.01);
    // Without pose nothing changes.
    assert_eq!(bias::corrected(&seen, &cameras, &[], &points, s.radius), seen);
    assert!(
        bias::offset(&s.camera, &s.camera_from_board, &Point2::new(0.0, 0.0), 0.0)
            .is_none_or(|d| d.norm() < 1e-9)
    );
}
