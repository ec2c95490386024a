//! The files that `calibrate` writes: each by itself, so that one that fails does not cost the others.

use std::path::Path;

use crate::job::store;
use crate::{
    calib::{
        Error, Result,
        format::{self, Destination, Evidence, Export, Frame},
        html,
        number::within_px,
        report::{FrameReport, Report},
    },
    cli::say,
};

/// Writes a camera file; answers what to say about it.
pub(super) fn camera(report: &Report, destination: &Destination) -> Result<String> {
    let solution = report
        .solution
        .as_ref()
        .ok_or_else(|| Error::Invalid("there is no calibration to write".to_owned()))?;
    let export = Export { camera: &solution.camera, evidence: &evidence(report), report: Some(report) };
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

/// What formats other than our own can hold beside the camera.
fn evidence(report: &Report) -> Evidence {
    let frame = |f: &FrameReport| Frame {
        file: f.file.clone(),
        camera_from_board: f.camera_from_board(),
        rms_px: f.rms_px,
        corners: f.corners.clone(),
    };
    let settings = &report.settings;
    let solution = report.solution.as_ref();
    Evidence {
        board: settings.board,
        square: Some(settings.square),
        unit: Some(settings.unit),
        rms_px: solution.map(|s| s.rms_px),
        sigma: solution.map(|s| s.sigma.iter().map(|(_, v)| *v).collect()).unwrap_or_default(),
        frames: report.included().map(frame).collect(),
        ..Evidence::default()
    }
}
