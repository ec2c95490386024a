//! ROS `camera_info` YAML, and on reading the ini twin (`ost.txt`) of the calibrator.
//!
//! Origin at the centre of the first pixel; `plumb_bob` = `k1 k2 p1 p2 k3`, `rational_polynomial` = OpenCV's eight.

use std::fmt::Write as _;

use super::{
    Content, Draft, Evidence, Export, Format,
    lens::{self, held, opencv_terms},
    node::{Node, size_px},
    number::joined,
    opencv::{camera_matrix, quoted},
};
use crate::calib::{Error, Result, camera::Model};

pub(super) const FORMAT: Format = Format {
    name: "ros",
    title: "ROS camera_info YAML",
    extensions: &[],
    usual: &["yaml", "yml", "ini", "txt"],
    stem: "camera",
    convention: "camera_info of image_pipeline: the centre of the first pixel is (0, 0). plumb_bob with k1 k2 p1 p2 k3, rational_polynomial with k4 k5 k6 more, equidistant with k1 k2 k3 k4.",
    lacks: "thin prism, tilt, double sphere and EUCM (refitted), poses, sigmas",
    write,
    read,
    sniff: |t| !t.trim_start().starts_with(['{', '<']) && (t.contains("camera_matrix:") || is_ini(t)),
};

/// What ROS has, and what stands for the rest.
const HAS: &[Model] = &[Model::Brown5, Model::Rational, Model::Kb4];
const OTHERWISE: &[Model] = &[Model::Rational, Model::Kb4];

fn is_ini(text: &str) -> bool {
    text.lines().any(|l| l.trim() == "[image]") && text.contains("camera matrix")
}

/// A name as plain YAML where that is unambiguous, else quoted.
fn name(text: &str) -> String {
    let plain = text.starts_with(|c: char| c.is_ascii_alphabetic())
        && text.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
        && !matches!(
            text.to_ascii_lowercase().as_str(),
            "null" | "true" | "false" | "yes" | "no" | "on" | "off" | "y" | "n"
        );
    if plain { text.to_owned() } else { quoted(text) }
}

fn write(export: &Export<'_>) -> Result<Draft> {
    let (camera, note) = held(export.camera, HAS, OTHERWISE, "ROS")?;
    let terms = opencv_terms(&camera);
    let model = match terms.as_deref() {
        None => "equidistant",
        Some([_, _, _, _, _]) => "plumb_bob",
        Some(_) => "rational_polynomial",
    };
    let terms = terms.unwrap_or_else(|| camera.params[4..].to_vec());
    let [fx, fy, cx, cy] = camera.intrinsics();
    let [w, h] = camera.size_px;
    let mut out = format!(
        "image_width: {w}\nimage_height: {h}\ncamera_name: {}\n",
        name(export.evidence.name.as_deref().unwrap_or("camera"))
    );
    let mut matrix = |name: &str, rows: usize, cols: usize, data: &[f64]| {
        let _ = write!(out, "{name}:\n  rows: {rows}\n  cols: {cols}\n  data: [{}]\n", joined(data, ", "));
    };
    matrix("camera_matrix", 3, 3, &[fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]);
    matrix("distortion_coefficients", 1, terms.len(), &terms);
    matrix("rectification_matrix", 3, 3, &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]);
    matrix("projection_matrix", 3, 4, &[fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0]);
    let named = format!("distortion_model: {model}\ndistortion_coefficients:");
    Ok(Draft::noted(out.replacen("distortion_coefficients:", &named, 1), note))
}

fn read(text: &str) -> Result<Content> {
    if is_ini(text) {
        return read_ini(text);
    }
    let root = Node::from_yaml(text)?;
    let data = |field: &str| {
        let node = root.get(field)?;
        let values = node.find("data").unwrap_or(node).numbers(field)?;
        if let (Some(rows), Some(cols)) = (node.find("rows"), node.find("cols"))
            && rows.number(field)? * cols.number(field)? != values.len() as f64
        {
            return Err(Error::Invalid(format!(
                "{field} has {} numbers, its rows and cols say otherwise: the file is damaged",
                values.len()
            )));
        }
        Ok(values)
    };
    let size = size_px(root.number_at("image_width")?, root.number_at("image_height")?)?;
    let intrinsics = camera_matrix("camera_matrix", &data("camera_matrix")?)?;
    let fisheye = match root.text_at("distortion_model") {
        None | Some("plumb_bob" | "rational_polynomial" | "none" | "") => false,
        Some("equidistant" | "fisheye") => true,
        Some(other) => {
            return Err(Error::Unsupported(format!("distortion_model {other} is not supported yet")));
        }
    };
    let coefficients = match root.find("distortion_coefficients") {
        Some(_) => data("distortion_coefficients")?,
        None => return Err(Error::Invalid("the field distortion_coefficients is missing".to_owned())),
    };
    let read = if fisheye { lens::fisheye } else { lens::opencv };
    let camera = read(size, intrinsics, &coefficients)?;
    let evidence = Evidence { name: root.text_at("camera_name").map(str::to_owned), ..Evidence::default() };
    Ok(Content { evidence, ..camera.into() })
}

/// `[image]` with width and height, then `[name]` with matrices below their titles.
fn read_ini(text: &str) -> Result<Content> {
    let lines: Vec<&str> =
        text.lines().map(str::trim).filter(|l| !l.is_empty() && !l.starts_with('#')).collect();
    let below = |title: &str| -> Result<Vec<f64>> {
        let at = lines
            .iter()
            .position(|l| *l == title)
            .ok_or_else(|| Error::Invalid(format!("the field {title} is missing")))?;
        let mut values = Vec::new();
        for line in &lines[at + 1..] {
            if line.starts_with(|c: char| c.is_ascii_alphabetic() && !matches!(c, 'n' | 'i' | 'N' | 'I'))
                || line.starts_with('[')
            {
                break;
            }
            values.extend(Node::Text((*line).to_owned()).numbers(title)?);
        }
        Ok(values)
    };
    let one = |title: &str| match below(title)?.as_slice() {
        [v] => Ok(*v),
        other => Err(Error::Invalid(format!("{title} has {} numbers, 1 is expected", other.len()))),
    };
    let size = size_px(one("width")?, one("height")?)?;
    let intrinsics = camera_matrix("camera matrix", &below("camera matrix")?)?;
    let camera = lens::opencv(size, intrinsics, &below("distortion")?)?;
    let section = |l: &&str| {
        l.strip_prefix('[').and_then(|l| l.strip_suffix(']')).filter(|n| *n != "image").map(str::to_owned)
    };
    let evidence = Evidence { name: lines.iter().find_map(section), ..Evidence::default() };
    Ok(Content { evidence, ..camera.into() })
}
