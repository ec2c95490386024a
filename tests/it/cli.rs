//! The built binary is run on rendered pictures: JSON, exit codes, files, bad input.

mod bad_input;
mod calibrate;
mod check;
mod known_points;
mod residual_map;

use std::{
    fs,
    path::Path,
    process::{Command, Output},
};

use serde_json::Value;
use straightedge::calib::{
    camera::{Camera, Model},
    synth::{self, Scene},
};
use tempfile::TempDir;

/// The source document's scene at half its size: eight pictures of 400 x 300 px.
fn scene() -> Scene {
    let mut scene = Scene::seed();
    let params = vec![500.0, 500.0, 199.75, 149.75, -0.28, 0.10, 0.001, 0.002, 0.0];
    scene.camera = Camera::new(Model::Brown5, [400, 300], params).unwrap();
    scene.poses.rotate_left(7);
    scene.poses.truncate(8);
    scene.color = false;
    scene
}

/// Renders the pictures and the truth file of a scene into a new folder.
fn photos(scene: &Scene) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for view in 0..scene.poses.len() {
        let png = synth::png(&synth::render(scene, view).unwrap(), scene.color).unwrap();
        fs::write(folder.path().join(scene.file_name(view)), png).unwrap();
    }
    fs::write(folder.path().join("truth.json"), scene.truth().to_json()).unwrap();
    folder
}

fn run(folder: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_straightedge")).args(args).current_dir(folder).output().unwrap()
}

/// Standard output as JSON; the exit code must be the expected one.
fn json(folder: &Path, args: &[&str], code: i32) -> Value {
    let output = run(folder, args);
    assert_eq!(output.status.code(), Some(code), "{args:?}: {}", stderr(&output));
    serde_json::from_slice(&output.stdout).unwrap_or_else(|e| panic!("{args:?}: {e}: {}", stderr(&output)))
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn stdout(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// The one frame of a report whose file has this name.
fn frame<'a>(report: &'a Value, name: &str) -> &'a Value {
    let all = report["frames"].as_array().unwrap();
    all.iter().find(|f| f["file"].as_str().unwrap().ends_with(name)).unwrap()
}

/// The warning with a code.
fn warning<'a>(report: &'a Value, code: &str) -> &'a Value {
    let all = report["warnings"].as_array().unwrap();
    all.iter().find(|w| w["code"] == code).unwrap_or_else(|| panic!("no warning {code}: {all:?}"))
}
