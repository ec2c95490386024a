//! What the rules look at, gathered once.

use nalgebra::Vector2;

use crate::calib::{
    report::{FrameReport, Report, Solution},
    stats::{
        regions::{self, Region},
        spatial::{Moran, Pairs, Placed, moran},
    },
    uncertainty::Uncertainty,
};

/// Most residuals that are looked at for patterns: more say nothing new and cost time.
const MOST: usize = 1200;
/// Shuffles of the test for patterns.
const PERMUTATIONS: usize = 199;

/// Everything that the rules need.
pub(super) struct Facts<'a> {
    pub(super) report: &'a Report,
    pub(super) solution: Option<&'a Solution>,
    /// Used pictures with their positions.
    pub(super) used: Vec<(usize, &'a FrameReport)>,
    /// Parts of the picture without a corner.
    pub(super) empty: Vec<Region>,
    /// Whether residuals agree between pictures at one place.
    pub(super) between: Option<Moran>,
    /// Whether neighbouring corners of a picture err alike.
    pub(super) within: Option<Moran>,
}

impl<'a> Facts<'a> {
    pub(super) fn of(report: &'a Report) -> Self {
        let solution = report.solution.as_ref();
        let used: Vec<(usize, &FrameReport)> =
            report.frames.iter().enumerate().filter(|(_, f)| f.included).collect();
        let points: Vec<Vector2<f64>> =
            used.iter().flat_map(|(_, f)| f.corners.iter().map(|c| c.px)).collect();
        let empty = solution.map(|s| regions::empty(&points, s.camera.size_px)).unwrap_or_default();
        let (field, radius) = field(&used, solution);
        let pattern = |pairs| moran(&field, pairs, radius, PERMUTATIONS, 1);
        Self {
            report,
            solution,
            used,
            empty,
            between: pattern(Pairs::BetweenViews),
            within: pattern(Pairs::WithinViews),
        }
    }

    /// Mean error of a picture, px.
    pub(super) fn mean_px(frame: &FrameReport) -> f64 {
        frame.errors_px().sum::<f64>() / frame.residuals_px.len().max(1) as f64
    }
}

/// Residuals at their places, whole pictures at a time, and how near is near.
fn field(used: &[(usize, &FrameReport)], solution: Option<&Solution>) -> (Vec<Placed>, f64) {
    let Some(solution) = solution else { return (Vec::new(), 0.0) };
    let corners: usize = used.iter().map(|(_, f)| f.residuals_px.len()).sum();
    let step = corners.div_ceil(MOST).max(1);
    let mut field = Vec::new();
    for (view, frame) in used.iter().step_by(step) {
        for (corner, [dx, dy]) in frame.corners.iter().zip(&frame.residuals_px) {
            // What the robust loss names as an outlier is said elsewhere.
            if !frame.outliers.contains(&corner.index) {
                field.push(Placed { px: corner.px, view: *view, residual_px: Vector2::new(*dx, *dy) });
            }
        }
    }
    let [w, h] = solution.camera.size_px.map(f64::from);
    (field, 0.06 * w.hypot(h))
}

/// Where the projection is a guess; none where it is not.
pub(super) fn guessed(u: &Uncertainty, limit_px: f64) -> Option<&'static str> {
    let rows = u.grid_px.len();
    let columns = u.grid_px.first().map_or(0, Vec::len);
    if rows == 0 || columns == 0 {
        return None;
    }
    let bad = |i: usize, j: usize| u.grid_px[j][i].is_none_or(|px| px > limit_px);
    let share = |cells: &mut dyn Iterator<Item = (usize, usize)>| {
        let (mut n, mut all) = (0usize, 0usize);
        for (i, j) in cells {
            all += 1;
            n += usize::from(bad(i, j));
        }
        n as f64 / all.max(1) as f64
    };
    // The middles of the four sides: corners are bad long before them.
    let (r, c) = (rows / 4..rows - rows / 4, columns / 4..columns - columns / 4);
    let left = share(&mut r.clone().map(|j| (0, j))) > 0.5;
    let right = share(&mut r.map(|j| (columns - 1, j))) > 0.5;
    let top = share(&mut c.clone().map(|i| (i, 0))) > 0.5;
    let bottom = share(&mut c.map(|i| (i, rows - 1))) > 0.5;
    let corners = share(&mut [0, columns - 1].into_iter().flat_map(|i| [(i, 0), (i, rows - 1)]));
    match (left, right, top, bottom) {
        (false, false, false, false) => (corners > 0.0).then_some("in the corners"),
        (true, false, false, false) => Some("at the left edge"),
        (false, true, false, false) => Some("at the right edge"),
        (false, false, true, false) => Some("at the upper edge"),
        (false, false, false, true) => Some("at the lower edge"),
        (true, true, false, false) => Some("at both sides"),
        (false, false, true, true) => Some("above and below"),
        _ => Some("towards the edges"),
    }
}
