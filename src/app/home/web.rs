//! The browser's database: the session that was open when the page was left.
//!
//! One record for what was decided and the result, and one for each picture with what was seen in it and its thumbnail, written
//! once: keeping the session costs little, whatever the number of pictures.

use std::{
    cell::Cell,
    collections::BTreeMap,
    path::{Path, PathBuf},
    rc::Rc,
    sync::Arc,
    time::Duration,
};

use js_sys::{Array, Uint8Array};
use serde::{Deserialize, Serialize};
use wasm_bindgen::{JsValue, prelude::wasm_bindgen};
use wasm_bindgen_futures::spawn_local;
use web_time::Instant;

use crate::{
    app::{
        action::{Action, Command},
        files::Post,
        session::Session,
        state::{Notice, State},
    },
    calib::{observation::FrameId, order},
    job::{Inspection, Key, raster::Raster},
    worker::wire::{self, Bulk},
};

#[wasm_bindgen(module = "/web/store.js")]
extern "C" {
    #[wasm_bindgen(catch)]
    async fn take() -> std::result::Result<JsValue, JsValue>;
    #[wasm_bindgen(catch)]
    async fn all() -> std::result::Result<JsValue, JsValue>;
    #[wasm_bindgen(catch)]
    async fn write(records: &Array, dropped: &Array) -> std::result::Result<JsValue, JsValue>;
}

/// Between two times of keeping.
const PAUSE: Duration = Duration::from_secs(1);
/// The record of decisions and the result.
const SESSION: &str = "session";

/// What is kept of one picture.
#[derive(Serialize, Deserialize)]
struct Seen {
    inspection: Inspection,
    thumbnail: Option<Raster>,
}

impl Bulk for Seen {
    fn bulk(&mut self) -> Option<&mut Vec<u8>> {
        self.thumbnail.as_mut().map(|t| &mut t.data)
    }
}

/// Whether the database is used.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Use {
    /// It has not answered yet.
    Opening,
    Open,
    /// It is not there, it is full, or another tab has it.
    Never,
}

/// The browser's database. Without one nothing is kept.
pub struct Home {
    used: Rc<Cell<Use>>,
    /// The content that was kept last, and when.
    kept: Option<(u64, Instant)>,
    /// What the record of each picture was made from.
    written: BTreeMap<FrameId, Made>,
    /// A browser does not tell where folders are.
    pub recent: Vec<PathBuf>,
}

/// What a record is made from: the picture with its options, and whether there was a thumbnail.
type Made = (Option<Key>, bool);

/// The name of the database that belongs to the application `id`.
pub fn place(id: &str) -> Option<PathBuf> {
    Some(id.into())
}

/// Copies of session files, which only a disk has.
pub struct Copies;

impl Home {
    /// Keeps things where there is a `place`.
    pub fn new(place: Option<PathBuf>) -> Self {
        let used = Rc::new(Cell::new(if place.is_some() { Use::Opening } else { Use::Never }));
        Self { used, kept: None, written: BTreeMap::new(), recent: Vec::new() }
    }

    /// Opens what was open when the page was left.
    pub fn bring_back(&self, post: &Post) {
        if self.used.get() == Use::Never {
            return;
        }
        let (used, post) = (self.used.clone(), post.clone());
        spawn_local(async move {
            if take().await.is_ok_and(|mine| mine == JsValue::FALSE) {
                used.set(Use::Never);
                let text = "Straightedge is open in another tab: what you do in this one is not kept when you close it";
                return post.put(Action::Tell(Notice::bad(text)));
            }
            match all().await {
                Ok(records) => {
                    used.set(Use::Open);
                    if let Some(session) = session_in(&records) {
                        post.put(Action::Restore(Box::new(session)));
                    }
                }
                Err(_) => {
                    used.set(Use::Never);
                    let text = "This browser keeps nothing between visits, as in a private window: save the session before you close the tab";
                    post.put(Action::Tell(Notice::bad(text)));
                }
            }
        });
    }

    /// Keeps the session where something has changed and the last time is not just now. Answers when to ask again.
    pub fn keep(&mut self, state: &State, post: &Post) -> Option<Duration> {
        if self.used.get() != Use::Open {
            return None;
        }
        let content = state.content();
        if let Some((kept, at)) = self.kept {
            if kept == content {
                return None;
            }
            if at.elapsed() < PAUSE {
                return Some(PAUSE.saturating_sub(at.elapsed()));
            }
        }
        self.kept = Some((content, Instant::now()));
        let (records, dropped) = (Array::new(), Array::new());
        let record = |name: &str, bytes: &[u8]| Array::of2(&name.into(), &Uint8Array::from(bytes));
        let mut session = Session::of(state);
        let seen = std::mem::take(&mut session.seen);
        records.push(&record(SESSION, session.to_json().as_bytes()));
        let mut written = BTreeMap::new();
        for (id, inspection) in seen {
            let thumbnail = state.data.thumbnails.get(&id).cloned().flatten();
            let made = (state.data.made_from.get(&id).copied(), thumbnail.is_some());
            if self.written.get(&id) != Some(&made) {
                let Ok(bytes) =
                    wire::to_bytes(Seen { inspection, thumbnail: thumbnail.map(Arc::unwrap_or_clone) })
                else {
                    continue;
                };
                records.push(&record(&name(id), &bytes));
            }
            written.insert(id, made);
        }
        for id in self.written.keys().filter(|id| !written.contains_key(id)) {
            dropped.push(&name(*id).into());
        }
        self.written = written;
        let (used, post) = (self.used.clone(), post.clone());
        spawn_local(async move {
            if write(&records, &dropped).await.is_err() {
                used.set(Use::Never);
                let text = "The browser gives no more room: this session is no longer kept when you close the tab. Save it as a file";
                post.put(Action::Tell(Notice {
                    offer: Some(("Save the session".to_owned(), Command::SaveSession)),
                    ..Notice::bad(text.to_owned())
                }));
            }
        });
        None
    }

    /// A downloaded session has no copy.
    pub fn copies(&self) -> Copies {
        Copies
    }

    /// A downloaded session has no copy.
    pub fn copy_of(&self, _: &Path) -> Option<PathBuf> {
        None
    }

    /// Nothing: a browser does not tell where folders are.
    pub fn opened(&mut self, _: &[PathBuf]) {}
}

/// The name of a picture's record.
fn name(id: FrameId) -> String {
    format!("picture {}", id.0)
}

/// The session in the records of the database.
fn session_in(records: &JsValue) -> Option<Session> {
    let records = order::map(Array::from(records).iter().filter_map(|pair| {
        let pair = Array::from(&pair);
        Some((pair.get(0).as_string()?, Uint8Array::new(&pair.get(1)).to_vec()))
    }));
    let text = String::from_utf8(records.get(SESSION)?.clone()).ok()?;
    let mut session = Session::from_json(&text, SESSION).ok().filter(|s| !s.document.frames.is_empty())?;
    for frame in session.document.frames.iter() {
        let seen = records.get(&name(frame.id)).and_then(|bytes| wire::from_bytes::<Seen>(bytes).ok());
        if let Some(Seen { inspection, thumbnail }) = seen {
            session.seen.push((frame.id, inspection));
            session.thumbnails.extend(thumbnail.map(|t| (frame.id, Arc::new(t))));
        }
    }
    Some(session)
}
