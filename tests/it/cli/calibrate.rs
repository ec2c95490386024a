//! `calibrate` and `detect` on good pictures.

use std::fs;

use serde_json::Value;
use straightedge::calib::{format, report::Report};

use super::{frame, json, photos, run, scene, stderr};

#[test]
fn a_folder_becomes_a_camera_with_its_evidence() {
    let scene = scene();
    let folder = photos(&scene);
    let at = folder.path();
    let args = ["calibrate", ".", "--board", "9x6", "--square", "30mm", "--truth", "truth.json", "--json"];
    let r = json(at, &args, 0);
    assert_eq!((&r["image_size_px"], &r["model"]), (&serde_json::json!([400, 300]), &"brown5".into()));
    assert_eq!((&r["settings"]["board"], &r["settings"]["unit"]), (&"9x6".into(), &"mm".into()));
    assert!(r["rms_px"].as_f64().unwrap() < 0.02, "{}", r["rms_px"]);
    let ratio = r["rms_px"].as_f64().unwrap() / r["rms_per_coordinate_px"].as_f64().unwrap();
    assert!((ratio - 2f64.sqrt()).abs() < 1e-12);
    for (name, unit) in [("fx", 1.0), ("fy", 1.0), ("cx", 1.0), ("cy", 1.0), ("k1", 0.02), ("p1", 2e-4)] {
        let t = &r["truth"][name];
        let field = |f: &str| t[f].as_f64().unwrap();
        assert!((field("estimate") - field("truth")).abs() < unit, "{name}: {t}");
        assert!((field("estimate") - field("truth")).abs() == field("absolute"));
        assert!(t["in_sigma"].is_number());
    }
    let sigma: Vec<&String> = r["sigma"].as_object().unwrap().keys().collect();
    assert_eq!(sigma, ["fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3"]);
    let covariance = r["covariance"].as_array().unwrap();
    for (i, name) in sigma.iter().enumerate() {
        let variance = covariance[i][i].as_f64().unwrap();
        assert!((variance.sqrt() / r["sigma"][*name].as_f64().unwrap() - 1.0).abs() < 1e-9);
    }
    assert_eq!(r["stats"]["n"], 8 * 54);
    assert!(r["iterations"].as_u64().unwrap() > 0 && r["termination"].is_string());
    assert!(r["starts"]["tried"].as_u64() >= r["starts"]["agreeing"].as_u64());
    for field in ["width_fraction", "height_fraction", "hull_fraction", "cells_fraction"] {
        assert!((0.2..=1.0).contains(&r["coverage"][field].as_f64().unwrap()), "{field}");
    }
    for field in ["read", "detect", "calibrate", "total"] {
        assert!(r["timing_ms"][field].as_f64().unwrap() > 0.0, "{field}");
    }
    assert!(r["truth_corners"]["max"].as_f64().unwrap() < 0.1);
    let truth = scene.truth();
    for t in &truth.frames {
        let f = frame(&r, &t.file);
        assert_eq!((&f["state"], &f["found"], &f["included"]), (&"full".into(), &true.into(), &true.into()));
        assert_eq!(f["corners"].as_array().unwrap().len(), 54);
        assert_eq!(f["residuals_px"].as_array().unwrap().len(), 54);
        let z = f["tvec"][2].as_f64().unwrap();
        assert!((z / t.pose.translation.z - 1.0).abs() < 1e-2, "{z} {}", t.pose.translation.z);
        assert!((f["tilt_rad"].as_f64().unwrap() - t.pose.tilt_rad()).abs() < 1e-2);
    }
}

#[test]
fn the_report_reads_back_to_the_same_bits() {
    let folder = photos(&scene());
    let at = folder.path();
    fs::write(at.join("old.json"), "an older file is overwritten").unwrap();
    let args = ["calibrate", ".", "--out", "old.json", "--out", "camera.yaml", "--out", "nowhere/c.txt"];
    let output = run(at, &args);
    // One file fails: it is named, and the others are written all the same.
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    assert!(
        stderr(&output).contains("nowhere") && stderr(&output).contains("make it first"),
        "{}",
        stderr(&output)
    );
    let text = fs::read_to_string(at.join("old.json")).unwrap();
    let report = Report::from_json(&text).unwrap();
    assert_eq!(report.to_json(), text);
    let camera = &report.solution.as_ref().unwrap().camera;
    let [ours, opencv] = ["old.json", "camera.yaml"]
        .map(|f| format::read(&fs::read_to_string(at.join(f)).unwrap(), f).unwrap());
    assert_eq!((&ours.camera, &opencv.camera), (camera, camera));
    assert_eq!(ours.evidence.frames.len(), 8);
    assert_eq!(ours.evidence.sigma.len(), 9);
    assert!(ours.evidence.covariance.is_some() && ours.evidence.rms_px.is_some());
    // Nothing is left behind.
    let left = fs::read_dir(at)
        .unwrap()
        .filter(|f| f.as_ref().unwrap().path().extension().is_some_and(|e| e == "part"));
    assert_eq!(left.count(), 0);
    // A broken report says which field is wrong, rather than being half a report.
    let broken = text.replacen("\"rms_px\": ", "\"rms_px\": \"x\", \"_\": ", 1);
    assert!(Report::from_json(&broken).unwrap_err().to_string().contains("invalid type"));
}

/// The report without what the clock says.
fn timeless(mut report: Value) -> Value {
    report.as_object_mut().unwrap().remove("timing_ms");
    report
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let folder = photos(&scene());
    let with = |n: &str| timeless(json(folder.path(), &["calibrate", ".", "--json", "--threads", n], 0));
    let one = with("1");
    assert_eq!(one, with("2"));
    assert_eq!(one, with("5"));
}

#[test]
fn corners_from_a_file_give_the_camera_of_the_pictures() {
    let folder = photos(&scene());
    let at = folder.path();
    let detected = run(at, &["detect", ".", "--square", "30mm", "--json"]);
    fs::write(at.join("corners.json"), detected.stdout).unwrap();
    let direct = json(at, &["calibrate", ".", "--square", "30mm", "--json"], 0);
    let again = json(at, &["calibrate", "--corners", "corners.json", "--json"], 0);
    for field in ["camera_matrix", "distortion", "sigma", "rms_px", "covariance"] {
        assert_eq!(direct[field], again[field], "{field}");
    }
    assert_eq!((&again["settings"]["board"], &again["settings"]["unit"]), (&"9x6".into(), &"mm".into()));
    // The truth file of a scene holds corners, too: exact ones.
    let exact = json(at, &["calibrate", "--corners", "truth.json", "--truth", "truth.json", "--json"], 0);
    for (name, t) in exact["truth"].as_object().unwrap() {
        let bound = 1e-9 * t["truth"].as_f64().unwrap().abs().max(1.0);
        assert!(t["absolute"].as_f64().unwrap() <= bound, "{name}: {t}");
    }
    // Without sizes the pictures are looked at.
    let mut bare: Value = serde_json::from_slice(&fs::read(at.join("corners.json")).unwrap()).unwrap();
    for f in bare["frames"].as_array_mut().unwrap() {
        f.as_object_mut().unwrap().remove("image_size_px");
    }
    fs::write(at.join("bare.json"), bare.to_string()).unwrap();
    let looked = json(at, &["calibrate", "--corners", "bare.json", "--json"], 0);
    assert_eq!(direct["camera_matrix"], looked["camera_matrix"]);
}

#[test]
fn options_reach_the_solver() {
    let folder = photos(&scene());
    let at = folder.path();
    let r = json(
        at,
        &["calibrate", ".", "--fix", "fx=fy,k3,cx", "--loss", "linear", "--weights", "none", "--json"],
        0,
    );
    assert_eq!(r["camera_matrix"]["fx"], r["camera_matrix"]["fy"]);
    assert_eq!((&r["sigma"]["k3"], &r["distortion"]["k3"]), (&Value::Null, &0.0.into()));
    assert_eq!((&r["camera_matrix"]["cx"], &r["settings"]["loss"]), (&199.5.into(), &"linear".into()));
    assert_eq!(r["settings"]["fixed"], serde_json::json!(["fx=fy", "k3", "cx"]));
    let r = json(at, &["calibrate", ".", "--model", "auto", "--json"], 0);
    assert!(r["model"] != "pinhole" && r["model"] == r["models"]["recommended"], "{}", r["models"]);
    let mut pinhole = scene();
    pinhole.camera.params[4..].fill(0.0);
    let r = json(photos(&pinhole).path(), &["calibrate", ".", "--model", "auto", "--json"], 0);
    assert!(
        r["model"] == "pinhole" || r["distortion"]["k1"].as_f64().unwrap().abs() < 0.01,
        "{}",
        r["model"]
    );
    // A start camera holds values.
    let start = at.join("start.yaml");
    let made = run(at, &["calibrate", ".", "--model", "pinhole", "--out", start.to_str().unwrap()]);
    assert!(made.status.success(), "{}", stderr(&made));
    let r = json(at, &["calibrate", ".", "--start", "start.yaml", "--fix", "fx,fy", "--json"], 0);
    assert_eq!(r["sigma"]["fx"], Value::Null);
    assert_eq!(r["settings"]["start"], "start.yaml");
}

#[test]
fn conditions_decide_the_exit_code() {
    let folder = photos(&scene());
    let at = folder.path();
    let with = |c: &str| run(at, &["calibrate", ".", "--fail-if", c]);
    assert_eq!(with("rms>0.5,images<3").status.code(), Some(0));
    let failed = with("rms>0.5,images<9");
    assert_eq!(failed.status.code(), Some(1));
    assert!(
        stderr(&failed).contains("images<9: the number of pictures that were used is 8"),
        "{}",
        stderr(&failed)
    );
    assert_eq!(with("rmss>0.5").status.code(), Some(2));
}

#[test]
fn without_a_display_one_line_names_the_commands() {
    let folder = tempfile::tempdir().unwrap();
    let output = std::process::Command::new(env!("CARGO_BIN_EXE_straightedge"))
        .current_dir(folder.path())
        .env_remove("DISPLAY")
        .env_remove("WAYLAND_DISPLAY")
        .output()
        .unwrap();
    let text = stderr(&output);
    assert_eq!(output.status.code(), Some(1), "{text}");
    assert_eq!(text.lines().count(), 1, "{text}");
    assert!(text.contains("no display") && text.contains("straightedge calibrate | detect"), "{text}");
}

#[test]
fn the_page_of_the_evidence_is_written() {
    let folder = photos(&scene());
    let output = run(folder.path(), &["calibrate", ".", "--report", "report.html"]);
    assert!(output.status.success(), "{}", stderr(&output));
    let page = fs::read_to_string(folder.path().join("report.html")).unwrap();
    assert!(page.starts_with("<!doctype html>") && page.contains("view_03.png"));
}

#[test]
fn advice_and_its_goal() {
    let folder = photos(&scene());
    let args = ["calibrate", ".", "--board", "9x6", "--square", "30mm", "--json", "--goal"];
    let with = |goal: &str| json(folder.path(), &[&args[..], &[goal]].concat(), 0)["advice"].clone();
    let enough = with("100px,centre");
    assert_eq!(
        (&enough["state"], &enough["pictures"], &enough["next"]),
        (&"enough".into(), &0.into(), &Value::Null)
    );
    let next = with("0.00001px");
    assert_eq!((&next["state"], &next["goal"]), (&"next".into(), &"0.00001px".into()));
    assert!(next["sentence"].as_str().unwrap().contains("of the picture, "), "{next}");
    let px = |of: &str| next[of]["center_px"].as_f64().unwrap();
    assert!(px("before") > 0.0 && px("after") > 0.0 && next["next"]["distance"].as_f64().unwrap() > 100.0);
    // 2 mm at 2 m with some 500 px of focal length; and nonsense is refused before any work.
    let task = with("2mm@2m");
    assert!((0.4..0.6).contains(&task["goal_px"].as_f64().unwrap()) && task["range"] == 2000.0, "{task}");
    let wrong = run(folder.path(), &["calibrate", ".", "--goal", "2mm"]);
    assert_eq!(wrong.status.code(), Some(2));
    assert!(stderr(&wrong).contains("baseline"), "{}", stderr(&wrong));
}

#[test]
fn a_capture_has_a_twin() {
    let folder = photos(&scene());
    let at = folder.path();
    let twin = json(at, &["twin", ".", "--board", "9x6", "--runs", "4", "--json"], 0);
    assert_eq!((&twin["runs"], &twin["failed"], &twin["pictures"]), (&4.into(), &0.into(), &8.into()));
    assert_eq!(twin["parameters"].as_array().unwrap().len(), 9);
    assert!(twin["found_fraction"].as_f64().unwrap() > 0.99);
    // Of a calibration as of its pictures.
    let told = run(at, &["calibrate", ".", "--board", "9x6", "--out", "camera.json"]);
    assert_eq!(told.status.code(), Some(0), "{}", stderr(&told));
    assert_eq!(json(at, &["twin", "camera.json", "--runs", "4", "--json"], 0)["places"], twin["places"]);
    fs::write(at.join("other.json"), "{}").unwrap();
    let wrong = run(at, &["twin", "other.json"]);
    assert_eq!(wrong.status.code(), Some(2));
    assert!(stderr(&wrong).contains("straightedge calibrate"), "{}", stderr(&wrong));
}
