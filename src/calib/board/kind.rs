//! Kinds of printed boards.

use std::{fmt, str::FromStr};

use crate::calib::{Error, Result};

/// Kind of printed board.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Kind {
    /// Black and white squares.
    #[default]
    Checkerboard,
    /// A checkerboard with markers in its white squares.
    Charuco,
    /// Kalibr's grid of tags that touch small squares.
    AprilGrid,
    /// A plain grid of markers.
    ArucoGrid,
    /// Circles in columns and rows.
    Circles,
    /// Circles of which every second row is shifted.
    AsymmetricCircles,
}

impl Kind {
    /// All kinds.
    pub const ALL: [Self; 6] = [
        Self::Checkerboard,
        Self::Charuco,
        Self::AprilGrid,
        Self::ArucoGrid,
        Self::Circles,
        Self::AsymmetricCircles,
    ];

    /// Name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Checkerboard => "checkerboard",
            Self::Charuco => "charuco",
            Self::AprilGrid => "aprilgrid",
            Self::ArucoGrid => "aruco-grid",
            Self::Circles => "circles",
            Self::AsymmetricCircles => "acircles",
        }
    }

    /// Name for people.
    pub const fn title(self) -> &'static str {
        match self {
            Self::Checkerboard => "Checkerboard",
            Self::Charuco => "ChArUco",
            Self::AprilGrid => "AprilGrid",
            Self::ArucoGrid => "ArUco grid",
            Self::Circles => "Circles",
            Self::AsymmetricCircles => "Asymmetric circles",
        }
    }

    /// As part of a sentence.
    pub const fn with_article(self) -> &'static str {
        match self {
            Self::Checkerboard => "a checkerboard",
            Self::Charuco => "a ChArUco board",
            Self::AprilGrid => "an AprilGrid",
            Self::ArucoGrid => "an ArUco grid",
            Self::Circles => "a circle grid",
            Self::AsymmetricCircles => "an asymmetric circle grid",
        }
    }

    /// What its size counts, columns x rows.
    pub const fn counts(self) -> &'static str {
        match self {
            Self::Checkerboard => "Inner corners",
            Self::Charuco => "Squares",
            Self::AprilGrid => "Tags",
            Self::ArucoGrid => "Markers",
            Self::Circles | Self::AsymmetricCircles => "Circles",
        }
    }

    /// What its length is.
    pub const fn length(self) -> &'static str {
        match self {
            Self::Checkerboard | Self::Charuco => "Edge of a square",
            Self::AprilGrid => "Edge of a tag",
            Self::ArucoGrid => "Edge of a marker",
            Self::Circles => "Spacing",
            Self::AsymmetricCircles => "Spacing of the rows",
        }
    }

    /// What lies within that length, by its name in words.
    pub const fn inner(self) -> Option<&'static str> {
        match self {
            Self::Checkerboard => None,
            Self::Charuco => Some("marker"),
            Self::AprilGrid | Self::ArucoGrid => Some("gap"),
            Self::Circles | Self::AsymmetricCircles => Some("diameter"),
        }
    }

    /// A size that is often seen.
    pub const fn usual_size(self) -> &'static str {
        match self {
            Self::Checkerboard => "9x6",
            Self::Charuco => "11x8",
            Self::AprilGrid => "6x6",
            Self::ArucoGrid => "7x5",
            Self::Circles => "9x7",
            Self::AsymmetricCircles => "4x11",
        }
    }

    /// The same as the label of a field.
    pub const fn inner_title(self) -> Option<&'static str> {
        match self {
            Self::Checkerboard => None,
            Self::Charuco => Some("Edge of a marker"),
            Self::AprilGrid => Some("Gap between tags"),
            Self::ArucoGrid => Some("Gap between markers"),
            Self::Circles | Self::AsymmetricCircles => Some("Diameter"),
        }
    }

    /// The dictionary of its markers where none is named, where it has some: of an AprilGrid Kalibr's, else one whose codes differ in six
    /// bits at least.
    pub const fn usual_dictionary(self) -> Option<&'static str> {
        match self {
            Self::AprilGrid => Some("36h11"),
            Self::Charuco | Self::ArucoGrid => Some("5x5_250"),
            Self::Checkerboard | Self::Circles | Self::AsymmetricCircles => None,
        }
    }

    /// Whether it is made of markers of a dictionary.
    pub const fn has_markers(self) -> bool {
        self.usual_dictionary().is_some()
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Kind {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        Self::ALL.into_iter().find(|k| k.name().eq_ignore_ascii_case(text)).ok_or_else(|| {
            let names: Vec<_> = Self::ALL.iter().map(|k| k.name()).collect();
            Error::Invalid(format!("\"{text}\" is not a kind of board: choose one of {}", names.join(", ")))
        })
    }
}
