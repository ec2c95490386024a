//! Sessions: one file with what the user decided, what was seen in the pictures, and the result.
//!
//! Pictures are not in it. They are named with the hash of their bytes, so that they are found again where they moved.

#[cfg(not(target_arch = "wasm32"))]
use std::path::Path;
use std::{collections::BTreeMap, path::PathBuf, sync::Arc};

use serde::{Deserialize, Serialize};

use super::state::{Document, Frame, State};
use crate::{
    calib::{Error, Result, json, observation::FrameId, order, report::Report},
    job::{Inspection, Source, photo, raster::Raster},
};

/// Of session files.
pub const EXTENSION: &str = "straightedge";
/// What every session starts with.
const FORMAT: &str = "straightedge session";
/// Raised when an older program could not read it.
const VERSION: u32 = 1;

/// What a session file holds.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Session {
    /// Always the same words.
    format: String,
    /// Of the layout of this file.
    version: u32,
    /// What the user decided.
    pub document: Document,
    /// What was seen in each picture that was read, without thumbnails.
    pub seen: Vec<(FrameId, Inspection)>,
    /// The result when it was saved, for other programs: it is computed again from the rest.
    pub result: Option<Report>,
    /// Small copies of pictures that may not be at hand. A session file has none.
    #[serde(skip)]
    pub thumbnails: Vec<(FrameId, Arc<Raster>)>,
}

impl Session {
    /// Of the present state.
    pub fn of(state: &State) -> Self {
        let fresh = state.inspected().into_iter().filter(|(.., fresh)| *fresh);
        let seen = fresh.filter_map(|(f, ..)| {
            let inspection = state.data.inspections.get(&f.id)?.as_ref().ok()?;
            Some((f.id, inspection.as_ref().clone()))
        });
        Self {
            format: FORMAT.to_owned(),
            version: VERSION,
            document: state.doc.clone(),
            seen: seen.collect(),
            result: state.data.answer.as_deref().map(|a| a.report().clone()),
            thumbnails: Vec::new(),
        }
    }

    /// The file's text.
    pub fn to_json(&self) -> String {
        // Fails only for keys that are not text, and there are none.
        serde_json::to_string(self).unwrap_or_default()
    }

    /// Reads a file's text; `file` is the name for messages.
    ///
    /// # Errors
    /// [`Error::Format`] with the place and the remedy.
    pub fn from_json(text: &str, file: &str) -> Result<Self> {
        let session: Self = json::read(text).map_err(|e| {
            Error::format(
                file,
                format!("this session is damaged or is no session ({e}): open its last good copy"),
            )
        })?;
        if session.format != FORMAT {
            return Err(Error::format(file, "this is no session of Straightedge"));
        }
        if session.version > VERSION {
            return Err(Error::format(
                file,
                "this session was saved by a newer Straightedge: update this one",
            ));
        }
        let ids: Vec<FrameId> = session.document.frames.iter().map(|f| f.id).collect();
        let ascending = ids.windows(2).all(|w| w[0] < w[1]);
        if !ascending || ids.iter().any(|id| id.0 >= session.document.next_id) {
            return Err(Error::format(
                file,
                "the numbers of its pictures contradict each other: open its last good copy",
            ));
        }
        Ok(session)
    }

    /// The document, and what was seen by picture.
    pub fn into_parts(self) -> (Document, BTreeMap<FrameId, Result<Arc<Inspection>>>) {
        (self.document, order::map(self.seen.into_iter().map(|(id, i)| (id, Ok(Arc::new(i))))))
    }

    /// Pictures that are not where they were.
    pub fn missing(&self) -> usize {
        self.document.frames.iter().filter(|f| is_missing(f)).count()
    }

    /// Finds pictures that moved: beside the session file by name, then anywhere in `folder` by the hash of their bytes.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn locate(&mut self, folder: &Path) {
        let hash_of = |path: &Path| photo::bytes(path).ok().map(|b| photo::hash_bytes(&b));
        let beside = |path: &Path| path.file_name().map(|n| folder.join(n)).filter(|p| p.is_file());
        let named = self.lost().into_iter().filter_map(|path| beside(&path));
        self.place(named.filter_map(|path| Some((hash_of(&path)?, path))).collect());
        if self.missing() > 0 {
            let files = photo::list(&[folder.to_owned()]).unwrap_or_default();
            self.place(files.into_iter().filter_map(|path| Some((hash_of(&path)?, path))).collect());
        }
    }

    /// Where pictures were that are not there any more.
    pub fn lost(&self) -> Vec<PathBuf> {
        let path = |f: &Frame| match &f.source {
            Source::File(path) => Some(path.clone()),
            Source::View { .. } => None,
        };
        self.document.frames.iter().filter(|f| is_missing(f)).filter_map(path).collect()
    }

    /// Puts files, by the hash of their bytes, in the place of those that are missing. Pictures that were never read have no hash:
    /// they go by their names.
    pub fn place(&mut self, files: Vec<(u128, PathBuf)>) {
        let hashes = order::map(self.seen.iter().map(|(id, i)| (*id, i.bytes_hash)));
        let named = |(_, path): &(u128, PathBuf)| Some((path.file_name()?.to_owned(), path.clone()));
        let names = order::map(files.iter().filter_map(named));
        let by_hash = order::map(files);
        let mut frames = self.document.frames.to_vec();
        for frame in frames.iter_mut().filter(|f| is_missing(f)) {
            let Source::File(path) = &frame.source else { continue };
            let found = match hashes.get(&frame.id) {
                Some(hash) => by_hash.get(hash),
                None => path.file_name().and_then(|name| names.get(name)),
            };
            if let Some(found) = found {
                frame.source = Source::File(found.clone());
            }
        }
        self.document.frames = Arc::new(frames);
    }
}

fn is_missing(frame: &Frame) -> bool {
    matches!(&frame.source, Source::File(path) if !photo::exists(path))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::action::{Action, demo};

    #[test]
    fn a_session_reads_back() {
        let mut state = State::default();
        state.apply(Action::Open(demo()));
        let text = Session::of(&state).to_json();
        let back = Session::from_json(&text, "a").unwrap();
        assert_eq!(back.document, state.doc);
    }

    #[test]
    fn damage_is_named() {
        let text = Session::of(&State::default()).to_json();
        for broken in [&text[..text.len() / 2], "", "{}", "[1]", "\u{0}"] {
            let error = Session::from_json(broken, "my.straightedge").unwrap_err().to_string();
            assert!(error.contains("my.straightedge"), "{error}");
        }
        let newer = text.replace("\"version\":1", "\"version\":2");
        assert!(Session::from_json(&newer, "a").unwrap_err().to_string().contains("newer"));
    }
}
