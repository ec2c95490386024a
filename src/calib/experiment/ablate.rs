//! One thing changed at a time: what each step of the method is worth.

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

use super::pipeline::{Bench, Run, Setup};
use crate::calib::{
    Error, Result,
    calibrate::{Loss, Precision, Weights},
    detect::{Refinement, gradient::Window},
    stats::{Comparison, ErrorStats},
    synth::{Degrade, Origin, Scene, poses},
};

/// A change.
pub struct Ablation {
    /// What it is about.
    pub group: &'static str,
    /// What is different.
    pub name: &'static str,
    change: fn(&mut Setup) -> Result<()>,
}

/// Seed of random poses.
const POSES_SEED: u64 = 1;
/// Most random poses: smaller sets are the first of them.
const MOST_POSES: usize = 40;

const fn ablation(group: &'static str, name: &'static str, change: fn(&mut Setup) -> Result<()>) -> Ablation {
    Ablation { group, name, change }
}

fn refine(s: &mut Setup, refinement: Refinement) -> Result<()> {
    s.detect.refinement = refinement;
    Ok(())
}

/// Some corners are mistaken.
fn wrong(s: &mut Setup, ransac: bool, loss: Loss) -> Result<()> {
    s.wrong_every = 50;
    (s.calibrate.ransac, s.calibrate.loss) = (ransac, loss);
    Ok(())
}

/// The first `views` of random poses (Section IV-B's rules).
fn random_poses(s: &mut Setup, views: usize) -> Result<()> {
    s.scene.poses = poses::random(MOST_POSES, &s.scene.camera, &s.scene.board, POSES_SEED)?;
    s.views = views;
    Ok(())
}

/// All changes, in the order of the table.
pub const ABLATIONS: &[Ablation] = &[
    ablation("Refinement", "strip (default)", |s| refine(s, Refinement::Strip)),
    ablation("Refinement", "gradient, adaptive window", |s| {
        refine(s, Refinement::Gradient(Window::Adaptive))
    }),
    ablation("Refinement", "gradient, ±7 px", |s| refine(s, Refinement::Gradient(Window::Half(7)))),
    ablation("Refinement", "gradient, ±11 px", |s| refine(s, Refinement::Gradient(Window::Half(11)))),
    ablation("Refinement", "off", |s| refine(s, Refinement::Off)),
    ablation("Pre-smoothing", "0.5 px, strip", |s| {
        s.detect.presmooth_px = 0.5;
        Ok(())
    }),
    ablation("Pre-smoothing", "0.5 px, gradient ±11 px", |s| {
        s.detect.presmooth_px = 0.5;
        refine(s, Refinement::Gradient(Window::Half(11)))
    }),
    ablation("Solver", "no normalisation", |s| {
        s.calibrate.normalise = false;
        Ok(())
    }),
    ablation("Solver", "no RANSAC", |s| {
        s.calibrate.ransac = false;
        Ok(())
    }),
    ablation("Solver", "single precision", |s| {
        s.calibrate.precision = Precision::F32;
        Ok(())
    }),
    ablation("Solver", "one start", |s| {
        s.calibrate.multi_start = false;
        Ok(())
    }),
    ablation("Solver", "linear loss", |s| {
        s.calibrate.loss = Loss::Linear;
        Ok(())
    }),
    ablation("Solver", "no weights", |s| {
        s.calibrate.weights = Weights::None;
        Ok(())
    }),
    ablation("Solver", "linear loss, no weights", |s| {
        s.calibrate.loss = Loss::Linear;
        s.calibrate.weights = Weights::None;
        Ok(())
    }),
    ablation("One corner in 50 is 20 px off", "default", |s| wrong(s, true, Loss::Huber)),
    ablation("One corner in 50 is 20 px off", "no RANSAC", |s| wrong(s, false, Loss::Huber)),
    ablation("One corner in 50 is 20 px off", "linear loss", |s| wrong(s, true, Loss::Linear)),
    ablation("One corner in 50 is 20 px off", "linear loss, no RANSAC", |s| wrong(s, false, Loss::Linear)),
    ablation("Board origin", "first inner corner", |s| {
        s.scene.board.origin = Origin::FirstInner;
        Ok(())
    }),
    ablation("Random poses", "3 views", |s| random_poses(s, 3)),
    ablation("Random poses", "4 views", |s| random_poses(s, 4)),
    ablation("Random poses", "5 views", |s| random_poses(s, 5)),
    ablation("Random poses", "7 views", |s| random_poses(s, 7)),
    ablation("Random poses", "10 views", |s| random_poses(s, 10)),
    ablation("Random poses", "15 views", |s| random_poses(s, 15)),
    ablation("Random poses", "20 views", |s| random_poses(s, 20)),
    ablation("Random poses", "30 views", |s| random_poses(s, 30)),
    ablation("Random poses", "40 views", |s| random_poses(s, 40)),
];

/// Pictures that every change is tried on.
pub const CONDITIONS: &[(&str, fn() -> Degrade)] = &[
    ("clean", Degrade::default),
    ("blur 1 px, noise 5", || Degrade { blur: 1.0, noise: 5.0, ..Degrade::default() }),
];

/// What a change does.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Effect {
    /// The pictures.
    pub condition: String,
    /// What it is about.
    pub group: String,
    /// What is different.
    pub name: String,
    /// Numbers, or why there are none.
    pub outcome: std::result::Result<Numbers, String>,
}

/// Numbers of one run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Numbers {
    /// Pictures.
    pub pictures: usize,
    /// Of these, whole boards found.
    pub full: usize,
    /// Corners used.
    pub corners: usize,
    /// fx of the closed form (no distortion yet) − true fx, px; `None` where it has no solution.
    pub closed_form_fx_px: Option<f64>,
    /// RMS of the residuals, px.
    pub rms_px: f64,
    /// |found − true| of the corners, px.
    pub localisation_px: ErrorStats,
    /// Parameters beside the truth.
    pub parameters: Vec<Comparison>,
    /// RMS over the picture of where the camera found and the true one show the same rays, px; `None` where the one found folds
    /// inside the picture.
    pub map_px: Option<f64>,
    /// 1σ of the projection in the middle and in the worst corner, px.
    pub uncertainty_px: [Option<f64>; 2],
}

impl Numbers {
    /// The numbers of a run.
    ///
    /// # Errors
    /// As [`Run::comparison`].
    pub fn of(run: &Run) -> Result<Self> {
        let (uncertainty, truth) = (run.uncertainty(), &run.setup.scene.camera);
        Ok(Self {
            pictures: run.setup.views,
            full: run.full(),
            corners: run.corners(),
            closed_form_fx_px: run
                .calibration
                .closed_form
                .camera
                .as_ref()
                .map(|c| c.params[0] - truth.params[0]),
            rms_px: run.calibration.rms_px,
            localisation_px: run.localisation(),
            parameters: run.comparison()?,
            map_px: map_px(run),
            uncertainty_px: [uncertainty.center_px, uncertainty.worst_corner_px],
        })
    }
}

/// RMS over a 20 × 15 grid of the picture of (projection by the camera found) − (pixel), for the true camera's rays.
fn map_px(run: &Run) -> Option<f64> {
    let (found, truth) = (run.camera(), &run.setup.scene.camera);
    let [w, h] = truth.size_px.map(f64::from);
    let (mut squares, mut n) = (0.0, 0.0);
    for j in 0..15 {
        for i in 0..20 {
            let px =
                Vector2::new((f64::from(i) + 0.5) / 20.0 * w - 0.5, (f64::from(j) + 0.5) / 15.0 * h - 0.5);
            squares += (found.project(&truth.unproject(&px)?.into())? - px).norm_squared();
            n += 1.0;
        }
    }
    Some(f64::sqrt(squares / n))
}

/// All changes under all conditions.
pub const TRIALS: usize = ABLATIONS.len() * CONDITIONS.len();

/// The number of a change, by its place in [`ABLATIONS`], under a condition, by its place in [`CONDITIONS`]: `0..TRIALS`,
/// one condition after the other.
pub const fn trial(condition: usize, change: usize) -> usize {
    condition * ABLATIONS.len() + change
}

/// Makes the change with this number ([`trial`]); `bench` keeps what several share.
///
/// # Errors
/// [`Error::Invalid`] where there is no such number, and scenes that cannot be drawn; a calibration that is refused is an outcome.
pub fn effect(number: usize, bench: &mut Bench) -> Result<Effect> {
    let [condition, change] = [number / ABLATIONS.len(), number % ABLATIONS.len()];
    let Some((name, degrade)) = CONDITIONS.get(condition) else {
        return Err(Error::Invalid(format!("there is no trial {number}: there are {TRIALS}")));
    };
    let ablation = &ABLATIONS[change];
    let mut setup = Setup::new(Scene { degrade: degrade(), ..Scene::seed() });
    (ablation.change)(&mut setup)?;
    Ok(Effect {
        condition: (*name).to_owned(),
        group: ablation.group.to_owned(),
        name: ablation.name.to_owned(),
        outcome: bench.run(setup).and_then(|run| Numbers::of(&run)).map_err(|e| e.to_string()),
    })
}

/// Makes every change, under every condition. `step` is called before each and may stop it.
///
/// # Errors
/// What `step` answers, and scenes that cannot be drawn; a calibration that is refused is an outcome.
pub fn ablate(step: &mut dyn FnMut(&str) -> Result<()>) -> Result<Vec<Effect>> {
    let mut effects = Vec::new();
    for (condition, (name, _)) in CONDITIONS.iter().enumerate() {
        let mut bench = Bench::default();
        for (change, ablation) in ABLATIONS.iter().enumerate() {
            step(&format!("{name}: {}, {}", ablation.group, ablation.name))?;
            effects.push(effect(trial(condition, change), &mut bench)?);
        }
    }
    Ok(effects)
}
