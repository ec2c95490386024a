//! Across a gap: what lies over a board may cut it in two. The far side is found by the homography of the near one, which says
//! what cell each saddle beyond the gap would be.

use nalgebra::Vector2;

use super::{
    grow::{ALONG, CONTRAST, Field},
    sheet::{Cell, STEPS, Sheet, add, is_black},
};
use crate::homography;

/// Farthest cell beyond the grid, in columns or rows.
const REACH: i32 = 6;
/// Largest distance from the place of a cell, in cells, after the lens's bend at the nearest cell of the grid is taken off.
const OFF: f64 = 0.15;
/// Largest difference of that distance between neighbours.
const SMOOTH: f64 = 0.12;
/// Fewest saddles in one piece beyond a gap.
const FEWEST: usize = 4;
/// A grid of fewer cells says too little of its surroundings; of one of more, what hides a part leaves enough.
const CELLS: std::ops::RangeInclusive<usize> = 9..=1000;

/// A saddle beyond the grid and how far it is off, in cells.
type Beyond = (usize, Vector2<f64>);

impl Field<'_> {
    /// Adds pieces of the same board that a gap parts from the grid; whether there were any.
    pub(super) fn bridge(&self, sheet: &mut Sheet<usize>) -> bool {
        let cells: Vec<(Cell, usize)> = sheet.iter().collect();
        if !CELLS.contains(&cells.len()) {
            return false;
        }
        let contrast = cells.iter().map(|(_, i)| self.saddles[*i].contrast).sum::<f32>() / cells.len() as f32;
        let alike = |i: &usize| CONTRAST.contains(&(self.saddles[*i].contrast / contrast));
        let left: Vec<usize> = (0..self.saddles.len()).filter(alike).collect();
        let Some(bounds) = sheet.bounds().filter(|_| left.len() >= cells.len() + FEWEST) else {
            return false;
        };
        let place = |cell: Cell| Vector2::from(cell.map(f64::from));
        let (board, px): (Vec<_>, Vec<_>) =
            cells.iter().map(|(c, i)| (place(*c), self.saddles[*i].px)).unzip();
        let plain = homography::Options { ransac: false, ..homography::Options::default() };
        let Some(h) = homography::fit(&board, &px, plain).map(|fit| fit.matrix) else { return false };
        let Some(back) = h.try_inverse() else { return false };

        let mut beyond = Sheet::<Beyond>::new();
        for i in left {
            let at = homography::apply(&back, &self.saddles[i].px);
            let near =
                |k: usize| at[k] > f64::from(bounds[k][0] - REACH) && at[k] < f64::from(bounds[k][1] + REACH);
            if !near(0) || !near(1) {
                continue;
            }
            let nearest = cells
                .iter()
                .min_by(|a, b| (place(a.0) - at).norm_squared().total_cmp(&(place(b.0) - at).norm_squared()));
            let Some((cell, j)) = nearest else { continue };
            let bend = homography::apply(&back, &self.saddles[*j].px) - place(*cell);
            let straight = at - bend;
            let whole = straight.map(f64::round);
            let (to, off) = ([whole.x as i32, whole.y as i32], straight - whole);
            let step = |s: [f64; 2]| {
                homography::apply(&h, &(whole + Vector2::from(s))) - homography::apply(&h, &whole)
            };
            let uv = [step([1.0, 0.0]), step([0.0, 1.0])];
            if off.amax() < OFF
                && sheet.get(to).is_none()
                && self.saddles[i].mismatch(uv, is_black(to)).is_some_and(|m| m < ALONG)
                && beyond.get(to).is_none_or(|(_, other)| off.amax() < other.amax())
            {
                beyond.set(to, (i, off));
            }
        }
        let mut any = false;
        loop {
            let Some(first) = beyond.iter().next().map(|(cell, _)| cell) else { return any };
            let piece = piece(&mut beyond, first);
            if piece.len() >= FEWEST {
                piece.iter().for_each(|(cell, i)| sheet.set(*cell, *i));
                any = true;
            }
        }
    }
}

/// Takes out what hangs together with `first` and is off by nearly the same.
fn piece(beyond: &mut Sheet<Beyond>, first: Cell) -> Vec<(Cell, usize)> {
    let (mut piece, mut queue) = (Vec::new(), vec![first]);
    while let Some(cell) = queue.pop() {
        let Some((i, off)) = beyond.get(cell) else { continue };
        beyond.remove(cell);
        piece.push((cell, i));
        let along = |c: &Cell| beyond.get(*c).is_some_and(|(_, o)| (o - off).amax() < SMOOTH);
        queue.extend(STEPS.map(|s| add(cell, s)).into_iter().filter(along));
    }
    piece
}
