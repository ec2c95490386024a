//! Files in and out: dialogs, dropped files, pasted paths. What was chosen comes back as an [`Action`].

#[cfg(not(target_arch = "wasm32"))]
mod native;
#[cfg(target_arch = "wasm32")]
mod web;

#[cfg(not(target_arch = "wasm32"))]
pub use native::Place;
#[cfg(target_arch = "wasm32")]
pub use web::Place;

use std::{
    path::{Path, PathBuf},
    sync::mpsc,
};

use super::{action::Action, screen::Beside, state::Notice};
use crate::{
    calib::{Result, format::FORMATS},
    job::{Source, photo},
};

/// Extensions that are offered first where pictures are asked for.
const PICTURES: [&str; 10] = ["png", "jpg", "jpeg", "tif", "tiff", "bmp", "webp", "pgm", "ppm", "pnm"];

/// Where dialogs answer.
pub struct Inbox {
    receiver: mpsc::Receiver<Action>,
    /// For what happens outside of the window.
    pub post: Post,
}

/// Takes actions to the window, from anywhere.
#[derive(Clone)]
pub struct Post {
    sender: mpsc::Sender<Action>,
    ctx: egui::Context,
}

impl Post {
    /// Something happened: the window wakes up and hears it.
    pub fn put(&self, action: Action) {
        let _ = self.sender.send(action);
        self.ctx.request_repaint();
    }
}

impl Inbox {
    /// Wakes this window when something was chosen.
    pub fn new(ctx: &egui::Context) -> Self {
        let (sender, receiver) = mpsc::channel();
        Self { receiver, post: Post { sender, ctx: ctx.clone() } }
    }

    /// What was chosen since the last call.
    pub fn drain(&self) -> Vec<Action> {
        self.receiver.try_iter().collect()
    }
}

/// Says what went wrong.
pub fn tell_bad(text: String) -> Action {
    Action::Tell(Notice::bad(text))
}

/// What opening paths comes to, once the pictures behind them are known.
fn opened(paths: &[PathBuf], files: Result<Vec<PathBuf>>, replace: bool) -> Action {
    match files {
        Ok(files) if files.is_empty() => tell_bad(format!(
            "No pictures in {}: open a folder with JPEG, PNG, TIFF, BMP, WebP or PNM files",
            paths.iter().map(|p| p.display().to_string()).collect::<Vec<_>>().join(", ")
        )),
        Ok(files) => {
            let sources = files.into_iter().map(Source::File).collect();
            if replace { Action::Open(sources) } else { Action::Add(sources) }
        }
        Err(error) => tell_bad(error.to_string()),
    }
}

/// Extensions of camera files.
fn camera_extensions() -> Vec<&'static str> {
    FORMATS.iter().flat_map(|f| f.usual).copied().collect()
}

/// Whether the name of a file is that of a camera file to compare with.
pub fn is_camera(path: &Path) -> bool {
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    extension.is_some_and(|e| camera_extensions().contains(&e.as_str()))
}

/// Says that camera files were opened before pictures.
pub fn without_pictures(paths: &[PathBuf]) -> Action {
    let name = |path: &PathBuf| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    tell_bad(format!(
        "{}: a calibration is compared with pictures; open pictures of the board first, then drop its file once more",
        paths.iter().map(name).collect::<Vec<_>>().join(", ")
    ))
}

/// What opening a camera file comes to; `written` is when the file itself was, days since 1970.
fn camera(path: &Path, text: Result<String>, written: Option<f64>) -> Action {
    match text.and_then(|text| Beside::read(path, text, written)) {
        Ok(beside) => Action::Beside(Box::new(beside)),
        Err(error) => tell_bad(error.to_string()),
    }
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
    text.lines()
        .map(clean)
        .filter(|l| !l.is_empty())
        .map(PathBuf::from)
        .filter(|p| photo::exists(p))
        .collect()
}
