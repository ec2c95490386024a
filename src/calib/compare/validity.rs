//! Whether a calibration still holds for new pictures: they are explained with it held, and with its parameters free.

use serde::{Deserialize, Serialize};

use super::{Comparison, Side, Verdict, compare};
use crate::calib::{
    Result,
    camera::Camera,
    number::{significant, with_sigma},
    report::{Report, Solution},
};

/// What new pictures say about a calibration.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Answer {
    /// It explains them as well as chance lets expect.
    StillValid,
    /// Another camera explains them better than chance can.
    Recalibrate,
    /// The new pictures do not tell.
    Unclear,
}

/// A change of the focal length.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Moved {
    /// By how much the mean of `fx` and `fy` grew, px.
    pub px: f64,
    /// σ of that, px.
    pub sigma_px: f64,
    /// The same as a share of the focal length.
    pub share: f64,
}

/// A calibration beside new pictures.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Validity {
    /// What it comes to.
    pub answer: Answer,
    /// The same in a sentence.
    pub sentence: String,
    /// Pictures that were used.
    pub pictures: usize,
    /// Corners in them.
    pub corners: usize,
    /// RMS with the camera held and only the poses free, px.
    pub held_rms_px: f64,
    /// RMS with the camera free, px; null where the pictures do not determine it.
    pub free_rms_px: Option<f64>,
    /// RMS that chance lets expect with the camera held: noise as in the free solution, and the camera's own σ, px.
    pub expected_rms_px: Option<f64>,
    /// How the focal length moved.
    pub focal: Option<Moved>,
    /// The old camera beside the free one; written for people only, and not read back.
    #[serde(skip_deserializing)]
    pub comparison: Option<Comparison>,
    /// Why the camera could not be free, or not all of it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub why: Option<String>,
}

/// Judges a calibration by the solution of new pictures with it held, and by one with its parameters free, or the reason why there is none.
///
/// # Errors
/// Those of [`compare`].
pub fn judge(old: &Side, held: &Report, free: std::result::Result<&Report, String>) -> Result<Validity> {
    let rms = |report: &Report| report.solution.as_ref().map(|s| s.rms_px);
    let found = free.as_ref().ok().and_then(|r| r.solution.as_ref());
    let new = found.map(Side::of);
    // Neither solution of the new pictures has a residual map.
    let old = &Side { residual: None, ..old.clone() };
    let comparison = new.as_ref().map(|new| compare(old, new)).transpose()?;
    let focal = new.as_ref().map(|new| moved(old, new));
    let views = held.included().count();
    let corners = held.included().map(|f| f.corners.len()).sum::<usize>();
    let expected_rms_px = found.and_then(|s| expected(old, s, corners, views));
    let held_rms_px = rms(held).unwrap_or_default();
    let answer = match comparison.as_ref().map(|c| c.verdict) {
        Some(Verdict::WithinChance) => Answer::StillValid,
        Some(Verdict::Differ) => Answer::Recalibrate,
        Some(Verdict::Unknown) | None => Answer::Unclear,
    };
    let mut validity = Validity {
        answer,
        sentence: String::new(),
        pictures: views,
        corners,
        held_rms_px,
        free_rms_px: free.as_ref().ok().and_then(|r| rms(r)),
        expected_rms_px,
        focal,
        comparison,
        why: free.err(),
    };
    validity.sentence = validity.in_words();
    Ok(validity)
}

/// The mean of `fx` and `fy`.
pub(super) fn focal(camera: &Camera) -> f64 {
    let [fx, fy, ..] = camera.intrinsics();
    0.5 * (fx + fy)
}

/// Its variance.
pub(super) fn variance(side: &Side) -> f64 {
    side.covariance.as_ref().map_or(0.0, |c| 0.25 * (c[(0, 0)] + 2.0 * c[(0, 1)] + c[(1, 1)]).max(0.0))
}

fn moved(old: &Side, new: &Side) -> Moved {
    let px = focal(&new.camera) - focal(&old.camera);
    Moved { px, sigma_px: (variance(old) + variance(new)).sqrt(), share: px / focal(&old.camera) }
}

/// RMS with the camera held as chance lets expect it. With A the information of the pictures about P free parameters in units of the noise,
/// the sums of squares are σ²(2N − 6V − P) free, and σ²(2N − 6V + tr(A Σ)) held at a camera of covariance Σ.
fn expected(old: &Side, free: &Solution, corners: usize, views: usize) -> Option<f64> {
    let slots: Vec<usize> =
        (0..free.covariance.nrows()).filter(|i| free.covariance[(*i, *i)] > 0.0).collect();
    let part = |m: &nalgebra::DMatrix<f64>| m.select_rows(&slots).select_columns(&slots);
    let brought = match &old.covariance {
        Some(covariance) => part(&free.covariance).cholesky()?.solve(&part(covariance)).trace(),
        None => 0.0,
    };
    let poses = 2.0 * corners as f64 - 6.0 * views as f64;
    let freedom = poses - slots.len() as f64;
    (freedom > 0.0).then(|| free.rms_px * ((poses + brought) / freedom).sqrt())
}

impl Validity {
    fn in_words(&self) -> String {
        let held = significant(self.held_rms_px, 3);
        let expected =
            self.expected_rms_px.map_or(String::new(), |e| format!(" ({} expected)", significant(e, 3)));
        let Some(chance) = self.comparison.as_ref().and_then(|c| c.chance.as_ref()) else {
            let why = self.why.as_deref().unwrap_or("the new pictures do not determine the camera");
            return format!(
                "Unclear: with the calibration held the new pictures fit to {held} px, but whether another camera would fit better they do not tell: {why}."
            );
        };
        let [moved, limit] = [chance.moved_px, chance.limit_px].map(|v| significant(v, 2));
        if self.answer == Answer::StillValid {
            return format!(
                "Still valid: the new pictures fit to {held} px{expected}, and would move the projection by {moved} px, places weighted by their certainty; chance makes up to {limit}."
            );
        }
        // The focal length is named where it is what moved.
        let named = self.focal.filter(|f| f.px.abs() > 2.0 * f.sigma_px).map_or(String::new(), |f| {
            let [px, sigma] = with_sigma(f.px, f.sigma_px);
            format!("the focal length moved by {px} ± {sigma} px ({:+.2} %), ", 100.0 * f.share)
        });
        format!(
            "No longer valid: {named}the projection moved by {moved} px, places weighted by their certainty, where chance makes at most {limit}; the new pictures fit to {held} px{expected}. \
             Use a calibration of the new pictures, or recalibrate."
        )
    }
}
