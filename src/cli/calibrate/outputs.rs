//! The files that `calibrate` writes: each by itself, so that one that fails does not cost the others.

use std::{
    ops::ControlFlow,
    path::{Path, PathBuf},
};

use crate::{
    calib::{
        Error, Result,
        format::{self, Destination, Evidence, Export},
        html, npy,
        number::{significant, within_px},
        report::Report,
    },
    cli::say,
    job::{
        evidence::{self, Case, splined_camera},
        store,
    },
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

/// Reads the name of a NumPy file.
///
/// # Errors
/// [`Error::Invalid`] for another extension.
pub(super) fn npy(text: &str) -> Result<PathBuf> {
    named(text, "a NumPy array", "npy")
}

/// Reads the name of a file of mrcal.
///
/// # Errors
/// [`Error::Invalid`] for another extension.
pub(super) fn cameramodel(text: &str) -> Result<PathBuf> {
    named(text, "a camera of mrcal", "cameramodel")
}

fn named(text: &str, what: &str, extension: &str) -> Result<PathBuf> {
    let path = PathBuf::from(text);
    match path.extension() {
        Some(given) if given.eq_ignore_ascii_case(extension) => Ok(path),
        _ => {
            Err(Error::Invalid(format!("\"{text}\" is not a name for {what}: let it end with .{extension}")))
        }
    }
}

/// Fits a splined camera and writes it.
pub(super) fn splined(case: &Case, found: &evidence::Evidence, path: &Path) -> Result<String> {
    let (Some(calibration), Some(target)) = (&found.calibration, found.report.settings.target()) else {
        return Err(Error::Invalid("there is no calibration to start a splined camera from".to_owned()));
    };
    let (text, fitted) = splined_camera(calibration, &target)?;
    store::write(path, text.as_bytes())?;
    let model = calibration.camera.model;
    // Compared already where the model was chosen.
    let known = found.report.models.as_ref().and_then(|m| m.splined.clone()).filter(|s| s.base == model);
    let judged = match known {
        Some(judged) => judged,
        None => evidence::splined(case, model, &mut |_| ControlFlow::Continue(()))?,
    };
    let [columns, rows] = judged.knots;
    let mut said = format!(
        "wrote {} (splined, {columns} x {rows} control points: RMS {} px, {} as {}; the data hold {:.0} % of the picture)\n  {}",
        path.display(),
        significant(fitted.rms_px, 3),
        significant(calibration.rms_px, 3),
        model.spec().title,
        100.0 * fitted.camera.supported_fraction(),
        judged.words()
    );
    if !judged.against.is_empty() {
        said += ": do not rely on it";
    }
    Ok(said)
}

/// Writes the residual map as an array.
pub(super) fn residual_map(report: &Report, path: &Path) -> Result<String> {
    let solution = report.solution.as_ref();
    let Some((solution, map)) = solution.and_then(|s| Some((s, s.residual_map.as_ref()?))) else {
        let why = report.warnings.iter().find(|w| w.code == "no_residual_map");
        return Err(Error::Output {
            path: path.display().to_string(),
            message: why.map_or_else(|| "there is no residual map".to_owned(), |w| w.text.clone()),
        });
    };
    store::write(path, &npy::displacement(map.field.as_ref(), solution.camera.size_px))?;
    let what = if map.worth_having {
        "the residual map, float32"
    } else {
        "zero everywhere: no residual map is worth having"
    };
    Ok(format!("wrote {} ({what})", path.display()))
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
