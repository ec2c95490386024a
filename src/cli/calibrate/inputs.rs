//! What `calibrate` reads beside pictures.

use std::path::{Path, PathBuf};

use crate::{
    calib::{
        Error, Result,
        camera::Camera,
        report::{CornerFile, CornerFrame},
        synth::Truth,
        target::{BoardSize, Unit},
    },
    cli::{files, frames::Inspected, say},
    job::{
        assemble::{Entry, Finding, Seen},
        evidence::Known,
        photo::{self, Exif},
    },
};

/// A start camera with the name of its file.
pub(super) fn start(path: &Path) -> Result<(String, Camera)> {
    let read = files::camera(path)?;
    read.notes.iter().for_each(|note| say(&format!("note: {note}")));
    Ok((path.display().to_string(), read.camera))
}

/// A truth file of `synth`, or a camera file.
pub(super) fn truth(path: &Path) -> Result<Known> {
    let camera = files::camera(path)?.camera;
    let scene = Truth::from_json(&files::text(path)?).ok();
    Ok(Known { file: path.display().to_string(), camera, scene })
}

/// What a corner file holds.
pub(super) struct Given {
    pub(super) board: Option<BoardSize>,
    pub(super) square: Option<(f64, Unit)>,
    pub(super) inspected: Inspected,
}

/// Reads a corner file. Sizes that it does not say are taken from the pictures that it names, looked for where it says, beside
/// the file, and in `paths`.
pub(super) fn corners(path: &Path, paths: &[PathBuf]) -> Result<Given> {
    let name = path.display().to_string();
    let file = CornerFile::from_json(&files::text(path)?, &name)?;
    let listed = photo::list(paths)?;
    let entry = |frame: CornerFrame| -> Result<Entry> {
        let size_px = match frame.size_px {
            Some(size_px) => size_px,
            None => {
                let same_name = listed.iter().find(|p| p.file_name() == Path::new(&frame.file).file_name());
                let places = frame.places(path);
                let place = same_name.or_else(|| places.iter().find(|p| p.is_file())).ok_or_else(|| {
                    Error::format(
                        &name,
                        format!(
                            "{}: its size is not known: add \"image_size_px\": [width, height], or give the folder of the pictures",
                            frame.file
                        ),
                    )
                })?;
                photo::size_px(place)?
            }
        };
        let finding = Finding::Corners { corners: frame.corners, why: frame.why };
        let seen = Seen {
            size_px,
            exif: Exif::default(),
            pixels_hash: None,
            notes: Vec::new(),
            finding,
            other: crate::job::Other::default(),
        };
        Ok(Entry { file: frame.file, seen: Ok(seen) })
    };
    let entries = file.frames.into_iter().map(entry).collect::<Result<_>>()?;
    Ok(Given {
        board: file.board,
        square: file.square,
        inspected: Inspected { entries, read_ms: 0.0, detect_ms: 0.0 },
    })
}
