//! mrcal `.cameramodel`: a Python dictionary.
//!
//! Origin at the centre of the first pixel; `LENSMODEL_OPENCV5` = `fx fy cx cy k1 k2 p1 p2 k3`. The pose is that of the
//! reference in the camera; both spellings (`rt_cam_ref` and the older `extrinsics`) are written.

pub(super) mod splined;

use std::{iter::Peekable, str::Chars};

use super::{
    Content, Draft, Export, Format,
    lens::{self, held, opencv_terms},
    node::{Node, polygon, size_px},
    number::{joined, points},
};
use crate::calib::{Error, Result, camera::Model};

pub(super) const FORMAT: Format = Format {
    name: "mrcal",
    title: "mrcal cameramodel",
    extensions: &["cameramodel"],
    usual: &["cameramodel"],
    stem: "camera",
    convention: "The centre of the first pixel is (0, 0). LENSMODEL_OPENCV5, 8 or 12: k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4.",
    lacks: "fisheye lenses beyond 90°, poses of the board, sigmas",
    write,
    read,
    sniff: |t| {
        ["lensmodel", "lens_model", "distortion_model"].iter().any(|k| t.contains(&format!("'{k}'")))
            || t.contains("LENSMODEL_")
    },
};

/// What mrcal has of ours.
const HAS: &[Model] = &[Model::Pinhole, Model::Brown5, Model::Rational, Model::ThinPrism];

fn write(export: &Export<'_>) -> Result<Draft> {
    let (camera, note) = held(export.camera, HAS, &[Model::ThinPrism], "mrcal")?;
    let terms = opencv_terms(&camera).filter(|_| camera.model != Model::Pinhole).unwrap_or_default();
    let model = if terms.is_empty() { "PINHOLE".to_owned() } else { format!("OPENCV{}", terms.len()) };
    let k = camera.intrinsics();
    let region = export.evidence.safe.as_deref();
    let text = text_of(&format!("LENSMODEL_{model}"), k.iter().chain(&terms), camera.size_px, region);
    Ok(Draft::noted(text, note))
}

/// A file without a pose; the region where the model is valid is a closed contour there, its first point is its last.
fn text_of<'a>(
    model: &str,
    intrinsics: impl IntoIterator<Item = &'a f64>,
    [w, h]: [u32; 2],
    region: Option<&[[f64; 2]]>,
) -> String {
    let region = region.map_or(String::new(), |polygon| {
        let closed: Vec<[f64; 2]> = polygon.iter().chain(polygon.first()).copied().collect();
        format!("    'valid_intrinsics_region': [ {} ],\n\n", points(&closed))
    });
    format!(
        "{{\n    'lensmodel':  '{model}',\n\n    # intrinsics are fx,fy,cx,cy,distortion0,distortion1,....\n    'intrinsics': [ {},],\n\n    'rt_cam_ref': [ 0.0, 0.0, 0.0, 0.0, 0.0, 0.0,],\n    'extrinsics': [ 0.0, 0.0, 0.0, 0.0, 0.0, 0.0,],\n\n{region}    'imagersize': [ {w}, {h},],\n}}\n",
        joined(intrinsics, ", ")
    )
}

fn read(text: &str) -> Result<Content> {
    let root = literal(text)?;
    let model = ["lensmodel", "lens_model", "distortion_model"]
        .iter()
        .find_map(|k| root.text_at(k))
        .ok_or_else(|| Error::Invalid("the field lensmodel is missing".to_owned()))?;
    let short = model.trim_start_matches("LENSMODEL_").trim_start_matches("DISTORTION_");
    let terms = match short {
        "PINHOLE" | "NONE" => 0,
        "OPENCV4" => 4,
        "OPENCV5" => 5,
        "OPENCV8" => 8,
        "OPENCV12" => 12,
        _ => {
            return Err(Error::Unsupported(format!(
                "the lens model {model} is not supported yet: LENSMODEL_PINHOLE and LENSMODEL_OPENCV4, 5, 8 and 12 are read"
            )));
        }
    };
    let values = root.get("intrinsics")?.numbers("intrinsics")?;
    if values.len() != 4 + terms {
        return Err(Error::Invalid(format!(
            "intrinsics has {} numbers, {model} needs {}",
            values.len(),
            4 + terms
        )));
    }
    let [w, h] = root.array_at("imagersize")?;
    let k = [values[0], values[1], values[2], values[3]];
    let mut content = Content::from(lens::opencv(size_px(w, h)?, k, &values[4..])?);
    if let Some(region) = root.find("valid_intrinsics_region") {
        let mut contour = polygon(region, "valid_intrinsics_region")?;
        if contour.len() > 1 && contour.first() == contour.last() {
            contour.pop();
        }
        content.evidence.safe = Some(contour);
    }
    Ok(content)
}

/// Reads one Python literal: dictionaries, lists, tuples, strings, numbers.
fn literal(text: &str) -> Result<Node> {
    let mut python = Python { rest: text.chars().peekable(), line: 1 };
    let node = python.value(0)?;
    match python.skip() {
        None => Ok(node),
        Some(c) => Err(python.unexpected(c)),
    }
}

struct Python<'a> {
    rest: Peekable<Chars<'a>>,
    line: usize,
}

impl Python<'_> {
    fn unexpected(&self, c: char) -> Error {
        Error::Invalid(format!("line {}: unexpected \"{}\"", self.line, c.escape_default()))
    }

    fn cut_off(&self) -> Error {
        Error::Invalid(format!("line {}: the file is cut off", self.line))
    }

    fn next(&mut self) -> Option<char> {
        let c = self.rest.next()?;
        self.line += usize::from(c == '\n');
        Some(c)
    }

    /// Passes over blanks and comments; the next character.
    fn skip(&mut self) -> Option<char> {
        loop {
            match self.rest.peek().copied() {
                Some('#') => while self.rest.peek().is_some_and(|c| *c != '\n') && self.next().is_some() {},
                Some(c) if c.is_whitespace() => {
                    self.next();
                }
                other => return other,
            }
        }
    }

    fn value(&mut self, depth: usize) -> Result<Node> {
        let c = self.skip().ok_or_else(|| self.cut_off())?;
        match c {
            _ if depth > 32 => Err(Error::Invalid("nested too deeply for a camera file".to_owned())),
            '{' => self.dictionary(depth),
            '[' => self.list(']', depth),
            '(' => self.list(')', depth),
            '\'' | '"' => self.string().map(Node::Text),
            _ => {
                let mut word = String::new();
                while let Some(c) =
                    self.rest.peek().copied().filter(|c| c.is_ascii_alphanumeric() || "+-._".contains(*c))
                {
                    word.push(c);
                    self.next();
                }
                match word.as_str() {
                    "" => Err(self.unexpected(c)),
                    "None" => Ok(Node::Null),
                    // A bytes literal: the stored optimisation inputs.
                    "b" => self.string().map(Node::Text),
                    w => w
                        .parse()
                        .map(Node::Number)
                        .map_err(|_| Error::Invalid(format!("line {}: \"{w}\" is not a number", self.line))),
                }
            }
        }
    }

    fn string(&mut self) -> Result<String> {
        let quote = match self.next() {
            Some(c @ ('\'' | '"')) => c,
            Some(c) => return Err(self.unexpected(c)),
            None => return Err(self.cut_off()),
        };
        let mut out = String::new();
        loop {
            match self.next().ok_or_else(|| self.cut_off())? {
                '\\' => out.extend(self.next()),
                c if c == quote => return Ok(out),
                c => out.push(c),
            }
        }
    }

    fn list(&mut self, close: char, depth: usize) -> Result<Node> {
        self.next();
        let mut items = Vec::new();
        loop {
            match self.skip().ok_or_else(|| self.cut_off())? {
                c if c == close => {
                    self.next();
                    return Ok(Node::List(items));
                }
                ',' if !items.is_empty() => {
                    self.next();
                }
                _ => items.push(self.value(depth + 1)?),
            }
        }
    }

    fn dictionary(&mut self, depth: usize) -> Result<Node> {
        self.next();
        let mut entries = Vec::new();
        loop {
            match self.skip().ok_or_else(|| self.cut_off())? {
                '}' => {
                    self.next();
                    return Ok(Node::Map(entries));
                }
                ',' if !entries.is_empty() => {
                    self.next();
                }
                _ => {
                    let key = self.string()?;
                    match self.skip() {
                        Some(':') => self.next(),
                        Some(c) => return Err(self.unexpected(c)),
                        None => return Err(self.cut_off()),
                    };
                    entries.push((key, self.value(depth + 1)?));
                }
            }
        }
    }
}
