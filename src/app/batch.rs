//! Many pictures straightened: a job each, on the lanes of everything else; the results go where the user said.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use super::{
    action::{Action, Command},
    files::{Place, tell_bad},
    plan::Kind,
    state::{Notice, State},
};
use crate::{
    calib::{Error, Result, number::counted, observation::FrameId},
    job::{Job, Key, Output, Reply, Request, Source},
};

/// Pictures that are being straightened.
pub struct Batch {
    place: Place,
    /// The picture of each job that has not answered.
    open: BTreeMap<Key, PathBuf>,
    total: usize,
    done: usize,
    /// The first thing that went wrong.
    wrong: Option<Error>,
}

impl Batch {
    /// Every picture that the camera fits, and the jobs for it. `number` tells batches apart.
    ///
    /// # Errors
    /// Those of [`Place::new`].
    pub fn new(state: &State, folder: &Path, number: u64) -> Result<Option<(Self, Vec<Request>)>> {
        let Some((answer, solution)) = state.data.solved() else { return Ok(None) };
        let fits =
            |id: FrameId| answer.frame(id).is_some_and(|f| f.image_size_px == Some(solution.camera.size_px));
        let mut open = BTreeMap::new();
        for frame in state.doc.frames.iter().filter(|f| fits(f.id)) {
            let Source::File(path) = &frame.source else { continue };
            let key = Kind::Develop(frame.id).key(number.into());
            open.insert(key, path.clone());
        }
        let pictures: Vec<PathBuf> = open.values().cloned().collect();
        let place = Place::new(folder, &pictures)?;
        let job = |path: &PathBuf| Job::Develop {
            path: path.clone(),
            to: place.to(path),
            camera: solution.camera.clone(),
            framing: state.doc.framing(),
        };
        let jobs: Vec<Request> =
            open.iter().map(|(key, path)| Request { key: *key, job: job(path) }).collect();
        let total = jobs.len();
        Ok((total > 0).then_some((Self { place, open, total, done: 0, wrong: None }, jobs)))
    }

    /// Whether a job is one of this batch that has not answered.
    pub fn has(&self, key: Key) -> bool {
        self.open.contains_key(&key)
    }

    /// Whether all jobs have answered.
    pub fn is_done(&self) -> bool {
        self.open.is_empty()
    }

    /// Takes the answer of a job; answers what to tell.
    pub fn take(&mut self, reply: Reply) -> Option<Action> {
        let path = self.open.remove(&reply.key)?;
        let put = reply.result.and_then(|output| match output {
            Output::File(bytes) => self.place.put(&path, &bytes),
            _ => Err(Error::Crashed("something else answered".to_owned())),
        });
        match put {
            Ok(()) => self.done += 1,
            Err(error) => drop(self.wrong.get_or_insert(error)),
        }
        let words = format!("{} of {} straightened", self.done, counted(self.total, "picture"));
        if !self.open.is_empty() {
            let offer = Some(("Stop".to_owned(), Command::StopStraightening));
            return Some(Action::Tell(Notice { offer, ..Notice::good(words) }));
        }
        Some(match (self.done, self.wrong.take()) {
            (0, Some(error)) => tell_bad(error.to_string()),
            (_, wrong) => match self.place.close(&words) {
                Ok(done) => {
                    let but = wrong.map_or(String::new(), |error| format!("; the others failed: {error}"));
                    Action::Tell(Notice { bad: !but.is_empty(), ..Notice::good(done + &but) })
                }
                Err(error) => tell_bad(error.to_string()),
            },
        })
    }
}
