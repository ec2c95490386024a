//! Everything that is measured before anything is judged.

use nalgebra::DMatrix;

use super::{
    document,
    pipeline::{Bench, Run, Setup},
};
use crate::calib::{
    Error, Result, calibrate,
    calibrate::{Loss, Weights, parse_fixes},
    detect::{self, Refinement, gradient::Window},
    stats::{
        self,
        spatial::{Moran, Pairs, moran},
    },
    synth::{Cut, Method, Origin, Scene},
    undistort,
};

/// Names of the measured columns: renderer and method.
///
/// *Its method* is the document's: corners by gradients in a window of ±11 px (what `cornerSubPix` does), least squares, no
/// weights. *Straightedge* is this program with its defaults.
pub const COLUMNS: [&str; 4] =
    ["crude (cut), its method", "crude (rounded), its method", "exact, its method", "exact, Straightedge"];

/// Column of the exact renderer with the document's method.
pub const EXACT_ITS: usize = 2;
/// Column of the exact renderer with this program.
pub const EXACT: usize = 3;

/// All runs.
#[derive(Clone, Debug)]
pub struct Evidence {
    /// One a column of [`COLUMNS`].
    pub runs: [Run; 4],
    /// Exact renderer, this program's corners, least squares without weights: with Table II's poses, and with the roll of
    /// view 15 taken out.
    pub roll: [Run; 2],
    /// How corners were refined, and what they miss: crude cut, crude rounded, exact.
    pub refinements: Vec<Refined>,
    /// Ever longer lens models on the corners of the last column.
    pub models: Vec<ModelFit>,
    /// The scene with its board placed by the first inner corner, as the document's text says.
    pub inner: Scene,
}

/// Accuracy of one refinement.
#[derive(Clone, Debug)]
pub struct Refined {
    /// Which.
    pub refinement: Refinement,
    /// RMS of found − true about its mean (a crude renderer shifts all corners alike), px: crude cut, crude rounded, exact.
    pub rms_px: [f64; 3],
}

/// A lens model on the same corners.
#[derive(Clone, Debug)]
pub struct ModelFit {
    /// Free terms of distortion.
    pub terms: &'static str,
    /// Number of them.
    pub count: usize,
    /// RMS, px.
    pub rms_px: f64,
    /// By how much Σr² exceeds that of all five terms, in units of σ₀² per term left out: Fisher's F, about 1 by chance.
    pub excess: Option<f64>,
    /// Pattern that the residuals of different views share in the picture.
    pub pattern: Option<Moran>,
}

/// The scene with a renderer.
pub fn scene(method: Method) -> Scene {
    Scene { method, ..Scene::seed() }
}

/// Least squares without weights, as `cv2.calibrateCamera`.
pub fn plain() -> calibrate::Options {
    calibrate::Options { loss: Loss::Linear, weights: Weights::None, ..calibrate::Options::default() }
}

/// The document's way from pictures to a camera.
pub fn its_method(scene: Scene) -> Setup {
    let detect =
        detect::Options { refinement: Refinement::Gradient(Window::Half(11)), ..detect::Options::default() };
    Setup { detect, calibrate: plain(), ..Setup::new(scene) }
}

impl Evidence {
    /// Measures everything; `step` is called between runs and may stop it.
    ///
    /// # Errors
    /// Those of the runs, and whatever `step` answers.
    pub fn measure(bench: &mut Bench, step: &mut dyn FnMut(&str) -> Result<()>) -> Result<Self> {
        let [cut, rounded, exact] =
            [Method::Crude(Cut::Truncate), Method::Crude(Cut::Round), Method::Exact].map(scene);
        let mut run = |name: &str, setup: Setup| {
            step(name)?;
            bench.run(setup)
        };
        let runs = [
            run(COLUMNS[0], its_method(cut.clone()))?,
            run(COLUMNS[1], its_method(rounded.clone()))?,
            run(COLUMNS[2], its_method(exact.clone()))?,
            run(COLUMNS[3], Setup::new(exact.clone()))?,
        ];
        let mut level = exact.clone();
        if let Some(last) = level.poses.last_mut() {
            last.angles_deg[2] = 0.0;
        }
        let with = |scene: &Scene| Setup { calibrate: plain(), ..Setup::new(scene.clone()) };
        let roll = [run("with roll", with(&exact))?, run("without roll", with(&level))?];
        let mut refinements = Vec::new();
        for refinement in [
            Refinement::Off,
            Refinement::Gradient(Window::Half(11)),
            Refinement::Gradient(Window::Half(7)),
            Refinement::Gradient(Window::Adaptive),
            Refinement::Strip,
        ] {
            let mut rms_px = [0.0; 3];
            for (rms, scene) in rms_px.iter_mut().zip([&cut, &rounded, &exact]) {
                let mut setup = with(scene);
                setup.detect.refinement = refinement;
                *rms = about_mean(&run(&format!("refinement {refinement}"), setup)?);
            }
            refinements.push(Refined { refinement, rms_px });
        }
        let mut fits = Vec::new();
        for (terms, fixed) in [
            ("none", "k1=0,k2=0,p1=0,p2=0,k3=0"),
            ("k1", "k2=0,p1=0,p2=0,k3=0"),
            ("k1 k2", "p1=0,p2=0,k3=0"),
            ("k1 k2 p1 p2", "k3=0"),
            ("k1 k2 p1 p2 k3", ""),
        ] {
            let mut setup = with(&exact);
            setup.calibrate.fixed = parse_fixes(fixed)?;
            fits.push((terms, run(&format!("terms {terms}"), setup)?));
        }
        let inner = Scene {
            board: crate::calib::synth::Board { origin: Origin::FirstInner, ..exact.board },
            ..exact
        };
        Ok(Self { runs, roll, refinements, models: models(&fits), inner })
    }

    /// σ that each parameter has at the document's RMS with its poses, its corners and its method.
    pub fn sigma_at_its_rms(&self) -> Vec<f64> {
        let run = &self.runs[EXACT_ITS];
        let scale = document::RMS_PX / run.calibration.rms_px;
        run.calibration.sigma.iter().map(|s| s.unwrap_or(0.0) * scale).collect()
    }

    /// Chance that errors as small as the document's come with its RMS: of one parameter, given by position.
    pub fn chance(&self, parameter: usize) -> f64 {
        let truth = &self.runs[EXACT_ITS].setup.scene.camera.params;
        let miss = document::ESTIMATE[parameter] - truth[parameter];
        let sigma = self.sigma_at_its_rms()[parameter];
        stats::chi2_below((miss / sigma).powi(2), 1)
    }

    /// The same of all parameters together, and the squared Mahalanobis distance of the document's errors; `None` where the
    /// covariance is singular.
    pub fn chance_of_all(&self) -> Option<(f64, f64)> {
        let run = &self.runs[EXACT_ITS];
        let scale = document::RMS_PX / run.calibration.rms_px;
        let covariance: DMatrix<f64> = run.calibration.covariance_of_all() * (scale * scale);
        let truth = &run.setup.scene.camera.params;
        let miss = nalgebra::DVector::from_fn(truth.len(), |i, _| document::ESTIMATE[i] - truth[i]);
        // Scaled to unit diagonal: the parameters differ by six orders of magnitude.
        let sigma = covariance.diagonal().map(f64::sqrt);
        let correlation =
            DMatrix::from_fn(truth.len(), truth.len(), |i, j| covariance[(i, j)] / (sigma[i] * sigma[j]));
        let scaled = miss.component_div(&sigma);
        let distance = scaled.dot(&correlation.cholesky()?.solve(&scaled));
        Some((stats::chi2_below(distance, truth.len()), distance))
    }

    /// Largest displacement of each column's camera and of the true one: px and % of the diagonal.
    ///
    /// # Errors
    /// As [`undistort::displacement`].
    pub fn displacements(&self) -> Result<([[f64; 2]; 4], [f64; 2])> {
        let of = |camera| undistort::displacement(camera, 25).map(|d| [d.largest_px, d.largest_percent]);
        let mut columns = [[0.0; 2]; 4];
        for (column, run) in columns.iter_mut().zip(&self.runs) {
            *column = of(run.camera())?;
        }
        Ok((columns, of(&self.runs[EXACT].setup.scene.camera)?))
    }

    /// What a refinement misses, px.
    ///
    /// # Errors
    /// [`Error::Invalid`] where it was not measured.
    pub fn refined(&self, refinement: Refinement) -> Result<&Refined> {
        let wanted = self.refinements.iter().find(|r| r.refinement == refinement);
        wanted.ok_or_else(|| Error::Invalid(format!("the refinement {refinement} was not measured")))
    }
}

/// Residuals this near in the picture are compared, px: half the distance of corners of a frontal board.
pub const NEAR_PX: f64 = 25.0;
/// Shuffles of the permutation test.
pub const SHUFFLES: usize = 999;

/// Whether residuals of different views agree where they are near in the picture; `None` where none are near.
pub fn pattern(run: &Run) -> Option<Moran> {
    moran(&run.placed(), Pairs::BetweenViews, NEAR_PX, SHUFFLES, 1)
}

fn about_mean(run: &Run) -> f64 {
    let miss = run.mistakes_px();
    let n = miss.len().max(1) as f64;
    let mean = miss.iter().sum::<nalgebra::Vector2<f64>>() / n;
    (miss.iter().map(|m| (m - mean).norm_squared()).sum::<f64>() / n).sqrt()
}

fn models(fits: &[(&'static str, Run)]) -> Vec<ModelFit> {
    let squares = |run: &Run| run.calibration.rms_px.powi(2) * run.corners() as f64;
    let free = |run: &Run| run.calibration.free.len() - 4;
    let Some((_, best)) = fits.last() else { return Vec::new() };
    let one = |(terms, run): &(&'static str, Run)| {
        let fewer = free(best) - free(run);
        let excess =
            (squares(run) - squares(best)) / best.calibration.sigma0_px.powi(2) / fewer.max(1) as f64;
        ModelFit {
            terms,
            count: free(run),
            rms_px: run.calibration.rms_px,
            excess: (fewer > 0).then_some(excess),
            pattern: pattern(run),
        }
    };
    fits.iter().map(one).collect()
}
