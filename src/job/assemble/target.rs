//! Boards other than checkerboards: which one a set shows, and what a picture shows of it.

use super::{Entry, Seen};
use crate::calib::{
    Result,
    board::Design,
    circles::{self, bias::radius_of},
    marker::{
        Sighting,
        board::{Located, MarkerBoard},
        guess::guess,
    },
    report::{FrameReport, FrameState},
    solution::Warning,
    target::{Length, Target, Unit},
};

/// The board of a set, where it is no checkerboard: of markers, or of circles, whichever more pictures show than a checkerboard.
pub(super) fn of(entries: &[&Entry], scale: f64, warnings: &mut Vec<Warning>) -> Option<Target> {
    let seen = || entries.iter().filter_map(|e| e.seen.as_ref().ok());
    let sightings: Vec<Sighting> = seen().filter_map(|s| s.other.markers.clone()).collect();
    let plain = entries
        .iter()
        .filter(|e| e.grid().is_some() && e.seen.as_ref().is_ok_and(|s| s.other.is_none()))
        .count();
    if sightings.len() > plain {
        // Of a mirrored print each picture says so once the board is known that it mirrors.
        let mirrored = || sightings.iter().cloned().map(Sighting::mirrored).collect::<Vec<_>>();
        let own = Some(guess(&sightings)).filter(|g| g.board.is_some());
        let guess = own.unwrap_or_else(|| guess(&mirrored()));
        if let Some(board) = guess.board {
            if !guess.certain {
                let says = format!("{board} is the likeliest board; {}", guess.considered.join("; "));
                warnings.push(Warning::new("board_is_a_guess", says));
            }
            return Some(Target::Markers { board, scale });
        }
    }
    let grids: Vec<&circles::Grid> = seen().filter_map(|s| s.other.circles.as_ref()).collect();
    if grids.len() <= plain {
        return None;
    }
    let choice = circles::board_of(&grids)?;
    if !choice.doubts.is_empty() {
        warnings.push(Warning::new("board_size", choice.doubts));
    }
    let radius = radius_of(&grids, choice.board)? * scale;
    Some(Target::Circles { board: choice.board, spacing: scale, radius })
}

/// Shares that were given and measured are told apart from here on.
const OFF: f64 = 0.06;

/// The board as it was given; what was left open is taken from the pictures, and what they contradict is told.
///
/// # Errors
/// Those of [`Design::target`].
pub(super) fn given(
    design: &Design,
    entries: &[&Entry],
    scale: f64,
    warnings: &mut Vec<Warning>,
) -> Result<Target> {
    let edge = Length { value: 1.0, unit: Unit::Squares };
    let seen = || entries.iter().filter_map(|e| e.seen.as_ref().ok());
    let mut board = *design;
    if design.kind.has_markers() {
        let sightings: Vec<Sighting> = seen().filter_map(|s| s.other.markers.clone()).collect();
        let guess = guess(&sightings);
        let shown = guess.board.and_then(|board| Design::of(&Target::Markers { board, scale }));
        if let Some(shown) = shown {
            let against = contradicted(design, &shown, guess.certain);
            warnings.extend(against.into_iter().map(|text| Warning::new("board_contradicted", text)));
            board.dictionary = design.dictionary.or(shown.dictionary);
            board.inner = design.inner.or(shown.inner.filter(|_| shown.kind == design.kind));
        }
    }
    let target = board.target(edge, scale)?;
    let (Target::Circles { board, spacing, .. }, None) = (&target, design.inner) else { return Ok(target) };
    let grids: Vec<&circles::Grid> = seen().filter_map(|s| s.other.circles.as_ref()).collect();
    match radius_of(&grids, *board) {
        Some(radius) => Ok(Target::Circles { board: *board, spacing: *spacing, radius: radius * scale }),
        None => Ok(target),
    }
}

/// What the pictures say against a board that was given.
fn contradicted(given: &Design, shown: &Design, certain: bool) -> Vec<String> {
    let mut list = Vec::new();
    if let (Some(given), Some(shown)) = (given.dictionary, shown.dictionary)
        && !given.is_kin_of(shown)
    {
        list.push(format!(
            "the pictures show markers of {shown}, not of {given}: say so, or leave the dictionary to the pictures"
        ));
    }
    if certain && (given.kind, given.size) != (shown.kind, shown.size) {
        list.push(format!("the pictures show {}, not {}: check the board", shown.words(), given.words()));
    } else if let (Some(said), Some(share)) = (given.inner, shown.inner)
        && given.kind == shown.kind
        && (said - share).abs() > OFF
    {
        list.push(format!(
            "{} measures {share:.2} of the {} in the pictures, not {said:.2} as given: measure the board with a ruler",
            given.kind.inner_title().unwrap_or_default(),
            given.kind.length().to_lowercase(),
        ));
    }
    list
}

/// What a picture shows of such a board.
pub(super) fn frame(mut frame: FrameReport, seen: &Seen, target: &Target) -> FrameReport {
    match target {
        Target::Markers { board, .. } => match &seen.other.markers {
            Some(sighting) => markers(&mut frame, board, sighting),
            None => frame.why = format!("no {board}: no two markers were found in the picture"),
        },
        Target::Circles { board, .. } => match &seen.other.circles {
            Some(grid) => circles(&mut frame, *board, grid),
            None => frame.why = format!("no circle grid {board} was found in the picture"),
        },
        Target::Points { .. } => {
            let why = "known points are not looked for in pictures: say where they are with --corners";
            why.clone_into(&mut frame.why);
        }
        Target::Checkerboard { .. } => {}
    }
    if !frame.corners.is_empty() {
        let full = frame.corners.len() == target.len();
        frame.state = if full { FrameState::Full } else { FrameState::Partial };
    }
    frame.found = frame.state.found();
    frame
}

fn markers(frame: &mut FrameReport, board: &MarkerBoard, sighting: &Sighting) {
    let Located { corners, why, notes, .. } = board.locate(sighting);
    (frame.corners, frame.why) = (corners, why);
    frame.notes.extend(notes);
}

fn circles(frame: &mut FrameReport, board: circles::CircleBoard, grid: &circles::Grid) {
    match grid.assign(board) {
        Err(why) => frame.why = why,
        Ok(assigned) => {
            frame.order_is_a_choice = assigned.order_is_a_choice;
            frame.corners = assigned.corners;
        }
    }
}
