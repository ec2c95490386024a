//! What the application knows: what the user decided, what was computed from it, what is on the screen.

use std::{
    cell::RefCell,
    collections::{BTreeMap, BTreeSet},
    path::PathBuf,
    sync::Arc,
};

use serde::{Deserialize, Serialize};

use super::{
    action::Command,
    plan::{Asked, Prints},
    screen::Screen,
};
use crate::{
    calib::{
        Error,
        advice::{Advice, Goal},
        board::Design,
        calibrate::{Comparison, Fix, Loss, Weights},
        camera::Model,
        compare::Validity,
        experiment::ablate::Numbers,
        observation::FrameId,
        report::{FrameReport, Report, Solution},
        synth::Scene,
        target::Length,
        twin::Outcome,
        undistort::{Framing, Projection, Rect},
    },
    job::{Inspection, Key, Source, evidence::Evidence, raster::Raster},
};

/// Factors by which residuals can be drawn longer.
pub const TIMES: [f64; 7] = [1.0, 10.0, 30.0, 100.0, 300.0, 1000.0, 3000.0];

/// A picture that was opened.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Frame {
    /// Never reused.
    pub id: FrameId,
    /// Where it comes from.
    pub source: Source,
}

/// What the user decided. Cheap to clone; saved and undone as one value.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Document {
    /// The pictures, in the order in which they were opened.
    pub frames: Arc<Vec<Frame>>,
    /// The board; none finds it from the pictures.
    pub board: Option<Design>,
    /// Edge of a square; none where it is not known.
    pub square: Option<Length>,
    /// Camera model; none takes an ordinary lens, or a fisheye where that does not fit.
    pub model: Option<Model>,
    /// Constraints on its parameters.
    pub fixed: Vec<Fix>,
    /// Loss of a residual.
    pub loss: Loss,
    /// Weights of the residuals.
    pub weights: Weights,
    /// Pictures that were set aside by hand.
    pub excluded: Arc<BTreeSet<FrameId>>,
    /// Corners that were dropped by hand: picture, index on the board.
    pub dropped: Arc<BTreeSet<(FrameId, u32)>>,
    /// How much of the picture a straightened one shows, 0..=1.
    pub alpha: f64,
    /// How a straightened picture is laid out.
    pub projection: Projection,
    /// Its horizontal field of view, degrees, in place of `alpha`.
    pub fov_deg: Option<f64>,
    /// Error above which pictures are named, px.
    pub threshold_px: f64,
    /// How sure the camera shall be, for the advice on what to photograph next.
    pub goal: Goal,
    /// The next picture's.
    pub next_id: u32,
}

impl Default for Document {
    fn default() -> Self {
        Self {
            frames: Arc::default(),
            board: None,
            square: None,
            model: None,
            fixed: Vec::new(),
            loss: Loss::default(),
            weights: Weights::default(),
            excluded: Arc::default(),
            dropped: Arc::default(),
            alpha: 0.5,
            projection: Projection::default(),
            fov_deg: None,
            threshold_px: 1.0,
            goal: Goal::default(),
            next_id: 0,
        }
    }
}

impl Document {
    /// The scene, where all pictures are rendered from one: its truth is known.
    pub fn scene(&self) -> Option<&Arc<Scene>> {
        let Source::View { scene: first, .. } = &self.frames.first()?.source else { return None };
        let same = |f: &Frame| matches!(&f.source, Source::View { scene, .. } if Arc::ptr_eq(scene, first) || scene == first);
        self.frames.iter().all(same).then_some(first)
    }

    /// What straightened pictures are to show.
    pub fn framing(&self) -> Framing {
        Framing { projection: self.projection, alpha: self.alpha, fov_rad: self.fov_deg.map(f64::to_radians) }
    }

    /// How much a straightened picture shows, in words.
    pub fn extent(&self) -> String {
        self.fov_deg.map_or_else(|| format!("α = {:.2}", self.alpha), |fov| format!("{fov:.0}° wide"))
    }

    /// A number that no picture has had.
    pub fn new_id(&mut self) -> FrameId {
        self.next_id += 1;
        FrameId(self.next_id - 1)
    }

    /// Sets pictures aside.
    pub fn set_aside(&mut self, ids: impl IntoIterator<Item = FrameId>) {
        Arc::make_mut(&mut self.excluded).extend(ids);
    }

    /// Sets a picture aside, or uses it again.
    pub fn toggle(&mut self, id: FrameId) {
        let excluded = Arc::make_mut(&mut self.excluded);
        if !excluded.remove(&id) {
            excluded.insert(id);
        }
    }

    /// Drops a corner by hand, or restores it.
    pub fn toggle_corner(&mut self, id: FrameId, index: u32) {
        let dropped = Arc::make_mut(&mut self.dropped);
        if !dropped.remove(&(id, index)) {
            dropped.insert((id, index));
        }
    }

    /// Whether a parameter is held.
    pub fn holds(&self, name: &str) -> bool {
        self.fixed.iter().any(|f| is_held(f, name))
    }

    /// Holds a parameter, or lets it go.
    pub fn hold(&mut self, name: &str, on: bool) {
        if on != self.holds(name) {
            self.fixed.retain(|f| !is_held(f, name));
            if on {
                self.fixed.push(Fix::Hold(name.to_owned()));
            }
        }
    }

    /// The picture with this number.
    pub fn frame(&self, id: FrameId) -> Option<&Frame> {
        // Numbers ascend.
        self.frames.binary_search_by_key(&id, |f| f.id).ok().map(|i| &self.frames[i])
    }
}

fn is_held(fix: &Fix, name: &str) -> bool {
    matches!(fix, Fix::Hold(n) | Fix::Value(n, _) if n == name)
}

/// A calibration with its evidence, and the pictures that its positions stand for.
#[derive(Clone, Debug)]
pub struct Answer {
    /// Hash of what it was made from.
    pub key: Key,
    /// The picture at each position of the report.
    pub ids: Vec<FrameId>,
    /// The evidence.
    pub evidence: Evidence,
    /// Whether all pictures had been looked at.
    pub complete: bool,
    /// Whether it says what each picture does to the camera.
    pub weighed: bool,
    /// Whether it says what may be wrong.
    pub sourced: bool,
}

impl Answer {
    /// The report.
    pub fn report(&self) -> &Report {
        &self.evidence.report
    }

    /// The camera, where there is one.
    pub fn solution(&self) -> Option<&Solution> {
        self.report().solution.as_ref()
    }

    /// The pictures that the calibration uses, in order.
    pub fn used(&self) -> impl Iterator<Item = (FrameId, &FrameReport)> {
        self.ids.iter().copied().zip(&self.report().frames).filter(|(_, frame)| frame.included)
    }

    /// What it says of a picture.
    pub fn frame(&self, id: FrameId) -> Option<&FrameReport> {
        self.position(id).map(|i| &self.report().frames[i])
    }

    /// Position of a picture in the report.
    pub fn position(&self, id: FrameId) -> Option<usize> {
        self.ids.binary_search(&id).ok()
    }
}

/// A computed picture and what it was made from.
#[derive(Clone, Debug)]
pub struct Shown {
    /// What it was made from.
    pub key: Key,
    /// The picture, or why there is none.
    pub raster: Result<Arc<Raster>, Error>,
    /// Where a straightened one is valid.
    pub valid: Option<Rect>,
}

/// What was computed. Old values stay until new ones arrive.
#[derive(Default)]
pub struct Data {
    /// What was seen in each picture.
    pub inspections: BTreeMap<FrameId, Result<Arc<Inspection>, Error>>,
    /// The key of each of these. One without comes from elsewhere and holds.
    pub made_from: BTreeMap<FrameId, Key>,
    /// The calibration that is being made.
    pub asked: Option<Asked>,
    /// The calibration.
    pub answer: Option<Arc<Answer>>,
    /// The one before the last edit, shown as a ghost.
    pub ghost: Option<Arc<Answer>>,
    /// The last answers, so that undo costs nothing and gives the same bits.
    pub kept: Vec<Arc<Answer>>,
    /// Small copies of the pictures; none where one cannot be made.
    pub thumbnails: BTreeMap<FrameId, Option<Arc<Raster>>>,
    /// The selected picture.
    pub look: Option<Shown>,
    /// The selected picture without its lens.
    pub straight: Option<Shown>,
    /// What changes of the method do, by their number in [`crate::job::Job::Ablate`].
    pub effects: BTreeMap<u32, std::result::Result<Numbers, String>>,
    /// The camera models side by side, with what that was made from; or why they are not.
    pub compared: Option<(Key, std::result::Result<Comparison, String>)>,
    /// Whether the earlier calibration that is shown still holds for the pictures, or why that cannot be told.
    pub validity: Option<(Key, std::result::Result<Validity, String>)>,
    /// What to photograph next, with what that was made from.
    pub advice: Option<(Key, Advice)>,
    /// What the twin of a capture says, with what that was made from; or why there is none.
    pub twin: Option<(Key, std::result::Result<Outcome, String>)>,
    /// Share that is done of the job that says so.
    pub progress: Option<(Key, f32)>,
    /// Whether the user stopped the reading of pictures.
    pub stopped: bool,
    /// Wall time from opening to the last answer, ms.
    pub took_ms: Option<f64>,
}

impl Data {
    /// What to photograph next, once all pictures were looked at: with a camera what was computed, without one what always helps.
    pub fn advice(&self, goal: Goal) -> Option<Advice> {
        let answer = self.answer.as_deref().filter(|a| a.complete)?;
        match answer.solution() {
            Some(_) => self.advice.as_ref().map(|(_, advice)| advice.clone()),
            None => Some(Advice::first(goal)),
        }
    }

    /// The answer where it has a camera.
    pub fn solved(&self) -> Option<(&Answer, &Solution)> {
        let answer = self.answer.as_deref()?;
        Some((answer, answer.solution()?))
    }
}

/// Something to tell the user.
#[derive(Clone, Debug, PartialEq)]
pub struct Notice {
    /// In words, with the remedy.
    pub text: String,
    /// Whether something went wrong.
    pub bad: bool,
    /// What can be done about it: the words of a button, and what it does.
    pub offer: Option<(String, Command)>,
}

impl Notice {
    /// Something went wrong.
    pub fn bad(text: impl Into<String>) -> Self {
        Self { text: text.into(), bad: true, offer: None }
    }

    /// Something went well.
    pub fn good(text: impl Into<String>) -> Self {
        Self { text: text.into(), bad: false, offer: None }
    }
}

/// Everything.
#[derive(Default)]
pub struct State {
    /// What the user decided.
    pub doc: Document,
    /// Documents to go back to.
    pub past: Vec<Document>,
    /// Documents to go forward to.
    pub future: Vec<Document>,
    /// What was computed.
    pub data: Data,
    /// What is on the screen.
    pub screen: Screen,
    /// Folders that were opened, the last first.
    pub recent: Vec<PathBuf>,
    /// Counts changes; plans are made when it moves.
    pub revision: u64,
    /// What pictures are made from, as hashes.
    pub(super) prints: RefCell<Prints>,
    /// Counts changes of what a session holds.
    pub(super) content: u64,
}

impl State {
    /// The selected picture, or the first used one where none was chosen.
    pub fn selected(&self) -> Option<FrameId> {
        let chosen = self.screen.selected.filter(|id| self.doc.frame(*id).is_some());
        chosen.or_else(|| {
            let used = self.data.answer.as_deref().and_then(|a| {
                let i = a.report().frames.iter().position(|f| f.included)?;
                a.ids.get(i).copied().filter(|id| self.doc.frame(*id).is_some())
            });
            used.or_else(|| self.doc.frames.first().map(|f| f.id))
        })
    }

    /// Position in the list of corners of the one that is selected, otherwise of the one with the largest error.
    pub fn corner_of(&self, frame: &FrameReport) -> Option<usize> {
        let chosen = self.screen.corner;
        if let Some(i) = chosen.and_then(|index| frame.corners.iter().position(|c| c.index == index)) {
            return Some(i);
        }
        let worst = frame.errors_px().enumerate().max_by(|a, b| a.1.total_cmp(&b.1)).map(|(i, _)| i);
        worst.or_else(|| (!frame.corners.is_empty()).then_some(0))
    }

    /// How much longer residuals are drawn: as chosen, or so that large ones reach a fair part of a square.
    pub fn times(&self) -> f64 {
        let fitting = || {
            let (_, solution) = self.data.solved()?;
            let room = f64::from(solution.camera.size_px[0].min(solution.camera.size_px[1])) / 14.0;
            TIMES.into_iter().rev().find(|times| times * solution.stats.p95 <= room)
        };
        self.screen.times.or_else(fitting).unwrap_or(TIMES[0])
    }

    /// Whether a picture takes part as far as the user decides.
    pub fn is_excluded(&self, id: FrameId) -> bool {
        self.doc.excluded.contains(&id)
    }

    /// Pictures that have not been looked at yet.
    pub fn waiting(&self) -> usize {
        self.inspected().iter().filter(|(.., fresh)| !fresh).count()
    }

    /// Moves where what a session holds has changed.
    pub fn content(&self) -> u64 {
        self.content
    }

    /// The name of a picture without its extension.
    pub fn name(&self, id: FrameId) -> String {
        let name = self.doc.frame(id).map(|f| f.source.name()).unwrap_or_default();
        short_name(&name).to_owned()
    }
}

/// A file name without folders and extension.
pub fn short_name(path: &str) -> &str {
    let name = path.rsplit(['/', '\\']).next().unwrap_or(path);
    name.rsplit_once('.').map_or(name, |(stem, _)| if stem.is_empty() { name } else { stem })
}
