//! From results to the report.

use nalgebra::Vector2;

use super::{Failure, FrameReport, GroupReport, Report, Settings, Solution, Timing, Trends};
use crate::calib::{
    Error, Result,
    camera::Camera,
    influence::Influence,
    observation::FrameId,
    order,
    pose::Pose,
    residual,
    safe::SafeRegion,
    solution::{Calibration, View, Warning},
    stats,
    synth::Truth,
    target::Target,
    uncertainty::{self, Range},
};

impl Report {
    /// What is known before a calibration, or without one.
    pub fn new(
        settings: Settings,
        groups: Vec<GroupReport>,
        frames: Vec<FrameReport>,
        warnings: Vec<Warning>,
    ) -> Self {
        Self {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            settings,
            error: None,
            solution: None,
            groups,
            frames,
            warnings,
            models: None,
            sources: None,
            advice: None,
            timing_ms: Timing::default(),
        }
    }

    /// Adds a calibration. The frames of its views are positions in [`Report::frames`].
    pub fn calibrated(&mut self, calibration: &Calibration, target: &Target) {
        for frame in &mut self.frames {
            frame.included = false;
        }
        for (id, why) in &calibration.set_aside {
            if let Some(frame) = self.frames.get_mut(id.0 as usize) {
                frame.why.clone_from(why);
            }
        }
        for (view, covariance) in calibration.views.iter().zip(uncertainty::of_poses(calibration, target)) {
            let Some(frame) = self.frames.get_mut(view.frame.0 as usize) else { continue };
            frame.seen(view, target);
            frame.pose_covariance = covariance;
        }
        self.warnings.extend(calibration.warnings.iter().cloned());
        self.solution = Some(self.solution(calibration, target));
    }

    fn solution(&self, calibration: &Calibration, target: &Target) -> Solution {
        let camera = calibration.camera.clone();
        let trend = |x: fn(&FrameReport) -> Option<f64>| {
            let points: Vec<_> = self.included().filter_map(|f| Some((x(f)?, f.rms_px?))).collect();
            stats::trend(&points)
        };
        let corners = self.corners_px();
        let [uncertainty, far] =
            uncertainty::of_ranges(calibration, target, [Range::Boards, Range::Infinity]);
        let names = camera.spec().params.iter().map(|p| p.name.to_owned());
        Solution {
            rms_px: calibration.rms_px,
            rms_per_coordinate_px: calibration.rms_px / 2f64.sqrt(),
            rms_inliers_px: calibration.rms_inliers_px,
            sigma0_px: calibration.sigma0_px,
            sigma: names.zip(calibration.sigma.iter().copied()).collect(),
            covariance: calibration.covariance_of_all(),
            termination: calibration.termination,
            iterations: calibration.iterations.len(),
            steps: calibration.iterations.clone(),
            starts: calibration.starts.clone(),
            closed_form: calibration.closed_form.clone(),
            stats: stats::errors(&self.errors_px()),
            uncertainty_far: Some(far),
            coverage: stats::coverage(&corners, camera.size_px),
            safe_region: Some(SafeRegion::new(&camera, &corners, &uncertainty)),
            uncertainty,
            trends: Trends { rms_by_tilt_rad: trend(|f| f.tilt_rad), rms_by_distance: trend(|f| f.distance) },
            residual_map: None,
            truth: Vec::new(),
            truth_corners: None,
            camera,
        }
    }

    /// Says how a picture of a burst fits by itself; `first` is the file that the burst counts as.
    pub fn burst_member(
        &mut self,
        frame: FrameId,
        target: &Target,
        camera_from_board: Pose,
        residuals_px: &[Vector2<f64>],
        outliers: Vec<u32>,
        first: &str,
    ) {
        let Some(frame) = self.frames.get_mut(frame.0 as usize) else { return };
        let squares = residuals_px.iter().map(|r| r.norm_squared()).sum::<f64>();
        let view = View {
            frame: FrameId(0),
            camera_from_board,
            indices: Vec::new(),
            weights: Vec::new(),
            residuals_px: residuals_px.to_vec(),
            outliers,
            rms_px: (squares / residuals_px.len().max(1) as f64).sqrt(),
        };
        frame.seen(&view, target);
        frame.repeats = (frame.file != first).then(|| first.to_owned());
    }

    /// Counts the errors once more, where more pictures were added.
    pub fn fits_again(&mut self) {
        let rms = |outliers: bool| {
            let all = self.included().flat_map(|f| {
                let kept = f.corners.iter().zip(&f.residuals_px);
                kept.filter(move |(c, _)| outliers || !f.outliers.contains(&c.index))
                    .map(|(_, [x, y])| x * x + y * y)
            });
            let (sum, n) = all.fold((0.0, 0usize), |(sum, n), e| (sum + e, n + 1));
            (sum / n.max(1) as f64).sqrt()
        };
        let (all, inliers, stats) = (rms(true), rms(false), stats::errors(&self.errors_px()));
        if let Some(solution) = &mut self.solution {
            (solution.rms_px, solution.rms_inliers_px, solution.stats) = (all, inliers, stats);
            solution.rms_per_coordinate_px = all / 2f64.sqrt();
        }
    }

    /// Adds what each picture does to the camera, in the order of the views.
    pub fn with_influence(&mut self, calibration: &Calibration, influences: &[Option<Influence>]) {
        for (view, influence) in calibration.views.iter().zip(influences) {
            if let Some(frame) = self.frames.get_mut(view.frame.0 as usize) {
                frame.influence = *influence;
            }
        }
        // A burst goes or stays as one.
        for i in 0..self.frames.len() {
            if let Some(first) = self.frames[i].repeats.clone() {
                let first = self.frames.iter().find(|f| f.file == first);
                self.frames[i].influence = first.and_then(|f| f.influence);
            }
        }
    }

    /// Adds the residual map, or a warning that says why there is none.
    pub fn with_residual_map(&mut self, calibration: &Calibration, target: &Target) {
        match residual::residual_map(calibration, target) {
            Ok(map) => {
                if let Some(solution) = &mut self.solution {
                    solution.residual_map = Some(map);
                }
            }
            Err(error) => {
                self.warnings
                    .push(Warning::new("no_residual_map", format!("there is no residual map: {error}")));
            }
        }
    }

    /// Adds the reason why there is no calibration.
    pub fn failed(&mut self, error: &Error) {
        for frame in &mut self.frames {
            frame.included = false;
        }
        self.error = Some(Failure::from(error));
    }

    /// Adds the comparison with the true camera.
    ///
    /// # Errors
    /// [`Error::Invalid`] where the truth is for pictures of another size.
    pub fn compared(&mut self, calibration: &Calibration, truth: &Camera) -> Result<()> {
        let comparison = stats::compare(calibration, truth)?;
        if let Some(solution) = &mut self.solution {
            solution.truth = comparison;
        }
        Ok(())
    }

    /// Adds the distances of the used corners from their true places; nothing where no picture of the truth is among ours.
    pub fn compared_corners(&mut self, truth: &Truth) {
        let mut distances = Vec::new();
        for frame in self.included() {
            let Some(known) = truth.frame(&frame.file) else { continue };
            let places = order::map(known.corners.iter().map(|(index, x, y)| (*index, Vector2::new(*x, *y))));
            distances
                .extend(frame.corners.iter().filter_map(|c| Some((places.get(&c.index)? - c.px).norm())));
        }
        if let Some(solution) = &mut self.solution
            && !distances.is_empty()
        {
            solution.truth_corners = Some(stats::errors(&distances));
        }
    }
}

impl FrameReport {
    /// Adds how the board was seen.
    fn seen(&mut self, view: &View, target: &Target) {
        let stance = stats::stance(&view.camera_from_board, target);
        self.included = true;
        self.pose_covariance = None;
        self.residuals_px = view.residuals_px.iter().map(|r| [r.x, r.y]).collect();
        self.outliers.clone_from(&view.outliers);
        self.rms_px = Some(view.rms_px);
        self.max_px = view.residuals_px.iter().map(Vector2::norm).max_by(f64::total_cmp);
        self.rvec_rad = Some(view.camera_from_board.rvec().into());
        self.tvec = Some(view.camera_from_board.translation.into());
        self.tilt_rad = Some(stance.tilt_rad);
        self.roll_rad = Some(stance.roll_rad);
        self.distance = Some(stance.distance);
    }
}
