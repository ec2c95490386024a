//! The inside of a browser's worker: waits for requests, runs them, answers.
//!
//! The page sends `{ request, path?, file? }` with the bytes of a [`Request`](crate::job::Request) and the picture that it reads.
//! The worker says `{ ready }` once, then `{ progress }`, and at the end `{ reply, memory }` with the bytes of the reply and how
//! large its memory has grown. Nothing is ever asked to stop: the page ends the worker and starts another one.

use std::ops::ControlFlow;

use js_sys::{Array, Object, Reflect, Uint8Array};
use wasm_bindgen::{JsCast as _, JsValue, closure::Closure};
use web_sys::{DedicatedWorkerGlobalScope, File, MessageEvent};

use super::wire;
use crate::job::{self, Progress, Request, photo};

/// The worker that this is, unless it is the page.
pub fn scope() -> Option<DedicatedWorkerGlobalScope> {
    js_sys::global().dyn_into().ok()
}

/// Serves from now on.
pub fn serve(scope: &DedicatedWorkerGlobalScope) {
    std::panic::set_hook(Box::new(|panic| {
        // The instance ends here; the page hears why, and goes on with another one.
        post(&[("crashed", panic.to_string().into())], &Array::new());
    }));
    let answer = Closure::<dyn FnMut(MessageEvent)>::new(|event: MessageEvent| {
        wasm_bindgen_futures::spawn_local(async move {
            if let Err(error) = work(&event.data()).await {
                post(&[("crashed", error.into())], &Array::new());
            }
        });
    });
    scope.set_onmessage(Some(answer.as_ref().unchecked_ref()));
    answer.forget();
    post(&[("ready", true.into())], &Array::new());
}

async fn work(message: &JsValue) -> Result<(), String> {
    let get = |name: &str| Reflect::get(message, &name.into()).unwrap_or(JsValue::UNDEFINED);
    let bytes: Uint8Array = get("request").unchecked_into();
    let request: Request = wire::from_bytes(&bytes.to_vec()).map_err(|e| e.to_string())?;
    if let (Some(path), Ok(file)) = (get("path").as_string(), get("file").dyn_into::<File>()) {
        photo::decode_ahead(&file).await;
        photo::offer(path.into(), file);
    }
    let mut told = -1.0;
    let reply = job::run(request, &mut |Progress(share)| {
        // A hundred messages are enough for a bar.
        if share - told >= 0.01 {
            told = share;
            post(&[("progress", share.into())], &Array::new());
        }
        ControlFlow::Continue(())
    });
    let bytes = Uint8Array::from(&wire::to_bytes(reply).map_err(|e| e.to_string())?[..]);
    post(&[("reply", bytes.clone().into()), ("memory", memory_bytes().into())], &Array::of1(&bytes.buffer()));
    Ok(())
}

fn memory_bytes() -> f64 {
    let memory: js_sys::WebAssembly::Memory = wasm_bindgen::memory().unchecked_into();
    memory.buffer().unchecked_into::<js_sys::ArrayBuffer>().byte_length().into()
}

fn post(pairs: &[(&str, JsValue)], transfer: &Array) {
    let message = Object::new();
    for (name, value) in pairs {
        let _ = Reflect::set(&message, &(*name).into(), value);
    }
    let Some(scope) = scope() else { return };
    let _ = scope.post_message_with_transfer(&message, transfer);
}
