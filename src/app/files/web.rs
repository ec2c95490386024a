//! Files of a browser: what the user picks or drops on the page, and downloads.

use std::{
    io,
    path::{Path, PathBuf},
};

use js_sys::{Array, Reflect, Uint8Array};
use wasm_bindgen::{JsCast as _, JsValue, closure::Closure, prelude::wasm_bindgen};
use wasm_bindgen_futures::spawn_local;
use zip::{
    CompressionMethod, ZipWriter,
    result::ZipError,
    write::{SimpleFileOptions, StreamWriter},
};

use super::{Inbox, PICTURES, camera, camera_extensions, opened, tell_bad, told};
use crate::{
    app::{
        action::{Action, Command},
        export::Content,
        home::Copies,
        session::{EXTENSION, Session},
    },
    calib::{Error, Result},
    job::photo,
};

#[wasm_bindgen(module = "/web/files.js")]
extern "C" {
    fn watch(dropped: &JsValue, failed: &JsValue);
    #[wasm_bindgen(catch)]
    async fn pick(folder: bool, accept: &str) -> std::result::Result<JsValue, JsValue>;
    #[wasm_bindgen(js_name = save)]
    fn download(name: &str, parts: &Array, kind: &str);
}

impl Inbox {
    /// Hears what is dropped on the page, folders too.
    pub fn watch(&self) {
        let (post, tell) = (self.post.clone(), self.post.clone());
        let dropped = Closure::<dyn Fn(JsValue)>::new(move |files: JsValue| {
            let paths = offer(&files);
            if !paths.is_empty() {
                post.put(Action::Do(Command::OpenPaths(paths)));
            }
        });
        let failed = Closure::<dyn Fn(String)>::new(move |why: String| {
            tell.put(tell_bad(format!("What was dropped cannot be read ({why}): try Open folder…")));
        });
        watch(dropped.as_ref(), failed.as_ref());
        dropped.forget();
        failed.forget();
    }

    /// Runs work that ends in an action, in turns with the page.
    fn spawn(&self, work: impl Future<Output = Option<Action>> + 'static) {
        let post = self.post.clone();
        spawn_local(async move {
            if let Some(action) = work.await {
                post.put(action);
            }
        });
    }

    fn ask(&self, folder: bool, accept: String) {
        self.spawn(async move {
            let paths = offer(&pick(folder, &accept).await.ok()?);
            (!paths.is_empty()).then_some(Action::Do(Command::OpenPaths(paths)))
        });
    }

    /// Asks for a folder.
    pub fn pick_folder(&self) {
        self.ask(true, String::new());
    }

    /// Asks for pictures.
    pub fn pick_pictures(&self) {
        self.ask(false, PICTURES.map(|e| format!(".{e}")).join(","));
    }

    /// Asks for a session file.
    pub fn pick_session(&self) {
        self.ask(false, format!(".{EXTENSION}"));
    }

    /// Asks for camera files.
    pub fn pick_cameras(&self) {
        let accept = camera_extensions().iter().map(|e| format!(".{e}")).collect::<Vec<_>>().join(",");
        let post = self.post.clone();
        self.spawn(async move {
            for path in offer(&pick(false, &accept).await.ok()?) {
                post.put(read(path).await);
            }
            None
        });
    }

    /// Opens a camera file to compare with.
    pub fn open_camera(&self, path: PathBuf) {
        self.spawn(async move { Some(read(path).await) });
    }

    /// Downloads a file.
    pub fn save(&self, name: &str, content: Content) {
        let name = name.to_owned();
        self.spawn(async move {
            let made = content.make().await.map(|bytes| {
                download(&name, &Array::of1(&Uint8Array::from(&bytes[..])), "application/octet-stream");
                format!("{name} is in your downloads")
            });
            Some(told(made))
        });
    }

    /// Straightened pictures are downloaded.
    pub fn straighten_into(&self) {
        self.post.put(Action::Do(Command::StraightenInto(PathBuf::new())));
    }

    /// Downloads files as one archive.
    pub fn save_all(&self, files: Vec<(String, Content)>) {
        self.spawn(async move {
            let mut archive = Archive::new();
            for (name, content) in files {
                let added = match content.make().await {
                    Ok(bytes) => archive.add(&name, &bytes),
                    Err(error) => Err(error),
                };
                if let Err(error) = added {
                    return Some(tell_bad(error.to_string()));
                }
            }
            Some(told(archive.download("figures.zip")))
        });
    }

    /// Downloads a session.
    pub fn save_session(&self, session: Session, _: Copies) {
        self.save(&format!("calibration.{EXTENSION}"), Content::bytes(session.to_json().into_bytes()));
    }

    /// Opens a session; its pictures are asked for where the page does not have them.
    pub fn open_session(&self, path: PathBuf, _: Option<PathBuf>) {
        self.spawn(async move {
            let name = path.display().to_string();
            let text = photo::text(&path).await.and_then(|text| Session::from_json(&text, &name));
            Some(text.map_or_else(|e| tell_bad(e.to_string()), |s| Action::Restore(Box::new(s))))
        });
    }

    /// Asks where the pictures of a session are, and looks for them by their hash.
    pub fn locate(&self, session: Session) {
        self.spawn(async move {
            let paths = offer(&pick(true, "").await.ok()?);
            if paths.is_empty() {
                return None;
            }
            Some(located(session, &paths).await.unwrap_or_else(|e| tell_bad(e.to_string())))
        });
    }

    /// The pictures behind paths. Where pictures of the session that is open are missing, these may be they.
    pub fn list(&self, paths: Vec<PathBuf>, replace: bool, open: Option<Session>) {
        self.spawn(async move {
            if let Some(session) = open {
                let lost = session.missing();
                if let Ok(Action::Restore(found)) = located(session, &paths).await
                    && found.missing() < lost
                {
                    return Some(Action::Restore(found));
                }
            }
            let files = photo::list(&paths).await;
            Some(opened(&paths, files, replace))
        });
    }
}

/// A camera file to compare with.
async fn read(path: PathBuf) -> Action {
    let text = photo::text(&path).await;
    camera(&path, text, photo::written(&path))
}

/// The session with the pictures that are among those at `paths`.
async fn located(mut session: Session, paths: &[PathBuf]) -> Result<Action> {
    let mut files = Vec::new();
    for path in photo::list(paths).await? {
        files.push((photo::hash_of(&path).await?, path));
    }
    session.place(files);
    Ok(Action::Restore(Box::new(session)))
}

/// Makes files of the page known; answers the paths of what was given: files, and folders with what is in them.
fn offer(given: &JsValue) -> Vec<PathBuf> {
    let mut paths: Vec<PathBuf> = Vec::new();
    for entry in Array::from(given) {
        let get = |name: &str| Reflect::get(&entry, &name.into()).unwrap_or(JsValue::UNDEFINED);
        let (Some(path), Ok(file)) = (get("path").as_string(), get("file").dyn_into::<web_sys::File>())
        else {
            continue;
        };
        let path = PathBuf::from(path);
        if let Some(top) = path.components().next().map(|c| PathBuf::from(c.as_os_str()))
            && !paths.contains(&top)
        {
            paths.push(top);
        }
        photo::offer(path, file);
    }
    paths
}

/// A ZIP whose parts are handed to the browser as they are made, so that it may be larger than the memory of the page.
struct Archive(ZipWriter<StreamWriter<Parts>>);

/// Bytes that went to the browser.
#[derive(Default)]
struct Parts(Array);

impl io::Write for Parts {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.push(&Uint8Array::from(bytes));
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Archive {
    fn new() -> Self {
        Self(ZipWriter::new_stream(Parts::default()))
    }

    /// Adds a file.
    fn add(&mut self, name: &str, bytes: &[u8]) -> Result<()> {
        use io::Write as _;
        let wrong = |why: String| Error::Output { path: name.to_owned(), message: why };
        // Pictures are compressed already.
        let options = SimpleFileOptions::default().compression_method(CompressionMethod::Stored);
        self.0.start_file(name, options).map_err(|e| wrong(e.to_string()))?;
        self.0.write_all(bytes).map_err(|e| wrong(e.to_string()))
    }

    /// Ends it and downloads it; answers what to tell.
    fn download(self, name: &str) -> Result<String> {
        let wrong = |e: ZipError| Error::Output { path: name.to_owned(), message: e.to_string() };
        let parts = self.0.finish().map_err(wrong)?.into_inner();
        download(name, &parts.0, "application/zip");
        Ok(format!("{name} is in your downloads"))
    }
}

/// Where straightened pictures go: one archive, downloaded at the end.
pub struct Place(Option<Archive>);

impl Place {
    /// An archive; neither the folder nor the number of pictures matters.
    ///
    /// # Errors
    /// None.
    pub fn new(_: &Path, _: &[PathBuf]) -> Result<Self> {
        Ok(Self(Some(Archive::new())))
    }

    /// A worker cannot write.
    pub fn to(&self, _: &Path) -> Option<PathBuf> {
        None
    }

    /// Adds a picture.
    ///
    /// # Errors
    /// [`Error::Output`] where its name cannot be one.
    pub fn put(&mut self, path: &Path, bytes: &[u8]) -> Result<()> {
        self.0.as_mut().map_or(Ok(()), |archive| archive.add(&path.display().to_string(), bytes))
    }

    /// Downloads it; answers what to tell.
    ///
    /// # Errors
    /// [`Error::Output`] where it cannot be ended.
    pub fn close(&mut self, words: &str) -> Result<String> {
        let told = self.0.take().map_or(Ok(String::new()), |archive| archive.download("straightened.zip"))?;
        Ok(format!("{words}: {told}"))
    }
}
