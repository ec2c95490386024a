//! A folder of the system: the autosave, good copies of sessions, recent folders.

use std::{
    path::{Path, PathBuf},
    sync::mpsc,
    thread,
    time::{Duration, Instant},
};

use siphasher::sip::SipHasher13;
use std::hash::{Hash as _, Hasher as _};

use crate::{
    app::{
        action::Action,
        files::Post,
        session::{EXTENSION, Session},
        state::{Notice, State},
    },
    job::store,
};

/// Most recent folders that are kept.
const RECENT: usize = 8;
/// Between two autosaves.
const PAUSE: Duration = Duration::from_millis(500);

/// Where the application named `id` keeps things on this machine.
pub fn place(id: &str) -> Option<PathBuf> {
    eframe::storage_dir(id)
}

/// The folder of the application. Without one nothing is kept.
pub struct Home {
    folder: Option<PathBuf>,
    /// Sessions to write, in a thread of its own: a slow disk never holds up the window.
    writer: Option<Writer>,
    saved: Option<(u64, Instant)>,
    /// Folders that were opened, the last first.
    pub recent: Vec<PathBuf>,
}

/// The thread that writes, and the way to it.
struct Writer {
    sessions: mpsc::Sender<Box<Session>>,
    thread: Option<thread::JoinHandle<()>>,
}

impl Home {
    /// Uses a folder, made where it is missing.
    pub fn new(folder: Option<PathBuf>) -> Self {
        let folder = folder.filter(|f| std::fs::create_dir_all(f).is_ok());
        let recent = folder.as_ref().and_then(|f| std::fs::read_to_string(f.join("recent.json")).ok());
        let recent = recent.and_then(|text| serde_json::from_str(&text).ok()).unwrap_or_default();
        Self { folder, writer: None, saved: None, recent }
    }

    fn autosave(&self) -> Option<PathBuf> {
        Some(self.folder.as_ref()?.join(format!("autosave.{EXTENSION}")))
    }

    /// Opens what an earlier run left when it ended without closing.
    pub fn bring_back(&self, post: &Post) {
        let text = self.autosave().and_then(|path| std::fs::read_to_string(path).ok());
        let session = text.and_then(|text| Session::from_json(&text, "autosave").ok());
        if let Some(session) = session.filter(|s| !s.document.frames.is_empty()) {
            post.put(Action::Restore(Box::new(session)));
            let text = "The last run ended without being closed: this is where it was";
            post.put(Action::Tell(Notice::good(text)));
        }
    }

    /// Saves where something has changed and the last time is not just now. Answers when to ask again.
    pub fn keep(&mut self, state: &State, _: &Post) -> Option<Duration> {
        let (path, revision) = (self.autosave()?, state.content());
        if let Some((saved, at)) = self.saved {
            if saved == revision {
                return None;
            }
            if at.elapsed() < PAUSE {
                return Some(PAUSE.saturating_sub(at.elapsed()));
            }
        }
        self.saved = Some((revision, Instant::now()));
        let writer = self.writer.get_or_insert_with(|| {
            let (sessions, inbox) = mpsc::channel::<Box<Session>>();
            let work = move || {
                while let Ok(mut session) = inbox.recv() {
                    // Only the last of several that wait counts.
                    while let Ok(newer) = inbox.try_recv() {
                        session = newer;
                    }
                    let _ = store::write(&path, session.to_json().as_bytes());
                }
            };
            Writer { sessions, thread: thread::Builder::new().name("autosave".to_owned()).spawn(work).ok() }
        });
        let _ = writer.sessions.send(Box::new(Session::of(state)));
        None
    }

    /// The window is closed in an orderly way: nothing is left behind.
    pub fn close(&mut self) {
        // What is being written would come after.
        if let Some(Writer { sessions, thread: Some(thread) }) = self.writer.take() {
            drop(sessions);
            let _ = thread.join();
        }
        if let Some(path) = self.autosave() {
            let _ = std::fs::remove_file(path);
        }
    }

    /// Remembers folders that were opened.
    pub fn opened(&mut self, paths: &[PathBuf]) {
        for path in paths {
            let folder = if path.is_dir() { path.clone() } else { path.parent().unwrap_or(path).to_owned() };
            let folder = folder.canonicalize().unwrap_or(folder);
            self.recent.retain(|r| *r != folder);
            self.recent.insert(0, folder);
        }
        self.recent.truncate(RECENT);
        if let (Some(home), Ok(text)) = (&self.folder, serde_json::to_string(&self.recent)) {
            let _ = store::write(&home.join("recent.json"), text.as_bytes());
        }
    }

    /// The last good copy of a session file.
    pub fn copy_of(&self, session: &Path) -> Option<PathBuf> {
        self.copies().of(session)
    }

    /// Where copies of sessions are kept.
    pub fn copies(&self) -> Copies {
        Copies(self.folder.clone())
    }
}

/// Where the last good copy of each session file is kept.
pub struct Copies(Option<PathBuf>);

impl Copies {
    /// The copy of a session file.
    pub fn of(&self, session: &Path) -> Option<PathBuf> {
        let mut hash = SipHasher13::new();
        session.canonicalize().unwrap_or_else(|_| session.to_owned()).hash(&mut hash);
        Some(self.0.as_ref()?.join(format!("copy-{:016x}.{EXTENSION}", hash.finish())))
    }
}
