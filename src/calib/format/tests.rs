//! Every format over one hand-written calibration, the half pixel, foreign files, and damaged files.

use nalgebra::{Vector2, Vector3};

use super::*;
use crate::calib::camera::Model;

/// The calibration of the snapshots: one frame, 800 × 600.
fn sample() -> (Camera, Evidence) {
    let params = vec![1000.2, 999.9, 399.4, 299.6, -0.28, 0.1, 0.001, 0.002, 0.0];
    let camera = Camera::new(Model::Brown5, [800, 600], params).unwrap();
    let evidence = Evidence {
        name: Some("narrow_stereo".to_owned()),
        make: Some("Acme".to_owned()),
        camera_model: Some("Eye 3".to_owned()),
        date: Some("2026-11-22".to_owned()),
        board: Some(BoardSize { cols: 9, rows: 6 }),
        square: Some(30.0),
        unit: Some(Unit::Mm),
        rms_px: Some(0.12),
        sigma: vec![
            Some(0.5),
            Some(0.25),
            Some(0.125),
            Some(0.5),
            Some(1e-3),
            Some(1e-7),
            None,
            Some(2.5),
            None,
        ],
        covariance: None,
        free: Vec::new(),
        residual: None,
        safe: None,
        frames: vec![Frame {
            file: "images/v01.png".to_owned(),
            camera_from_board: Some(Pose::from_rvec_tvec(
                Vector3::zeros(),
                Vector3::new(-120.0, -75.0, 1000.0),
            )),
            rms_px: Some(0.12),
            corners: Vec::new(),
        }],
    };
    (camera, evidence)
}

fn written(name: &str, camera: &Camera, evidence: &Evidence) -> Written {
    write(by_name(name).unwrap(), &Export { camera, evidence, report: None }).unwrap()
}

fn message(text: &str) -> String {
    read(text, "file").unwrap_err().to_string()
}

#[test]
fn texts_of_the_hand_written_calibration() {
    let (camera, evidence) = sample();
    let golden: [(&str, &str); 11] = [
        ("opencv", include_str!("../../../tests/golden/formats/opencv.yaml")),
        ("ros", include_str!("../../../tests/golden/formats/ros.yaml")),
        ("kalibr", include_str!("../../../tests/golden/formats/kalibr.yaml")),
        ("colmap", include_str!("../../../tests/golden/formats/cameras.txt")),
        ("nerfstudio", include_str!("../../../tests/golden/formats/transforms.json")),
        ("straightedge", include_str!("../../../tests/golden/formats/straightedge.json")),
        ("mrcal", include_str!("../../../tests/golden/formats/mrcal.cameramodel")),
        ("matlab", include_str!("../../../tests/golden/formats/matlab.m")),
        ("metashape", include_str!("../../../tests/golden/formats/metashape.xml")),
        ("gyroflow", include_str!("../../../tests/golden/formats/gyroflow.json")),
        ("opensfm", include_str!("../../../tests/golden/formats/opensfm.json")),
    ];
    for (name, expected) in golden {
        let w = written(name, &camera, &evidence);
        let text = w.text.replace(concat!(env!("CARGO_PKG_VERSION"), "\""), "VERSION\"");
        if std::env::var_os("STRAIGHTEDGE_PRINT_GOLDEN").is_some() {
            println!("=== {name}\n{text}");
        }
        assert_eq!(text, expected, "{name}");
        assert!(w.notes.is_empty() && w.self_check_px < 1e-10, "{name}: {w:?}");
        let file = read(&w.text, "file").unwrap();
        assert_eq!(file.format, name);
        for (a, b) in camera.params.iter().zip(&file.camera.params) {
            assert!((a - b).abs() < 1e-12, "{name}: {:?}", file.camera);
        }
    }
}

#[test]
fn principal_points_obey_the_half_pixel_table() {
    // A camera that is centred for a 640 × 480 picture: (w − 1)/2 here.
    let camera = Camera::new(Model::Pinhole, [640, 480], vec![500.0, 500.0, 319.5, 239.5]).unwrap();
    let e = Evidence::default();
    for (name, marks) in [
        ("opencv", ["319.5", "239.5"]),
        ("ros", ["319.5", "239.5"]),
        ("kalibr", ["319.5", "239.5"]),
        ("mrcal", ["319.5", "239.5"]),
        ("basalt", ["\"cx\": 319.5", "\"cy\": 239.5"]),
        ("straightedge", ["\"cx\": 319.5", "\"cy\": 239.5"]),
        ("colmap", [" 320.0 ", " 240.0"]),
        ("nerfstudio", ["\"cx\": 320.0", "\"cy\": 240.0"]),
        ("matlab", ["[320.5 ", " 240.5]"]),
        ("metashape", ["<cx>0.0</cx>", "<cy>0.0</cy>"]),
        ("gyroflow", ["319.5", "239.5"]),
        ("opensfm", ["\"c_x\": 0.0", "\"c_y\": 0.0"]),
    ] {
        let text = written(name, &camera, &e).text;
        for mark in marks {
            assert!(text.contains(mark), "{name}: {mark} in {text}");
        }
        assert_eq!(read(&text, "file").unwrap().camera, camera, "{name}");
    }
    assert_eq!(FORMATS.len(), 12);
}

#[test]
fn matlab_gives_rows_before_columns_and_metashape_swaps_the_tangential_terms() {
    let (camera, e) = sample();
    assert!(written("matlab", &camera, &e).text.contains("[600 800]"));
    let text = written("metashape", &camera, &e).text;
    assert!(
        text.contains("<p1>0.002</p1>") && text.contains("<p2>0.001</p2>") && text.contains("<f>999.9</f>")
    );
}

#[test]
fn a_skew_has_a_place_or_its_error_is_told() {
    let params = vec![600.0, 590.0, 320.0, 240.0, 0.12, -0.05, -2e-3, 1e-3, 0.01, 3.5];
    let camera = Camera::new(Model::Brown5Skew, [640, 480], params).unwrap();
    for f in FORMATS {
        let w = write(f, &Export { camera: &camera, evidence: &Evidence::default(), report: None }).unwrap();
        let back = read(&w.text, "file").unwrap().camera;
        if matches!(f.name, "matlab" | "metashape" | "straightedge") {
            assert!(w.notes.is_empty() && w.self_check_px < 1e-9, "{}: {w:?}", f.name);
            assert_eq!(back.model, Model::Brown5Skew, "{}", f.name);
            assert!(camera.params.iter().zip(&back.params).all(|(a, b)| (a - b).abs() < 1e-12), "{}", f.name);
        } else {
            assert!(w.notes.iter().any(|n| n.contains("largest error")), "{}: {:?}", f.name, w.notes);
            assert!(w.self_check_px > 1e-3 && w.self_check_px < 5.0, "{}: {}", f.name, w.self_check_px);
        }
    }
    let e = Evidence::default();
    assert!(written("matlab", &camera, &e).text.contains("'Skew', 3.5"));
    assert!(written("metashape", &camera, &e).text.contains("<b2>3.5</b2>"));
    // As MATLAB's own matrices have it; the old one is transposed.
    for matrix in
        ["'K', [600 3.5 321; 0 590 241; 0 0 1]", "'IntrinsicMatrix', [600 0 0; 3.5 590 0; 321 241 1]"]
    {
        let script = format!(
            "p = cameraParameters({matrix}, 'ImageSize', [480 640], 'RadialDistortion', [0.1 -0.05]);"
        );
        let read = read(&script, "p.m").unwrap().camera;
        assert_eq!(read.model, Model::Brown5Skew);
        assert_eq!(read.params, [600.0, 590.0, 320.0, 240.0, 0.1, -0.05, 0.0, 0.0, 0.0, 3.5]);
    }
}

#[test]
fn terms_without_a_place_are_refitted_and_reported() {
    let params = vec![600.0, 590.0, 320.0, 240.0, 0.12, -0.05, -2e-3, 1e-3, 0.01];
    let camera = Camera::new(Model::Brown5, [640, 480], params).unwrap();
    for f in FORMATS {
        let w = write(f, &Export { camera: &camera, evidence: &Evidence::default(), report: None }).unwrap();
        let refitted = matches!(f.name, "kalibr" | "nerfstudio" | "basalt");
        assert_eq!(
            refitted,
            w.notes.iter().any(|n| n.contains("largest error")),
            "{}: {:?}",
            f.name,
            w.notes
        );
        assert!(w.self_check_px < if refitted { 2.0 } else { 1e-9 }, "{}: {}", f.name, w.self_check_px);
        assert!(!refitted || w.self_check_px > 1e-9, "{}", f.name);
    }
    assert!(written("colmap", &camera, &Evidence::default()).text.contains("1 FULL_OPENCV 640 480 "));
}

#[test]
fn poses_survive_where_the_format_has_them() {
    let (camera, mut evidence) = sample();
    let pose = Pose::from_euler_deg([20.0, -15.0, 70.0], Vector3::new(-100.0, 40.0, 900.0));
    evidence.frames[0].camera_from_board = Some(pose);
    for name in ["opencv", "nerfstudio", "straightedge"] {
        let back = read(&written(name, &camera, &evidence).text, "file").unwrap();
        let other = back.evidence.frames[0].camera_from_board.unwrap();
        assert!((other.matrix() - pose.matrix()).norm() < 1e-14, "{name}");
        assert!((other.translation - pose.translation).norm() < 1e-11, "{name}");
        assert_eq!(back.evidence.frames[0].file, "images/v01.png", "{name}");
    }
    // OpenGL looks along −z with y up: the board in front has negative z in its camera.
    let text = written("nerfstudio", &camera, &sample().1).text;
    assert!(
        text.contains("[[1.0, 0.0, 0.0, 120.0], [0.0, -1.0, 0.0, 75.0], [0.0, 0.0, -1.0, -1000.0]"),
        "{text}"
    );
}

#[test]
fn own_json_is_exact_and_reads_reports_and_truth() {
    let (mut camera, mut evidence) = sample();
    camera.params = camera.params.iter().map(|v| v / 3.0 + 0.1).collect();
    evidence.free = vec![0, 1, 2, 3, 4, 5, 7];
    evidence.covariance = Some(DMatrix::from_fn(7, 7, |i, j| 1.0 / (1.0 + i as f64 + j as f64)));
    evidence.frames[0].corners = vec![Corner { index: 3, px: Vector2::new(0.1 + 0.2, 1e-7), sigma_px: 0.02 }];
    // These are of the pictures, and stand in the groups of a report.
    (evidence.date, evidence.make, evidence.camera_model) = (None, None, None);
    let back = read(&written("straightedge", &camera, &evidence).text, "a.json").unwrap();
    assert_eq!(back.camera, camera);
    assert_eq!(back.evidence, evidence);

    let truth = r#"{"camera": {"model": "brown5", "size_px": [640, 480], "camera_matrix": {"fx": 800.0, "fy": 802.0, "cx": 321.0, "cy": 239.0},
        "distortion": {"k1": -0.1, "k2": 0.01, "p1": 0.0, "p2": 0.0, "k3": 0.0}}, "board": "9x6", "square": 30.0, "unit": "mm",
        "frames": [{"file": "v01.png", "rvec_rad": [0.0, 0.1, 0.0], "tvec": [0.0, 0.0, 900.0], "corners": [[0, 1.5, 2.5]]}]}"#;
    let truth = read(truth, "truth.json").unwrap();
    assert_eq!(truth.camera.params[1], 802.0);
    assert_eq!(truth.evidence.board.map(|b| b.to_string()).as_deref(), Some("9x6"));
    assert_eq!(truth.evidence.frames[0].corners[0].px, Vector2::new(1.5, 2.5));
    assert_eq!((truth.evidence.square, truth.evidence.unit), (Some(30.0), Some(Unit::Mm)));
}

#[test]
fn files_of_other_tools_are_read() {
    let k = [1000.2, 999.9, 399.4, 299.6];
    let d = [-0.28, 0.1, 0.001, 0.002, 0.0];
    let full: Vec<f64> = k.iter().chain(&d).copied().collect();
    for (format, text) in [
        ("opencv", include_str!("../../../tests/golden/formats/foreign/opencv5.yaml")),
        ("opencv", include_str!("../../../tests/golden/formats/foreign/opencv4.xml")),
        ("opencv", include_str!("../../../tests/golden/formats/foreign/opencv.json")),
        ("opencv", include_str!("../../../tests/golden/formats/foreign/opencv_interactive.xml")),
        ("ros", include_str!("../../../tests/golden/formats/foreign/ost.txt")),
        ("ros", include_str!("../../../tests/golden/formats/foreign/ros_rational.yaml")),
        ("kalibr", include_str!("../../../tests/golden/formats/foreign/kalibr_two.yaml")),
        ("colmap", "1 OPENCV 800 600 1000.2 999.9 399.9 300.1 -0.28 0.1 0.001 0.002"),
        ("colmap", "7 FULL_OPENCV 800 600 1000.2 999.9 399.9 300.1 -0.28 0.1 0.001 0.002 0 0 0 0\n"),
        (
            "nerfstudio",
            r#"{"camera_model":"OPENCV","fl_x":1000.2,"fl_y":999.9,"cx":399.9,"cy":300.1,"w":800,"h":600,"k1":-0.28,"k2":0.1,"p1":0.001,"p2":0.002,"frames":[]}"#,
        ),
        (
            "nerfstudio",
            r#"{"frames":[{"fl_x":1000.2,"fl_y":999.9,"cx":399.9,"cy":300.1,"w":800,"h":600,"k1":-0.28,"k2":0.1,"p1":0.001,"p2":0.002}]}"#,
        ),
        (
            "mrcal",
            "# made by hand\n{ 'lens_model': 'LENSMODEL_OPENCV8', 'intrinsics': [ 1000.2, 999.9, 399.4, 299.6, -0.28, .10, 1e-3, 0.002, 0,0,0,0,],\n 'extrinsics': [0,0,0,0,0,0], 'imagersize': (800, 600,), 'valid_intrinsics_region': [[0,0],[1,1],],\n 'optimization_inputs': b'abc{}', }\n",
        ),
        (
            "mrcal",
            "{'lensmodel': \"LENSMODEL_OPENCV4\", 'intrinsics': [1000.2,999.9,399.4,299.6,-0.28,.10,1e-3,0.002], 'imagersize': [800,600]}",
        ),
        (
            "matlab",
            "intrinsics = cameraIntrinsics([1000.2 999.9],[400.4 300.6],[600 800],RadialDistortion=[-0.28 0.10 0.0],TangentialDistortion=[0.001 0.002]);",
        ),
        (
            "matlab",
            "% comment\nf = [1000.2, 999.9];\npp = [400.4 300.6];\nimageSize = [600 800];\nc = cameraIntrinsics(f, pp, imageSize, ...\n  \"RadialDistortion\", [-0.28 0.1], 'TangentialDistortion',[0.001,0.002]); disp(c)",
        ),
        (
            "matlab",
            "p = cameraParameters('IntrinsicMatrix',[1000.2 0 0; 0 999.9 0; 400.4 300.6 1],'RadialDistortion',[-0.28 0.1],'TangentialDistortion',[0.001 0.002],'ImageSize',[600 800]);",
        ),
        (
            "matlab",
            "K = [1000.2 0 400.4\n 0 999.9 300.6\n 0 0 1];\np = cameraParameters('K',K,'RadialDistortion',[-0.28 0.1],'TangentialDistortion',[0.001 0.002],'ImageSize',[600 800]);",
        ),
        (
            "metashape",
            "<calibration type=\"frame\" class=\"adjusted\"><resolution width=\"800\" height=\"600\"/><f>999.9</f><cx>-0.1</cx><cy>0.1</cy><b1>0.3</b1><k1>-0.28</k1><k2>0.10</k2><p1>0.002</p1><p2>0.001</p2></calibration>",
        ),
        ("metashape", include_str!("../../../tests/golden/formats/foreign/metashape_cameras.xml")),
        (
            "gyroflow",
            r#"{"calib_dimension": {"w": 800, "h": 600}, "asymmetrical": true, "distortion_model": "opencv_standard", "fisheye_params": {"camera_matrix": [[1000.2, 0, 399.4], [0, 999.9, 299.6], [0, 0, 1]], "distortion_coeffs": [-0.28, 0.1, 0.001, 0.002, 0, 0, 0, 0, 0, 0, 0, 0]}}"#,
        ),
        (
            "opensfm",
            r#"{"v2 acme eye 800 600 brown 1.2": {"projection_type": "brown", "width": 800, "height": 600, "focal_x": 1.25025, "focal_y": 1.249875, "c_x": -0.000125, "c_y": 0.000125, "k1": -0.28, "k2": 0.1, "p1": 0.001, "p2": 0.002, "k3": 0.0}}"#,
        ),
    ] {
        let file = read(text, "file").unwrap_or_else(|e| panic!("{format}: {e}\n{text}"));
        assert_eq!(file.format, format, "{text}");
        assert_eq!(file.camera.size_px, [800, 600], "{text}");
        for (a, b) in full.iter().zip(&file.camera.params) {
            assert!((a - b).abs() < 1e-9, "{format}: {:?}\n{text}", file.camera.params);
        }
    }
    let simple = |text: &str| read(text, "cameras.txt").unwrap().camera.params;
    assert_eq!(simple("1 SIMPLE_PINHOLE 640 480 500 320 240\n"), [500.0, 500.0, 319.5, 239.5]);
    assert_eq!(simple("1 SIMPLE_RADIAL 640 480 500 320 240 0.1\n")[4..], [0.1, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(simple("1 RADIAL 640 480 500 320 240 0.1 0.2\n")[..6], [500.0, 500.0, 319.5, 239.5, 0.1, 0.2]);
    let angle = r#"{"camera_angle_x": 1.5707963267948966, "w": 640, "h": 480, "frames": []}"#;
    assert!((read(angle, "t.json").unwrap().camera.params[0] - 320.0).abs() < 1e-9);
    let perspective = r#"{"a": {"projection_type": "perspective", "width": 640, "height": 480, "focal": 0.78125, "k1": 0.1, "k2": 0.2}}"#;
    assert_eq!(
        read(perspective, "c.json").unwrap().camera.params[..6],
        [500.0, 500.0, 319.5, 239.5, 0.1, 0.2]
    );
    let two =
        read("1 PINHOLE 640 480 500 500 320 240\n2 PINHOLE 64 48 50 50 32 24\n", "cameras.txt").unwrap();
    assert!(two.notes[0].contains("2 cameras"), "{:?}", two.notes);
    let renamed = read("1 PINHOLE 640 480 500 500 320 240\n", "cameras.yaml").unwrap();
    assert!(renamed.notes[0].contains("cameras.yaml: read as colmap"), "{:?}", renamed.notes);
}

#[test]
fn wrong_files_say_what_is_wrong() {
    let (camera, evidence) = sample();
    let opencv = written("opencv", &camera, &evidence).text;
    let ros = written("ros", &camera, &evidence).text;
    let json = written("straightedge", &camera, &evidence).text;
    let xml = written("metashape", &camera, &evidence).text;
    let gyroflow = written("gyroflow", &camera, &evidence).text;
    let opensfm = written("opensfm", &camera, &evidence).text;
    for (text, expected) in [
        (String::new(), "file is empty"),
        ("hello".to_owned(), "no camera file format was recognised"),
        (opencv.replace("1000.2", ".Nan"), "must be a finite number"),
        (opencv.replace("1000.2", "-.Inf"), "must be a finite number"),
        (opencv.replace("1000.2", "0."), "fx is 0"),
        (opencv.replace("1000.2", "-5"), "fx is -5"),
        (opencv.replace("1000.2, ", ""), "camera_matrix has 8 numbers"),
        (opencv.replace("image_width: 800\n", ""), "picture size is missing"),
        (opencv.replace("image_width: 800", "image_width: 0"), "whole numbers of pixels"),
        (opencv.replace("image_width: 800", "image_width: 800.5"), "whole numbers of pixels"),
        (opencv.replace("image_width: 800", "image_size: [640, 480]\nimage_width: 800"), "contradict"),
        (opencv.replace("distortion_coefficients", "lens"), "distortion_coefficients is missing"),
        (opencv.replace("0.0, 399.4", "0.5, 399.4"), "skew"),
        (opencv.split("data").next().unwrap().to_owned(), "camera_matrix has no data"),
        (ros.replace("plumb_bob", "thin_prism"), "thin_prism is not supported"),
        (ros.replace("plumb_bob", "equidistant"), "the fisheye (equidistant) model has 4"),
        (ros.replace("cols: 5", "cols: 4"), "distortion_coefficients has 5 numbers"),
        (ros.replace("image_height: 600", "image_height: high"), "image_height must be a number"),
        (json.replace("\"cy\": 299.6", "\"cy\": NaN"), "not valid JSON"),
        (json.replace("\"cy\": 299.6", "\"cz\": 299.6"), "cy is missing"),
        (json.replace("\"k3\"", "\"k9\""), "has no parameter k9"),
        (json.replace("brown5", "brown6"), "not a camera model"),
        (json.chars().take(300).collect(), "not valid JSON"),
        (xml.replace("</calibration>", ""), "not valid XML"),
        (xml.replace("<k3>", "<p3>0.4</p3><k3>"), "p3 = 0.4"),
        (xml.replace("frame", "spherical"), "spherical is not supported"),
        (xml.replace("frame", "fisheye"), "p1 = 0.002"),
        ("<calibration><fx>1</fx></calibration>".to_owned(), "PhotoScan before 1.2"),
        ("1 OPENCV 800 600 1000 1000 400 300 0 0 0\n".to_owned(), "has 8 parameters, 7 were found"),
        ("1 PINHOLE 800 600 1 1 400 300\n".to_owned(), "fx of 1e0 px contradicts the picture"),
        ("1 PINHOLE 800 600 900 9e8 400 300\n".to_owned(), "fy of 9e8 px contradicts the picture"),
        ("1 PINHOLE 800 600 900 900 -8001 300\n".to_owned(), "cx of -8"),
        ("1 PINHOLE 800 600 900 900 400 1e300\n".to_owned(), "cy of 1e300 px contradicts the picture"),
        ("{'lensmodel': 'LENSMODEL_OPENCV8', 'intrinsics': [1,2,3".to_owned(), "line 1: the file is cut off"),
        (
            "{'lensmodel': 'LENSMODEL_CAHVOR', 'intrinsics': [], 'imagersize': [8,6]}".to_owned(),
            "LENSMODEL_CAHVOR is not",
        ),
        ("c = cameraIntrinsics([1 2],[3 4]".to_owned(), "cut off"),
        ("c = cameraIntrinsics(f,[3 4],[5 6])".to_owned(), "variable f is not assigned"),
        (
            "cam0:\n  camera_model: omni\n  intrinsics: [1.0]\n".to_owned(),
            "camera_model omni is not supported",
        ),
        (r#"{"value0": {"intrinsics": [], "resolution": []}}"#.to_owned(), "at least one camera"),
        (gyroflow.replace("opencv_standard", "gopro"), "distortion_model gopro is not supported"),
        (
            gyroflow.replace("\"input_horizontal_stretch\": 1.0", "\"input_horizontal_stretch\": 1.33"),
            "anamorphic",
        ),
        (gyroflow.replace("\"w\": 800", "\"w\": 0"), "whole numbers of pixels"),
        (gyroflow.replace("opencv_standard", "opencv_fisheye"), "the fisheye (equidistant) model has 4"),
        (opensfm.replace("\"brown\"", "\"spherical\""), "projection_type spherical is not supported"),
        (opensfm.replace("focal_y", "focal_z"), "focal_y is missing"),
    ] {
        let m = message(&text);
        assert!(m.contains(expected) && m.starts_with("file"), "{expected:?} in {m:?} for {text}");
    }
    assert!(read_bytes(&[0xff, 0xd8, 0xff], "a.yaml").unwrap_err().to_string().contains("not a text file"));
}

#[test]
fn own_json_may_not_contradict_itself() {
    let (camera, evidence) = sample();
    let flat: serde_json::Value =
        serde_json::from_str(&written("straightedge", &camera, &evidence).text).unwrap();
    let mut both = flat.clone();
    both["cameras"] = serde_json::json!([{
        "image_size_px": flat["image_size_px"], "model": "brown5",
        "camera_matrix": flat["camera_matrix"], "distortion": flat["distortion"],
    }]);
    assert_eq!(read(&both.to_string(), "c.json").unwrap().camera, camera);
    let with = |pointer: &str, value: serde_json::Value| {
        let mut json = both.clone();
        *json.pointer_mut(pointer).unwrap() = value;
        json.to_string()
    };
    // Rounding of another program is no contradiction.
    assert!(read(&with("/camera_matrix/fx", (1000.2 + 1e-10).into()), "c.json").is_ok());
    for (pointer, value, says) in [
        (
            "/camera_matrix/fx",
            serde_json::json!(1200.0),
            "fx is 1200 at the top of the file, but 1000.2 in cameras[0]",
        ),
        ("/cameras/0/distortion/k1", serde_json::json!(-0.2), "k1 is -0.28 at the top"),
        ("/image_size_px", serde_json::json!([1920, 1080]), "image_size_px is [1920, 1080] at the top"),
        ("/model", serde_json::json!("pinhole"), "the model pinhole has no parameter k1"),
        ("/model", serde_json::json!("fisheye"), "not a camera model"),
        ("/model", serde_json::Value::Null, "model is null"),
        ("/camera_matrix", serde_json::Value::Null, "camera_matrix is null"),
        ("/distortion", serde_json::Value::Null, "distortion is null"),
        ("/image_size_px", serde_json::Value::Null, "image_size_px is null"),
        ("/camera_matrix/cy", serde_json::Value::Null, "cy is missing"),
        ("/cameras", serde_json::Value::Null, "cameras must be a list"),
        ("/cameras", serde_json::json!([]), "cameras must be a list"),
        ("/cameras/0/model", serde_json::json!(5), "model must be the name"),
    ] {
        let m = message(&with(pointer, value));
        assert!(m.starts_with("file (straightedge)") && m.contains(says), "{pointer}: {m}");
    }
}

#[test]
fn equidistant_texts_are_read_wherever_they_come_from() {
    let k = "-0.02, 0.01, -0.003, 0.0004";
    for (format, text) in [
        ("ros", format!("image_width: 640\nimage_height: 480\ncamera_matrix:\n  data: [500.0, 0.0, 319.5, 0.0, 501.0, 239.5, 0.0, 0.0, 1.0]\ndistortion_model: equidistant\ndistortion_coefficients:\n  data: [{k}]\n")),
        ("kalibr", format!("cam0:\n  camera_model: pinhole\n  distortion_model: equidistant\n  distortion_coeffs: [{k}]\n  intrinsics: [500.0, 501.0, 319.5, 239.5]\n  resolution: [640, 480]\n")),
        ("colmap", format!("1 OPENCV_FISHEYE 640 480 500 501 320 240 {}\n", k.replace(',', ""))),
        ("nerfstudio", "{\"camera_model\": \"OPENCV_FISHEYE\", \"fl_x\": 500, \"fl_y\": 501, \"cx\": 320, \"cy\": 240, \"w\": 640, \"h\": 480, \"k1\": -0.02, \"k2\": 0.01, \"k3\": -0.003, \"k4\": 0.0004, \"frames\": []}".to_owned()),
        ("opencv", format!("%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\nfisheye_model: 1\ncameraMatrix: [500., 0., 319.5, 0., 501., 239.5, 0., 0., 1.]\ndistCoeffs: [{k}]\n")),
        ("gyroflow", format!("{{\"calib_dimension\": {{\"w\": 640, \"h\": 480}}, \"asymmetrical\": true, \"fisheye_params\": {{\"camera_matrix\": [[500, 0, 319.5], [0, 501, 239.5], [0, 0, 1]], \"distortion_coeffs\": [{k}]}}}}")),
        ("opensfm", "{\"v2 a b 640 480 fisheye_opencv 0.78\": {\"projection_type\": \"fisheye_opencv\", \"width\": 640, \"height\": 480, \"focal_x\": 0.78125, \"focal_y\": 0.7828125, \"c_x\": 0, \"c_y\": 0, \"k1\": -0.02, \"k2\": 0.01, \"k3\": -0.003, \"k4\": 0.0004}}".to_owned()),
        ("basalt", "{\"value0\": {\"intrinsics\": [{\"camera_type\": \"kb4\", \"intrinsics\": {\"fx\": 500, \"fy\": 501, \"cx\": 319.5, \"cy\": 239.5, \"k1\": -0.02, \"k2\": 0.01, \"k3\": -0.003, \"k4\": 0.0004}}], \"resolution\": [[640, 480]]}}".to_owned()),
    ] {
        let file = read(&text, "file").unwrap_or_else(|e| panic!("{format}: {e}"));
        assert_eq!((file.format, file.camera.model), (format, Model::Kb4));
        assert_eq!(file.camera.params, [500.0, 501.0, 319.5, 239.5, -0.02, 0.01, -0.003, 0.0004], "{format}");
        assert!(file.notes.is_empty(), "{:?}", file.notes);
    }
}

#[test]
fn every_model_goes_through_every_format_or_the_loss_is_told() {
    for model in Model::ALL {
        for params in model.spec().examples {
            let camera = Camera::new(model, [640, 480], params.to_vec()).unwrap();
            for f in FORMATS {
                let export = Export { camera: &camera, evidence: &Evidence::default(), report: None };
                match write(f, &export) {
                    Ok(w) => {
                        let refitted = w.notes.iter().any(|n| n.contains("largest error"));
                        assert!(
                            refitted || w.self_check_px < 1e-8,
                            "{model} {}: {}",
                            f.name,
                            w.self_check_px
                        );
                        let back =
                            read(&w.text, "file").unwrap_or_else(|e| panic!("{model} {}: {e}", f.name));
                        assert_eq!(back.format, f.name, "{}", w.text);
                    }
                    Err(e) => {
                        let e = e.to_string();
                        assert!(e.contains("has no model for this lens"), "{model} {}: {e}", f.name);
                        assert!(
                            ["beyond 90°", "useless", "folds"].iter().any(|w| e.contains(w)),
                            "{model} {}: {e}",
                            f.name
                        );
                    }
                }
            }
            let own = written("straightedge", &camera, &Evidence::default());
            assert_eq!(read(&own.text, "file").unwrap().camera, camera);
        }
    }
}

#[test]
fn an_angle_that_contradicts_the_focal_length_is_a_note() {
    let with = |angle: f64| {
        read(
            &format!(
                "{{\"fl_x\": 320, \"camera_angle_x\": {angle}, \"w\": 640, \"h\": 480, \"frames\": []}}"
            ),
            "t.json",
        )
        .unwrap()
    };
    assert!(with(std::f64::consts::FRAC_PI_2).notes.is_empty());
    let file = with(1.0);
    assert_eq!(file.camera.params[0], 320.0);
    assert!(file.notes[0].contains("camera_angle_x means a focal length of 585.8 px"), "{:?}", file.notes);
}

#[test]
fn the_photographs_make_and_model_reach_the_programs_that_ask_for_them() {
    let (camera, mut evidence) = sample();
    let opensfm = written("opensfm", &camera, &evidence);
    assert!(opensfm.text.contains("\"v2 acme eye 3 800 600 brown 1.2503\": {"), "{}", opensfm.text);
    let profile = read(&written("gyroflow", &camera, &evidence).text, "lens.json").unwrap();
    assert_eq!(profile.evidence.make.as_deref(), Some("Acme"));
    assert_eq!(profile.evidence.camera_model.as_deref(), Some("Eye 3"));
    (evidence.make, evidence.camera_model) = (None, None);
    let unknown = written("opensfm", &camera, &evidence);
    assert!(unknown.text.contains("\"v2 unknown unknown 800 600") && unknown.notes[0].contains("EXIF"));

    // From the groups of a report, and from its JSON.
    let mut report = Report::new(crate::calib::report::Settings::default(), vec![], vec![], vec![]);
    report.groups.push(crate::calib::report::GroupReport {
        name: "all".to_owned(),
        reason: String::new(),
        images: 1,
        found: 1,
        make: Some("Acme".to_owned()),
        model: Some("Eye 3".to_owned()),
    });
    let known = Evidence::from(&report);
    assert_eq!((known.make.as_deref(), known.camera_model.as_deref()), (Some("Acme"), Some("Eye 3")));
    let text = written("straightedge", &camera, &Evidence::default()).text;
    let with = text.replacen('{', "{\"groups\": [{\"make\": \"Acme\", \"model\": \"Eye 3\"}],", 1);
    assert_eq!(read(&with, "camera.json").unwrap().evidence.make.as_deref(), Some("Acme"));
}

#[test]
fn gyroflow_centres_a_profile_that_is_not_asymmetrical() {
    let (camera, evidence) = sample();
    let text = written("gyroflow", &camera, &evidence).text;
    let file = read(&text.replace("\"asymmetrical\": true", "\"asymmetrical\": false"), "lens.json").unwrap();
    assert_eq!(file.camera.intrinsics()[2..], [400.0, 300.0]);
    assert!(file.notes[0].contains("the middle of the picture"), "{:?}", file.notes);
}

/// Deterministic stand-in for a fuzzer: nothing may panic, whatever the bytes.
#[test]
fn damaged_files_never_panic() {
    let (camera, evidence) = sample();
    let foreign = [
        include_str!("../../../tests/golden/formats/foreign/ost.txt").to_owned(),
        include_str!("../../../tests/golden/formats/foreign/opencv4.xml").to_owned(),
        "f = [1 2];\nc = cameraParameters('IntrinsicMatrix',[1 0 0; 0 9 0; 4 3 1],'RadialDistortion',f,'ImageSize',[6 8]);".to_owned(),
    ];
    // Basalt's text is that of a pinhole: a refit for each damage would take minutes.
    let pinhole = Camera::new(Model::Pinhole, camera.size_px, camera.params[..4].to_vec()).unwrap();
    let text = |f: &Format| {
        let camera = if f.name == "basalt" { &pinhole } else { &camera };
        let evidence = if f.name == "basalt" { &Evidence::default() } else { &evidence };
        written(f.name, camera, evidence).text
    };
    let texts = FORMATS.iter().map(text).chain(foreign);
    for text in texts {
        for i in 0..text.len() {
            if text.is_char_boundary(i) {
                let _ = read(&text[..i], "prefix");
            }
            let all = *b"\0\n -9.e[{\":%<&#\xff";
            for byte in all.into_iter().skip(i % 4).step_by(4) {
                let mut bytes = text.as_bytes().to_vec();
                bytes[i] = byte;
                let _ = read_bytes(&bytes, "corrupt");
                let _ = read(&String::from_utf8_lossy(&bytes), "corrupt");
            }
        }
    }
}

#[test]
fn hostile_files_are_refused_quickly() {
    let deep = |open: &str| format!("camera_matrix: {}", open.repeat(200_000));
    for text in [
        deep("["),
        deep("{a: "),
        deep("- "),
        format!("{{\"camera_matrix\": {}", "[".repeat(200_000)),
        format!("<calibration>{}", "<a>".repeat(200_000)),
        format!("{{'lensmodel': {}", "[".repeat(200_000)),
        format!("c = cameraIntrinsics({}", "[".repeat(200_000)),
        (0..20_000).map(|i| format!("{}camera_matrix:\n", " ".repeat(i % 300))).collect(),
        "camera_matrix:\n  a: &a [1,1,1,1,1,1,1,1,1]\n".to_owned()
            + &(b'b'..b'z').map(|c| {
                let (n, p) = (char::from(c), char::from(c - 1));
                format!("  {n}: &{n} [*{p},*{p},*{p},*{p},*{p},*{p},*{p},*{p},*{p}]\n")
            }).collect::<String>(),
        "<!DOCTYPE c [<!ENTITY a \"aaaaaaaaaa\"><!ENTITY b \"&a;&a;&a;&a;\">]><calibration><f>&b;</f></calibration>".to_owned(),
        "intrinsics = cameraIntrinsics(a,a,a);\na = b;\nb = a;".to_owned(),
    ] {
        assert!(read(&text, "file").is_err());
    }
}
