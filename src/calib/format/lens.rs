//! Cameras in the terms of a file.

use std::borrow::Cow;

use crate::calib::{
    Error, Result,
    camera::{Camera, Model},
};

/// Names of OpenCV's fourteen coefficients, in its order; here the last two are `taux tauy`.
const OPENCV_NAMES: [&str; 14] =
    ["k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6", "s1", "s2", "s3", "s4", "taux", "tauy"];
/// OpenCV's models by the number of their coefficients.
const OPENCV_MODELS: [(usize, Model); 5] = [
    (0, Model::Pinhole),
    (5, Model::Brown5),
    (8, Model::Rational),
    (12, Model::ThinPrism),
    (14, Model::Tilted),
];

/// From `fx fy cx cy` (origin at the centre of the first pixel) and the coefficients in OpenCV's order, 0 to 14 of them: the simplest
/// of its models that has all that are not zero.
///
/// # Errors
/// [`Error::Invalid`] for more coefficients, or values that no camera may have.
pub(super) fn opencv(size_px: [u32; 2], intrinsics: [f64; 4], coefficients: &[f64]) -> Result<Camera> {
    // NaN is not zero: it is refused below.
    let used = coefficients.iter().rposition(|c| *c != 0.0).map_or(0, |last| last + 1);
    let Some((n, model)) = OPENCV_MODELS.into_iter().find(|(n, _)| *n >= used) else {
        return Err(Error::Invalid(format!(
            "{} distortion coefficients: at most {} are known",
            coefficients.len(),
            OPENCV_NAMES.len()
        )));
    };
    let mut params = intrinsics.to_vec();
    params.extend(coefficients.iter().take(n));
    params.resize(4 + n, 0.0);
    Camera::new(model, size_px, params)
}

/// A camera with a skew beside its terms, px; one without where that is zero.
///
/// # Errors
/// [`Error::Unsupported`] for more terms than Brown's five, [`Error::Invalid`] for a value that no camera may have.
pub(super) fn with_skew(camera: Camera, skew: f64) -> Result<Camera> {
    if skew == 0.0 {
        return Ok(camera);
    }
    let model = Model::Brown5Skew;
    let plain = in_terms_of(&camera, model).ok_or_else(|| {
        Error::Unsupported(format!("a skew beside {} is not supported", camera.spec().title))
    })?;
    let mut params = plain.params;
    if let Some(value) = model.spec().index("skew").and_then(|i| params.get_mut(i)) {
        *value = skew;
    }
    Camera::new(model, plain.size_px, params)
}

/// Kannala–Brandt from `fx fy cx cy` (origin at the centre of the first pixel) and `k1 k2 k3 k4`.
///
/// # Errors
/// [`Error::Invalid`] for another number of coefficients, or values that no camera may have.
pub(super) fn fisheye(size_px: [u32; 2], intrinsics: [f64; 4], coefficients: &[f64]) -> Result<Camera> {
    if coefficients.len() != 4 {
        return Err(Error::Invalid(format!(
            "{} distortion coefficients: the fisheye (equidistant) model has 4",
            coefficients.len()
        )));
    }
    Camera::new(Model::Kb4, size_px, [&intrinsics[..], coefficients].concat())
}

/// The coefficients of a camera in OpenCV's order, as many as its usual models have (5, 8, 12 or 14); `None` for lenses that are
/// not of its perspective family.
pub(super) fn opencv_terms(camera: &Camera) -> Option<Vec<f64>> {
    if !camera.spec().perspective {
        return None;
    }
    let terms = OPENCV_NAMES.map(|name| camera.get(name).unwrap_or(0.0));
    let used = terms.iter().rposition(|t| *t != 0.0).map_or(0, |last| last + 1);
    let (n, _) = OPENCV_MODELS.into_iter().skip(1).find(|(n, _)| *n >= used)?;
    Some(terms[..n].to_vec())
}

/// A camera as a file holds it, with a note where it had to be refitted.
pub(super) type Held<'a> = (Cow<'a, Camera>, Option<String>);

/// The camera in one of the models that `program` has: as it is, with terms that are zero left out or added, or refitted to
/// the best of `otherwise`.
///
/// # Errors
/// [`Error::Unsupported`] where none of them can stand for the camera.
pub(super) fn held<'a>(
    camera: &'a Camera,
    has: &[Model],
    otherwise: &[Model],
    program: &str,
) -> Result<Held<'a>> {
    if has.contains(&camera.model) {
        return Ok((Cow::Borrowed(camera), None));
    }
    if let Some(same) = has.iter().find_map(|model| in_terms_of(camera, *model)) {
        return Ok((Cow::Owned(same), None));
    }
    let title = camera.spec().title;
    let mut best: Option<(Camera, crate::calib::camera::FitError)> = None;
    let mut why = String::new();
    for model in otherwise {
        match camera.refit(*model) {
            Ok((fitted, error)) => {
                if best.as_ref().is_none_or(|b| error.max_px < b.1.max_px) {
                    best = Some((fitted, error));
                }
            }
            Err(error) => why = error.to_string(),
        }
    }
    // Many terms may fold where a few do not: a skew makes them.
    let plain = || {
        let (fitted, error) = camera.refit(Model::Brown5).ok().filter(|_| camera.spec().perspective)?;
        Some((has.iter().find_map(|model| in_terms_of(&fitted, *model))?, error))
    };
    let (fitted, error) = best.or_else(plain).ok_or_else(|| {
        Error::Unsupported(format!(
            "{program} has no model for this lens ({title}): {why}; choose another format"
        ))
    })?;
    let note =
        format!("{program} has no {title}: {} was fitted over the picture, {error}", fitted.spec().title);
    Ok((Cow::Owned(fitted), Some(note)))
}

/// The same camera in another model of OpenCV's perspective family; `None` where terms that are not zero would be lost.
fn in_terms_of(camera: &Camera, model: Model) -> Option<Camera> {
    let spec = model.spec();
    if !(spec.perspective && camera.spec().perspective) {
        return None;
    }
    if camera.distortion().any(|(name, value)| value != 0.0 && spec.index(name).is_none()) {
        return None;
    }
    let params = spec.params.iter().map(|p| camera.get(p.name).unwrap_or(0.0)).collect();
    Some(Camera { model, size_px: camera.size_px, params })
}

/// `fx fy cx cy` with the principal point moved by `offset` px in both directions.
pub(super) fn moved(intrinsics: [f64; 4], offset: f64) -> [f64; 4] {
    let [fx, fy, cx, cy] = intrinsics;
    [fx, fy, cx + offset, cy + offset]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_simplest_model_with_all_terms_is_read() {
        let read = |d: &[f64]| opencv([640, 480], [500.0, 500.0, 319.5, 239.5], d).unwrap().model;
        assert_eq!(read(&[]), Model::Pinhole);
        assert_eq!(read(&[0.0; 5]), Model::Pinhole);
        assert_eq!(read(&[0.1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]), Model::Brown5);
        assert_eq!(read(&[0.1, 0.0, 0.0, 0.0, 0.0, 0.2]), Model::Rational);
        assert_eq!(read(&[0.0; 13].map(|_| 0.01)), Model::Tilted);
        let nan = opencv([640, 480], [500.0, 500.0, 319.5, 239.5], &[f64::NAN]);
        assert!(nan.is_err() && opencv([640, 480], [500.0; 4], &[0.1; 15]).is_err());
    }

    #[test]
    fn a_skew_makes_a_model_of_its_own() {
        let plain = opencv([640, 480], [500.0, 501.0, 319.5, 239.5], &[0.1, -0.2]).unwrap();
        assert_eq!(with_skew(plain.clone(), 0.0).unwrap(), plain);
        let skewed = with_skew(plain, 2.5).unwrap();
        assert_eq!(
            (skewed.model, skewed.get("k2"), skewed.get("skew")),
            (Model::Brown5Skew, Some(-0.2), Some(2.5))
        );
        let rational = opencv([640, 480], [500.0, 501.0, 319.5, 239.5], &[0.1; 8]).unwrap();
        assert!(with_skew(rational, 1.0).is_err());
        let nan = opencv([640, 480], [500.0, 501.0, 319.5, 239.5], &[]).unwrap();
        assert!(with_skew(nan, f64::NAN).is_err());
    }

    #[test]
    fn terms_that_are_zero_cost_nothing() {
        let params = vec![533.0, 533.2, 342.3, 234.0, -0.2854, 0.064, 1.1e-3, -1.3e-4, 0.0];
        let camera = Camera::new(Model::Brown5, [640, 480], params).unwrap();
        let (same, note) = held(&camera, &[Model::Brown4], &[], "x").unwrap();
        assert_eq!((same.params.as_slice(), note), (&camera.params[..8], None));
        let (more, note) = held(&camera, &[Model::Rational], &[], "x").unwrap();
        assert!(more.params[9..] == [0.0; 3] && note.is_none());
    }
}
