//! Files in and out: dialogs, dropped files, pasted paths. What was chosen comes back as an [`Action`].

use std::{
    path::{Path, PathBuf},
    sync::{Arc, mpsc},
};

use super::{
    action::{Action, Command},
    state::Notice,
};
use crate::{
    calib::{Error, Result},
    job::{Source, photo},
};

/// Where dialogs answer.
pub struct Inbox {
    sender: mpsc::Sender<Action>,
    receiver: mpsc::Receiver<Action>,
    ctx: egui::Context,
}

impl Inbox {
    /// Wakes this window when something was chosen.
    pub fn new(ctx: &egui::Context) -> Self {
        let (sender, receiver) = mpsc::channel();
        Self { sender, receiver, ctx: ctx.clone() }
    }

    /// What was chosen since the last call.
    pub fn drain(&self) -> Vec<Action> {
        self.receiver.try_iter().collect()
    }

    /// Runs work that ends in an action beside the window.
    pub fn spawn(&self, work: impl FnOnce() -> Option<Action> + Send + 'static) {
        let (sender, ctx) = (self.sender.clone(), self.ctx.clone());
        let work = move || {
            if let Some(action) = work() {
                let _ = sender.send(action);
                ctx.request_repaint();
            }
        };
        // Where the system refuses a thread there is no dialog; the next click tries again.
        drop(std::thread::Builder::new().name("files".to_owned()).spawn(work));
    }

    /// Asks for a folder.
    pub fn pick_folder(&self) {
        let task = rfd::AsyncFileDialog::new().set_title("Open a folder of board pictures").pick_folder();
        self.spawn(move || {
            let folder = pollster::block_on(task)?;
            Some(Action::Do(Command::OpenPaths(vec![folder.path().to_owned()])))
        });
    }

    /// Asks for pictures.
    pub fn pick_pictures(&self) {
        let task = rfd::AsyncFileDialog::new()
            .set_title("Open board pictures")
            .add_filter("Pictures", &["png", "jpg", "jpeg", "tif", "tiff", "bmp", "webp", "pgm", "ppm", "pnm"])
            .pick_files();
        self.spawn(move || {
            let files = pollster::block_on(task)?;
            Some(Action::Do(Command::OpenPaths(files.iter().map(|f| f.path().to_owned()).collect())))
        });
    }

    /// Asks for a session file.
    pub fn pick_session(&self) {
        let task = rfd::AsyncFileDialog::new()
            .set_title("Open a session")
            .add_filter("Straightedge session", &[super::session::EXTENSION])
            .pick_file();
        self.spawn(move || {
            let file = pollster::block_on(task)?;
            Some(Action::Do(Command::OpenPaths(vec![file.path().to_owned()])))
        });
    }

    /// Asks for a folder, then does something with it.
    pub fn pick_target(&self, work: impl FnOnce(&Path) -> Result<String> + Send + 'static) {
        let task = rfd::AsyncFileDialog::new().set_title("Choose a folder to write to").pick_folder();
        self.spawn(move || {
            let folder = pollster::block_on(task)?;
            Some(told(work(folder.path())))
        });
    }

    /// Asks for a place and writes.
    pub fn save(&self, name: &str, bytes: Arc<Vec<u8>>) {
        let task = rfd::AsyncFileDialog::new().set_title("Save").set_file_name(name).save_file();
        self.spawn(move || {
            let file = pollster::block_on(task)?;
            Some(told(write(file.path(), &bytes).map(|()| format!("Saved {}", file.path().display()))))
        });
    }

    /// The pictures behind paths, listed beside the window: a network folder may be slow.
    pub fn list(&self, paths: Vec<PathBuf>, replace: bool) {
        self.spawn(move || {
            Some(match photo::list(&paths) {
                Ok(files) if files.is_empty() => tell_bad(format!(
                    "No pictures in {}: open a folder with JPEG, PNG, TIFF, BMP, WebP or PNM files",
                    paths.iter().map(|p| p.display().to_string()).collect::<Vec<_>>().join(", ")
                )),
                Ok(files) => {
                    let sources = files.into_iter().map(Source::File).collect();
                    if replace { Action::Open(sources) } else { Action::Add(sources) }
                }
                Err(error) => tell_bad(error.to_string()),
            })
        });
    }
}

/// Says what went wrong.
pub fn tell_bad(text: String) -> Action {
    Action::Tell(Notice { text, bad: true })
}

/// Says how something ended.
fn told(result: Result<String>) -> Action {
    match result {
        Ok(text) => Action::Tell(Notice { text, bad: false }),
        Err(error) => tell_bad(error.to_string()),
    }
}

/// Writes a file so that at every moment either the old one or the new one is there.
///
/// # Errors
/// [`Error::Output`] with the path and the reason.
pub fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    use std::io::Write as _;
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let part = path.with_file_name(format!(".{name}.{}.part", std::process::id()));
    let written = (|| {
        let mut file = std::fs::File::create(&part)?;
        file.write_all(bytes)?;
        file.sync_all()?;
        std::fs::rename(&part, path)
    })();
    written.map_err(|e| {
        let _ = std::fs::remove_file(&part);
        Error::Output { path: path.display().to_string(), message: format!("cannot be written: {e}") }
    })
}

/// Paths in a pasted text: one a line, with or without quotes or `file://`.
pub fn pasted_paths(text: &str) -> Vec<PathBuf> {
    let clean = |line: &str| {
        let line = line.trim().trim_matches(['"', '\'']);
        line.strip_prefix("file://").unwrap_or(line).replace("%20", " ")
    };
    text.lines().map(clean).filter(|l| !l.is_empty()).map(PathBuf::from).filter(|p| p.exists()).collect()
}
