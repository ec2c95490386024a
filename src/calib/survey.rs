//! Known points and where they were seen, as CSV of other programs: a target `id,x,y,z` and observations `image,id,u,v[,sigma]`.
//!
//! Points are in a right-handed frame and any one unit; pixels count from the centre of the first one. σ is that of a coordinate, px.

mod table;

use std::collections::BTreeMap;

use nalgebra::{Point3, Vector2};

use super::{Error, Result, observation::Corner, order, report::CornerFrame, target::PointSet};
use table::{Row, Table};

/// Reads known points; `file` is its name for messages.
///
/// # Errors
/// [`Error::Format`] with the line and what was expected; also for fewer than four points, and those on a line.
pub fn points(text: &str, file: &str) -> Result<PointSet> {
    let table = Table::new(text, file, &["id", "x", "y", "z"], &[])?;
    let mut lines = BTreeMap::new();
    let mut list = Vec::new();
    for row in table.rows() {
        let row = row?;
        let id = row.word(0)?.to_owned();
        if let Some(first) = lines.insert(id.clone(), row.line) {
            return Err(row.wrong(&format!("the point {id} is in line {first} already: remove one of them")));
        }
        list.push((id, Point3::new(row.number(1)?, row.number(2)?, row.number(3)?)));
    }
    PointSet::new(list).map_err(|e| Error::format(file, e.to_string()))
}

/// Places of points in pictures.
#[derive(Clone, Debug, PartialEq)]
pub struct Observations {
    /// The pictures, in the order in which the file names them first; their size is not known.
    pub frames: Vec<CornerFrame>,
    /// For each corner of each picture its line.
    lines: Vec<Vec<usize>>,
    file: String,
}

impl Observations {
    /// Reads them. The points are those of `target`; without one they are corners of a board by their index.
    ///
    /// # Errors
    /// [`Error::Format`] with the line and what was expected.
    pub fn from_csv(text: &str, file: &str, target: Option<&PointSet>) -> Result<Self> {
        let table = Table::new(text, file, &["image", "id", "u", "v"], &["sigma"])?;
        let named: BTreeMap<&str, u32> = target
            .map(|t| order::map(t.names().iter().zip(0..).map(|(name, i)| (name.as_str(), i))))
            .unwrap_or_default();
        let mut positions = BTreeMap::<String, usize>::new();
        let mut frames: Vec<(String, BTreeMap<u32, (usize, Corner)>)> = Vec::new();
        for row in table.rows() {
            let row = row?;
            let (image, id) = (row.word(0)?, row.word(1)?);
            let index = match target {
                Some(_) => named.get(id).copied().ok_or_else(|| unknown(&row, id, &named))?,
                None => id.parse().map_err(|_| {
                    row.wrong(&format!(
                        "\"{id}\" is no index of a corner of a board: give the known points themselves with --target"
                    ))
                })?,
            };
            let sigma_px = if row.has(4) { row.number(4)? } else { 0.0 };
            if sigma_px < 0.0 {
                return Err(row.wrong("sigma must not be negative"));
            }
            let corner = Corner { index, px: Vector2::new(row.number(2)?, row.number(3)?), sigma_px };
            let at = *positions.entry(image.to_owned()).or_insert(frames.len());
            if at == frames.len() {
                frames.push((image.to_owned(), BTreeMap::new()));
            }
            if let Some((first, _)) = frames[at].1.insert(index, (row.line, corner)) {
                return Err(row.wrong(&format!(
                    "the point {id} of {image} is in line {first} already: remove one of them"
                )));
            }
        }
        if frames.is_empty() {
            return Err(Error::format(
                file,
                "there is no observation in it: lines of image,id,u,v are expected",
            ));
        }
        let (mut list, mut lines) = (Vec::new(), Vec::new());
        for (name, corners) in frames {
            let (at, corners) = corners.into_values().unzip();
            lines.push(at);
            list.push(CornerFrame { file: name, size_px: None, corners, why: String::new() });
        }
        Ok(Self { frames: list, lines, file: file.to_owned() })
    }

    /// Refuses points outside pictures of these sizes, one for each of `frames`.
    ///
    /// # Errors
    /// [`Error::Format`] with the line of the first one.
    pub fn inside(&self, sizes_px: &[[u32; 2]]) -> Result<()> {
        for ((frame, lines), size) in self.frames.iter().zip(&self.lines).zip(sizes_px) {
            let pairs = frame.corners.iter().zip(lines);
            let mut bad: Vec<(&Corner, &usize)> = pairs.filter(|(c, _)| c.is_outside(*size)).collect();
            order::by(&mut bad, |c| [*c.1 as f64]);
            if let Some((corner, line)) = bad.first() {
                let [w, h] = size;
                return Err(Error::format(
                    &self.file,
                    format!(
                        "line {line}: {:.1}, {:.1} is outside a picture of {w} x {h} px: is --image-size that of these pictures?",
                        corner.px.x, corner.px.y
                    ),
                ));
            }
        }
        Ok(())
    }
}

/// A corner of a JSON file under the name that is its index.
///
/// # Errors
/// [`Error::Format`] where the target has no such point.
pub fn by_name(corners: &mut [Corner], target: &PointSet, file: &str) -> Result<()> {
    for corner in corners.iter_mut() {
        let id = corner.index.to_string();
        let found = target.names().iter().position(|name| *name == id);
        corner.index = found
            .ok_or_else(|| Error::format(file, format!("the point {id} is not among those of --target")))?
            as u32;
    }
    order::by(corners, |c| [f64::from(c.index)]);
    Ok(())
}

fn unknown(row: &Row<'_>, id: &str, named: &BTreeMap<&str, u32>) -> Error {
    let like: Vec<&str> = named.keys().copied().take(3).collect();
    row.wrong(&format!(
        "the point {id} is not in the file of --target, which has {}, …: are these files of one target?",
        like.join(", ")
    ))
}

#[cfg(test)]
mod tests;
