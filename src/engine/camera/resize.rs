//! The camera of resized and cropped pictures.
//!
//! With the centre of the first pixel at (0, 0), resizing by s keeps the *corner* of the picture in place:
//! `f' = s f`, `c' = s (c + 0.5) − 0.5`. A skew is scaled as f is. A crop moves the principal point by whole
//! pixels. Distortion is unchanged.

use super::Camera;
use crate::{Error, Result};

impl Camera {
    /// The camera of the same pictures resized by `scale`; the size is rounded to whole pixels.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a scale that is not a positive number or leaves an empty or absurdly large picture.
    pub fn scaled(&self, scale: f64) -> Result<Self> {
        if !(scale.is_finite() && scale > 0.0) {
            return Err(Error::Invalid(format!("the scale must be greater than zero, {scale} is not")));
        }
        let size = self.size_px.map(|n| (f64::from(n) * scale).round());
        if !size.iter().all(|n| (1.0..=1e6).contains(n)) {
            return Err(Error::Invalid(format!(
                "scaled by {scale} the picture would have {} x {} px: choose another scale",
                size[0], size[1]
            )));
        }
        let mut params = self.params.clone();
        for (i, v) in params.iter_mut().enumerate() {
            match i {
                2 | 3 => *v = scale * (*v + 0.5) - 0.5,
                _ if self.spec().params[i].unit == "px" => *v *= scale,
                _ => {}
            }
        }
        Self::new(self.model, size.map(|n| n as u32), params)
    }

    /// The camera of the same pictures cropped to `[x, y, width, height]`, px from the top-left pixel.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a rectangle that is empty or reaches outside the picture.
    pub fn cropped(&self, [x, y, width, height]: [u32; 4]) -> Result<Self> {
        let [w, h] = self.size_px;
        let inside = |from: u32, extent: u32, all: u32| {
            extent > 0 && from.checked_add(extent).is_some_and(|to| to <= all)
        };
        if !(inside(x, width, w) && inside(y, height, h)) {
            return Err(Error::Invalid(format!(
                "the crop {x},{y},{width},{height} does not lie inside the picture of {w} x {h} px"
            )));
        }
        let mut params = self.params.clone();
        params[2] -= f64::from(x);
        params[3] -= f64::from(y);
        Self::new(self.model, [width, height], params)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Model;
    use nalgebra::{Point3, Vector2};

    fn camera() -> Camera {
        Camera::new(
            Model::Brown5,
            [800, 600],
            vec![1000.2, 999.9, 399.4, 299.6, -0.28, 0.1, 0.001, 0.002, 0.01],
        )
        .unwrap()
    }

    #[test]
    fn a_point_moves_with_its_pixel() {
        let (full, point) = (camera(), Point3::new(0.21, -0.13, 1.0));
        let px = full.project(&point).unwrap();
        let half = full.scaled(0.5).unwrap();
        assert_eq!(half.size_px, [400, 300]);
        // The corner of the picture (−0.5, −0.5) stays: twice as many pixels lie before the point.
        let expected = (px + Vector2::repeat(0.5)) * 0.5 - Vector2::repeat(0.5);
        assert!((half.project(&point).unwrap() - expected).norm() < 1e-12);
        let crop = full.cropped([100, 50, 640, 480]).unwrap();
        assert!((crop.project(&point).unwrap() - (px - Vector2::new(100.0, 50.0))).norm() < 1e-12);
        assert_eq!(crop.size_px, [640, 480]);
    }

    #[test]
    fn a_skew_is_a_length() {
        let params = [&camera().params[..], &[7.0]].concat();
        let skewed = Camera::new(Model::Brown5Skew, [800, 600], params).unwrap();
        let point = Point3::new(0.21, -0.13, 1.0);
        let expected = (skewed.project(&point).unwrap() + Vector2::repeat(0.5)) * 3.0 - Vector2::repeat(0.5);
        assert!((skewed.scaled(3.0).unwrap().project(&point).unwrap() - expected).norm() < 1e-12);
    }

    #[test]
    fn a_centred_camera_stays_centred() {
        let c = Camera::new(Model::Pinhole, [640, 480], vec![500.0, 500.0, 319.5, 239.5]).unwrap();
        assert_eq!(c.scaled(2.0).unwrap().params, [1000.0, 1000.0, 639.5, 479.5]);
        assert_eq!(c.scaled(0.25).unwrap().params, [125.0, 125.0, 79.5, 59.5]);
    }

    #[test]
    fn what_cannot_be_is_refused() {
        let c = camera();
        for s in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-9, 1e9] {
            assert!(c.scaled(s).is_err(), "{s}");
        }
        for r in [[0, 0, 0, 10], [0, 0, 801, 600], [1, 0, 800, 600], [u32::MAX, 0, 2, 2], [799, 599, 2, 1]] {
            assert!(c.cropped(r).is_err(), "{r:?}");
        }
    }
}
