//! Plain grids of markers, as OpenCV's `GridBoard`: the corners of the markers are measured, each as the crossing of two edges.

use nalgebra::{Point3, Vector2};
use serde::{Deserialize, Serialize};

use super::{
    Sighting,
    board::{Layout, Located, nothing, square},
    dictionary::Dictionary,
    place::{Nearby, Placed, place},
};
use crate::{observation::Corner, order};

/// A grid of markers, row by row from the upper left. Its index is `4 · position + corner`, the corners clockwise from the upper left.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ArucoGrid {
    /// Markers along x.
    pub columns: u32,
    /// Markers along y.
    pub rows: u32,
    /// Edge of a marker, in the unit of the board.
    pub marker: f64,
    /// Distance between two markers, in the same unit.
    pub gap: f64,
    /// What the markers are from.
    pub dictionary: Dictionary,
    /// Width of their black border, cells.
    pub border: u8,
    /// Id of the first marker.
    pub first_id: u32,
}

impl ArucoGrid {
    /// Corners of the markers in the board frame, by index; the first one is the origin.
    pub fn points(&self) -> Vec<Point3<f64>> {
        self.layout().marks.iter().flatten().map(|p| Point3::new(p.x, p.y, 0.0)).collect()
    }

    pub(super) fn layout(&self) -> Layout {
        let step = self.marker + self.gap;
        let places = (0..self.rows).flat_map(|r| (0..self.columns).map(move |c| [c, r].map(f64::from)));
        let marks = places.map(|[c, r]| square(c * step, r * step, self.marker)).collect();
        Layout { dictionary: self.dictionary, border: self.border, first_id: self.first_id, marks }
    }

    /// The corners that a picture shows.
    pub fn locate(&self, sighting: &Sighting) -> Located {
        let layout = self.layout();
        let by_mark = |m: &Placed, k: usize, stray: bool| (!stray).then_some((m.corners[k], m.sigma_px[k]));
        corners_of_marks(sighting, &layout, [0, 1, 2, 3], by_mark)
    }
}

/// Corners of recognised markers: corner k of a code is number `order[k]` of its place, and `measure` says where it is; its last argument is
/// whether the marker lies off the others.
pub(super) fn corners_of_marks(
    sighting: &Sighting,
    layout: &Layout,
    order: [u32; 4],
    measure: impl Fn(&Placed, usize, bool) -> Option<(Vector2<f64>, f64)>,
) -> Located {
    let Some(group) = place(sighting, layout).filter(|g| g.certain) else { return nothing(sighting, layout) };
    let strays = Nearby::new(layout, &group.marks).strays();
    let mut corners: Vec<Corner> = group
        .marks
        .iter()
        .zip(&strays)
        .flat_map(|(m, stray)| (0..4).map(move |k| (m, k, *stray)))
        .filter_map(|(m, k, stray)| {
            let (px, sigma_px) = measure(m, k, stray)?;
            Some(Corner { index: 4 * m.place as u32 + order[k], px, sigma_px })
        })
        .collect();
    order::by(&mut corners, |c| [c.index.into()]);
    let mut notes = Vec::new();
    if group.elsewhere > 0 {
        notes.push(format!(
            "{} more markers of these ids stand elsewhere: of two boards in a picture only the one with more markers is used",
            group.elsewhere
        ));
    }
    Located {
        corners,
        markers: group.marks.len() as u32,
        inverted: group.marks.first().is_some_and(|m| m.inverted),
        why: String::new(),
        notes,
    }
}
