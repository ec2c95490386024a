//! Which board a set of pictures shows: its kind and size.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::{
    CircleBoard, Grid, Kind,
    assign::{Conflicts, Placement, cell, extent, turned},
};
use crate::{order, target::BoardSize};

/// A line at the rim of a board that is thinner than this share of what it should hold is chance: something beside the board.
const THIN: f64 = 0.3;
/// Share of the circles of a board that must be seen in a picture from which its size is taken.
const FILLED: f64 = 0.8;

/// The board that a set of pictures shows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BoardChoice {
    /// Kind and size; symmetric boards with columns ≥ rows.
    pub board: CircleBoard,
    /// Grids of the set that are this whole board.
    pub seen_whole: usize,
    /// What should be known about the choice; empty where there is nothing to say.
    pub doubts: String,
}

/// Finds the board that most grids of a set show; `None` where no grid is whole enough to tell.
///
/// A grid around which nothing more is seen counts three times, another complete one once; of boards with the same count the
/// larger is taken.
pub fn board_of(grids: &[&Grid]) -> Option<BoardChoice> {
    let mut votes = BTreeMap::<CircleBoard, (usize, usize)>::new();
    let mut closed = Vec::new();
    for grid in grids {
        for seen in [Kind::Symmetric, Kind::Asymmetric].into_iter().filter_map(|kind| grid.whole(kind)) {
            let vote = votes.entry(seen.board).or_default();
            vote.0 += if seen.closed { 3 } else { 1 };
            vote.1 += usize::from(seen.complete);
            if seen.closed {
                closed.push(seen.board);
            }
        }
    }
    let (board, (_, seen_whole)) = votes.iter().max_by_key(|(board, (n, _))| (*n, board.len()))?;
    let mut others: Vec<CircleBoard> = closed.iter().copied().filter(|b| b != board).collect();
    order::by(&mut others, |b| [f64::from(b.kind as u8), b.size.cols.into(), b.size.rows.into()]);
    others.dedup();
    let doubts = if !others.is_empty() {
        let list: Vec<String> = others.iter().map(ToString::to_string).collect();
        format!("other pictures show a board of {} circles", list.join(", "))
    } else if !closed.contains(board) {
        "no picture shows all four borders of the board: the board may be larger".to_owned()
    } else {
        String::new()
    };
    Some(BoardChoice { board: *board, seen_whole: *seen_whole, doubts })
}

/// What a grid says of the board.
pub(super) struct Whole {
    pub(super) board: CircleBoard,
    complete: bool,
    /// Nothing more is seen on any side.
    closed: bool,
}

impl Grid {
    /// The board of a kind whose circles these dots are, all or nearly all of them; `None` where they are not.
    pub(super) fn whole(&self, kind: Kind) -> Option<Whole> {
        let turns = if kind == Kind::Symmetric { 0..1 } else { 0..4 };
        turns.into_iter().find_map(|turns| {
            let all = self.trimmed(kind, turns)?;
            let shift = [-all[0][0], -all[1][0]];
            let [w, h] = all.map(|[a, b]| b - a + 1);
            let size = match kind {
                Kind::Symmetric => BoardSize { cols: w as u32, rows: h as u32 },
                Kind::Asymmetric if w % 2 == 0 => BoardSize { cols: w as u32 / 2, rows: h as u32 },
                Kind::Asymmetric => return None,
            };
            let board = CircleBoard { kind, size };
            let placement = Placement { turns, shift };
            let Conflicts { on, .. } = self.conflicts(board, placement)?;
            let complete = on == board.len();
            let beyond: Vec<[i32; 2]> = self
                .blanks
                .iter()
                .map(|b| placement.place(kind, *b))
                .filter(|b| board.at(*b).is_none())
                .collect();
            let sides = [(0, -1, h), (0, w, h), (1, -1, w), (1, h, w)];
            let closed = sides.into_iter().all(|(k, at, along)| {
                2 * beyond.iter().filter(|b| b[k] == at).count() as i32 >= kind.along(along).max(2)
            });
            let filled = on as f64 >= FILLED * board.len() as f64;
            // The two kinds share their smallest boards: too little to tell.
            let large = size.cols.min(size.rows) >= 2 && board.len() >= 6;
            let turn = kind == Kind::Symmetric && size.cols < size.rows;
            let size = if turn { BoardSize { cols: size.rows, rows: size.cols } } else { size };
            (large && (complete || (closed && filled))).then_some(Whole {
                board: CircleBoard { kind, size },
                complete,
                closed,
            })
        })
    }

    /// Extent of the dots in places of a kind, turned, without thin lines at its rim.
    fn trimmed(&self, kind: Kind, turns: usize) -> Option<[[i32; 2]; 2]> {
        let mut places: Vec<[i32; 2]> =
            self.dots.iter().map(|d| turned(kind.place(cell(d)), turns)).collect();
        loop {
            let all = extent(places.iter().copied())?;
            let on = |k: usize, at: i32| places.iter().filter(|p| p[k] == at).count();
            let thin = (0..2).flat_map(|k| all[k].map(|at| (k, at))).find(|(k, at)| {
                let along = all[1 - k][1] - all[1 - k][0] + 1;
                (on(*k, *at) as f64) < THIN * f64::from(kind.along(along))
            });
            let Some((k, at)) = thin else { return Some(all) };
            places.retain(|p| p[k] != at);
        }
    }
}
