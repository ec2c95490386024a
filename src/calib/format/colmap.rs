//! COLMAP `cameras.txt`, first camera.
//!
//! The top-left *corner* of the picture is (0, 0): principal points are half a pixel larger than here.
//! Models in COLMAP's order: `OPENCV fx fy cx cy k1 k2 p1 p2`, `FULL_OPENCV … k3 k4 k5 k6`.

use super::{
    Content, Draft, Export, Format,
    lens::{self, held, moved, opencv_terms},
    node::{Node, size_px},
    number::joined,
};
use crate::calib::{Error, Result, camera::Model};

pub(super) const FORMAT: Format = Format {
    name: "colmap",
    title: "COLMAP cameras.txt",
    extensions: &["txt"],
    usual: &["txt"],
    stem: "cameras",
    convention: "The corner of the first pixel is (0, 0): cx and cy are half a pixel larger than OpenCV's. OPENCV k1 k2 p1 p2, FULL_OPENCV k3 k4 k5 k6 more, OPENCV_FISHEYE k1 k2 k3 k4.",
    lacks: "thin prism, tilt, double sphere and EUCM (refitted), poses (they are in images.txt), sigmas",
    write,
    read,
    sniff: |t| camera_lines(t).next().is_some(),
};

/// Offset of COLMAP's principal point from ours, px.
const ORIGIN: f64 = 0.5;

/// What COLMAP has, and what stands for the rest.
const HAS: &[Model] = &[Model::Pinhole, Model::Rational, Model::Kb4];
const OTHERWISE: &[Model] = &[Model::Rational, Model::Kb4];

/// Lines `ID MODEL W H PARAMS…`, split.
fn camera_lines(text: &str) -> impl Iterator<Item = Vec<&str>> {
    text.lines().filter(|l| !l.trim_start().starts_with('#')).filter_map(|l| {
        let words: Vec<&str> = l.split_whitespace().collect();
        let model = *words.get(1)?;
        let is_model = model.len() > 2
            && model.bytes().all(|b| b.is_ascii_uppercase() || b == b'_' || b.is_ascii_digit());
        (words[0].bytes().all(|b| b.is_ascii_digit()) && is_model && model.as_bytes()[0].is_ascii_uppercase())
            .then_some(words)
    })
}

fn write(export: &Export<'_>) -> Result<Draft> {
    let (camera, note) = held(export.camera, HAS, OTHERWISE, "COLMAP")?;
    let k = moved(camera.intrinsics(), ORIGIN);
    let (name, rest) = match opencv_terms(&camera) {
        None => ("OPENCV_FISHEYE", camera.params[4..].to_vec()),
        Some(_) if camera.model == Model::Pinhole => ("PINHOLE", vec![]),
        Some(terms) if terms.len() == 5 && terms[4] == 0.0 => ("OPENCV", terms[..4].to_vec()),
        Some(mut terms) => {
            terms.resize(8, 0.0);
            ("FULL_OPENCV", terms)
        }
    };
    let [w, h] = camera.size_px;
    let text = format!(
        "# Camera list with one line of data per camera:\n#   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n# Number of cameras: 1\n1 {name} {w} {h} {}\n",
        joined(k.iter().chain(&rest), " ")
    );
    Ok(Draft::noted(text, note))
}

fn read(text: &str) -> Result<Content> {
    let mut lines = camera_lines(text);
    let Some(words) = lines.next() else {
        return Err(Error::Invalid("no line CAMERA_ID MODEL WIDTH HEIGHT PARAMS was found".to_owned()));
    };
    let others = lines.count();
    let mut notes = Vec::new();
    if others > 0 {
        notes.push(format!("the file holds {} cameras: camera {} is used", others + 1, words[0]));
    }
    let model = words[1];
    let value = |i: usize, field: &str| match words.get(i) {
        Some(w) => Node::Text((*w).to_owned()).number(field),
        None => Err(Error::Invalid(format!("{field} is missing: the line is cut off"))),
    };
    let size = size_px(value(2, "WIDTH")?, value(3, "HEIGHT")?)?;
    let p: Vec<f64> = (4..words.len()).map(|i| value(i, "PARAMS")).collect::<Result<_>>()?;
    let need = match model {
        "SIMPLE_PINHOLE" => 3,
        "PINHOLE" | "SIMPLE_RADIAL" => 4,
        "RADIAL" => 5,
        "OPENCV" | "OPENCV_FISHEYE" => 8,
        "FULL_OPENCV" => 12,
        other => {
            return Err(Error::Unsupported(format!(
                "the COLMAP model {other} is not supported yet: SIMPLE_PINHOLE, PINHOLE, SIMPLE_RADIAL, RADIAL, OPENCV, FULL_OPENCV and OPENCV_FISHEYE are read"
            )));
        }
    };
    if p.len() != need {
        return Err(Error::Invalid(format!(
            "the model {model} has {need} parameters, {} were found",
            p.len()
        )));
    }
    let (k, d): ([f64; 4], &[f64]) = match model {
        "SIMPLE_PINHOLE" | "SIMPLE_RADIAL" | "RADIAL" => ([p[0], p[0], p[1], p[2]], &p[3..]),
        _ => ([p[0], p[1], p[2], p[3]], &p[4..]),
    };
    let read = if model == "OPENCV_FISHEYE" { lens::fisheye } else { lens::opencv };
    let camera = read(size, moved(k, -ORIGIN), d)?;
    Ok(Content { notes, ..camera.into() })
}
