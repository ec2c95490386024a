//! What is printed black of a board of markers.

use std::ops::Range;

use super::board::{AprilGrid, Charuco, Layout, MarkerBoard};
use crate::{Error, Result};

/// A black rectangle in the board frame: x and y of its corner nearest to the origin of the paper, width, height; in the unit of the
/// board.
pub type Black = [f64; 4];

impl MarkerBoard {
    /// Ids of its markers.
    pub fn ids(&self) -> Range<u32> {
        let layout = self.printed();
        layout.first_id..layout.first_id + layout.marks.len() as u32
    }

    /// What is printed black, without overlaps, on white paper. A ChArUco board of either layout is printed as of OpenCV 4.6 and later.
    ///
    /// # Errors
    /// [`Error::Invalid`] where the dictionary has too few markers.
    pub fn ink(&self) -> Result<Vec<Black>> {
        let layout = self.printed();
        let mut ink = match self {
            Self::Charuco(b) => squares(b),
            Self::AprilGrid(b) => crossings(b),
            Self::ArucoGrid(_) => Vec::new(),
        };
        self.fits_its_dictionary()?;
        let dictionary = layout.dictionary;
        for (mark, code) in layout.marks.iter().zip(self.ids().filter_map(|id| dictionary.code(id))) {
            marker(&layout, mark, code, &mut ink);
        }
        Ok(ink)
    }

    /// Refuses a dictionary that has too few markers for this board.
    ///
    /// # Errors
    /// [`Error::Invalid`] with the ids that are needed.
    pub fn fits_its_dictionary(&self) -> Result<()> {
        let (ids, dictionary) = (self.ids(), self.printed().dictionary);
        if ids.end <= dictionary.len() {
            return Ok(());
        }
        Err(Error::Invalid(format!(
            "the board needs the ids {} to {}, the dictionary {dictionary} ends at {}: choose one with more markers, or fewer of them",
            ids.start,
            ids.end.saturating_sub(1),
            dictionary.len().saturating_sub(1)
        )))
    }

    fn printed(&self) -> Layout {
        match self {
            Self::Charuco(b) => b.layout(b.legacy.unwrap_or(false)),
            Self::AprilGrid(b) => b.layout(),
            Self::ArucoGrid(b) => b.layout(),
        }
    }
}

/// The black squares of a ChArUco board.
fn squares(board: &Charuco) -> Vec<Black> {
    let legacy = board.legacy.unwrap_or(false);
    let all = (0..board.rows).flat_map(|r| (0..board.columns).map(move |c| (c, r)));
    let at = |i: u32| f64::from(i) * board.square;
    all.filter(|(c, r)| !board.is_white(*c, *r, legacy))
        .map(|(c, r)| [at(c), at(r), board.square, board.square])
        .collect()
}

/// The small squares of an AprilGrid: in every crossing of the gaps, outside of the outermost tags too.
fn crossings(board: &AprilGrid) -> Vec<Black> {
    let gap = board.tag * board.spacing;
    let at = |i: u32| f64::from(i) * (board.tag + gap) - gap;
    let all = (0..=board.rows).flat_map(|r| (0..=board.columns).map(move |c| (c, r)));
    all.map(|(c, r)| [at(c), at(r), gap, gap]).collect()
}

/// The black cells of a marker, those beside each other in a row as one.
fn marker(layout: &Layout, mark: &[nalgebra::Vector2<f64>; 4], code: u64, ink: &mut Vec<Black>) {
    let (n, border) = (usize::from(layout.dictionary.cells()), usize::from(layout.border));
    let total = n + 2 * border;
    let white = |r: usize, c: usize| {
        let inner = |k: usize| (border..border + n).contains(&k);
        inner(r) && inner(c) && code >> (n * n - 1 - (r - border) * n - (c - border)) & 1 == 1
    };
    let [right, down] = [mark[1] - mark[0], mark[3] - mark[0]].map(|side| side / total as f64);
    for row in 0..total {
        let mut column = 0;
        while column < total {
            let from = column;
            while column < total && !white(row, column) {
                column += 1;
            }
            if column > from {
                let corner = |r: usize, c: usize| mark[0] + right * c as f64 + down * r as f64;
                let (a, b) = (corner(row, from), corner(row + 1, column));
                let (low, size) = (a.inf(&b), (b - a).abs());
                ink.push([low.x, low.y, size.x, size.y]);
            }
            column += 1;
        }
    }
}
