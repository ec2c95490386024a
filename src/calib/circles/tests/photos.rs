//! Real photographs: the sets of OpenCV, and pictures without circles.

use std::path::PathBuf;

use crate::calib::{
    circles::{detect, Detection},
    image::Gray,
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
        Some(g) => format!("{name}: {:?} {} dots, radius {:.2}, {} blanks", g.size, g.dots.len(), g.radius, g.blanks.len()),
        None => format!("{name}: {}", found.why),
    }
}

#[test]
fn show() {
    for set in ["opencv_circles", "opencv_acircles", "negatives", "opencv_left", "udacity_lane", "caliscope_charuco", "aprilgrid_tumvi_euroc", "opencv_chess_misc", "misc_targets", "camodocal_fisheye", "plantcv_gopro", "learning_opencv_phone", "caliscope_chess"] {
        for (name, picture) in pictures(set) {
            let t = std::time::Instant::now();
            let found = detect(&picture);
            println!("{set}/{} {:.1} ms", say(&name, &found), t.elapsed().as_secs_f64() * 1e3);
        }
    }
}
