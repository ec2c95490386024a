//! What a calibration is worth, in words: one verdict, and what is behind it.
//!
//! The verdict comes from the certainty of the projection, the focal length's σ, the number of views and their tilt; never from
//! the RMS alone: a set of three frontal boards has a small one and a useless camera.

mod facts;
mod rules;

use serde::{Deserialize, Serialize};

use super::{
    camera::Model,
    number::significant,
    report::{Report, Solution},
};
use facts::Facts;

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
    let Some(solution) = &report.solution else {
        let (level, sentence) = match &report.error {
            Some(_) => (Level::Bad, "No camera from these pictures".to_owned()),
            None => (Level::Info, "No camera yet".to_owned()),
        };
        return Verdict { level, sentence, rms_alone: String::new() };
    };
    let rms_alone = match solution.rms_px {
        rms if rms <= 0.25 => "excellent",
        rms if rms <= 0.5 => "good",
        _ => "poor",
    };
    let (level, sentence) = judged(solution);
    Verdict { level, sentence, rms_alone: rms_alone.to_owned() }
}

/// Certainty beyond which a place is a guess, px.
const GUESS_PX: f64 = 1.0;

fn judged(solution: &Solution) -> (Level, String) {
    let u = &solution.uncertainty;
    let focal = solution.camera.intrinsics()[0];
    let sigma = solution.sigma.iter().find(|(name, _)| *name == "fx").and_then(|(_, s)| *s).unwrap_or(0.0);
    if sigma > 0.01 * focal {
        let text =
            format!("Not trustworthy: the focal length is only known to ±{} px", significant(sigma, 2));
        return (Level::Bad, text);
    }
    match u.center_px {
        None => return (Level::Bad, "Not trustworthy: the pictures do not determine the camera".to_owned()),
        Some(px) if px > GUESS_PX => {
            let text = format!("Not trustworthy: ±{} px even in the middle", significant(px, 2));
            return (Level::Bad, text);
        }
        Some(_) => {}
    }
    if !solution.termination.converged() {
        return (Level::Bad, "Not trustworthy: the refinement did not reach its optimum".to_owned());
    }
    let guessed = facts::guessed(u, GUESS_PX);
    let worst = u.worst_corner_px;
    if guessed.is_none() && worst.is_some_and(|px| px <= GUESS_PX) {
        // Nobody needs, or believes, more digits than thousandths of a pixel.
        let short =
            |px: f64| if px < 0.001 { "under 0.001".to_owned() } else { format!("±{}", significant(px, 2)) };
        let [center, corner] = [u.center_px, worst].map(|px| short(px.unwrap_or(0.0)));
        let text = format!("Good everywhere: {center} px at the centre, {corner} px in the corners");
        return (Level::Good, text);
    }
    let place = guessed.unwrap_or("in the corners");
    (Level::Warn, format!("Good in the middle, a guess {place}"))
}

/// What is behind the verdict, the worst first.
pub fn findings(report: &Report) -> Vec<Finding> {
    let facts = Facts::of(report);
    let mut list: Vec<Finding> = rules::RULES.iter().flat_map(|rule| rule(&facts)).collect();
    list.sort_by_key(|f| std::cmp::Reverse(f.level));
    list
}

#[cfg(test)]
mod tests;
