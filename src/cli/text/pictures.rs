//! The table of pictures.

use super::table::{Table, tail};
use crate::calib::{
    influence::Role,
    number::{counted, degrees, significant},
    report::{FrameReport, Report},
};

/// Up to this many pictures are listed; of more, the unused and the worst.
const LISTED: usize = 60;
/// The worst pictures of a long list.
const WORST: usize = 20;
/// Room for a name.
const NAME: usize = 30;

/// One line a picture: state, corners, error, how the board stood, and why it was not used.
pub(super) fn table(report: &Report) -> String {
    if report.frames.is_empty() {
        return String::new();
    }
    let unit = report.settings.unit.name();
    let mut table = Table::new("llrrrrrrrrl");
    let distance = format!("away {unit}");
    let head = [
        "picture", "board", "corners", "outliers", "rms px", "max px", "tilt °", "roll °", &distance,
        "moves px", "",
    ];
    let solved = report.solution.is_some();
    let asked = report.frames.iter().any(|f| f.influence.is_some());
    let any_outlier = report.frames.iter().any(|f| !f.outliers.is_empty());
    table.row(
        head.iter()
            .take(if solved { head.len() - if asked { 0 } else { 2 } } else { 3 })
            .map(|name| if *name == "outliers" && !any_outlier { "" } else { *name }),
    );
    let (listed, left_out) = listed(report);
    let some = |n: usize| if n == 0 { String::new() } else { n.to_string() };
    for frame in listed {
        let start = [tail(frame.name(), NAME), frame.state.name().to_owned(), some(frame.corners.len())];
        let Some(numbers) = numbers(frame) else {
            table.note(start, &frame.why);
            continue;
        };
        // Without such a picture the others do not determine the camera: nobody can say where it would go.
        let alone = || (asked && frame.included).then(|| [String::new(), Role::Precious.name().to_owned()]);
        let influence = frame.influence.map(|i| [significant(i.moves_px, 2), word(i.role).to_owned()]);
        let influence = influence.or_else(alone);
        let outliers = [some(frame.outliers.len())];
        table.row(start.into_iter().chain(outliers).chain(numbers).chain(influence.into_iter().flatten()));
    }
    let more = if left_out == 0 {
        String::new()
    } else {
        format!("  … and {} with smaller errors (--json lists all)\n", counted(left_out, "picture"))
    };
    format!("\n{}{more}", table.render())
}

/// What is worth a word.
const fn word(role: Role) -> &'static str {
    match role {
        Role::Fine => "",
        other => other.name(),
    }
}

/// What the calibration says of a picture.
fn numbers(frame: &FrameReport) -> Option<[String; 5]> {
    Some([
        significant(frame.rms_px?, 3),
        significant(frame.max_px?, 3),
        degrees(frame.tilt_rad?),
        degrees(frame.roll_rad?),
        significant(frame.distance?, 4),
    ])
}

/// What is listed, in the order of the pictures, and how many are left out.
fn listed(report: &Report) -> (Vec<&FrameReport>, usize) {
    let all: Vec<&FrameReport> = report.frames.iter().collect();
    if all.len() <= LISTED {
        return (all, 0);
    }
    let mut errors: Vec<f64> = all.iter().filter_map(|f| f.rms_px).collect();
    errors.sort_by(|a, b| b.total_cmp(a));
    let least = errors.get(WORST - 1).copied().unwrap_or(0.0);
    let kept: Vec<_> = all.iter().copied().filter(|f| f.rms_px.is_none_or(|e| e >= least)).collect();
    let left_out = all.len() - kept.len();
    (kept, left_out)
}
