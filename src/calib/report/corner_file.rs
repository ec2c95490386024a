//! Corners from a file instead of pictures: the JSON of `detect` or `calibrate`, a truth file of `synth`, or the like of it
//! written by another program.

use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
};

use serde::Deserialize;
use serde_json::Value;

use super::wire;
use crate::calib::{
    Error, Result, json,
    observation::Corner,
    order,
    target::{BoardSize, Length, Unit},
};

/// What a corner file holds.
#[derive(Clone, Debug, PartialEq)]
pub struct CornerFile {
    /// Inner corners of the board.
    pub board: Option<BoardSize>,
    /// Edge of a square, with its unit.
    pub square: Option<(f64, Unit)>,
    /// The pictures.
    pub frames: Vec<CornerFrame>,
}

/// A picture in a corner file.
#[derive(Clone, Debug, PartialEq)]
pub struct CornerFrame {
    /// Its path, as the file says.
    pub file: String,
    /// `[width, height]`, px; `None` where the file does not say.
    pub size_px: Option<[u32; 2]>,
    /// Ascending by index, each index once; σ is 0 where the file does not say.
    pub corners: Vec<Corner>,
    /// Why there are none or not all.
    pub why: String,
}

#[derive(Deserialize)]
struct Wire {
    #[serde(default)]
    settings: WireBoard,
    board: Option<String>,
    square: Option<Value>,
    unit: Option<Unit>,
    image_size_px: Option<[u32; 2]>,
    camera: Option<WireCamera>,
    frames: Vec<WireFrame>,
}

#[derive(Default, Deserialize)]
struct WireBoard {
    board: Option<String>,
    square: Option<Value>,
    unit: Option<Unit>,
}

#[derive(Deserialize)]
struct WireCamera {
    size_px: Option<[u32; 2]>,
}

#[derive(Deserialize)]
struct WireFrame {
    file: String,
    image_size_px: Option<[u32; 2]>,
    #[serde(default, with = "wire::corners")]
    corners: Vec<Corner>,
    #[serde(default)]
    why: Option<String>,
}

impl CornerFile {
    /// Reads a corner file; `file` is its name for messages.
    ///
    /// # Errors
    /// [`Error::Format`] with the picture and what was expected.
    pub fn from_json(text: &str, file: &str) -> Result<Self> {
        let wrong = |message: String| Error::format(file, message);
        let wire: Wire = json::read(text.trim_start_matches('\u{feff}')).map_err(|e| {
            wrong(format!("not a corner file ({e}): give what `straightedge detect --json` printed"))
        })?;
        let own = WireBoard { board: wire.board, square: wire.square, unit: wire.unit };
        let board = own.board.as_ref().or(wire.settings.board.as_ref());
        let board = board.map(|b| b.parse()).transpose().map_err(|e: Error| wrong(e.to_string()))?;
        let square = own.length(&wrong)?.or(wire.settings.length(&wrong)?);
        let size_px = wire.image_size_px.or(wire.camera.and_then(|c| c.size_px));
        let mut names = BTreeSet::new();
        let frames = wire.frames.into_iter().map(|frame| {
            let name = frame.file.clone();
            if !names.insert(name.clone()) {
                return Err(wrong(format!("{name} is listed twice: remove one of them")));
            }
            frame.check(size_px).map_err(|what| wrong(format!("{name}: {what}")))
        });
        Ok(Self { board, square, frames: frames.collect::<Result<_>>()? })
    }
}

impl WireBoard {
    fn length(&self, wrong: &impl Fn(String) -> Error) -> Result<Option<(f64, Unit)>> {
        let text = match &self.square {
            None => return Ok(None),
            Some(Value::String(text)) => text.clone(),
            // A number; what is neither is refused in its own words.
            Some(other) => other.to_string(),
        };
        let length: Length = text.parse().map_err(|e: Error| wrong(format!("square: {e}")))?;
        let unit =
            if length.unit == Unit::Unspecified { self.unit.unwrap_or(length.unit) } else { length.unit };
        Ok(Some((length.value, unit)))
    }
}

impl WireFrame {
    fn check(self, size_px: Option<[u32; 2]>) -> std::result::Result<CornerFrame, String> {
        let mut corners = self.corners;
        order::by(&mut corners, |c| [c.index.into()]);
        if let Some(twice) = corners.windows(2).find(|w| w[0].index == w[1].index) {
            return Err(format!("corner {} is given twice: remove one of them", twice[0].index));
        }
        if let Some(bad) = corners.iter().find(|c| !(c.sigma_px >= 0.0 && c.sigma_px.is_finite())) {
            return Err(format!("corner {}: σ must not be negative", bad.index));
        }
        let size_px = self.image_size_px.or(size_px);
        if size_px.is_some_and(|s| s.contains(&0)) {
            return Err("the picture is empty: give its width and height in image_size_px".to_owned());
        }
        Ok(CornerFrame { file: self.file, size_px, corners, why: self.why.unwrap_or_default() })
    }
}

impl CornerFrame {
    /// Where the picture may be: as the file says, and beside the corner file.
    pub fn places(&self, corner_file: &Path) -> [PathBuf; 2] {
        let own = PathBuf::from(&self.file);
        [own.clone(), corner_file.parent().unwrap_or(Path::new("")).join(own)]
    }
}
