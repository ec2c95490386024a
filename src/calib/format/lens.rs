//! What a file says about the lens, before it becomes a [`Camera`].

use nalgebra::{Vector2, Vector3};

use super::kannala_brandt;
use crate::calib::{
    Error, Result,
    camera::{Camera, Model},
};

/// Names of OpenCV's fourteen coefficients, in its order.
pub(super) const OPENCV_NAMES: [&str; 14] =
    ["k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6", "s1", "s2", "s3", "s4", "tau_x", "tau_y"];

/// A lens in the terms of a file.
pub(super) enum Lens {
    /// One that is a camera model here.
    Camera(Camera),
    /// Kannala–Brandt: `[width, height]` and `fx fy cx cy k1 k2 k3 k4`; no camera model here, refitted.
    KannalaBrandt([u32; 2], [f64; 8]),
}

impl Lens {
    /// `fx fy cx cy` (origin at the centre of the first pixel) and the coefficients in OpenCV's order, 0 to 14 of them.
    ///
    /// # Errors
    /// [`Error::Unsupported`] for a coefficient beyond k3 that is not zero.
    pub(super) fn brown(size_px: [u32; 2], intrinsics: [f64; 4], coefficients: &[f64]) -> Result<Self> {
        if coefficients.len() > OPENCV_NAMES.len() {
            return Err(Error::Invalid(format!(
                "{} distortion coefficients: at most {} are known",
                coefficients.len(),
                OPENCV_NAMES.len()
            )));
        }
        for (name, value) in OPENCV_NAMES.iter().zip(coefficients).skip(5) {
            // Written this way round, NaN is refused here too.
            if !matches!(value, 0.0) {
                return Err(Error::Unsupported(format!(
                    "{name} = {value}: models with more than k1 k2 p1 p2 k3 are not supported yet; calibrate with these five terms"
                )));
            }
        }
        let mut params = intrinsics.to_vec();
        let model = if coefficients.iter().all(|c| *c == 0.0) {
            Model::Pinhole
        } else {
            params.extend(coefficients.iter().take(5));
            params.resize(9, 0.0);
            Model::Brown5
        };
        Ok(Self::Camera(Camera::new(model, size_px, params)?))
    }

    /// Kannala–Brandt from `fx fy cx cy` (origin at the centre of the first pixel) and `k1 k2 k3 k4`.
    ///
    /// # Errors
    /// [`Error::Invalid`] for another number of coefficients, or values that no camera may have.
    pub(super) fn kannala_brandt(
        size_px: [u32; 2],
        intrinsics: [f64; 4],
        coefficients: &[f64],
    ) -> Result<Self> {
        let &[k1, k2, k3, k4] = coefficients else {
            return Err(Error::Invalid(format!(
                "{} distortion coefficients: the fisheye (equidistant) model has 4",
                coefficients.len()
            )));
        };
        // Its rules for `fx fy cx cy` are those of any camera.
        let [fx, fy, cx, cy] = intrinsics;
        Camera::new(Model::Pinhole, size_px, intrinsics.to_vec())?;
        Ok(Self::KannalaBrandt(size_px, [fx, fy, cx, cy, k1, k2, k3, k4]))
    }

    /// Where a direction appears, px.
    pub(super) fn project(&self, ray: &Vector3<f64>) -> Option<Vector2<f64>> {
        match self {
            Self::Camera(camera) => (camera.spec().project_px)(&camera.params, ray),
            Self::KannalaBrandt(_, p) => Some(kannala_brandt::project(p, ray)),
        }
    }

    /// The camera, and a note with the error where the lens was refitted.
    ///
    /// # Errors
    /// [`Error::Unsupported`] where no camera model here can hold the lens.
    pub(super) fn into_camera(self) -> Result<(Camera, Option<String>)> {
        match self {
            Self::Camera(camera) => Ok((camera, None)),
            Self::KannalaBrandt(size_px, p) => {
                kannala_brandt::into_camera(size_px, &p).map(|(camera, note)| (camera, Some(note)))
            }
        }
    }
}

/// The five coefficients `k1 k2 p1 p2 k3` of a camera.
///
/// # Errors
/// [`Error::Unsupported`] for a model that is not a part of Brown's five terms.
pub(super) fn five(camera: &Camera) -> Result<[f64; 5]> {
    match camera.model {
        Model::Pinhole => Ok([0.0; 5]),
        Model::Brown5 => super::number::array(&camera.params[4..])
            .ok_or_else(|| Error::Invalid("brown5 has 9 parameters".to_owned())),
    }
}

/// `fx fy cx cy` with the principal point moved by `offset` px in both directions.
pub(super) fn moved(intrinsics: [f64; 4], offset: f64) -> [f64; 4] {
    let [fx, fy, cx, cy] = intrinsics;
    [fx, fy, cx + offset, cy + offset]
}
