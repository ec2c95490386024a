//! Files of the disk, through the dialogs of the system.

use std::{
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

use super::{Inbox, PICTURES, camera, camera_extensions, opened, tell_bad, told};
use crate::{
    app::{
        action::{Action, Command},
        export::Content,
        home::Copies,
        session::{EXTENSION, Session},
        state::Notice,
    },
    calib::{Result, number::counted},
    job::{photo, store},
    worker::straighten::{self, Task},
};

/// Nobody cancels a dialog faster than this: it was never there.
const CANCELLED: Duration = Duration::from_millis(200);

impl Inbox {
    /// Runs work that ends in an action beside the window.
    pub fn spawn(&self, work: impl FnOnce() -> Option<Action> + Send + 'static) {
        let post = self.post.clone();
        let work = move || {
            if let Some(action) = work() {
                post.put(action);
            }
        };
        // Where the system refuses a thread there is no dialog; the next click tries again.
        drop(std::thread::Builder::new().name("files".to_owned()).spawn(work));
    }

    /// Waits for what is chosen in a dialog, and goes on with it.
    fn ask<T>(
        &self,
        dialog: impl Future<Output = Option<T>> + Send + 'static,
        work: impl FnOnce(T) -> Option<Action> + Send + 'static,
    ) {
        self.spawn(move || {
            let begun = Instant::now();
            match pollster::block_on(dialog) {
                Some(chosen) => work(chosen),
                None if begun.elapsed() < CANCELLED => Some(tell_bad(
                    "This desktop opens no file dialog: install xdg-desktop-portal or zenity. Folders can also be dropped on the window, and paths pasted"
                        .to_owned(),
                )),
                None => None,
            }
        });
    }

    /// Asks for a folder.
    pub fn pick_folder(&self) {
        let task = rfd::AsyncFileDialog::new().set_title("Open a folder of board pictures").pick_folder();
        self.ask(task, move |folder| Some(Action::Do(Command::OpenPaths(vec![folder.path().to_owned()]))));
    }

    /// Asks for pictures.
    pub fn pick_pictures(&self) {
        let task = rfd::AsyncFileDialog::new()
            .set_title("Open board pictures")
            .add_filter("Pictures", &PICTURES)
            .pick_files();
        self.ask(task, move |files| {
            Some(Action::Do(Command::OpenPaths(files.iter().map(|f| f.path().to_owned()).collect())))
        });
    }

    /// Asks for a session file.
    pub fn pick_session(&self) {
        let task = rfd::AsyncFileDialog::new()
            .set_title("Open a session")
            .add_filter("Straightedge session", &[EXTENSION])
            .pick_file();
        self.ask(task, move |file| Some(Action::Do(Command::OpenPaths(vec![file.path().to_owned()]))));
    }

    /// Asks for camera files.
    pub fn pick_cameras(&self) {
        let task = rfd::AsyncFileDialog::new()
            .set_title("Open earlier calibrations to compare with")
            .add_filter("Camera files", &camera_extensions())
            .pick_files();
        let post = self.post.clone();
        self.ask(task, move |files| {
            files.iter().for_each(|file| post.put(read(file.path())));
            None
        });
    }

    /// Opens a camera file to compare with.
    pub fn open_camera(&self, path: PathBuf) {
        self.spawn(move || Some(read(&path)));
    }

    /// Asks for a folder, then does something with it.
    fn pick_target(&self, work: impl FnOnce(&Path) -> Action + Send + 'static) {
        let task = rfd::AsyncFileDialog::new().set_title("Choose a folder to write to").pick_folder();
        self.ask(task, move |folder| Some(work(folder.path())));
    }

    /// Asks for the folder of straightened pictures.
    pub fn straighten_into(&self) {
        self.pick_target(|folder| Action::Do(Command::StraightenInto(folder.to_owned())));
    }

    /// Asks for a folder and writes files into it.
    pub fn save_all(&self, files: Vec<(String, Content)>) {
        self.pick_target(move |folder| {
            let write =
                |(name, content): &(String, Content)| store::write(&folder.join(name), &content.make()?);
            let written: Result<()> = files.iter().try_for_each(write);
            told(
                written.map(|()| format!("{} saved into {}", counted(files.len(), "file"), folder.display())),
            )
        });
    }

    /// Asks for a place and writes.
    pub fn save(&self, name: &str, content: Content) {
        let task = rfd::AsyncFileDialog::new().set_title("Save").set_file_name(name).save_file();
        self.ask(task, move |file| {
            let written = content.make().and_then(|bytes| store::write(file.path(), &bytes));
            Some(told(written.map(|()| format!("Saved {}", file.path().display()))))
        });
    }

    /// Asks for a place and writes a session, with a copy in the folder of the application.
    pub fn save_session(&self, session: Session, copies: Copies) {
        let name = format!("calibration.{EXTENSION}");
        let task = rfd::AsyncFileDialog::new().set_title("Save the session").set_file_name(name).save_file();
        self.ask(task, move |file| {
            let text = session.to_json();
            let written = store::write(file.path(), text.as_bytes());
            // The copy is for the day on which the file is damaged; without it only that help is missing.
            if let (Ok(()), Some(copy)) = (&written, copies.of(file.path())) {
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
        self.ask(task, move |folder| {
            session.locate(folder.path());
            Some(Action::Restore(Box::new(session)))
        });
    }

    /// The pictures behind paths, listed beside the window: a network folder may be slow. Where pictures of the session that is
    /// open are missing, these may be they.
    pub fn list(&self, paths: Vec<PathBuf>, replace: bool, open: Option<Session>) {
        self.spawn(move || {
            if let Some(mut session) = open {
                let lost = session.missing();
                paths.iter().filter(|p| p.is_dir()).for_each(|folder| session.locate(folder));
                if session.missing() < lost {
                    return Some(Action::Restore(Box::new(session)));
                }
            }
            Some(opened(&paths, photo::list(&paths), replace))
        });
    }
}

/// A camera file to compare with.
fn read(path: &Path) -> Action {
    let text = photo::bytes(path).map(|b| String::from_utf8_lossy(&b).into_owned());
    camera(path, text, store::written(path))
}

/// Where straightened pictures go: a folder, written to by the jobs themselves.
pub struct Place {
    folder: PathBuf,
    tasks: Vec<Task>,
}

impl Place {
    /// A folder for these pictures.
    ///
    /// # Errors
    /// Those of [`straighten::tasks`].
    pub fn new(folder: &Path, pictures: &[PathBuf]) -> Result<Self> {
        Ok(Self { folder: folder.to_owned(), tasks: straighten::tasks(pictures, folder)? })
    }

    /// Where the job of a picture writes.
    pub fn to(&self, path: &Path) -> Option<PathBuf> {
        self.tasks.iter().find(|t| t.from == path).map(|t| t.to.clone())
    }

    /// Nothing is left to do.
    ///
    /// # Errors
    /// None.
    pub fn put(&mut self, _: &Path, _: &[u8]) -> Result<()> {
        Ok(())
    }

    /// What to tell at the end.
    ///
    /// # Errors
    /// None.
    pub fn close(&mut self, words: &str) -> Result<String> {
        Ok(format!("{words} into {}", self.folder.display()))
    }
}
