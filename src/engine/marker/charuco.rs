//! ChArUco boards: a checkerboard whose white squares hold markers; its inner corners are what is measured.

use nalgebra::{Point3, Vector2};
use serde::{Deserialize, Serialize};

use super::{
    Sighting,
    board::{Layout, Located, nothing, square},
    dictionary::Dictionary,
    place::{Group, Nearby, place},
};
use crate::{homography::apply, observation::Corner, order};

/// Largest distance of a corner from where the markers around it have it, in squares and in px.
const OFF: (f64, f64) = (0.16, 1.5);
/// Farthest marker that tells where a corner is, in squares.
const REACH: f64 = 2.2;
/// Smallest cosine between the black squares of the board and of a crossing.
const COLOURS: f64 = 0.6;

/// A ChArUco board. Its index is `row · (columns − 1) + column` over the inner corners, as OpenCV's ids.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Charuco {
    /// Squares along x.
    pub columns: u32,
    /// Squares along y.
    pub rows: u32,
    /// Edge of a square, in the unit of the board.
    pub square: f64,
    /// Edge of a marker, in the same unit; less than `square`.
    pub marker: f64,
    /// What the markers are from.
    pub dictionary: Dictionary,
    /// Width of their black border, cells.
    pub border: u8,
    /// Id of the first marker.
    pub first_id: u32,
    /// Whether the first square of a board with an even number of rows is white, as before OpenCV 4.6; `None`: either, found
    /// in each picture. It changes nothing where the number of rows is odd.
    pub legacy: Option<bool>,
}

impl Charuco {
    /// Inner corners along x and y.
    fn inner(&self) -> [u32; 2] {
        [self.columns, self.rows].map(|n| n.saturating_sub(1))
    }

    /// Inner corners in the board frame, by index; the first one is one square from the board's corner both ways, as in OpenCV.
    pub fn points(&self) -> Vec<Point3<f64>> {
        let [columns, rows] = self.inner();
        let at = |i: u32| f64::from(i + 1) * self.square;
        (0..rows).flat_map(|r| (0..columns).map(move |c| Point3::new(at(c), at(r), 0.0))).collect()
    }

    /// Whether the square in a column and row is white.
    pub(super) fn is_white(&self, column: u32, row: u32, legacy: bool) -> bool {
        let shift = u32::from(legacy && self.rows.is_multiple_of(2));
        (column + row + shift) % 2 == 1
    }

    /// Its markers, row by row.
    pub(super) fn layout(&self, legacy: bool) -> Layout {
        let margin = 0.5 * (self.square - self.marker);
        let white = (0..self.rows).flat_map(|r| (0..self.columns).map(move |c| (c, r)));
        let marks = white
            .filter(|(c, r)| self.is_white(*c, *r, legacy))
            .map(|(c, r)| {
                let at = |i: u32| f64::from(i) * self.square + margin;
                square(at(c), at(r), self.marker)
            })
            .collect();
        Layout { dictionary: self.dictionary, border: self.border, first_id: self.first_id, marks }
    }

    /// The corners that a picture shows.
    pub fn locate(&self, sighting: &Sighting) -> Located {
        let first = self.legacy.unwrap_or(false);
        let mut best = self.locate_as(sighting, first);
        if !self.rows.is_multiple_of(2) {
            return best; // both layouts are the same
        }
        let other = self.locate_as(sighting, !first);
        let score = |l: &Located| (l.markers, l.corners.len());
        match self.legacy {
            // Of the wrong layout the markers of one row agree, those of several do not.
            Some(_) if other.markers > best.markers + 1 => {
                best.why = format!(
                    "{} markers fit the layout {} and {} this one: say the other layout, or none",
                    other.markers,
                    if first { "of OpenCV 4.6 and later" } else { "before OpenCV 4.6" },
                    best.markers
                );
                best.corners.clear();
            }
            Some(_) => {}
            None if score(&other) == score(&best) && !best.corners.is_empty() => {
                best.corners.clear();
                best.why = "too little of the board is seen to tell the layout of OpenCV 4.6 and later from the one before it: say which"
                    .to_owned();
            }
            None if score(&other) > score(&best) => {
                best = other;
                best.notes
                    .push("the layout is the one before OpenCV 4.6: the first square is white".to_owned());
            }
            None => {}
        }
        best
    }

    fn locate_as(&self, sighting: &Sighting, legacy: bool) -> Located {
        let layout = self.layout(legacy);
        let Some(group) = place(sighting, &layout) else { return nothing(sighting, &layout) };
        let corners = self.corners(sighting, &layout, &group, legacy);
        let inverted = group.marks.first().is_some_and(|m| m.inverted);
        // A single marker whose code could be chance counts where crossings stand around it.
        if !group.certain && corners.len() < 3 {
            return nothing(sighting, &layout);
        }
        let mut notes = Vec::new();
        if group.elsewhere > 0 {
            notes.push(format!(
                "{} more markers of these ids stand elsewhere: of two boards in a picture only the one with more markers is used",
                group.elsewhere
            ));
        }
        let why = if corners.is_empty() {
            "markers were recognised, but no inner corner between them: more of the board must be seen, and sharper".to_owned()
        } else {
            String::new()
        };
        Located { corners, markers: group.marks.len() as u32, inverted, why, notes }
    }

    fn corners(&self, sighting: &Sighting, layout: &Layout, group: &Group, legacy: bool) -> Vec<Corner> {
        let nearby = Nearby::new(layout, &group.marks);
        let inverted = group.marks.first().is_some_and(|m| m.inverted);
        let [columns, _] = self.inner();
        let mut used: Vec<Option<(u32, f64)>> = vec![None; sighting.crossings.len()];
        for (index, point) in self.points().iter().enumerate() {
            let (index, point) = (index as u32, point.xy().coords);
            let Some(h) = nearby.homography(point, REACH * self.square) else { continue };
            let at = apply(&h, &point);
            let half = 0.5 * self.square;
            // The square before the corner, up and to the left, and the one below that.
            let white = self.is_white(index % columns, index / columns, legacy) != inverted;
            let black = apply(&h, &(point + Vector2::new(half, if white { -half } else { half }))) - at;
            let steps = [Vector2::new(half, 0.0), Vector2::new(0.0, half)]
                .map(|d| (apply(&h, &(point + d)) - at).norm());
            let allowed = (OFF.0 * 2.0 * steps[0].min(steps[1])).max(OFF.1);
            let nearest = sighting
                .crossings
                .iter()
                .enumerate()
                .filter(|(_, c)| c.black.dot(&black).abs() >= COLOURS * black.norm())
                .map(|(i, c)| ((c.px - at).norm(), i))
                .filter(|n| n.0 <= allowed)
                .min_by(|a, b| a.0.total_cmp(&b.0));
            if let Some((off, i)) = nearest
                && used[i].is_none_or(|(_, before)| off < before)
            {
                used[i] = Some((index, off));
            }
        }
        let taken = used
            .iter()
            .zip(&sighting.crossings)
            .filter_map(|(u, c)| u.map(|(index, _)| Corner { index, px: c.px, sigma_px: c.sigma_px }));
        let mut corners: Vec<Corner> = taken.collect();
        order::by(&mut corners, |c| [c.index.into()]);
        corners
    }
}
