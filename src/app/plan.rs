//! What is still to be computed: compares what each value should be made from with what it was made from.
//!
//! No panel starts a job, no edit lists what it invalidates, there are no flags. A result is a function of its key.

use std::{hash::Hash, sync::Arc};

use siphasher::sip128::{Hasher128, SipHasher13};

use super::{
    lab,
    screen::Beside,
    state::{Answer, Frame, State},
};
use crate::{
    calib::{
        calibrate::Options, camera::Model, detect, experiment::ablate::TRIALS, observation::FrameId,
        report::Settings, synth::Scene, target::Unit,
    },
    job::{
        Job, Key, Request, Source,
        assemble::Entry,
        evidence::{Case, Known},
    },
};

/// Longer side of thumbnails, px: sharp at twice the size in which they are listed.
const THUMBNAIL_PX: u32 = 192;
/// While pictures are read, a new calibration waits until there are this many times as many as in the last.
const GROWTH: f64 = 1.3;

/// How often a twin is drawn.
const TWINS: u32 = 30;

/// What a key stands for; it is the key's first byte.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// What is seen in a picture.
    Inspect(FrameId),
    /// A small copy of a picture.
    Thumbnail(FrameId),
    /// The calibration.
    Evidence,
    /// The selected picture.
    Look(FrameId),
    /// The selected picture, straightened.
    Straight,
    /// What one change of the method does.
    Effect(u32),
    /// A picture, straightened, as a file.
    Develop(FrameId),
    /// The camera models side by side.
    Compare,
    /// Whether an earlier calibration still holds.
    Validate,
    /// What each picture does to the camera.
    Weigh,
    /// What may be wrong with the calibration.
    Sources,
    /// What to photograph next.
    Advise,
    /// The capture drawn anew.
    Twin,
}

impl Kind {
    /// Of a key; none for a foreign one.
    pub fn of(key: Key) -> Option<Self> {
        match key.0 >> 120 {
            1 => Some(Self::Inspect(FrameId(key.0 as u32))),
            2 => Some(Self::Evidence),
            3 => Some(Self::Look(FrameId(key.0 as u32))),
            4 => Some(Self::Straight),
            6 => Some(Self::Effect(key.0 as u32)),
            7 => Some(Self::Develop(FrameId(key.0 as u32))),
            8 => Some(Self::Compare),
            13 => Some(Self::Validate),
            9 => Some(Self::Weigh),
            12 => Some(Self::Sources),
            10 => Some(Self::Advise),
            11 => Some(Self::Twin),
            5 => Some(Self::Thumbnail(FrameId(key.0 as u32))),
            _ => None,
        }
    }

    /// A key of this kind with this content.
    pub(super) const fn key(self, content: u128) -> Key {
        let (kind, content) = match self {
            Self::Inspect(id) => (1, content << 32 | id.0 as u128),
            Self::Thumbnail(id) => (5, content << 32 | id.0 as u128),
            Self::Evidence => (2, content),
            Self::Look(id) => (3, content << 32 | id.0 as u128),
            Self::Straight => (4, content),
            Self::Effect(number) => (6, number as u128),
            Self::Develop(id) => (7, content << 32 | id.0 as u128),
            Self::Compare => (8, content),
            Self::Validate => (13, content),
            Self::Weigh => (9, content),
            Self::Sources => (12, content),
            Self::Advise => (10, content),
            Self::Twin => (11, content),
        };
        Key((kind << 120) | (content & (u128::MAX >> 8)))
    }
}

/// Tells apart what pictures of one number are made from: views by all of their scene.
///
/// Kept in the state: it is asked for in every frame, and a scene is hashed as text.
#[derive(Default)]
pub(super) struct Prints {
    /// How many times something else was opened: numbers of pictures start over then, and jobs of before may still answer.
    opened: u64,
    /// The last scene: all views of one share it.
    scene: Option<(Arc<Scene>, u64)>,
}

impl Prints {
    /// Of what is opened after this.
    pub(super) fn next(&self) -> Self {
        Self { opened: self.opened + 1, scene: None }
    }

    fn of(&mut self, source: &Source) -> u64 {
        let mut hash = SipHasher13::new();
        match source {
            // A file's number is its own while it is open, also where the file is found again elsewhere.
            Source::File(_) => self.opened.hash(&mut hash),
            Source::View { scene, view } => {
                if !self.scene.as_ref().is_some_and(|(last, _)| Arc::ptr_eq(last, scene)) {
                    let mut text = SipHasher13::new();
                    scene.to_json().hash(&mut text);
                    self.scene = Some((scene.clone(), text.finish128().as_u64().0));
                }
                (self.scene.as_ref().map(|s| s.1), view).hash(&mut hash);
            }
        }
        hash.finish128().as_u64().0
    }
}

/// A calibration that was asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct Asked {
    /// What it is made from.
    pub key: Key,
    /// The picture at each position.
    pub ids: Vec<FrameId>,
    /// Whether all pictures had been looked at.
    pub complete: bool,
}

/// What is wanted now.
#[derive(Debug, Default)]
pub struct Plan {
    /// Someone waits for these: before all others, the last of them first.
    pub first: Vec<Request>,
    /// In this order.
    pub then: Vec<Request>,
}

impl State {
    /// Everything that is wanted and not there. While a calibration runs (`solving`) no other is: the next one starts from everything
    /// that has come meanwhile.
    pub fn plan(&mut self, solving: bool) -> Plan {
        let mut plan = Plan::default();
        plan.first.extend(self.look());
        plan.first.extend(self.straight());
        plan.first.extend(self.weighing());
        if !solving {
            plan.first.extend(self.evidence());
        }
        if !self.data.stopped {
            let waiting = self.inspected().into_iter().filter(|(.., fresh)| !fresh);
            plan.then.extend(waiting.map(|(frame, key, _)| Request {
                key,
                job: Job::Inspect {
                    source: frame.source.clone(),
                    options: detect::Options::default(),
                    thumbnail_px: THUMBNAIL_PX,
                },
            }));
        }
        // Of a session that was opened: its pictures were looked at in another run.
        let bare = |f: &&Frame| {
            matches!(self.data.inspections.get(&f.id), Some(Ok(_)))
                && !self.data.thumbnails.contains_key(&f.id)
        };
        plan.then.extend(self.doc.frames.iter().filter(bare).map(|frame| Request {
            key: Kind::Thumbnail(frame.id).key(u128::from(self.prints.borrow_mut().of(&frame.source))),
            job: Job::Thumbnail { source: frame.source.clone(), longest_px: THUMBNAIL_PX },
        }));
        plan.then.extend(self.advising());
        plan.then.extend(self.sourcing());
        plan.then.extend(self.validity());
        plan.then.extend(self.comparison());
        plan.then.extend(self.twin());
        if self.screen.lab == Some(lab::Part::Ablation) {
            let missing = (0..TRIALS as u32).filter(|n| !self.data.effects.contains_key(n));
            plan.then.extend(missing.map(|n| Request { key: Kind::Effect(n).key(0), job: Job::Ablate(n) }));
        }
        plan
    }

    fn look(&self) -> Option<Request> {
        let id = self.selected()?;
        let key = self.look_key()?;
        if self.data.look.as_ref().is_some_and(|l| l.key == key) {
            return None;
        }
        Some(Request { key, job: Job::Look { source: self.doc.frame(id)?.source.clone() } })
    }

    fn straight(&self) -> Option<Request> {
        let id = self.selected()?;
        let (answer, solution) = self.data.solved()?;
        // A straightened picture for every partial result would be thrown away at once.
        if !answer.complete && self.data.straight.is_some() {
            return None;
        }
        // A picture of another size is not this camera's.
        if answer.frame(id)?.image_size_px != Some(solution.camera.size_px) {
            return None;
        }
        let mut hash = SipHasher13::new();
        let doc = &self.doc;
        (self.look_key()?.0, doc.alpha.to_bits(), doc.fov_deg.map(f64::to_bits)).hash(&mut hash);
        (doc.projection, solution.camera.model).hash(&mut hash);
        solution.camera.params.iter().for_each(|p| p.to_bits().hash(&mut hash));
        let key = Kind::Straight.key(hash.finish128().into());
        if self.data.straight.as_ref().is_some_and(|s| s.key == key) {
            return None;
        }
        let source = self.doc.frame(id)?.source.clone();
        Some(Request {
            key,
            job: Job::Straighten { source, camera: solution.camera.clone(), framing: self.doc.framing() },
        })
    }

    fn evidence(&mut self) -> Option<Request> {
        let key = evidence_key(self)?;
        let have = self.data.answer.as_deref();
        if have.is_some_and(|a| a.key == key) {
            return None;
        }
        let inspected = self.inspected();
        let ids: Vec<FrameId> = inspected.iter().filter(|i| i.2).map(|(frame, ..)| frame.id).collect();
        let (seen, all) = (ids.len(), inspected.len());
        let complete = seen == all || self.data.stopped;
        let last = have.map_or(0, |a| a.ids.len());
        let few = seen < 3 || (seen > last && (seen as f64) < last as f64 * GROWTH);
        // Of a scene that has changed all views come anew: until then the old camera stays.
        let changed =
            inspected.iter().any(|(f, _, fresh)| !fresh && self.data.inspections.contains_key(&f.id));
        if !complete && (few || changed) {
            return None;
        }
        let case = case(self, &ids);
        self.data.asked = Some(Asked { key, ids, complete });
        Some(Request { key, job: Job::Evidence(Box::new(case)) })
    }
}

impl State {
    /// The camera that is shown, once it is complete and no other is wanted.
    fn settled(&self) -> Option<&Answer> {
        let (answer, _) = self.data.solved().filter(|(a, _)| a.complete)?;
        (evidence_key(self) == Some(answer.key)).then_some(answer)
    }

    /// The camera shown is weighed: the words of the pictures are part of what an edit brings.
    fn weighing(&self) -> Option<Request> {
        let answer = self.settled().filter(|a| !a.weighed)?;
        let evidence = Box::new(answer.evidence.clone());
        Some(Request { key: Kind::Weigh.key(answer.key.0), job: Job::Weigh(evidence) })
    }

    /// Then it is asked what may be wrong.
    fn sourcing(&self) -> Option<Request> {
        let answer = self.settled().filter(|a| a.weighed && !a.sourced)?;
        let evidence = Box::new(answer.evidence.clone());
        Some(Request { key: Kind::Sources.key(answer.key.0), job: Job::Sources(evidence) })
    }

    /// Advice is for the camera shown, once it is complete and no other is wanted.
    fn advising(&self) -> Option<Request> {
        let answer = self.settled()?;
        let goal = self.doc.goal;
        let mut hash = SipHasher13::new();
        (answer.key.0, goal.to_string()).hash(&mut hash);
        let key = Kind::Advise.key(hash.finish128().into());
        if self.data.advice.as_ref().is_some_and(|a| a.0 == key) {
            return None;
        }
        Some(Request { key, job: Job::Advise(Box::new(answer.evidence.clone()), goal) })
    }

    /// A twin is drawn of the camera that one was asked of, while it is shown.
    fn twin(&self) -> Option<Request> {
        let (answer, _) = self.data.solved().filter(|(a, _)| self.screen.twin == Some(a.key))?;
        let key = twin_key(answer);
        if self.data.twin.as_ref().is_some_and(|t| t.0 == key) {
            return None;
        }
        Some(Request { key, job: Job::Twin(Box::new(answer.report().clone()), TWINS) })
    }

    /// The earlier calibration that is shown is held against the pictures, also where these alone have no camera.
    fn validity(&self) -> Option<Request> {
        let (answer, beside) = (self.data.answer.as_deref()?, self.screen.earlier.shown()?);
        if !answer.complete || evidence_key(self) != Some(answer.key) {
            return None;
        }
        let key = validity_key(answer, beside);
        if self.data.validity.as_ref().is_some_and(|v| v.0 == key) {
            return None;
        }
        let case = Box::new(case(self, &answer.ids));
        let Beside { name, text, .. } = &**beside;
        Some(Request { key, job: Job::Validate { case, file: name.clone(), text: text.clone() } })
    }

    /// Models are compared on what the camera shown was calibrated from, once that is complete.
    fn comparison(&self) -> Option<Request> {
        let (answer, _) = self.data.solved().filter(|(a, _)| a.complete && self.screen.comparing)?;
        let key = Kind::Compare.key(content(self, false)?);
        if self.data.compared.as_ref().is_some_and(|c| c.0 == key) {
            return None;
        }
        Some(Request { key, job: Job::Compare(Box::new(case(self, &answer.ids))) })
    }

    /// Each picture with the key of what is seen in it, and whether that is known.
    pub(super) fn inspected(&self) -> Vec<(&Frame, Key, bool)> {
        let mut prints = self.prints.borrow_mut();
        let frames = self.doc.frames.iter();
        frames
            .map(|frame| {
                let key = Kind::Inspect(frame.id).key(u128::from(prints.of(&frame.source)));
                let made_from = self.data.made_from.get(&frame.id).unwrap_or(&key);
                (frame, key, *made_from == key && self.data.inspections.contains_key(&frame.id))
            })
            .collect()
    }

    /// The key of the selected picture as it is looked at.
    pub fn look_key(&self) -> Option<Key> {
        let frame = self.doc.frame(self.selected()?)?;
        let print = self.prints.borrow_mut().of(&frame.source);
        Some(Kind::Look(frame.id).key(u128::from(print)))
    }
}

/// What the calibration should be made from; none without pictures that were looked at.
pub fn evidence_key(state: &State) -> Option<Key> {
    content(state, true).map(|content| Kind::Evidence.key(content))
}

/// What a calibration is made from, with or without the model that was asked for.
fn content(state: &State, with_model: bool) -> Option<u128> {
    let doc = &state.doc;
    let mut hash = SipHasher13::new();
    let mut any = false;
    for (frame, key, _) in state.inspected().into_iter().filter(|(.., fresh)| *fresh) {
        any = true;
        (key.0, doc.excluded.contains(&frame.id)).hash(&mut hash);
    }
    (doc.board.map(|b| b.to_string()), doc.model.filter(|_| with_model), doc.loss, doc.weights)
        .hash(&mut hash);
    for fix in &doc.fixed {
        fix.to_string().hash(&mut hash);
    }
    if let Some(square) = doc.square {
        (square.value.to_bits(), square.unit.name()).hash(&mut hash);
    }
    for (id, index) in doc.dropped.iter() {
        (1u8, id, index).hash(&mut hash);
    }
    any.then(|| hash.finish128().into())
}

/// What draws this answer anew.
pub(super) const fn twin_key(answer: &Answer) -> Key {
    Kind::Twin.key(answer.key.0)
}

/// What holds an earlier calibration against the pictures of this answer.
pub fn validity_key(answer: &Answer, beside: &Beside) -> Key {
    let mut hash = SipHasher13::new();
    (answer.key.0, beside.print).hash(&mut hash);
    Kind::Validate.key(hash.finish128().into())
}

fn case(state: &State, ids: &[FrameId]) -> Case {
    let doc = &state.doc;
    let position = |id: FrameId| ids.binary_search(&id).ok();
    let entry = |id: &FrameId| {
        let name = doc.frame(*id).map(|f| f.source.name()).unwrap_or_default();
        let seen = state.data.inspections.get(id).cloned();
        let seen = seen.map(|s| s.map(Arc::unwrap_or_clone));
        Entry::inspected(name, seen.unwrap_or(Err(crate::calib::Error::Stopped)))
    };
    let (mut square, mut unit) = doc.square.map_or((1.0, Unit::Squares), |s| (s.value, s.unit));
    let truth = doc.scene().map(|scene| scene.truth());
    if let (None, Some(truth)) = (doc.square, &truth) {
        (square, unit) = (truth.square, truth.unit);
    }
    let settings = Settings { square, unit, ..Settings::default() };
    Case {
        board: doc.board,
        models: doc.model.map_or_else(|| Model::USUAL.to_vec(), |m| vec![m]),
        truth: truth.map(|t| Known { file: "scene".to_owned(), camera: t.camera.clone(), scene: Some(t) }),
        options: Options {
            fixed: doc.fixed.clone(),
            loss: doc.loss,
            weights: doc.weights,
            ..Options::default()
        },
        excluded: doc.excluded.iter().filter_map(|id| position(*id)).collect(),
        dropped: doc.dropped.iter().filter_map(|(id, index)| Some((position(*id)?, *index))).collect(),
        ..Case::new(ids.iter().map(entry).collect(), settings)
    }
}
