//! Scaled and cropped camera files.

use super::CameraFile;
use crate::calib::{Result, observation::Corner, safe::clipped};

impl CameraFile {
    /// The camera of the same pictures resized by `scale`, with everything that is in pixels.
    ///
    /// # Errors
    /// As [`crate::calib::camera::Camera::scaled`].
    pub fn scaled(&self, scale: f64) -> Result<Self> {
        let mut file = self.clone();
        file.camera = self.camera.scaled(scale)?;
        let in_px: Vec<bool> = self.camera.spec().params.iter().map(|p| p.unit == "px").collect();
        let factor = |i: usize| if in_px.get(i) == Some(&true) { scale } else { 1.0 };
        let e = &mut file.evidence;
        for (i, sigma) in e.sigma.iter_mut().enumerate() {
            *sigma = sigma.map(|s| s * factor(i));
        }
        if let Some(c) = &mut e.covariance {
            for (a, i) in e.free.iter().enumerate().take(c.nrows()) {
                for (b, j) in e.free.iter().enumerate().take(c.ncols()) {
                    c[(a, b)] *= factor(*i) * factor(*j);
                }
            }
        }
        e.rms_px = e.rms_px.map(|v| v * scale);
        e.residual = e.residual.as_ref().map(|field| field.scaled(scale)).transpose()?;
        for point in e.safe.iter_mut().flatten() {
            *point = point.map(|v| scale * (v + 0.5) - 0.5);
        }
        for frame in &mut e.frames {
            frame.rms_px = frame.rms_px.map(|v| v * scale);
            for c in &mut frame.corners {
                let px = c.px.map(|v| scale * (v + 0.5) - 0.5);
                *c = Corner { px, sigma_px: c.sigma_px * scale, ..*c };
            }
        }
        Ok(file)
    }

    /// The camera of the same pictures cropped to `[x, y, width, height]`, with everything that is in pixels.
    ///
    /// # Errors
    /// As [`crate::calib::camera::Camera::cropped`].
    pub fn cropped(&self, rectangle: [u32; 4]) -> Result<Self> {
        let mut file = self.clone();
        file.camera = self.camera.cropped(rectangle)?;
        let [x, y] = [rectangle[0], rectangle[1]].map(f64::from);
        file.evidence.residual = file.evidence.residual.map(|field| field.cropped([x, y]));
        let [_, _, w, h] = rectangle;
        file.evidence.safe = file.evidence.safe.map(|polygon| {
            let moved: Vec<[f64; 2]> = polygon.iter().map(|[a, b]| [a - x, b - y]).collect();
            clipped(&moved, [w, h])
        });
        for corner in file.evidence.frames.iter_mut().flat_map(|f| &mut f.corners) {
            corner.px.x -= x;
            corner.px.y -= y;
        }
        Ok(file)
    }
}
