//! Basalt calibration JSON, first camera.
//!
//! Origin at the centre of the first pixel. Basalt has no Brown model: such a camera is refitted to
//! Kannala–Brandt (`kb4`). Basalt's reader needs all fields of its calibration, those of the inertial
//! sensor too; they are written as zero and unity.

use super::{
    Content, Draft, Export, Format,
    lens::{self, held},
    node::{Node, size_px},
    number::{array, number},
};
use crate::calib::{
    Error, Result,
    camera::{Camera, Model},
};

pub(super) const FORMAT: Format = Format {
    name: "basalt",
    title: "Basalt JSON",
    extensions: &[],
    usual: &["json"],
    stem: "camera",
    convention: "The centre of the first pixel is (0, 0). pinhole, kb4 with k1 k2 k3 k4, ds with xi alpha, eucm with alpha beta.",
    lacks: "Brown's model (refitted to kb4), poses, sigmas",
    write,
    read,
    sniff: |t| t.trim_start().starts_with('{') && t.contains("\"value0\""),
};

/// What Basalt has of ours.
const HAS: &[Model] = &[Model::Pinhole, Model::Kb4, Model::Ds, Model::Eucm];

fn write(export: &Export<'_>) -> Result<Draft> {
    let (camera, refit) = held(export.camera, HAS, &[Model::Kb4], "Basalt")?;
    let exact = refit.is_none();
    let mut notes: Vec<String> = refit.into_iter().collect();
    notes.push("the fields of the inertial sensor are placeholders (no bias, no noise)".to_owned());
    // Its names are ours, of models and parameters.
    let spec = camera.spec();
    let kind = spec.name;
    let intrinsics: Vec<String> = spec
        .params
        .iter()
        .zip(&camera.params)
        .map(|(p, v)| format!("\"{}\": {}", p.name, number(*v)))
        .collect();
    let zeros = |n: usize| vec!["0.0"; n].join(", ");
    let [w, h] = camera.size_px;
    let fields = [
        "\"T_imu_cam\": [{\"px\": 0.0, \"py\": 0.0, \"pz\": 0.0, \"qx\": 0.0, \"qy\": 0.0, \"qz\": 0.0, \"qw\": 1.0}]".to_owned(),
        format!("\"intrinsics\": [{{\"camera_type\": \"{kind}\", \"intrinsics\": {{{}}}}}]", intrinsics.join(", ")),
        format!("\"resolution\": [[{w}, {h}]]"),
        format!("\"calib_accel_bias\": [{}]", zeros(9)),
        format!("\"calib_gyro_bias\": [{}]", zeros(12)),
        "\"imu_update_rate\": 200.0".to_owned(),
        format!("\"accel_noise_std\": [{}]", zeros(3)),
        format!("\"gyro_noise_std\": [{}]", zeros(3)),
        format!("\"accel_bias_std\": [{}]", zeros(3)),
        format!("\"gyro_bias_std\": [{}]", zeros(3)),
        "\"cam_time_offset_ns\": 0".to_owned(),
        "\"vignette\": []".to_owned(),
    ];
    let text = format!("{{\n  \"value0\": {{\n    {}\n  }}\n}}\n", fields.join(",\n    "));
    Ok(Draft { text, notes, exact })
}

fn read(text: &str) -> Result<Content> {
    let root = Node::from_json(text)?;
    let value = root.get("value0")?;
    let cameras = value.get("intrinsics")?.items();
    let sizes = value.get("resolution")?.items();
    let (Some(camera), Some(size)) = (cameras.first(), sizes.first()) else {
        return Err(Error::Invalid("intrinsics and resolution must hold at least one camera".to_owned()));
    };
    let mut notes = Vec::new();
    if cameras.len() > 1 {
        notes.push(format!("the file holds {} cameras: the first one is used", cameras.len()));
    }
    let numbers = size.numbers("resolution")?;
    let [w, h] = array(&numbers)
        .ok_or_else(|| Error::Invalid(format!("resolution has {} numbers, 2 are expected", numbers.len())))?;
    let size = size_px(w, h)?;
    let kind = camera.text_at("camera_type").unwrap_or("?");
    let p = camera.get("intrinsics")?;
    let named = |names: &[&str]| names.iter().map(|n| p.number_at(n)).collect::<Result<Vec<f64>>>();
    let k = [p.number_at("fx")?, p.number_at("fy")?, p.number_at("cx")?, p.number_at("cy")?];
    let camera = match HAS.iter().find(|m| m.spec().name == kind) {
        Some(model) => {
            let names: Vec<&str> = model.spec().params.iter().map(|p| p.name).collect();
            Camera::new(*model, size, named(&names)?)?
        }
        None if kind == "pinhole-radtan8" => {
            lens::opencv(size, k, &named(&["k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"])?)?
        }
        None => return Err(Error::Unsupported(format!("camera_type {kind} is not supported"))),
    };
    Ok(Content { notes, ..camera.into() })
}
