//! The known object in front of the camera.

mod points;

use nalgebra::{Point3, Vector3};
use serde::{Deserialize, Serialize};
use std::{fmt, str::FromStr};

use super::{
    Error, Result,
    circles::{CircleBoard, Kind},
    json::need,
    marker::board::MarkerBoard,
    spread::IN_SPACE,
};
pub use points::PointSet;

/// Unit of a typed length.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Unit {
    /// Millimetres.
    Mm,
    /// Centimetres.
    Cm,
    /// Metres.
    M,
    /// Inches.
    In,
    /// Not said: lengths are in whatever unit the number was in.
    #[serde(rename = "unit")]
    Unspecified,
    /// No square size is known: lengths are in squares.
    Squares,
}

impl Unit {
    /// As shown after a number.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Mm => "mm",
            Self::Cm => "cm",
            Self::M => "m",
            Self::In => "in",
            Self::Unspecified => "unit",
            Self::Squares => "squares",
        }
    }

    /// Metres in one of this unit; `None` where it is not a length of the world.
    pub const fn metres(self) -> Option<f64> {
        match self {
            Self::Mm => Some(1e-3),
            Self::Cm => Some(1e-2),
            Self::M => Some(1.0),
            Self::In => Some(0.0254),
            Self::Unspecified | Self::Squares => None,
        }
    }
}

/// A positive length with its unit, as typed: `25mm`, `1in`, `2,54 cm`, `30`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Length {
    /// In `unit`; finite and > 0.
    pub value: f64,
    /// Unit.
    pub unit: Unit,
}

impl Length {
    /// A multiple of it, without the last digits of the product.
    #[must_use]
    pub fn times(self, share: f64) -> Self {
        Self { value: (share * self.value * 1e6).round() / 1e6, ..self }
    }
}

impl FromStr for Length {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let wrong = || {
            Error::Invalid(format!("\"{text}\" is not a length: write for example 25mm, 2.5cm, 1in or 30"))
        };
        let t = text.trim().to_lowercase();
        let split = t.find(|c: char| c.is_alphabetic() && c != 'e').unwrap_or(t.len());
        let (number, unit) = t.split_at(split);
        let unit = match unit.trim() {
            "" => Unit::Unspecified,
            "mm" => Unit::Mm,
            "cm" => Unit::Cm,
            "m" => Unit::M,
            "in" | "inch" | "inches" => Unit::In,
            _ => return Err(wrong()),
        };
        let value: f64 = number.trim().replace(',', ".").parse().map_err(|_| wrong())?;
        if !(value.is_finite() && value > 0.0) {
            return Err(Error::Invalid(format!("a length must be greater than zero, \"{text}\" is not")));
        }
        Ok(Self { value, unit })
    }
}

impl fmt::Display for Length {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.unit {
            Unit::Unspecified => write!(f, "{}", self.value),
            unit => write!(f, "{} {}", self.value, unit.name()),
        }
    }
}

/// Size of a checkerboard in *inner* corners: columns × rows, `6x9` is not `9x6`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct BoardSize {
    /// Inner corners along x.
    pub cols: u32,
    /// Inner corners along y.
    pub rows: u32,
}

impl BoardSize {
    /// Number of inner corners.
    pub const fn len(self) -> usize {
        self.cols as usize * self.rows as usize
    }

    /// `a` or `an`, as its name is spoken: an 8x6 board.
    pub fn article(self) -> &'static str {
        if matches!(self.cols, 11 | 18) || self.cols.to_string().starts_with('8') { "an" } else { "a" }
    }

    /// Never: a board has at least 2 × 2 corners.
    pub const fn is_empty(self) -> bool {
        self.len() == 0
    }

    /// Index of the corner in column `col` and row `row`.
    pub const fn index(self, col: u32, row: u32) -> u32 {
        row * self.cols + col
    }

    /// `[column, row]` of an index.
    pub const fn at(self, index: u32) -> [u32; 2] {
        [index % self.cols, index / self.cols]
    }

    /// Number of orders in which the corners could be counted when colours are ignored but the board is not mirrored:
    /// 2, or 4 where columns = rows.
    pub const fn rotations(self) -> usize {
        if self.cols == self.rows { 4 } else { 2 }
    }
}

impl BoardSize {
    /// Refuses a board that detection cannot find.
    ///
    /// # Errors
    /// [`Error::Invalid`] below 12 inner corners, or 3 columns or rows.
    pub fn findable(self) -> Result<Self> {
        if self.cols.min(self.rows) >= 3 && self.len() >= 12 {
            return Ok(self);
        }
        Err(Error::Invalid(format!(
            "a board of {self} inner corners is too small to be found: at least 4x3 inner corners are needed (5x4 squares)"
        )))
    }
}

impl FromStr for BoardSize {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let wrong = || {
            Error::Invalid(format!(
                "\"{text}\" is not a board size: write inner corners as columns x rows, for example 9x6, each from 2 to 500"
            ))
        };
        let lower = text.trim().to_lowercase().replace(['×', '*'], "x");
        let (c, r) = lower.split_once('x').ok_or_else(wrong)?;
        let parse = |s: &str| s.trim().parse::<u32>().ok().filter(|n| (2..=500).contains(n));
        match (parse(c), parse(r)) {
            (Some(cols), Some(rows)) => Ok(Self { cols, rows }),
            _ => Err(wrong()),
        }
    }
}

impl fmt::Display for BoardSize {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}x{}", self.cols, self.rows)
    }
}

/// The known object: its points in the board frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", try_from = "Wire")]
pub enum Target {
    /// Inner corners of a checkerboard, `square` apart, corner 0 at the origin.
    Checkerboard {
        /// Inner corners.
        size: BoardSize,
        /// Edge of a square in the user's unit.
        square: f64,
    },
    /// A board of square markers.
    Markers {
        /// The board, its lengths in squares (ChArUco) or markers.
        board: MarkerBoard,
        /// One of those in the user's unit.
        scale: f64,
    },
    /// A grid of circles.
    Circles {
        /// Kind and size.
        board: CircleBoard,
        /// Spacing in the user's unit.
        spacing: f64,
        /// Radius of a circle in the same unit, as the pictures show it.
        radius: f64,
    },
    /// Surveyed points, flat or not, in the user's unit.
    Points {
        /// The points.
        points: PointSet,
    },
}

/// All targets in one, for the reason of [`MarkerBoard`]'s.
#[derive(Deserialize)]
struct Wire {
    kind: String,
    size: Option<BoardSize>,
    square: Option<f64>,
    board: Option<serde_json::Value>,
    scale: Option<f64>,
    spacing: Option<f64>,
    radius: Option<f64>,
    points: Option<PointSet>,
}

impl TryFrom<Wire> for Target {
    type Error = String;

    fn try_from(wire: Wire) -> std::result::Result<Self, String> {
        let board = || need(wire.board, "board");
        let wrong = |e: serde_json::Error| e.to_string();
        Ok(match wire.kind.as_str() {
            "checkerboard" => {
                Self::Checkerboard { size: need(wire.size, "size")?, square: need(wire.square, "square")? }
            }
            "markers" => Self::Markers {
                board: serde_json::from_value(board()?).map_err(wrong)?,
                scale: need(wire.scale, "scale")?,
            },
            "circles" => Self::Circles {
                board: serde_json::from_value(board()?).map_err(wrong)?,
                spacing: need(wire.spacing, "spacing")?,
                radius: need(wire.radius, "radius")?,
            },
            "points" => Self::Points { points: need(wire.points, "points")? },
            other => return Err(format!("unknown kind of target `{other}`")),
        })
    }
}

impl Target {
    /// A checkerboard of `size` inner corners with squares of `square` units.
    pub const fn checkerboard(size: BoardSize, square: f64) -> Self {
        Self::Checkerboard { size, square }
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        match self {
            Self::Checkerboard { size, .. } => size.len(),
            Self::Markers { board, .. } => board.points().len(),
            Self::Circles { board, .. } => board.len(),
            Self::Points { points } => points.points().len(),
        }
    }

    /// What it is, as short as can be.
    pub fn name(&self) -> String {
        match self {
            Self::Checkerboard { size, .. } => format!("{} × {}", size.cols, size.rows),
            Self::Markers { board, .. } => {
                let kind = match board {
                    MarkerBoard::Charuco(_) => "ChArUco",
                    MarkerBoard::AprilGrid(_) => "AprilGrid",
                    MarkerBoard::ArucoGrid(_) => "ArUco",
                };
                let BoardSize { cols, rows } = board.size();
                format!("{kind} {cols} × {rows}")
            }
            Self::Circles { board, .. } => format!("Circles {} × {}", board.size.cols, board.size.rows),
            Self::Points { .. } => format!("{} points", self.len()),
        }
    }

    /// What it is, in words; empty for a checkerboard.
    pub fn words(&self) -> String {
        match self {
            Self::Checkerboard { .. } => String::new(),
            Self::Markers { board, .. } => board.to_string(),
            Self::Circles { board, .. } => format!("circle grid {board}"),
            Self::Points { .. } => {
                format!("{} known points{}", self.len(), if self.is_solid() { "" } else { " in a plane" })
            }
        }
    }

    /// Points along x and y, where every place of the grid is a point counted row by row, as on a checkerboard.
    pub fn grid(&self) -> Option<BoardSize> {
        match *self {
            Self::Checkerboard { size, .. } => Some(size),
            Self::Markers { board: MarkerBoard::Charuco(b), .. } => {
                Some(BoardSize { cols: b.columns.saturating_sub(1), rows: b.rows.saturating_sub(1) })
            }
            Self::Circles { board: CircleBoard { kind: Kind::Symmetric, size }, .. } => Some(size),
            Self::Markers { .. } | Self::Circles { .. } | Self::Points { .. } => None,
        }
    }

    /// Whether its points are not in a plane: then one picture may determine a camera.
    pub fn is_solid(&self) -> bool {
        IN_SPACE && matches!(self, Self::Points { points } if points.plane().is_solid())
    }

    /// Normal of the plane that its points are in or near, in the board frame.
    pub fn normal_in_board(&self) -> Vector3<f64> {
        match self {
            Self::Points { points } => points.plane().normal_in_board(),
            _ => Vector3::z(),
        }
    }

    /// Whether there is no point.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Point `index` in the board frame; `None` outside the target.
    pub fn point_in_board(&self, index: u32) -> Option<Point3<f64>> {
        match self {
            &Self::Checkerboard { size, square } => ((index as usize) < size.len()).then(|| {
                let [col, row] = size.at(index);
                Point3::new(f64::from(col) * square, f64::from(row) * square, 0.0)
            }),
            Self::Markers { board, scale } => board.points().get(index as usize).map(|p| p * *scale),
            Self::Circles { board, spacing, .. } => board.point(index, *spacing),
            Self::Points { points } => points.points().get(index as usize).copied(),
        }
    }

    /// All points in the board frame, by index.
    pub fn points_in_board(&self) -> Vec<Point3<f64>> {
        match self {
            Self::Markers { board, scale } => board.points().iter().map(|p| p * *scale).collect(),
            _ => (0..self.len() as u32).filter_map(|i| self.point_in_board(i)).collect(),
        }
    }

    /// Smallest and largest x and y of its points.
    pub fn extent(&self) -> [[f64; 2]; 2] {
        let [low, high] = self.bounds();
        [[low.x, low.y], [high.x, high.y]]
    }

    /// Corners of the box about its points, along the axes of the board frame.
    fn bounds(&self) -> [Point3<f64>; 2] {
        let points = self.points_in_board();
        let bound = |pick: fn(f64, f64) -> f64| {
            let extreme = points.iter().map(|p| p.coords).reduce(|a, b| a.zip_map(&b, pick));
            Point3::from(extreme.unwrap_or_default())
        };
        [bound(f64::min), bound(f64::max)]
    }

    /// Centre of the target in the board frame.
    pub fn center_in_board(&self) -> Point3<f64> {
        let [low, high] = self.bounds();
        nalgebra::center(&low, &high)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_are_read_as_people_write_them() {
        for (text, value, unit) in [
            ("25mm", 25.0, Unit::Mm),
            ("25,4 mm", 25.4, Unit::Mm),
            ("1in", 1.0, Unit::In),
            ("2.5cm", 2.5, Unit::Cm),
            ("0.03 m", 0.03, Unit::M),
            ("30", 30.0, Unit::Unspecified),
            ("1e-2m", 0.01, Unit::M),
        ] {
            assert_eq!(text.parse::<Length>(), Ok(Length { value, unit }), "{text}");
        }
        for text in ["", "0", "-25mm", "mm", "25 parsec", "nan", "inf", "1,2,3"] {
            assert!(text.parse::<Length>().is_err(), "{text}");
        }
    }

    #[test]
    fn board_sizes() {
        assert_eq!("9x6".parse::<BoardSize>(), Ok(BoardSize { cols: 9, rows: 6 }));
        assert_eq!(" 9 × 6 ".parse::<BoardSize>(), Ok(BoardSize { cols: 9, rows: 6 }));
        for text in ["", "9", "9x", "x6", "1x6", "9x-6", "9x6x2", "9x60000"] {
            assert!(text.parse::<BoardSize>().is_err(), "{text}");
        }
        let b = BoardSize { cols: 9, rows: 6 };
        assert!((0..54).all(|i| b.index(b.at(i)[0], b.at(i)[1]) == i));
    }

    #[test]
    fn points_follow_the_index() {
        let t = Target::checkerboard(BoardSize { cols: 3, rows: 2 }, 25.0);
        assert_eq!(t.point_in_board(5), Some(Point3::new(50.0, 25.0, 0.0)));
        assert_eq!(t.point_in_board(6), None);
        assert_eq!((t.points_in_board().len(), t.center_in_board()), (6, Point3::new(25.0, 12.5, 0.0)));
    }

    #[test]
    fn known_points_read_back() {
        let list = |n: usize| -> Vec<(String, Point3<f64>)> {
            (0..n).map(|i| (format!("p{i}"), Point3::new(i as f64, (i * i) as f64, 0.0))).collect()
        };
        let target = Target::Points { points: PointSet::new(list(5)).unwrap() };
        let json = serde_json::to_string(&target).unwrap();
        assert!(json.contains(r#"{"kind":"points","points":[["p0",0.0,0.0,0.0],"#), "{json}");
        assert_eq!(serde_json::from_str::<Target>(&json).unwrap(), target);
        assert_eq!((target.len(), target.point_in_board(5)), (5, None));
        assert_eq!(target.point_in_board(2), Some(Point3::new(2.0, 4.0, 0.0)));
        assert_eq!(target.center_in_board(), Point3::new(2.0, 8.0, 0.0));
        let mut twice = list(5);
        twice[3].0 = "p1".to_owned();
        let line =
            (0..5).map(|i| (i.to_string(), Point3::new(1.0, f64::from(i), 2.0 * f64::from(i)))).collect();
        for (bad, says) in [(list(3), "at least 4"), (twice, "p1 is given twice"), (line, "on a line")] {
            let error = PointSet::new(bad).unwrap_err().to_string();
            assert!(error.contains(says), "{error}");
        }
    }
}
