//! Real photographs: the sets of OpenCV, and pictures without circles.

use std::path::PathBuf;

use nalgebra::Vector2;

use crate::{
    circles::{CircleBoard, Detection, Kind, bias::radius_of, board_of, detect},
    image::{Gray, Plane},
    target::BoardSize,
};
use crate::job::photo::{self, Colours};

/// The folder of photographs; a printed line and `None` where it is absent.
fn data(set: &str) -> Option<PathBuf> {
    let root = std::env::var_os("STRAIGHTEDGE_DATA")
        .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared/data"), PathBuf::from);
    let folder = root.join(set);
    if folder.is_dir() {
        return Some(folder);
    }
    println!("skipped: no photographs in {} (set STRAIGHTEDGE_DATA)", folder.display());
    None
}

fn pictures(set: &str) -> Vec<(String, Gray)> {
    let Some(folder) = data(set) else { return Vec::new() };
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder)
        .unwrap()
        .map(|e| e.unwrap().path())
        .filter(|p| p.extension().is_some_and(|e| e == "png" || e == "jpg"))
        .collect();
    files.sort();
    let name = |p: &PathBuf| p.file_name().unwrap().to_string_lossy().into_owned();
    files.iter().map(|p| (name(p), photo::read(p, Colours::Gray).unwrap().photo.into_gray())).collect()
}

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

fn cpu_ms() -> f64 {
    let now = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    now.tv_sec as f64 * 1e3 + now.tv_nsec as f64 / 1e6
}

/// CPU time of the sets of circles, to be set beside OpenCV's in the same minute; alone, in a release build.
#[test]
#[ignore = "a measurement"]
fn speed() {
    for set in ["opencv_circles", "opencv_acircles", "negatives", "opencv_left"] {
        let all = pictures(set);
        let mut best = f64::MAX;
        for _ in 0..5 {
            let start = cpu_ms();
            for (_, picture) in &all {
                std::hint::black_box(detect(picture));
            }
            best = best.min(cpu_ms() - start);
        }
        println!("{set}: {:.2} ms a picture", best / all.len().max(1) as f64);
    }
    // 24 MP: dots of 6 px in a corner of it, and rough texture without any.
    let dots = Plane::from_fn(6000, 4000, |x, y| {
        let off = (x as f64 % 14.0 - 7.0).hypot(y as f64 % 14.0 - 7.0);
        if x < 140 && y < 98 { (220.0 - 190.0 * (3.5 - off).clamp(0.0, 1.0)) as u8 } else { 220 }
    });
    let texture = Plane::from_fn(6000, 4000, |x, y| ((x * 7919 + y * 104_729 + x * y) % 251) as u8);
    for (name, picture) in [("dots", dots), ("texture", texture)] {
        let (picture, start) = (Gray::U8(picture), cpu_ms());
        let found = detect(&picture);
        println!("24 MP: {} {:.0} ms", say(name, &found), cpu_ms() - start);
    }
}
