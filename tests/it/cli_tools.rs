//! The commands beside `calibrate` and `detect`, through the built binary.

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Output},
};

use serde_json::Value;
use straightedge::{
    calib::{
        format::{self, FORMATS},
        image::{Photo, Samples},
        synth::{Scene, Truth},
        undistort,
    },
    job::photo::{self, Colours, Format},
};
use tempfile::TempDir;

fn run(folder: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_straightedge")).current_dir(folder).args(args).output().unwrap()
}

/// Runs, checks the exit code, and answers stdout and stderr.
fn ran(folder: &Path, code: i32, args: &[&str]) -> (String, String) {
    let out = run(folder, args);
    let (stdout, stderr) = (String::from_utf8_lossy(&out.stdout), String::from_utf8_lossy(&out.stderr));
    assert_eq!(out.status.code(), Some(code), "{args:?}\n{stdout}\n{stderr}");
    assert!(!stderr.contains("panicked"), "{args:?}\n{stderr}");
    (stdout.into_owned(), stderr.into_owned())
}

/// Runs with an answer on stderr that holds all words; nothing on stdout.
fn refused(folder: &Path, code: i32, args: &[&str], words: &[&str]) {
    let (stdout, stderr) = ran(folder, code, args);
    assert!(words.iter().all(|w| stderr.contains(w)), "{args:?} should say {words:?}:\n{stderr}");
    assert_eq!(stdout, "", "{args:?}");
}

/// A folder with `pictures/` of a small scene.
fn scene(n: u32) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let poses = format!("random:{n}");
    ran(folder.path(), 0, &["synth", "--poses", &poses, "--size", "400x300", "--out", "pictures"]);
    folder
}

fn files(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> =
        fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn synth_writes_pictures_truth_and_the_scene_that_makes_them_again() {
    let folder = scene(3);
    let at = |name: &str| folder.path().join(name);
    assert_eq!(
        files(&at("pictures")),
        ["scene.json", "truth.json", "view_01.png", "view_02.png", "view_03.png"]
    );
    let truth = Truth::from_json(&fs::read_to_string(at("pictures/truth.json")).unwrap()).unwrap();
    assert_eq!(
        (truth.frames.len(), truth.frames[2].corners.len(), truth.camera.size_px),
        (3, 54, [400, 300])
    );
    let (stdout, stderr) =
        ran(folder.path(), 0, &["synth", "--scene", "pictures/scene.json", "--out", "again"]);
    assert!(stdout.contains("3 pictures of 400 x 300 px") && stderr.is_empty(), "{stdout}{stderr}");
    for name in files(&at("again")) {
        assert_eq!(
            fs::read(at("again").join(&name)).unwrap(),
            fs::read(at("pictures").join(&name)).unwrap(),
            "{name}"
        );
    }
    // The number of threads changes nothing; the seed does.
    ran(
        folder.path(),
        0,
        &["synth", "--scene", "pictures/scene.json", "--threads", "1", "--degrade", "noise=5", "--out", "a"],
    );
    ran(
        folder.path(),
        0,
        &["synth", "--scene", "pictures/scene.json", "--threads", "4", "--degrade", "noise=5", "--out", "b"],
    );
    ran(folder.path(), 0, &["synth", "--scene", "a/scene.json", "--seed", "9", "--out", "c"]);
    let picture = |f: &str| fs::read(at(f).join("view_02.png")).unwrap();
    assert!(picture("a") == picture("b") && picture("a") != picture("c") && picture("a") != picture("again"));
}

#[test]
fn synth_takes_every_option() {
    let folder = tempfile::tempdir().unwrap();
    let (stdout, _) = ran(
        folder.path(),
        0,
        &[
            "synth",
            "--poses",
            "random:2",
            "--size",
            "320x320",
            "--board",
            "5x4",
            "--square",
            "1in",
            "--margin",
            "1",
            "--origin",
            "inner",
            "--crude",
            "--degrade",
            "blur=1,jpeg=60",
            "--seed",
            "4",
            "--out",
            "x",
        ],
    );
    assert!(stdout.contains("board 5x4, square 1 in, crude, blur=1,jpeg=60, seed 4"), "{stdout}");
    let scene = Scene::from_json(&fs::read_to_string(folder.path().join("x/scene.json")).unwrap()).unwrap();
    assert_eq!((scene.camera.size_px, scene.poses.len(), scene.board.margin), ([320, 320], 2, 1.0));
    // 400 / 300 px of the middle, scaled: the principal point stays in the middle.
    let [fx, _, cx, _] = scene.camera.intrinsics();
    assert!((fx - 1000.0 * 320.0 / 600.0).abs() < 1e-9 && (cx - 160.0).abs() < 1.0, "{fx} {cx}");
}

#[test]
fn another_run_in_the_same_folder_is_said() {
    let folder = scene(3);
    let (_, stderr) = ran(
        folder.path(),
        0,
        &["synth", "--poses", "random:1", "--size", "400x300", "--seed", "2", "--out", "pictures"],
    );
    assert!(stderr.contains("warning: pictures: the pictures of another run were overwritten, but 2 of them are left (view_02.png to view_03.png): remove them"), "{stderr}");
}

#[test]
fn undistort_agrees_with_the_library_and_writes_its_camera() {
    let folder = scene(2);
    let at = |name: &str| folder.path().join(name);
    let (stdout, stderr) = ran(
        folder.path(),
        0,
        &["undistort", "pictures", "--camera", "pictures/truth.json", "--alpha", "0.5", "--out", "new/flat"],
    );
    assert!(
        stdout.contains("2 of 2 pictures undistorted into new/flat")
            && stdout.contains("new/flat/camera.yaml"),
        "{stdout}"
    );
    assert_eq!(stderr, "");
    assert_eq!(files(&at("new/flat")), ["camera.yaml", "view_01.png", "view_02.png"]);
    let truth = Truth::from_json(&fs::read_to_string(at("pictures/truth.json")).unwrap()).unwrap();
    let before = photo::read(&at("pictures/view_02.png"), Colours::Keep).unwrap().photo;
    let after = photo::read(&at("new/flat/view_02.png"), Colours::Keep).unwrap().photo;
    let expected = undistort::straighten(
        &before,
        &truth.camera,
        &undistort::Framing::flat(0.5),
        false,
        undistort::Interpolation::Lanczos,
    )
    .unwrap();
    assert_eq!(after, expected);
    let camera =
        format::read_bytes(&fs::read(at("new/flat/camera.yaml")).unwrap(), "camera.yaml").unwrap().camera;
    let view = undistort::new_camera(&truth.camera, 0.5).unwrap();
    assert_eq!((camera.size_px, &camera.params[..4]), (view.size_px, &view.params[..]));
}

#[test]
fn undistort_crops_and_says_what_the_files_are() {
    let folder = scene(1);
    let path = folder.path();
    let (stdout, _) = ran(
        path,
        0,
        &[
            "undistort",
            "pictures/view_01.png",
            "--camera",
            "pictures/truth.json",
            "--alpha",
            "1",
            "--crop",
            "--interpolation",
            "bilinear",
            "--out",
            "u",
        ],
    );
    let [w, h] = photo::size_px(&path.join("u/view_01.png")).unwrap();
    assert!(stdout.contains(&format!("pinhole, {w} x {h} px")) && w <= 400 && h < 300, "{stdout}");
    // Every pixel is valid: none is black beside the board, whose background is grey.
    let Samples::U8(samples) = photo::read(&path.join("u/view_01.png"), Colours::Keep).unwrap().photo.samples
    else {
        panic!("8 bit")
    };
    let row = &samples[..3 * w as usize];
    assert!(row.iter().all(|v| *v > 100), "the first row has invalid pixels");
}

#[test]
fn undistort_goes_on_after_a_bad_picture_and_keeps_formats() {
    let folder = scene(1);
    let path = folder.path();
    let stored = photo::read(&path.join("pictures/view_01.png"), Colours::Keep).unwrap().photo;
    // 16 bit, under a JPEG's name.
    let Samples::U8(samples) = &stored.samples else { panic!("8 bit") };
    let deep = Photo {
        samples: Samples::U16(samples.iter().map(|v| u16::from(*v) * 257).collect()),
        ..stored.clone()
    };
    let png = fs::read(path.join("pictures/view_01.png")).unwrap();
    fs::create_dir_all(path.join("in")).unwrap();
    fs::write(path.join("in/deep.jpg"), photo::write::like("a", &png, &deep).unwrap()).unwrap();
    fs::write(path.join("in/cut.png"), &png[..png.len() / 2]).unwrap();
    fs::write(path.join("in/movie.mp4"), b"\0\0\0\x18ftypisom").unwrap();
    let small = Photo { width: 2, height: 1, channels: 3, samples: Samples::U8(vec![0; 6]) };
    fs::write(path.join("in/small.png"), photo::write::like("a", &png, &small).unwrap()).unwrap();
    let (stdout, stderr) =
        ran(path, 0, &["undistort", "in", "--camera", "pictures/truth.json", "--out", "u"]);
    assert!(stdout.starts_with("1 of 4 pictures"), "{stdout}");
    for words in [
        "in/cut.png: the PNG file is cut short",
        "in/movie.mp4: MP4 is a video",
        "in/small.png: it has 2 x 1 px, the camera is for 400 x 300",
        "straightedge convert --scale",
        "in/deep.jpg: it ends in .jpg but holds a PNG",
    ] {
        assert!(stderr.contains(words), "{words}\n{stderr}");
    }
    assert_eq!(files(&path.join("u")), ["camera.yaml", "deep.jpg"]);
    let after = photo::read(&path.join("u/deep.jpg"), Colours::Keep).unwrap();
    assert!(after.format == Format::Png && matches!(after.photo.samples, Samples::U16(_)));
    // None is left: no result.
    let (_, stderr) =
        ran(path, 1, &["undistort", "in/cut.png", "--camera", "pictures/truth.json", "--out", "v"]);
    assert!(stderr.contains("none of 1 picture could"), "{stderr}");
    assert_eq!(files(&path.join("v")), [""; 0]);
    // The camera of an earlier run stays with its pictures.
    let before = fs::read(path.join("u/camera.yaml")).unwrap();
    ran(path, 0, &["convert", "pictures/truth.json", "half.yaml", "--scale", "0.5"]);
    ran(path, 1, &["undistort", "in/deep.jpg", "--camera", "half.yaml", "--out", "u"]);
    assert_eq!(fs::read(path.join("u/camera.yaml")).unwrap(), before);
}

#[test]
fn undistort_keeps_folders_apart_and_never_overwrites_a_photograph() {
    let folder = scene(2);
    let path = folder.path();
    for side in ["left", "right"] {
        fs::create_dir_all(path.join("rig").join(side)).unwrap();
        fs::copy(path.join("pictures/view_01.png"), path.join("rig").join(side).join("1.png")).unwrap();
    }
    ran(path, 0, &["undistort", "rig", "--camera", "pictures/truth.json", "--out", "u"]);
    assert_eq!(files(&path.join("u")), ["camera.yaml", "left", "right"]);
    assert_eq!(files(&path.join("u/right")), ["1.png"]);
    let before = fs::read(path.join("pictures/view_01.png")).unwrap();
    for (inputs, out) in
        [("pictures", "pictures"), ("pictures/view_01.png", "."), ("rig", "rig/../pictures/../rig")]
    {
        refused(
            path,
            2,
            &["undistort", inputs, "--camera", "pictures/truth.json", "--out", out],
            &["give another folder"],
        );
    }
    assert_eq!(fs::read(path.join("pictures/view_01.png")).unwrap(), before);
    assert!(!path.join("pictures/camera.yaml").exists());
    // Nor the camera file that was given.
    ran(path, 0, &["convert", "pictures/truth.json", "u/camera.yaml"]);
    let args = ["undistort", "pictures", "--camera", "u/camera.yaml", "--out", "u"];
    refused(path, 2, &args, &["where the camera of the results would go"]);
}

#[test]
fn convert_goes_through_every_format() {
    let folder = scene(1);
    let path = folder.path();
    let source =
        format::read(&fs::read_to_string(path.join("pictures/truth.json")).unwrap(), "truth.json").unwrap();
    for f in FORMATS {
        let out = format!("camera.{}", f.usual[0]);
        let (stdout, _) = ran(path, 0, &["convert", "pictures/truth.json", &format!("{}:{out}", f.name)]);
        assert!(
            stdout.contains(&format!("({}): 400 x 300 px, brown5; read back, it projects", f.name)),
            "{stdout}"
        );
        let back = format::read(&fs::read_to_string(path.join(&out)).unwrap(), &out).unwrap();
        assert_eq!(back.camera.size_px, source.camera.size_px, "{}", f.name);
        assert!((back.camera.params[0] / source.camera.params[0] - 1.0).abs() < 0.01, "{}", f.name);
    }
    // Kalibr has no k3: the refit is told.
    let text =
        fs::read_to_string(path.join("pictures/truth.json")).unwrap().replace("\"k3\": 0.0", "\"k3\": -0.3");
    fs::write(path.join("k3.json"), text).unwrap();
    let (_, stderr) = ran(path, 0, &["convert", "k3.json", "kalibr:k.yaml"]);
    assert!(stderr.contains("note: ") && stderr.contains("px"), "{stderr}");
}

#[test]
fn convert_crops_then_scales() {
    let folder = scene(1);
    let path = folder.path();
    ran(path, 0, &["convert", "pictures/truth.json", "c.yaml", "--crop", "40,20,200,100", "--scale", "0.5"]);
    let camera = |name: &str| format::read_bytes(&fs::read(path.join(name)).unwrap(), name).unwrap().camera;
    let expected = camera("pictures/truth.json").cropped([40, 20, 200, 100]).unwrap().scaled(0.5).unwrap();
    assert_eq!((camera("c.yaml").size_px, camera("c.yaml").params), ([100, 50], expected.params));
}

#[test]
fn poses_are_those_of_the_truth() {
    let folder = scene(3);
    let path = folder.path();
    fs::write(path.join("pictures/cut.png"), b"\x89PNG\r\n\x1A\n").unwrap();
    let args = ["pose", "pictures", "--camera", "pictures/truth.json", "--board", "9x6", "--square", "30mm"];
    let (stdout, _) = ran(path, 0, &[&args[..], &["--json"]].concat());
    let json: Value = serde_json::from_str(&stdout).unwrap();
    assert_eq!((&json["settings"]["board"], &json["settings"]["unit"]), (&"9x6".into(), &"mm".into()));
    let frames = json["frames"].as_array().unwrap();
    assert_eq!((frames.len(), &frames[0]["state"]), (4, &"unreadable".into()));
    let truth = Truth::from_json(&fs::read_to_string(path.join("pictures/truth.json")).unwrap()).unwrap();
    for frame in &frames[1..] {
        let pose = truth.frame(frame["file"].as_str().unwrap()).unwrap().pose;
        let vector = |name: &str| -> Vec<f64> {
            frame[name].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
        };
        let (r, t) = (vector("rvec_rad"), vector("tvec"));
        for k in 0..3 {
            assert!(
                (t[k] - pose.translation[k]).abs() < 0.5 && (r[k] - pose.rvec()[k]).abs() < 2e-3,
                "{frame}"
            );
        }
        assert!(frame["rms_px"].as_f64().unwrap() < 0.05);
        assert!((frame["tilt_rad"].as_f64().unwrap() - pose.tilt_rad()).abs() < 2e-3);
    }
    let (table, _) = ran(path, 0, &args);
    assert!(
        table.contains("view_03.png")
            && table.contains("distance mm")
            && table.contains("cut.png      unreadable: "),
        "{table}"
    );
    // Found from the pictures; lengths are then in squares.
    let (auto, _) = ran(path, 0, &["pose", "pictures", "--camera", "pictures/truth.json", "--json"]);
    let json: Value = serde_json::from_str(&auto).unwrap();
    assert_eq!((&json["settings"]["board"], &json["settings"]["unit"]), (&"9x6".into(), &"squares".into()));
    // A camera for other pictures, or another board: no result, and why.
    ran(path, 0, &["convert", "pictures/truth.json", "half.yaml", "--scale", "0.5"]);
    let (none, _) = ran(path, 1, &["pose", "pictures", "--camera", "half.yaml", "--board", "9x6"]);
    assert!(none.contains("no pose: it has 400 x 300 px, the camera is for 200 x 150"), "{none}");
    let (none, _) =
        ran(path, 1, &["pose", "pictures", "--camera", "pictures/truth.json", "--board", "12x11"]);
    assert!(none.contains("asked 12x11"), "{none}");
}

#[test]
fn boards_are_written_and_say_their_paper() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let (stdout, stderr) = ran(path, 0, &["board", "--size", "9x6", "--square", "25mm", "--out", "b.pdf"]);
    assert_eq!(stdout, "b.pdf: checkerboard, 9x6 inner corners, square 25 mm, on A4 (297 x 210 mm)\n");
    assert_eq!(stderr, "");
    assert!(fs::read(path.join("b.pdf")).unwrap().starts_with(b"%PDF-"));
    let (_, stderr) = ran(
        path,
        0,
        &["board", "--kind", "checkerboard", "--size", "11x9", "--square", "60mm", "--out", "B.SVG"],
    );
    assert!(
        stderr.contains("does not fit on A4 or A3") && stderr.contains("squares of 18 mm fit on A4"),
        "{stderr}"
    );
    assert!(stderr.contains("looks the same upside down"), "{stderr}");
    assert!(fs::read_to_string(path.join("B.SVG")).unwrap().starts_with("<svg"));
    let charuco = ["board", "--kind", "charuco", "--size", "11x8", "--square", "20mm", "--marker", "15mm"];
    let (stdout, stderr) = ran(path, 0, &[&charuco[..], &["--first-id", "3", "--out", "c.svg"]].concat());
    let words = "ChArUco 11x8 squares, square 20 mm, marker 15 mm, dictionary 5x5_250, ids 3 to 46, layout since OpenCV 4.6";
    assert_eq!(stdout, format!("c.svg: charuco, {words}, on A4 (297 x 210 mm)\n"));
    assert_eq!(stderr, "");
    let sheet = fs::read_to_string(path.join("c.svg")).unwrap();
    assert!(words.split(", dictionary").next().is_some_and(|w| sheet.contains(w)), "{sheet}");
}

#[test]
fn stmaps_are_written_both_ways() {
    let folder = scene(1);
    let path = folder.path();
    for (name, mark) in [("lens.exr", &[0x76u8, 0x2f, 0x31, 0x01][..]), ("lens.png", b"\x89PNG")] {
        let (stdout, _) = ran(path, 0, &["stmap", "--camera", "pictures/truth.json", "--out", name]);
        assert!(stdout.contains("perspective, 400 x 300 px"), "{stdout}");
        for way in ["undistort", "distort"] {
            let file = name.replace('.', &format!("_{way}."));
            assert!(fs::read(path.join(&file)).unwrap().starts_with(mark), "{file}");
        }
    }
    // A step of 16 bits is 0.006 px here: the map takes a corner of the board from where the lens shows it.
    let truth = Truth::from_json(&fs::read_to_string(path.join("pictures/truth.json")).unwrap()).unwrap();
    let map = image::open(path.join("lens_undistort.png")).unwrap().into_rgb16();
    let view = undistort::new_camera(&truth.camera, 0.0).unwrap();
    for (u, v) in [(20, 30), (200, 150), (380, 290)] {
        let [s, t, _] = map.get_pixel(u, v).0.map(|c| f64::from(c) / 65535.0);
        let ray = view.unproject(&nalgebra::Vector2::new(f64::from(u), f64::from(v))).unwrap();
        let px = truth.camera.project(&ray.into()).unwrap();
        assert!((s * 400.0 - 0.5 - px.x).abs() < 0.01, "{u} {v}: {s} {px}");
        assert!(((1.0 - t) * 300.0 - 0.5 - px.y).abs() < 0.01, "{u} {v}: {t} {px}");
    }
    refused(path, 2, &["stmap", "--camera", "pictures/truth.json", "--out", "lens.tif"], &[".exr or .png"]);
}

#[test]
fn undistort_lays_pictures_out_by_other_projections() {
    let folder = scene(1);
    let path = folder.path();
    let run = |projection, out, more: &[&str]| {
        let args = ["undistort", "pictures", "--camera", "pictures/truth.json", "--projection", projection];
        ran(path, 0, &[&args[..], &["--out", out], more].concat())
    };
    let (stdout, _) = run("equidistant", "e", &["--fov", "60"]);
    assert!(stdout.contains("their camera is e/camera.yaml: kb4, 400 x 300 px"), "{stdout}");
    let camera = |name: &str| format::read_bytes(&fs::read(path.join(name)).unwrap(), name).unwrap().camera;
    let equidistant = camera("e/camera.yaml");
    // 30° to the outer edge of the outermost pixel.
    assert!((equidistant.params[0] - 200.0 / 30f64.to_radians()).abs() < 1e-9, "{equidistant:?}");
    let (stdout, _) = run("stereographic", "s", &[]);
    assert!(stdout.contains("their camera is s/camera.json: eucm"), "{stdout}");
    assert_eq!(camera("s/camera.json").params[4..], [0.5, 1.0]);
    let (stdout, stderr) = run("cylindrical", "c", &["--alpha", "1"]);
    assert!(
        stdout.contains("cylindrical, 400 x 300 px") && stderr.contains("no camera model has such pictures")
    );
    assert_eq!(files(&path.join("c")), ["view_01.png"]);
}

#[test]
fn wrong_use_is_answered_with_the_remedy() {
    let folder = scene(1);
    let path = folder.path();
    fs::create_dir(path.join("empty")).unwrap();
    fs::write(path.join("note.txt"), "hello").unwrap();
    fs::write(path.join("file"), "").unwrap();
    let camera = "pictures/truth.json";
    let undistort = |extra: &[&'static str]| {
        [&["undistort", "pictures", "--camera", camera, "--out", "o"], extra].concat()
    };
    for (args, words) in [
        (
            vec!["undistort", "missing", "--camera", camera, "--out", "o"],
            vec!["missing: no such file or folder"],
        ),
        (
            vec!["undistort", "pictures", "--camera", "missing.yaml", "--out", "o"],
            vec!["missing.yaml: no such file"],
        ),
        (
            vec!["undistort", "pictures", "--camera", "note.txt", "--out", "o"],
            vec!["note.txt", "no camera file format"],
        ),
        (vec!["undistort", "pictures", "--camera", "pictures", "--out", "o"], vec!["this is a folder"]),
        (vec!["undistort", "pictures", "--camera", camera], vec!["--out"]),
        (vec!["undistort", "--camera", camera, "--out", "o"], vec!["PATHS"]),
        (undistort(&["--alpha", "2"]), vec!["\"2\" is not an alpha: give a number from 0 to 1"]),
        (undistort(&["--alpha", "-0.5"]), vec!["from 0 to 1"]),
        (undistort(&["--alpha", "nan"]), vec!["from 0 to 1"]),
        (undistort(&["--interpolation", "cubic"]), vec!["choose bilinear or lanczos"]),
        (vec!["convert", camera, "a.docx"], vec!["does not say which format", "opencv, ros"]),
        (vec!["convert", camera, "caffe:a.yaml"], vec!["\"caffe\" is not a camera file format"]),
        (vec!["convert", "note.txt", "a.yaml"], vec!["note.txt"]),
        (vec!["convert", "pictures/view_01.png", "a.yaml"], vec!["not a text file"]),
        (vec!["convert", camera, "a.yaml", "--scale", "0"], vec!["greater than zero"]),
        (vec!["convert", camera, "a.yaml", "--scale", "-1"], vec!["greater than zero"]),
        (vec!["convert", camera, "a.yaml", "--scale", "1e-9"], vec!["choose another scale"]),
        (
            vec!["convert", camera, "a.yaml", "--crop", "0,0,401,300"],
            vec!["does not lie inside the picture of 400 x 300"],
        ),
        (vec!["convert", camera, "a.yaml", "--crop", "0,0,0,10"], vec!["does not lie inside"]),
        (vec!["convert", camera, "a.yaml", "--crop", "1,2,3"], vec!["x,y,width,height"]),
        (vec!["convert", camera, camera], vec!["this is the file to read"]),
        (vec!["convert", camera, "opencv:pictures/view_01.png"], vec!["view_01.png: this is a photograph"]),
        (
            vec!["calibrate", "pictures", "--out", "a.yaml", "--out", "opencv:pictures/view_01.png"],
            vec!["view_01.png: this is a photograph"],
        ),
        (
            vec!["calibrate", "pictures", "--report", "pictures/view_01.png"],
            vec!["view_01.png: this is a photograph"],
        ),
        (
            vec!["calibrate", "pictures", "--truth", camera, "--out", camera],
            vec!["pictures/truth.json: this is the file to read"],
        ),
        (vec!["convert", camera, "a.yaml", "--crop", "-5,0,100,100"], vec!["\"-5,0,100,100\" is not a crop"]),
        (vec!["pose", "pictures", "--camera", camera, "--board", "9"], vec!["is not a board size"]),
        (vec!["pose", "pictures", "--camera", camera, "--square", "-1mm"], vec!["greater than zero"]),
        (vec!["pose", "missing", "--camera", camera], vec!["missing"]),
        (vec!["synth", "--scene", "missing.json", "--out", "o"], vec!["missing.json: no such file"]),
        (vec!["synth", "--scene", camera, "--out", "o"], vec!["pictures/truth.json"]),
        (vec!["synth", "--poses", "random:0", "--out", "o"], vec!["random:N"]),
        (vec!["synth", "--poses", "20", "--out", "o"], vec!["random:N"]),
        (vec!["synth", "--degrade", "fog=1", "--out", "o"], vec!["not a degradation", "noise"]),
        (vec!["synth", "--degrade", "jpeg=0", "--out", "o"], vec!["quality from 1 to 100"]),
        (vec!["synth", "--size", "0x10", "--out", "o"], vec!["not a picture size"]),
        (vec!["synth", "--origin", "middle", "--out", "o"], vec!["choose outer or inner"]),
        (vec!["synth", "--margin", "-1", "--out", "o"], vec!["margin"]),
        (vec!["synth", "--seed", "-1", "--out", "o"], vec!["--seed"]),
        (
            vec!["board", "--kind", "go", "--size", "9x6", "--square", "25mm", "--out", "b.pdf"],
            vec!["not a kind of board", "charuco, aprilgrid, aruco-grid, circles, acircles"],
        ),
        (
            vec![
                "board", "--kind", "circles", "--size", "9x6", "--square", "25mm", "--legacy", "--out",
                "b.pdf",
            ],
            vec!["--legacy says nothing about a board of kind circles"],
        ),
        (
            vec!["board", "--kind", "charuco", "--size", "40x30", "--square", "25mm", "--out", "b.pdf"],
            vec!["needs the ids 0 to 599", "ends at 249"],
        ),
        (
            vec!["undistort", "pictures", "--camera", camera, "--out", "o", "--projection", "mercator"],
            vec!["perspective, cylindrical, equidistant, stereographic"],
        ),
        (
            vec!["undistort", "pictures", "--camera", camera, "--out", "o", "--fov", "200"],
            vec!["at most 160°, or another projection"],
        ),
        (vec!["board", "--size", "9x6", "--square", "25", "--out", "b.pdf"], vec!["with a unit"]),
        (vec!["board", "--size", "9x6", "--square", "25mm", "--out", "b.png"], vec![".pdf or .svg"]),
        (vec!["board", "--size", "9x6", "--square", "1m", "--out", "b.pdf"], vec!["more than 5 m"]),
        (vec!["board", "--size", "1x6", "--square", "25mm", "--out", "b.pdf"], vec!["is not a board size"]),
    ] {
        refused(path, 2, &args, &words);
    }
    // What cannot be written: ran, but no result.
    for (args, words) in [
        (
            vec!["undistort", "pictures", "--camera", camera, "--out", "file"],
            vec!["this is a file, a folder was expected"],
        ),
        (
            vec!["undistort", "pictures", "--camera", camera, "--out", "file/o"],
            vec!["file/o", "cannot be made"],
        ),
        (vec!["convert", camera, "missing/a.yaml"], vec!["the folder missing does not exist"]),
        (vec!["synth", "--out", "file"], vec!["a folder was expected"]),
        (
            vec!["board", "--size", "9x6", "--square", "25mm", "--out", "no/b.pdf"],
            vec!["the folder no does not exist"],
        ),
        (vec!["experiment", "--out", "file"], vec!["file: this is a file, a folder was expected"]),
    ] {
        refused(path, 1, &args, &words);
    }
    // Nothing to do: ran, but no result.
    refused(
        path,
        1,
        &["undistort", "empty", "--camera", camera, "--out", "o2"],
        &["empty: no pictures were found"],
    );
    refused(path, 1, &["pose", "empty", "--camera", camera], &["empty: no pictures were found"]);
    let left: Vec<PathBuf> =
        ["o", "o2", "a.yaml", "b.pdf"].map(|n| path.join(n)).into_iter().filter(|p| p.exists()).collect();
    assert!(left.is_empty(), "wrong use must leave nothing behind: {left:?}");
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_told_and_a_reader_that_left_is_not() {
    let folder = scene(1);
    let run = |stdout: std::process::Stdio| {
        Command::new(env!("CARGO_BIN_EXE_straightedge"))
            .current_dir(folder.path())
            .args(["convert", "pictures/truth.json", "a.yaml"])
            .stdout(stdout)
            .stderr(std::process::Stdio::piped())
            .spawn()
            .unwrap()
    };
    let full = fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    let out = run(full.into()).wait_with_output().unwrap();
    let stderr = String::from_utf8_lossy(&out.stderr).into_owned();
    assert_eq!(out.status.code(), Some(1), "{stderr}");
    assert!(stderr.contains("standard output: the disk is full"), "{stderr}");
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let out = run(writer.into()).wait_with_output().unwrap();
    assert_eq!((out.status.code(), out.stderr.as_slice()), (Some(0), &b""[..]));
}

#[cfg(unix)]
#[test]
fn links_devices_and_permissions_stay_what_they_are() {
    use std::os::unix::fs::{FileTypeExt as _, PermissionsExt as _, symlink};
    let folder = scene(1);
    let path = folder.path();
    let at = |name: &str| path.join(name);
    fs::write(at("real.yaml"), "old").unwrap();
    fs::set_permissions(at("real.yaml"), fs::Permissions::from_mode(0o640)).unwrap();
    symlink("real.yaml", at("link.yaml")).unwrap();
    ran(path, 0, &["convert", "pictures/truth.json", "link.yaml"]);
    assert!(fs::symlink_metadata(at("link.yaml")).unwrap().is_symlink());
    assert!(fs::read_to_string(at("real.yaml")).unwrap().contains("camera_matrix"));
    ran(path, 0, &["convert", "pictures/truth.json", "real.yaml", "--scale", "0.5"]);
    assert_eq!(fs::metadata(at("real.yaml")).unwrap().permissions().mode() & 0o777, 0o640);
    assert!(Command::new("mkfifo").arg(at("pipe")).status().unwrap().success());
    let pipe = at("pipe");
    let reader = std::thread::spawn(move || fs::read_to_string(pipe).unwrap());
    ran(path, 0, &["convert", "pictures/truth.json", "opencv:pipe"]);
    assert!(fs::metadata(at("pipe")).unwrap().file_type().is_fifo());
    assert!(reader.join().unwrap().contains("camera_matrix"));
}

#[test]
fn another_unit_of_the_square_is_the_same_board_in_the_same_places() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let scene = |square: &str, out: &str| {
        ran(path, 0, &["synth", "--size", "80x60", "--square", square, "--out", out]);
        Scene::from_json(&fs::read_to_string(path.join(out).join("scene.json")).unwrap()).unwrap()
    };
    let (mm, cm, small) = (scene("30mm", "mm"), scene("3cm", "cm"), scene("2.5cm", "small"));
    for ((a, b), c) in mm.poses.iter().zip(&cm.poses).zip(&small.poses) {
        assert_eq!(b.translation, c.translation);
        for k in 0..3 {
            assert!((a.translation[k] - 10.0 * b.translation[k]).abs() < 1e-9, "{a:?} {b:?}");
        }
    }
    for view in 0..mm.poses.len() {
        for (p, q) in mm.corners_px(view).into_iter().zip(cm.corners_px(view)) {
            assert!((p.unwrap() - q.unwrap()).norm() < 1e-9);
        }
    }
    // A bend that the scene had is converted, one that is asked for now is in the unit that is asked for now.
    let mut bent = mm;
    bent.degrade.bend = 5.0;
    fs::write(path.join("bent.json"), bent.to_json()).unwrap();
    ran(path, 0, &["synth", "--scene", "bent.json", "--square", "3cm", "--out", "bent"]);
    let bent = Scene::from_json(&fs::read_to_string(path.join("bent/scene.json")).unwrap()).unwrap();
    assert!((bent.degrade.bend - 0.5).abs() < 1e-12);
}
