//! What the verdict and the rules look at, gathered once.

use std::cell::OnceCell;

use nalgebra::Vector2;

use super::{
    Level,
    bend::{self, Bend},
};
use crate::calib::{
    report::{FrameReport, Report, Solution},
    stats::{
        regions::{self, Region},
        spatial::Moran,
    },
    target::Target,
    uncertainty::Uncertainty,
};

/// Everything that is asked for more than once.
pub(super) struct Facts<'a> {
    pub(super) report: &'a Report,
    pub(super) solution: Option<&'a Solution>,
    /// Used pictures with their positions.
    pub(super) used: Vec<(usize, &'a FrameReport)>,
    /// Parts of the picture without a corner.
    pub(super) empty: Vec<Region>,
    /// Whether the board was bent, once that was asked.
    bend: OnceCell<Option<Bend>>,
    /// What errors of different pictures share, once that was asked.
    pub(super) between: OnceCell<Option<Moran>>,
}

impl<'a> Facts<'a> {
    pub(super) fn of(report: &'a Report) -> Self {
        let solution = report.solution.as_ref();
        let points: Vec<Vector2<f64>> = report.corners_px();
        Self {
            report,
            solution,
            used: report.frames.iter().enumerate().filter(|(_, f)| f.included).collect(),
            empty: solution.map(|s| regions::empty(&points, s.camera.size_px)).unwrap_or_default(),
            bend: OnceCell::new(),
            between: OnceCell::new(),
        }
    }

    /// The bend of the board.
    pub(super) fn bend(&self) -> Option<&Bend> {
        self.bend.get_or_init(|| bend::of(self)).as_ref()
    }

    /// The strongest tilt of a board; none for things that are not flat, which need not be tilted.
    pub(super) fn most_tilt_deg(&self) -> Option<f64> {
        if self.report.settings.target.as_ref().is_some_and(Target::is_solid) {
            return None;
        }
        self.used.iter().filter_map(|(_, f)| f.tilt_rad.map(f64::to_degrees)).reduce(f64::max)
    }

    /// Whether the camera misses its corners, and how badly.
    pub(super) fn misfit(&self) -> Option<Level> {
        let solution = self.solution?;
        let [w, h] = solution.camera.size_px.map(f64::from);
        let large = solution.rms_inliers_px / (LARGE_PX * (w.hypot(h) / 2000.0).max(1.0));
        (large > 1.0).then_some(if large > ABSURD { Level::Bad } else { Level::Warn })
    }
}

/// RMS beyond which the model and the pictures disagree visibly, px in a picture of up to 2000 px from corner to corner.
const LARGE_PX: f64 = 1.0;
/// As many times this, and no lens, board or blur explains it.
const ABSURD: f64 = 3.0;

/// Strongest tilt below which the focal length rests on perspective that is hardly there.
pub(super) const FLAT_DEG: f64 = 20.0;

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
