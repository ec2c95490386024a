//! The table of pictures.

use super::table::{Table, tail};
use crate::calib::{
    number::{degrees, significant},
    report::{FrameReport, Report},
};

/// Up to this many pictures are listed; of more, the unused and the worst.
const LISTED: usize = 60;
/// The worst pictures of a long list.
const WORST: usize = 20;
/// Room for a name.
const NAME: usize = 30;

/// `1 picture`, `13 pictures`.
pub(super) fn count(n: usize) -> String {
    if n == 1 { "1 picture".to_owned() } else { format!("{n} pictures") }
}

/// One line a picture: state, corners, error, how the board stood, and why it was not used.
pub(super) fn table(report: &Report) -> String {
    if report.frames.is_empty() {
        return String::new();
    }
    let unit = report.settings.unit.name();
    let mut table = Table::new("llrrrrrrl");
    let solved = report.solution.is_some();
    if solved {
        table.row([
            "picture",
            "board",
            "corners",
            "rms px",
            "max px",
            "tilt °",
            "roll °",
            &format!("dist. {unit}"),
            "",
        ]);
    } else {
        table.row(["picture", "board", "corners"]);
    }
    let (listed, left_out) = listed(report);
    for frame in listed {
        let name = tail(frame.name(), NAME);
        let corners = match (frame.corners.len(), frame.outliers.len()) {
            (0, _) => String::new(),
            (n, 0) => n.to_string(),
            (n, bad) => format!("{n} -{bad}"),
        };
        let mut row = vec![name, frame.state.name().to_owned(), corners];
        let shown = |v: Option<f64>, how: &dyn Fn(f64) -> String| v.map_or(String::new(), how);
        if solved {
            row.push(shown(frame.rms_px, &|v| significant(v, 3)));
            row.push(shown(frame.max_px, &|v| significant(v, 3)));
            row.push(shown(frame.tilt_rad, &degrees));
            row.push(shown(frame.roll_rad, &degrees));
            row.push(shown(frame.distance, &|v| significant(v, 4)));
        } else {
            row.extend(std::iter::repeat_n(String::new(), 5));
        }
        row.push(frame.why.clone());
        table.row(row);
    }
    let more = if left_out == 0 {
        String::new()
    } else {
        format!("  … and {} with smaller errors (--json lists all)\n", count(left_out))
    };
    format!("\n{}{more}", table.render())
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
