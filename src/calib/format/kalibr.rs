//! Kalibr camera chain (YAML), first camera.
//!
//! Origin at the centre of the first pixel. `radtan` is exactly `k1 k2 p1 p2`: k3 is refitted away.

use std::fmt::Write as _;

use super::{
    Content, Draft, Evidence, Export, Format,
    lens::{self, held},
    node::{Node, size_px},
    number::{array, joined},
};
use crate::calib::{
    Error, Result,
    camera::{Camera, Model},
};

pub(super) const FORMAT: Format = Format {
    name: "kalibr",
    title: "Kalibr camchain YAML",
    extensions: &[],
    usual: &["yaml", "yml"],
    stem: "camera",
    convention: "camchain.yaml: the centre of the first pixel is (0, 0). radtan with k1 k2 p1 p2, equidistant with k1 k2 k3 k4, ds and eucm.",
    lacks: "k3 and what follows it (refitted), poses, sigmas",
    write,
    read,
    sniff: |t| !t.trim_start().starts_with('{') && t.contains("camera_model:") && t.contains("intrinsics:"),
};

/// What Kalibr has, and what stands for the rest.
const HAS: &[Model] = &[Model::Brown4, Model::Kb4, Model::Ds, Model::Eucm];
const OTHERWISE: &[Model] = &[Model::Brown4, Model::Kb4];

fn write(export: &Export<'_>) -> Result<Draft> {
    let (camera, note) = held(export.camera, HAS, OTHERWISE, "Kalibr")?;
    let (k, terms) = camera.params.split_at(4);
    // Its own wide models begin with their terms, and have no distortion.
    let wide = [terms, k].concat();
    let (model, distortion, intrinsics, terms) = match camera.model {
        Model::Ds => ("ds", "none", &wide[..], &[][..]),
        Model::Eucm => ("eucm", "none", &wide[..], &[][..]),
        Model::Kb4 => ("pinhole", "equidistant", k, terms),
        _ => ("pinhole", "radtan", k, terms),
    };
    let [w, h] = camera.size_px;
    let mut text = format!("cam0:\n  cam_overlaps: []\n  camera_model: {model}\n");
    let _ = write!(
        text,
        "  distortion_coeffs: [{}]\n  distortion_model: {distortion}\n  intrinsics: [{}]\n  resolution: [{w}, {h}]\n  rostopic: /cam0/image_raw\n",
        joined(terms, ", "),
        joined(intrinsics, ", "),
    );
    Ok(Draft::noted(text, note))
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
    let evidence = Evidence { name: Some(name.to_owned()), ..Evidence::default() };
    let wide = match camera.text_at("camera_model") {
        Some("pinhole") => None,
        Some("ds") => Some(Model::Ds),
        Some("eucm") => Some(Model::Eucm),
        other => {
            return Err(Error::Unsupported(format!(
                "{name}: camera_model {} is not supported: only pinhole with radtan, equidistant or none, ds and eucm are",
                other.unwrap_or("?")
            )));
        }
    };
    let [w, h] = camera.array_at::<2>("resolution")?;
    let size = size_px(w, h)?;
    if let Some(model) = wide {
        let [a, b, fx, fy, cx, cy] = camera.array_at::<6>("intrinsics")?;
        let camera = Camera::new(model, size, vec![fx, fy, cx, cy, a, b])?;
        return Ok(Content { camera, evidence, notes });
    }
    let intrinsics = camera.array_at::<4>("intrinsics")?;
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
    let read = if model == Some("equidistant") { lens::fisheye } else { lens::opencv };
    let camera = read(size, intrinsics, &coefficients)?;
    Ok(Content { camera, evidence, notes })
}
