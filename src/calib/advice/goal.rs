//! How sure the camera shall be: in px, or in what is measured with it.

use std::{fmt, str::FromStr};

use serde::{Deserialize, Serialize};

use crate::calib::{
    Error, Result,
    camera::Camera,
    target::{Length, Unit},
    uncertainty::{Range, Uncertainty},
};

/// Figure of the uncertainty that a goal is about.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Figure {
    /// In the worst of the four corners of the picture.
    #[default]
    Corner,
    /// The mean over the picture.
    Mean,
    /// In the middle of the picture.
    Centre,
}

impl Figure {
    const ALL: [(Self, &str); 3] = [(Self::Corner, "corner"), (Self::Mean, "mean"), (Self::Centre, "centre")];

    /// In words, after a number.
    pub const fn words(self) -> &'static str {
        match self {
            Self::Corner => "in the worst corner",
            Self::Mean => "on average over the picture",
            Self::Centre => "in the middle",
        }
    }

    /// Its value, px; `None` where it has no answer.
    pub fn of(self, uncertainty: &Uncertainty) -> Option<f64> {
        match self {
            Self::Corner => uncertainty.worst_corner_px,
            Self::Mean => uncertainty.mean_px(),
            Self::Centre => uncertainty.center_px,
        }
    }
}

/// An error that is small enough, 1 σ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Tolerance {
    /// Of the projection, px.
    Px(f64),
    /// Of places seen at a distance, across the line of sight: e = σ · Z / f.
    Across {
        /// e.
        error: Length,
        /// Z.
        distance: Length,
    },
    /// Of the depth that two such cameras side by side measure: e = √2 σ · Z² / (f · b), each camera with its own σ.
    Depth {
        /// e.
        error: Length,
        /// Z.
        distance: Length,
        /// b.
        baseline: Length,
    },
}

/// How sure the camera shall be, and where in the picture. As text: `0.1px`, `5mm@2m`, `1cm@2m,baseline=12cm`, each also with
/// `,mean` or `,centre`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(into = "String", try_from = "String")]
pub struct Goal {
    /// How sure.
    pub tolerance: Tolerance,
    /// Where.
    pub figure: Figure,
}

impl Default for Goal {
    /// One pixel in the corners: what the verdict calls good everywhere.
    fn default() -> Self {
        Self { tolerance: Tolerance::Px(1.0), figure: Figure::Corner }
    }
}

impl Goal {
    /// The σ of the projection that it allows, px; f is √(fx fy).
    pub fn px(&self, camera: &Camera) -> f64 {
        let [fx, fy, ..] = camera.intrinsics();
        let f = (fx * fy).sqrt();
        match self.tolerance {
            Tolerance::Px(px) => px,
            Tolerance::Across { error, distance } => f * metres(error) / metres(distance),
            Tolerance::Depth { error, distance, baseline } => {
                metres(error) * f * metres(baseline) / (2f64.sqrt() * metres(distance).powi(2))
            }
        }
    }

    /// How far away the points are that it is about. Without the size of the board's squares in the world that is as far as the
    /// boards were.
    pub fn range(&self, unit: Unit) -> Range {
        match (self.tolerance, unit.metres()) {
            (Tolerance::Across { distance, .. } | Tolerance::Depth { distance, .. }, Some(unit)) => {
                Range::At(metres(distance) / unit)
            }
            _ => Range::Boards,
        }
    }
}

/// Lengths without a unit are refused when a goal is read.
fn metres(length: Length) -> f64 {
    length.value * length.unit.metres().unwrap_or(1.0)
}

impl fmt::Display for Goal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let plain = |l: Length| format!("{}{}", l.value, l.unit.name());
        match self.tolerance {
            Tolerance::Px(px) => write!(f, "{px}px")?,
            Tolerance::Across { error, distance } => write!(f, "{}@{}", plain(error), plain(distance))?,
            Tolerance::Depth { error, distance, baseline } => {
                write!(f, "{}@{},baseline={}", plain(error), plain(distance), plain(baseline))?;
            }
        }
        let place =
            Figure::ALL.iter().find(|(figure, _)| *figure == self.figure && self.figure != Figure::default());
        place.map_or(Ok(()), |(_, name)| write!(f, ",{name}"))
    }
}

impl FromStr for Goal {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let wrong = || {
            Error::Invalid(format!(
                "\"{text}\" is not a goal: write 0.1px, 5mm@2m (across, at a distance) or 1cm@2m,baseline=12cm (depth from two such cameras), each also with ,mean or ,centre in place of the worst corner"
            ))
        };
        let length = |part: &str| {
            let length: Length = part.parse().map_err(|_| wrong())?;
            length.unit.metres().map(|_| length).ok_or_else(wrong)
        };
        // A comma between digits is a decimal one.
        let mut points = text.trim().to_owned();
        while let Some(at) = points.match_indices(',').map(|m| m.0).find(|&at| {
            let digit = |c: Option<char>| c.is_some_and(|c| c.is_ascii_digit());
            digit(points[..at].chars().next_back()) && digit(points[at + 1..].chars().next())
        }) {
            points.replace_range(at..=at, ".");
        }
        let parts: Vec<&str> = points.split(',').map(str::trim).collect();
        let (mut figure, mut baseline) = (Figure::default(), None);
        for part in &parts[1..] {
            let lower = part.to_lowercase().replace("center", "centre");
            if let Some(value) = lower.strip_prefix("baseline=") {
                baseline = Some(length(value)?);
            } else {
                figure = Figure::ALL.iter().find(|(_, name)| *name == lower).ok_or_else(wrong)?.0;
            }
        }
        let tolerance = match (parts[0].split_once('@'), baseline) {
            (Some((error, distance)), None) => {
                Tolerance::Across { error: length(error)?, distance: length(distance)? }
            }
            (Some((error, distance)), Some(baseline)) => {
                Tolerance::Depth { error: length(error)?, distance: length(distance)?, baseline }
            }
            (None, None) => {
                let number = parts[0].to_lowercase();
                let number = number.strip_suffix("px").ok_or_else(wrong)?.trim().parse().ok();
                Tolerance::Px(number.filter(|px: &f64| px.is_finite() && *px > 0.0).ok_or_else(wrong)?)
            }
            (None, Some(_)) => return Err(wrong()),
        };
        Ok(Self { tolerance, figure })
    }
}

impl From<Goal> for String {
    fn from(goal: Goal) -> Self {
        goal.to_string()
    }
}

impl TryFrom<String> for Goal {
    type Error = Error;

    fn try_from(text: String) -> Result<Self> {
        text.parse()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calib::synth::Scene;

    #[test]
    fn goals_are_read_as_people_write_them_and_written_as_they_are_read() {
        for (text, written) in [
            ("0.1px", "0.1px"),
            (" 0,1 px", "0.1px"),
            ("1px,mean", "1px,mean"),
            ("0.5 PX, center", "0.5px,centre"),
            ("1px,corner", "1px"),
            ("5mm@2m", "5mm@2m"),
            ("1cm@2m, baseline=12cm", "1cm@2m,baseline=12cm"),
            ("1cm@2m,mean,baseline=0.12m", "1cm@2m,baseline=0.12m,mean"),
        ] {
            let goal: Goal = text.parse().unwrap();
            assert_eq!(goal.to_string(), written, "{text}");
            assert_eq!(written.parse::<Goal>(), Ok(goal));
        }
        for text in [
            "",
            "1",
            "0px",
            "-1px",
            "5mm",
            "5@2m",
            "5mm@2",
            "1px,baseline=1m",
            "1px,edge",
            "5mm@2m@3m",
            "nanpx",
        ] {
            let error = text.parse::<Goal>().unwrap_err().to_string();
            assert!(error.contains("0.1px") && error.contains("baseline"), "{text}: {error}");
        }
    }

    #[test]
    fn tasks_become_pixels() {
        // f = 1000 px: 5 mm at 2 m are 2.5 px; 1 cm of depth there from cameras 20 cm apart are 0.5 px of disparity.
        let camera = Scene::seed().camera;
        let px = |text: &str| text.parse::<Goal>().unwrap().px(&camera);
        assert!((px("0.1px") - 0.1).abs() < 1e-12 && (px("5mm@2m") - 2.5).abs() < 1e-12);
        assert!((px("1cm@2m,baseline=20cm") - 0.5 / 2f64.sqrt()).abs() < 1e-12);
        let goal: Goal = "5mm@2m".parse().unwrap();
        assert_eq!((goal.range(Unit::Mm), goal.range(Unit::Squares)), (Range::At(2000.0), Range::Boards));
    }
}
