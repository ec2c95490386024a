//! What the user should know about a set of pictures.

use std::collections::BTreeMap;

use crate::calib::{
    board::{Design, Kind},
    detect::{Grid, board_of},
    number::counted,
    order,
    report::{FrameReport, FrameState, GroupReport},
    solution::Warning,
};

/// Warnings about a set; `used` are the frames that are calibrated.
pub(super) fn warnings(frames: &[FrameReport], groups: &[GroupReport], used: &[usize]) -> Vec<Warning> {
    let mut list = Vec::new();
    let mut about = |code: &str, text: String, frames: Vec<&FrameReport>| {
        if !frames.is_empty() {
            list.push(Warning::new(code, text).about(frames.into_iter().map(|f| f.file.clone())));
        }
    };
    let unreadable = of(frames, |f| f.state == FrameState::Unreadable);
    let n = unreadable.len();
    about(
        "unreadable",
        format!("{} could not be read and {} left out", counted(n, "picture"), was(n)),
        unreadable,
    );
    let mut notes: BTreeMap<&str, Vec<&FrameReport>> = BTreeMap::new();
    for frame in frames {
        for note in &frame.notes {
            notes.entry(note).or_default().push(frame);
        }
    }
    for (note, frames) in notes {
        about("picture", note.to_owned(), frames);
    }
    let copies = of(frames, |f| f.copy_of.is_some());
    let n = copies.len();
    about(
        "copies",
        format!("{} {} a copy of another one: counted once", counted(n, "picture"), is(n)),
        copies,
    );
    for group in groups.iter().skip(1).filter(|g| g.found > 0) {
        let others = of(frames, |f| f.group == group.name && f.found && f.copy_of.is_none());
        let n = others.len();
        about(
            "other_camera",
            format!(
                "{} \"{}\" {} not calibrated ({}): one camera at a time, give {} alone for another calibration",
                counted(n, "picture"),
                group.name,
                is(n),
                group.reason,
                if n == 1 { "it" } else { "them" }
            ),
            others,
        );
    }
    let chosen: Vec<_> = used.iter().map(|i| &frames[*i]).filter(|f| f.order_is_a_choice).collect();
    about(
        "order_is_a_choice",
        "the board looks the same when it is turned, so corner 0 is the one nearest to the top left of the picture: the camera is \
         not affected, the poses are; a board whose columns + rows is odd has one order only"
            .to_owned(),
        chosen,
    );
    list
}

fn of(frames: &[FrameReport], wanted: impl Fn(&FrameReport) -> bool) -> Vec<&FrameReport> {
    frames.iter().filter(|f| wanted(f)).collect()
}

const fn is(n: usize) -> &'static str {
    if n == 1 { "is" } else { "are" }
}

const fn was(n: usize) -> &'static str {
    if n == 1 { "was" } else { "were" }
}

/// Why no picture can be used, and what to do: one sentence.
pub(super) fn no_board(frames: &[FrameReport], asked: Option<&Design>, grids: &[&Grid]) -> String {
    if frames.is_empty() {
        return "no pictures: give photographs of a checkerboard, or the folder that holds them".to_owned();
    }
    if frames.iter().all(|f| f.state == FrameState::Unreadable) {
        let why = frames[0].why.as_str();
        return match frames {
            [one] => format!("{}: {why}", one.file),
            _ => format!("none of the {} pictures could be read ({}: {why})", frames.len(), frames[0].name()),
        };
    }
    // What each reason advises comes once, at the end.
    let short = |why: &'_ str| why.split(": ").next().unwrap_or_default().to_owned();
    let mut reasons: BTreeMap<String, usize> = BTreeMap::new();
    for frame in frames {
        *reasons.entry(short(&frame.why)).or_default() += 1;
    }
    let mut reasons: Vec<_> = reasons.into_iter().collect();
    order::by(&mut reasons, |r| [-(r.1 as f64)]);
    let told: Vec<String> = reasons
        .into_iter()
        .take(2)
        .map(|(why, n)| match n {
            _ if frames.len() == 1 => why,
            n if n == frames.len() => format!("{why} in all of them"),
            n => format!("{why} in {n} of {}", frames.len()),
        })
        .collect();
    let what = asked.map_or("a checkerboard".to_owned(), |design| design.words());
    let remedy = match (asked, board_of(grids)) {
        (Some(asked), Some(seen))
            if asked.kind == Kind::Checkerboard && *asked != Design::checkerboard(seen.size) =>
        {
            format!("try --board {} (inner corners, columns x rows) or --board auto", seen.size)
        }
        (Some(asked), _) if asked.kind != Kind::Checkerboard => {
            "check --board, light and sharpness, or try --board auto".to_owned()
        }
        (Some(_), _) => {
            "check --board (inner corners, columns x rows), light and sharpness, or try --board auto"
                .to_owned()
        }
        _ => "photograph a checkerboard, sharp, evenly lit and large in the picture".to_owned(),
    };
    let none = if frames.len() == 1 { "the picture does not show" } else { "no picture shows" };
    format!("{none} {what} that can be used: {}; {remedy}", told.join(", "))
}
