//! Results on disk: whole or not at all.

use std::{
    fs, io,
    path::{Path, PathBuf},
    time::UNIX_EPOCH,
};

use crate::calib::{Error, Result};

/// When a file was written, days since 1970; `None` where the system does not tell.
pub fn written(path: &Path) -> Option<f64> {
    let since = fs::metadata(path).ok()?.modified().ok()?.duration_since(UNIX_EPOCH).ok()?;
    Some(since.as_secs_f64() / 86_400.0)
}

/// Writes a file as a whole or not at all: into a new file beside it, which then takes its name and its permissions. A link goes
/// on leading where it led, and what is no file (`/dev/null`, a pipe) is written to, never replaced.
///
/// # Errors
/// [`Error::Output`] with the reason.
pub fn write(path: &Path, bytes: &[u8]) -> Result<()> {
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

/// Writes a file as [`write()`], with the folders above it.
///
/// # Errors
/// Those of [`folder`] and [`write()`].
pub fn file(path: &Path, bytes: &[u8]) -> Result<()> {
    path.parent().map_or(Ok(()), folder)?;
    write(path, bytes)
}

/// Why a result could not be written, and what to do.
pub fn not_written(error: &io::Error) -> String {
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
pub fn folder(path: &Path) -> Result<()> {
    if path.is_file() {
        return Err(output(path, "this is a file, a folder was expected: choose another name"));
    }
    fs::create_dir_all(path)
        .map_err(|e| output(path, &format!("this folder cannot be made ({e}): choose another")))
}

/// A hidden name in the same folder, which no other process uses.
fn beside(path: &Path) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!(".{name}.{}.part", std::process::id()))
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
