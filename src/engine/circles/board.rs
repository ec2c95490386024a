//! Boards of circles: kinds, sizes, indices and places.

use nalgebra::Point3;
use serde::{Deserialize, Serialize};

use crate::target::BoardSize;

/// How the circles of a board are laid out.
///
/// ```text
/// symmetric 4x3     asymmetric 2x5
/// o  o  o  o        o . o .
/// o  o  o  o        . o . o
/// o  o  o  o        o . o .
///                   . o . o
///                   o . o .
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// Columns and rows one spacing apart (OpenCV's `CALIB_CB_SYMMETRIC_GRID`).
    Symmetric,
    /// Rows one spacing apart, circles of a row two; every second row is shifted by one (OpenCV's
    /// `CALIB_CB_ASYMMETRIC_GRID`).
    Asymmetric,
}

/// A board of circles. Index = `row · columns + column`, as OpenCV's `findCirclesGrid` counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct CircleBoard {
    /// Layout.
    pub kind: Kind,
    /// Circles in a row × rows.
    pub size: BoardSize,
}

impl CircleBoard {
    /// Number of circles.
    pub const fn len(self) -> usize {
        self.size.len()
    }

    /// Whether it has no circle.
    pub const fn is_empty(self) -> bool {
        self.size.is_empty()
    }

    /// Place of a circle's centre in spacings: `[x, y]`.
    pub const fn place(self, index: u32) -> [i32; 2] {
        let [col, row] = self.size.at(index);
        let (col, row) = (col as i32, row as i32);
        match self.kind {
            Kind::Symmetric => [col, row],
            Kind::Asymmetric => [2 * col + row % 2, row],
        }
    }

    /// The circle at a place in spacings; `None` where there is none.
    pub const fn at(self, [x, y]: [i32; 2]) -> Option<u32> {
        let ([w, h], col) = match self.kind {
            Kind::Symmetric => (self.extent(), x),
            Kind::Asymmetric if (x + y).rem_euclid(2) == 0 => (self.extent(), x / 2),
            Kind::Asymmetric => return None,
        };
        if x < 0 || y < 0 || x >= w || y >= h {
            return None;
        }
        Some(self.size.index(col as u32, y as u32))
    }

    /// Spacings along x and y that hold circles: places are in `0..extent`.
    pub const fn extent(self) -> [i32; 2] {
        let (cols, rows) = (self.size.cols as i32, self.size.rows as i32);
        match self.kind {
            Kind::Symmetric => [cols, rows],
            Kind::Asymmetric => [2 * cols, rows],
        }
    }

    /// Distance of neighbours on the square lattice, in spacings.
    pub const fn pitch(self) -> f64 {
        match self.kind {
            Kind::Symmetric => 1.0,
            Kind::Asymmetric => std::f64::consts::SQRT_2,
        }
    }

    /// Number of orders in which the circles could be counted, not mirrored: symmetric boards look the same after half a
    /// turn, square ones after a quarter; asymmetric ones after half a turn where the number of rows is even.
    pub const fn rotations(self) -> usize {
        match self.kind {
            Kind::Symmetric => self.size.rotations(),
            Kind::Asymmetric => 2 - self.size.rows as usize % 2,
        }
    }

    /// Centre of circle `index` in the board frame, in the unit of `spacing`; `None` outside the board.
    pub fn point(self, index: u32, spacing: f64) -> Option<Point3<f64>> {
        let [x, y] = self.place(index);
        ((index as usize) < self.len())
            .then(|| Point3::new(f64::from(x) * spacing, f64::from(y) * spacing, 0.0))
    }

    /// Centres of all circles in the board frame, by index, z = 0, in the unit of `spacing` (of an asymmetric board: the
    /// distance of its rows).
    pub fn points(self, spacing: f64) -> Vec<Point3<f64>> {
        (0..self.len() as u32).filter_map(|i| self.point(i, spacing)).collect()
    }
}

impl std::fmt::Display for CircleBoard {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let kind = match self.kind {
            Kind::Symmetric => "symmetric",
            Kind::Asymmetric => "asymmetric",
        };
        write!(f, "{kind} {}", self.size)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn board(kind: Kind, cols: u32, rows: u32) -> CircleBoard {
        CircleBoard { kind, size: BoardSize { cols, rows } }
    }

    #[test]
    fn places_follow_opencv() {
        let b = board(Kind::Asymmetric, 4, 11);
        for (i, p) in b.points(20.0).into_iter().enumerate() {
            let (row, col) = (i / 4, i % 4);
            assert_eq!(p, Point3::new((2 * col + row % 2) as f64 * 20.0, row as f64 * 20.0, 0.0));
        }
        let b = board(Kind::Symmetric, 4, 3);
        assert_eq!(b.points(2.0)[5], Point3::new(2.0, 2.0, 0.0));
        assert_eq!(b.point(12, 1.0), None);
    }

    #[test]
    fn indices_and_places_agree() {
        for kind in [Kind::Symmetric, Kind::Asymmetric] {
            let b = board(kind, 5, 4);
            assert!((0..20).all(|i| b.at(b.place(i)) == Some(i)));
            let [w, h] = b.extent();
            let seen = (-2..w + 2).flat_map(|x| (-2..h + 2).map(move |y| [x, y])).filter_map(|p| b.at(p));
            assert_eq!(seen.count(), 20);
        }
        assert_eq!([(4, 11), (4, 10)].map(|(c, r)| board(Kind::Asymmetric, c, r).rotations()), [1, 2]);
        assert_eq!([(4, 4), (4, 3)].map(|(c, r)| board(Kind::Symmetric, c, r).rotations()), [4, 2]);
    }
}
