//! From the paths that the user gave to the list of picture files.
//!
//! In order of the paths, those of a folder in natural order (`2` before `10`):
//!
//! * A file that is named is listed whatever it is: reading it says what is wrong with it.
//! * Of a folder, all pictures and videos are listed by content or by extension, also those of kinds that cannot be read, so that
//!   they are named; other files are passed over, and so is everything whose name begins with a dot and what is no file at
//!   all, as a pipe or a device: reading it may wait for ever.
//! * Sub-folders are entered only where a folder holds no file beside them.
//! * A file is listed once.

#[cfg(not(target_arch = "wasm32"))]
mod native;
#[cfg(target_arch = "wasm32")]
mod web;

use std::path::{Path, PathBuf};

use super::{Content, sniff::sniff};
use crate::calib::Result;
#[cfg(not(target_arch = "wasm32"))]
pub use native::{bytes, exists, is_folder, list};
#[cfg(target_arch = "wasm32")]
pub use web::{bytes, exists, file, hash_of, is_folder, list, offer, text, written};

/// Bytes of a file that are looked at to see what it is.
const HEAD: u64 = 4096;

/// What lies in a folder.
struct Entry {
    name: String,
    path: PathBuf,
    is_folder: bool,
}

/// Files in a folder, or in the folders below one that holds no file, in natural order.
fn walk(path: &Path, entries: &impl Fn(&Path) -> Result<Vec<Entry>>) -> Result<Vec<PathBuf>> {
    deeper(path, entries, 0)
}

fn deeper(path: &Path, entries: &impl Fn(&Path) -> Result<Vec<Entry>>, depth: usize) -> Result<Vec<PathBuf>> {
    // Links may lead in circles.
    const DEEPEST: usize = 16;
    let mut all: Vec<Entry> = entries(path)?.into_iter().filter(|e| !e.name.starts_with('.')).collect();
    all.sort_by(|a, b| natord::compare_ignore_case(&a.name, &b.name).then_with(|| a.name.cmp(&b.name)));
    let (folders, files): (Vec<Entry>, Vec<Entry>) = all.into_iter().partition(|e| e.is_folder);
    if !files.is_empty() || depth >= DEEPEST {
        return Ok(files.into_iter().map(|e| e.path).collect());
    }
    let mut found = Vec::new();
    for folder in folders {
        found.extend(deeper(&folder.path, entries, depth + 1)?);
    }
    Ok(found)
}

/// Whether the first bytes of a file are those of a picture or video.
fn begins_like_a_picture(head: &[u8]) -> bool {
    matches!(sniff(head), Content::Picture(_) | Content::Foreign(_))
}
