//! From the paths that the user gave to the list of picture files.

use std::{
    collections::BTreeSet,
    fs, io,
    io::Read,
    path::{Path, PathBuf},
};

use super::{
    Content,
    sniff::{named_like_a_picture, sniff},
};
use crate::calib::{Error, Result};

/// Bytes of a file that are looked at to see what it is.
const HEAD: u64 = 4096;

/// Picture files behind `paths`, in the order of the paths, those of a folder in natural order (`2` before `10`).
///
/// * A file that is named is listed whatever it is: reading it says what is wrong with it.
/// * Of a folder, all pictures and videos are listed by content or by extension, also those of kinds that cannot be
///   read, so that they are named; other files are passed over, and so is everything whose name begins with a dot and what is
///   no file at all, as a pipe or a device: reading it may wait for ever.
/// * Sub-folders are entered only where a folder holds no file beside them.
/// * A file is listed once.
///
/// # Errors
/// [`Error::File`] where a path does not exist or a folder cannot be read.
pub fn list(paths: &[PathBuf]) -> Result<Vec<PathBuf>> {
    let mut seen = BTreeSet::new();
    let mut files = Vec::new();
    for path in paths {
        let about = fs::metadata(path).map_err(|e| error(path, &e))?;
        let found = if about.is_dir() { folder(path, 0)? } else { vec![path.clone()] };
        files.extend(found.into_iter().filter(|f| seen.insert(f.components().as_path().to_path_buf())));
    }
    Ok(files)
}

fn folder(path: &Path, depth: usize) -> Result<Vec<PathBuf>> {
    // Links may lead in circles.
    const DEEPEST: usize = 16;
    let mut files = Vec::new();
    let mut folders = Vec::new();
    for entry in fs::read_dir(path).map_err(|e| error(path, &e))? {
        let entry = entry.map_err(|e| error(path, &e))?;
        let name = entry.file_name().to_string_lossy().into_owned();
        if name.starts_with('.') {
            continue;
        }
        let path = entry.path();
        if path.is_dir() {
            folders.push((name, path));
        } else if fs::metadata(&path).map_or(true, |about| about.is_file()) {
            files.push((name, path));
        }
    }
    if files.is_empty() && depth < DEEPEST {
        let mut found = Vec::new();
        for sub in natural(folders) {
            found.extend(folder(&sub, depth + 1)?);
        }
        return Ok(found);
    }
    Ok(natural(files).into_iter().filter(|f| is_wanted(f)).collect())
}

fn natural(mut named: Vec<(String, PathBuf)>) -> Vec<PathBuf> {
    named.sort_by(|(a, _), (b, _)| natord::compare_ignore_case(a, b).then_with(|| a.cmp(b)));
    named.into_iter().map(|(_, path)| path).collect()
}

fn is_wanted(path: &Path) -> bool {
    if named_like_a_picture(path) {
        return true;
    }
    let mut head = Vec::new();
    let read = fs::File::open(path).and_then(|f| f.take(HEAD).read_to_end(&mut head));
    read.is_ok() && matches!(sniff(&head), Content::Picture(_) | Content::Foreign(_))
}

/// The whole file.
///
/// # Errors
/// [`Error::File`] where it cannot be read or is no file: a pipe or a device would be waited for.
pub fn bytes(path: &Path) -> Result<Vec<u8>> {
    let about = fs::metadata(path).map_err(|e| error(path, &e))?;
    if !about.is_file() && !about.is_dir() {
        return Err(Error::File {
            path: path.display().to_string(),
            message: "this is no file but a pipe or a device: save the picture to a file and give that"
                .to_owned(),
        });
    }
    fs::read(path).map_err(|e| error(path, &e))
}

fn error(path: &Path, error: &io::Error) -> Error {
    Error::File { path: path.display().to_string(), message: reason(error) }
}

/// An operating system's error in words that help.
fn reason(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::NotFound => "no such file or folder: check the path".to_owned(),
        io::ErrorKind::PermissionDenied => "it may not be read: check its permissions".to_owned(),
        io::ErrorKind::IsADirectory => "this is a folder, a file was expected".to_owned(),
        _ => format!("it cannot be read ({error})"),
    }
}
