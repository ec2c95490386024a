//! One photograph with the lens taken out, as a file of the same kind.

use std::path::Path;

use super::photo::{self, Colours};
use crate::calib::{
    Error, Result,
    undistort::{Interpolation, Straightener},
};

/// A photograph straightened: format, depth and metadata are kept. Answers the bytes of the file and what reading it told.
///
/// # Errors
/// Those of [`photo::read`]; [`Error::Picture`] where it is not of the size of the camera, or cannot be written.
pub fn developed(
    path: &Path,
    straight: &Straightener,
    interpolation: Interpolation,
) -> Result<(Vec<u8>, Vec<String>)> {
    let name = path.display().to_string();
    let original = photo::bytes(path)?;
    let picture = photo::decode(&name, &original, Colours::Keep)?;
    let [w, h] = straight.map.source_size();
    if [picture.photo.width, picture.photo.height] != [w, h] {
        return Err(Error::Picture {
            file: name,
            message: format!(
                "it has {} x {} px, the camera is for {w} x {h}: where the photograph was resized or cropped, convert the camera with `straightedge convert --scale` or `--crop`",
                picture.photo.width, picture.photo.height
            ),
        });
    }
    let photo = straight.run(&picture.photo, interpolation)?;
    Ok((photo::write::like(&name, &original, &photo)?, picture.notes))
}
