//! Files that commands read and write beside pictures.

use std::{
    fs,
    io::{self, Read as _},
    path::{Path, PathBuf},
    sync::Arc,
};

use super::say;
use crate::{
    calib::{
        Error, Result,
        format::{self, CameraFile},
        lens::Lens,
    },
    job::{
        assemble::Entry,
        photo::{Content, sniff_named},
    },
};

/// Bytes of a file that are looked at to see what it is.
const HEAD: u64 = 65536;

/// Reads a camera file of any format.
///
/// # Errors
/// [`Error::File`] where it cannot be read, else those of [`format::read_bytes`].
pub(super) fn camera(path: &Path) -> Result<CameraFile> {
    format::read_bytes(&bytes(path)?, &path.display().to_string())
}

/// Reads what takes the distortion out of pictures: a camera file of any format, with its residual map, or a splined camera of mrcal; and
/// the part of the picture that its corners support, where the file tells.
/// Says what reading told.
///
/// # Errors
/// Those of [`camera`].
pub(super) fn lens(path: &Path) -> Result<(Arc<dyn Lens>, Option<Vec<[f64; 2]>>)> {
    let bytes = bytes(path)?;
    let name = path.display().to_string();
    if let Ok(text) = std::str::from_utf8(&bytes)
        && format::is_splined(text)
    {
        let splined = format::read_splined(text).map_err(|e| error(path, &e.to_string()))?;
        return Ok((Arc::new(splined), None));
    }
    let file = format::read_bytes(&bytes, &name)?;
    for note in &file.notes {
        say(&format!("note: {note}"));
    }
    let lens = file.lens();
    Ok((lens, file.evidence.safe))
}

/// Reads a text file.
///
/// # Errors
/// [`Error::File`] where it cannot be read or is no text.
pub(super) fn text(path: &Path) -> Result<String> {
    String::from_utf8(bytes(path)?).map_err(|_| error(path, "this is not a text file: check the path"))
}

/// Reads a whole file.
///
/// # Errors
/// [`Error::File`] with the reason.
pub(super) fn bytes(path: &Path) -> Result<Vec<u8>> {
    if path.is_dir() {
        return Err(error(path, "this is a folder, a file was expected"));
    }
    fs::read(path).map_err(|e| {
        error(
            path,
            &match e.kind() {
                io::ErrorKind::NotFound => "no such file: check the path".to_owned(),
                io::ErrorKind::PermissionDenied => "it may not be read: check its permissions".to_owned(),
                _ => format!("it cannot be read ({e})"),
            },
        )
    })
}

/// Whether both paths lead to one file that exists.
pub(super) fn same(a: &Path, b: &Path) -> bool {
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}

/// Refuses to write where a photograph lies, or an input: asked before any work.
///
/// # Errors
/// [`Error::Invalid`] with the reason.
pub(super) fn may_write<'a>(path: &Path, inputs: impl IntoIterator<Item = &'a Path>) -> Result<()> {
    let refuse = |what: &str| {
        Err(Error::Invalid(format!("{}: this is {what}: give another name to the result", path.display())))
    };
    // A pipe or a device is not looked into: that would wait for what it gives.
    if !path.is_file() {
        return Ok(());
    }
    if inputs.into_iter().any(|input| same(input, path)) {
        return refuse("the file to read");
    }
    let mut head = Vec::new();
    let read = fs::File::open(path).and_then(|f| f.take(HEAD).read_to_end(&mut head));
    match sniff_named(&path.to_string_lossy(), &head) {
        Content::Picture(_) | Content::Foreign(_) if read.is_ok() => refuse("a photograph"),
        _ => Ok(()),
    }
}

/// What to say where the paths hold no picture.
pub(super) fn no_pictures(paths: &[PathBuf]) -> Error {
    let names: Vec<String> = paths.iter().map(|p| p.display().to_string()).collect();
    Error::Picture {
        file: names.join(", "),
        message: "no pictures were found: give JPEG, PNG, TIFF, BMP, WebP or PNM files, or a folder of them"
            .to_owned(),
    }
}

/// Why there is no board where there are not even pictures.
pub(super) fn none_found(entries: &[Entry], paths: &[PathBuf]) -> Option<Error> {
    (entries.is_empty() && !paths.is_empty()).then(|| Error::NoBoard(no_pictures(paths).to_string()))
}

fn error(path: &Path, message: &str) -> Error {
    Error::File { path: path.display().to_string(), message: message.to_owned() }
}
