//! Files of a browser: the page may read what the user gave to it, and nothing else.
//!
//! A path is a name here: that of the file, below that of the folder in which it was given. The page knows all files; a worker
//! knows the one that came with its request. Only a worker can wait for the bytes of a file.

use std::{
    cell::RefCell,
    collections::{BTreeMap, BTreeSet},
    hash::Hasher as _,
    path::{Path, PathBuf},
};

use siphasher::sip128::{Hasher128 as _, SipHasher13};
use wasm_bindgen::{JsCast as _, JsValue};
use wasm_bindgen_futures::JsFuture;
use web_sys::{Blob, File, FileReaderSync};

use super::{Entry, HEAD, begins_like_a_picture, walk};
use crate::{
    calib::{Error, Result, order},
    job::photo::sniff::{Content, named_like_a_picture, sniff_named},
};

/// Most bytes of a file that is read: decoded beside its own bytes it must fit into the memory of a worker.
const MOST_BYTES: f64 = 400e6;
/// Bytes that are hashed at a time: the page goes on in between.
const PIECE: f64 = 4e6;

thread_local! {
    static FILES: RefCell<BTreeMap<PathBuf, File>> = const { RefCell::new(BTreeMap::new()) };
}

/// Makes a file known under a path.
pub fn offer(path: PathBuf, file: File) {
    FILES.with_borrow_mut(|files| files.insert(path, file));
}

/// The file at a path.
pub fn file(path: &Path) -> Option<File> {
    FILES.with_borrow(|files| files.get(path).cloned())
}

/// When the file at a path was written, days since 1970.
pub fn written(path: &Path) -> Option<f64> {
    file(path).map(|file| file.last_modified() / 86_400_000.0)
}

/// Whether a file is known at a path, or in a folder with this path.
pub fn exists(path: &Path) -> bool {
    file(path).is_some() || is_folder(path)
}

/// Whether files are known in a folder with this path.
pub fn is_folder(path: &Path) -> bool {
    FILES.with_borrow(|files| {
        files.range(path.to_path_buf()..).take_while(|(p, _)| p.starts_with(path)).any(|(p, _)| p != path)
    })
}

/// Picture files behind `paths`, by the rules of this module.
///
/// # Errors
/// [`Error::File`] where a path is not known.
pub async fn list(paths: &[PathBuf]) -> Result<Vec<PathBuf>> {
    let mut seen = BTreeSet::new();
    let mut files = Vec::new();
    for path in paths {
        let found = if is_folder(path) { walk(path, &entries)? } else { vec![path.clone()] };
        for found in found {
            let named = found == *path || named_like_a_picture(&found);
            if (named || begins_like_a_picture(&head(&found).await?)) && seen.insert(found.clone()) {
                files.push(found);
            }
        }
    }
    Ok(files)
}

fn entries(folder: &Path) -> Result<Vec<Entry>> {
    let entry = |path: &Path| {
        let mut below = path.strip_prefix(folder).ok()?.components();
        let first = below.next()?;
        let name = first.as_os_str().to_string_lossy().into_owned();
        Some((name, (folder.join(first), below.next().is_some())))
    };
    let names = FILES.with_borrow(|files| order::map(files.keys().filter_map(|p| entry(p))));
    Ok(names.into_iter().map(|(name, (path, is_folder))| Entry { name, path, is_folder }).collect())
}

/// The first bytes of a file, for the page.
async fn head(path: &Path) -> Result<Vec<u8>> {
    let file = known(path)?;
    piece(&file, 0.0, HEAD as f64).await.map_err(|_| gone(path))
}

async fn piece(blob: &Blob, from: f64, to: f64) -> std::result::Result<Vec<u8>, JsValue> {
    let buffer = JsFuture::from(blob.slice_with_f64_and_f64(from, to)?.array_buffer()).await?;
    Ok(js_sys::Uint8Array::new(&buffer).to_vec())
}

/// The hash of a file's bytes ([`crate::job::photo::hash_bytes`]), for the page.
///
/// # Errors
/// [`Error::File`] where it cannot be read.
pub async fn hash_of(path: &Path) -> Result<u128> {
    let file = known(path)?;
    let mut hasher = SipHasher13::new();
    let mut from = 0.0;
    while from < file.size() {
        hasher.write(&piece(&file, from, from + PIECE).await.map_err(|_| gone(path))?);
        from += PIECE;
    }
    Ok(hasher.finish128().as_u128())
}

/// The text of a file, for the page.
///
/// # Errors
/// [`Error::File`] where it is not known, cannot be read or is too large.
pub async fn text(path: &Path) -> Result<String> {
    let file = known(path)?;
    if file.size() > MOST_BYTES {
        return Err(wrong(path, "it is too large for a text"));
    }
    let bytes = piece(&file, 0.0, file.size()).await.map_err(|_| gone(path))?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

/// The whole file, for a worker.
///
/// # Errors
/// [`Error::File`] where it is not known or cannot be read, [`Error::Picture`] where it is too large.
pub fn bytes(path: &Path) -> Result<Vec<u8>> {
    let file = known(path)?;
    let size = file.size();
    if size > MOST_BYTES {
        let name = path.display().to_string();
        let head = file.slice_with_f64_and_f64(0.0, HEAD as f64).map_err(|_| gone(path))?;
        let message = match sniff_named(&name, &read(&head).map_err(|_| gone(path))?) {
            Content::Foreign(what) => what,
            _ => format!(
                "{:.0} MB are more than a browser tab opens ({:.0} MB): give a smaller copy, or use the desktop program",
                size / 1e6,
                MOST_BYTES / 1e6
            ),
        };
        return Err(Error::Picture { file: name, message });
    }
    read(&file).map_err(|_| gone(path))
}

fn read(blob: &Blob) -> std::result::Result<Vec<u8>, JsValue> {
    let buffer = FileReaderSync::new()?.read_as_array_buffer(blob)?;
    Ok(js_sys::Uint8Array::new(buffer.unchecked_ref()).to_vec())
}

fn known(path: &Path) -> Result<File> {
    file(path)
        .ok_or_else(|| wrong(path, "the page does not have this picture any more: drop its folder again"))
}

fn gone(path: &Path) -> Error {
    wrong(path, "the browser can no longer read it, it was moved or changed: drop it again")
}

fn wrong(path: &Path, message: &str) -> Error {
    Error::File { path: path.display().to_string(), message: message.to_owned() }
}
