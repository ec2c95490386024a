//! A lane as a thread.

use std::{
    ops::ControlFlow,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
        mpsc::{self, Sender},
    },
    thread::{self, JoinHandle},
};

use super::pool::{Message, Wake};
use crate::{
    calib::Error,
    job::{self, Reply, Request},
};

/// A thread that does one job at a time.
pub(super) struct Lane {
    index: usize,
    /// `None` once the lane is being closed.
    requests: Option<Sender<Request>>,
    messages: Sender<Message>,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Lane {
    /// `wake` is called after each message.
    pub(super) fn spawn(index: usize, messages: Sender<Message>, wake: Wake) -> Self {
        let (requests, inbox) = mpsc::channel::<Request>();
        let stop = Arc::new(AtomicBool::new(false));
        let (flag, out) = (stop.clone(), messages.clone());
        let work = move || {
            for request in inbox {
                let key = request.key;
                let mut report = |progress| {
                    let _ = out.send(Message::Progress(key, progress));
                    wake();
                    if flag.load(Ordering::Relaxed) {
                        ControlFlow::Break(())
                    } else {
                        ControlFlow::Continue(())
                    }
                };
                let reply = job::run(request, &mut report);
                if out.send(Message::Ended { lane: index, key, reply }).is_err() {
                    return;
                }
                wake();
            }
        };
        // A thread that the system refuses leaves a lane whose jobs fail by name (`send`).
        let thread = thread::Builder::new().name(format!("lane {index}")).spawn(work).ok();
        Self { index, requests: Some(requests), messages, stop, thread }
    }

    /// Hands over a job; only to a lane that is free.
    pub(super) fn send(&mut self, request: Request) {
        self.stop.store(false, Ordering::Relaxed);
        let key = request.key;
        let sent = self.requests.as_ref().is_some_and(|r| r.send(request).is_ok());
        if !sent {
            let result = Err(Error::Crashed("the thread of this job could not be started".to_owned()));
            let reply = Some(Reply { key, result });
            let _ = self.messages.send(Message::Ended { lane: self.index, key, reply });
        }
    }

    /// Asks the running job to stop.
    pub(super) fn stop(&self) {
        self.stop.store(true, Ordering::Relaxed);
    }
}

impl Drop for Lane {
    fn drop(&mut self) {
        self.stop();
        self.requests = None;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}
