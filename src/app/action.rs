//! Everything that can happen, and the only place where the state changes.

use std::{path::PathBuf, sync::Arc};

use super::{
    export::Content,
    panels::{Tile, lens},
    plan,
    screen::{Beside, Screen},
    session::Session,
    state::{Answer, Document, Frame, Notice, Shown, State},
};
use crate::{
    calib::{Error, Result, advice::Advice, synth::Scene},
    job::{Key, Output, Reply, Source},
};

/// Answers that are kept for undo.
const KEPT: usize = 32;
/// Documents to go back to.
const DEPTH: usize = 200;

/// Something that happened.
#[derive(Clone, Debug)]
pub enum Action {
    /// Pictures to add, in order; those that are open already are passed over.
    Add(Vec<Source>),
    /// Start over with these pictures.
    Open(Vec<Source>),
    /// Close everything.
    Close,
    /// Start over with a session.
    Restore(Box<Session>),
    /// A new document: one step of undo.
    Edit(Box<Document>),
    /// A new document while something is dragged: the step of undo was made at the start of the drag.
    Drag(Box<Document>),
    /// The screen shows something else.
    Show(Box<Screen>),
    /// One document back.
    Undo,
    /// One document forward.
    Redo,
    /// Stop reading pictures.
    Stop,
    /// Go on reading pictures.
    Resume,
    /// A job has answered.
    Finished(Box<Reply>),
    /// A calibration was opened to be compared.
    Beside(Box<Beside>),
    /// A job has done this share of its work.
    Progress(Key, f32),
    /// Something to tell.
    Tell(Notice),
    /// Something that only the application itself can do: it has files and windows.
    Do(Command),
}

/// What is done outside of the state.
#[derive(Clone, Debug, PartialEq)]
pub enum Command {
    /// Ask for a folder.
    PickFolder,
    /// Ask for pictures.
    PickPictures,
    /// Open what lies at these paths, beside what is open or instead of it.
    OpenPaths(Vec<PathBuf>),
    /// Ask for a place and write a file.
    Save {
        /// Proposed name.
        name: String,
        /// What is written.
        content: Content,
    },
    /// Ask for a folder and write files into it, names and contents; a browser makes one archive.
    SaveAll(Vec<(String, Content)>),
    /// Ask where straightened pictures go.
    StraightenAll,
    /// Straighten every picture into a folder; a browser makes one archive.
    StraightenInto(PathBuf),
    /// Leave the rest of the pictures as they are.
    StopStraightening,
    /// Ask for a place and write the session.
    SaveSession,
    /// Ask for the folder that pictures moved to.
    Locate,
    /// Ask for a session.
    OpenSession,
    /// Ask for camera files to compare with.
    PickCameras,
    /// Put the panels back into their places.
    ResetLayout,
    /// Put a text on the clipboard.
    Copy(String),
}

impl State {
    /// Changes the state.
    pub fn apply(&mut self, action: Action) {
        self.revision += 1;
        if !matches!(
            action,
            Action::Show(_)
                | Action::Beside(_)
                | Action::Progress(..)
                | Action::Tell(_)
                | Action::Do(_)
                | Action::Stop
                | Action::Resume
        ) {
            self.content += 1;
        }
        match action {
            Action::Add(sources) => self.add(sources),
            Action::Open(sources) => {
                *self = self.fresh();
                self.add(sources);
                self.past.clear();
            }
            Action::Restore(mut session) => {
                *self = self.fresh();
                let thumbnails = std::mem::take(&mut session.thumbnails);
                self.data.thumbnails =
                    thumbnails.into_iter().map(|(id, raster)| (id, Some(raster))).collect();
                (self.doc, self.data.inspections) = session.into_parts();
                let keys: Vec<_> = self.inspected().into_iter().map(|(f, key, _)| (f.id, key)).collect();
                self.data.made_from.extend(keys);
            }
            Action::Close => *self = self.fresh(),
            Action::Edit(doc) => self.edit(*doc),
            Action::Drag(doc) => self.doc = *doc,
            Action::Show(screen) => self.screen = *screen,
            Action::Undo => {
                if let Some(doc) = self.past.pop() {
                    self.future.push(std::mem::replace(&mut self.doc, doc));
                }
            }
            Action::Redo => {
                if let Some(doc) = self.future.pop() {
                    self.past.push(std::mem::replace(&mut self.doc, doc));
                }
            }
            Action::Stop => self.data.stopped = true,
            Action::Resume => self.data.stopped = false,
            Action::Finished(reply) => self.finished(*reply),
            Action::Beside(beside) => {
                self.screen.earlier.open(*beside);
                self.screen.go(Tile::Lens, lens::COMPARE);
            }
            Action::Progress(key, share) => self.data.progress = Some((key, share)),
            Action::Tell(notice) => self.screen.notice = Some(notice),
            Action::Do(_) => {}
        }
        self.recall();
    }

    /// Nothing open; counters go on, and what was open once is remembered.
    fn fresh(&mut self) -> Self {
        let recent = std::mem::take(&mut self.recent);
        let Screen { layers, unlocked, lab, .. } = self.screen;
        let screen = Screen { layers, unlocked, lab, ..Screen::default() };
        let prints = self.prints.get_mut().next();
        Self {
            revision: self.revision,
            content: self.content,
            recent,
            screen,
            prints: prints.into(),
            ..Self::default()
        }
    }

    fn edit(&mut self, doc: Document) {
        if doc != self.doc {
            self.past.push(std::mem::replace(&mut self.doc, doc));
            self.future.clear();
            if self.past.len() > DEPTH {
                self.past.remove(0);
            }
        }
    }

    fn add(&mut self, sources: Vec<Source>) {
        let mut doc = self.doc.clone();
        let mut frames = doc.frames.to_vec();
        for source in sources {
            if !frames.iter().any(|f| f.source == source) {
                frames.push(Frame { id: doc.new_id(), source });
            }
        }
        doc.frames = Arc::new(frames);
        self.data.stopped = false;
        self.edit(doc);
    }

    fn finished(&mut self, Reply { key, result }: Reply) {
        match plan::Kind::of(key) {
            Some(plan::Kind::Inspect(id)) => {
                self.data.made_from.insert(id, key);
                let result = result.map(|output| match output {
                    Output::Inspection(i) => Some(*i),
                    _ => None,
                });
                match result.transpose() {
                    Some(Ok(mut inspection)) => {
                        let thumbnail = inspection.thumbnail.take();
                        self.data.thumbnails.insert(id, thumbnail.map(Arc::new));
                        self.data.inspections.insert(id, Ok(Arc::new(inspection)));
                    }
                    Some(Err(error)) => drop(self.data.inspections.insert(id, Err(error))),
                    None => {}
                }
            }
            Some(plan::Kind::Thumbnail(id)) => {
                self.data.thumbnails.insert(id, shown(key, result).raster.ok());
            }
            Some(plan::Kind::Evidence) => match result {
                Ok(Output::Evidence(mut evidence)) => {
                    if let Some(asked) = self.data.asked.take_if(|a| a.key == key) {
                        let plan::Asked { key, ids, complete } = asked;
                        // What was done before and beside: the job itself knows its own time alone.
                        let time = &mut evidence.report.timing_ms;
                        for seen in ids.iter().filter_map(|id| self.data.inspections.get(id)?.as_ref().ok()) {
                            time.read += seen.read_ms;
                            time.detect += seen.detect_ms;
                        }
                        time.total = time.read + time.detect + time.calibrate;
                        self.keep(Arc::new(Answer {
                            key,
                            ids,
                            evidence: *evidence,
                            complete,
                            weighed: false,
                            sourced: false,
                        }));
                    }
                }
                Ok(_) => {}
                Err(error) => self.screen.notice = Some(Notice::bad(error.to_string())),
            },
            Some(plan::Kind::Look(_)) => self.data.look = Some(shown(key, result)),
            Some(plan::Kind::Straight) => self.data.straight = Some(shown(key, result)),
            Some(plan::Kind::Effect(number)) => {
                let outcome = match result {
                    Ok(Output::Effect(outcome)) => outcome.map(|n| *n),
                    Ok(_) => return,
                    Err(error) => Err(error.to_string()),
                };
                self.data.effects.insert(number, outcome);
            }
            Some(kind @ (plan::Kind::Weigh | plan::Kind::Sources)) => self.grown(kind, key, result),
            Some(plan::Kind::Advise) => {
                // Where it fails it is not asked for again: the camera stands without it.
                let advice = match result {
                    Ok(Output::Advice(advice)) => *advice,
                    Ok(_) => return,
                    Err(error) => Advice::failed(self.doc.goal, &error),
                };
                self.data.advice = Some((key, advice));
            }
            Some(plan::Kind::Twin) => {
                let outcome = match result {
                    Ok(Output::Twin(outcome)) => Ok(*outcome),
                    Ok(_) => return,
                    Err(error) => Err(error.to_string()),
                };
                self.data.twin = Some((key, outcome));
            }
            Some(plan::Kind::Compare) => {
                let outcome = match result {
                    Ok(Output::Compared(comparison)) => Ok(*comparison),
                    Ok(_) => return,
                    Err(error) => Err(error.to_string()),
                };
                self.data.compared = Some((key, outcome));
            }
            Some(plan::Kind::Validate) => {
                let outcome = match result {
                    Ok(Output::Validity(validity)) => Ok(*validity),
                    Ok(_) => return,
                    Err(error) => Err(error.to_string()),
                };
                self.data.validity = Some((key, outcome));
            }
            // Files go past the state: see `batch`.
            Some(plan::Kind::Develop(_)) | None => {}
        }
    }

    /// Puts an answer that says more in place of the one before.
    fn grown(&mut self, kind: plan::Kind, key: Key, result: Result<Output>) {
        let same = |a: &Arc<Answer>| kind.key(a.key.0) == key;
        let Some(known) = self.data.kept.iter_mut().find(|a| same(a)) else { return };
        let evidence = match result {
            Ok(Output::Evidence(evidence)) => *evidence,
            // Once is enough: the camera stands without it.
            _ => known.evidence.clone(),
        };
        let (weighed, sourced) = (true, known.sourced || kind == plan::Kind::Sources);
        *known = Arc::new(Answer { evidence, weighed, sourced, ids: known.ids.clone(), ..**known });
        if self.data.answer.as_ref().is_some_and(|a| a.key == known.key) {
            self.data.answer = Some(known.clone());
        }
    }

    fn keep(&mut self, answer: Arc<Answer>) {
        if self.data.kept.len() >= KEPT {
            self.data.kept.remove(0);
        }
        self.data.kept.push(answer.clone());
        self.show(answer);
    }

    fn show(&mut self, answer: Arc<Answer>) {
        let before = self.data.answer.replace(answer);
        // A ghost shows what an edit changed, not what another picture read made of a part.
        self.data.ghost = before.filter(|b| b.complete && b.solution().is_some());
    }

    /// Shows the answer at once where it is known already.
    fn recall(&mut self) {
        let wanted = plan::evidence_key(self);
        if self.data.answer.as_ref().map(|a| a.key) != wanted
            && let Some(known) = self.data.kept.iter().find(|a| Some(a.key) == wanted)
        {
            let known = known.clone();
            self.show(known);
        }
    }
}

/// A picture that was computed.
fn shown(key: Key, result: Result<Output>) -> Shown {
    let (raster, valid) = match result {
        Ok(Output::Raster(raster)) => (Ok(raster), None),
        Ok(Output::Straight(raster, valid)) => (Ok(raster), valid),
        Ok(_) => (Err(Error::Crashed("something else answered".to_owned())), None),
        Err(error) => (Err(error), None),
    };
    Shown { key, raster: raster.map(Arc::new), valid }
}

/// The built-in scene as pictures.
pub fn demo() -> Vec<Source> {
    let scene = Arc::new(Scene::seed());
    (0..scene.poses.len()).map(|view| Source::View { scene: scene.clone(), view }).collect()
}
