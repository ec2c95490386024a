//! A report as its JSON has it: the fields of a solution stand beside the others.
//!
//! Serde's own way to read such, `flatten`, keeps every value twice and is compiled for every type once more; a page would load it.

use nalgebra::DMatrix;
use serde::Deserialize;

use super::{
    Advice, Camera, ClosedForm, Comparison, Coverage, ErrorStats, Failure, FrameReport, GroupReport,
    Iteration, Model, Named, Report, ResidualMap, SafeRegion, Settings, Solution, Sources, Starts,
    Termination, Timing, Trends, Uncertainty, Warning, calibrate, json, wire,
};

#[derive(Deserialize)]
pub(super) struct Flat {
    version: String,
    settings: Settings,
    error: Option<Failure>,
    #[serde(default)]
    groups: Vec<GroupReport>,
    frames: Vec<FrameReport>,
    #[serde(default)]
    warnings: Vec<Warning>,
    models: Option<calibrate::Comparison>,
    sources: Option<Sources>,
    advice: Option<Advice>,
    #[serde(default)]
    timing_ms: Timing,

    image_size_px: Option<[u32; 2]>,
    model: Option<Model>,
    camera_matrix: Option<Named<f64>>,
    #[serde(default)]
    distortion: Named<f64>,
    rms_px: Option<f64>,
    rms_per_coordinate_px: Option<f64>,
    rms_inliers_px: Option<f64>,
    sigma0_px: Option<f64>,
    sigma: Option<Named<Option<f64>>>,
    covariance: Option<Matrix>,
    termination: Option<Termination>,
    iterations: Option<usize>,
    steps: Option<Vec<Iteration>>,
    starts: Option<Starts>,
    closed_form: Option<ClosedForm>,
    stats: Option<ErrorStats>,
    coverage: Option<Coverage>,
    uncertainty: Option<Uncertainty>,
    uncertainty_far: Option<Uncertainty>,
    safe_region: Option<SafeRegion>,
    trends: Option<Trends>,
    residual_map: Option<ResidualMap>,
    #[serde(default, with = "wire::by_name")]
    truth: Vec<Comparison>,
    truth_corners: Option<ErrorStats>,
}

#[derive(Deserialize)]
struct Matrix(#[serde(with = "wire::matrix")] DMatrix<f64>);

impl TryFrom<Flat> for Report {
    type Error = String;

    fn try_from(mut flat: Flat) -> Result<Self, String> {
        let solution = match flat.camera_matrix.take() {
            Some(matrix) => Some(flat.solution(&matrix)?),
            None => None,
        };
        Ok(Self {
            solution,
            version: flat.version,
            settings: flat.settings,
            error: flat.error,
            groups: flat.groups,
            frames: flat.frames,
            warnings: flat.warnings,
            models: flat.models,
            sources: flat.sources,
            advice: flat.advice,
            timing_ms: flat.timing_ms,
        })
    }
}

/// [`json::need`] by the name of the field.
macro_rules! need {
    ($flat:ident.$field:ident) => {
        json::need($flat.$field.take(), stringify!($field))?
    };
}

impl Flat {
    fn solution(&mut self, matrix: &Named<f64>) -> Result<Solution, String> {
        let named = matrix.iter().chain(self.distortion.iter());
        let values: Vec<(&str, f64)> = named.map(|(name, value)| (name, *value)).collect();
        Ok(Solution {
            camera: Camera::from_named(need!(self.model), need!(self.image_size_px), &values)
                .map_err(|e| e.to_string())?,
            rms_px: need!(self.rms_px),
            rms_per_coordinate_px: need!(self.rms_per_coordinate_px),
            rms_inliers_px: need!(self.rms_inliers_px),
            sigma0_px: need!(self.sigma0_px),
            sigma: need!(self.sigma),
            covariance: need!(self.covariance).0,
            termination: need!(self.termination),
            iterations: need!(self.iterations),
            steps: need!(self.steps),
            starts: need!(self.starts),
            closed_form: need!(self.closed_form),
            stats: need!(self.stats),
            coverage: need!(self.coverage),
            uncertainty: need!(self.uncertainty),
            uncertainty_far: self.uncertainty_far.take(),
            safe_region: self.safe_region.take(),
            trends: need!(self.trends),
            residual_map: self.residual_map.take(),
            truth: std::mem::take(&mut self.truth),
            truth_corners: self.truth_corners,
        })
    }
}
