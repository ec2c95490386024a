//! From one model to another, over the whole picture.
//!
//! The pixels of a grid are turned into rays by the camera; the parameters of the other model are found so that the rays appear
//! where they were, in the least-squares sense. The frame of the camera is held, so poses stay valid.

use std::fmt;

use nalgebra::{DMatrix, DVector, Vector2, Vector3};

use super::{Camera, Model, Spec};
use crate::{Error, Result};

/// Columns and rows of the pixels of the fit.
const GRID: [u32; 2] = [41, 31];
const MAX_ITERATIONS: usize = 200;
/// Error beyond which the result is no approximation any more, as a fraction of the picture's diagonal.
const USELESS: f64 = 0.02;
/// Angle at which the start looks at the lens, rad.
const NEAR_AXIS: f64 = 0.1;

/// How well the other model follows the camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FitError {
    /// Largest distance over the picture, px.
    pub max_px: f64,
    /// Root mean square distance over the picture, px.
    pub rms_px: f64,
}

impl fmt::Display for FitError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "largest error {} px, RMS {} px", digits(self.max_px), digits(self.rms_px))
    }
}

/// Two significant digits below 1 px.
fn digits(px: f64) -> String {
    if px == 0.0 || px >= 1e-3 { format!("{px:.4}") } else { format!("{px:.1e}") }
}

/// Pixels of a grid that covers a picture from border to border.
pub fn grid(size_px: [u32; 2], [cols, rows]: [u32; 2]) -> impl Iterator<Item = Vector2<f64>> {
    let [w, h] = size_px.map(f64::from);
    let at = |extent: f64, i: u32, n: u32| extent * f64::from(i) / f64::from(n - 1) - 0.5;
    (0..rows).flat_map(move |j| (0..cols).map(move |i| Vector2::new(at(w, i, cols), at(h, j, rows))))
}

impl Camera {
    /// The camera of another model that follows this one best over its picture.
    ///
    /// # Errors
    /// [`Error::Unsupported`] where the picture has too few rays, the model cannot see all of them, the best fit is useless or folds
    /// inside the picture.
    pub fn refit(&self, model: Model) -> Result<(Self, FitError)> {
        let seen: Vec<Seen> = grid(self.size_px, GRID)
            .filter_map(|px| self.unproject(&px).map(|ray| Seen { ray, px }))
            .collect();
        let no = |why: &str| {
            Error::Unsupported(format!("{} cannot stand for this camera: {why}", model.spec().title))
        };
        if seen.len() < 10 * model.spec().params.len() {
            return Err(no("most of the picture has no ray, because the distortion folds"));
        }
        if model.spec().perspective && seen.iter().any(|s| s.ray.z <= 0.0) {
            return Err(no("the picture reaches beyond 90° from the optical axis"));
        }
        let (params, error) =
            fit(model.spec(), &seen, self.start_of(model)).ok_or_else(|| no("no fit was found"))?;
        let [w, h] = self.size_px.map(f64::from);
        if error.max_px.is_nan() || error.max_px > USELESS * w.hypot(h) {
            return Err(no(&format!("even the best fit is useless ({error})")));
        }
        let camera = Self::new(model, self.size_px, params)?;
        if seen.iter().any(|s| camera.expansion(&s.ray).is_none_or(|d| d <= 0.0)) {
            return Err(no("the best fit folds inside the picture"));
        }
        Ok((camera, error))
    }

    /// Parameters of another model that look the same near the axis.
    fn start_of(&self, model: Model) -> Vec<f64> {
        let spec = model.spec();
        let [fx, fy, cx, cy] = self.intrinsics();
        let mut params = vec![fx, fy, cx, cy];
        params.extend(spec.neutral);
        let own = self.spec();
        // `r/f = θ + c θ³ + …`; that of a perspective lens without terms, tan θ, has c = 1/3.
        let (sin, cos) = NEAR_AXIS.sin_cos();
        let axis = (own.project)(&self.params, &Vector3::z());
        let beside = (own.project_px)(&self.params, &Vector3::new(sin, 0.0, cos));
        if let (Some(axis), Some(beside)) = (axis, beside) {
            params[0] = axis.by_point[(0, 0)];
            params[1] = axis.by_point[(1, 1)];
            let c = ((beside.x - axis.px.x) / (params[0] * NEAR_AXIS) - 1.0) / NEAR_AXIS.powi(2);
            if let Some(k1) = spec.index("k1") {
                params[k1] = if spec.perspective { c - 1.0 / 3.0 } else { c };
            }
        }
        if own.perspective && spec.perspective {
            for (name, value) in self.distortion() {
                if let Some(i) = spec.index(name) {
                    params[i] = value;
                }
            }
        }
        params
    }
}

/// A ray and where the camera sees it.
struct Seen {
    ray: Vector3<f64>,
    px: Vector2<f64>,
}

/// Levenberg–Marquardt; `None` where the start does not see the rays.
fn fit(spec: &Spec, seen: &[Seen], start: Vec<f64>) -> Option<(Vec<f64>, FitError)> {
    let mut params = start;
    let mut cost = squares(spec, seen, &params)?;
    let mut damping = 1e-6;
    for _ in 0..MAX_ITERATIONS {
        let (hessian, gradient) = normal(spec, seen, &params)?;
        let mut better = None;
        while better.is_none() && damping < 1e12 {
            let mut damped = hessian.clone();
            for i in 0..params.len() {
                damped[(i, i)] = damped[(i, i)] * (1.0 + damping) + f64::MIN_POSITIVE;
            }
            if let Some(step) = damped.cholesky().map(|c| c.solve(&gradient)) {
                let candidate: Vec<f64> = params.iter().zip(step.iter()).map(|(p, s)| p + s).collect();
                better = squares(spec, seen, &candidate).filter(|c| *c < cost).map(|c| (candidate, c));
            }
            damping *= if better.is_some() { 0.1 } else { 10.0 };
        }
        let Some((candidate, new_cost)) = better else { break };
        let done = cost - new_cost <= 1e-15 * cost;
        (params, cost) = (candidate, new_cost);
        if done {
            break;
        }
    }
    let error = measure(spec, seen, &params);
    Some((params, error))
}

fn squares(spec: &Spec, seen: &[Seen], params: &[f64]) -> Option<f64> {
    let mut sum = 0.0;
    for s in seen {
        sum += (s.px - (spec.project_px)(params, &s.ray)?).norm_squared();
    }
    (sum.is_finite() && params[0] > 0.0 && params[1] > 0.0).then_some(sum)
}

/// JᵀJ and Jᵀr.
fn normal(spec: &Spec, seen: &[Seen], params: &[f64]) -> Option<(DMatrix<f64>, DVector<f64>)> {
    let n = params.len();
    let (mut hessian, mut gradient) = (DMatrix::zeros(n, n), DVector::zeros(n));
    for s in seen {
        let at = (spec.project)(params, &s.ray)?;
        let residual = s.px - at.px;
        for i in 0..n {
            gradient[i] += at.by_params[i].dot(&residual);
            for j in 0..n {
                hessian[(i, j)] += at.by_params[i].dot(&at.by_params[j]);
            }
        }
    }
    Some((hessian, gradient))
}

fn measure(spec: &Spec, seen: &[Seen], params: &[f64]) -> FitError {
    let mut max_px = 0.0f64;
    let mut sum = 0.0;
    for s in seen {
        let miss = (spec.project_px)(params, &s.ray).map_or(f64::INFINITY, |p| (s.px - p).norm());
        max_px = max_px.max(miss);
        sum += miss * miss;
    }
    FitError { max_px, rms_px: (sum / seen.len() as f64).sqrt() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_model_that_holds_the_camera_gives_it_back() {
        let truth = vec![533.0, 533.2, 342.3, 234.0, -0.2854, 0.064, 1.1e-3, -1.3e-4, 0.0];
        let camera = Camera::new(Model::Brown5, [640, 480], truth).unwrap();
        let (brown4, error) = camera.refit(Model::Brown4).unwrap();
        assert!(error.max_px < 1e-9, "{error}");
        for (f, t) in brown4.params.iter().zip(&camera.params) {
            assert!((f - t).abs() < 1e-9 * t.abs().max(1.0), "{brown4:?}");
        }
    }

    #[test]
    fn fisheye_models_follow_each_other_beyond_a_right_angle() {
        let params = vec![160.0, 160.5, 319.5, 239.5, -0.2, 0.58];
        let sphere = Camera::new(Model::Ds, [640, 480], params).unwrap();
        assert!(sphere.unproject(&Vector2::new(0.0, 0.0)).unwrap().z < 0.0);
        let (kb4, error) = sphere.refit(Model::Kb4).unwrap();
        assert!(error.max_px < 1.0, "{error}");
        // Its two numbers and the focal length stand for each other.
        let (_, error) = kb4.refit(Model::Ds).unwrap();
        assert!(error.max_px < 1.0, "{error}");
    }

    #[test]
    fn moderate_lenses_are_refitted_and_wide_ones_refused() {
        let kb4 = |p: [f64; 8]| Camera::new(Model::Kb4, [640, 480], p.to_vec()).unwrap();
        let (brown, error) =
            kb4([500.0, 501.0, 319.5, 239.5, 0.1, -0.05, 0.01, 0.0]).refit(Model::Brown5).unwrap();
        assert!((brown.params[0] - 500.0).abs() < 10.0 && error.max_px < 0.1, "{error}");
        let wide = kb4([150.0, 150.0, 319.5, 239.5, 0.0, 0.0, 0.0, 0.0]).refit(Model::Brown5).unwrap_err();
        assert!(wide.to_string().contains("beyond 90°"), "{wide}");
        // A lens whose terms fold before the corners of the picture.
        assert!(kb4([300.0, 300.0, 319.5, 239.5, -2.0, 0.0, 0.0, 0.0]).refit(Model::Brown5).is_err());
    }

    #[test]
    fn the_error_of_a_missing_term_is_reported_and_small() {
        let params = vec![400.0, 400.0, 320.0, 240.0, -0.3, 0.12, 0.0, 0.0, -0.02];
        let camera = Camera::new(Model::Brown5, [640, 480], params).unwrap();
        let (fitted, error) = camera.refit(Model::Brown4).unwrap();
        assert!((fitted.params[0] - 400.0).abs() < 5.0 && error.max_px > 0.0, "{error}");
    }
}
