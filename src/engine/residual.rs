//! What a camera model leaves, as a smooth displacement over the picture.
//!
//! A model with few terms cannot follow a lens everywhere. What it misses at one place of the picture is the same in every
//! photograph, so it can be told from noise: a [`Field`] of bicubic B-splines is fitted to the residuals of all views, with the
//! camera held and **all poses free** (to first order), because each pose has already taken its share of the displacement. With the
//! residual `r`, the derivatives `J` by the pose and the weight `w` of each corner it is the minimum of
//!
//! ```text
//! Σ_views min_δ Σ w |r − J δ − field(px)|²  +  λ Σ (second differences of the knots)²
//! ```
//!
//! λ is chosen by cross-validation over whole pictures, those that show nearly the same together: the field is fitted without them
//! and judged by what it leaves of them. The same figures say whether it is **worth having**: with a fitting model there is nothing
//! to find, and the usual answer is no.
//!
//! Knots that no corner is near are zero, so the field ends where the data end.
//!
//! P. Eilers, B. Marx, "Flexible smoothing with B-splines and penalties", Statistical Science 11(2), 1996 (the penalty);
//! M. Stone, "Cross-validatory choice and assessment of statistical predictions", J. R. Stat. Soc. B 36, 1974.

mod corrected;
mod field;
mod grid;
mod rows;
mod search;

use std::fmt;

use serde::{Deserialize, Serialize};

use super::{
    Error, Result, bursts,
    number::{percent, significant},
    solution::Calibration,
    target::Target,
};
pub use corrected::Corrected;
pub use field::Field;

/// Fewest groups of pictures between which a field is judged.
pub const FEWEST_GROUPS: usize = 6;
/// Standard errors by which held-out pictures must be fitted better.
const SURE: f64 = 3.0;
/// Share of their RMS that must be gained.
const GAIN: f64 = 0.01;

/// A field with what it is worth.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ResidualMap {
    /// Whether pictures that it was not fitted to are explained better, beyond chance.
    pub worth_having: bool,
    /// The field; none where it is not worth having: then zero is the better answer.
    pub field: Option<Field>,
    /// Share of the picture where data support it, 0 to 1.
    pub supported_fraction: f64,
    /// What it leaves of pictures that it was not fitted to.
    pub held_out: HeldOut,
}

/// What is left of pictures that a field was not fitted to.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct HeldOut {
    /// √(Σ w |r|² / Σ w) of the camera alone, px; w are the final weights of the calibration.
    pub without_px: f64,
    /// The same with the field, fitted without these pictures.
    pub with_px: f64,
    /// Mean gain of a picture in standard errors over the groups of pictures.
    pub standard_errors: f64,
    /// Groups of pictures, those that show nearly the same together.
    pub groups: usize,
    /// Parts into which the groups were split.
    pub folds: usize,
}

impl HeldOut {
    fn is_better(&self) -> bool {
        self.standard_errors > SURE && self.with_px < (1.0 - GAIN) * self.without_px
    }
}

impl fmt::Display for ResidualMap {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let HeldOut { without_px, with_px, standard_errors, .. } = self.held_out;
        let (without, with) = (significant(without_px, 3), significant(with_px, 3));
        match &self.field {
            Some(field) => write!(
                f,
                "worth having: it lowers the RMS of pictures that were held out from {without} to {with} px \
                 ({standard_errors:.1} standard errors); up to {} px, known over {} of the picture",
                significant(field.largest_px(), 2),
                percent(self.supported_fraction)
            ),
            None => write!(
                f,
                "not worth having: pictures that were held out have an RMS of {with} px with it, {without} px without, \
                 which is no more than chance"
            ),
        }
    }
}

/// Fits a field to what a calibration leaves, and judges it.
///
/// `target` is the board of the calibration.
///
/// # Errors
/// [`Error::TooFewViews`] below [`FEWEST_GROUPS`] pictures that differ.
pub fn residual_map(calibration: &Calibration, target: &Target) -> Result<ResidualMap> {
    let grid = grid::Grid::new(calibration.camera.size_px);
    let mut views = rows::of(calibration, target, &grid);
    let corners: Vec<_> =
        views.iter().map(|v| v.rows.iter().map(|r| (r.index, r.seen_px)).collect()).collect();
    let group = bursts::groups(&corners, calibration.camera.size_px);
    let groups = group.iter().max().map_or(0, |last| last + 1);
    for (view, group) in views.iter_mut().zip(group) {
        view.group = group;
    }
    if groups < FEWEST_GROUPS {
        return Err(Error::TooFewViews { need: FEWEST_GROUPS, got: groups });
    }
    let mut found = search::search(&views, &grid, groups)?;
    // Where the model fails most, the robust loss took the corners for outliers.
    if rows::believe_again(&mut views, &found.left, calibration.sigma0_px) {
        found = search::search(&views, &grid, groups)?;
    }
    let worth_having = found.held_out.is_better();
    Ok(ResidualMap {
        worth_having,
        field: worth_having.then_some(found.field),
        supported_fraction: found.supported_fraction,
        held_out: found.held_out,
    })
}

#[cfg(test)]
mod tests;
