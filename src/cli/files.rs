//! Files that commands read and write beside pictures.

use std::{
    fs,
    io::{self, Read as _},
    path::{Path, PathBuf},
};

use crate::{
    calib::{
        Error, Result,
        format::{self, CameraFile},
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

/// Writes a file as a whole or not at all: into a new file beside it, which then takes its name and its permissions. A link goes
/// on leading where it led, and what is no file (`/dev/null`, a pipe) is written to, never replaced.
///
/// # Errors
/// [`Error::Output`] with the reason.
pub(super) fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    let wrong = |e: io::Error| {
        let folder = path.parent().filter(|p| !p.as_os_str().is_empty() && !p.is_dir());
        let why = match (e.kind(), folder) {
            (_, Some(folder)) => format!("the folder {} does not exist: make it first", folder.display()),
            _ => not_written(&e),
        };
        output(path, &why)
    };
    if path.is_dir() {
        return Err(output(path, "this is a folder: add a file name"));
    }
    let before = path.metadata().ok();
    if before.as_ref().map_or(path.is_symlink(), |b| !b.is_file()) {
        return fs::write(path, bytes).map_err(wrong);
    }
    let target = path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
    let beside = beside(&target);
    let written = fs::write(&beside, bytes)
        .and_then(|()| before.map_or(Ok(()), |b| fs::set_permissions(&beside, b.permissions())))
        .and_then(|()| fs::rename(&beside, &target));
    written.map_err(|e| {
        let _ = fs::remove_file(&beside);
        wrong(e)
    })
}

/// Why a result could not be written, and what to do.
pub(super) fn not_written(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::PermissionDenied => "it may not be written: choose another folder".to_owned(),
        io::ErrorKind::StorageFull => "the disk is full: make room".to_owned(),
        _ => format!("it cannot be written ({error})"),
    }
}

/// Makes a folder for results, and those above it, where they are missing.
///
/// # Errors
/// [`Error::Output`] with the reason.
pub(super) fn folder(path: &Path) -> Result<()> {
    if path.is_file() {
        return Err(output(path, "this is a file, a folder was expected: choose another name"));
    }
    fs::create_dir_all(path)
        .map_err(|e| output(path, &format!("this folder cannot be made ({e}): choose another")))
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

/// A hidden name in the same folder, which no other process uses.
fn beside(path: &Path) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!(".{name}.{}.part", std::process::id()))
}

fn error(path: &Path, message: &str) -> Error {
    Error::File { path: path.display().to_string(), message: message.to_owned() }
}

fn output(path: &Path, message: &str) -> Error {
    Error::Output { path: path.display().to_string(), message: message.to_owned() }
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use std::os::unix::fs::{FileTypeExt as _, symlink};

    #[test]
    fn links_stay_links_and_devices_stay_devices() {
        let folder = tempfile::tempdir().unwrap();
        let [file, link, device] = ["camera.yaml", "link.yaml", "null"].map(|name| folder.path().join(name));
        fs::write(&file, "old").unwrap();
        symlink(&file, &link).unwrap();
        symlink("/dev/null", &device).unwrap();
        for path in [&link, &device] {
            write(path, b"new").unwrap();
            assert!(path.is_symlink(), "{}", path.display());
        }
        assert_eq!(fs::read(&file).unwrap(), b"new");
        assert!(device.metadata().unwrap().file_type().is_char_device());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 3);
    }
}
