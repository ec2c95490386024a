//! `calibrate --residual-map`, and the commands that apply what it found.

use std::{fs, path::Path};

use nalgebra::{Vector2, Vector3};
use serde_json::{Value, json};
use straightedge::calib::{
    format,
    report::Report,
    synth::{self, Scene, poses},
    undistort::{Framing, Interpolation, straighten},
};
use straightedge::job::photo::{self, Colours};

use super::{json as ran, run, stderr, stdout};

/// What no closed-form model holds: 0.5 px at its summit.
fn bump(x: f64, y: f64) -> [f64; 2] {
    let at = (-((x - 520.0).powi(2) + (y - 250.0).powi(2)) / (2.0 * 80.0 * 80.0)).exp();
    [0.45 * at, -0.22 * at]
}

/// A corner file of 30 boards before the source document's camera, with or without the bump, and a picture of one of them.
fn corners(folder: &Path, bent: bool) -> Scene {
    let mut scene = Scene::seed();
    scene.poses = poses::random(30, &scene.camera, &scene.board, 5).unwrap();
    let frame = |view: usize| {
        let corners = scene.corners_px(view).into_iter().enumerate().map(|(index, px)| {
            let px = px.unwrap();
            let [dx, dy] = if bent { bump(px.x, px.y) } else { [0.0, 0.0] };
            // A deterministic stand-in for noise of 0.05 px.
            let noise = |k: usize| 0.07 * ((view * 540 + index * 10 + k) as f64 * 78.233).sin();
            json!([index, px.x + dx + noise(0), px.y + dy + noise(1), 0.05])
        });
        json!({"file": format!("view_{view:02}.png"), "image_size_px": [800, 600], "corners": corners.collect::<Vec<_>>()})
    };
    let file = json!({"board": "9x6", "square": 30.0, "unit": "mm", "frames": (0..30).map(frame).collect::<Vec<_>>()});
    fs::write(folder.join("corners.json"), file.to_string()).unwrap();
    scene
}

#[test]
fn what_the_model_leaves_is_found_written_and_applied() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let scene = corners(at, true);
    let args = [
        "calibrate",
        "--corners",
        "corners.json",
        "--residual-map",
        "map.npy",
        "--out",
        "c.json",
        "--out",
        "c.yaml",
    ];
    let text = run(at, &args);
    assert!(text.status.success(), "{}", stderr(&text));
    assert!(
        stdout(&text).contains("Residual map") && stdout(&text).contains("worth having"),
        "{}",
        stdout(&text)
    );
    // Only our own format has a place for it.
    assert_eq!(stderr(&text).matches("has no place for the residual map").count(), 1, "{}", stderr(&text));
    let report = Report::from_json(&fs::read_to_string(at.join("c.json")).unwrap()).unwrap();
    let map = report.solution.unwrap().residual_map.unwrap();
    let held = map.held_out;
    assert!(
        map.worth_having && held.with_px < 0.85 * held.without_px && held.standard_errors > 4.0,
        "{held:?}"
    );

    // The array is the field at every pixel.
    let bytes = fs::read(at.join("map.npy")).unwrap();
    assert_eq!(bytes.len(), 128 + 800 * 600 * 8);
    let field = map.field.unwrap();
    let from = 128 + 8 * (250 * 800 + 520);
    let there = f32::from_le_bytes(bytes[from..from + 4].try_into().unwrap());
    assert_eq!(there, field.at(&Vector2::new(520.0, 250.0)).x as f32);
    assert!(field.largest_px() > 0.1, "{}", field.largest_px());

    // It is applied to photographs.
    fs::create_dir(at.join("photos")).unwrap();
    let png = synth::png(&synth::render(&scene, 0).unwrap(), false).unwrap();
    fs::write(at.join("photos/a.png"), png).unwrap();
    let done = run(at, &["undistort", "photos", "--camera", "c.json", "--out", "flat"]);
    assert!(done.status.success(), "{}", stderr(&done));
    let read = |name: &str| photo::read(&at.join(name), Colours::Keep).unwrap().photo;
    let file = format::read(&fs::read_to_string(at.join("c.json")).unwrap(), "c.json").unwrap();
    let with = straighten(
        &read("photos/a.png"),
        file.lens().as_ref(),
        &Framing::flat(0.0),
        false,
        Interpolation::Lanczos,
    )
    .unwrap();
    let without =
        straighten(&read("photos/a.png"), &file.camera, &Framing::flat(0.0), false, Interpolation::Lanczos)
            .unwrap();
    assert_eq!(read("flat/a.png"), with);
    assert!(with != without);

    // It stays with resized cameras and is left out, with a word, where the model becomes another.
    let done = run(at, &["convert", "c.json", "half.json", "--scale", "0.5"]);
    assert!(done.status.success(), "{}", stderr(&done));
    let half = format::read(&fs::read_to_string(at.join("half.json")).unwrap(), "half.json").unwrap();
    let half = half.evidence.residual.unwrap();
    let moved = half.at(&Vector2::new(259.75, 124.75)) - field.at(&Vector2::new(520.0, 250.0)) * 0.5;
    assert!(moved.norm() < 1e-12, "{moved}");
    let done = run(at, &["convert", "c.json", "other.json", "--model", "rational"]);
    assert!(stderr(&done).contains("residual map was that of the other model"), "{}", stderr(&done));

    // Poses take it into account: what is seen is first put where the model alone would show it.
    let rms = |camera: &str| {
        let args = ["pose", "photos", "--camera", camera, "--board", "9x6", "--json"];
        ran(at, &args, 0)["frames"][0]["rms_px"].as_f64().unwrap()
    };
    assert!((rms("c.json") - rms("c.yaml")).abs() > 1e-3, "{} {}", rms("c.json"), rms("c.yaml"));
}

#[test]
fn a_splined_camera_holds_what_the_model_leaves() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let scene = corners(at, true);
    let args = ["calibrate", "--corners", "corners.json", "--splined", "lens.cameramodel", "--out", "c.json"];
    let done = run(at, &args);
    assert!(done.status.success(), "{}", stderr(&done));
    assert!(stderr(&done).contains("wrote lens.cameramodel (splined, 20 x "), "{}", stderr(&done));

    // Away from the rim it is nearer to what was seen than the model: by the angle of the bump between two rays.
    let text = fs::read_to_string(at.join("lens.cameramodel")).unwrap();
    let splined = format::read_splined(&text).unwrap();
    let model = format::read(&fs::read_to_string(at.join("c.json")).unwrap(), "c.json").unwrap().camera;
    let (mut of_splined, mut of_model, mut n) = (0.0, 0.0, 0);
    for view in 0..10 {
        let seen: Vec<Vector2<f64>> = scene.corners_px(view).into_iter().flatten().collect();
        for (a, b) in seen.iter().zip(&seen[1..]) {
            let inside = |p: &Vector2<f64>| (60.0..740.0).contains(&p.x) && (60.0..540.0).contains(&p.y);
            if !inside(a) || !inside(b) {
                continue;
            }
            let angle = |ray: &dyn Fn(&Vector2<f64>) -> Vector3<f64>, moved: bool| {
                let at = |p: &Vector2<f64>| {
                    let d = if moved { Vector2::from(bump(p.x, p.y)) } else { Vector2::zeros() };
                    ray(&(p + d))
                };
                at(a).angle(&at(b))
            };
            let truth = angle(&|p| scene.camera.unproject(p).unwrap(), false);
            of_splined += (angle(&|p| splined.unproject(p).unwrap(), true) - truth).powi(2);
            of_model += (angle(&|p| model.unproject(p).unwrap(), true) - truth).powi(2);
            n += 1;
        }
    }
    assert!(n > 300 && of_splined < 0.25 * of_model, "{n}: {of_splined:e} {of_model:e}");

    // Photographs and maps go through it.
    fs::create_dir(at.join("photos")).unwrap();
    let png = synth::png(&synth::render(&scene, 0).unwrap(), false).unwrap();
    fs::write(at.join("photos/a.png"), png).unwrap();
    let done = run(at, &["undistort", "photos", "--camera", "lens.cameramodel", "--out", "flat"]);
    assert!(done.status.success(), "{}", stderr(&done));
    let read = |name: &str| photo::read(&at.join(name), Colours::Keep).unwrap().photo;
    let flat =
        straighten(&read("photos/a.png"), &splined, &Framing::flat(0.0), false, Interpolation::Lanczos);
    assert_eq!(read("flat/a.png"), flat.unwrap());
    let done = run(at, &["stmap", "--camera", "lens.cameramodel", "--out", "map.exr"]);
    assert!(done.status.success() && at.join("map_undistort.exr").is_file(), "{}", stderr(&done));

    // What cannot be: another extension, and a file that is cut short.
    let done = run(at, &["calibrate", "--corners", "corners.json", "--splined", "lens.yaml"]);
    assert!(stderr(&done).contains("let it end with .cameramodel"), "{}", stderr(&done));
    fs::write(at.join("cut.cameramodel"), &text[..text.len() / 2]).unwrap();
    let done = run(at, &["undistort", "photos", "--camera", "cut.cameramodel", "--out", "no"]);
    assert!(!done.status.success() && stderr(&done).contains("cut.cameramodel"), "{}", stderr(&done));
}

#[test]
fn where_the_model_fits_the_answer_is_no() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    corners(at, false);
    let args =
        ["calibrate", "--corners", "corners.json", "--residual-map", "map.npy", "--out", "c.json", "--json"];
    let r = ran(at, &args, 0);
    assert_eq!(
        (&r["residual_map"]["worth_having"], &r["residual_map"]["field"]),
        (&json!(false), &Value::Null)
    );
    assert!(fs::read(at.join("map.npy")).unwrap()[128..].iter().all(|b| *b == 0));
    let file = format::read(&fs::read_to_string(at.join("c.json")).unwrap(), "c.json").unwrap();
    assert_eq!(file.evidence.residual, None);
    // Not asked for, it is not there.
    let r = ran(at, &["calibrate", "--corners", "corners.json", "--json"], 0);
    assert!(r.get("residual_map").is_none());
}

#[test]
fn wrong_use_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    corners(at, false);
    let refused = run(at, &["calibrate", "--corners", "corners.json", "--residual-map", "map.png"]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(stderr(&refused).contains("let it end with .npy"), "{}", stderr(&refused));
    // Too few pictures: the calibration stands, the map is missed.
    let mut file: Value =
        serde_json::from_str(&fs::read_to_string(at.join("corners.json")).unwrap()).unwrap();
    file["frames"].as_array_mut().unwrap().truncate(5);
    fs::write(at.join("corners.json"), file.to_string()).unwrap();
    let few = run(at, &["calibrate", "--corners", "corners.json", "--residual-map", "map.npy"]);
    assert_eq!(few.status.code(), Some(1));
    assert!(
        stderr(&few).contains("map.npy: there is no residual map: 5 usable views, at least 6"),
        "{}",
        stderr(&few)
    );
    assert!(!at.join("map.npy").exists());
}
