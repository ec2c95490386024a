//! `cameras.json` of OpenDroneMap, `camera_models.json` of OpenSfM: first camera.
//!
//! Positions are normalised: origin in the middle of the picture, the longer side is 1, so that `c_x = (cx − (w − 1)/2) / max(w, h)`.
//! Axes and terms are OpenCV's: `brown` with `k1 k2 p1 p2 k3`, `fisheye_opencv` with `k1 k2 k3 k4`; read are `perspective`,
//! `simple_radial`, `radial` and `fisheye` (one focal length, `k1 k2`) too. OpenSfM finds a camera by its key
//! `v2 make model width height projection focal`, of EXIF's make and model in lower case.
//!
//! OpenSfM, "Geometric Models" (documentation).

use serde_json::{Map, Value, json};

use super::{
    Content, Draft, Export, Format,
    lens::{self, held},
    node::{Node, size_px},
};
use crate::calib::{
    Error, Result,
    camera::{Camera, Model},
};

pub(super) const FORMAT: Format = Format {
    name: "opensfm",
    title: "OpenDroneMap, OpenSfM",
    extensions: &[],
    usual: &["json"],
    stem: "cameras",
    convention: "From the middle of the picture, the longer side is 1. brown with k1 k2 p1 p2 k3, fisheye_opencv with k1 k2 k3 k4, by name. The key names make and model of the photographs.",
    lacks: "more terms than k3, double sphere and EUCM (refitted), poses, sigmas",
    write,
    read,
    sniff: |t| t.trim_start().starts_with('{') && t.contains("\"projection_type\""),
};

/// What OpenSfM has of ours, and what stands for the rest.
const HAS: &[Model] = &[Model::Brown5, Model::Kb4];
/// Names of the terms of `brown`, in our order.
const BROWN: [&str; 5] = ["k1", "k2", "p1", "p2", "k3"];
/// Names of the terms of `fisheye_opencv`.
const FISHEYE: [&str; 4] = ["k1", "k2", "k3", "k4"];

/// Longer side and middle of a picture, px.
fn frame([w, h]: [u32; 2]) -> (f64, [f64; 2]) {
    (f64::from(w.max(h)), [w, h].map(|n| (f64::from(n) - 1.0) / 2.0))
}

fn write(export: &Export<'_>) -> Result<Draft> {
    let (camera, note) = held(export.camera, HAS, HAS, "OpenSfM")?;
    let (kind, names): (_, &[&str]) = match camera.model {
        Model::Kb4 => ("fisheye_opencv", &FISHEYE),
        _ => ("brown", &BROWN),
    };
    let (side, middle) = frame(camera.size_px);
    let [fx, fy, cx, cy] = camera.intrinsics();
    let [w, h] = camera.size_px;
    let mut fields = Map::new();
    let mut field = |name: &str, value: Value| fields.insert(name.to_owned(), value);
    field("projection_type", kind.into());
    field("width", w.into());
    field("height", h.into());
    field("focal_x", (fx / side).into());
    field("focal_y", (fy / side).into());
    field("c_x", ((cx - middle[0]) / side).into());
    field("c_y", ((cy - middle[1]) / side).into());
    for (name, term) in names.iter().zip(&camera.params[4..]) {
        field(name, (*term).into());
    }
    let mut notes: Vec<String> = note.into_iter().collect();
    let exact = notes.is_empty();
    let word = |text: &Option<String>| text.as_deref().unwrap_or("unknown").trim().to_lowercase();
    let [make, model] = [&export.evidence.make, &export.evidence.camera_model].map(word);
    if export.evidence.camera_model.is_none() {
        notes.push(
            "make and model of the camera are not known: write those of the photographs' EXIF in place of \"unknown unknown\""
                .to_owned(),
        );
    }
    let key = format!("v2 {make} {model} {w} {h} {kind} {:.4}", fx / side);
    Ok(Draft { text: format!("{:#}\n", json!({ key: fields })), notes, exact })
}

fn read(text: &str) -> Result<Content> {
    let root = Node::from_json(text)?;
    let Node::Map(entries) = &root else {
        return Err(Error::Invalid("a map of cameras by their keys is expected".to_owned()));
    };
    let mut cameras = entries.iter().filter(|(_, v)| v.find("projection_type").is_some());
    let Some((key, fields)) = cameras.next() else {
        return Err(Error::Invalid("no camera with a projection_type was found".to_owned()));
    };
    let mut notes = Vec::new();
    let others = cameras.count();
    if others > 0 {
        notes.push(format!("the file holds {} cameras: \"{key}\" is used", others + 1));
    }
    let size = size_px(fields.number_at("width")?, fields.number_at("height")?)?;
    let (side, middle) = frame(size);
    let kind = fields.text_at("projection_type").unwrap_or("?");
    // One focal length is named `focal`, two are `focal_x focal_y`.
    let one = fields.find("focal").map(|v| v.number("focal")).transpose()?;
    let focal = |name: &str| match (fields.find(name), one) {
        (Some(v), _) => v.number(name),
        (None, Some(f)) => Ok(f),
        (None, None) => Err(Error::Invalid(format!("the field {name} is missing"))),
    };
    let k = [
        focal("focal_x")? * side,
        focal("focal_y")? * side,
        fields.number_or_zero("c_x")? * side + middle[0],
        fields.number_or_zero("c_y")? * side + middle[1],
    ];
    let terms = |names: &[&str]| names.iter().map(|n| fields.number_or_zero(n)).collect::<Result<Vec<f64>>>();
    let camera: Camera = match kind {
        "perspective" | "simple_radial" | "radial" => lens::opencv(size, k, &terms(&["k1", "k2"])?)?,
        "brown" => lens::opencv(size, k, &terms(&BROWN)?)?,
        "fisheye" => {
            let [k1, k2] = [fields.number_or_zero("k1")?, fields.number_or_zero("k2")?];
            lens::fisheye(size, k, &[k1, k2, 0.0, 0.0])?
        }
        "fisheye_opencv" => lens::fisheye(size, k, &terms(&FISHEYE)?)?,
        other => {
            return Err(Error::Unsupported(format!(
                "projection_type {other} is not supported yet: perspective, simple_radial, radial, brown, fisheye and fisheye_opencv are"
            )));
        }
    };
    Ok(Content { notes, ..camera.into() })
}
