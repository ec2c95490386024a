//! What `calibrate` reads beside pictures.

use std::path::Path;

use crate::{
    calib::{Result, camera::Camera, synth::Truth},
    cli::{files, say},
    job::evidence::Known,
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
