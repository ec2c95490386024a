//! Lenses and boards of all kinds on photographs, without any hint; skipped where they are not there.

use std::process::Command;

use serde_json::Value;

use crate::detection::data;

/// What `calibrate --model auto` says of a set; `None` where it is absent.
fn calibrated(set: &str) -> Option<Value> {
    let folder = data(set)?;
    let output = Command::new(env!("CARGO_BIN_EXE_straightedge"))
        .arg("calibrate")
        .arg(folder)
        .args(["--model", "auto", "--json"])
        .output()
        .unwrap();
    Some(serde_json::from_slice(&output.stdout).unwrap())
}

fn used(report: &Value) -> usize {
    report["frames"].as_array().unwrap().iter().filter(|f| f["included"] == true).count()
}

#[test]
fn a_fisheye_beyond_180_degrees_needs_no_hint() {
    let Some(report) = calibrated("camodocal_fisheye") else { return };
    assert_eq!(report["model"], "kb4", "{} {}", report["error"], report["models"]);
    let rms = report["rms_px"].as_f64().unwrap();
    assert!(rms <= 0.55 && used(&report) == 11, "{rms}");
}

#[test]
fn an_aprilgrid_before_a_fisheye_needs_no_hint() {
    let Some(report) = calibrated("aprilgrid_tumvi_euroc") else { return };
    assert_eq!(report["model"], "kb4", "{}", report["error"]);
    assert_eq!(report["settings"]["target"]["board"]["kind"], "april_grid");
    let rms = report["rms_px"].as_f64().unwrap();
    assert!(rms <= 0.2 && used(&report) == 3, "{rms}");
}

#[test]
fn a_charuco_board_is_used_in_parts() {
    let Some(report) = calibrated("caliscope_charuco") else { return };
    assert_eq!(report["settings"]["target"]["board"]["kind"], "charuco", "{}", report["error"]);
    let found = report["frames"].as_array().unwrap().iter().filter(|f| f["found"] == true).count();
    // OpenCV finds corners in 15 pictures, 4 or more of them in 14.
    assert!(found >= 15, "{found}");
}

#[test]
fn circles_are_calibrated() {
    for (set, pictures) in [("opencv_circles", 13), ("opencv_acircles", 3)] {
        let Some(report) = calibrated(set) else { return };
        assert_eq!(report["settings"]["target"]["kind"], "circles", "{set}: {}", report["error"]);
        assert_eq!(used(&report), pictures, "{set}");
    }
}

#[test]
fn ordinary_lenses_stay_ordinary() {
    let Some(report) = calibrated("opencv_left") else { return };
    let terms = report["distortion"].as_object().unwrap().len();
    assert!(terms <= 5 && used(&report) == 13, "{}", report["model"]);
    // One that errs by several times as much in new pictures is not what is recommended.
    assert!(report["model"] != "pinhole" && report["models"]["recommended"] == report["model"]);
}
