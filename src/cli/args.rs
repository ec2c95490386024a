//! Words and values that several commands share.

use std::{fmt, path::PathBuf, str::FromStr};

use crate::calib::{
    Error, Result,
    board::Design,
    calibrate::{Fix, parse_fixes},
    camera::Model,
    detect::{self, Refinement},
    report::Settings,
    target::{Length, Unit},
    undistort::{Framing, Projection},
};

/// The board of the pictures.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct Board {
    /// The board, or `auto` to find it from the pictures: inner corners of a checkerboard, columns x rows (9x6), or
    /// KIND:CxR, KIND of charuco (counts squares), aprilgrid (tags), aruco-grid (markers), circles, acircles; then, as far as known,
    /// :DICTIONARY :marker=SHARE (or gap=, diameter=) :first=ID :border=CELLS :legacy. What is left out is measured in the pictures
    #[arg(long, value_name = "BOARD|auto", default_value = "auto")]
    pub(super) board: BoardArg,
    /// Edge of a square (of a tag, of a marker; spacing of circles): 25mm, 2.5cm, 1in, 30 (any unit). Scales distances only, never the camera
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true)]
    pub(super) square: Option<Length>,
}

impl Board {
    /// Edge of a square and its unit; 1 square where nothing was said.
    pub(super) fn square(&self) -> (f64, Unit) {
        self.square.map_or((1.0, Unit::Squares), |s| (s.value, s.unit))
    }
}

/// What straightened pictures show.
#[derive(Clone, Copy, Debug, clap::Args)]
pub(super) struct Framed {
    /// perspective (straight lines stay straight), cylindrical (vertical lines do), equidistant (angles are lengths) or
    /// stereographic (shapes are kept); the last three for wide lenses, beyond 180° too
    #[arg(long, value_name = "NAME", default_value_t)]
    pub(super) projection: Projection,
    /// From 0 (only valid pixels) to 1 (all pixels of the photograph, black around them)
    #[arg(long, value_name = "0..1", default_value = "0", value_parser = alpha, allow_hyphen_values = true)]
    alpha: f64,
    /// Horizontal field of view of the results about the optical axis, instead of --alpha
    #[arg(long, value_name = "DEG", conflicts_with = "alpha", allow_hyphen_values = true)]
    fov: Option<f64>,
}

impl Framed {
    /// As the engine wants it.
    pub(super) fn framing(self) -> Framing {
        let Self { projection, alpha, fov } = self;
        Framing { projection, alpha, fov_rad: fov.map(f64::to_radians) }
    }
}

fn alpha(text: &str) -> Result<f64> {
    match text.trim().replace(',', ".").parse() {
        Ok(a) if (0.0..=1.0).contains(&a) => Ok(a),
        _ => Err(Error::Invalid(format!("\"{text}\" is not an alpha: give a number from 0 to 1"))),
    }
}

/// How pictures are read and searched.
#[derive(Clone, Copy, Debug, clap::Args)]
pub(super) struct Detecting {
    /// Refinement of corners below the pixel, for comparison: strip, gradient, gradient11 (half-window), off
    #[arg(long, value_name = "METHOD", default_value = "strip", help_heading = "For experiments")]
    pub(super) refine: Refinement,
    /// Smooth pictures by a Gaussian of this many px before the detection
    #[arg(long, value_name = "PX", default_value = "0", value_parser = sigma_px, allow_negative_numbers = true, help_heading = "For experiments")]
    pub(super) presmooth: f64,
    /// Pictures that are worked on at the same time [default: one for each processor]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub(super) threads: Option<u16>,
}

impl Detecting {
    /// As the detector wants it.
    pub(super) const fn options(self) -> detect::Options {
        detect::Options { refinement: self.refine, presmooth_px: self.presmooth }
    }

    /// As the report says it.
    pub(super) fn settings(self) -> Settings {
        Settings { refinement: self.refine, presmooth_px: self.presmooth, ..Settings::default() }
    }
}

fn sigma_px(text: &str) -> Result<f64> {
    match text.parse() {
        Ok(v) if (0.0..=20.0).contains(&v) => Ok(v),
        _ => Err(Error::Invalid(format!("\"{text}\" is not a width in px: give 0 to 20, for example 0.5"))),
    }
}

/// A board, or `auto`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct BoardArg(pub(super) Option<Design>);

impl FromStr for BoardArg {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        if text.trim().eq_ignore_ascii_case("auto") {
            return Ok(Self(None));
        }
        text.parse().map(|board| Self(Some(board)))
    }
}

impl fmt::Display for BoardArg {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Some(board) => board.fmt(f),
            None => f.write_str("auto"),
        }
    }
}

/// A camera model, or `auto`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct ModelArg(pub(super) Option<Model>);

impl FromStr for ModelArg {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        if text.trim().eq_ignore_ascii_case("auto") {
            return Ok(Self(None));
        }
        match text.trim().parse() {
            Ok(model) => Ok(Self(Some(model))),
            Err(error) => Err(Error::Invalid(format!("{error}, auto"))),
        }
    }
}

/// A whole `--fix` value.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Fixes(pub(super) Vec<Fix>);

impl FromStr for Fixes {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        parse_fixes(text).map(Self)
    }
}

/// Paths of pictures.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct Pictures {
    /// Photographs, or folders of them
    #[arg(value_name = "PATHS", required = true)]
    pub(super) paths: Vec<PathBuf>,
}
