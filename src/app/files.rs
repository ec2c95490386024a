//! Files in and out: dialogs, dropped files, pasted paths. What was chosen comes back as an [`Action`].

use std::{
    path::{Path, PathBuf},
    sync::mpsc,
};

use super::{
    action::{Action, Command},
    export::Content,
    session::Session,
    state::Notice,
};
use crate::{
    calib::Result,
    job::{Source, photo, store},
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
            .add_filter(
                "Pictures",
                &["png", "jpg", "jpeg", "tif", "tiff", "bmp", "webp", "pgm", "ppm", "pnm"],
            )
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
    pub fn save(&self, name: &str, content: Content) {
        let task = rfd::AsyncFileDialog::new().set_title("Save").set_file_name(name).save_file();
        self.spawn(move || {
            let file = pollster::block_on(task)?;
            let written = content.make().and_then(|bytes| store::write(file.path(), &bytes));
            Some(told(written.map(|()| format!("Saved {}", file.path().display()))))
        });
    }

    /// Asks for a place and writes a session, with a copy in the folder of the application.
    pub fn save_session(
        &self,
        session: Session,
        copy_of: impl Fn(&Path) -> Option<PathBuf> + Send + 'static,
    ) {
        let name = format!("calibration.{}", super::session::EXTENSION);
        let task = rfd::AsyncFileDialog::new().set_title("Save the session").set_file_name(name).save_file();
        self.spawn(move || {
            let file = pollster::block_on(task)?;
            let text = session.to_json();
            let written = store::write(file.path(), text.as_bytes());
            // The copy is for the day on which the file is damaged; without it only that help is missing.
            if let (Ok(()), Some(copy)) = (&written, copy_of(file.path())) {
                let _ = store::write(&copy, text.as_bytes());
            }
            Some(told(written.map(|()| format!("Saved {}", file.path().display()))))
        });
    }

    /// Opens a session; pictures that moved are looked for beside it.
    pub fn open_session(&self, path: PathBuf, copy: Option<PathBuf>) {
        self.spawn(move || {
            let name = path.display().to_string();
            let text = photo::bytes(&path).map(|b| String::from_utf8_lossy(&b).into_owned());
            match text.and_then(|t| Session::from_json(&t, &name)) {
                Ok(mut session) => {
                    session.locate(path.parent().unwrap_or(Path::new(".")));
                    Some(Action::Restore(Box::new(session)))
                }
                Err(error) => {
                    let copy = copy.filter(|c| c.is_file());
                    let offer =
                        copy.map(|c| ("Open the last good copy".to_owned(), Command::OpenPaths(vec![c])));
                    Some(Action::Tell(Notice { offer, ..Notice::bad(error.to_string()) }))
                }
            }
        });
    }

    /// Asks where the pictures of a session are, and looks for them by their hash.
    pub fn locate(&self, mut session: Session) {
        let task = rfd::AsyncFileDialog::new().set_title("Where are the pictures?").pick_folder();
        self.spawn(move || {
            let folder = pollster::block_on(task)?;
            session.locate(folder.path());
            Some(Action::Restore(Box::new(session)))
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
    Action::Tell(Notice::bad(text))
}

/// Says how something ended.
fn told(result: Result<String>) -> Action {
    match result {
        Ok(text) => Action::Tell(Notice::good(text)),
        Err(error) => tell_bad(error.to_string()),
    }
}

/// Paths in a pasted text: one a line, with or without quotes or `file://`.
pub fn pasted_paths(text: &str) -> Vec<PathBuf> {
    let clean = |line: &str| {
        let line = line.trim().trim_matches(['"', '\'']);
        line.strip_prefix("file://").unwrap_or(line).replace("%20", " ")
    };
    text.lines().map(clean).filter(|l| !l.is_empty()).map(PathBuf::from).filter(|p| p.exists()).collect()
}
