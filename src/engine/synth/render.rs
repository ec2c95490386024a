//! Anti-aliased rendering by inverse mapping with area integration.
//!
//! The map from pixel to board coordinates is known at all pixel centres. Where no printed edge passes within a pixel
//! its grey value is that of its place. Elsewhere the map is developed to second order about the centre, the pixel
//! is cut into 2 × 2 parts, each part becomes a parallelogram on the board, and the areas that black and white take
//! of it are computed by clipping. What remains neglected is the curvature within half a pixel: below 1e-4 px.

use nalgebra::Vector3;

use super::{Method, Print, Scene, crude, rays::Rays, scene::check_camera, surface::Surface};
use crate::{Error, Result, camera::Camera, image::Plane, pose::Pose};

/// Parts per side of a pixel that a line crosses.
const PARTS: i32 = 2;
/// Where nothing of the board is near, in its widths from its first edge.
const FAR: [f64; 2] = [-3.0, 4.0];
/// Samples per side of a pixel at the rim of what the lens can see, where the map has no derivatives.
const SAMPLES: i32 = 16;

/// Renders the views of one scene; the rays of the pixels are computed once.
pub struct Renderer<'a> {
    scene: &'a Scene,
    rays: Option<Rays>,
}

impl<'a> Renderer<'a> {
    /// Checks the scene and computes the rays.
    ///
    /// # Errors
    /// [`Error::Invalid`] from [`Scene::validate`].
    pub fn new(scene: &'a Scene) -> Result<Self> {
        scene.validate()?;
        let rays = (scene.method == Method::Exact).then(|| Rays::new(&scene.camera));
        Ok(Self { scene, rays })
    }

    /// The picture of a view with all degradations, 8 bits.
    ///
    /// # Errors
    /// [`Error::Invalid`] where the scene has no such view.
    pub fn render(&self, view: usize) -> Result<Plane<u8>> {
        let light = self.light(view)?;
        self.scene.degrade.apply(light, self.scene, view)
    }

    /// The light that falls on each pixel before anything but the bend spoils it, in grey levels, not rounded.
    ///
    /// # Errors
    /// [`Error::Invalid`] where the scene has no such view.
    pub fn light(&self, view: usize) -> Result<Plane<f32>> {
        let n = self.scene.poses.len();
        let Some(pose) = self.scene.camera_from_board(view) else {
            return Err(Error::Invalid(format!("view {} of a scene of {n} views", view + 1)));
        };
        Ok(match (&self.rays, self.scene.method) {
            (Some(rays), Method::Exact) => exact(self.scene, rays, &pose),
            (_, Method::Exact) => exact(self.scene, &Rays::new(&self.scene.camera), &pose),
            (_, Method::Crude(cut)) => crude::picture(self.scene, &pose, cut),
        })
    }
}

fn exact(scene: &Scene, rays: &Rays, camera_from_board: &Pose) -> Plane<f32> {
    let print = Print::checkerboard(&scene.board);
    let surface = Surface::new(&scene.board, scene.degrade.bend);
    Exact { rays, surface, print: &print, board_from_camera: camera_from_board.inverse() }.picture()
}

impl Print {
    /// The light that falls on each pixel of a camera in front of which this board lies flat, in grey levels, not rounded.
    ///
    /// # Errors
    /// [`Error::Invalid`] where the camera is refused or its pictures are too large.
    pub fn light(&self, camera: &Camera, camera_from_board: &Pose) -> Result<Plane<f32>> {
        check_camera(camera)?;
        let (surface, board_from_camera) = (Surface::FLAT, camera_from_board.inverse());
        Ok(Exact { rays: &Rays::new(camera), surface, print: self, board_from_camera }.picture())
    }
}

struct Exact<'a> {
    rays: &'a Rays,
    surface: Surface,
    print: &'a Print,
    board_from_camera: Pose,
}

/// Board coordinates, in units of the print, of three rows of pixels −1..=w; NaN where the board's plane is not seen.
type Window = [Vec<[f64; 2]>; 3];

impl Exact<'_> {
    fn picture(&self) -> Plane<f32> {
        let [w, h] = self.rays.size_px().map(|n| n as usize);
        let columns = self.rays.columns();
        let mut rays = Vec::with_capacity(w + 2);
        let mut read = |y: f64, out: &mut Vec<[f64; 2]>| {
            self.rays.row(y, &columns, &mut rays);
            out.clear();
            out.extend(rays.iter().map(|r| self.board(r)));
        };
        let mut rows: Window = Default::default();
        read(-1.0, &mut rows[1]);
        read(0.0, &mut rows[2]);
        let mut picture = Plane::new(w, h);
        for y in 0..h {
            rows.rotate_left(1);
            read((y + 1) as f64, &mut rows[2]);
            for (x, value) in picture.row_mut(y).iter_mut().enumerate() {
                *value = self.pixel(&rows, x, y);
            }
        }
        picture
    }

    /// Board coordinates, in units of the print, that a ray meets.
    fn board(&self, ray: &Vector3<f64>) -> [f64; 2] {
        let direction = self.board_from_camera.rotation * ray;
        self.surface.hit(&self.board_from_camera.translation, &direction).map(|v| v / self.print.unit())
    }

    fn pixel(&self, rows: &Window, x: usize, y: usize) -> f32 {
        // Column x of the picture is entry x + 1 of a row.
        let b = |dx: usize, dy: usize| rows[dy][x + dx];
        let c = b(1, 1);
        // A wide lens looks past the board's plane with much of its picture, and along it where that ends.
        let ends = self.print.ends();
        let past = |i: usize| {
            let at = b(i % 3, i / 3);
            at[0].is_nan() || (0..2).any(|k| !(FAR[0] * ends[k][1]..FAR[1] * ends[k][1]).contains(&at[k]))
        };
        if (0..9).all(past) {
            return self.print.background();
        }
        let along = |k: usize| 0.5 * (b(2, 1)[k] - b(0, 1)[k]);
        let down = |k: usize| 0.5 * (b(1, 2)[k] - b(1, 0)[k]);
        let j = [[along(0), down(0)], [along(1), down(1)]];
        if j[0][0].is_nan() || j[0][1].is_nan() || c[0].is_nan() {
            return self.sampled(x, y);
        }
        // Far from the board nothing is to be integrated.
        if (0..2).any(|k| {
            let reach = j[k][0].abs() + j[k][1].abs();
            c[k] + reach < ends[k][0] || c[k] - reach > ends[k][1]
        }) {
            return self.print.background();
        }
        if let Some(level) = self.print.uniform(c, j) {
            return level;
        }
        let xx = |k: usize| b(2, 1)[k] - 2.0 * c[k] + b(0, 1)[k];
        let yy = |k: usize| b(1, 2)[k] - 2.0 * c[k] + b(1, 0)[k];
        let xy = |k: usize| 0.25 * (b(2, 2)[k] - b(0, 2)[k] - b(2, 0)[k] + b(0, 0)[k]);
        let second = [[xx(0), xy(0), yy(0)], [xx(1), xy(1), yy(1)]];
        if second.iter().flatten().any(|v| v.is_nan()) {
            return self.sampled(x, y);
        }
        let part = 1.0 / f64::from(PARTS);
        let mut sum = 0.0;
        for v in 0..PARTS {
            for u in 0..PARTS {
                let [u, v] = [u, v].map(|i| (f64::from(i) + 0.5) * part - 0.5);
                let at = |k: usize| {
                    let [xx, xy, yy] = second[k];
                    c[k] + j[k][0] * u + j[k][1] * v + 0.5 * (xx * u * u + yy * v * v) + xy * u * v
                };
                let slope = |k: usize| {
                    let [xx, xy, yy] = second[k];
                    [part * (j[k][0] + xx * u + xy * v), part * (j[k][1] + xy * u + yy * v)]
                };
                sum += self.print.mean([at(0), at(1)], [slope(0), slope(1)]);
            }
        }
        sum / (PARTS * PARTS) as f32
    }

    /// Mean of exactly mapped samples.
    fn sampled(&self, x: usize, y: usize) -> f32 {
        let offset = |i: i32| (f64::from(i) + 0.5) / f64::from(SAMPLES) - 0.5;
        let mut sum = 0.0;
        for v in 0..SAMPLES {
            for u in 0..SAMPLES {
                let b = self.board(&self.rays.exact(x as f64 + offset(u), y as f64 + offset(v)));
                sum += if b[0].is_nan() { self.print.background() } else { self.print.at(b) };
            }
        }
        sum / (SAMPLES * SAMPLES) as f32
    }
}
