//! Kalibr's AprilGrid: tags whose corners touch small black squares, so that every corner is a crossing as on a checkerboard.
//!
//! Ids run row by row from the *lower* left, and the corners of a tag counter-clockwise from its lower left one, as in Kalibr's
//! `GridCalibrationTargetAprilgrid`. Its tags are printed half a turn from the way that OpenCV's dictionaries have them: the first
//! corner of the code is the lower right one. The frame is the one of all boards here, x to the right and y *down*, with its
//! origin at the upper left corner of the uppermost left tag (Kalibr has y up from the lower left corner of tag 0).

use nalgebra::{Point3, Vector2};
use serde::{Deserialize, Serialize};

use super::{
    Sighting,
    aruco_grid::corners_of_marks,
    board::{Layout, Located, square},
    dictionary::Dictionary,
    place::Placed,
};

/// Largest distance of a crossing from where the sides of the tag meet, in sides and in px.
const OFF: (f64, f64) = (0.07, 1.2);
/// Smallest cosine between the diagonal of a tag and the black squares of the crossing.
const COLOURS: f64 = 0.6;

/// An AprilGrid. Its index is `4 · position + corner`, the corners counter-clockwise from the lower left.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AprilGrid {
    /// Tags along x.
    pub columns: u32,
    /// Tags along y.
    pub rows: u32,
    /// Edge of a tag over its black border, in the unit of the board.
    pub tag: f64,
    /// Distance between two tags as a share of `tag` (Kalibr's `tagSpacing`).
    pub spacing: f64,
    /// What the tags are from.
    pub dictionary: Dictionary,
    /// Width of their black border, cells: 2 in Kalibr's prints.
    pub border: u8,
    /// Id of the first tag.
    pub first_id: u32,
}

impl AprilGrid {
    /// Corners of the tags in the board frame, by index.
    pub fn points(&self) -> Vec<Point3<f64>> {
        let layout = self.layout();
        // The code begins lower right and runs clockwise: lower right, lower left, upper left, upper right.
        layout
            .marks
            .iter()
            .flat_map(|m| [m[1], m[0], m[3], m[2]])
            .map(|p| Point3::new(p.x, p.y, 0.0))
            .collect()
    }

    pub(super) fn layout(&self) -> Layout {
        let step = self.tag * (1.0 + self.spacing);
        let places = (0..self.rows).rev().flat_map(|r| (0..self.columns).map(move |c| [c, r].map(f64::from)));
        let marks = places
            .map(|[c, r]| {
                let [upper_left, upper_right, lower_right, lower_left] = square(c * step, r * step, self.tag);
                [lower_right, lower_left, upper_left, upper_right]
            })
            .collect();
        Layout { dictionary: self.dictionary, border: self.border, first_id: self.first_id, marks }
    }

    /// The corners that a picture shows: each the crossing of four squares, and where that cannot be measured, of the two sides.
    pub fn locate(&self, sighting: &Sighting) -> Located {
        let measure = |m: &Placed, k: usize, stray: bool| {
            let px = m.corners[k];
            let diagonal = m.corners[(k + 2) % 4] - px;
            let allowed = (OFF.0 * 0.7 * diagonal.norm()).max(OFF.1);
            // Of an inverted print the tag is white.
            let black = |c: Vector2<f64>| c.dot(&diagonal).abs() / diagonal.norm();
            let nearest = sighting
                .crossings
                .iter()
                .filter(
                    |c| if m.inverted { black(c.black) <= 1.0 - COLOURS } else { black(c.black) >= COLOURS },
                )
                .map(|c| ((c.px - px).norm(), c))
                .filter(|n| n.0 <= allowed)
                .min_by(|a, b| a.0.total_cmp(&b.0));
            let by_sides = (!stray).then_some((px, m.sigma_px[k]));
            nearest.map(|(_, c)| (c.px, c.sigma_px)).or(by_sides)
        };
        corners_of_marks(sighting, &self.layout(), [1, 0, 3, 2], measure)
    }
}
