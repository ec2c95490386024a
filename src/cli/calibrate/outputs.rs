//! The files that `calibrate` writes: each by itself, so that one that fails does not cost the others.

use std::path::{Path, PathBuf};

use crate::job::store;
use crate::{
    calib::{
        Error, Result,
        format::{self, Destination, Evidence, Export},
        html, npy,
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

/// Reads the name of a NumPy file.
///
/// # Errors
/// [`Error::Invalid`] for another extension.
pub(super) fn npy(text: &str) -> Result<PathBuf> {
    let path = PathBuf::from(text);
    match path.extension() {
        Some(extension) if extension.eq_ignore_ascii_case("npy") => Ok(path),
        _ => Err(Error::Invalid(format!("\"{text}\" is not a name for a NumPy array: let it end with .npy"))),
    }
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
