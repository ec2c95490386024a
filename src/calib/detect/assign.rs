//! From grids to boards: which size the board has, and which corner is which.

use serde::{Deserialize, Serialize};

use super::Grid;
use crate::calib::{observation::Corner, target::BoardSize};

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
pub fn board_of(grids: &[&Grid]) -> Option<BoardChoice> {
    let _ = grids;
    None
}

impl Grid {
    /// Gives corners their indices on a board of `size` inner corners.
    ///
    /// A part of a board is used where every index is certain: its place follows from borders that are seen, from the
    /// picture's frame, and from the colours.
    ///
    /// # Errors
    /// One sentence that says why the grid is not used: another size (`found 8x6, asked 9x6`), too small a part, or a part
    /// whose place on the board is not certain.
    pub fn assign(&self, size: BoardSize) -> Result<Assigned, String> {
        Err(format!("found {}x{}, asked {size}", self.size[0], self.size[1]))
    }
}
