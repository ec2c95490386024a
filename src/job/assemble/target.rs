//! Boards other than checkerboards: which one a set shows, and what a picture shows of it.

use super::{Entry, Finding, begun, given};
use crate::calib::{
    circles::{self, bias::radius_of},
    marker::{
        Sighting,
        board::{Located, MarkerBoard},
        guess::guess,
    },
    report::{FrameReport, FrameState},
    solution::Warning,
    target::Target,
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
        let guess = guess(&sightings);
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

/// What a picture shows of such a board.
pub fn frame(entry: &Entry, target: &Target) -> FrameReport {
    let (mut frame, seen) = begun(entry);
    let Some(seen) = seen else { return frame };
    match target {
        Target::Markers { board, .. } => match &seen.other.markers {
            Some(sighting) => markers(&mut frame, board, sighting),
            None => frame.why = format!("no {board}: no two markers were found in the picture"),
        },
        Target::Circles { board, .. } => match &seen.other.circles {
            Some(grid) => circles(&mut frame, *board, grid),
            None => frame.why = format!("no circle grid {board} was found in the picture"),
        },
        Target::Points { .. } => match &seen.finding {
            Finding::Corners { corners, why } => given(&mut frame, corners, why, Some(target.len())),
            Finding::Grid(_) => {
                let why = "known points are not looked for in pictures: say where they are with --corners";
                why.clone_into(&mut frame.why);
            }
        },
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
