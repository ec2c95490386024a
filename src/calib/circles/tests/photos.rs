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

#[test]
fn debug() {
    use crate::calib::circles::{ellipse::{Start, fit}, spot::spots, lattice::Field};
    use crate::calib::detect::pyramid::noise;
    for (name, picture) in pictures("opencv_acircles").into_iter().chain(pictures("opencv_circles")) {
        if !["acircles2.png", "acircles4.png", "circles2.png", "circles1.png"].contains(&name.as_str()) { continue }
        let Gray::U8(p) = &picture else { continue };
        let n = noise(p);
        let s = spots(p, f64::from(2.5 * n).clamp(2.0, 40.0));
        let field = Field::new(s.clone(), [p.width(), p.height()]);
        let l = field.lattices(8);
        println!("{name} noise {n} spots {} lattices {:?}", s.len(), l.iter().map(|l| l.len()).collect::<Vec<_>>());
        if let Some(l) = l.first() {
            for (c, s) in l.iter().take(12) {
                let d = fit(p, &Start { px: s.px, ellipse: s.ellipse, reach: 2.0, blur_px: None });
                println!("  {c:?} {:?}\n     {:?}", s, d);
            }
        }
    }
}
