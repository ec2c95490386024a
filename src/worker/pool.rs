//! The queue in front of the lanes.

use std::{
    collections::VecDeque,
    ops::ControlFlow,
    sync::{
        Arc,
        mpsc::{self, Receiver},
    },
};

#[cfg(not(target_arch = "wasm32"))]
use super::lane_native::Lane;
#[cfg(target_arch = "wasm32")]
use super::lane_web::Lane;
use crate::{
    calib::{Error, Result},
    job::{Job, Key, Output, Progress, Reply, Request},
};

/// Called when there is something to hear.
pub(super) type Wake = Arc<dyn Fn() + Send + Sync>;

/// What a lane says to its pool.
pub(super) enum Message {
    Progress(Key, Progress),
    /// The lane is free again; no reply where the job was stopped.
    Ended {
        lane: usize,
        key: Key,
        reply: Option<Reply>,
    },
}

/// A queue of jobs and the lanes that work on it.
pub struct Pool {
    lanes: Vec<Lane>,
    /// What each lane is at.
    busy: Vec<Option<Key>>,
    queue: VecDeque<Request>,
    messages: Receiver<Message>,
}

/// What happened in the pool.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// A job is so far.
    Progress(Key, Progress),
    /// A job is done.
    Done(Box<Reply>),
    /// A job was stopped and has no reply.
    Stopped(Key),
}

impl Pool {
    /// A pool of `lanes` lanes, at least one.
    pub fn new(lanes: usize) -> Self {
        Self::waking(lanes, || ())
    }

    /// The same; `wake` is called, by a lane, whenever there is something to [`Pool::poll`].
    pub fn waking(lanes: usize, wake: impl Fn() + Send + Sync + 'static) -> Self {
        let wake: Wake = Arc::new(wake);
        let lanes = lanes.max(1);
        let (sender, messages) = mpsc::channel();
        Self {
            lanes: (0..lanes).map(|i| Lane::spawn(i, sender.clone(), wake.clone())).collect(),
            busy: vec![None; lanes],
            queue: VecDeque::new(),
            messages,
        }
    }

    /// Puts a job at the end of the queue.
    pub fn submit(&mut self, request: Request) {
        self.queue.push_back(request);
        self.feed();
    }

    /// Puts jobs at the end of the queue, and before all that wait those whose results someone looks at, the last of them first.
    /// Lanes begin only then, or a free one would take what can wait.
    pub fn submit_all(&mut self, first: Vec<Request>, then: Vec<Request>) {
        for request in then {
            if !self.has(request.key) {
                self.queue.push_back(request);
            }
        }
        for request in first {
            if !self.has(request.key) {
                self.queue.push_front(request);
            }
        }
        self.feed();
    }

    /// Whether a job with this key waits or runs.
    pub fn has(&self, key: Key) -> bool {
        self.busy.contains(&Some(key)) || self.queue.iter().any(|r| r.key == key)
    }

    /// Keys of all jobs that wait or run.
    pub fn keys(&self) -> impl Iterator<Item = Key> + '_ {
        self.busy.iter().flatten().copied().chain(self.queue.iter().map(|r| r.key))
    }

    /// Drops queued jobs and stops running ones whose keys are not wanted any more.
    pub fn keep(&mut self, wanted: impl Fn(Key) -> bool) {
        self.queue.retain(|request| wanted(request.key));
        for (lane, key) in self.lanes.iter().zip(&self.busy) {
            if key.is_some_and(|key| !wanted(key)) {
                lane.stop();
            }
        }
    }

    /// What happened since the last call; does not wait.
    pub fn poll(&mut self) -> Option<Event> {
        let message = self.messages.try_recv().ok()?;
        Some(self.take(message))
    }

    /// Waits for the next event; `None` where nothing is queued or running.
    pub fn wait(&mut self) -> Option<Event> {
        self.busy.iter().any(Option::is_some).then(|| self.messages.recv().ok())?.map(|m| self.take(m))
    }

    /// Runs jobs and answers their results in the same order. `heard` gets the number of jobs that are done and may stop all.
    ///
    /// # Errors
    /// [`Error::Stopped`] where `heard` breaks; what fails by itself is in the list.
    pub fn map(
        &mut self,
        jobs: Vec<Job>,
        heard: &mut dyn FnMut(usize) -> ControlFlow<()>,
    ) -> Result<Vec<Result<Output>>> {
        let mut results: Vec<Option<Result<Output>>> = vec![None; jobs.len()];
        for (i, job) in jobs.into_iter().enumerate() {
            self.submit(Request { key: Key(i as u128), job });
        }
        let mut done = 0;
        while let Some(event) = self.wait() {
            if let Event::Done(reply) = event {
                results[reply.key.0 as usize] = Some(reply.result);
                done += 1;
            }
            if heard(done).is_break() {
                self.keep(|_| false);
                while self.wait().is_some() {}
                return Err(Error::Stopped);
            }
        }
        Ok(results.into_iter().map(|r| r.unwrap_or(Err(Error::Stopped))).collect())
    }

    fn take(&mut self, message: Message) -> Event {
        match message {
            Message::Progress(key, progress) => Event::Progress(key, progress),
            Message::Ended { lane, key, reply } => {
                self.busy[lane] = None;
                self.feed();
                reply.map_or(Event::Stopped(key), |reply| Event::Done(Box::new(reply)))
            }
        }
    }

    /// Gives queued jobs to idle lanes.
    fn feed(&mut self) {
        for (lane, busy) in self.lanes.iter_mut().zip(&mut self.busy) {
            if busy.is_none()
                && let Some(request) = self.queue.pop_front()
            {
                *busy = Some(request.key);
                lane.send(request);
            }
        }
    }
}

#[cfg(test)]
mod tests;
