//! Agisoft Metashape XML: the lens file, and on reading also the sensor of a camera export.
//!
//! The principal point is given from the middle of the picture, and the top-left *corner* is (0, 0):
//! `cx_ms = cx + 0.5 − w/2`. One focal length `f = fy` with the affinity `b1 = fx − fy` and the skew `b2`; `P1` and `P2` are OpenCV's `p2` and `p1`.
//! Terms that are zero may be absent.

use std::fmt::Write as _;

use roxmltree::{Document, Node as Xml};

use super::{
    Content, Draft, Evidence, Export, Format,
    lens::{self, held},
    node::{Node, size_px},
    number::number,
};
use crate::calib::{
    Error, Result,
    camera::{Camera, Model},
};

pub(super) const FORMAT: Format = Format {
    name: "metashape",
    title: "Agisoft Metashape XML",
    extensions: &["xml"],
    usual: &["xml"],
    stem: "camera",
    convention: "The principal point counts from the middle of the picture. k1 k2 k3; P1 is OpenCV's p2 and P2 is p1; f is fy, b1 is fx − fy, b2 the skew. A fisheye is equidistant with k1 k2 k3 k4.",
    lacks: "rational and further terms, double sphere and EUCM (refitted), poses, sigmas",
    write,
    read,
    sniff: |t| {
        t.trim_start().starts_with('<') && t.contains("<calibration") && !t.contains("<opencv_storage>")
    },
};

fn write(export: &Export<'_>) -> Result<Draft> {
    let has = &[Model::Brown5, Model::Kb4, Model::Brown5Skew];
    let (camera, note) = held(export.camera, has, &[Model::Brown5, Model::Kb4], "Metashape")?;
    let projection = if camera.model == Model::Kb4 { "fisheye" } else { "frame" };
    let [fx, fy, cx, cy] = camera.intrinsics();
    let term = |name: &str| camera.get(name).unwrap_or(0.0);
    let [w, h] = camera.size_px;
    let center = |c: f64, extent: u32| (c - f64::from(extent) / 2.0) + 0.5;
    let mut text = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<calibration>\n  <projection>{projection}</projection>\n  <width>{w}</width>\n  <height>{h}</height>\n"
    );
    for (name, value) in [
        ("f", fy),
        ("cx", center(cx, w)),
        ("cy", center(cy, h)),
        ("b1", fx - fy),
        ("b2", term("skew")),
        ("k1", term("k1")),
        ("k2", term("k2")),
        ("k3", term("k3")),
        ("k4", term("k4")),
        ("p1", term("p2")),
        ("p2", term("p1")),
    ] {
        if name == "k4" && value == 0.0 {
            continue;
        }
        let _ = writeln!(text, "  <{name}>{}</{name}>", number(value));
    }
    text += "</calibration>\n";
    Ok(Draft::noted(text, note))
}

fn read(text: &str) -> Result<Content> {
    let document = Document::parse(text).map_err(|e| Error::Invalid(format!("not valid XML: {e}")))?;
    let all: Vec<Xml<'_, '_>> = document.descendants().filter(|n| n.has_tag_name("calibration")).collect();
    // A camera export has the initial and the adjusted calibration of each sensor.
    let adjusted: Vec<Xml<'_, '_>> =
        all.iter().filter(|n| n.attribute("class") == Some("adjusted")).copied().collect();
    let candidates = if adjusted.is_empty() { &all } else { &adjusted };
    let Some(calibration) = candidates.first() else {
        return Err(Error::Invalid("the element <calibration> is missing".to_owned()));
    };
    let mut notes = Vec::new();
    if candidates.len() > 1 {
        notes.push(format!("the file holds {} calibrations: the first one is used", candidates.len()));
    }
    let camera = read_calibration(*calibration)?;
    let sensor = calibration.parent().filter(|p| p.has_tag_name("sensor"));
    let evidence = Evidence {
        name: sensor.and_then(|s| s.attribute("label")).map(str::to_owned),
        ..Evidence::default()
    };
    Ok(Content { camera, evidence, notes })
}

fn read_calibration(calibration: Xml<'_, '_>) -> Result<Camera> {
    let child = |name: &str| calibration.children().find(|n| n.has_tag_name(name));
    let value = |name: &str| match child(name) {
        Some(n) => Node::Text(n.text().unwrap_or("").trim().to_owned()).number(name),
        None => Ok(0.0),
    };
    let projection =
        calibration.attribute("type").or_else(|| child("projection").and_then(|n| n.text())).map(str::trim);
    let fisheye = match projection {
        None | Some("frame") => false,
        Some("fisheye") => true,
        Some(other) => {
            return Err(Error::Unsupported(format!(
                "projection {other} is not supported: only frame and fisheye are"
            )));
        }
    };
    if child("f").is_none() {
        let text = if child("fx").is_some() {
            "<fx>, <fy>: a lens file of PhotoScan before 1.2; load it in Metashape and save it again"
        } else {
            "the element <f> is missing"
        };
        return Err(Error::Invalid(text.to_owned()));
    }
    let size_of = |n: Xml<'_, '_>| -> Result<[u32; 2]> {
        let number = |name: &str| {
            let text =
                n.attribute(name).ok_or_else(|| Error::Invalid(format!("resolution has no {name}")))?;
            Node::Text(text.to_owned()).number(name)
        };
        size_px(number("width")?, number("height")?)
    };
    let size = match child("resolution") {
        Some(n) => size_of(n)?,
        None if child("width").is_some() => size_px(value("width")?, value("height")?)?,
        None => return Err(Error::Invalid("the element <width> (or <resolution>) is missing".to_owned())),
    };
    if let Some(outer) =
        calibration.parent().and_then(|p| p.children().find(|n| n.has_tag_name("resolution")))
    {
        let other = size_of(outer)?;
        if other != size {
            return Err(Error::Invalid(format!(
                "two picture sizes contradict each other: {}x{} and {}x{}",
                other[0], other[1], size[0], size[1]
            )));
        }
    }
    let beyond: &[&str] = if fisheye { &["b2", "p1", "p2", "p3", "p4"] } else { &["k4", "p3", "p4"] };
    for name in beyond.iter().copied() {
        let v = value(name)?;
        if v != 0.0 {
            return Err(Error::Unsupported(format!(
                "{name} = {v}: only f cx cy b1 k1 k2 k3 with b2 p1 p2 (frame) or k4 (fisheye) are supported"
            )));
        }
    }
    let [w, h] = size.map(f64::from);
    let (f, b1) = (value("f")?, value("b1")?);
    let intrinsics = [f + b1, f, (value("cx")? - 0.5) + w / 2.0, (value("cy")? - 0.5) + h / 2.0];
    if fisheye {
        return lens::fisheye(size, intrinsics, &[value("k1")?, value("k2")?, value("k3")?, value("k4")?]);
    }
    let terms = [value("k1")?, value("k2")?, value("p2")?, value("p1")?, value("k3")?];
    lens::with_skew(lens::opencv(size, intrinsics, &terms)?, value("b2")?)
}
