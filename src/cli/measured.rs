//! Corners and points that were measured before: read from files instead of found in pictures.

use std::path::{Path, PathBuf};

use super::{files, frames::Inspected};
use crate::{
    calib::{
        Error, Result,
        report::{CornerFile, CornerFrame},
        survey::{self, Observations},
        target::{BoardSize, Length, PointSet, Target, Unit},
    },
    job::{
        assemble::{Entry, Finding, Seen},
        photo::{self, Exif},
    },
};

/// Where corners are, and of what.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct Measured {
    /// Corners from a file instead of pictures: JSON of `detect`, or CSV of other programs: image,id,u,v and if known sigma
    #[arg(long, value_name = "FILE")]
    pub(super) corners: Option<PathBuf>,
    /// Known points instead of a board, flat or not: CSV, id,x,y,z in a right-handed frame. --corners says where they were seen
    #[arg(long, value_name = "FILE.csv", requires = "corners", conflicts_with_all = ["board", "square"])]
    target: Option<PathBuf>,
    /// Unit of the known points: mm, cm, m or in
    #[arg(long, value_name = "UNIT", requires = "target", value_parser = unit)]
    unit: Option<Unit>,
    /// Size of the pictures in px, where neither --corners nor the pictures tell it
    #[arg(long, value_name = "WxH", requires = "corners", value_parser = size_px)]
    image_size: Option<[u32; 2]>,
}

fn unit(text: &str) -> Result<Unit> {
    match format!("1{}", text.trim()).parse::<Length>() {
        Ok(length) if length.unit != Unit::Unspecified => Ok(length.unit),
        _ => Err(Error::Invalid(format!("\"{text}\" is not a unit: choose one of mm, cm, m, in"))),
    }
}

fn size_px(text: &str) -> Result<[u32; 2]> {
    let side = |s: &str| s.trim().parse::<u32>().ok().filter(|n| (1..=100_000).contains(n));
    let lower = text.to_lowercase().replace('×', "x");
    lower.split_once('x').and_then(|(w, h)| Some([side(w)?, side(h)?])).ok_or_else(|| {
        Error::Invalid(format!(
            "\"{text}\" is not a size of pictures: write width x height in px, for example 1920x1080"
        ))
    })
}

/// What the files hold.
pub(super) struct Given {
    pub(super) board: Option<BoardSize>,
    /// Edge of a square, or 1 of the points, with its unit.
    pub(super) square: Option<(f64, Unit)>,
    pub(super) target: Option<Target>,
    pub(super) inspected: Inspected,
}

impl Measured {
    /// All its files.
    pub(super) fn files(&self) -> impl Iterator<Item = &Path> {
        [&self.corners, &self.target].into_iter().flatten().map(PathBuf::as_path)
    }

    /// Reads them; `None` where there are no corners to read. Sizes that are said nowhere are taken from the pictures that the file
    /// names, looked for where it says, beside the file, and in `paths`, and else are `usual`.
    ///
    /// # Errors
    /// [`Error::File`] and [`Error::Format`] with the file, the line and what was expected.
    pub(super) fn read(&self, paths: &[PathBuf], usual: Option<[u32; 2]>) -> Result<Option<Given>> {
        let Some(path) = &self.corners else { return Ok(None) };
        let name = path.display().to_string();
        let points = self
            .target
            .as_ref()
            .map(|target| survey::points(&files::text(target)?, &target.display().to_string()))
            .transpose()?;
        let text = files::text(path)?;
        let (file, seen) = if is_json(path, &text) {
            (json(&text, &name, points.as_ref())?, None)
        } else {
            let seen = Observations::from_csv(&text, &name, points.as_ref())?;
            (CornerFile { board: None, square: None, frames: seen.frames.clone() }, Some(seen))
        };
        let listed = photo::list(paths)?;
        let size = |frame: &CornerFrame| -> Result<[u32; 2]> {
            if let Some(size_px) = frame.size_px.or(self.image_size) {
                return Ok(size_px);
            }
            let same_name = listed.iter().find(|p| p.file_name() == Path::new(&frame.file).file_name());
            let places = frame.places(path);
            match same_name.or_else(|| places.iter().find(|p| p.is_file())) {
                Some(place) => photo::size_px(place),
                None => usual.ok_or_else(|| {
                    Error::format(
                        &name,
                        format!(
                            "{}: its size is not known: give --image-size, for example 1920x1080, or the folder of the pictures{}",
                            frame.file,
                            if seen.is_none() { ", or add \"image_size_px\": [width, height]" } else { "" }
                        ),
                    )
                }),
            }
        };
        let sizes = file.frames.iter().map(size).collect::<Result<Vec<_>>>()?;
        if let Some(seen) = &seen {
            seen.inside(&sizes)?;
        }
        let entries =
            file.frames.into_iter().zip(sizes).map(|(frame, size_px)| entry(frame, size_px)).collect();
        let unit = points.as_ref().map(|_| (1.0, self.unit.unwrap_or(Unit::Unspecified)));
        Ok(Some(Given {
            board: file.board.filter(|_| points.is_none()),
            square: unit.or(file.square),
            target: points.map(|points| Target::Points { points }),
            inspected: Inspected { entries, read_ms: 0.0, detect_ms: 0.0 },
        }))
    }
}

/// Whether a corner file is JSON and no CSV.
fn is_json(path: &Path, text: &str) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("json"))
        || text.trim_start_matches('\u{feff}').trim_start().starts_with(['{', '['])
}

/// A corner file; of known points an index is a name.
fn json(text: &str, name: &str, points: Option<&PointSet>) -> Result<CornerFile> {
    let mut file = CornerFile::from_json(text, name)?;
    if let Some(points) = points {
        file.frames.iter_mut().try_for_each(|frame| survey::by_name(&mut frame.corners, points, name))?;
    }
    Ok(file)
}

fn entry(frame: CornerFrame, size_px: [u32; 2]) -> Entry {
    let seen = Seen {
        size_px,
        exif: Exif::default(),
        pixels_hash: None,
        notes: Vec::new(),
        finding: Finding::Corners { corners: frame.corners, why: frame.why },
        other: crate::job::Other::default(),
    };
    Entry { file: frame.file, seen: Ok(seen) }
}
