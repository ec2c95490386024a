//! MATLAB script that makes a `cameraIntrinsics` object.
//!
//! The centre of the first pixel is (1, 1); the picture size is `[rows columns]`; `p1 p2` as in `OpenCV`. Read are also
//! `cameraParameters` with `K` or `IntrinsicMatrix` (that one transposed), and simple variables.

use std::collections::BTreeMap;

use super::{
    Content, Draft, Export, Format,
    lens::{self, held, moved},
    node::{Node, size_px},
    number::{array, joined},
    opencv::camera_matrix,
};
use crate::calib::{Error, Result, camera::Model};

pub(super) const FORMAT: Format = Format {
    name: "matlab",
    title: "MATLAB script",
    extensions: &["m"],
    usual: &["m"],
    stem: "camera",
    convention: "The first pixel is (1, 1): cx and cy are one pixel larger than OpenCV's. Radial k1 k2 k3, tangential p1 p2, skew.",
    lacks: "rational and further terms (refitted), fisheye lenses beyond 90°, poses, sigmas",
    write,
    read,
    sniff: |t| t.contains("cameraIntrinsics") || t.contains("cameraParameters"),
};

/// Offset of MATLAB's principal point from ours, px.
const ORIGIN: f64 = 1.0;

fn write(export: &Export<'_>) -> Result<Draft> {
    let (camera, note) = held(
        export.camera,
        &[Model::Brown5, Model::Brown5Skew],
        &[Model::Brown5],
        "MATLAB's cameraIntrinsics",
    )?;
    let [fx, fy, cx, cy] = moved(camera.intrinsics(), ORIGIN);
    let [k1, k2, p1, p2, k3] = ["k1", "k2", "p1", "p2", "k3"].map(|name| camera.get(name).unwrap_or(0.0));
    let [w, h] = camera.size_px;
    let list = |values: &[f64]| joined(values, " ");
    let skew = match camera.get("skew") {
        Some(skew) if skew != 0.0 => format!(", 'Skew', {}", list(&[skew])),
        _ => String::new(),
    };
    let text = format!(
        "% MATLAB counts pixels from 1: the principal point is one larger than in OpenCV.\nintrinsics = cameraIntrinsics([{}], [{}], [{h} {w}], ...\n    'RadialDistortion', [{}], 'TangentialDistortion', [{}]{skew});\n",
        list(&[fx, fy]),
        list(&[cx, cy]),
        list(&[k1, k2, k3]),
        list(&[p1, p2]),
    );
    Ok(Draft::noted(text, note))
}

fn wrong(message: impl Into<String>) -> Error {
    Error::Invalid(message.into())
}

fn read(text: &str) -> Result<Content> {
    let script = clean(text);
    let (name, arguments) = ["cameraIntrinsics", "cameraParameters"]
        .iter()
        .find_map(|name| {
            let after = &script[script.find(&format!("{name}("))? + name.len() + 1..];
            Some((*name, after))
        })
        .ok_or_else(|| wrong("no call of cameraIntrinsics(…) was found"))?;
    let arguments = split(arguments)
        .ok_or_else(|| wrong(format!("{name}(… has no closing bracket: the file is cut off")))?;
    let (plain, named) = by_name(&arguments);
    let value = |text: &str, field: &str| numbers(text, field, &script, 0);
    let optional = |field: &str| named.get(field).map_or(Ok(Vec::new()), |t| value(t, field));
    let (k, skew, image_size) = if name == "cameraIntrinsics" {
        let pair = |i: usize, field: &str| {
            let text = plain.get(i).ok_or_else(|| wrong(format!("{field} is missing")))?;
            match value(text, field)?.as_slice() {
                [v] => Ok([*v; 2]),
                [a, b] => Ok([*a, *b]),
                other => Err(wrong(format!("{field} has {} numbers, 2 are expected", other.len()))),
            }
        };
        let ([fx, fy], [cx, cy]) = (pair(0, "focalLength")?, pair(1, "principalPoint")?);
        let skew = optional("Skew")?.first().copied().unwrap_or(0.0);
        ([fx, fy, cx, cy], skew, pair(2, "imageSize")?)
    } else {
        let (field, mut matrix) = match (named.get("K"), named.get("IntrinsicMatrix")) {
            (Some(t), _) => ("K", value(t, "K")?),
            (None, Some(t)) => ("IntrinsicMatrix", value(t, "IntrinsicMatrix")?),
            (None, None) => return Err(wrong("the argument K is missing")),
        };
        if field == "IntrinsicMatrix" && matrix.len() == 9 {
            matrix = [0, 3, 6, 1, 4, 7, 2, 5, 8].map(|i| matrix[i]).to_vec();
        }
        let size = array(&optional("ImageSize")?)
            .ok_or_else(|| wrong("the argument ImageSize (two numbers) is missing"))?;
        // The only place of a skew is the matrix.
        let skew = matrix.get_mut(1).map_or(0.0, std::mem::take);
        (camera_matrix(field, &matrix)?, skew, size)
    };
    let radial = optional("RadialDistortion")?;
    let tangential = optional("TangentialDistortion")?;
    let (k1, k2, k3) = match radial.as_slice() {
        [] => (0.0, 0.0, 0.0),
        [k1, k2] => (*k1, *k2, 0.0),
        [k1, k2, k3] => (*k1, *k2, *k3),
        other => {
            return Err(wrong(format!("RadialDistortion has {} numbers, 2 or 3 are expected", other.len())));
        }
    };
    let (p1, p2) = match tangential.as_slice() {
        [] => (0.0, 0.0),
        [p1, p2] => (*p1, *p2),
        other => {
            return Err(wrong(format!("TangentialDistortion has {} numbers, 2 are expected", other.len())));
        }
    };
    let [rows, columns] = image_size;
    let plain = lens::opencv(size_px(columns, rows)?, moved(k, -ORIGIN), &[k1, k2, p1, p2, k3])?;
    Ok(lens::with_skew(plain, skew)?.into())
}

/// Without comments and line continuations.
fn clean(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for line in text.lines() {
        let code = line.split('%').next().unwrap_or("");
        match code.split_once("...") {
            Some((before, _)) => out.push_str(before),
            None => {
                out.push_str(code);
                out.push('\n');
            }
        }
    }
    out
}

/// The arguments up to the bracket that closes the call; `None` where there is none.
fn split(text: &str) -> Option<Vec<String>> {
    let mut arguments = vec![String::new()];
    let mut depth = 0usize;
    let mut quote = None;
    for c in text.chars() {
        match (quote, c) {
            (Some(q), _) if c == q => quote = None,
            (None, '\'' | '"') => quote = Some(c),
            (None, '(' | '[' | '{') => depth += 1,
            (None, ')') if depth == 0 => return Some(arguments),
            (None, ')' | ']' | '}') => depth = depth.saturating_sub(1),
            (None, ',') if depth == 0 => {
                arguments.push(String::new());
                continue;
            }
            _ => {}
        }
        if let Some(last) = arguments.last_mut() {
            last.push(c);
        }
    }
    None
}

/// Positional arguments, then `'Name', value` or `Name=value`.
fn by_name(arguments: &[String]) -> (Vec<&str>, BTreeMap<String, &str>) {
    let (mut plain, mut named) = (Vec::new(), BTreeMap::new());
    let mut rest = arguments.iter().map(|a| a.trim());
    while let Some(argument) = rest.next() {
        if argument.starts_with(['\'', '"']) {
            if let Some(value) = rest.next() {
                named.insert(argument.trim_matches(['\'', '"']).to_owned(), value);
            }
        } else if let Some((name, value)) = argument.split_once('=') {
            named.insert(name.trim().to_owned(), value.trim());
        } else {
            plain.push(argument);
        }
    }
    (plain, named)
}

/// The numbers of `[1 2; 3 4]`, of a number, or of a variable that is assigned such a value.
fn numbers(text: &str, field: &str, script: &str, depth: usize) -> Result<Vec<f64>> {
    let t = text.trim();
    let word = |c: char| c.is_ascii_alphanumeric() || c == '_';
    if depth < 4 && t.starts_with(|c: char| c.is_ascii_alphabetic()) && t.chars().all(word) {
        let value = script.match_indices('=').find_map(|(at, _)| {
            let before = script[..at].trim_end().rsplit(|c| !word(c)).next();
            (before == Some(t)).then(|| script[at + 1..].trim_start())
        });
        // A matrix may hold semicolons and line ends.
        return match value {
            Some(v) if v.starts_with('[') => {
                numbers(v.split_inclusive(']').next().unwrap_or(v), field, script, depth + 1)
            }
            Some(v) => numbers(v.split([';', '\n']).next().unwrap_or(v), field, script, depth + 1),
            None => Err(wrong(format!("{field}: the variable {t} is not assigned in the file"))),
        };
    }
    let inner = t.trim_start_matches('[').trim_end_matches(']').replace(';', " ");
    Node::Text(inner).numbers(field)
}
