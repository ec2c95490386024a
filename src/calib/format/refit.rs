//! Fits a lens with fewer or other terms to a camera, over the whole picture.
//!
//! The pixels of a grid are turned into rays by the camera; the parameters of the other lens are found so that the rays
//! appear where they were, in the least-squares sense. The frame of the camera is held, so poses stay valid.

use std::fmt;

use nalgebra::{DMatrix, DVector, Vector2, Vector3};

use super::grid;
use crate::calib::{Error, Result, camera::Camera};

/// Pixels of the fit.
const GRID: [u32; 2] = [41, 31];
const MAX_ITERATIONS: usize = 200;
/// Error beyond which the result is no approximation any more, as a fraction of the picture's diagonal.
const USELESS: f64 = 0.02;

/// How well the other lens follows the camera.
#[derive(Clone, Copy, Debug)]
pub(super) struct FitError {
    /// Largest distance over the picture, px.
    max_px: f64,
    /// Root mean square distance over the picture, px.
    rms_px: f64,
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

/// A lens: parameters and a direction to px.
pub(super) type Project<'a> = &'a dyn Fn(&[f64], &Vector3<f64>) -> Option<Vector2<f64>>;

/// Ray of a pixel; `None` where there is none.
pub(super) type RayOf<'a> = &'a dyn Fn(&Vector2<f64>) -> Option<Vector3<f64>>;

/// Parameters of `project` that follow the lens `ray_of` best over a picture, from `start` (`fx fy cx cy` first), by Levenberg–Marquardt.
///
/// # Errors
/// [`Error::Unsupported`] where the picture has too few rays or the best fit is useless.
pub(super) fn fit(
    size_px: [u32; 2],
    ray_of: RayOf<'_>,
    start: &[f64],
    project: Project<'_>,
) -> Result<(Vec<f64>, FitError)> {
    let rays: Vec<(Vector3<f64>, Vector2<f64>)> =
        grid(size_px, GRID).filter_map(|px| ray_of(&px).map(|ray| (ray, px))).collect();
    if rays.len() < 10 * start.len() {
        return Err(Error::Unsupported(
            "most of the picture has no ray (the distortion folds): the camera cannot be refitted".to_owned(),
        ));
    }
    let mut params = start.to_vec();
    let mut cost = squares(&rays, &params, project).unwrap_or(f64::INFINITY);
    let mut damping = 1e-6;
    for _ in 0..MAX_ITERATIONS {
        let Some((hessian, gradient)) = normal(&rays, &params, project) else { break };
        let mut better = None;
        while better.is_none() && damping < 1e12 {
            let mut damped = hessian.clone();
            for i in 0..params.len() {
                damped[(i, i)] *= 1.0 + damping;
            }
            if let Some(step) = damped.cholesky().map(|c| c.solve(&gradient)) {
                let candidate: Vec<f64> = params.iter().zip(step.iter()).map(|(p, s)| p + s).collect();
                better = squares(&rays, &candidate, project).filter(|c| *c < cost).map(|c| (candidate, c));
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
    let error = measure(&rays, &params, project);
    let [w, h] = size_px.map(f64::from);
    if error.max_px.is_nan() || error.max_px > USELESS * w.hypot(h) {
        return Err(Error::Unsupported(format!(
            "even the best refit is useless ({error}): choose a format that holds the model"
        )));
    }
    Ok((params, error))
}

fn squares(rays: &[(Vector3<f64>, Vector2<f64>)], params: &[f64], project: Project<'_>) -> Option<f64> {
    let mut sum = 0.0;
    for (ray, px) in rays {
        sum += (px - project(params, ray)?).norm_squared();
    }
    (sum.is_finite() && params[0] > 0.0 && params[1] > 0.0).then_some(sum)
}

/// JᵀJ and Jᵀr with central differences: the fit is small, and any lens will do.
fn normal(
    rays: &[(Vector3<f64>, Vector2<f64>)],
    params: &[f64],
    project: Project<'_>,
) -> Option<(DMatrix<f64>, DVector<f64>)> {
    let n = params.len();
    let (mut hessian, mut gradient) = (DMatrix::zeros(n, n), DVector::zeros(n));
    let mut columns = vec![Vector2::zeros(); n];
    let mut moved = params.to_vec();
    for (ray, px) in rays {
        let residual = px - project(params, ray)?;
        for (k, column) in columns.iter_mut().enumerate() {
            let h = 1e-6 * if k < 4 { params[0] } else { params[k].abs().max(0.1) };
            moved[k] = params[k] + h;
            let plus = project(&moved, ray)?;
            moved[k] = params[k] - h;
            *column = (plus - project(&moved, ray)?) / (2.0 * h);
            moved[k] = params[k];
        }
        for i in 0..n {
            gradient[i] += columns[i].dot(&residual);
            for j in 0..n {
                hessian[(i, j)] += columns[i].dot(&columns[j]);
            }
        }
    }
    Some((hessian, gradient))
}

fn measure(rays: &[(Vector3<f64>, Vector2<f64>)], params: &[f64], project: Project<'_>) -> FitError {
    let mut max_px = 0.0f64;
    let mut sum = 0.0;
    for (ray, px) in rays {
        let miss = project(params, ray).map_or(f64::INFINITY, |p| (px - p).norm());
        max_px = max_px.max(miss);
        sum += miss * miss;
    }
    FitError { max_px, rms_px: (sum / rays.len() as f64).sqrt() }
}

/// `k1 k2 p1 p2` without k3: the parameters `fx fy cx cy k1 k2 p1 p2`, and a note with the error where k3 was not zero.
pub(super) fn without_k3(camera: &Camera, target: &str) -> Result<([f64; 8], Option<String>)> {
    use crate::calib::camera::Model;
    let [k1, k2, p1, p2, k3] = super::lens::five(camera)?;
    let [fx, fy, cx, cy] = camera.intrinsics();
    let exact = [fx, fy, cx, cy, k1, k2, p1, p2];
    if k3 == 0.0 {
        return Ok((exact, None));
    }
    let spec = Model::Brown5.spec();
    let (fitted, error) = fit(camera.size_px, &|px| camera.unproject(px), &exact, &|p, ray| {
        let mut five = [0.0; 9];
        five[..8].copy_from_slice(p);
        (spec.project_px)(&five, ray)
    })?;
    let note = format!(
        "{target} has no k3 (here {k3}): fx fy cx cy k1 k2 p1 p2 were refitted over the picture, {error}"
    );
    let fitted =
        super::number::array(&fitted).ok_or_else(|| Error::Invalid("refit of 8 parameters".to_owned()))?;
    Ok((fitted, Some(note)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calib::camera::Model;

    #[test]
    fn a_lens_that_fits_is_recovered() {
        let truth = [533.0, 533.2, 342.3, 234.0, -0.2854, 0.064, 1.1e-3, -1.3e-4, 0.0];
        let camera = Camera::new(Model::Brown5, [640, 480], truth.to_vec()).unwrap();
        let spec = Model::Brown5.spec();
        let start = [500.0, 500.0, 320.0, 240.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        let (fitted, error) =
            fit(camera.size_px, &|px| camera.unproject(px), &start, &|p, r| (spec.project_px)(p, r)).unwrap();
        assert!(error.max_px < 1e-9, "{error:?}");
        for (f, t) in fitted.iter().zip(truth) {
            assert!((f - t).abs() < 1e-9 * t.abs().max(1.0), "{fitted:?}");
        }
    }

    #[test]
    fn the_error_of_a_missing_term_is_reported_and_small() {
        let params = vec![400.0, 400.0, 320.0, 240.0, -0.3, 0.12, 0.0, 0.0, -0.02];
        let camera = Camera::new(Model::Brown5, [640, 480], params).unwrap();
        let (fitted, note) = without_k3(&camera, "Kalibr radtan").unwrap();
        let note = note.unwrap();
        assert!(note.contains("k3 (here -0.02)") && note.contains("px"), "{note}");
        assert!((fitted[0] - 400.0).abs() < 5.0 && fitted[5] != 0.12, "{fitted:?}");
    }
}
