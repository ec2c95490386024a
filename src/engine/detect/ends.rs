//! Where the board ends: beyond its last corners there is one more row of squares, and then none.

use super::{
    complete::{Fitted, level_at},
    sheet::{Cell, add, guess, is_black},
};
use crate::image::{Plane, Sample};

/// Where, in squares beyond the last corners, the last squares are looked at, and what lies behind them: something that lies over
/// the board seldom has its edge just between the inner two in every row.
const INSIDE: [f64; 3] = [0.3, 0.6, 0.82];
const BEHIND: [f64; 2] = [1.18, 1.4];
/// Share of the contrast with which squares alternate, at least where there are some, at most where there are none.
const ALTERNATE: [f64; 2] = [0.6, 0.5];

/// Whether the board ends beyond the first column, last column, first row, last row; not where `goes_on` says that it does not.
pub(super) fn ends<T: Sample>(picture: &Plane<T>, fitted: &Fitted, goes_on: [bool; 4]) -> [bool; 4] {
    let Some(bounds) = fitted.bounds() else { return [false; 4] };
    [0, 1, 2, 3].map(|side| {
        let (k, outward) = (side / 2, if side % 2 == 0 { -1 } else { 1 });
        let last = bounds[k][side % 2];
        let alternate = |at: f64| alternation(picture, fitted, (k, last, outward), at);
        !goes_on[side]
            && INSIDE.iter().all(|at| alternate(*at).is_some_and(|s| s >= ALTERNATE[0]))
            && BEHIND.iter().all(|at| alternate(*at).is_some_and(|s| s.abs() <= ALTERNATE[1]))
    })
}

/// How strongly squares alternate along a line `at` cells outward of the line `last` of axis `k`: 1 as on the board, 0 not at all.
/// `None` where less than three squares are in the picture.
fn alternation<T: Sample>(
    picture: &Plane<T>,
    fitted: &Fitted,
    (k, last, outward): (usize, i32, i32),
    at: f64,
) -> Option<f64> {
    let across = |cell: Cell| if k == 0 { add(cell, [0, 1]) } else { add(cell, [1, 0]) };
    let mut samples = Vec::new();
    for (cell, f) in fitted.iter().filter(|(cell, _)| cell[k] == last) {
        let Some(next) = fitted.get(across(cell)) else { continue };
        let Some(g) = guess(fitted, cell, |f| f.px) else { continue };
        let out = g.uv[k] * f64::from(outward);
        let Some(level) = level_at(picture, 0.5 * (f.px + next.px) + out * at) else { continue };
        let contrast = 0.5 * (f.amplitude.abs() + next.amplitude.abs());
        let bright = (level - 0.5 * (f.mean + next.mean)) / contrast;
        // The square between a cell and the next ones is black where the sum of its column and row has the right parity.
        let square = if outward > 0 {
            cell
        } else if k == 0 {
            add(cell, [-1, 0])
        } else {
            add(cell, [0, -1])
        };
        let dark = is_black(square) == (at < 1.0);
        samples.push((if dark { -1.0 } else { 1.0 }, bright.clamp(-1.5, 1.5)));
    }
    if samples.len() < 3 {
        return None;
    }
    let n = samples.len() as f64;
    let (me, mb) = samples.iter().fold((0.0, 0.0), |(e, b), s| (e + s.0 / n, b + s.1 / n));
    let (cov, var) = samples
        .iter()
        .fold((0.0, 0.0), |(c, v), s| (c + (s.0 - me) * (s.1 - mb), v + (s.0 - me) * (s.0 - me)));
    (var > 0.0).then(|| cov / var)
}
