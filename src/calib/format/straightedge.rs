//! This program's own JSON: what `calibrate --json` prints, and the truth file of `synth`.
//!
//! Origin at the centre of the first pixel; every number reads back to the same bits.

use std::fmt::Write as _;

use nalgebra::{DMatrix, Vector2, Vector3};

use super::{
    Content, Draft, Evidence, Export, Format, Frame,
    node::{Node, polygon, size_px},
    number::{joined, number, points},
    residual,
};
use crate::calib::{
    Error, Result,
    camera::{Camera, Model},
    observation::Corner,
    pose::Pose,
    target::{Length, Unit},
};

pub(super) const FORMAT: Format = Format {
    name: "straightedge",
    title: "Straightedge JSON",
    extensions: &["json"],
    usual: &["json", "html"],
    stem: "camera",
    convention: "Everything that is known, with σ and covariance. The centre of the first pixel is (0, 0); values by name.",
    lacks: "nothing",
    write,
    read,
    sniff: |t| {
        t.starts_with(['{', ' ', '\n', '\r', '\t'])
            && t.contains("\"camera_matrix\"")
            && !t.contains("opencv-matrix")
            && !t.contains("\"fisheye_params\"")
    },
};

fn write(export: &Export<'_>) -> Result<Draft> {
    if let Some(report) = export.report {
        return Ok(Draft::exact(report.to_json()));
    }
    let (camera, evidence) = (export.camera, export.evidence);
    let [w, h] = camera.size_px;
    let names: Vec<&str> = camera.spec().params.iter().map(|p| p.name).collect();
    let object = |from: usize, to: usize| named(&names[from..to], &camera.params[from..to]);
    let mut out = format!("{{\n  \"version\": {:?}", env!("CARGO_PKG_VERSION"));
    let mut field = |name: &str, value: String| {
        let _ = write!(out, ",\n  \"{name}\": {value}");
    };
    if let Some(name) = &evidence.name {
        field("name", json_text(name));
    }
    if let Some(date) = &evidence.date {
        field("date", json_text(date));
    }
    let settings: Vec<String> = [
        evidence.board.map(|b| format!("\"board\": \"{b}\"")),
        evidence.square.map(|s| format!("\"square\": {}", number(s))),
        evidence.unit.map(|u| format!("\"unit\": \"{}\"", u.name())),
    ]
    .into_iter()
    .flatten()
    .collect();
    if !settings.is_empty() {
        field("settings", format!("{{{}}}", settings.join(", ")));
    }
    field("image_size_px", format!("[{w}, {h}]"));
    field("model", format!("\"{}\"", camera.model));
    if let Some(rms) = evidence.rms_px {
        field("rms_px", number(rms));
    }
    field("camera_matrix", object(0, 4));
    field("distortion", object(4, names.len()));
    if evidence.sigma.len() == names.len() {
        let values: Vec<String> = names
            .iter()
            .zip(&evidence.sigma)
            .map(|(n, s)| format!("\"{n}\": {}", s.map_or_else(|| "null".to_owned(), number)))
            .collect();
        field("sigma", format!("{{{}}}", values.join(", ")));
        if let Some(covariance) = evidence.covariance_of_all(camera) {
            let rows: Vec<String> =
                covariance.row_iter().map(|r| format!("[{}]", joined(r.iter(), ", "))).collect();
            field("covariance", format!("[\n    {}\n  ]", rows.join(",\n    ")));
        }
    }
    if let Some(polygon) = &evidence.safe {
        field("safe_region", format!("{{\"polygon_px\": [{}]}}", points(polygon)));
    }
    if let Some(residual_field) = &evidence.residual {
        field("residual_map", residual::written(residual_field));
    }
    if !evidence.frames.is_empty() {
        let frames: Vec<String> = evidence.frames.iter().map(frame).collect();
        field("frames", format!("[\n    {}\n  ]", frames.join(",\n    ")));
    }
    out += "\n}\n";
    Ok(Draft::exact(out))
}

fn named(names: &[&str], values: &[f64]) -> String {
    let fields: Vec<String> =
        names.iter().zip(values).map(|(n, v)| format!("\"{n}\": {}", number(*v))).collect();
    format!("{{{}}}", fields.join(", "))
}

fn json_text(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}

fn frame(frame: &Frame) -> String {
    let mut fields = vec![format!("\"file\": {}", json_text(&frame.file))];
    if let Some(rms) = frame.rms_px {
        fields.push(format!("\"rms_px\": {}", number(rms)));
    }
    if let Some(pose) = frame.camera_from_board {
        fields.push(format!("\"rvec_rad\": [{}]", joined(pose.rvec().iter(), ", ")));
        fields.push(format!("\"tvec\": [{}]", joined(pose.translation.iter(), ", ")));
    }
    if !frame.corners.is_empty() {
        let corners: Vec<String> = frame
            .corners
            .iter()
            .map(|c| format!("[{}, {}]", c.index, joined(&[c.px.x, c.px.y, c.sigma_px], ", ")))
            .collect();
        fields.push(format!("\"corners\": [{}]", corners.join(", ")));
    }
    format!("{{{}}}", fields.join(", "))
}

fn read(text: &str) -> Result<Content> {
    let root = Node::from_json(text)?;
    let mut notes = Vec::new();
    let (place, inner) = match root.field("cameras") {
        Some(list) => {
            let [first, rest @ ..] = list.items() else {
                return Err(Error::Invalid(
                    "cameras must be a list of at least one camera, or absent".to_owned(),
                ));
            };
            if !rest.is_empty() {
                notes.push(format!("the file holds {} cameras: the first one is used", rest.len() + 1));
            }
            ("cameras[0]", Some(first))
        }
        None => ("camera", root.find("camera").filter(|c| matches!(c, Node::Map(_)))),
    };
    let lens = match inner {
        Some(inner) => {
            let camera = read_camera(inner)?;
            agree(&read_camera(&inner.overridden(&root, &FIELDS))?, &camera, place)?;
            camera
        }
        None => read_camera(&root)?,
    };
    let mut evidence = read_evidence(&root)?;
    let params = &lens.spec().params;
    if let Some(sigma) = root.find("sigma") {
        evidence.sigma = params
            .iter()
            .map(|p| sigma.find(p.name).map(|v| v.number(p.name)).transpose())
            .collect::<Result<_>>()?;
    }
    if let Some(region) = root.find("safe_region") {
        evidence.safe = Some(polygon(region.get("polygon_px")?, "safe_region")?);
    }
    if let Some(map) = root.find("residual_map") {
        evidence.residual = residual::read(map)?;
    }
    if let Some(covariance) = root.find("covariance") {
        read_covariance(covariance, params.len(), &mut evidence)?;
    }
    Ok(Content { camera: lens, evidence, notes })
}

/// Fields of a camera; `calibrate --json` has them at the top and once more in `cameras`.
const FIELDS: [&str; 5] = ["model", "image_size_px", "size_px", "camera_matrix", "distortion"];
/// Relative difference that another program's rounding of a number may leave.
const ROUNDING: f64 = 1e-9;

/// Refuses a file that says two things about its camera.
fn agree(top: &Camera, inner: &Camera, place: &str) -> Result<()> {
    let contradict = |field: &str, a: String, b: String| {
        Err(Error::Invalid(format!(
            "{field} is {a} at the top of the file, but {b} in {place}: correct one of them, or remove {place}"
        )))
    };
    if top.model != inner.model {
        return contradict("model", top.model.to_string(), inner.model.to_string());
    }
    if top.size_px != inner.size_px {
        return contradict("image_size_px", format!("{:?}", top.size_px), format!("{:?}", inner.size_px));
    }
    for ((param, a), b) in top.spec().params.iter().zip(&top.params).zip(&inner.params) {
        if (a - b).abs() > ROUNDING * a.abs().max(b.abs()) {
            return contradict(param.name, a.to_string(), b.to_string());
        }
    }
    Ok(())
}

fn read_camera(node: &Node) -> Result<Camera> {
    if let Some(name) = FIELDS.iter().find(|name| node.field(name) == Some(&Node::Null)) {
        return Err(Error::Invalid(format!("{name} is null: give its value, or export the camera again")));
    }
    if node.field("model").is_some_and(|m| !matches!(m, Node::Text(_))) {
        return Err(Error::Invalid(
            "model must be the name of a camera model, for example \"brown5\"".to_owned(),
        ));
    }
    let model: Model = node.text_at("model").unwrap_or("brown5").parse()?;
    let field = if node.find("image_size_px").is_some() { "image_size_px" } else { "size_px" };
    let [w, h] = node.array_at(field)?;
    let matrix = node.get("camera_matrix")?;
    let empty = Node::Null;
    let distortion = node.find("distortion").unwrap_or(&empty);
    let known: Vec<&str> = model.spec().params.iter().map(|p| p.name).collect();
    if let Node::Map(fields) = distortion
        && let Some((name, _)) = fields.iter().find(|(n, _)| !known.contains(&n.as_str()))
    {
        return Err(Error::Invalid(format!("distortion: the model {model} has no parameter {name}")));
    }
    let params = known
        .iter()
        .enumerate()
        .map(|(i, name)| if i < 4 { matrix.number_at(name) } else { distortion.number_at(name) })
        .collect::<Result<_>>()?;
    Camera::new(model, size_px(w, h)?, params)
}

/// When the first picture was taken.
fn first_taken(root: &Node) -> Option<&str> {
    root.find("frames")?.items().iter().filter_map(|f| f.text_at("taken")).min()
}

fn read_evidence(root: &Node) -> Result<Evidence> {
    let settings = root.find("settings").unwrap_or(root);
    let group = root.find("groups").and_then(|g| g.items().first());
    let of_group = |field: &str| group.and_then(|g| g.text_at(field)).map(str::to_owned);
    let mut evidence = Evidence {
        make: of_group("make"),
        camera_model: of_group("model"),
        name: root.text_at("name").map(str::to_owned),
        date: root.text_at("date").or(first_taken(root)).map(str::to_owned),
        board: settings.text_at("board").and_then(|t| t.parse().ok()),
        rms_px: root.find("rms_px").map(|v| v.number("rms_px")).transpose()?,
        ..Evidence::default()
    };
    match settings.find("square") {
        Some(Node::Text(t)) => {
            let length = t.parse::<Length>().ok();
            (evidence.square, evidence.unit) = (length.map(|l| l.value), length.map(|l| l.unit));
        }
        Some(v) => evidence.square = Some(v.number("square")?),
        None => {}
    }
    if let Some(unit) = settings.text_at("unit") {
        evidence.unit = [Unit::Mm, Unit::Cm, Unit::M, Unit::In, Unit::Unspecified, Unit::Squares]
            .into_iter()
            .find(|u| u.name() == unit);
    }
    for (i, f) in root.find("frames").map_or(&[][..], Node::items).iter().enumerate() {
        let field = |name: &str| format!("frames[{i}].{name}");
        let mut frame = Frame {
            file: f.text_at("file").unwrap_or_default().to_owned(),
            rms_px: f.find("rms_px").map(|v| v.number(&field("rms_px"))).transpose()?,
            ..Frame::default()
        };
        if let (Some(_), Some(_)) = (f.find("rvec_rad"), f.find("tvec")) {
            let (r, t): ([f64; 3], [f64; 3]) = (f.array_at("rvec_rad")?, f.array_at("tvec")?);
            frame.camera_from_board = Some(Pose::from_rvec_tvec(Vector3::from(r), Vector3::from(t)));
        }
        for c in f.find("corners").map_or(&[][..], Node::items) {
            let values = c.numbers(&field("corners"))?;
            let ([index, x, y] | [index, x, y, _]) = values.as_slice() else {
                return Err(Error::Invalid(format!(
                    "{} must hold [index, x_px, y_px, sigma_px]",
                    field("corners")
                )));
            };
            if !(0.0..=1e6).contains(index) || index.fract() != 0.0 {
                return Err(Error::Invalid(format!("{}: {index} is not an index", field("corners"))));
            }
            let sigma_px = values.get(3).copied().unwrap_or(0.0);
            frame.corners.push(Corner { index: *index as u32, px: Vector2::new(*x, *y), sigma_px });
        }
        evidence.frames.push(frame);
    }
    Ok(evidence)
}

/// A square matrix over all parameters, or over those that have a σ.
fn read_covariance(node: &Node, n: usize, evidence: &mut Evidence) -> Result<()> {
    let values = node.numbers("covariance")?;
    let with_sigma: Vec<usize> =
        evidence.sigma.iter().enumerate().filter(|(_, s)| s.is_some()).map(|(i, _)| i).collect();
    let rows = node.items().len();
    if rows * rows != values.len() {
        return Err(Error::Invalid(format!(
            "covariance has {rows} rows and {} numbers: it must be square",
            values.len()
        )));
    }
    let matrix = DMatrix::from_row_slice(rows, rows, &values);
    if rows == with_sigma.len() {
        evidence.covariance = Some(matrix);
    } else if rows == n {
        evidence.covariance = Some(matrix.select_rows(&with_sigma).select_columns(&with_sigma));
    } else {
        return Err(Error::Invalid(format!("covariance has {rows} rows, {n} are expected")));
    }
    evidence.free = with_sigma;
    Ok(())
}
