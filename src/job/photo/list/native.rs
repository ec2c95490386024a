//! Files of the disk.

use std::{
    collections::BTreeSet,
    fs,
    io::{self, Read},
    path::{Path, PathBuf},
};

use super::{Entry, HEAD, begins_like_a_picture, walk};
use crate::{
    calib::{Error, Result},
    job::photo::sniff::named_like_a_picture,
};

/// Picture files behind `paths`, by the rules of this module.
///
/// # Errors
/// [`Error::File`] where a path does not exist or a folder cannot be read.
pub fn list(paths: &[PathBuf]) -> Result<Vec<PathBuf>> {
    let mut seen = BTreeSet::new();
    let mut files = Vec::new();
    for path in paths {
        let about = fs::metadata(path).map_err(|e| error(path, &e))?;
        let found = if about.is_dir() {
            walk(path, &entries)?.into_iter().filter(|f| is_wanted(f)).collect()
        } else {
            vec![path.clone()]
        };
        files.extend(found.into_iter().filter(|f| seen.insert(f.components().as_path().to_path_buf())));
    }
    Ok(files)
}

fn entries(path: &Path) -> Result<Vec<Entry>> {
    let mut all = Vec::new();
    for entry in fs::read_dir(path).map_err(|e| error(path, &e))? {
        let entry = entry.map_err(|e| error(path, &e))?;
        let name = entry.file_name().to_string_lossy().into_owned();
        let path = entry.path();
        let is_folder = path.is_dir();
        if is_folder || fs::metadata(&path).map_or(true, |about| about.is_file()) {
            all.push(Entry { name, path, is_folder });
        }
    }
    Ok(all)
}

fn is_wanted(path: &Path) -> bool {
    if named_like_a_picture(path) {
        return true;
    }
    let mut head = Vec::new();
    let read = fs::File::open(path).and_then(|f| f.take(HEAD).read_to_end(&mut head));
    read.is_ok() && begins_like_a_picture(&head)
}

/// Whether something lies at a path.
pub fn exists(path: &Path) -> bool {
    path.exists()
}

/// Whether a path is that of a folder.
pub fn is_folder(path: &Path) -> bool {
    path.is_dir()
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
