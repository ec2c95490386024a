//! A board in words, as one types it: `9x6`, `charuco:11x8:5x5_250:marker=0.75`.

use serde::{Deserialize, Serialize};
use std::{fmt, str::FromStr};

use super::Kind;
use crate::calib::{
    Error, Result,
    circles::{self, CircleBoard},
    marker::{
        board::{AprilGrid, ArucoGrid, Charuco, MarkerBoard},
        dictionary::Dictionary,
    },
    target::{BoardSize, Length, Target, Unit},
};

/// Edge of a marker in a square of a ChArUco board where it is not given.
const MARKER: f64 = 0.75;
/// Gap between tags of an AprilGrid where it is not given, in tags: Kalibr's.
const TAG_GAP: f64 = 0.3;
/// Gap between markers where it is not given, in markers.
const MARKER_GAP: f64 = 0.4;
/// Diameter of a circle where it is not given, in distances of neighbours.
const DIAMETER: f64 = 0.6;

/// What a board is made of, but for the length of its square.
///
/// In words `[KIND:]CxR[:DICTIONARY][:marker|gap|diameter=SHARE][:first=ID][:border=CELLS][:legacy]`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(into = "String", try_from = "Wire")]
pub struct Design {
    /// What it is made of.
    pub kind: Kind,
    /// What [`Kind::counts`] says, columns × rows.
    pub size: BoardSize,
    /// What [`Kind::inner`] names, as a share of what [`Kind::length`] says; none takes the usual one.
    pub inner: Option<f64>,
    /// What the markers are from; none takes the usual one.
    pub dictionary: Option<Dictionary>,
    /// Id of the first marker.
    pub first_id: u32,
    /// Width of the black border of markers, cells; none takes the usual one.
    pub border: Option<u8>,
    /// Whether a ChArUco board is laid out as before OpenCV 4.6: with an even number of rows the first square is white.
    /// None: either, found in each picture.
    pub legacy: Option<bool>,
}

impl Design {
    /// A board with what is usual for its kind.
    pub const fn new(kind: Kind, size: BoardSize) -> Self {
        Self { kind, size, inner: None, dictionary: None, first_id: 0, border: None, legacy: None }
    }

    /// A checkerboard of so many inner corners.
    pub const fn checkerboard(size: BoardSize) -> Self {
        Self::new(Kind::Checkerboard, size)
    }

    /// That of a board which is known; `None` where none describes it.
    pub fn of(target: &Target) -> Option<Self> {
        let marked = |kind, [cols, rows]: [u32; 2], inner, dictionary, first_id, border| Self {
            inner: Some(inner),
            dictionary: Some(dictionary),
            first_id,
            border: Some(border),
            ..Self::new(kind, BoardSize { cols, rows })
        };
        Some(match *target {
            Target::Points { .. } => return None,
            Target::Checkerboard { size, .. } => Self::checkerboard(size),
            Target::Circles { board: CircleBoard { kind, size }, spacing, radius } => {
                let kind = match kind {
                    circles::Kind::Symmetric => Kind::Circles,
                    circles::Kind::Asymmetric => Kind::AsymmetricCircles,
                };
                Self { inner: Some(2.0 * radius / spacing), ..Self::new(kind, size) }
            }
            Target::Markers { board: MarkerBoard::Charuco(b), .. } => {
                let (size, marker) = ([b.columns, b.rows], b.marker / b.square);
                let design = marked(Kind::Charuco, size, marker, b.dictionary, b.first_id, b.border);
                Self { legacy: b.legacy, ..design }
            }
            Target::Markers { board: MarkerBoard::AprilGrid(b), .. } => {
                let size = [b.columns, b.rows];
                marked(Kind::AprilGrid, size, b.spacing, b.dictionary, b.first_id, b.border)
            }
            Target::Markers { board: MarkerBoard::ArucoGrid(b), .. } => {
                let (size, gap) = ([b.columns, b.rows], b.gap / b.marker);
                marked(Kind::ArucoGrid, size, gap, b.dictionary, b.first_id, b.border)
            }
        })
    }

    /// The board with lengths in the unit of `scale`, which is what [`Kind::length`] names; messages tell them in that of `edge`.
    ///
    /// # Errors
    /// [`Error::Invalid`] where a share cannot be told apart in a picture, and for a dictionary with too few markers.
    pub fn target(&self, edge: Length, scale: f64) -> Result<Target> {
        let share = |what: &str, usual: f64, least: f64, most: f64| {
            self.within(what, self.inner.unwrap_or(usual), [least, most], edge)
        };
        let [columns, rows] = [self.size.cols, self.size.rows];
        let first_id = self.first_id;
        let dictionary = || match self.dictionary {
            Some(dictionary) => Ok(dictionary),
            None => self.kind.usual_dictionary().unwrap_or_default().parse(),
        };
        let board = match self.kind {
            Kind::Checkerboard => return Ok(Target::checkerboard(self.size, scale)),
            Kind::Circles | Kind::AsymmetricCircles => {
                let kind = match self.kind {
                    Kind::Circles => circles::Kind::Symmetric,
                    _ => circles::Kind::Asymmetric,
                };
                let board = CircleBoard { kind, size: self.size };
                let pitch = board.pitch();
                let diameter = share("a circle", DIAMETER * pitch, 0.1 * pitch, 0.9 * pitch)?;
                return Ok(Target::Circles { board, spacing: scale, radius: 0.5 * diameter * scale });
            }
            Kind::Charuco => MarkerBoard::Charuco(Charuco {
                columns,
                rows,
                square: 1.0,
                marker: share("a marker", MARKER, 0.3, 0.95)?,
                dictionary: dictionary()?,
                border: self.border.unwrap_or(1),
                first_id,
                legacy: self.legacy,
            }),
            Kind::AprilGrid => MarkerBoard::AprilGrid(AprilGrid {
                columns,
                rows,
                tag: 1.0,
                spacing: share("a gap", TAG_GAP, 0.1, 1.0)?,
                dictionary: dictionary()?,
                border: self.border.unwrap_or(2),
                first_id,
            }),
            Kind::ArucoGrid => MarkerBoard::ArucoGrid(ArucoGrid {
                columns,
                rows,
                marker: 1.0,
                gap: share("a gap", MARKER_GAP, 0.1, 3.0)?,
                dictionary: dictionary()?,
                border: self.border.unwrap_or(1),
                first_id,
            }),
        };
        Ok(Target::Markers { board, scale })
    }

    /// As part of a sentence: `a 9x6 board`.
    pub fn words(&self) -> String {
        let size = self.size;
        match self.kind {
            Kind::Checkerboard => format!("{} {size} board", size.article()),
            kind => format!("{} of {size} {}", kind.with_article(), kind.counts().to_lowercase()),
        }
    }

    /// Refuses a share of the edge that cannot be told apart in a picture.
    fn within(&self, what: &str, share: f64, [least, most]: [f64; 2], edge: Length) -> Result<f64> {
        // The share comes out of a division.
        if (least * (1.0 - 1e-9)..=most * (1.0 + 1e-9)).contains(&share) {
            return Ok(share);
        }
        let length = |share: f64| edge.times(share);
        Err(Error::Invalid(format!(
            "{what} of {} does not fit a board of {edge}: give {} to {}",
            length(share),
            length(least),
            length(most)
        )))
    }

    /// Refuses what cannot be found in pictures.
    ///
    /// # Errors
    /// As [`Design::target`], and for a checkerboard that is too small.
    pub fn findable(self) -> Result<Self> {
        let one = Length { value: 1.0, unit: Unit::Unspecified };
        match self.kind {
            Kind::Checkerboard => self.size.findable().map(|_| self),
            _ => {
                if let Target::Markers { board, .. } = self.target(one, 1.0)? {
                    board.fits_its_dictionary()?;
                }
                Ok(self)
            }
        }
    }
}

impl FromStr for Design {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let wrong = |why: &str| {
            Error::Invalid(format!(
                "\"{text}\" is not a board: {why}; write for example 9x6, charuco:11x8:5x5_250:marker=0.75, aprilgrid:6x6, acircles:4x11"
            ))
        };
        let mut words = text.split(':').map(str::trim).peekable();
        let kind = match words.peek().map(|word| word.parse::<Kind>()) {
            Some(Ok(kind)) => {
                words.next();
                kind
            }
            Some(Err(error)) if words.clone().count() > 1 => return Err(error),
            _ => Kind::Checkerboard,
        };
        let size =
            words.next().ok_or_else(|| wrong(&format!("how many {}?", kind.counts().to_lowercase())))?;
        let mut design = Self::new(kind, size.parse()?);
        for word in words {
            match word.split_once('=').map(|(name, value)| (name.trim(), value.trim())) {
                Some((name, value)) if kind.inner() == Some(name) => {
                    let share = value.replace(',', ".").parse().ok().filter(|v: &f64| v.is_finite());
                    design.inner = Some(share.ok_or_else(|| {
                        wrong(&format!("{name} is a share of the {}", kind.length().to_lowercase()))
                    })?);
                }
                Some(("first", value)) if kind.has_markers() => {
                    let id = value.parse().ok().filter(|id| *id < 1_000_000);
                    design.first_id = id.ok_or_else(|| wrong("first is the id of a marker"))?;
                }
                Some(("border", value)) if kind.has_markers() => {
                    let cells = value.parse().ok().filter(|cells| (1..=2).contains(cells));
                    design.border = Some(cells.ok_or_else(|| wrong("border is 1 or 2 cells"))?);
                }
                None if word == "legacy" && kind == Kind::Charuco => design.legacy = Some(true),
                None if kind.has_markers() => design.dictionary = Some(word.parse()?),
                _ => return Err(wrong(&format!("{word} says nothing about a board of kind {kind}"))),
            }
        }
        design.findable()
    }
}

impl fmt::Display for Design {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.kind != Kind::Checkerboard {
            write!(f, "{}:", self.kind)?;
        }
        self.size.fmt(f)?;
        if let Some(dictionary) = self.dictionary {
            write!(f, ":{dictionary}")?;
        }
        if let (Some(name), Some(share)) = (self.kind.inner(), self.inner) {
            write!(f, ":{name}={share}")?;
        }
        if self.first_id > 0 {
            write!(f, ":first={}", self.first_id)?;
        }
        if let Some(border) = self.border {
            write!(f, ":border={border}")?;
        }
        if self.legacy == Some(true) {
            f.write_str(":legacy")?;
        }
        Ok(())
    }
}

impl From<Design> for String {
    fn from(design: Design) -> Self {
        design.to_string()
    }
}

/// Words, or the `{cols, rows}` of a checkerboard, as sessions held it before there were other boards.
#[derive(Deserialize)]
#[serde(transparent)]
struct Wire(serde_json::Value);

impl TryFrom<Wire> for Design {
    type Error = String;

    fn try_from(Wire(value): Wire) -> std::result::Result<Self, String> {
        match value.as_str() {
            Some(words) => words.parse().map_err(|e: Error| e.to_string()),
            None => serde_json::from_value(value).map(Self::checkerboard).map_err(|e| e.to_string()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boards_are_read_as_they_are_written() {
        for words in [
            "9x6",
            "charuco:11x8",
            "charuco:11x8:5x5_250:marker=0.7:first=4:legacy",
            "aprilgrid:6x6:36h11:gap=0.3",
            "aruco-grid:7x5:4x4_100:gap=0.5:border=2",
            "circles:9x7",
            "acircles:4x11:diameter=0.9",
        ] {
            let design: Design = words.parse().unwrap();
            assert_eq!(design.to_string(), words);
            let json = serde_json::to_string(&design).unwrap();
            assert_eq!(serde_json::from_str::<Design>(&json).unwrap(), design);
        }
        assert_eq!("checkerboard : 9 × 6".parse::<Design>().unwrap().to_string(), "9x6");
        let old: Design = serde_json::from_str("{\"cols\": 9, \"rows\": 6}").unwrap();
        assert_eq!(old, "9x6".parse().unwrap());
    }

    #[test]
    fn what_is_no_board_is_told() {
        for (words, says) in [
            ("9", "not a board size"),
            ("3x3", "at least 4x3"),
            ("chess:9x6", "charuco, aprilgrid"),
            ("charuco", "how many squares?"),
            ("charuco:11x8:9x9_50", "9x9_50"),
            ("charuco:11x8:marker=1.2", "a marker of 1.2 does not fit a board of 1: give 0.3 to 0.95"),
            ("charuco:11x8:marker=wide", "marker is a share of the edge of a square"),
            ("charuco:11x8:gap=0.2", "says nothing about a board of kind charuco"),
            ("aprilgrid:60x60", "markers"),
            ("circles:9x7:5x5_250", "says nothing"),
            ("aruco-grid:7x5:border=3", "border is 1 or 2 cells"),
        ] {
            let error = words.parse::<Design>().unwrap_err().to_string();
            assert!(error.contains(says), "{words}: {error}");
        }
    }
}
