//! What a calibration is worth, in words: one verdict, and what is behind it.
//!
//! The verdict comes from the certainty of the projection, the focal length's σ, the number of views, their tilt and the parts of
//! the picture that they cover. A large RMS counts against a camera, a small one never for it: three frontal boards have a
//! small one and a useless camera.

mod bend;
mod facts;
pub mod faults;
mod map;
mod rules;
pub mod sources;
mod verdict;

use serde::{Deserialize, Serialize};

use super::{
    camera::Model,
    number::{counted, significant},
    report::Report,
};
use facts::Facts;

/// σ of the focal length beyond which nothing can be measured with the camera, as a share of it.
pub(super) const UNSURE_FOCAL: f64 = 0.01;

/// Findings that are shown unasked.
pub const SHOWN: usize = 3;

/// How serious something is, worse ones later.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Level {
    /// Trustworthy.
    Good,
    /// Worth knowing.
    Info,
    /// Not certain.
    Warn,
    /// Not trustworthy.
    Bad,
}

/// One sentence.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Verdict {
    /// How serious it is.
    pub level: Level,
    /// Where the camera holds first, then where it does not.
    pub sentence: String,
    /// What the RMS alone would have said.
    pub rms_alone: String,
}

impl Verdict {
    /// What people who look at the RMS only would have been told.
    pub fn rms_words(&self) -> String {
        format!("RMS alone would have said: {}.", self.rms_alone)
    }
}

/// Something that the user should know, with its evidence and its remedy.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Finding {
    /// Stable machine-readable name.
    pub code: String,
    /// How serious it is.
    pub level: Level,
    /// What is.
    pub title: String,
    /// What it costs.
    pub text: String,
    /// Where the evidence is.
    pub show: Show,
    /// What helps, where the program can do it.
    pub remedy: Option<Remedy>,
}

/// Where evidence is to be seen. Positions are those of [`Report::frames`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Show {
    /// In a picture.
    Picture(usize),
    /// In all pictures.
    Pictures,
    /// In the errors.
    Errors,
    /// In the errors over the picture.
    Field,
    /// In the map of the certainty.
    Certainty,
    /// In the corners over the picture.
    Corners,
    /// In how the boards stood.
    Diversity,
    /// In the straightened picture.
    Lens,
}

/// What the program can do.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Remedy {
    /// Hold parameters.
    Hold(Vec<String>),
    /// Set pictures aside, by their positions; with what they are called.
    SetAside(Vec<usize>, String),
    /// Ask for more pictures.
    AddPictures,
    /// Another model.
    Model(Model),
}

impl Remedy {
    /// On its button.
    pub fn label(&self) -> String {
        match self {
            Self::Hold(names) => match &names[..] {
                [one] => format!("Hold {one} at 0"),
                _ => format!("Hold {} at 0", names.join(", ")),
            },
            Self::SetAside(_, name) => format!("Set aside {name}"),
            Self::AddPictures => "Add pictures…".to_owned(),
            Self::Model(model) => format!("Use {}", model.spec().title),
        }
    }
}

/// The verdict.
pub fn verdict(report: &Report) -> Verdict {
    verdict::of(&Facts::of(report))
}

/// The verdict with what it rests on: a sentence for text and pages.
pub fn summary(report: &Report) -> (Level, String) {
    let Verdict { level, sentence, .. } = verdict(report);
    let text = match (&report.solution, &report.error) {
        (Some(solution), _) => format!(
            "{sentence} ({} of {}, RMS {} px).",
            report.included().count(),
            counted(report.frames.len(), "picture"),
            significant(solution.rms_px, 3)
        ),
        (None, Some(error)) => format!("{sentence}: {}.", error.text.trim_end_matches('.')),
        (None, None) => format!("{sentence}."),
    };
    (level, text)
}

/// What is behind the verdict, the worst first.
pub fn findings(report: &Report) -> Vec<Finding> {
    rules::all(&Facts::of(report))
}

#[cfg(test)]
mod tests;
