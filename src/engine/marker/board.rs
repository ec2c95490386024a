//! Boards made of markers: where each marker and each corner lies, and which corners a picture shows.

use nalgebra::{Point3, Vector2};
use serde::{Deserialize, Serialize};

use super::{Sighting, dictionary::Dictionary};
pub use super::{aprilgrid::AprilGrid, aruco_grid::ArucoGrid, charuco::Charuco};
use crate::{json::need, observation::Corner, target::BoardSize};

/// A board made of markers. Its frame is that of all boards: x along the columns, y along the rows (down, as the board is read),
/// z = 0; lengths are in the unit of the board.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", try_from = "Wire")]
pub enum MarkerBoard {
    /// A checkerboard with markers in its white squares.
    Charuco(Charuco),
    /// Kalibr's grid of tags that touch small squares.
    AprilGrid(AprilGrid),
    /// A plain grid of markers.
    ArucoGrid(ArucoGrid),
}

/// All boards in one: serde's way to read by `kind` keeps every value twice, and a page would load what does so.
#[derive(Deserialize)]
struct Wire {
    kind: String,
    columns: u32,
    rows: u32,
    dictionary: Dictionary,
    border: u8,
    first_id: u32,
    square: Option<f64>,
    marker: Option<f64>,
    tag: Option<f64>,
    spacing: Option<f64>,
    gap: Option<f64>,
    legacy: Option<bool>,
}

impl TryFrom<Wire> for MarkerBoard {
    type Error = String;

    fn try_from(wire: Wire) -> Result<Self, String> {
        let Wire { kind, columns, rows, dictionary, border, first_id, legacy, .. } = wire;
        Ok(match kind.as_str() {
            "charuco" => Self::Charuco(Charuco {
                columns,
                rows,
                square: need(wire.square, "square")?,
                marker: need(wire.marker, "marker")?,
                dictionary,
                border,
                first_id,
                legacy,
            }),
            "april_grid" => Self::AprilGrid(AprilGrid {
                columns,
                rows,
                tag: need(wire.tag, "tag")?,
                spacing: need(wire.spacing, "spacing")?,
                dictionary,
                border,
                first_id,
            }),
            "aruco_grid" => Self::ArucoGrid(ArucoGrid {
                columns,
                rows,
                marker: need(wire.marker, "marker")?,
                gap: need(wire.gap, "gap")?,
                dictionary,
                border,
                first_id,
            }),
            other => return Err(format!("unknown kind of board `{other}`")),
        })
    }
}

/// What a picture shows of a board.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Located {
    /// Corners in ascending order of index, each at most once.
    pub corners: Vec<Corner>,
    /// Markers of the board that were recognised.
    pub markers: u32,
    /// The print is white on black.
    pub inverted: bool,
    /// Why there are no corners, in words that help; empty where there are some.
    pub why: String,
    /// What the user may want to know: a second board, the layout that was taken.
    pub notes: Vec<String>,
}

impl MarkerBoard {
    /// Name of the kind.
    pub const fn kind(&self) -> &'static str {
        match self {
            Self::Charuco(_) => "charuco",
            Self::AprilGrid(_) => "aprilgrid",
            Self::ArucoGrid(_) => "arucogrid",
        }
    }

    /// Squares (ChArUco) or markers along x and y.
    pub const fn size(&self) -> BoardSize {
        let (cols, rows) = match self {
            Self::Charuco(b) => (b.columns, b.rows),
            Self::AprilGrid(b) => (b.columns, b.rows),
            Self::ArucoGrid(b) => (b.columns, b.rows),
        };
        BoardSize { cols, rows }
    }

    /// Points in the board frame, by index.
    pub fn points(&self) -> Vec<Point3<f64>> {
        match self {
            Self::Charuco(b) => b.points(),
            Self::AprilGrid(b) => b.points(),
            Self::ArucoGrid(b) => b.points(),
        }
    }

    /// The corners of this board that a picture shows. No pixels are read.
    pub fn locate(&self, sighting: &Sighting) -> Located {
        match self {
            Self::Charuco(b) => b.locate(sighting),
            Self::AprilGrid(b) => b.locate(sighting),
            Self::ArucoGrid(b) => b.locate(sighting),
        }
    }
}

impl std::fmt::Display for MarkerBoard {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Charuco(b) => write!(
                f,
                "ChArUco board of {}x{} squares, {}, markers of {:.2} squares",
                b.columns,
                b.rows,
                b.dictionary,
                b.marker / b.square
            ),
            Self::AprilGrid(b) => {
                write!(
                    f,
                    "AprilGrid of {}x{} tags, {}, spacing {:.2}",
                    b.columns, b.rows, b.dictionary, b.spacing
                )
            }
            Self::ArucoGrid(b) => write!(
                f,
                "ArUco grid of {}x{} markers, {}, gaps of {:.2} markers",
                b.columns,
                b.rows,
                b.dictionary,
                b.gap / b.marker
            ),
        }
    }
}

/// The markers of a board.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Layout {
    pub(super) dictionary: Dictionary,
    /// Width of the black border, cells.
    pub(super) border: u8,
    /// Id of the first marker; the others follow.
    pub(super) first_id: u32,
    /// Corners of each marker in the board's plane, in the order of its code: upper left, upper right, lower right, lower left of
    /// the marker the right way up. Empty places have no marker.
    pub(super) marks: Vec<[Vector2<f64>; 4]>,
}

/// A square with its upper left corner at (x, y), clockwise from there.
pub(super) fn square(x: f64, y: f64, side: f64) -> [Vector2<f64>; 4] {
    [[x, y], [x + side, y], [x + side, y + side], [x, y + side]].map(Vector2::from)
}

/// Why a picture of which no marker of the board was recognised shows none.
pub(super) fn nothing(sighting: &Sighting, layout: &Layout) -> Located {
    let d = layout.dictionary;
    let marks = sighting.marks.len();
    let mirrored = sighting.marks.iter().filter(|m| m.identify_mirrored(d).is_some()).count();
    let of_border = |border: u8| {
        sighting.marks.iter().filter(|m| m.identify(d).is_some() && m.has_border(d, border)).count()
    };
    let other_border = [1, 2].into_iter().find(|b| *b != layout.border && of_border(*b) >= 2);
    let ids = layout.first_id..layout.first_id + layout.marks.len() as u32;
    let recognised = sighting.marks.iter().filter_map(|m| m.identify(d));
    let (own, foreign): (Vec<_>, Vec<_>) = recognised.partition(|i| ids.contains(&i.id));
    let (own, foreign) = (own.len(), foreign.len());
    let why = if marks == 0 {
        "no markers were found: the border of a marker must be black all around on white (or white on black), at least 12 px wide and sharp"
            .to_owned()
    } else if mirrored >= 2 && mirrored > own {
        format!(
            "{mirrored} markers of {d} are mirrored: the print or the picture is reversed left to right; print the board again, or turn the mirroring of the camera off"
        )
    } else if let Some(b) = other_border {
        format!("the markers have a border of {b} cells, not of {}: say so", layout.border)
    } else if foreign >= 2 {
        format!(
            "{foreign} markers of {d} are not among ids {} to {}: the board is another one",
            ids.start,
            ids.end - 1
        )
    } else if own >= 2 {
        format!(
            "{own} markers of {d} were recognised, but they do not stand as on this board: check its size and how large its markers are"
        )
    } else {
        format!(
            "none of {marks} squares that look like markers is of {d} in the right place: try another dictionary"
        )
    };
    Located { why, ..Located::default() }
}
