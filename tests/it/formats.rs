//! Every format over the examples of the models that nearly all of them have; the others are in the unit tests of `format`.

use nalgebra::{Vector2, Vector3};
use straightedge::calib::{
    camera::{Camera, Model},
    format::{Evidence, Export, FORMATS, Format, Frame, read, write},
    observation::Corner,
    pose::Pose,
    synth::Scene,
};

fn examples() -> impl Iterator<Item = Camera> {
    [Model::Pinhole, Model::Brown5].into_iter().flat_map(|model| {
        model.spec().examples.iter().map(move |p| Camera::new(model, [640, 480], p.to_vec()).unwrap())
    })
}

fn file_name(format: &Format) -> String {
    format!("camera.{}", format.usual[0])
}

/// Largest difference of two cameras over a grid of pixels, px.
fn difference_px(a: &Camera, b: &Camera) -> f64 {
    let [w, h] = a.size_px.map(f64::from);
    let mut worst = 0.0f64;
    for j in 0..=15 {
        for i in 0..=20 {
            let px = Vector2::new(w * f64::from(i) / 20.0 - 0.5, h * f64::from(j) / 15.0 - 0.5);
            let Some(ray) = a.unproject(&px) else { continue };
            worst = worst.max((b.project(&ray.into()).unwrap() - px).norm());
        }
    }
    worst
}

/// The largest error that a note names, px.
fn reported_px(notes: &[String]) -> f64 {
    let number = |n: &String| n.split_once("largest error ")?.1.split(' ').next()?.parse().ok();
    notes.iter().find_map(number).unwrap()
}

#[test]
fn every_camera_survives_or_its_error_is_reported() {
    for camera in examples() {
        for format in FORMATS {
            let name = format.name;
            let written =
                write(format, &Export { camera: &camera, evidence: &Evidence::default(), report: None })
                    .unwrap();
            let refitted = written.notes.iter().any(|n| n.contains("largest error") && n.contains("RMS"));
            let file = read(&written.text, &file_name(format)).unwrap_or_else(|e| panic!("{name}: {e}"));
            assert_eq!((file.format, file.camera.size_px), (name, camera.size_px));
            let px = difference_px(&camera, &file.camera);
            if refitted {
                // The note says what the file really does, to the grid's density.
                let reported = reported_px(&written.notes);
                assert!(px > 1e-9 && px < 1.05 * reported, "{name}: {px} px, {:?}", written.notes);
                assert!(written.self_check_px < 1.05 * reported && reported < 6.0, "{name}: {written:?}");
            } else {
                assert!(px <= 1e-9 && written.self_check_px <= 1e-9, "{name}: {px:e} px");
            }
        }
    }
}

#[test]
fn only_the_formats_without_k3_refit() {
    for camera in examples() {
        let distorted = camera.distortion().any(|(_, v)| v != 0.0);
        let has_k3 = camera.get("k3").is_some_and(|v| v != 0.0);
        for format in FORMATS {
            let written =
                write(format, &Export { camera: &camera, evidence: &Evidence::default(), report: None })
                    .unwrap();
            let expected = match format.name {
                "kalibr" | "nerfstudio" => has_k3,
                "basalt" => distorted,
                _ => false,
            };
            let refitted = written.notes.iter().any(|n| n.contains("largest error"));
            assert_eq!(refitted, expected, "{}: {:?}", format.name, written.notes);
        }
    }
}

#[test]
fn a_converted_file_keeps_what_the_target_can_hold() {
    let camera = examples().last().unwrap();
    let evidence = Evidence {
        frames: vec![Frame {
            file: "a.png".to_owned(),
            camera_from_board: Some(Pose::from_rvec_tvec(
                Vector3::new(0.1, -0.2, 0.3),
                Vector3::new(-90.0, -60.0, 800.0),
            )),
            rms_px: Some(0.25),
            corners: vec![Corner { index: 0, px: Vector2::new(100.0, 50.0), sigma_px: 0.02 }],
        }],
        rms_px: Some(0.25),
        sigma: camera.params.iter().map(|_| Some(0.5)).collect(),
        ..Evidence::default()
    };
    let json = FORMATS.iter().find(|f| f.name == "straightedge").unwrap();
    let text = write(json, &Export { camera: &camera, evidence: &evidence, report: None }).unwrap().text;
    let file = read(&text, "camera.json").unwrap();
    let half = file.scaled(0.5).unwrap();
    assert_eq!((half.camera.size_px, half.evidence.rms_px), ([320, 240], Some(0.125)));
    assert_eq!(half.evidence.sigma[3..5], [Some(0.25), Some(0.5)]);
    assert_eq!(half.evidence.frames[0].corners[0].px, Vector2::new(49.75, 24.75));
    let crop = file.cropped([40, 30, 200, 100]).unwrap();
    assert_eq!(crop.camera.intrinsics()[2..], [camera.params[2] - 40.0, camera.params[3] - 30.0]);
    assert_eq!(crop.evidence.frames[0].corners[0].px, Vector2::new(60.0, 20.0));
    // Twice the half is the whole again, to rounding.
    let whole = half.scaled(2.0).unwrap();
    assert!(difference_px(&camera, &whole.camera) < 1e-9);
}

#[test]
fn the_truth_of_a_scene_is_a_camera_file() {
    let truth = Scene::seed().truth();
    let file = read(&truth.to_json(), "truth.json").unwrap();
    assert_eq!(file.camera, truth.camera);
    assert_eq!(file.evidence.frames.len(), truth.frames.len());
    assert_eq!((file.evidence.board, file.evidence.square), (Some(truth.board), Some(truth.square)));
    let pose = file.evidence.frames[3].camera_from_board.unwrap();
    assert!((pose.matrix() - truth.frames[3].pose.matrix()).norm() < 1e-15);
}

/// The part of the picture that corners support: kept by the formats that have a place for it, and carried along.
#[test]
fn the_safe_region_is_kept() {
    let camera = examples().next().unwrap();
    let polygon = vec![[10.5, 20.0], [600.0, 30.25], [620.0, 440.0], [100.0, 470.5]];
    let evidence = Evidence { safe: Some(polygon.clone()), ..Evidence::default() };
    for format in FORMATS {
        let written = write(format, &Export { camera: &camera, evidence: &evidence, report: None }).unwrap();
        let file = read(&written.text, &file_name(format)).unwrap();
        let keeps = ["straightedge", "mrcal"].contains(&format.name);
        assert_eq!(file.evidence.safe, keeps.then(|| polygon.clone()), "{}", format.name);
        if !keeps {
            continue;
        }
        assert_eq!(file.scaled(2.0).unwrap().evidence.safe.unwrap()[0], [21.5, 40.5]);
        let cropped = file.cropped([100, 50, 200, 300]).unwrap().evidence.safe.unwrap();
        assert!(cropped.iter().all(|[x, y]| (-0.5..=199.5).contains(x) && (-0.5..=299.5).contains(y)));
    }
    for text in [
        "{ 'lensmodel': 'LENSMODEL_PINHOLE', 'intrinsics': [1,1,1,1], 'imagersize': [9,9], 'valid_intrinsics_region': [[1,2],[3]] }",
    ] {
        assert!(read(text, "a.cameramodel").unwrap_err().to_string().contains("must hold points"));
    }
}
