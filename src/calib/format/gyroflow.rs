//! Gyroflow lens profile.
//!
//! Origin at the centre of the first pixel, as OpenCV's, which Gyroflow calibrates with. Two of its distortion models are OpenCV's:
//! `opencv_fisheye` with `k1 k2 k3 k4`, and `opencv_standard` with `k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4`. Without
//! `asymmetrical` Gyroflow puts the principal point in the middle of the picture, whatever the matrix says; it is written, so that
//! the measured one counts.

use serde_json::{Value, json};

use super::{
    Content, Draft, Evidence, Export, Format,
    lens::{self, held, opencv_terms},
    node::{Node, size_px},
};
use crate::calib::{Error, Result, camera::Model};

pub(super) const FORMAT: Format = Format {
    name: "gyroflow",
    title: "Gyroflow lens profile",
    extensions: &[],
    usual: &["json"],
    stem: "camera",
    convention: "The centre of the first pixel is (0, 0). opencv_fisheye with k1 k2 k3 k4, opencv_standard with k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4. Frame rate and readout time are to be filled in.",
    lacks: "tilt, double sphere and EUCM (refitted), poses, sigmas",
    write,
    read,
    sniff: |t| t.trim_start().starts_with('{') && t.contains("\"fisheye_params\""),
};

/// What Gyroflow has of ours, and what stands for the rest.
const HAS: &[Model] = &[Model::ThinPrism, Model::Kb4];
/// Fewest coefficients of `opencv_standard`: four are taken for a fisheye by programs that look at their number.
const FEWEST: usize = 5;

fn write(export: &Export<'_>) -> Result<Draft> {
    let Export { evidence, .. } = export;
    let (camera, note) = held(export.camera, HAS, HAS, "Gyroflow")?;
    let (model, coefficients) = match opencv_terms(&camera) {
        Some(terms) => ("opencv_standard", terms),
        None => ("opencv_fisheye", camera.params[4..].to_vec()),
    };
    let [fx, fy, cx, cy] = camera.intrinsics();
    let [w, h] = camera.size_px;
    let known = |text: &Option<String>| text.clone().unwrap_or_default();
    let [make, name] = [known(&evidence.make), known(&evidence.camera_model)];
    let whole = [make.as_str(), name.as_str()].into_iter().filter(|s| !s.is_empty());
    let title = whole.chain([format!("{w}x{h}").as_str()]).collect::<Vec<_>>().join(" ");
    let size = json!({ "w": w, "h": h });
    let profile = json!({
        "name": title,
        "note": "",
        "calibrated_by": "Straightedge",
        "camera_brand": make,
        "camera_model": name,
        "lens_model": "",
        "camera_setting": "",
        "calib_dimension": size,
        "orig_dimension": size,
        "output_dimension": size,
        "frame_readout_time": Value::Null,
        "input_horizontal_stretch": 1.0,
        "input_vertical_stretch": 1.0,
        "num_images": evidence.frames.len(),
        "fps": 0.0,
        "official": false,
        "asymmetrical": true,
        "fisheye_params": {
            "RMS_error": evidence.rms_px.unwrap_or_default(),
            "camera_matrix": [[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]],
            "distortion_coeffs": coefficients,
            "radial_distortion_limit": Value::Null,
        },
        "distortion_model": model,
        "identifier": "",
        "calibrator_version": concat!("Straightedge ", env!("CARGO_PKG_VERSION")),
        "date": known(&evidence.date),
        "compatible_settings": [],
    });
    Ok(Draft::noted(format!("{profile:#}\n"), note))
}

fn read(text: &str) -> Result<Content> {
    let root = Node::from_json(text)?;
    let size = root.get("calib_dimension")?;
    let [w, h] = [size.number_at("w")?, size.number_at("h")?];
    let size = size_px(w, h)?;
    for stretch in ["input_horizontal_stretch", "input_vertical_stretch"] {
        // Zero is how the program writes "not said".
        if let Some(v) = root.find(stretch).map(|v| v.number(stretch)).transpose()?
            && ![0.0, 1.0].contains(&v)
        {
            return Err(Error::Unsupported(format!(
                "{stretch} is {v}: an anamorphic lens has no camera model here"
            )));
        }
    }
    let lens = root.get("fisheye_params")?;
    let [fx, skew, mut cx, zero, fy, mut cy, ..]: [f64; 9] = lens.array_at("camera_matrix")?;
    if skew != 0.0 || zero != 0.0 {
        return Err(Error::Unsupported("camera_matrix has a skew: no camera model here has one".to_owned()));
    }
    let mut notes = Vec::new();
    let middle = [w / 2.0, h / 2.0];
    if root.text_at("asymmetrical") != Some("true") && [cx, cy] != middle {
        notes.push(format!(
            "the profile is not marked as asymmetrical: as in Gyroflow the middle of the picture is its principal point, not {cx:.1}, {cy:.1}"
        ));
        [cx, cy] = middle;
    }
    let coefficients = lens.get("distortion_coeffs")?.numbers("distortion_coeffs")?;
    let k = [fx, fy, cx, cy];
    let camera = match root.text_at("distortion_model").unwrap_or("opencv_fisheye") {
        "opencv_fisheye" => lens::fisheye(size, k, &coefficients)?,
        "opencv_standard" if coefficients.len() >= FEWEST || coefficients.is_empty() => {
            lens::opencv(size, k, &coefficients)?
        }
        "opencv_standard" => {
            return Err(Error::Invalid(format!(
                "distortion_coeffs has {} numbers: opencv_standard has at least {FEWEST}",
                coefficients.len()
            )));
        }
        other => {
            return Err(Error::Unsupported(format!(
                "distortion_model {other} is not supported yet: opencv_fisheye and opencv_standard are"
            )));
        }
    };
    let said = |field: &str| root.text_at(field).filter(|t| !t.is_empty()).map(str::to_owned);
    let evidence = Evidence {
        make: said("camera_brand"),
        camera_model: said("camera_model"),
        date: said("date"),
        rms_px: lens.find("RMS_error").map(|v| v.number("RMS_error")).transpose()?.filter(|v| *v > 0.0),
        ..Evidence::default()
    };
    Ok(Content { camera, evidence, notes })
}
