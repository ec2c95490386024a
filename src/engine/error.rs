//! One error type: the numbers are inside, the text says what to do next.

use serde::{Deserialize, Serialize};

use super::number::counted;

/// What can keep a calibration, a detection, a rendering or a file from existing.
///
/// Everything that can be worked around is a [`crate::solution::Warning`] beside a result instead.
#[derive(Clone, Debug, PartialEq, thiserror::Error, Serialize, Deserialize)]
pub enum Error {
    /// Fewer usable views than the unknowns need.
    #[error(
        "{}, at least {need} are needed: photograph the board from {need} or more different angles",
        counted(*.got, "usable view")
    )]
    TooFewViews {
        /// Views that the model and the fixed parameters ask for.
        need: usize,
        /// Views that could be used.
        got: usize,
    },
    /// Fewer corners than unknowns.
    #[error("{got} corners for {need} unknowns: add pictures that show more of the board")]
    TooFewCorners {
        /// Smallest number of corners.
        need: usize,
        /// Corners at hand.
        got: usize,
    },
    /// The data cannot determine the camera; the text names the reason and the remedy.
    #[error("{0}")]
    Degenerate(String),
    /// No picture shows a board that can be used; the text says why and what to do.
    #[error("{0}")]
    NoBoard(String),
    /// A number that is not finite, contradictory or out of range.
    #[error("{0}")]
    Invalid(String),
    /// A camera file, corner file or scene that cannot be read; says which line or field and what was expected.
    #[error("{format}: {message}")]
    Format {
        /// Name of the format.
        format: String,
        /// What is wrong and what to do.
        message: String,
    },
    /// A target format cannot hold this camera even after a refit.
    #[error("{0}")]
    Unsupported(String),
    /// A picture that cannot be used, with the reason and the remedy.
    #[error("{file}: {message}")]
    Picture {
        /// File name as the user gave it.
        file: String,
        /// Reason and remedy.
        message: String,
    },
    /// A file or folder that cannot be read.
    #[error("{path}: {message}")]
    File {
        /// Path as the user gave it.
        path: String,
        /// Reason and remedy.
        message: String,
    },
    /// A result that cannot be written.
    #[error("{path}: {message}")]
    Output {
        /// Path as the user gave it, or the stream.
        path: String,
        /// Reason and remedy.
        message: String,
    },
    /// The caller asked to stop; there is no result.
    #[error("stopped")]
    Stopped,
    /// A job ended in a panic; the message is for a bug report.
    #[error("internal error, please report it: {0}")]
    Crashed(String),
}

impl Error {
    /// Stable machine-readable name, the `code` of the JSON output.
    pub const fn code(&self) -> &'static str {
        match self {
            Self::TooFewViews { .. } => "too_few_views",
            Self::TooFewCorners { .. } => "too_few_corners",
            Self::Degenerate(_) => "degenerate",
            Self::NoBoard(_) => "no_board",
            Self::Invalid(_) => "invalid",
            Self::Format { .. } => "format",
            Self::Unsupported(_) => "unsupported",
            Self::Picture { .. } => "picture",
            Self::File { .. } => "file",
            Self::Output { .. } => "output",
            Self::Stopped => "stopped",
            Self::Crashed(_) => "crashed",
        }
    }

    /// A [`Error::Format`] of the named format.
    pub fn format(format: &str, message: impl Into<String>) -> Self {
        Self::Format { format: format.to_owned(), message: message.into() }
    }
}

/// Result with this crate's [`Error`].
pub type Result<T> = std::result::Result<T, Error>;
