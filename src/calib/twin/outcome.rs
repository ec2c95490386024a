//! What the runs of a twin say: bias and scatter beside the predicted σ.

use std::{collections::BTreeMap, ops::ControlFlow};

use nalgebra::{Matrix2, Point3, Vector2, Vector3};
use serde::{Deserialize, Serialize};

use super::{Seen, Twin};
use crate::calib::{
    Error, Result,
    calibrate::{Problem, calibrate, centred},
    marker::board::MarkerBoard,
    number::significant,
    order,
    pose::Pose,
    solution::Calibration,
    stats,
    target::Target,
    uncertainty::{self, Range},
};

/// Fewest runs that say something about a scatter.
const FEWEST: usize = 3;

/// What came out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// Runs that have a camera.
    pub runs: usize,
    /// Runs that have none.
    pub failed: usize,
    /// Pictures of a run.
    pub pictures: usize,
    /// Share of the corners that were found again.
    pub found_fraction: f64,
    /// Noise of the pictures, grey levels: the median.
    pub noise_levels: f64,
    /// RMS of the corners' distances from their true places per coordinate, and of their predicted σ, px.
    pub corner_px: [f64; 2],
    /// Of these distances what is the same in every run, RMS per coordinate, px.
    pub corner_bias_px: f64,
    /// Correlation of the noise of neighbouring corners across the printed edge between them; 0 of circles, which have none.
    pub neighbours: f64,
    /// RMS per coordinate of the residuals: of the capture, and of its twin.
    pub rms_per_coordinate_px: [f64; 2],
    /// One for each parameter of the camera that is free.
    pub parameters: Vec<Parameter>,
    /// The projection at places in the picture, at the boards' distance, px.
    pub places: Vec<Place>,
}

/// A parameter of the camera over the runs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Parameter {
    /// Its name.
    pub name: String,
    /// Its true value: that of the capture.
    pub truth: f64,
    /// Mean of what was found − truth.
    pub bias: f64,
    /// Standard deviation of what was found.
    pub scatter: f64,
    /// Predicted σ: root mean square over the runs.
    pub sigma: f64,
    /// Predicted σ of the capture.
    pub capture_sigma: Option<f64>,
}

/// The projection at a place in the picture over the runs, in the gauge of the boards.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Place {
    /// What it is called.
    pub name: String,
    /// The pixel.
    pub at_px: [f64; 2],
    /// Length of the mean shift of what the true camera sees there, px.
    pub bias_px: f64,
    /// Standard deviation of the shift in its worst direction, px.
    pub scatter_px: f64,
    /// Predicted σ: root mean square over the runs; `None` where a run has none.
    pub sigma_px: Option<f64>,
}

impl Outcome {
    /// By how much more than σ the projection scatters where corners are dense, because neighbours err together: σ takes corners for
    /// independent. Along a line of corners that are correlated by ρ with the next the variance of a smooth shift is 1 + 2ρ.
    pub fn beyond_sigma(&self) -> f64 {
        (1.0 + 2.0 * self.neighbours.max(0.0)).sqrt()
    }

    /// The same in words; nothing where neighbours do not matter.
    pub fn neighbour_words(&self) -> Option<String> {
        /// A scatter that is a twentieth larger than σ.
        const MATTERS: f64 = 0.05;
        (self.neighbours > MATTERS).then(|| {
            format!(
                "Errors of neighbouring corners go together by {}: squares are so small that both read the edge between them, which σ does not know. The scatter is up to {} times σ",
                significant(self.neighbours, 2),
                significant(self.beyond_sigma(), 2)
            )
        })
    }
}

impl Parameter {
    /// Bias in its own standard errors over the runs.
    pub fn bias_in_errors(&self, runs: usize) -> f64 {
        self.bias / (self.scatter / (runs.max(1) as f64).sqrt()).max(f64::MIN_POSITIVE)
    }
}

pub(super) fn of(
    twin: &Twin,
    seen: &[Seen],
    report: &mut dyn FnMut(f32) -> ControlFlow<()>,
) -> Result<Outcome> {
    let runs = seen.iter().map(|s| s.corners.len()).min().unwrap_or(0);
    let mut found = Vec::with_capacity(runs);
    for run in 0..runs {
        if report(run as f32 / runs as f32).is_break() {
            return Err(Error::Stopped);
        }
        match solved(&twin.problem(seen, run)) {
            Ok(calibration) => found.push(calibration),
            Err(Error::Stopped) => return Err(Error::Stopped),
            Err(_) => {}
        }
    }
    if found.len() < FEWEST {
        return Err(Error::Invalid(format!(
            "only {} of {runs} runs of the twin have a camera, {FEWEST} are needed: give more runs, or a capture whose boards are found",
            found.len()
        )));
    }
    let mut noises: Vec<f64> = seen.iter().map(|s| s.noise).collect();
    noises.sort_by(f64::total_cmp);
    let corners = Corners::of(twin, seen);
    let wanted = runs * twin.views.iter().map(|v| v.used.len()).sum::<usize>();
    let rms = |of: &dyn Fn(&Calibration) -> f64| mean(found.iter().map(|c| of(c).powi(2))).sqrt();
    Ok(Outcome {
        runs: found.len(),
        failed: runs - found.len(),
        pictures: seen.len(),
        found_fraction: corners.found as f64 / wanted.max(1) as f64,
        noise_levels: stats::quantile(&noises, 0.5),
        corner_px: [corners.off, corners.told].map(f64::sqrt),
        corner_bias_px: corners.bias.sqrt(),
        neighbours: corners.neighbours,
        rms_per_coordinate_px: [twin.solution.rms_per_coordinate_px, rms(&|c| c.rms_px / 2f64.sqrt())],
        parameters: parameters(twin, &found),
        places: places(twin, &found),
    })
}

/// As a capture is: with the centres of circles put right.
fn solved(problem: &Problem) -> Result<Calibration> {
    let go_on = &mut |_| ControlFlow::Continue(());
    centred(problem, calibrate(problem, go_on)?, go_on)
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (n, sum) = values.fold((0.0, 0.0), |(n, sum), v| (n + 1.0, sum + v));
    if n > 0.0 { sum / n } else { 0.0 }
}

/// What the corners of all pictures tell, per coordinate.
#[derive(Default)]
struct Corners {
    found: usize,
    /// Mean squares: of the distance from the true place, of what of it is the same in every run, of the predicted σ, px².
    off: f64,
    bias: f64,
    told: f64,
    /// Correlation of the noise of neighbours, across the edge between them.
    neighbours: f64,
}

impl Corners {
    fn of(twin: &Twin, seen: &[Seen]) -> Self {
        let pairs = neighbours(&twin.target);
        let (mut out, mut together, mut alone) = (Self::default(), 0.0, 0.0);
        for (view, seen) in seen.iter().enumerate() {
            let truth = twin.places_px(view);
            let place = |index: u32| truth.get(index as usize).copied().flatten();
            let mut means: BTreeMap<u32, (f64, Vector2<f64>)> = BTreeMap::new();
            for c in seen.corners.iter().flatten() {
                let Some(error) = place(c.index).map(|at| c.px - at) else { continue };
                let (n, sum) = means.entry(c.index).or_default();
                (*n, *sum) = (*n + 1.0, *sum + error);
                out.found += 1;
                out.off += 0.5 * error.norm_squared();
                out.told += c.sigma_px.powi(2);
            }
            for (n, mean) in means.values_mut() {
                *mean /= *n;
                out.bias += 0.5 * *n * mean.norm_squared();
            }
            for corners in &seen.corners {
                let noise = order::map(
                    corners
                        .iter()
                        .filter_map(|c| Some((c.index, c.px - place(c.index)? - means.get(&c.index)?.1))),
                );
                for [index, next] in pairs.iter().copied() {
                    let (Some(one), Some(two), Some(a), Some(b)) =
                        (noise.get(&index), noise.get(&next), place(index), place(next))
                    else {
                        continue;
                    };
                    let across = [one, two].map(|e| (b - a).normalize().perp(e));
                    together += across[0] * across[1];
                    alone += 0.5 * (across[0].powi(2) + across[1].powi(2));
                }
            }
        }
        let n = out.found.max(1) as f64;
        (out.off, out.bias, out.told) = (out.off / n, out.bias / n, out.told / n);
        out.neighbours = if alone > 0.0 { together / alone } else { 0.0 };
        out
    }
}

/// Indices of points that are joined by a printed edge.
pub(super) fn neighbours(target: &Target) -> Vec<[u32; 2]> {
    let mut pairs = Vec::new();
    match target {
        Target::Circles { .. } | Target::Points { .. } => {}
        // Corners around each marker, and of an AprilGrid across the small squares between them; rows are counted upwards there.
        Target::Markers {
            board: board @ (MarkerBoard::AprilGrid(_) | MarkerBoard::ArucoGrid(_)), ..
        } => {
            let size = board.size();
            for place in 0..size.len() as u32 {
                let corner = |place: u32, k: u32| 4 * place + k;
                pairs.extend([0, 1, 2, 3].map(|k| [corner(place, k), corner(place, (k + 1) % 4)]));
                if matches!(board, MarkerBoard::AprilGrid(_)) {
                    let [column, row] = size.at(place);
                    if column + 1 < size.cols {
                        pairs.extend([[1, 0], [2, 3]].map(|[a, b]| [corner(place, a), corner(place + 1, b)]));
                    }
                    if row + 1 < size.rows {
                        let above = place + size.cols;
                        pairs.extend([[3, 0], [2, 1]].map(|[a, b]| [corner(place, a), corner(above, b)]));
                    }
                }
            }
        }
        Target::Checkerboard { .. } | Target::Markers { .. } => {
            let Some(size) = target.grid() else { return pairs };
            for index in 0..size.len() as u32 {
                let [column, row] = size.at(index);
                pairs.extend((column + 1 < size.cols).then_some([index, index + 1]));
                pairs.extend((row + 1 < size.rows).then_some([index, index + size.cols]));
            }
        }
    }
    pairs
}

fn parameters(twin: &Twin, found: &[Calibration]) -> Vec<Parameter> {
    let camera = &twin.camera;
    let n = found.len() as f64;
    let of = |(i, param): (usize, &crate::calib::camera::Param)| {
        let sigma = found.iter().map(|c| c.sigma.get(i).copied().flatten()).collect::<Option<Vec<f64>>>()?;
        let shift = |c: &Calibration| c.camera.params[i] - camera.params[i];
        let bias = mean(found.iter().map(shift));
        let squares: f64 = found.iter().map(|c| (shift(c) - bias).powi(2)).sum();
        Some(Parameter {
            name: param.name.to_owned(),
            truth: camera.params[i],
            bias,
            scatter: (squares / (n - 1.0)).sqrt(),
            sigma: mean(sigma.into_iter().map(|s| s * s)).sqrt(),
            capture_sigma: twin.solution.sigma.get(param.name).copied().flatten(),
        })
    };
    camera.spec().params.iter().enumerate().filter_map(of).collect()
}

fn places(twin: &Twin, found: &[Calibration]) -> Vec<Place> {
    let [w, h] = twin.camera.size_px.map(|n| f64::from(n) - 1.0);
    let list = [
        ("middle", [w / 2.0, h / 2.0]),
        ("upper left corner", [0.0, 0.0]),
        ("upper right corner", [w, 0.0]),
        ("lower left corner", [0.0, h]),
        ("lower right corner", [w, h]),
    ];
    let range = twin.solution.uncertainty.range;
    let pixels = list.map(|(_, at)| Vector2::from(at));
    let told: Vec<Vec<Option<f64>>> = found
        .iter()
        .map(|c| uncertainty::at(c, &twin.target, range.map_or(Range::Infinity, Range::At), &pixels))
        .collect();
    let poses: Vec<Option<Pose>> =
        (0..twin.pictures()).map(|v| twin.views.get(v).map(|v| v.camera_from_board)).collect();
    let place = |(k, (name, at_px)): (usize, (&str, [f64; 2]))| {
        let shifts =
            found.iter().map(|c| shift(twin, &poses, c, &pixels[k], range?)).collect::<Option<Vec<_>>>()?;
        let bias = shifts.iter().sum::<Vector2<f64>>() / shifts.len() as f64;
        let spread: Matrix2<f64> = shifts.iter().map(|s| (s - bias) * (s - bias).transpose()).sum();
        let variance = (spread / (shifts.len() as f64 - 1.0)).symmetric_eigenvalues().max();
        let sigma = told.iter().map(|t| t[k]).collect::<Option<Vec<f64>>>();
        Some(Place {
            name: name.to_owned(),
            at_px,
            bias_px: bias.norm(),
            scatter_px: variance.max(0.0).sqrt(),
            sigma_px: sigma.map(|s| mean(s.into_iter().map(|s| s * s)).sqrt()),
        })
    };
    list.into_iter().enumerate().filter_map(place).collect()
}

/// Where a found camera shows what the true one sees at a pixel, by the mean of the boards' frames, minus that pixel.
fn shift(
    twin: &Twin,
    poses: &[Option<Pose>],
    found: &Calibration,
    px: &Vector2<f64>,
    range: f64,
) -> Option<Vector2<f64>> {
    let point = Point3::from(twin.camera.unproject(px)? * range);
    let (mut sum, mut n) = (Vector3::zeros(), 0.0);
    for view in &found.views {
        let pose = (*poses.get(view.frame.0 as usize)?)?;
        sum += view.camera_from_board.apply(&pose.inverse().apply(&point)).coords;
        n += 1.0;
    }
    Some(found.camera.project(&Point3::from(sum / n))? - px)
}
