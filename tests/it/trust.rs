//! What is said about sets whose faults are known: photographs, some of them tampered with.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use image::{DynamicImage, ImageFormat, imageops::FilterType};
use straightedge::calib::{
    diagnose::{self, Finding, Level, sources::Sources},
    report::Report,
};

use crate::detection::data;

fn report(pictures: &[PathBuf]) -> Report {
    let output = Command::new(env!("CARGO_BIN_EXE_straightedge"))
        .args(["calibrate", "--json"])
        .args(pictures)
        .output()
        .unwrap();
    Report::from_json(&String::from_utf8(output.stdout).unwrap()).unwrap()
}

fn pictures(folder: &Path) -> Vec<PathBuf> {
    let mut list: Vec<PathBuf> = fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    list.retain(|p| p.extension().is_some_and(|e| e == "jpg" || e == "png"));
    list.sort();
    list
}

fn sources(report: &Report) -> &Sources {
    report.sources.as_ref().unwrap()
}

#[test]
fn three_frontal_pictures_are_not_trusted() {
    let Some(folder) = data("opencv_left") else { return };
    let three = ["left01.jpg", "left04.jpg", "left07.jpg"].map(|name| folder.join(name));
    let report = report(&three);
    let verdict = diagnose::verdict(&report);
    assert_eq!((verdict.level, verdict.rms_alone.as_str()), (Level::Bad, "excellent"), "{verdict:?}");
    assert!(verdict.sentence.contains("the focal length is only known to ±13 px"), "{}", verdict.sentence);
    // Diversity, or the flat board, is what it costs; it is no fault of anything.
    let first = &sources(&report).cards[0];
    assert!(["diversity", "degeneracy", "corners", "lens_model"].contains(&first.code.as_str()), "{first:?}");
    assert!(first.level == Level::Bad && first.px > 1.0, "{first:?}");
}

#[test]
fn an_untouched_set_is_not_blamed() {
    let Some(folder) = data("opencv_left") else { return };
    let report = report(&pictures(&folder));
    let sources = sources(&report);
    let outsiders = ["mirrored_picture", "foreign_picture", "zoomed_picture", "zoom_step", "focus_varies"];
    let found: Vec<_> = sources.faults.iter().filter(|f| f.found).collect();
    assert!(!found.iter().any(|f| outsiders.contains(&f.code.as_str())), "{found:?}");
    assert_eq!(sources.cards.len(), 7);
    assert!(sources.cards.windows(2).all(|pair| pair[0].px >= pair[1].px));
    let cross = sources.cross_validation.as_ref().unwrap();
    assert!(cross.poses == 13 && cross.halves_px < 3.0 * cross.halves_by_chance_px, "{cross:?}");
    assert!(cross.held_out_px < 1.2 * cross.fitted_px, "{cross:?}");
}

#[test]
fn pictures_that_do_not_belong_head_the_findings() {
    let (Some(left), Some(right)) = (data("opencv_left"), data("opencv_right")) else { return };
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let save =
        |picture: DynamicImage, name: &str| picture.save_with_format(at(name), ImageFormat::Png).unwrap();
    save(image::open(left.join("left05.jpg")).unwrap().fliph(), "mirrored.png");
    // The middle, enlarged by a quarter: a longer focal length.
    let picture = image::open(left.join("left02.jpg")).unwrap();
    let (w, h) = (picture.width(), picture.height());
    let large = picture.resize_exact(w * 5 / 4, h * 5 / 4, FilterType::CatmullRom);
    save(large.crop_imm(w / 8, h / 8, w, h), "zoomed.png");
    save(image::open(right.join("right06.jpg")).unwrap(), "foreign.png");
    for (name, titles) in [
        ("mirrored.png", &["is mirrored"][..]),
        ("zoomed.png", &["another zoom"]),
        ("foreign.png", &["from another camera", "does not belong", "another zoom", "pulls the camera away"]),
    ] {
        let mut list = pictures(&left);
        list.push(at(name));
        let report = report(&list);
        let findings: Vec<Finding> = diagnose::findings(&report);
        let first = &findings[0];
        let stem = name.split('.').next().unwrap();
        assert!(
            first.title.contains(stem) && titles.iter().any(|t| first.title.contains(t)),
            "{name}: {findings:#?}"
        );
        assert!(first.level >= Level::Warn, "{name}: {first:?}");
    }
}

#[test]
fn five_copies_of_each_picture_count_as_one() {
    let Some(folder) = data("opencv_left") else { return };
    let plain = report(&pictures(&folder));
    let copies = tempfile::tempdir().unwrap();
    let mut list = Vec::new();
    for picture in pictures(&folder) {
        let name = picture.file_stem().unwrap().to_str().unwrap().to_owned();
        let gray = image::open(&picture).unwrap().into_luma8();
        for quality in [95, 90, 85, 80, 75] {
            let path = copies.path().join(format!("{name}_{quality}.jpg"));
            let mut file = fs::File::create(&path).unwrap();
            let mut encoder = image::codecs::jpeg::JpegEncoder::new_with_quality(&mut file, quality);
            encoder.encode_image(&gray).unwrap();
            list.push(path);
        }
    }
    let many = report(&list);
    assert_eq!(many.included().count(), 65);
    assert_eq!(many.included().filter(|f| f.repeats.is_none()).count(), 13);
    let [plain, many] = [plain, many].map(|r| r.solution.unwrap());
    for (name, sigma) in plain.sigma.iter() {
        let ratio = many.sigma.get(name).copied().flatten().unwrap() / sigma.unwrap();
        println!("σ of {name}: {ratio:.3} of that of single pictures");
        assert!((0.85..1.15).contains(&ratio), "{name}: {ratio}");
    }
}

#[test]
fn a_bent_board_is_named() {
    let Some(folder) = data("udacity_lane") else { return };
    let report = report(&pictures(&folder));
    let found: Vec<_> = sources(&report).faults.iter().filter(|f| f.found).collect();
    assert!(found.iter().any(|f| f.code == "bowed_board"), "{found:#?}");
    assert!(diagnose::findings(&report).iter().any(|f| f.title.contains("board was not flat")));
}
