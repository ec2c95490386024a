//! From grids to boards: which size the board has, and which corner is which.

use std::collections::BTreeMap;

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

use super::{Grid, GridCorner};
use crate::{homography, observation::Corner, order, target::BoardSize};

/// A part of a board is used from this many corners in 3 × 3.
const FEWEST: usize = 12;

/// Corners of a grid with their indices on a board.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Assigned {
    /// Ascending by index, each index at most once.
    pub corners: Vec<Corner>,
    /// Whether every corner of the board is there.
    pub full: bool,
    /// Whether the board looks the same in another order, so that the order is a choice: the one whose corner 0 has the
    /// smallest x + y in the picture.
    pub order_is_a_choice: bool,
}

/// The size of a board as a set of pictures shows it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BoardChoice {
    /// Inner corners, columns ≥ rows.
    pub size: BoardSize,
    /// Grids of the set that are this whole board.
    pub seen_whole: usize,
    /// What should be known about the choice (no picture shows the whole board, another size was seen too); empty where
    /// there is nothing to say.
    pub doubts: String,
}

/// Finds the size of the board that most grids of a set show; `None` where no grid is large enough to tell.
///
/// A grid whose four borders were seen is a whole board and counts three times, another complete rectangle once; of sizes
/// with the same count the larger is taken.
pub fn board_of(grids: &[&Grid]) -> Option<BoardChoice> {
    let normal = |[a, b]: [u32; 2]| BoardSize { cols: a.max(b), rows: a.min(b) };
    let mut votes = BTreeMap::<BoardSize, (usize, usize)>::new();
    for grid in grids {
        let complete = grid.corners.len() == normal(grid.size).len();
        let closed = grid.ends == [true; 4];
        if complete || closed {
            let vote = votes.entry(normal(grid.size)).or_default();
            vote.0 += if closed { 3 } else { 1 };
            vote.1 += usize::from(complete);
        }
    }
    let largest = |(size, (n, _)): &(&BoardSize, &(usize, usize))| (*n, size.len());
    let (size, (_, seen_whole)) = votes.iter().max_by_key(largest)?;
    let closed = |g: &&&Grid| g.ends == [true; 4];
    let others: Vec<String> = {
        let mut sizes: Vec<_> =
            grids.iter().filter(closed).map(|g| normal(g.size)).filter(|s| s != size).collect();
        order::by(&mut sizes, |s| [s.cols.into(), s.rows.into()]);
        sizes.dedup();
        sizes.iter().map(ToString::to_string).collect()
    };
    let doubts = if !others.is_empty() {
        format!("other pictures show a board of {}", others.join(", "))
    } else if !grids.iter().filter(closed).any(|g| normal(g.size) == *size) {
        "no picture shows all four borders of the board: the board may be larger".to_owned()
    } else {
        String::new()
    };
    Some(BoardChoice { size: *size, seen_whole: *seen_whole, doubts })
}

/// A way to lay a grid on a board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Placement {
    /// Quarter turns of the grid.
    turns: usize,
    /// Column and row of the board at the first cell of the turned grid.
    offset: [u32; 2],
}

/// All ways to lay a grid, given in its four turns, on a board without contradiction.
fn all_placements(turned: &[Grid; 4], size: BoardSize) -> Vec<Placement> {
    let of = |turns: usize| turned[turns].placements(size).map(move |offset| Placement { turns, offset });
    (0..4).flat_map(of).collect()
}

impl Grid {
    /// The same grid turned by quarter turns: what were rows become columns, counted so that it is not mirrored.
    pub(super) fn turned(&self, turns: usize) -> Self {
        if turns.is_multiple_of(4) {
            return self.clone();
        }
        let [columns, rows] = self.size;
        let [left, right, top, bottom] = self.ends;
        let mut corners: Vec<GridCorner> = self
            .corners
            .iter()
            .map(|c| GridCorner { cell: [c.cell[1], columns - 1 - c.cell[0]], ..*c })
            .collect();
        order::by(&mut corners, |c| [c.cell[1], c.cell[0]].map(f64::from));
        let quarter = Self {
            size: [rows, columns],
            corners,
            // The first cell was the last of the first row, and the square before it lies across that one's edge.
            black_first: self.black_first == (columns % 2 == 0),
            ends: [top, bottom, right, left],
            dots: self.dots.iter().map(|[c, r]| [*r, columns - 2 - c]).collect(),
        };
        quarter.turned(turns % 4 - 1)
    }

    /// Turned so that columns run to the right as far as possible.
    pub(super) fn upright(&self) -> Self {
        let to_the_right = |grid: &Self| {
            let by_cell = order::map(grid.corners.iter().map(|c| (c.cell, c.px)));
            let step = |c: &GridCorner| by_cell.get(&[c.cell[0] + 1, c.cell[1]]).map(|q| q.x - c.px.x);
            grid.corners.iter().filter_map(step).sum::<f64>()
        };
        let all = [0, 1, 2, 3].map(|turns| self.turned(turns));
        all.into_iter()
            .max_by(|a, b| to_the_right(a).total_cmp(&to_the_right(b)))
            .unwrap_or_else(|| self.clone())
    }

    /// Gives corners their indices on a board of `size` inner corners with dots in the squares of these first corners.
    ///
    /// A part of a board is used where every index is certain: its place follows from borders that are seen, from the size,
    /// from the colours, and from the dots, if it shows one.
    ///
    /// # Errors
    /// One sentence that says why the grid is not used: another size (`found 8x6, asked 9x6`), too small a part, or a part
    /// whose place on the board is not certain.
    pub fn assign(&self, size: BoardSize, dots: &[[u32; 2]]) -> Result<Assigned, String> {
        let turned = [0, 1, 2, 3].map(|turns| self.turned(turns));
        let mut placements = all_placements(&turned, size);
        let agrees = |p: &Placement| turned[p.turns].agrees(dots, p.offset);
        if !self.dots.is_empty() && placements.iter().any(agrees) {
            placements.retain(agrees);
        }
        let Some(first) = placements.first() else { return Err(self.misfit(size)) };
        let enough = self.corners.len() >= FEWEST && self.size.iter().all(|n| *n >= 3);
        if !enough && self.corners.len() < size.len() {
            return Err(format!(
                "only {} corners of the {size} board, a part needs {FEWEST} in 3x3",
                self.corners.len()
            ));
        }
        let outline = |p: &Placement| self.outline(size, *p);
        if placements.iter().any(|p| outline(p) != outline(first)) {
            return Err(format!(
                "a part of {}x{} corners of the {size} board, but which part is not certain: show two opposite borders of the board",
                self.size[0], self.size[1]
            ));
        }
        // Corner 0 may lie outside of the part: the plane of the others says where.
        let place = |p: &Placement| {
            let corners = turned[p.turns].indexed(size, p.offset);
            let at = match corners.iter().find(|c| c.index == 0) {
                Some(c) => Some(c.px),
                None => corner_zero(&corners, size),
            };
            (at.map_or(f64::INFINITY, |px| px.x + px.y), corners)
        };
        let all: Vec<_> = placements.iter().map(place).collect();
        let order_is_a_choice = all.len() > 1;
        let best = all.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
        let corners = best.map(|b| b.1).unwrap_or_default();
        Ok(Assigned { full: corners.len() == size.len(), corners, order_is_a_choice })
    }

    /// Squares with a dot, by column and row of the board, for each way to lay the whole grid on it; each ascending by row, then column.
    pub(super) fn dots_on(&self, size: BoardSize) -> Vec<Vec<[u32; 2]>> {
        let turned = [0, 1, 2, 3].map(|turns| self.turned(turns));
        let dots = |p: &Placement| {
            let [c, r] = p.offset;
            let mut dots: Vec<_> = turned[p.turns].dots.iter().map(|d| [d[0] + c, d[1] + r]).collect();
            order::by(&mut dots, |d| [d[1], d[0]].map(f64::from));
            dots
        };
        all_placements(&turned, size).iter().map(dots).collect()
    }

    /// Whether of the squares with four corners those have a dot that have one on the board, with this grid, unturned, laid at `offset`.
    fn agrees(&self, dots: &[[u32; 2]], [c, r]: [u32; 2]) -> bool {
        let cells = order::set(self.corners.iter().map(|c| c.cell));
        let is_whole = |[c, r]: &[u32; 2]| {
            [[*c, *r], [c + 1, *r], [*c, r + 1], [c + 1, r + 1]].iter().all(|k| cells.contains(k))
        };
        let expected =
            dots.iter().filter_map(|d| Some([d[0].checked_sub(c)?, d[1].checked_sub(r)?])).filter(is_whole);
        order::set(expected) == order::set(self.dots.iter().copied())
    }

    /// Offsets at which this grid, unturned, lies on a board without contradiction.
    fn placements(&self, size: BoardSize) -> impl Iterator<Item = [u32; 2]> + use<> {
        let board = [size.cols, size.rows];
        let (grid, ends, black_first) = (self.size, self.ends, self.black_first);
        let free = [0, 1].map(|k| board[k].checked_sub(grid[k]).map_or(0..0, |room| 0..room + 1));
        // Where columns + rows is odd, the board has one black corner pair: corner 0 touches a black square.
        let coloured = (size.cols + size.rows) % 2 == 1;
        let [columns, rows] = free;
        columns.flat_map(move |c| rows.clone().map(move |r| [c, r])).filter(move |offset| {
            let fits = |k: usize| {
                (!ends[2 * k] || offset[k] == 0) && (!ends[2 * k + 1] || offset[k] + grid[k] == board[k])
            };
            fits(0) && fits(1) && (!coloured || black_first == ((offset[0] + offset[1]) % 2 == 0))
        })
    }

    /// First and last column and row of the board in cells of this grid.
    fn outline(&self, size: BoardSize, p: Placement) -> [[i64; 2]; 2] {
        let board = [i64::from(size.cols), i64::from(size.rows)];
        let [columns, rows] = self.size.map(i64::from);
        let [c, r] = p.offset.map(i64::from);
        // Two opposite corners of the board in cells of the turned grid, turned back.
        let corners = [[-c, -r], [board[0] - 1 - c, board[1] - 1 - r]];
        let [[a, b], [d, e]] = corners.map(|[x, y]| match p.turns {
            0 => [x, y],
            1 => [columns - 1 - y, x],
            2 => [columns - 1 - x, rows - 1 - y],
            _ => [y, rows - 1 - x],
        });
        [[a.min(d), a.max(d)], [b.min(e), b.max(e)]]
    }

    fn indexed(&self, size: BoardSize, offset: [u32; 2]) -> Vec<Corner> {
        let index = |c: &GridCorner| size.index(c.cell[0] + offset[0], c.cell[1] + offset[1]);
        let mut corners: Vec<Corner> =
            self.corners.iter().map(|c| Corner { index: index(c), px: c.px, sigma_px: c.sigma_px }).collect();
        order::by(&mut corners, |c| [c.index.into()]);
        corners
    }

    /// Why the grid is no part of a board.
    fn misfit(&self, size: BoardSize) -> String {
        let [a, b] = self.size;
        let [long, short] = [a.max(b), a.min(b)];
        let fits = long <= size.cols.max(size.rows) && short <= size.cols.min(size.rows);
        let whole = self.ends == [true; 4] || !fits;
        let found =
            if size.cols >= size.rows { format!("{long}x{short}") } else { format!("{short}x{long}") };
        if whole && (long, short) != (size.cols.max(size.rows), size.cols.min(size.rows)) {
            format!("found {found}, asked {size}")
        } else {
            format!(
                "found {found}, whose colours and borders do not fit {} {size} board: check --board",
                size.article()
            )
        }
    }
}

/// Where corner 0 would be, by the plane of the corners that are seen.
fn corner_zero(corners: &[Corner], size: BoardSize) -> Option<Vector2<f64>> {
    let at = |c: &Corner| {
        let [col, row] = size.at(c.index);
        Vector2::new(f64::from(col), f64::from(row))
    };
    let board: Vec<_> = corners.iter().map(at).collect();
    let px: Vec<_> = corners.iter().map(|c| c.px).collect();
    let fit = homography::fit(&board, &px, homography::Options::default())?;
    Some(homography::apply(&fit.matrix, &Vector2::zeros()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn size(text: &str) -> BoardSize {
        text.parse().unwrap()
    }

    /// The part of a board with columns and rows in the given ranges, as a picture shows it: turned, and seen to end where
    /// asked. Places are those of the board, 10 px a square, turned with it.
    fn part(board: &str, [c0, c1]: [u32; 2], [r0, r1]: [u32; 2], turns: usize, see_ends: bool) -> Grid {
        let board = size(board);
        let corners = (r0..r1).flat_map(|r| (c0..c1).map(move |c| [c, r])).map(|[c, r]| GridCorner {
            cell: [c - c0, r - r0],
            px: Vector2::new(100.0 + 10.0 * f64::from(c), 100.0 + 10.0 * f64::from(r)),
            sigma_px: 0.01,
        });
        let ends = [c0 == 0, c1 == board.cols, r0 == 0, r1 == board.rows].map(|e| e && see_ends);
        let grid = Grid {
            size: [c1 - c0, r1 - r0],
            corners: corners.collect(),
            black_first: (c0 + r0) % 2 == 0,
            ends,
            dots: Vec::new(),
        };
        grid.turned(turns)
    }

    /// Whether every corner has the index of its place.
    fn right(assigned: &Assigned, board: BoardSize) -> bool {
        assigned.corners.iter().all(|c| {
            let [col, row] = board.at(c.index);
            c.px == Vector2::new(100.0 + 10.0 * f64::from(col), 100.0 + 10.0 * f64::from(row))
        })
    }

    #[test]
    fn four_quarter_turns_change_nothing() {
        let grid = part("9x6", [2, 8], [0, 5], 0, true);
        assert_eq!(grid.turned(1).turned(3), grid);
        assert_eq!(grid.turned(2).turned(2), grid);
        assert_eq!(grid.turned(1).turned(1), grid.turned(2));
        assert_eq!(grid.turned(3).upright(), grid);
    }

    #[test]
    fn colours_tell_the_order_of_whole_boards() {
        for turns in 0..4 {
            let assigned = part("9x6", [0, 9], [0, 6], turns, false).assign(size("9x6"), &[]).unwrap();
            assert!(assigned.full && !assigned.order_is_a_choice && right(&assigned, size("9x6")), "{turns}");
        }
    }

    #[test]
    fn where_the_order_is_a_choice_corner_0_is_the_uppermost_left() {
        for board in ["8x6", "7x5", "12x12"] {
            let b = size(board);
            for turns in 0..4 {
                let assigned = part(board, [0, b.cols], [0, b.rows], turns, true).assign(b, &[]).unwrap();
                assert!(
                    assigned.full && assigned.order_is_a_choice && right(&assigned, b),
                    "{board} {turns}"
                );
            }
        }
    }

    #[test]
    fn parts_are_used_where_their_place_is_certain() {
        let nine = size("9x6");
        for turns in 0..4 {
            // Two borders that meet and more columns than the board has rows, or all rows and one border.
            for (c, r) in [([0, 7], [0, 4]), ([2, 9], [2, 6]), ([0, 7], [0, 6]), ([2, 9], [0, 6])] {
                let assigned = part("9x6", c, r, turns, true).assign(nine, &[]).unwrap();
                assert!(!assigned.full && right(&assigned, nine), "{c:?} {r:?} {turns}");
            }
            // All columns but no border: by the colours the missing row may be at either side.
            let why = part("9x6", [0, 9], [0, 5], turns, false).assign(nine, &[]).unwrap_err();
            assert!(why.contains("not certain"), "{why}");
            assert!(part("9x6", [2, 7], [1, 5], turns, true).assign(nine, &[]).is_err());
            // At a corner of the board that is seen, either side may be the long one.
            assert!(part("9x6", [0, 5], [0, 4], turns, true).assign(nine, &[]).is_err());
        }
        let twelve = size("12x12");
        assert!(part("12x12", [0, 12], [3, 12], 1, true).assign(twelve, &[]).is_ok());
        assert!(part("12x12", [0, 12], [3, 12], 1, false).assign(twelve, &[]).is_err());
    }

    #[test]
    fn too_small_a_part_is_refused() {
        let why = part("9x6", [0, 3], [0, 3], 0, true).assign(size("9x6"), &[]).unwrap_err();
        assert!(why.contains("only 9 corners"), "{why}");
        assert!(part("9x6", [0, 2], [0, 6], 0, true).assign(size("9x6"), &[]).is_err());
        // A whole small board is a board.
        assert!(part("3x3", [0, 3], [0, 3], 0, true).assign(size("3x3"), &[]).unwrap().full);
    }

    #[test]
    fn another_size_is_named() {
        for (asked, said) in [
            ("8x6", "found 9x6, asked 8x6"),
            ("10x7", "found 9x6, asked 10x7"),
            ("6x8", "found 6x9, asked 6x8"),
        ] {
            assert_eq!(part("9x6", [0, 9], [0, 6], 1, true).assign(size(asked), &[]), Err(said.to_owned()));
        }
        // 6x9 is 9x6 turned, with another meaning of the index.
        assert!(part("9x6", [0, 9], [0, 6], 0, true).assign(size("6x9"), &[]).is_ok_and(|a| a.full));
    }

    #[test]
    fn the_size_is_that_of_most_whole_boards() {
        let whole = part("9x6", [0, 9], [0, 6], 1, true);
        let unsure = part("9x6", [0, 9], [0, 6], 0, false);
        let cut = part("9x6", [0, 9], [0, 5], 0, true);
        let other = part("7x5", [0, 7], [0, 5], 0, true);
        let choice = board_of(&[&cut, &whole, &unsure]).unwrap();
        assert_eq!((choice.size, choice.seen_whole, choice.doubts.as_str()), (size("9x6"), 2, ""));
        let choice = board_of(&[&whole, &whole, &other]).unwrap();
        assert!(choice.size == size("9x6") && choice.doubts.contains("7x5"));
        assert!(board_of(&[&unsure]).unwrap().doubts.contains("four borders"));
        assert_eq!(board_of(&[]), None);
    }
}
