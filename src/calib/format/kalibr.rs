//! Kalibr camera chain (YAML), first camera.
//!
//! Origin at the centre of the first pixel. `radtan` is exactly `k1 k2 p1 p2`: k3 is refitted away.

use std::fmt::Write as _;

use super::{
    Content, Draft, Evidence, Export, Format,
    lens::Lens,
    node::{Node, size_px},
    number::{array, joined},
    refit,
};
use crate::calib::{Error, Result};

pub(super) const FORMAT: Format = Format {
    name: "kalibr",
    title: "Kalibr camchain YAML",
    extensions: &[],
    usual: &["yaml", "yml"],
    convention: "camchain.yaml: the centre of the first pixel is (0, 0). radtan, k1 k2 p1 p2.",
    lacks: "k3 (refitted), poses, sigmas",
    write,
    read,
    sniff: |t| !t.trim_start().starts_with('{') && t.contains("camera_model:") && t.contains("intrinsics:"),
};

fn write(export: &Export<'_>) -> Result<Draft> {
    let camera = export.camera;
    let (p, note) = refit::without_k3(camera, "Kalibr's radtan")?;
    let [w, h] = camera.size_px;
    let mut text = String::from("cam0:\n  cam_overlaps: []\n  camera_model: pinhole\n");
    let _ = write!(
        text,
        "  distortion_coeffs: [{}]\n  distortion_model: radtan\n  intrinsics: [{}]\n  resolution: [{w}, {h}]\n  rostopic: /cam0/image_raw\n",
        joined(&p[4..], ", "),
        joined(&p[..4], ", "),
    );
    Ok(Draft { text, exact: note.is_none(), notes: note.into_iter().collect() })
}

fn read(text: &str) -> Result<Content> {
    let root = Node::from_yaml(text)?;
    let Node::Map(entries) = &root else {
        return Err(Error::Invalid("the field cam0 is missing".to_owned()));
    };
    let cameras: Vec<&(String, Node)> =
        entries.iter().filter(|(_, n)| n.find("camera_model").is_some()).collect();
    let mut notes = Vec::new();
    // A file of `kalibr_create_target` or of one camera has the fields at the top.
    let (name, camera) = match cameras.as_slice() {
        [] if root.find("camera_model").is_some() => ("cam0", &root),
        [] => return Err(Error::Invalid("no camera (cam0 with camera_model) was found".to_owned())),
        [(name, first), rest @ ..] => {
            if !rest.is_empty() {
                notes.push(format!("the chain holds {} cameras: {name} is used", cameras.len()));
            }
            (name.as_str(), first)
        }
    };
    match camera.text_at("camera_model") {
        Some("pinhole") => {}
        other => {
            return Err(Error::Unsupported(format!(
                "{name}: camera_model {} is not supported yet: only pinhole with radtan, equidistant or none",
                other.unwrap_or("?")
            )));
        }
    }
    let intrinsics = camera.array_at::<4>("intrinsics")?;
    let [w, h] = camera.array_at::<2>("resolution")?;
    let coefficients =
        camera.find("distortion_coeffs").map_or(Ok(Vec::new()), |d| d.numbers("distortion_coeffs"))?;
    let model = camera.text_at("distortion_model");
    let coefficients = match model {
        Some("equidistant") => coefficients,
        Some("radtan") => array::<4>(&coefficients)
            .ok_or_else(|| {
                Error::Invalid(format!(
                    "distortion_coeffs has {} numbers, radtan needs 4",
                    coefficients.len()
                ))
            })?
            .to_vec(),
        Some("none") | None => Vec::new(),
        Some(other) => {
            return Err(Error::Unsupported(format!("{name}: distortion_model {other} is not supported yet")));
        }
    };
    let read = if model == Some("equidistant") { Lens::kannala_brandt } else { Lens::brown };
    let lens = read(size_px(w, h)?, intrinsics, &coefficients)?;
    let evidence = Evidence { name: Some(name.to_owned()), ..Evidence::default() };
    Ok(Content { lens, evidence, notes })
}
