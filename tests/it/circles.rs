//! Circle grids in photographs: the sets of OpenCV, and pictures without circles; skipped where they are not there.

use nalgebra::Vector2;
use straightedge::calib::{
    circles::{CircleBoard, Detection, Kind, bias::radius_of, board_of, detect},
    target::BoardSize,
};

use crate::detection::{data, pictures};

fn say(name: &str, found: &Detection) -> String {
    match &found.grid {
        Some(g) => format!(
            "{name}: {:?} {} dots, radius {:.2}, {} blanks",
            g.size,
            g.dots.len(),
            g.radius,
            g.blanks.len()
        ),
        None => format!("{name}: {}", found.why),
    }
}

/// Places that OpenCV has for an asymmetric board: `[columns, rows]` and centres.
fn published(name: &str) -> ([u32; 2], Vec<Vector2<f64>>) {
    let file = name.replace("acircles", "acircles_corners").replace(".png", ".dat");
    let text = std::fs::read_to_string(data("opencv_acircles").unwrap().join(file)).unwrap();
    let number =
        |key: &str| text.split(key).nth(1).unwrap().split_whitespace().next().unwrap().parse().unwrap();
    let list = text.split('[').nth(1).unwrap().split(']').next().unwrap();
    let v: Vec<f64> = list.split(',').map(|v| v.trim().parse().unwrap()).collect();
    ([number("cols:"), number("rows:")], v.chunks(2).map(|c| Vector2::new(c[0], c[1])).collect())
}

#[test]
fn asymmetric_boards_are_found_as_opencv_has_them() {
    let mut grids = Vec::new();
    for (name, picture) in pictures("opencv_acircles") {
        let ([cols, rows], want) = published(&name);
        let found = detect(&picture);
        println!("{}", say(&name, &found));
        let board = CircleBoard { kind: Kind::Asymmetric, size: BoardSize { cols, rows } };
        let grid = found.grid.unwrap();
        let got = grid.assign(board).unwrap();
        // An odd number of rows has one order.
        assert!(got.full && !got.order_is_a_choice, "{name}");
        let off: Vec<f64> = got.corners.iter().map(|c| (c.px - want[c.index as usize]).norm()).collect();
        let mean = off.iter().sum::<f64>() / off.len() as f64;
        println!(
            "  from OpenCV's centres: mean {mean:.3}, largest {:.3} px",
            off.iter().fold(0.0f64, |m, v| m.max(*v))
        );
        assert!(off.iter().all(|d| *d < 0.6) && mean < 0.2, "{name}: {mean}");
        assert_eq!(board_of(&[&grid]).unwrap().board, board, "{name}");
        grids.push(grid);
    }
    if let Some(choice) = board_of(&grids.iter().collect::<Vec<_>>()) {
        println!("{choice:?}");
        assert!(choice.doubts.contains("other pictures"));
    }
}

#[test]
fn symmetric_boards_are_found_whole() {
    let mut grids = Vec::new();
    for (name, picture) in pictures("opencv_circles") {
        let found = detect(&picture);
        println!("{}", say(&name, &found));
        let grid = found.grid.unwrap();
        let board = CircleBoard { kind: Kind::Symmetric, size: BoardSize { cols: 7, rows: 7 } };
        let got = grid.assign(board).unwrap();
        assert!(got.full && got.order_is_a_choice, "{name}");
        grids.push(grid);
    }
    if let Some(choice) = board_of(&grids.iter().collect::<Vec<_>>()) {
        println!("{choice:?}");
        assert_eq!((choice.board.to_string().as_str(), choice.seen_whole), ("symmetric 7x7", 13));
        let radius = radius_of(&grids.iter().collect::<Vec<_>>(), choice.board).unwrap();
        assert!((radius - 0.225).abs() < 0.02, "{radius}");
    }
}

#[test]
fn what_is_no_grid_of_circles_is_refused_with_a_reason() {
    for set in [
        "negatives",
        "opencv_left",
        "opencv_right",
        "udacity_lane",
        "learning_opencv_phone",
        "caliscope_chess",
        "opencv_chess_misc",
        "plantcv_gopro",
        "camodocal_fisheye",
        "caliscope_charuco",
        "aprilgrid_tumvi_euroc",
        "misc_targets",
    ] {
        for (name, picture) in pictures(set) {
            let found = detect(&picture);
            println!("{set}/{}", say(&name, &found));
            assert!(found.grid.is_none() && !found.why.is_empty(), "{set}/{name}");
        }
    }
}
