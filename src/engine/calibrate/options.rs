//! What the user may choose, and its grammar on the command line.

use serde::{Deserialize, Serialize};
use std::{fmt, str::FromStr};

use crate::{Error, Result, camera::Camera, camera::Model, refine::Free};

/// A constraint on the intrinsics, one item of `--fix fx=fy,cx,cy,k3=0.1`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(into = "String", try_from = "String")]
pub enum Fix {
    /// `k3`: stays at its start value: that of the start camera, else the middle of the picture for `cx cy`, else 0.
    Hold(String),
    /// `k3=0.1`: stays at this value.
    Value(String, f64),
    /// `fx=fy`: both share one value.
    Tie(String, String),
}

impl FromStr for Fix {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let wrong = || {
            Error::Invalid(format!(
                "\"{text}\" does not fix a parameter: write names, name=value or name=name, for example fx=fy,cx,cy,k3=0"
            ))
        };
        let is_name = |s: &str| {
            s.starts_with(|c: char| c.is_ascii_alphabetic()) && s.chars().all(|c| c.is_ascii_alphanumeric())
        };
        let t = text.trim().to_lowercase();
        match t.split_once('=').map(|(a, b)| (a.trim(), b.trim())) {
            None if is_name(&t) => Ok(Self::Hold(t)),
            Some((a, b)) if is_name(a) => match b.parse::<f64>() {
                Ok(v) if v.is_finite() => Ok(Self::Value(a.to_owned(), v)),
                Err(_) if is_name(b) => Ok(Self::Tie(a.to_owned(), b.to_owned())),
                _ => Err(wrong()),
            },
            _ => Err(wrong()),
        }
    }
}

impl fmt::Display for Fix {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Hold(a) => f.write_str(a),
            Self::Value(a, v) => write!(f, "{a}={v}"),
            Self::Tie(a, b) => write!(f, "{a}={b}"),
        }
    }
}

impl From<Fix> for String {
    fn from(fix: Fix) -> Self {
        fix.to_string()
    }
}

impl TryFrom<String> for Fix {
    type Error = Error;

    fn try_from(text: String) -> Result<Self> {
        text.parse()
    }
}

/// Reads a whole `--fix` value: items separated by commas; empty for none.
///
/// # Errors
/// [`Error::Invalid`] with the item that is wrong.
pub fn parse_fixes(text: &str) -> Result<Vec<Fix>> {
    text.split(',').filter(|t| !t.trim().is_empty()).map(str::parse).collect()
}

/// Checks constraints before there are pictures: names, values, ties.
///
/// # Errors
/// [`Error::Invalid`] with the item that is wrong, where no model of `models` can obey.
pub fn check_fixes(fixed: &[Fix], models: &[Model], start: Option<&Camera>) -> Result<()> {
    // The size only says where the middle is.
    let size_px = start.map_or([1; 2], |c| c.size_px);
    let mut result = Ok(());
    for model in models {
        result = Constraints::new(fixed, *model, size_px, start, None).and_then(|c| {
            let nothing_left = || {
                Error::Invalid(format!(
                    "all parameters of {model} are fixed, nothing is left to calibrate: fix fewer of them"
                ))
            };
            if c.free.is_empty() { Err(nothing_left()) } else { Ok(()) }
        });
        if result.is_ok() {
            break;
        }
    }
    result
}

/// Refuses ties that mean nothing: of unlike parameters, or in a circle.
fn check_ties(model: Model, tied: &[[usize; 2]]) -> Result<()> {
    let params = model.spec().params;
    let mut group: Vec<usize> = (0..params.len()).collect();
    for &[a, b] in tied {
        let kind = |i: usize| if params[i].unit == "px" { i / 2 } else { 2 };
        let [x, y] = [a, b].map(|i| params[i].name);
        if kind(a) != kind(b) {
            return Err(Error::Invalid(format!(
                "{x}={y} ties parameters of different kinds: tie focal lengths (fx=fy), centres or coefficients with their like"
            )));
        }
        let (from, to) = (group[a], group[b]);
        if from == to {
            return Err(Error::Invalid(format!(
                "{x}={y} closes a circle: {x} and {y} share one value already"
            )));
        }
        group.iter_mut().filter(|g| **g == from).for_each(|g| *g = to);
    }
    Ok(())
}

macro_rules! words {
    ($(#[$doc:meta])* $name:ident, $what:literal { $($(#[$item:meta])* $variant:ident = $word:literal),* }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, Default)]
        #[serde(rename_all = "lowercase")]
        pub enum $name { $($(#[$item])* $variant),* }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(match self { $(Self::$variant => $word),* })
            }
        }

        impl FromStr for $name {
            type Err = Error;

            fn from_str(text: &str) -> Result<Self> {
                match text.trim().to_lowercase().as_str() {
                    $($word => Ok(Self::$variant),)*
                    _ => Err(Error::Invalid(format!(
                        "\"{text}\" is not a {}: choose one of {}", $what, [$($word),*].join(", ")
                    ))),
                }
            }
        }
    };
}

words! {
    /// Loss of a residual.
    Loss, "loss" {
        /// Quadratic up to 2.5 robust standard deviations of a coordinate, linear beyond: 99.5 % efficient on normal noise
        /// in two dimensions, and a wrong corner pulls no harder than a slightly bad one.
        #[default]
        Huber = "huber",
        /// Least squares, as OpenCV minimises.
        Linear = "linear"
    }
}

words! {
    /// Weights of the residuals.
    Weights, "weighting" {
        /// By the corners' own σ. To each σ² the variance is added that the residuals show beyond it (unevenness of the
        /// board, lens model), estimated with the solution, so that optimistic σ do not rule it.
        #[default]
        Sigma = "sigma",
        /// All corners alike.
        None = "none"
    }
}

words! {
    /// Width of the arithmetic, an ablation.
    Precision, "precision" {
        /// Double precision throughout.
        #[default]
        F64 = "f64",
        /// Corners are rounded to `f32`, homographies are computed in `f32`, and the refinement rounds every weighted
        /// residual and every entry of the Jacobian to `f32`. Their products are still summed, and the normal equations
        /// solved, in `f64`: a solver that is `f32` throughout can only be worse.
        F32 = "f32"
    }
}

/// How to calibrate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Options {
    /// Constraints on the intrinsics.
    pub fixed: Vec<Fix>,
    /// Loss.
    pub loss: Loss,
    /// Weights.
    pub weights: Weights,
    /// Normalise points before linear solutions (off: an ablation).
    pub normalise: bool,
    /// RANSAC for homographies (off: an ablation).
    pub ransac: bool,
    /// Width of the arithmetic.
    pub precision: Precision,
    /// Several starts with different focal lengths; off: the closed form (or the given camera) alone.
    pub multi_start: bool,
    /// Most steps of the refinement.
    pub max_iterations: usize,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            fixed: Vec::new(),
            loss: Loss::default(),
            weights: Weights::default(),
            normalise: true,
            ransac: true,
            precision: Precision::default(),
            multi_start: true,
            max_iterations: 100,
        }
    }
}

/// The constraints, resolved for a model.
pub(super) struct Constraints {
    pub(super) free: Free,
    /// Values that stay.
    held: Vec<(usize, f64)>,
    /// `[follower, leader]`.
    tied: Vec<[usize; 2]>,
}

impl Constraints {
    /// Resolves names and the values at which parameters are held.
    pub(super) fn new(
        fixed: &[Fix],
        model: Model,
        size_px: [u32; 2],
        start: Option<&Camera>,
        focal_hint_px: Option<f64>,
    ) -> Result<Self> {
        let spec = model.spec();
        let find = |name: &str| {
            spec.index(name).ok_or_else(|| {
                let names: Vec<_> = spec.params.iter().map(|p| p.name).collect();
                Error::Invalid(format!(
                    "the model {model} has no parameter {name} to fix: it has {}",
                    names.join(" ")
                ))
            })
        };
        let (mut held, mut tied) = (Vec::new(), Vec::new());
        for fix in fixed {
            match fix {
                Fix::Value(name, value) => held.push((find(name)?, *value)),
                Fix::Tie(a, b) => tied.push([find(a)?, find(b)?]),
                Fix::Hold(name) => {
                    let i = find(name)?;
                    let value = match (start.and_then(|c| c.get(name)), i) {
                        (Some(v), _) => v,
                        (None, 0 | 1) => focal_hint_px.ok_or_else(|| {
                            Error::Invalid(format!(
                                "{name} is fixed but has no value: write {name}=<px> or give a start camera"
                            ))
                        })?,
                        (None, 2 | 3) => (f64::from(size_px[i - 2]) - 1.0) / 2.0,
                        (None, _) => spec.neutral.get(i - 4).copied().unwrap_or(0.0),
                    };
                    held.push((i, value));
                }
            }
        }
        if let Some((i, v)) = held.iter().find(|(i, v)| *i < 2 && *v <= 0.0) {
            return Err(Error::Invalid(format!(
                "{} is fixed at {v}: a focal length must be greater than zero",
                spec.params[*i].name
            )));
        }
        for (k, (i, _)) in held.iter().enumerate() {
            if held[..k].iter().any(|(j, _)| i == j) {
                let name = spec.params[*i].name;
                return Err(Error::Invalid(format!("{name} is fixed twice: give it one value")));
            }
        }
        check_ties(model, &tied)?;
        let free = Free::new(model, &held.iter().map(|h| h.0).collect::<Vec<_>>(), &tied);
        Ok(Self { free, held, tied })
    }

    /// Makes parameters obey: tied ones take their mean, held ones (and what is tied to them) their value.
    pub(super) fn apply(&self, params: &mut [f64]) {
        for slot in 0..self.free.len() {
            let members: Vec<_> = (0..params.len()).filter(|i| self.free.slot(*i) == Some(slot)).collect();
            let mean = members.iter().map(|i| params[*i]).sum::<f64>() / members.len() as f64;
            for i in members {
                params[i] = mean;
            }
        }
        for (i, value) in &self.held {
            params[*i] = *value;
        }
        // What is tied to a held parameter follows it, also through others.
        for _ in &self.tied {
            for &[a, b] in &self.tied {
                if self.held.iter().any(|(i, _)| *i == b) || self.free.slot(b).is_none() {
                    if !self.held.iter().any(|(i, _)| *i == a) {
                        params[a] = params[b];
                    } else {
                        params[b] = params[a];
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_grammar_of_fix() {
        let fixes = parse_fixes("fx=fy, cx,cy ,K3,k1=-0.28").unwrap();
        assert_eq!(
            fixes,
            [
                Fix::Tie("fx".into(), "fy".into()),
                Fix::Hold("cx".into()),
                Fix::Hold("cy".into()),
                Fix::Hold("k3".into()),
                Fix::Value("k1".into(), -0.28)
            ]
        );
        assert_eq!(parse_fixes("").unwrap(), []);
        for text in ["=", "fx=", "=fy", "k1=nan", "3", "fx fy", "fx==fy", "k1=inf"] {
            assert!(parse_fixes(text).is_err(), "{text}");
        }
        for fix in fixes {
            assert_eq!(fix.to_string().parse::<Fix>().unwrap(), fix);
        }
        assert_eq!("Linear".parse::<Loss>().unwrap(), Loss::Linear);
        assert!("l2".parse::<Loss>().is_err() && "none".parse::<Weights>().is_ok());
    }

    #[test]
    fn fixes_are_checked_without_pictures() {
        let check = |text: &str, models: &[Model]| check_fixes(&parse_fixes(text).unwrap(), models, None);
        let brown = [Model::Brown5];
        for (text, says) in [
            ("k4", "no parameter k4"),
            ("cx=abc", "no parameter abc"),
            ("fx", "fx is fixed but has no value"),
            ("fx=0", "greater than zero"),
            ("fx=cx", "different kinds"),
            ("k1=cx", "different kinds"),
            ("fx=fy,fy=fx", "closes a circle"),
            ("fx=fx", "closes a circle"),
            ("cx=1,cx=2", "fixed twice"),
            ("fx=500,fy=500,cx,cy,k1,k2,p1,p2,k3", "nothing is left"),
        ] {
            let message = check(text, &brown).unwrap_err().to_string();
            assert!(message.contains(says), "{text}: {message}");
        }
        assert!(check("fx=fy,cx,cy,k3=0,k1=k2", &brown).is_ok());
        // `--model auto`: the pinhole has no k3, brown5 has.
        assert!(check("k3", &Model::ALL).is_ok() && check("k3", &[Model::Pinhole]).is_err());
        let start = Camera::new(Model::Pinhole, [640, 480], vec![500.0, 500.0, 320.0, 240.0]).unwrap();
        assert!(check_fixes(&parse_fixes("fx").unwrap(), &brown, Some(&start)).is_ok());
    }

    #[test]
    fn constraints_are_applied_to_starts() {
        let resolve =
            |text: &str| Constraints::new(&parse_fixes(text).unwrap(), Model::Brown5, [640, 480], None, None);
        let mut p = vec![500.0, 520.0, 1.0, 2.0, 0.1, 0.2, 0.3, 0.4, 0.5];
        let c = resolve("fx=fy,cx,cy,k3").unwrap();
        c.apply(&mut p);
        assert_eq!(p, [510.0, 510.0, 319.5, 239.5, 0.1, 0.2, 0.3, 0.4, 0.0]);
        assert_eq!(c.free.len(), 5);
        let c = resolve("fx=fy,fy=700").unwrap();
        c.apply(&mut p);
        assert_eq!((p[0], p[1], c.free.len()), (700.0, 700.0, 7));
        assert!(resolve("fx").is_err() && resolve("k4").is_err() && resolve("fx=-3").is_err());
    }
}
