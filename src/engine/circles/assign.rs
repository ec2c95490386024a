//! From lattices to boards: which dot is which.

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

use super::{CircleBoard, Grid, GridDot, Kind};
use crate::{homography, observation::Corner, order};

/// A part of a board is used from this many dots on.
const FEWEST: usize = 12;
/// One dot in so many may be missed where the picture shows nothing in its place: a reflection, a worn print.
const MISSED: usize = 15;

/// Dots of a lattice with their indices on a board.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Assigned {
    /// Ascending by index, each index at most once.
    pub corners: Vec<Corner>,
    /// Whether every circle of the board is there.
    pub full: bool,
    /// Whether the board looks the same in another order, so that the order is a choice: the one whose circle 0 has the
    /// smallest x + y in the picture. So it is with all symmetric boards, and with asymmetric ones of an even number of rows.
    pub order_is_a_choice: bool,
}

impl Kind {
    /// A cell of the lattice in spacings of the board, up to turns and shifts.
    pub(super) const fn place(self, [c, r]: [i32; 2]) -> [i32; 2] {
        match self {
            Self::Symmetric => [c, r],
            Self::Asymmetric => [c - r, c + r],
        }
    }

    /// Circles along a line of `extent` spacings, at least.
    pub(super) const fn along(self, extent: i32) -> i32 {
        match self {
            Self::Symmetric => extent,
            Self::Asymmetric => extent / 2,
        }
    }
}

/// Turned by quarter turns about the origin, columns to rows.
pub(super) const fn turned([x, y]: [i32; 2], turns: usize) -> [i32; 2] {
    match turns % 4 {
        0 => [x, y],
        1 => [-y, x],
        2 => [-x, -y],
        _ => [y, -x],
    }
}

/// First and last along both axes; `None` of nothing.
pub(super) fn extent(places: impl Iterator<Item = [i32; 2]>) -> Option<[[i32; 2]; 2]> {
    places.fold(None, |b: Option<[[i32; 2]; 2]>, p| {
        let b = b.unwrap_or([[p[0]; 2], [p[1]; 2]]);
        Some([0, 1].map(|k| [b[k][0].min(p[k]), b[k][1].max(p[k])]))
    })
}

/// A way to lay a lattice on a board: quarter turns, then a shift.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Placement {
    pub(super) turns: usize,
    pub(super) shift: [i32; 2],
}

impl Placement {
    pub(super) fn place(self, kind: Kind, cell: [i32; 2]) -> [i32; 2] {
        let [x, y] = turned(kind.place(cell), self.turns);
        [x + self.shift[0], y + self.shift[1]]
    }

    /// The board's extent in unturned, unshifted places: equal for placements that differ by a symmetry of the board.
    fn outline(self, board: CircleBoard) -> Option<[[i32; 2]; 2]> {
        let [w, h] = board.extent();
        let back = |[x, y]: [i32; 2]| turned([x - self.shift[0], y - self.shift[1]], 4 - self.turns);
        extent([[0, 0], [w - 1, h - 1]].map(back).into_iter())
    }
}

/// How a lattice lies on a board.
pub(super) struct Conflicts {
    /// Dots that are circles of the board.
    pub(super) on: usize,
    /// Circles that were seen to be missing, and twice the dots that are no circles.
    against: usize,
}

pub(super) fn cell(dot: &GridDot) -> [i32; 2] {
    dot.cell.map(|v| v as i32)
}

impl Grid {
    /// The same lattice turned by quarter turns: what were rows become columns, counted so that it is not mirrored.
    fn turned(&self, turns: usize) -> Self {
        if turns.is_multiple_of(4) {
            return self.clone();
        }
        let last = self.size[0] as i32 - 1;
        let turn = |[c, r]: [i32; 2]| [r, last - c];
        let mut dots: Vec<GridDot> =
            self.dots.iter().map(|d| GridDot { cell: turn(cell(d)).map(|v| v as u32), ..*d }).collect();
        order::by(&mut dots, |d| [d.cell[1], d.cell[0]].map(f64::from));
        let mut blanks: Vec<[i32; 2]> = self.blanks.iter().map(|b| turn(*b)).collect();
        order::by(&mut blanks, |[c, r]| [*r, *c].map(f64::from));
        Self { size: [self.size[1], self.size[0]], dots, blanks, ..*self }.turned(turns % 4 - 1)
    }

    /// Turned so that columns run to the right as far as possible.
    pub(super) fn upright(&self) -> Self {
        let by_cell = order::map(self.dots.iter().map(|d| (d.cell, d.px)));
        let sum = |[c, r]: [u32; 2]| -> Vector2<f64> {
            let step = |d: &GridDot| by_cell.get(&[d.cell[0] + c, d.cell[1] + r]).map(|q| q - d.px);
            self.dots.iter().filter_map(step).sum()
        };
        let (along, down) = (sum([1, 0]), sum([0, 1]));
        // A quarter turn makes rows the new columns, and columns, backwards, the new rows.
        let to_the_right = [along.x, down.x, -along.x, -down.x];
        let best = (0..4).max_by(|a, b| to_the_right[*a].total_cmp(&to_the_right[*b])).unwrap_or(0);
        self.turned(best)
    }

    /// What speaks against a placement; `None` where too many dots are no circles of the board.
    pub(super) fn conflicts(&self, board: CircleBoard, placement: Placement) -> Option<Conflicts> {
        let at = |cell| board.at(placement.place(board.kind, cell));
        let most = self.dots.len() / MISSED;
        let mut off = 0;
        for dot in &self.dots {
            off += usize::from(at(cell(dot)).is_none());
            if off > most {
                return None;
            }
        }
        let blank = self.blanks.iter().filter(|b| at(**b).is_some()).count();
        Some(Conflicts { on: self.dots.len() - off, against: blank + 2 * off })
    }

    /// Gives dots their indices on a board.
    ///
    /// A part of a board is used where every index is certain: its place follows from the size and from where nothing is.
    ///
    /// # Errors
    /// One sentence that says why the grid is not used: another board, too small a part, or a part whose place on the board is
    /// not certain.
    pub fn assign(&self, board: CircleBoard) -> Result<Assigned, String> {
        let all = self.placements(board);
        let Some(fewest) = all.iter().map(|(_, against)| *against).min() else {
            return Err(self.misfit(board));
        };
        if fewest > 2 * (self.dots.len() / MISSED) {
            return Err(self.misfit(board));
        }
        // One blank more may be one more missed dot.
        let possible: Vec<Placement> =
            all.into_iter().filter(|(_, against)| *against <= fewest + 1).map(|(p, _)| p).collect();
        if self.dots.len() < FEWEST.min(board.len()) {
            return Err(format!(
                "only {} circles of the {board} board, a part needs {FEWEST}",
                self.dots.len()
            ));
        }
        let first = possible.first().and_then(|p| p.outline(board));
        if possible.iter().any(|p| p.outline(board) != first) {
            return Err(format!(
                "a part of {} circles of the {board} board, but which part is not certain: show two opposite borders of the board",
                self.dots.len()
            ));
        }
        let place = |p: &Placement| {
            let corners = self.indexed(board, *p);
            let at = match corners.iter().find(|c| c.index == 0) {
                Some(c) => Some(c.px),
                None => circle_zero(&corners, board),
            };
            (at.map_or(f64::INFINITY, |px| px.x + px.y), corners)
        };
        let order_is_a_choice = possible.len() > 1;
        let best = possible.iter().map(place).min_by(|a, b| a.0.total_cmp(&b.0));
        let corners = best.map(|b| b.1).unwrap_or_default();
        Ok(Assigned { full: corners.len() == board.len(), corners, order_is_a_choice })
    }

    /// Ways to lay the lattice on a board, with what speaks against each.
    fn placements(&self, board: CircleBoard) -> Vec<(Placement, usize)> {
        let size = board.extent();
        let mut list = Vec::new();
        for turns in 0..4 {
            let Some(all) = extent(self.dots.iter().map(|d| turned(board.kind.place(cell(d)), turns))) else {
                continue;
            };
            // A line more than the board has may be chance.
            let range = |k: usize| (-all[k][0] - 1)..(size[k] - all[k][1] + 1);
            for x in range(0) {
                for y in range(1) {
                    let placement = Placement { turns, shift: [x, y] };
                    if let Some(c) = self.conflicts(board, placement) {
                        list.push((placement, c.against));
                    }
                }
            }
        }
        list
    }

    fn indexed(&self, board: CircleBoard, p: Placement) -> Vec<Corner> {
        let corner = |d: &GridDot| {
            let index = board.at(p.place(board.kind, cell(d)))?;
            Some(Corner { index, px: d.px, sigma_px: d.sigma_px })
        };
        let mut corners: Vec<Corner> = self.dots.iter().filter_map(corner).collect();
        order::by(&mut corners, |c| [c.index.into()]);
        corners
    }

    /// Why the grid is no part of a board.
    fn misfit(&self, board: CircleBoard) -> String {
        let seen =
            [board.kind, if board.kind == Kind::Symmetric { Kind::Asymmetric } else { Kind::Symmetric }]
                .into_iter()
                .find_map(|kind| self.whole(kind));
        match seen {
            Some(seen) => format!("found {} circles, asked {board}", seen.board),
            None => format!(
                "{} circles in the picture do not fit the {board} board: check kind and size",
                self.dots.len()
            ),
        }
    }
}

/// Where circle 0 would be, by the plane of those that are seen.
fn circle_zero(corners: &[Corner], board: CircleBoard) -> Option<Vector2<f64>> {
    let at = |c: &Corner| Vector2::from(board.place(c.index).map(f64::from));
    let places: Vec<_> = corners.iter().map(at).collect();
    let px: Vec<_> = corners.iter().map(|c| c.px).collect();
    let fit = homography::fit(&places, &px, homography::Options::default())?;
    Some(homography::apply(&fit.matrix, &Vector2::zeros()))
}
