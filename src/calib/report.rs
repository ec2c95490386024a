//! The evidence as one serialisable value: the JSON of `calibrate --json` (with the verdict on it) and `detect --json`.
//!
//! Text, HTML and every camera file are made from a [`Report`], and it reads back: `docs/interface.md` defines each field.
//! Lengths are in [`Settings::unit`], angles in rad, pixels have their origin at the centre of the first pixel.

mod build;
mod corner_file;
mod problem;
mod read;
mod wire;

pub use corner_file::{CornerFile, CornerFrame};
pub use problem::SET_ASIDE_BY_HAND;

use nalgebra::{DMatrix, Vector2, Vector3};
use serde::{Deserialize, Serialize};

use super::{
    Error, Result,
    advice::Advice,
    calibrate::{self, Fix, Loss, Options, Precision, Weights},
    camera::{Camera, Model},
    detect::{Light, Refinement},
    diagnose::{self, Finding, Verdict, sources::Sources},
    figure::Bar,
    influence::Influence,
    json,
    named::Named,
    observation::Corner,
    pose::Pose,
    residual::ResidualMap,
    safe::SafeRegion,
    solution::{ClosedForm, Iteration, Starts, Termination, Warning},
    stats::{Comparison, Coverage, ErrorStats, Trend},
    target::{BoardSize, Target, Unit},
    uncertainty::{PoseCovariance, Uncertainty},
};

/// Everything that is known after a run, with or without a calibration.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "read::Flat")]
pub struct Report {
    /// Version of this program.
    pub version: String,
    /// What was asked for.
    pub settings: Settings,
    /// Why there is no calibration; absent where there is one, and where none was asked for (`detect`).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<Failure>,
    /// The calibration; its fields stand beside the others in the JSON.
    #[serde(flatten)]
    pub solution: Option<Solution>,
    /// Cameras that the pictures were taken by, the calibrated one first.
    pub groups: Vec<GroupReport>,
    /// The pictures, in the order in which they were given.
    pub frames: Vec<FrameReport>,
    /// What the user should know.
    pub warnings: Vec<Warning>,
    /// Camera models side by side, where one was to be recommended.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub models: Option<calibrate::Comparison>,
    /// What the calibration may err by, and what was found to be wrong; absent where that was not asked.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sources: Option<Sources>,
    /// What to photograph next, where that was asked.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub advice: Option<Advice>,
    /// Where the time went.
    pub timing_ms: Timing,
}

/// What was asked for: the source document's Table III.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Settings {
    /// Inner corners, columns × rows; none where the pictures do not tell.
    #[serde(with = "wire::board")]
    pub board: Option<BoardSize>,
    /// Whether the size of the board was found from the pictures.
    pub board_is_found: bool,
    /// The board, where it is no checkerboard.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub target: Option<Target>,
    /// Edge of a square, in `unit`; 1 where it is not known.
    pub square: f64,
    /// Unit of all lengths.
    pub unit: Unit,
    /// Pictures that were given.
    pub images: usize,
    /// Camera model.
    pub model: Model,
    /// Constraints on the parameters.
    pub fixed: Vec<Fix>,
    /// Camera file that the refinement started from.
    pub start: Option<String>,
    /// That camera: with it the solution can be repeated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub start_camera: Option<Camera>,
    /// Focal length that the pictures' metadata suggested as one more start, px.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub focal_hint_px: Option<f64>,
    /// Corner file that was read instead of pictures.
    pub corners: Option<String>,
    /// File with the true camera.
    pub truth: Option<String>,
    /// Loss of a residual.
    pub loss: Loss,
    /// Weights of the residuals.
    pub weights: Weights,
    /// Refinement of the corners below the pixel.
    pub refinement: Refinement,
    /// Gaussian before detection, px; 0 for none.
    pub presmooth_px: f64,
    /// How the refinement of the camera works.
    pub solver: String,
    /// Most steps of it.
    pub max_iterations: usize,
    /// Whether several starts were tried.
    pub multi_start: bool,
    /// Whether points were normalised before linear solutions.
    pub normalise: bool,
    /// Whether homographies were robust.
    pub ransac: bool,
    /// Width of the arithmetic.
    pub precision: Precision,
}

/// How the solver is called in [`Settings::solver`].
pub const SOLVER: &str =
    "Zhang's closed form, then Levenberg-Marquardt with analytic Jacobians and the Schur complement";

impl Default for Settings {
    fn default() -> Self {
        let options = Options::default();
        Self {
            board: None,
            board_is_found: false,
            target: None,
            square: 1.0,
            unit: Unit::Squares,
            images: 0,
            model: Model::Brown5,
            fixed: options.fixed,
            start: None,
            start_camera: None,
            focal_hint_px: None,
            corners: None,
            truth: None,
            loss: options.loss,
            weights: options.weights,
            refinement: Refinement::default(),
            presmooth_px: 0.0,
            solver: SOLVER.to_owned(),
            max_iterations: options.max_iterations,
            multi_start: options.multi_start,
            normalise: options.normalise,
            ransac: options.ransac,
            precision: options.precision,
        }
    }
}

impl Settings {
    /// The same with the options of the solver.
    #[must_use]
    pub fn with_options(self, options: &Options) -> Self {
        Self {
            fixed: options.fixed.clone(),
            loss: options.loss,
            weights: options.weights,
            max_iterations: options.max_iterations,
            multi_start: options.multi_start,
            normalise: options.normalise,
            ransac: options.ransac,
            precision: options.precision,
            ..self
        }
    }

    /// The board; none where its size is not known.
    pub fn target(&self) -> Option<Target> {
        self.target.clone().or_else(|| Some(Target::checkerboard(self.board?, self.square)))
    }

    /// The board in words: `9x6 board`, or what else it is.
    pub fn board_words(&self) -> Option<String> {
        match &self.target {
            Some(target) => Some(target.words()),
            None => Some(format!("{} board", self.board?)),
        }
    }
}

/// Why there is no calibration.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Failure {
    /// Stable machine-readable name, [`Error::code`].
    pub code: String,
    /// One sentence for people, with the remedy.
    pub text: String,
}

impl From<&Error> for Failure {
    fn from(error: &Error) -> Self {
        Self { code: error.code().to_owned(), text: error.to_string() }
    }
}

/// The calibrated camera and how far it can be believed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Solution {
    /// The camera: `image_size_px`, `model`, `camera_matrix` and `distortion` in the JSON, and once more as the only item of
    /// `cameras`.
    #[serde(flatten, with = "wire::camera")]
    pub camera: Camera,
    /// √(Σ|r|²/N) over all corners of the included pictures, px.
    pub rms_px: f64,
    /// `rms_px` / √2.
    pub rms_per_coordinate_px: f64,
    /// The same as `rms_px` without outliers.
    pub rms_inliers_px: f64,
    /// σ of one residual coordinate, a posteriori, px.
    pub sigma0_px: f64,
    /// σ of each parameter; null where it was fixed.
    pub sigma: Named<Option<f64>>,
    /// Covariance of the parameters of the camera in the order of `sigma`, poses marginalised; zero where fixed.
    #[serde(with = "wire::matrix")]
    pub covariance: DMatrix<f64>,
    /// Why the refinement stopped.
    pub termination: Termination,
    /// Steps of the refinement.
    pub iterations: usize,
    /// Each of these steps.
    pub steps: Vec<Iteration>,
    /// How the several starts fared.
    pub starts: Starts,
    /// Before the refinement.
    pub closed_form: ClosedForm,
    /// Statistics of |r| per corner, px.
    pub stats: ErrorStats,
    /// How much of the picture the corners cover.
    pub coverage: Coverage,
    /// How sure the projection is, 1 σ in px at the boards' distance.
    pub uncertainty: Uncertainty,
    /// The same of points beyond all distances; none in files of before.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub uncertainty_far: Option<Uncertainty>,
    /// The part of the picture that corners and certainty support; absent in files of older versions.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub safe_region: Option<SafeRegion>,
    /// Whether errors depend on how the board stood; none where there are too few pictures.
    pub trends: Trends,
    /// What the model leaves as a displacement over the picture, and whether that is worth having; only where it was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub residual_map: Option<ResidualMap>,
    /// Comparison with the true camera, by parameter; empty where it is not known.
    #[serde(with = "wire::by_name", skip_serializing_if = "Vec::is_empty")]
    pub truth: Vec<Comparison>,
    /// Distances of the corners from their true places, px, where those are known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub truth_corners: Option<ErrorStats>,
}

impl Solution {
    /// The border of the safe region, px; empty where it is not known.
    pub fn safe_px(&self) -> &[[f64; 2]] {
        self.safe_region.as_ref().map_or(&[], |region| &region.polygon_px)
    }
}

/// Straight-line trends of the pictures' RMS, px.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Trends {
    /// Over the tilt, px per rad.
    pub rms_by_tilt_rad: Option<Trend>,
    /// Over the distance, px per unit of length.
    pub rms_by_distance: Option<Trend>,
}

/// Pictures of one camera.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct GroupReport {
    /// What tells it from the others; `all` where there are no others.
    pub name: String,
    /// Why it is not calibrated; empty for the one that is.
    pub reason: String,
    /// Its pictures.
    pub images: usize,
    /// Of these, pictures with a board.
    pub found: usize,
    /// Who made the camera, as the pictures say (EXIF).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub make: Option<String>,
    /// Its model, as the pictures say (EXIF).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub model: Option<String>,
}

/// How much of the board was found in a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum FrameState {
    /// Every corner.
    Full,
    /// A part that can be used.
    Partial,
    /// Nothing that can be used; the picture was read.
    None,
    /// The picture could not be read.
    Unreadable,
}

impl FrameState {
    /// As in the JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Full => "full",
            Self::Partial => "partial",
            Self::None => "none",
            Self::Unreadable => "unreadable",
        }
    }

    /// Whether corners were found.
    pub const fn found(self) -> bool {
        matches!(self, Self::Full | Self::Partial)
    }
}

/// One picture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FrameReport {
    /// Its path, as given or found.
    pub file: String,
    /// Name of the group that it belongs to; empty for one that could not be read.
    pub group: String,
    /// `[width, height]` of the stored pixels; none for one that could not be read.
    pub image_size_px: Option<[u32; 2]>,
    /// How much was found.
    pub state: FrameState,
    /// Whether that is all of the board or a part of it.
    pub found: bool,
    /// Why it is not used, or why not all of it; empty where there is nothing to say.
    pub why: String,
    /// Whether the calibration used it.
    pub included: bool,
    /// The picture that it is a copy of.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub copy_of: Option<String>,
    /// The first picture of the same pose: they count as one, with their corners averaged.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub repeats: Option<String>,
    /// Whether the order of its corners is a choice between several that look alike.
    #[serde(default)]
    pub order_is_a_choice: bool,
    /// When it was taken, as its file says (EXIF): `2026:05:01 12:00:00`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub taken: Option<String>,
    /// What reading it told: wrong extension, first frame of an animation, …
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
    /// How the board was lit and sharp; absent where its corners are no checkerboard's, or from a file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub light: Option<Light>,
    /// Corners, ascending by index.
    #[serde(with = "wire::corners")]
    pub corners: Vec<Corner>,
    /// Observed − projected, px, in the order of `corners`; empty where it was not included.
    pub residuals_px: Vec<[f64; 2]>,
    /// Indices of the corners that the robust loss names as outliers.
    pub outliers: Vec<u32>,
    /// √(Σ|r|²/n), px; null, as all that follows, where it was not included.
    pub rms_px: Option<f64>,
    /// Largest |r|, px.
    pub max_px: Option<f64>,
    /// Rotation of `camera_from_board` (axis · angle), rad.
    pub rvec_rad: Option<[f64; 3]>,
    /// Translation of `camera_from_board`.
    pub tvec: Option<[f64; 3]>,
    /// Covariance of both, and with the parameters of the camera; absent where the picture is one of several of a pose, and in files of
    /// older versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pose_covariance: Option<PoseCovariance>,
    /// Angle between the board's normal and the optical axis.
    pub tilt_rad: Option<f64>,
    /// Rotation of the board about the optical axis.
    pub roll_rad: Option<f64>,
    /// Distance of the middle of the board from the camera.
    pub distance: Option<f64>,
    /// What leaving the picture out would do; absent where that was not asked.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub influence: Option<Influence>,
}

impl FrameReport {
    /// A picture of which nothing is known yet.
    pub const fn new(file: String) -> Self {
        Self {
            file,
            group: String::new(),
            image_size_px: None,
            state: FrameState::None,
            found: false,
            why: String::new(),
            included: false,
            copy_of: None,
            repeats: None,
            order_is_a_choice: false,
            taken: None,
            notes: Vec::new(),
            light: None,
            corners: Vec::new(),
            residuals_px: Vec::new(),
            outliers: Vec::new(),
            rms_px: None,
            max_px: None,
            rvec_rad: None,
            tvec: None,
            pose_covariance: None,
            tilt_rad: None,
            roll_rad: None,
            distance: None,
            influence: None,
        }
    }

    /// Where the board was; none for a picture that was not included.
    pub fn camera_from_board(&self) -> Option<Pose> {
        Some(Pose::from_rvec_tvec(Vector3::from(self.rvec_rad?), Vector3::from(self.tvec?)))
    }

    /// |r| of each corner, px.
    pub fn errors_px(&self) -> impl Iterator<Item = f64> {
        self.residuals_px.iter().map(|[x, y]| x.hypot(*y))
    }

    /// Mean of |r|, px; 0 for a picture that was not included.
    pub fn mean_px(&self) -> f64 {
        self.errors_px().sum::<f64>() / self.residuals_px.len().max(1) as f64
    }

    /// The file name without its folders and its extension.
    pub fn stem(&self) -> &str {
        let name = self.name();
        name.rsplit_once('.').map_or(name, |(stem, _)| stem)
    }

    /// The file name without its folders.
    pub fn name(&self) -> &str {
        self.file.rsplit(['/', '\\']).next().unwrap_or(&self.file)
    }
}

/// Wall time, ms.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Timing {
    /// Reading and decoding, summed over all pictures.
    pub read: f64,
    /// Detection, summed over all pictures.
    pub detect: f64,
    /// Calibration.
    pub calibrate: f64,
    /// Everything, from start to end.
    pub total: f64,
}

impl Report {
    /// Writes the JSON of a calibration, with what follows from its numbers: the verdict and what is behind it.
    pub fn to_json(&self) -> String {
        #[derive(Serialize)]
        struct Judged<'a> {
            #[serde(flatten)]
            report: &'a Report,
            verdict: Verdict,
            findings: Vec<Finding>,
        }
        json::text(&Judged {
            report: self,
            verdict: diagnose::verdict(self),
            findings: diagnose::findings(self),
        })
    }

    /// Reads the JSON.
    ///
    /// # Errors
    /// [`Error::Format`] with the place and what was expected.
    pub fn from_json(text: &str) -> Result<Self> {
        json::read(text).map_err(|e| Error::format("straightedge", e.to_string()))
    }

    /// |r| of all used corners, px.
    pub fn errors_px(&self) -> Vec<f64> {
        self.included().flat_map(FrameReport::errors_px).collect()
    }

    /// A bar for each used picture, numbered in their order.
    pub fn bars(&self) -> Vec<Bar> {
        let bar = |(i, f): (usize, &FrameReport)| Bar {
            name: (i + 1).to_string(),
            mean_px: f.mean_px(),
            max_px: f.max_px.unwrap_or(0.0),
        };
        self.included().enumerate().map(bar).collect()
    }

    /// Places of all used corners, px.
    pub fn corners_px(&self) -> Vec<Vector2<f64>> {
        self.included().flat_map(|f| f.corners.iter().map(|c| c.px)).collect()
    }

    /// When the first of the used pictures was taken, as their files say.
    pub fn taken(&self) -> Option<&str> {
        self.included().filter_map(|f| f.taken.as_deref()).min()
    }

    /// Frames that the calibration used.
    pub fn included(&self) -> impl Iterator<Item = &FrameReport> {
        self.frames.iter().filter(|f| f.included)
    }
}
