//! The faults that are planted, each exactly, not linearised.

use nalgebra::{Point3, Vector2};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::capture::Spot;
use crate::calib::{
    camera::{Camera, Model},
    pose::Pose,
};

/// A kind of fault.
pub(super) struct Planted {
    /// What it should be called.
    pub(super) code: &'static str,
    /// A small strength to start from.
    pub(super) least: f64,
    /// More is no fault but another capture.
    pub(super) most: f64,
    /// Whether one picture alone has it.
    pub(super) alone: bool,
    /// Whether it is the camera's own.
    of_camera: bool,
    plant: fn(&Strength, &Spot, &mut Corner),
}

/// A fault of one capture: its strength and what chance makes of it.
pub(super) struct Strength {
    pub(super) value: f64,
    of: fn(&Strength, &Spot, &mut Corner),
    alone: bool,
    of_camera: bool,
    /// Uniform in −1..1, for the whole capture and for each picture.
    whole: [f64; 6],
    each: Vec<[f64; 2]>,
}

/// A corner while it is seen.
pub(super) struct Corner {
    camera: Camera,
    point: Point3<f64>,
    /// Displacement over the height of the picture while its rows are read, px.
    rows: Vector2<f64>,
}

/// Pictures that chance is drawn for.
const MOST_VIEWS: usize = 40;

fn uniform(random: &mut Pcg64) -> f64 {
    random.random_range(-1.0..1.0)
}

impl Planted {
    pub(super) fn drawn(&self, seed: u64, value: f64) -> Strength {
        let mut random = Pcg64::seed_from_u64(seed ^ 0x5eed);
        let whole = std::array::from_fn(|_| uniform(&mut random));
        let each = (0..MOST_VIEWS).map(|_| [uniform(&mut random), uniform(&mut random)]).collect();
        Strength { value, of: self.plant, alone: self.alone, of_camera: self.of_camera, whole, each }
    }
}

impl Strength {
    /// The picture that is about it.
    pub(super) fn picture(&self) -> Option<usize> {
        self.alone.then_some(((self.whole[5] + 1.0) * 7.0) as usize)
    }

    fn is_in(&self, spot: &Spot) -> bool {
        self.picture().is_none_or(|view| view == spot.view)
    }

    /// Where a corner is seen.
    pub(super) fn project(
        &self,
        camera: &Camera,
        pose: &Pose,
        point: &Point3<f64>,
        spot: &Spot,
    ) -> Option<Vector2<f64>> {
        let mut corner = Corner { camera: camera.clone(), point: *point, rows: Vector2::zeros() };
        if self.is_in(spot) {
            (self.of)(self, spot, &mut corner);
        }
        let px = corner.camera.project(&pose.apply(&corner.point))?;
        let h = f64::from(camera.size_px[1]);
        Some(px + corner.rows * (px.y / h - 0.5))
    }

    /// The camera that the pictures were taken with, where a fault is the camera's own.
    pub(super) fn true_camera(&self, camera: &Camera) -> Camera {
        let mut corner = Corner { camera: camera.clone(), point: Point3::origin(), rows: Vector2::zeros() };
        if self.of_camera {
            (self.of)(self, &Spot { view: 0, views: 1, flat: [0.0; 2] }, &mut corner);
        }
        corner.camera
    }

    /// A factor that is not near zero.
    fn sign(&self, k: usize) -> f64 {
        self.whole[k].signum() * (0.5 + 0.5 * self.whole[k].abs())
    }
}

fn zoom(corner: &mut Corner, by: f64) {
    corner.camera.params[..2].iter_mut().for_each(|f| *f *= 1.0 + by);
}

fn shift(corner: &mut Corner, by: [f64; 2]) {
    corner.camera.params[2] += by[0];
    corner.camera.params[3] += by[1];
}

/// From −1/2 at the first picture to 1/2 at the last.
fn when(spot: &Spot) -> f64 {
    spot.view as f64 / (spot.views - 1).max(1) as f64 - 0.5
}

const fn planted(
    code: &'static str,
    [least, most]: [f64; 2],
    plant: fn(&Strength, &Spot, &mut Corner),
) -> Planted {
    Planted { code, least, most, alone: false, of_camera: false, plant }
}

const fn alone(
    code: &'static str,
    [least, most]: [f64; 2],
    plant: fn(&Strength, &Spot, &mut Corner),
) -> Planted {
    Planted { code, least, most, alone: true, of_camera: false, plant }
}

/// All of them.
pub(super) const PLANTED: &[Planted] = &[
    planted("bowed_board", [0.1, 15.0], |s, spot, corner| {
        let [x, y] = spot.flat;
        corner.point.z += s.value * (s.sign(0) * x * x + s.whole[1] * x * y + s.whole[2] * y * y);
    }),
    planted("board_aspect", [0.0005, 0.05], |s, _, corner| corner.point.x *= 1.0 + s.sign(0) * s.value),
    alone("zoomed_picture", [0.001, 0.3], |s, _, corner| zoom(corner, s.sign(0) * s.value)),
    planted("zoom_step", [0.001, 0.1], |s, spot, corner| {
        let step = spot.views / 2 + (s.whole[1] * spot.views as f64 / 4.0) as usize;
        // The camera is that of the mean.
        let before = step as f64 / spot.views as f64;
        let by = if spot.view < step { before - 1.0 } else { before };
        zoom(corner, s.sign(0) * s.value * by);
    }),
    planted("focal_drift", [0.001, 0.1], |s, spot, corner| zoom(corner, s.sign(0) * s.value * when(spot))),
    planted("focus_varies", [0.001, 0.1], |s, spot, corner| zoom(corner, s.value * s.each[spot.view][0])),
    planted("centre_drift", [1.0, 60.0], |s, spot, corner| {
        shift(corner, [0, 1].map(|k| s.sign(k) * s.value * when(spot)));
    }),
    planted("shifted_pictures", [1.0, 60.0], |s, spot, corner| {
        shift(corner, s.each[spot.view].map(|e| e * s.value));
    }),
    planted("rolling_shutter", [0.5, 30.0], |s, spot, corner| {
        corner.rows = Vector2::from(s.each[spot.view]) * s.value;
    }),
    Planted {
        of_camera: true,
        ..planted("lens_model", [0.001, 0.05], |s, _, corner| {
            let mut params = vec![0.0; Model::ThinPrism.spec().params.len()];
            params[..9].copy_from_slice(&corner.camera.params);
            // s1 s2 s3 s4, the last of the model.
            for (k, by) in [s.whole[0], s.sign(1), s.whole[2], s.sign(3)].into_iter().enumerate() {
                params[12 + k] = s.value * by;
            }
            corner.camera = Camera { model: Model::ThinPrism, size_px: corner.camera.size_px, params };
        })
    },
    alone("foreign_picture", [1.0, 60.0], |s, _, corner| {
        zoom(corner, s.whole[0] * s.value * 1e-3);
        shift(corner, [1, 2].map(|k| s.sign(k) * s.value));
    }),
];
