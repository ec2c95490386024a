//! The files that `calibrate` writes: each by itself, so that one that fails does not cost the others.

use std::path::Path;

use crate::job::store;
use crate::{
    calib::{
        Error, Result,
        format::{self, Destination, Evidence, Export},
        html,
        number::within_px,
        report::Report,
    },
    cli::say,
};

/// Writes a camera file; answers what to say about it.
pub(super) fn camera(report: &Report, destination: &Destination) -> Result<String> {
    let solution = report
        .solution
        .as_ref()
        .ok_or_else(|| Error::Invalid("there is no calibration to write".to_owned()))?;
    let export = Export { camera: &solution.camera, evidence: &Evidence::from(report), report: Some(report) };
    let written = format::write(destination.format, &export)?;
    store::write(Path::new(&destination.path), written.text.as_bytes())?;
    let mut said = format!(
        "wrote {} ({}; read back, it projects {})",
        destination.path,
        destination.format.title,
        within_px(written.self_check_px)
    );
    for note in written.notes {
        said += &format!("\n  {note}");
    }
    Ok(said)
}

/// Writes the page of the evidence.
pub(super) fn page(report: &Report, path: &Path) -> Result<String> {
    store::write(path, html::page(report).as_bytes())?;
    Ok(format!("wrote {} (the evidence as one page)", path.display()))
}

/// Says what was done or why not; whether it was done.
pub(super) fn told(done: Result<String>) -> bool {
    self::done(done.map(|text| say(&text)))
}

/// Whether it was done; says why not.
pub(super) fn done(done: Result<()>) -> bool {
    match done {
        Ok(()) => true,
        Err(error) => {
            say(&format!("error: {error}"));
            false
        }
    }
}
