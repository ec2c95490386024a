//! Bad input gives one clear line that names the file and what to do, or a warning beside a result: never a panic, and one bad
//! file never costs the rest.

use std::{fs, path::Path, process::Output};

use straightedge::calib::synth::{self, Scene};
use tempfile::TempDir;
use tiff::encoder::{TiffEncoder, colortype};

use super::{frame, json, photos, run, scene, stderr, warning};

/// Adds a file.
fn add(folder: &Path, name: &str, bytes: &[u8]) {
    fs::write(folder.join(name), bytes).unwrap();
}

fn render(scene: &Scene, view: usize) -> Vec<u8> {
    synth::png(&synth::render(scene, view).unwrap(), false).unwrap()
}

/// A grey PNG of one brightness.
fn blank(width: usize, height: usize) -> Vec<u8> {
    synth::png(&straightedge::calib::image::Plane::from_fn(width, height, |_, _| 128), false).unwrap()
}

/// The picture as a CMYK TIFF.
fn cmyk(scene: &Scene, view: usize) -> Vec<u8> {
    let plane = synth::render(scene, view).unwrap();
    let samples: Vec<u8> = plane.data().iter().flat_map(|v| [0, 0, 0, 255 - v]).collect();
    let mut bytes = std::io::Cursor::new(Vec::new());
    let mut encoder = TiffEncoder::new(&mut bytes).unwrap();
    encoder.write_image::<colortype::CMYK8>(plane.width() as u32, plane.height() as u32, &samples).unwrap();
    bytes.into_inner()
}

/// Wrong use: the exit code is 2, and stderr says something.
fn refused(output: &Output, says: &[&str]) {
    let text = stderr(output);
    assert_eq!(output.status.code(), Some(2), "{text}");
    assert!(output.stdout.is_empty());
    for word in says {
        assert!(text.contains(word), "{word}: {text}");
    }
}

#[test]
fn one_bad_file_never_costs_the_rest() {
    let scene = scene();
    let folder = photos(&scene);
    let at = folder.path();
    let good = render(&scene, 0);
    add(at, "truncated.png", &good[..good.len() / 2]);
    add(at, "zero.jpg", b"");
    add(at, "one_pixel.png", &blank(1, 1));
    add(at, "blank.png", &blank(400, 300));
    add(at, "text.jpg", b"this is no picture");
    add(at, "phone.heic", b"\0\0\0\x18ftypheic\0\0\0\0mif1heic");
    add(at, "raw.dng", b"II*\0\x08\0\0\0\x01\0\x12\xC6\x01\0\x04\0\0\0\x01\x04\0\0\0\0\0\0");
    add(at, "clip.mp4", b"\0\0\0\x18ftypisom\0\0\0\0isomiso2");
    add(at, "copy_of_first.png", &good);
    add(at, "notes.txt", b"not a picture, and not named like one");
    fs::rename(at.join("view_05.png"), at.join("view_05.jpg")).unwrap();
    fs::remove_file(at.join("view_06.png")).unwrap();
    add(at, "view_06.tif", &cmyk(&scene, 5));
    let r = json(at, &["calibrate", ".", "--json"], 0);
    assert_eq!(r["stats"]["n"], 8 * 54, "{}", r["warnings"]);
    for (name, state, says) in [
        ("truncated.png", "unreadable", "cut short"),
        ("zero.jpg", "unreadable", "empty"),
        ("one_pixel.png", "none", ""),
        ("blank.png", "none", ""),
        ("text.jpg", "unreadable", "text file"),
        ("phone.heic", "unreadable", "export them as JPEG"),
        ("raw.dng", "unreadable", "develop it"),
        ("clip.mp4", "unreadable", "video"),
        ("view_05.jpg", "full", ""),
        ("view_06.tif", "full", ""),
    ] {
        let f = frame(&r, name);
        assert_eq!(f["state"], state, "{f}");
        let why = f["why"].as_str().unwrap();
        assert!(why.contains(says) && (state == "full" || !why.is_empty()), "{name}: {why}");
        assert_eq!(f["included"], state == "full");
    }
    assert_eq!(r["frames"].as_array().unwrap().len(), 17);
    assert_eq!(warning(&r, "unreadable")["frames"].as_array().unwrap().len(), 6);
    let copies = warning(&r, "copies");
    assert_eq!(copies["frames"].as_array().unwrap().len(), 1);
    let notes: Vec<&str> = r["warnings"]
        .as_array()
        .unwrap()
        .iter()
        .filter(|w| w["code"] == "picture")
        .map(|w| w["text"].as_str().unwrap())
        .collect();
    assert!(notes.iter().any(|n| n.contains(".jpg")), "{notes:?}");
    // The same as text: each reason stands beside its file.
    let text = super::stdout(&run(at, &["calibrate", "."]));
    assert!(text.contains("phone.heic") && text.contains("cut short"), "{text}");
}

#[test]
fn cameras_and_sizes_are_never_mixed() {
    let scene = scene();
    let folder = photos(&scene);
    let at = folder.path();
    let other = Scene::seed();
    for view in 0..3 {
        add(at, &format!("large_{view}.png"), &render(&other, view));
    }
    let r = json(at, &["calibrate", ".", "--json"], 0);
    assert_eq!((&r["image_size_px"], &r["stats"]["n"]), (&serde_json::json!([400, 300]), &(8 * 54).into()));
    let w = warning(&r, "other_camera");
    assert_eq!(w["frames"].as_array().unwrap().len(), 3);
    assert!(w["text"].as_str().unwrap().contains("800x600"), "{w}");
    assert!(frame(&r, "large_1.png")["why"].as_str().unwrap().contains("800x600 px, not 400x300"));
    assert_eq!(r["groups"].as_array().unwrap().len(), 2);
    // Many pictures without a board do not make their camera the one to calibrate.
    for i in 0..10 {
        add(at, &format!("blank_{i}.png"), &blank(500, 400 + i));
    }
    assert_eq!(json(at, &["calibrate", ".", "--json"], 0)["image_size_px"], serde_json::json!([400, 300]));
}

#[test]
fn without_a_board_there_is_no_calibration_but_json() {
    let empty = tempfile::tempdir().unwrap();
    let r = json(empty.path(), &["calibrate", ".", "--json"], 1);
    assert_eq!(r["error"]["code"], "no_board");
    assert!(r["error"]["text"].as_str().unwrap().contains(".: no pictures"), "{r}");
    for command in ["calibrate", "detect"] {
        let folder = empty.path().display().to_string();
        let text = stderr(&run(Path::new("/"), &[command, &folder]));
        assert!(text.contains(&format!("error: {folder}: no pictures were found")), "{text}");
    }
    add(empty.path(), "readme.txt", b"no picture here");
    assert_eq!(json(empty.path(), &["calibrate", ".", "--json"], 1)["error"]["code"], "no_board");
    add(empty.path(), "blank.png", &blank(400, 300));
    let r = json(empty.path(), &["calibrate", ".", "--json"], 1);
    assert_eq!((&r["error"]["code"], &r["frames"][0]["state"]), (&"no_board".into(), &"none".into()));
    assert!(r.get("camera_matrix").is_none());
    let detected = json(empty.path(), &["detect", ".", "--json"], 1);
    assert_eq!(detected["frames"][0]["found"], false);
    add(empty.path(), "broken.png", b"\x89PNG\r\n\x1A\n");
    assert_eq!(
        json(empty.path(), &["calibrate", "broken.png", "--json"], 1)["frames"][0]["state"],
        "unreadable"
    );
    // No calibration writes no camera.
    let output = run(empty.path(), &["calibrate", ".", "--out", "camera.yaml"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(!empty.path().join("camera.yaml").exists());
}

#[test]
fn a_wrong_board_says_what_was_found() {
    let folder = photos(&scene());
    let r = json(folder.path(), &["calibrate", ".", "--board", "8x5", "--json"], 1);
    let text = r["error"]["text"].as_str().unwrap();
    assert!(text.contains("found 9x6, asked 8x5") && text.contains("--board 9x6"), "{text}");
    assert_eq!(frame(&r, "view_01.png")["why"], "found 9x6, asked 8x5");
}

#[test]
fn one_and_many_are_said_as_people_do() {
    let folder = photos(&scene());
    let said = |args: &[&str]| {
        let output = run(folder.path(), args);
        super::stdout(&output) + &stderr(&output)
    };
    let text = said(&["detect", "view_01.png"]);
    assert!(text.contains("in 1 of 1 picture, 54 corners"), "{text}");
    let text = said(&["calibrate", "view_01.png", "--model", "brown5"]);
    assert!(!text.contains("(s)"), "{text}");
    let text = said(&["calibrate", ".", "--board", "8x5"]);
    assert!(text.contains("an 8x5 board") && !text.contains("a 8x5"), "{text}");
}

#[test]
fn too_few_or_alike_pictures_say_so() {
    let scene = scene();
    let folder = tempfile::tempdir().unwrap();
    add(folder.path(), "a.png", &render(&scene, 0));
    add(folder.path(), "b.png", &render(&scene, 0));
    let r = json(folder.path(), &["calibrate", ".", "--json"], 1);
    assert!(
        ["degenerate", "too_few_views"].contains(&r["error"]["code"].as_str().unwrap()),
        "{}",
        r["error"]
    );
    assert!(warning(&r, "copies")["text"].as_str().unwrap().contains("1 picture is a copy"));
    assert_eq!(frame(&r, "b.png")["why"], "a copy of a.png");
}

#[test]
fn wrong_use_is_refused() {
    let folder = photos(&scene());
    let at = folder.path();
    let with = |args: &[&str]| run(at, args);
    for square in ["0", "-25mm", "nan", "0mm", "25 parsec", "inf"] {
        refused(&with(&["calibrate", ".", "--square", square]), &["--square"]);
    }
    for board in ["9", "9x", "1x6", "9x6x2", "axb"] {
        refused(&with(&["calibrate", ".", "--board", board]), &["inner corners"]);
    }
    for board in ["3x3", "6x2", "2x9"] {
        refused(&with(&["calibrate", ".", "--board", board]), &["at least 4x3"]);
        refused(&with(&["board", "--size", board, "--square", "25mm", "--out", "b.pdf"]), &["at least 4x3"]);
    }
    for fix in ["k4", "cx=abc", "fx", "fx=0", "fx=cx", "fx=fy,fy=fx"] {
        refused(&with(&["calibrate", ".", "--fix", fix]), &["error: "]);
    }
    refused(&with(&["calibrate", ".", "--model", "foo"]), &["eucm, ds, kb4, auto"]);
    add(at, "fov.txt", b"1 FOV 400 300 500 500 200 150 0.9\n");
    for args in [
        &["convert", "fov.txt", "c.yaml"][..],
        &["calibrate", ".", "--start", "fov.txt"],
        &["calibrate", ".", "--truth", "fov.txt"],
        &["pose", ".", "--camera", "fov.txt"],
        &["undistort", ".", "--camera", "fov.txt", "--out", "u"],
    ] {
        refused(&with(args), &["fov.txt", "the COLMAP model FOV is not supported"]);
    }
    refused(&with(&["calibrate"]), &["PATHS"]);
    refused(&with(&["calibrate", "no/such/folder"]), &["no/such/folder", "check the path"]);
    refused(&with(&["calibrate", ".", "--model", "fisheye9"]), &["pinhole, radial1"]);
    refused(&with(&["calibrate", ".", "--fix", "fx=="]), &["fx=fy"]);
    refused(&with(&["calibrate", ".", "--loss", "l3"]), &["huber, linear"]);
    refused(&with(&["calibrate", ".", "--out", "camera.docx"]), &["camera.docx", "opencv"]);
    refused(&with(&["calibrate", ".", "--refine", "magic"]), &["strip"]);
    refused(&with(&["calibrate", ".", "--presmooth", "-1"]), &["width in px"]);
    refused(&with(&["calibrate", ".", "--threads", "0"]), &["--threads"]);
    refused(&with(&["calibrate", ".", "--truth", "missing.json"]), &["missing.json", "no such file"]);
    refused(&with(&["calibrate", ".", "--start", "."]), &["a folder"]);
    refused(&with(&["calibrat", "."]), &["calibrate"]);
}

#[test]
fn contradictory_camera_files_are_named() {
    let folder = photos(&scene());
    let at = folder.path();
    let truth = fs::read_to_string(at.join("truth.json")).unwrap();
    add(
        at,
        "nan.yaml",
        b"image_width: 400\nimage_height: 300\ncamera_matrix: [.nan, 0, 200, 0, 500, 150, 0, 0, 1]\n",
    );
    refused(&run(at, &["calibrate", ".", "--start", "nan.yaml"]), &["nan.yaml"]);
    add(at, "bad.json", truth.replacen("\"fx\": 500.0", "\"fx\": -500.0", 1).as_bytes());
    refused(&run(at, &["calibrate", ".", "--truth", "bad.json"]), &["bad.json", "fx"]);
    // A start for pictures of another size has no answer; a truth of another size costs the comparison only.
    add(at, "other.json", truth.replacen("400,\n      300", "800,\n      600", 1).as_bytes());
    let r = json(at, &["calibrate", ".", "--start", "other.json", "--json"], 1);
    let text = r["error"]["text"].as_str().unwrap();
    assert!(
        text.contains("other.json") && text.contains("800 x 600") && text.contains("400 x 300"),
        "{text}"
    );
    let r = json(at, &["calibrate", ".", "--truth", "other.json", "--json"], 0);
    assert!(warning(&r, "truth_of_another_camera")["text"].as_str().unwrap().contains("other.json"));
    assert!(r.get("truth").is_none());
}

/// A folder with one corner file.
fn corners(text: &str) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    add(folder.path(), "c.json", text.as_bytes());
    folder
}

#[test]
fn broken_corner_files_are_named() {
    for (text, says) in [
        ("", "not a corner file"),
        ("{}", "frames"),
        (r#"{"frames": [{"file": "a.png", "corners": [[0, 1]]}]}"#, "[index, x_px, y_px, sigma_px]"),
        (r#"{"frames": [{"file": "a.png", "corners": [[-1, 1, 2]]}]}"#, "[index, x_px, y_px, sigma_px]"),
        (
            r#"{"image_size_px": [640, 480], "frames": [{"file": "a.png", "corners": [[3, 1, 2], [3, 4, 5]]}]}"#,
            "corner 3 is given twice",
        ),
        (
            r#"{"image_size_px": [640, 480], "frames": [{"file": "a.png", "corners": [[3, 1, 2, -0.5]]}]}"#,
            "corner 3",
        ),
        (r#"{"image_size_px": [0, 480], "frames": [{"file": "a.png"}]}"#, "a.png"),
        (
            r#"{"image_size_px": [640, 480], "frames": [{"file": "a.png"}, {"file": "a.png"}]}"#,
            "listed twice",
        ),
        (r#"{"board": "9", "frames": []}"#, "board size"),
        (r#"{"settings": {"square": -3}, "frames": []}"#, "greater than zero"),
        (r#"{"frames": [{"file": "a.png", "corners": [[0, 1, 2]]}]}"#, "its size is not known"),
    ] {
        refused(&run(corners(text).path(), &["calibrate", "--corners", "c.json"]), &["c.json", says]);
    }
    // Readable, but not a calibration.
    let folder = corners(
        r#"{"board": "9x6", "image_size_px": [640, 480], "frames": [{"file": "a.png", "corners": [[99, 1, 2]]}]}"#,
    );
    assert_eq!(
        json(folder.path(), &["calibrate", "--corners", "c.json", "--json"], 1)["frames"][0]["included"],
        false
    );
}
