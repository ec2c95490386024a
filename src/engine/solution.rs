//! What a calibration answers: camera, views, certainty, and why it stopped.

use nalgebra::{DMatrix, Vector2, Vector3};
use serde::{Deserialize, Serialize};

use super::{camera::Camera, observation::FrameId, pose::Pose, stats::indistinct, target::Target};

/// A board in front of the camera, as the solution sees it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct View {
    /// The picture.
    pub frame: FrameId,
    /// Where the board was.
    pub camera_from_board: Pose,
    /// Index on the board of each corner, ascending: the order of `residuals_px` and `weights`.
    pub indices: Vec<u32>,
    /// Observed − projected, px.
    pub residuals_px: Vec<Vector2<f64>>,
    /// Final weight of each corner's squared residual in the sum that was minimised: robust factor × (σ₀/σ)², 0..; all 1 for the
    /// linear loss without weights.
    pub weights: Vec<f64>,
    /// Indices on the board of the corners that the robust loss names as outliers.
    pub outliers: Vec<u32>,
    /// √(Σ|r|²/n) over all corners of the view, px.
    pub rms_px: f64,
}

impl View {
    /// The corners in the camera frame, in the order of `indices`; `None` without corners, or where one is not on the board.
    pub(crate) fn points_in_camera(&self, target: &Target) -> Option<Vec<Vector3<f64>>> {
        let point = |i: &u32| Some(self.camera_from_board.apply(&target.point_in_board(*i)?).coords);
        let points: Option<Vec<_>> = self.indices.iter().map(point).collect();
        points.filter(|p| !p.is_empty())
    }
}

/// Why the refinement stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Termination {
    /// The cost no longer falls: the relative decrease, predicted and found, is below the tolerance.
    CostConverged,
    /// The step is below the rounding of the parameters.
    StepConverged,
    /// The gradient vanishes to rounding.
    GradientConverged,
    /// The largest number of iterations was used up before convergence.
    IterationLimit,
    /// No damping produced a better point, without convergence.
    Stuck,
}

impl Termination {
    /// Whether this is an optimum.
    pub const fn converged(self) -> bool {
        matches!(self, Self::CostConverged | Self::StepConverged | Self::GradientConverged)
    }
}

/// One step of the refinement, for the convergence plot.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Iteration {
    /// Sum that is minimised, after the step.
    pub cost: f64,
    /// √(Σ|r|²/N) over all corners after the step, px.
    pub rms_px: f64,
    /// Levenberg–Marquardt damping of the step.
    pub damping: f64,
    /// Whether the step was taken.
    pub accepted: bool,
}

/// How the several starts fared.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Starts {
    /// Starts that were refined.
    pub tried: usize,
    /// Of these, how many reached the best optimum.
    pub agreeing: usize,
    /// Name, starting focal length (px) and RMS reached (px; `None` where it failed) of each.
    pub list: Vec<Start>,
}

/// One start of the refinement.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Start {
    /// Where it came from: `closed form`, `EXIF`, `given`, …
    pub name: String,
    /// Focal length it started from, px.
    pub focal_px: f64,
    /// RMS it reached, px.
    pub rms_px: Option<f64>,
}

/// Zhang's closed form, before the refinement.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ClosedForm {
    /// The camera without distortion that the homographies imply; `None` where the closed form has no real solution.
    pub camera: Option<Camera>,
    /// RMS with that camera, its poses and no distortion, px.
    pub rms_px: Option<f64>,
}

/// Something that the user should know beside the result.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Warning {
    /// Stable machine-readable name, `snake_case`.
    pub code: String,
    /// One sentence for people, with the remedy.
    pub text: String,
    /// Pictures that it is about, empty where it is about the whole.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub frames: Vec<String>,
}

impl Warning {
    /// A warning about the whole result.
    pub fn new(code: &str, text: impl Into<String>) -> Self {
        Self { code: code.to_owned(), text: text.into(), frames: Vec::new() }
    }

    /// The same, about named pictures.
    #[must_use]
    pub fn about(mut self, frames: impl IntoIterator<Item = String>) -> Self {
        self.frames.extend(frames);
        self
    }

    /// The text with the pictures that it is about.
    pub fn words(&self) -> String {
        let names: Vec<&str> =
            self.frames.iter().map(|f| f.rsplit(['/', '\\']).next().unwrap_or(f)).collect();
        match names.len() {
            0 => self.text.clone(),
            n if n > 6 => format!("{} [{}, … {}]", self.text, names[..3].join(", "), names[n - 1]),
            _ => format!("{} [{}]", self.text, names.join(", ")),
        }
    }
}

/// The calibrated camera and its evidence.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Calibration {
    /// The camera.
    pub camera: Camera,
    /// One view for each observation that was used, in the order of the problem.
    pub views: Vec<View>,
    /// A posteriori σ of each parameter, in the model's order; `None` where it was fixed (a tied parameter has its partner's).
    pub sigma: Vec<Option<f64>>,
    /// Covariance of the free parameters ([`Calibration::free`]), poses included (Schur-reduced).
    pub covariance: DMatrix<f64>,
    /// Positions, in the model's order, of the parameters that rows and columns of `covariance` belong to.
    pub free: Vec<usize>,
    /// For each parameter the position of the one that it is tied to, if any.
    pub tied_to: Vec<Option<usize>>,
    /// √(Σ|r|²/N) over all corners, px.
    pub rms_px: f64,
    /// The same over the corners that are not outliers.
    pub rms_inliers_px: f64,
    /// σ of one residual coordinate, a posteriori: √(Σ w r² / (2N − P)), px.
    pub sigma0_px: f64,
    /// Why it stopped.
    pub termination: Termination,
    /// Each step of the best start.
    pub iterations: Vec<Iteration>,
    /// The starts.
    pub starts: Starts,
    /// Before the refinement.
    pub closed_form: ClosedForm,
    /// Frames that were given but could not be used, with the reason.
    pub set_aside: Vec<(FrameId, String)>,
    /// What else to know.
    pub warnings: Vec<Warning>,
}

impl Calibration {
    /// Names of the coefficients of the lens that cannot be told from zero (less than 2 σ).
    pub fn unobservable(&self) -> Vec<&'static str> {
        let params = self.camera.spec().params;
        let unsure = indistinct(&self.camera.params, &self.covariance_of_all(), 4).into_iter();
        unsure.filter_map(|i| Some(params.get(i)?.name)).collect()
    }

    /// For each parameter of the model its place among the free ones, or that of the one whose value it shares; `None` where it was held.
    pub fn slots(&self) -> Vec<Option<usize>> {
        let of_free = |k: usize| self.free.iter().position(|&f| f == k);
        let tied = |k: usize| self.tied_to.get(k).copied().flatten();
        (0..self.camera.params.len()).map(|k| of_free(k).or_else(|| of_free(tied(k)?))).collect()
    }

    /// The covariance over all parameters in the model's order: zero where a parameter was fixed, its partner's rows where it
    /// was tied.
    pub fn covariance_of_all(&self) -> DMatrix<f64> {
        let n = self.camera.params.len();
        let place = self.slots();
        DMatrix::from_fn(n, n, |i, j| match (place[i], place[j]) {
            (Some(a), Some(b)) => self.covariance[(a, b)],
            _ => 0.0,
        })
    }
}
