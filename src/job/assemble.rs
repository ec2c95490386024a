//! From what was seen in the pictures to a problem that can be solved: pure and cheap.
//!
//! 1. Copies (same pixels, or the very same corners) count once.
//! 2. Pictures are grouped by camera; the group with the most boards is the one to calibrate, the rest is named.
//! 3. The size of the board is the given one, or the one that the group shows.
//! 4. Corners get their indices; a picture whose board has another size or whose corners are not certain says why.

mod advice;
mod target;

use serde::{Deserialize, Serialize};

use super::{
    Inspection, Other,
    group::{self, Candidate},
    photo::Exif,
};
use crate::calib::{
    Error, Result,
    board::Design,
    calibrate::{CameraSetup, Options, Problem},
    camera::{Camera, Model},
    detect::{self, Detection, Grid},
    observation::{Corner, FrameId, Observation},
    report::{FrameReport, FrameState, GroupReport},
    solution::Warning,
    target::Target,
};

/// A picture and what was seen in it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Entry {
    /// Its path, as given or found.
    pub file: String,
    /// What was seen, or why it could not be read.
    pub seen: std::result::Result<Seen, String>,
}

/// What was seen in a picture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Seen {
    /// `[width, height]` of the stored pixels.
    pub size_px: [u32; 2],
    /// What the file says about its camera.
    pub exif: Exif,
    /// Equal for copies of one picture.
    pub pixels_hash: Option<u128>,
    /// What reading it told.
    pub notes: Vec<String>,
    /// The board.
    pub finding: Finding,
    /// Markers and circles.
    #[serde(default, skip_serializing_if = "Other::is_none")]
    pub other: Other,
}

/// A board, with or without indices.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Finding {
    /// A grid of unknown size, from a picture.
    Grid(Detection),
    /// Corners that have their indices already, from a corner file; ascending.
    Corners {
        /// The corners.
        corners: Vec<Corner>,
        /// Why there are none or not all.
        why: String,
    },
}

impl Entry {
    /// A picture that was inspected.
    pub fn inspected(file: String, inspection: Result<Inspection>) -> Self {
        let seen = inspection.map(|i| Seen {
            size_px: i.size_px,
            exif: i.exif,
            pixels_hash: Some(i.pixels_hash),
            notes: i.notes,
            finding: Finding::Grid(i.detection),
            other: i.other,
        });
        // The file is named beside the reason.
        let why = |error| match error {
            Error::Picture { message, .. } | Error::File { message, .. } => message,
            other => other.to_string(),
        };
        Self { file, seen: seen.map_err(why) }
    }

    fn finding(&self) -> Option<&Finding> {
        self.seen.as_ref().ok().map(|s| &s.finding)
    }

    /// The grid of corners, where a picture shows one.
    pub fn grid(&self) -> Option<&Grid> {
        match self.finding()? {
            Finding::Grid(detection) => detection.grid.as_ref(),
            Finding::Corners { .. } => None,
        }
    }

    fn has_board(&self) -> bool {
        match self.finding() {
            Some(Finding::Corners { corners, .. }) => !corners.is_empty(),
            _ => self.grid().is_some() || self.seen.as_ref().is_ok_and(|s| !s.other.is_none()),
        }
    }
}

/// What is wanted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Wanted {
    /// The board; `None` finds it from the pictures.
    pub board: Option<Design>,
    /// What was photographed, where it is no board to be found.
    pub target: Option<Target>,
    /// Edge of a square, in any unit.
    pub square: f64,
    /// Model to fit.
    pub model: Model,
    /// Camera to start from.
    pub start: Option<Camera>,
    /// How to calibrate.
    pub options: Options,
}

/// A set of pictures, sorted out.
#[derive(Clone, Debug, PartialEq)]
pub struct Assembly {
    /// The board, where it is known.
    pub target: Option<Target>,
    /// One for each entry, in order; nothing is included yet.
    pub frames: Vec<FrameReport>,
    /// Cameras, the one to calibrate first.
    pub groups: Vec<GroupReport>,
    /// What the user should know.
    pub warnings: Vec<Warning>,
    /// What to solve; [`FrameId`] is the position in `frames`. Or why there is nothing.
    pub problem: Result<Problem>,
}

/// Sorts out what was seen.
pub fn assemble(entries: &[Entry], wanted: &Wanted) -> Assembly {
    let copies = copies(entries);
    let readable: Vec<usize> = (0..entries.len()).filter(|i| entries[*i].seen.is_ok()).collect();
    let candidates: Vec<Candidate<'_>> = readable
        .iter()
        .filter_map(|&i| {
            let seen = entries[i].seen.as_ref().ok()?;
            let counts = entries[i].has_board() && copies[i].is_none();
            Some(Candidate { name: &entries[i].file, size_px: seen.size_px, exif: &seen.exif, counts })
        })
        .collect();
    let groups = group::by_camera(&candidates);
    let members = |k: usize| groups.get(k).into_iter().flat_map(|g| &g.members).map(|m| readable[*m]);

    let mut warnings = Vec::new();
    let first_group: Vec<&Entry> = members(0).filter(|i| copies[*i].is_none()).map(|i| &entries[i]).collect();
    let found = match &wanted.target {
        Some(target) => Ok(Some(target.clone())),
        None => target_of(&first_group, wanted.board.as_ref(), wanted.square, &mut warnings),
    };
    let (target, why) = match found {
        Ok(target) => (target, None),
        Err(error) => (None, Some(error)),
    };
    let dots = dots_of(&first_group, target.as_ref());
    let mut frames: Vec<FrameReport> = entries.iter().map(|e| frame(e, target.as_ref(), &dots)).collect();
    for (k, group) in groups.iter().enumerate() {
        for i in members(k) {
            frames[i].group.clone_from(&group.name);
            if k > 0 && frames[i].found {
                frames[i].why = format!("not calibrated: {}", group.reason);
            }
        }
    }
    for (i, first) in copies.iter().enumerate() {
        if let Some(first) = first {
            frames[i].copy_of = Some(entries[*first].file.clone());
            frames[i].why = format!("a copy of {}", frames[*first].name());
        }
    }
    let used: Vec<usize> = members(0).filter(|i| frames[*i].found && copies[*i].is_none()).collect();
    let groups: Vec<GroupReport> = groups
        .iter()
        .enumerate()
        .map(|(k, g)| GroupReport {
            name: g.name.clone(),
            reason: g.reason.clone(),
            images: g.members.len(),
            found: members(k).filter(|i| frames[*i].found).count(),
            make: g.make.clone(),
            model: g.model.clone(),
        })
        .collect();
    warnings.extend(advice::warnings(&frames, &groups, &used));
    let problem = match why {
        Some(error) => Err(error),
        None => problem(entries, &frames, &used, target.as_ref(), wanted),
    };
    Assembly { target, frames, groups, warnings, problem }
}

/// The board of a set: the given one, or the one that the pictures show; `None` where they do not tell.
///
/// # Errors
/// [`Error::Invalid`] where the given one cannot be.
pub fn target_of(
    entries: &[&Entry],
    given: Option<&Design>,
    square: f64,
    warnings: &mut Vec<Warning>,
) -> Result<Option<Target>> {
    if let Some(design) = given {
        return target::given(design, entries, square, warnings).map(Some);
    }
    if let Some(other) = target::of(entries, square, warnings) {
        return Ok(Some(other));
    }
    let grids: Vec<&Grid> = entries.iter().filter_map(|e| e.grid()).collect();
    let Some(choice) = detect::board_of(&grids) else { return Ok(None) };
    if !choice.doubts.is_empty() {
        warnings.push(Warning::new("board_size", choice.doubts));
    }
    Ok(Some(Target::checkerboard(choice.size, square)))
}

/// Squares of a checkerboard that bear a dot, as the pictures show them.
pub fn dots_of(entries: &[&Entry], target: Option<&Target>) -> Vec<[u32; 2]> {
    let Some(Target::Checkerboard { size, .. }) = target else { return Vec::new() };
    let grids: Vec<&Grid> = entries.iter().filter_map(|e| e.grid()).collect();
    detect::dots_of(&grids, *size)
}

/// For each entry an earlier one with the same pixels or the very same corners.
fn copies(entries: &[Entry]) -> Vec<Option<usize>> {
    let hashes: Vec<_> = entries.iter().map(|e| e.seen.as_ref().ok().and_then(|s| s.pixels_hash)).collect();
    let mut copies = group::duplicates(&hashes);
    let given = |i: usize| match entries[i].finding() {
        Some(Finding::Corners { corners, .. }) if !corners.is_empty() => Some(corners),
        _ => None,
    };
    for i in 0..entries.len() {
        if let Some(corners) = given(i) {
            copies[i] = (0..i).find(|j| given(*j).is_some_and(|c| c == corners));
        }
    }
    copies
}

/// Of a picture with two boards.
const PASSED_OVER: &str = "a second checkerboard was passed over: the one with more corners was taken";

/// What a picture shows of this board, of which these squares bear a dot ([`detect::dots_of`]).
pub fn frame(entry: &Entry, target: Option<&Target>, dots: &[[u32; 2]]) -> FrameReport {
    let (mut frame, seen) = begun(entry);
    let Some(seen) = seen else { return frame };
    let size = match target {
        None => None,
        Some(Target::Checkerboard { size, .. }) => Some(*size),
        Some(_) if matches!(seen.finding, Finding::Corners { .. }) => None,
        Some(other) => return target::frame(frame, seen, other),
    };
    match (&seen.finding, size) {
        (Finding::Corners { corners, why }, _) => given(&mut frame, corners, why, target.map(Target::len)),
        (Finding::Grid(Detection { grid: None, why, .. }), _) => frame.why.clone_from(why),
        (Finding::Grid(Detection { grid: Some(_), .. }), None) => {
            frame.why = "corners were found, but not the size of the board: give --board".to_owned();
        }
        (Finding::Grid(Detection { grid: Some(grid), passed_over, light, .. }), Some(size)) => {
            match grid.assign(size, dots) {
                Err(why) => frame.why = why,
                Ok(assigned) => {
                    if *passed_over {
                        frame.notes.push(PASSED_OVER.to_owned());
                    }
                    frame.state = if assigned.full { FrameState::Full } else { FrameState::Partial };
                    frame.order_is_a_choice = assigned.order_is_a_choice;
                    frame.corners = assigned.corners;
                    frame.light = *light;
                }
            }
        }
    }
    frame.found = frame.state.found();
    frame
}

/// Corners that have their indices already, of so many.
fn given(frame: &mut FrameReport, corners: &[Corner], why: &str, of: Option<usize>) {
    frame.corners = corners.to_vec();
    why.clone_into(&mut frame.why);
    if !corners.is_empty() {
        let full = of == Some(corners.len());
        frame.state = if full { FrameState::Full } else { FrameState::Partial };
    }
}

/// What is said of a picture whatever its board, and what was seen in it; none where it could not be read.
fn begun(entry: &Entry) -> (FrameReport, Option<&Seen>) {
    let mut frame = FrameReport::new(entry.file.clone());
    match &entry.seen {
        Ok(seen) => {
            frame.image_size_px = Some(seen.size_px);
            frame.notes.clone_from(&seen.notes);
            frame.taken.clone_from(&seen.exif.time);
            (frame, Some(seen))
        }
        Err(why) => {
            frame.state = FrameState::Unreadable;
            frame.why.clone_from(why);
            (frame, None)
        }
    }
}

/// The problem of the first group.
fn problem(
    entries: &[Entry],
    frames: &[FrameReport],
    used: &[usize],
    target: Option<&Target>,
    wanted: &Wanted,
) -> Result<Problem> {
    if target.is_none() && !used.is_empty() {
        return Err(Error::Invalid(
            "the size of the board is not known: give it, for example --board 9x6".to_owned(),
        ));
    }
    let (Some(target), Some(&first)) = (target.cloned(), used.first()) else {
        let grids: Vec<&Grid> = entries.iter().filter_map(Entry::grid).collect();
        return Err(Error::NoBoard(advice::no_board(frames, wanted.board.as_ref(), &grids)));
    };
    let seen = |i: usize| entries[i].seen.as_ref().ok();
    let mut hints: Vec<f64> = used
        .iter()
        .filter_map(|&i| {
            let [w, h] = seen(i)?.size_px;
            seen(i)?.exif.focal_hint_px(w, h)
        })
        .collect();
    hints.sort_by(f64::total_cmp);
    let setup = CameraSetup {
        size_px: seen(first).map_or([0; 2], |s| s.size_px),
        model: wanted.model,
        start: wanted.start.clone(),
        focal_hint_px: hints.get(hints.len() / 2).copied(),
    };
    let observation =
        |&i: &usize| Observation { camera: 0, frame: FrameId(i as u32), corners: frames[i].corners.clone() };
    Ok(Problem {
        cameras: vec![setup],
        target,
        observations: used.iter().map(observation).collect(),
        options: wanted.options.clone(),
    })
}

#[cfg(test)]
mod tests;
