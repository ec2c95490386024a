//! A lane as a web worker.
//!
//! All workers share the compiled module of the page. A worker cannot be asked to stop while it computes, so it is ended and another one takes
//! its place; the same where it crashed, and where its memory has grown: that of WebAssembly never shrinks.

use std::{
    cell::RefCell,
    path::Path,
    rc::{Rc, Weak},
    sync::mpsc::Sender,
};

use js_sys::{Array, Object, Reflect, Uint8Array};
use wasm_bindgen::{JsCast as _, JsValue, closure::Closure, prelude::wasm_bindgen};
use web_sys::{ErrorEvent, MessageEvent, Worker, WorkerOptions, WorkerType};

use super::{
    pool::{Message, Wake},
    wire,
};
use crate::{
    calib::{Error, Result},
    job::{Key, Progress, Reply, Request, photo},
};

/// What a worker runs first.
const BOOT: &str = "worker_boot.js";
/// Memory of a worker above which another one takes its place, bytes.
const GROWN: f64 = 160e6;
/// More workers than this cost memory and gain little.
const MOST: usize = 6;

#[wasm_bindgen(module = "/web/page.js")]
extern "C" {
    /// The address of the JavaScript around the program.
    fn program_js() -> String;
}

/// Workers for this machine: one processor is left to the page.
pub fn threads(asked: Option<u16>) -> usize {
    let all = || web_sys::window().map_or(1, |w| w.navigator().hardware_concurrency() as usize);
    asked.map_or_else(|| all().saturating_sub(1).min(MOST), usize::from).max(1)
}

/// A worker that does one job at a time, and its successors.
pub(super) struct Lane(Rc<RefCell<Inner>>);

struct Inner {
    me: Weak<RefCell<Self>>,
    index: usize,
    messages: Sender<Message>,
    wake: Wake,
    worker: Option<Running>,
    /// What runs or waits for the worker to be ready.
    job: Option<Key>,
    waiting: Option<Request>,
}

struct Running {
    worker: Worker,
    ready: bool,
    // Alive as long as the worker may call them.
    _heard: Closure<dyn FnMut(MessageEvent)>,
    _failed: Closure<dyn FnMut(ErrorEvent)>,
}

impl Drop for Running {
    fn drop(&mut self) {
        self.worker.set_onmessage(None);
        self.worker.set_onerror(None);
        self.worker.terminate();
    }
}

impl Lane {
    /// `wake` is called after each message.
    pub(super) fn spawn(index: usize, messages: Sender<Message>, wake: Wake) -> Self {
        let inner = Rc::new_cyclic(|me| {
            let me = me.clone();
            RefCell::new(Inner { me, index, messages, wake, worker: None, job: None, waiting: None })
        });
        inner.borrow_mut().start();
        Self(inner)
    }

    /// Hands over a job; only to a lane that is free.
    pub(super) fn send(&mut self, request: Request) {
        let mut inner = self.0.borrow_mut();
        inner.job = Some(request.key);
        inner.waiting = Some(request);
        match &inner.worker {
            // Its last start has failed: this may have been the network.
            None => inner.start(),
            Some(running) if running.ready => inner.hand_over(),
            Some(_) => {}
        }
    }

    /// Ends the running job.
    pub(super) fn stop(&self) {
        let mut inner = self.0.borrow_mut();
        if inner.job.is_some() {
            let waits = inner.waiting.take().is_some();
            if !waits {
                inner.start();
            }
            inner.end(None);
        }
    }
}

impl Inner {
    /// A new worker in the place of the one that is there.
    fn start(&mut self) {
        self.worker = None;
        let started = self.started();
        match started {
            Ok(running) => self.worker = Some(running),
            Err(error) => self.failed(&text(&error)),
        }
    }

    fn started(&self) -> std::result::Result<Running, JsValue> {
        let options = WorkerOptions::new();
        options.set_type(WorkerType::Module);
        let worker = Worker::new_with_options(BOOT, &options)?;
        let me = self.me.clone();
        let heard = Closure::<dyn FnMut(MessageEvent)>::new(move |event: MessageEvent| {
            if let Some(inner) = me.upgrade() {
                inner.borrow_mut().heard(&event.data());
            }
        });
        let me = self.me.clone();
        let failed = Closure::<dyn FnMut(ErrorEvent)>::new(move |event: ErrorEvent| {
            // It is told in its picture, not in the console.
            event.prevent_default();
            if let Some(inner) = me.upgrade() {
                inner.borrow_mut().failed(&event.message());
            }
        });
        worker.set_onmessage(Some(heard.as_ref().unchecked_ref()));
        worker.set_onerror(Some(failed.as_ref().unchecked_ref()));
        let program = Object::new();
        Reflect::set(&program, &"module".into(), &wasm_bindgen::module())?;
        Reflect::set(&program, &"js".into(), &program_js().into())?;
        worker.post_message(&program)?;
        Ok(Running { worker, ready: false, _heard: heard, _failed: failed })
    }

    fn heard(&mut self, message: &JsValue) {
        let get = |name: &str| Reflect::get(message, &name.into()).ok().filter(|v| !v.is_undefined());
        if get("ready").is_some() {
            if let Some(running) = &mut self.worker {
                running.ready = true;
            }
            self.hand_over();
        } else if let (Some(share), Some(key)) = (get("progress").and_then(|v| v.as_f64()), self.job) {
            let _ = self.messages.send(Message::Progress(key, Progress(share as f32)));
            (self.wake)();
        } else if let Some(why) = get("crashed") {
            self.failed(&text(&why));
        } else if let (Some(bytes), Some(key)) = (get("reply"), self.job) {
            let bytes: Uint8Array = bytes.unchecked_into();
            let reply: Result<Option<Reply>> = wire::from_bytes(&bytes.to_vec());
            if get("memory").and_then(|v| v.as_f64()).is_some_and(|bytes| bytes > GROWN) {
                self.start();
            }
            self.end(reply.unwrap_or_else(|error| Some(Reply { key, result: Err(error) })));
        }
    }

    /// Sends what waits to the worker, which is ready.
    fn hand_over(&mut self) {
        let (Some(running), Some(request)) = (&self.worker, self.waiting.take()) else { return };
        let sent = {
            let path = request.job.file().map(Path::to_path_buf);
            wire::to_bytes(request).map(|bytes| (bytes, path)).map_err(|e| e.to_string())
        };
        let sent = sent.and_then(|(bytes, path)| {
            let message = Object::new();
            let bytes = Uint8Array::from(&bytes[..]);
            let set = |name: &str, value: &JsValue| Reflect::set(&message, &name.into(), value).map(drop);
            set("request", &bytes).map_err(|e| text(&e))?;
            if let Some(path) = path
                && let Some(file) = photo::file(&path)
            {
                set("path", &path.display().to_string().into()).map_err(|e| text(&e))?;
                set("file", &file).map_err(|e| text(&e))?;
            }
            let transfer = Array::of1(&bytes.buffer());
            running.worker.post_message_with_transfer(&message, &transfer).map_err(|e| text(&e))
        });
        if let Err(why) = sent {
            self.crashed(&why);
        }
    }

    /// The worker is lost: its job has an error, and another worker takes its place, unless it was lost before it was ready.
    fn failed(&mut self, why: &str) {
        if self.worker.take().is_some_and(|w| w.ready) {
            self.start();
        }
        self.crashed(why);
    }

    fn crashed(&mut self, why: &str) {
        self.waiting = None;
        if let Some(key) = self.job {
            self.end(Some(Reply { key, result: Err(Error::Crashed(why.to_owned())) }));
        }
    }

    fn end(&mut self, reply: Option<Reply>) {
        if let Some(key) = self.job.take() {
            let _ = self.messages.send(Message::Ended { lane: self.index, key, reply });
            (self.wake)();
        }
    }
}

/// An error of the browser in words.
fn text(error: &JsValue) -> String {
    let message = || Reflect::get(error, &"message".into()).ok()?.as_string();
    error.as_string().or_else(message).unwrap_or_else(|| "unknown error".to_owned())
}
