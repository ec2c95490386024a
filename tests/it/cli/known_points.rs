//! Known points from CSV: a rig and a plate of the user's, measured by another program.

use std::{fmt::Write as _, fs, path::Path};

use nalgebra::{Point3, Vector3};
use straightedge::calib::{
    camera::{Camera, Model},
    pose::Pose,
    report::Report,
    target::Target,
};
use tempfile::TempDir;

use super::{frame, json, run, stderr, stdout};

const SIZE: [u32; 2] = [800, 600];

fn camera() -> Camera {
    let params = vec![700.0, 702.0, 405.0, 296.0, -0.21, 0.07, 8e-4, -4e-4, 0.0];
    Camera::new(Model::Brown5, SIZE, params).unwrap()
}

/// Irregular points in a box of 400 x 300 x `depth` mm, their names not in order.
fn things(depth: f64) -> Vec<(String, Point3<f64>)> {
    let part = |i: u32, k: f64| (f64::from(i) * k).fract() - 0.5;
    (0..48)
        .map(|i| {
            let p = Point3::new(
                400.0 * part(i, 0.618_034),
                300.0 * part(i, 0.754_878),
                depth * part(i, 0.569_84),
            );
            (if i % 3 == 0 { format!("{}", 100 - i) } else { format!("P{i}") }, p)
        })
        .collect()
}

fn poses() -> Vec<Pose> {
    [[10.0, -25.0, 5.0], [-30.0, 8.0, -40.0], [22.0, 28.0, 90.0], [-18.0, -20.0, 170.0], [35.0, -5.0, 60.0]]
        .iter()
        .enumerate()
        .map(|(i, a)| {
            Pose::from_euler_deg(*a, Vector3::new(15.0 * i as f64 - 30.0, 10.0, 640.0 + 20.0 * i as f64))
        })
        .collect()
}

/// A folder with `target.csv` and `seen.csv` of the exact camera.
fn folder(depth: f64, views: usize) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let (mut target, mut seen) = ("# a rig, mm\nid,x,y,z\n".to_owned(), "image,id,u,v\n".to_owned());
    for (name, p) in things(depth) {
        let _ = writeln!(target, "{name},{},{},{}", p.x, p.y, p.z);
    }
    for (i, pose) in poses().iter().take(views).enumerate() {
        for (name, p) in things(depth) {
            let px = camera().project(&pose.apply(&p)).unwrap();
            if px.x > 0.0 && px.y > 0.0 && px.x < 799.0 && px.y < 599.0 {
                let _ = writeln!(seen, "view{i}.png,{name},{},{}", px.x, px.y);
            }
        }
    }
    fs::write(folder.path().join("target.csv"), target).unwrap();
    fs::write(folder.path().join("seen.csv"), seen).unwrap();
    fs::write(folder.path().join("truth.json"), truth()).unwrap();
    folder
}

/// A camera file with the true one.
fn truth() -> String {
    let c = camera();
    let matrix: serde_json::Value = ["fx", "fy", "cx", "cy"]
        .iter()
        .map(|n| ((*n).to_owned(), c.get(n).unwrap().into()))
        .collect::<serde_json::Map<_, _>>()
        .into();
    let distortion: serde_json::Value =
        c.distortion().map(|(n, v)| (n.to_owned(), v.into())).collect::<serde_json::Map<_, _>>().into();
    let camera = serde_json::json!({"model": "brown5", "size_px": SIZE, "camera_matrix": matrix, "distortion": distortion});
    serde_json::json!({"camera": camera, "board": "9x6", "square": 1.0, "unit": "mm", "frames": []})
        .to_string()
}

const ARGS: [&str; 7] =
    ["calibrate", "--target", "target.csv", "--corners", "seen.csv", "--image-size", "800x600"];

fn with<'a>(more: &[&'a str]) -> Vec<&'a str> {
    [&ARGS[..], more].concat()
}

#[test]
fn a_rig_and_a_plate_give_their_camera() {
    for (depth, views) in [(250.0, 1), (250.0, 5), (0.0, 5)] {
        let folder = folder(depth, views);
        let at = folder.path();
        let args = with(&[
            "--unit",
            "mm",
            "--truth",
            "truth.json",
            "--report",
            "r.html",
            "--out",
            "c.json",
            "--json",
        ]);
        let r = json(at, &args, 0);
        for (name, t) in r["truth"].as_object().unwrap() {
            let bound = 1e-7 * t["truth"].as_f64().unwrap().abs().max(1.0);
            assert!(t["absolute"].as_f64().unwrap() <= bound, "{depth} {views} {name}: {t}");
        }
        assert_eq!(r["settings"]["target"]["kind"], "points");
        assert_eq!(r["settings"]["target"]["points"][1][0], "P1");
        assert_eq!(
            (&r["settings"]["unit"], &r["settings"]["board"]),
            (&"mm".into(), &serde_json::Value::Null)
        );
        let report = Report::from_json(&fs::read_to_string(at.join("c.json")).unwrap()).unwrap();
        let target = report.settings.target().unwrap();
        assert!(matches!(target, Target::Points { .. }) && target.is_solid() == (depth > 0.0));
        for (i, pose) in poses().iter().take(views).enumerate() {
            let f = frame(&r, &format!("view{i}.png"));
            let t = f["tvec"].as_array().unwrap();
            for k in 0..3 {
                assert!((t[k].as_f64().unwrap() - pose.translation[k]).abs() < 1e-4, "{f}");
            }
        }
        let page = fs::read_to_string(at.join("r.html")).unwrap();
        assert!(page.contains("48 known points") && page.contains("<th>Unit</th><td>mm</td>"));
        let text = stdout(&run(at, &with(&[])));
        assert!(text.contains("Camera: Brown, 5 terms"), "{text}");
        assert!(!text.contains("tilted by more than"), "{text}");
        // The same poses of the known camera.
        let args =
            ["pose", "--camera", "c.json", "--target", "target.csv", "--corners", "seen.csv", "--json"];
        let p = json(at, &args, 0);
        for (i, pose) in poses().iter().take(views).enumerate() {
            let z = frame(&p, &format!("view{i}.png"))["tvec"][2].as_f64().unwrap();
            assert!((z - pose.translation.z).abs() < 1e-4);
        }
    }
}

/// Changes one file and answers what is said; the exit code must be the expected one.
fn spoiled(at: &Path, file: &str, change: impl Fn(&str) -> String, code: i32) -> String {
    let good = fs::read_to_string(at.join(file)).unwrap();
    fs::write(at.join(file), change(&good)).unwrap();
    let output = run(at, &ARGS);
    fs::write(at.join(file), good).unwrap();
    assert_eq!(output.status.code(), Some(code), "{}{}", stdout(&output), stderr(&output));
    stderr(&output)
}

#[test]
fn bad_files_are_told_with_line_and_remedy() {
    let folder = folder(250.0, 3);
    let at = folder.path();
    let add = |more: &'static str| move |text: &str| format!("{text}{more}\n");
    for (file, more, says) in [
        ("target.csv", "P1,1,2,3", ["target.csv: line 51: the point P1 is in line 4 already", "remove"]),
        ("target.csv", "X,1,2,z", ["target.csv: line 51: z is \"z\"", "a number was expected"]),
        ("target.csv", "X,1,nan,3", ["target.csv: line 51: y is \"nan\"", "a number was expected"]),
        ("target.csv", "X,1,2", ["target.csv: line 51: 3 fields", "id,x,y,z"]),
        ("seen.csv", "view0.png,Q7,10,10", ["the point Q7 is not in the file of --target", "one target?"]),
        ("seen.csv", "view0.png,P1,10,10", ["already: remove one", "seen.csv: line"]),
        ("seen.csv", "view9.png,P1,x,10", ["u is \"x\"", "a number was expected"]),
        ("seen.csv", "view9.png,P1,1900,10", ["outside a picture of 800 x 600 px", "--image-size"]),
    ] {
        let text = spoiled(at, file, add(more), 2);
        assert!(says.iter().all(|s| text.contains(s)), "{more}: {text}");
    }
    let few = spoiled(at, "target.csv", |t| t.lines().take(5).map(|l| format!("{l}\n")).collect(), 2);
    assert!(few.contains("target.csv: 3 points: at least 4 are needed"), "{few}");
    // Left-handed: y upwards with x to the right and z away.
    let flip = |text: &str| -> String {
        let line = |l: &str| match l.split(',').collect::<Vec<_>>()[..] {
            [id, x, y, z] if id != "id" => format!("{id},{x},{},{z}\n", -y.parse::<f64>().unwrap()),
            _ => format!("{l}\n"),
        };
        text.lines().map(line).collect()
    };
    let text = spoiled(at, "target.csv", flip, 1);
    assert!(text.contains("the points are mirrored") && text.contains("change the sign"), "{text}");
    // No size anywhere; wrong words.
    let output = run(at, &["calibrate", "--target", "target.csv", "--corners", "seen.csv"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(
        stderr(&output).contains("view0.png: its size is not known: give --image-size"),
        "{}",
        stderr(&output)
    );
    for (args, says) in [
        (["--image-size", "800"], "not a size of pictures"),
        (["--unit", "parsec"], "not a unit"),
        (["--board", "9x6"], "cannot be used with"),
    ] {
        let output = run(at, &[&ARGS[..5], &args[..]].concat());
        assert_eq!(output.status.code(), Some(2), "{args:?}");
        assert!(stderr(&output).contains(says), "{}", stderr(&output));
    }
    let output = run(at, &["calibrate", "--target", "target.csv", "."]);
    assert!(output.status.code() == Some(2) && stderr(&output).contains("--corners"), "{}", stderr(&output));
}

#[test]
fn what_determines_no_camera_is_refused() {
    // Few points of a rig, and a plate in one picture.
    let rig = folder(250.0, 1);
    let few = |t: &str| t.lines().take(6).map(|l| format!("{l}\n")).collect::<String>();
    let text = spoiled(rig.path(), "seen.csv", few, 1);
    assert!(text.contains("5 corners for 8 unknowns"), "{text}");
    let plate = folder(0.0, 1);
    let text = spoiled(plate.path(), "seen.csv", str::to_owned, 1);
    assert!(text.contains("1 usable view, at least 2 are needed"), "{text}");
}
