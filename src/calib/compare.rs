//! Two calibrations beside each other: where in the picture they differ, by how many px, and whether chance explains it.
//!
//! Pixels of the first camera are seen by the second in the direction that they look in, after the rotation between both that brings
//! them closest: how a camera is turned is no property of its lens. With the covariance Σ of the parameters of both, the
//! displacement δ has, to first order,
//!
//! ```text
//! δ = (I − T (TᵀWT)⁻¹ TᵀW) (J_B δb_B − J_A δb_A),    T = ∂px/∂rotation,  J = ∂px/∂parameters
//! ```
//!
//! and the covariance that follows. Places count by their certainty, W = 1/(σ² + s²) with s the median of σ over the picture, so that
//! neither extrapolated corners nor a single certain spot decide; where no file holds σ the middle half of the picture counts alone.
//! The sum δᵀWδ is, by chance, a sum of χ² with weights λ (the eigenvalues of its covariance), of which mean and variance give its
//! distribution (F. E. Satterthwaite, "An approximate distribution of estimates of variance components", 1946).
//!
//! A residual map is part of the camera that it corrects, and counts as exact. σ is that of corner noise: a lens that its model does not describe differs by more, and so do two calibrations with it.

mod chance;
pub mod date;
mod page;
mod series;
mod spread;
mod validity;

use nalgebra::{DMatrix, Vector2};
use serde::Serialize;

use super::{
    Error, Result, camera::Camera, figure::Grid, format::CameraFile, influence::displacement_with,
    report::Solution, residual::Field,
};
pub use chance::{Chance, UNLIKELY};
pub use page::{figures, page};
pub use series::{Course, Entry, Member, Series};
use spread::Spread;
pub use validity::{Answer, Moved, Validity, judge};

/// Cells along the longer side of the picture.
const CELLS: usize = 32;

/// One of two calibrations.
#[derive(Clone, Debug, PartialEq)]
pub struct Side {
    /// The camera.
    pub camera: Camera,
    /// Covariance of all its parameters in the model's order, zero where fixed; `None` where it is not known.
    pub covariance: Option<DMatrix<f64>>,
    /// What its residual map adds; `None` where it has none. It counts as exact.
    pub residual: Option<Field>,
}

impl Side {
    /// Of a solution.
    pub fn of(solution: &Solution) -> Self {
        Self {
            camera: solution.camera.clone(),
            covariance: Some(solution.covariance.clone()),
            residual: solution.residual_map.as_ref().and_then(|map| map.field.clone()),
        }
    }

    fn seen(&self) -> (&Camera, Option<&Field>) {
        (&self.camera, self.residual.as_ref())
    }
}

impl From<&CameraFile> for Side {
    fn from(file: &CameraFile) -> Self {
        Self {
            camera: file.camera.clone(),
            covariance: file.evidence.covariance_of_all(&file.camera),
            residual: file.evidence.residual.clone(),
        }
    }
}

/// Lengths of the displacement over a part of the picture, px.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Figures {
    /// Mean.
    pub mean_px: f64,
    /// √ of the mean square.
    pub rms_px: f64,
    /// Largest.
    pub max_px: f64,
}

impl Figures {
    fn of(lengths: impl Iterator<Item = f64>) -> Self {
        let (mut n, mut sums, mut max_px) = (0.0, [0.0, 0.0], 0.0f64);
        for length in lengths {
            n += 1.0;
            sums[0] += length;
            sums[1] += length * length;
            max_px = max_px.max(length);
        }
        let n = f64::max(n, 1.0);
        Self { mean_px: sums[0] / n, rms_px: (sums[1] / n).sqrt(), max_px }
    }
}

/// A parameter that both models have.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Parameter {
    /// Its name.
    pub name: &'static str,
    /// In the first and the second.
    pub values: [f64; 2],
    /// σ in both, where known; 0 where it was fixed.
    pub sigma: [Option<f64>; 2],
    /// The difference in units of its σ; none where no σ is known.
    pub in_sigma: Option<f64>,
}

/// What comparing two calibrations tells.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Chance explains the difference.
    WithinChance,
    /// It does not.
    Differ,
    /// Neither file holds σ, so nobody can say.
    Unknown,
}

/// Two calibrations beside each other.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// Of the pictures of both, px.
    pub image_size_px: [u32; 2],
    /// What it comes to.
    pub verdict: Verdict,
    /// Over the whole picture.
    pub whole: Figures,
    /// Over the middle half of its width and height.
    pub middle: Figures,
    /// In its four corners.
    pub corners: Figures,
    /// What chance lets expect; none where neither file holds σ.
    pub chance: Option<Chance>,
    /// Parameters that both models have.
    pub parameters: Vec<Parameter>,
    /// `[Δx, Δy]` in the middles of equal cells, rows from the top: where the second sees what the first sees there; null where one of
    /// them does not.
    pub moved_px: Vec<Vec<Option<[f64; 2]>>>,
    /// 1σ of each side at the same places, largest over directions, px; null where its file holds none.
    pub sigma_px: [Option<Vec<Vec<f64>>>; 2],
}

impl Comparison {
    /// Lengths of the displacement as a map.
    pub fn lengths(&self) -> Grid {
        let length = |d: &Option<[f64; 2]>| d.map_or(f64::NAN, |[x, y]| x.hypot(y));
        self.grid(self.moved_px.iter().flatten().map(length).collect())
    }

    /// σ of one side as a map.
    pub fn sigma(&self, side: usize) -> Option<Grid> {
        let rows = self.sigma_px.get(side)?.as_ref()?;
        Some(self.grid(rows.iter().flatten().copied().collect()))
    }

    fn grid(&self, values: Vec<f64>) -> Grid {
        Grid { columns: self.moved_px.first().map_or(0, Vec::len), rows: self.moved_px.len(), values }
    }

    /// A parameter by its name.
    pub fn parameter(&self, name: &str) -> Option<&Parameter> {
        self.parameters.iter().find(|p| p.name == name)
    }
}

/// Compares two calibrations of pictures of one size.
///
/// # Errors
/// [`Error::Invalid`] where the sizes differ, with the command that converts, [`Error::Degenerate`] where the two share no place.
pub fn compare(a: &Side, b: &Side) -> Result<Comparison> {
    let size_px = a.camera.size_px;
    if b.camera.size_px != size_px {
        return Err(sizes_differ(size_px, b.camera.size_px));
    }
    let [columns, rows] = cells(size_px);
    let [w, h] = size_px.map(f64::from);
    let middle_of = |i: usize, n: usize, size: f64| (i as f64 + 0.5) / n as f64 * size - 0.5;
    let mut pixels: Vec<Vector2<f64>> = (0..rows)
        .flat_map(|j| {
            (0..columns).map(move |i| Vector2::new(middle_of(i, columns, w), middle_of(j, rows, h)))
        })
        .collect();
    let inside = pixels.len();
    pixels.extend([[0.0, 0.0], [w - 1.0, 0.0], [0.0, h - 1.0], [w - 1.0, h - 1.0]].map(Vector2::from));
    let central =
        |px: &Vector2<f64>| ((px.x + 0.5) / w - 0.5).abs() <= 0.25 && ((px.y + 0.5) / h - 0.5).abs() <= 0.25;
    let mut weights: Vec<f64> = pixels.iter().map(|px| if central(px) { 1.0 } else { 0.0 }).collect();
    let known = a.covariance.is_some() || b.covariance.is_some();
    let mut spread = None;
    if known && let Some(first) = Spread::new(a, b, &pixels, &weights) {
        weights = first.weights();
        spread = Spread::new(a, b, &pixels, &weights);
    }
    let moved = displacement_with([a.seen(), b.seen()], &pixels, &weights);
    let lengths = || moved.iter().map(|d| d.map(|d| d.norm()));
    if lengths().take(inside).flatten().next().is_none() {
        return Err(Error::Degenerate(
            "no place of the picture is seen by both cameras: one of the models folds, or is for another lens".to_owned(),
        ));
    }
    let in_middle = || lengths().zip(&pixels).take(inside).filter(|(_, px)| central(px));
    let chance = spread.as_ref().and_then(|s| s.chance(&moved, &weights));
    let by_rows = |values: Vec<f64>| values.chunks(columns).map(<[f64]>::to_vec).collect();
    let sigma_of = |side: usize, known: bool| {
        let values = spread.as_ref()?.sigma(side).into_iter().take(inside).collect();
        known.then(|| by_rows(values))
    };
    Ok(Comparison {
        image_size_px: size_px,
        verdict: match &chance {
            None => Verdict::Unknown,
            Some(c) if c.probability < UNLIKELY => Verdict::Differ,
            Some(_) => Verdict::WithinChance,
        },
        whole: Figures::of(lengths().take(inside).flatten()),
        middle: Figures::of(in_middle().filter_map(|(d, _)| d)),
        corners: Figures::of(lengths().skip(inside).flatten()),
        chance,
        parameters: parameters(a, b),
        moved_px: moved[..inside]
            .chunks(columns)
            .map(|row| row.iter().map(|d| d.map(Into::into)).collect())
            .collect(),
        sigma_px: [sigma_of(0, a.covariance.is_some()), sigma_of(1, b.covariance.is_some())],
    })
}

fn cells(size_px: [u32; 2]) -> [usize; 2] {
    let longer = f64::from(size_px[0].max(size_px[1]).max(1));
    size_px.map(|n| (CELLS as f64 * f64::from(n) / longer).round().max(1.0) as usize)
}

fn sizes_differ([aw, ah]: [u32; 2], [bw, bh]: [u32; 2]) -> Error {
    let scale = f64::from(aw) / f64::from(bw);
    let how = if (f64::from(bh) * scale).round() == f64::from(ah) {
        format!("convert the second one with `straightedge convert --scale {scale}`")
    } else {
        "convert one of them with `straightedge convert --crop` or `--scale`".to_owned()
    };
    Error::Invalid(format!(
        "the first camera is for pictures of {aw} x {ah} px, the second for {bw} x {bh}: {how}, if it is one camera"
    ))
}

fn parameters(a: &Side, b: &Side) -> Vec<Parameter> {
    let sigma = |side: &Side, i: usize| Some(side.covariance.as_ref()?.get((i, i))?.max(0.0).sqrt());
    let shared = a.camera.spec().params.iter().enumerate().filter_map(|(i, p)| {
        let j = b.camera.spec().index(p.name)?;
        let values = [a.camera.params[i], b.camera.params[j]];
        let sigma = [sigma(a, i), sigma(b, j)];
        let both = sigma[0].unwrap_or(0.0).hypot(sigma[1].unwrap_or(0.0));
        let in_sigma = (both > 0.0).then(|| (values[1] - values[0]) / both);
        Some(Parameter { name: p.name, values, sigma, in_sigma })
    });
    shared.collect()
}
