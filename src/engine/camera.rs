//! Camera models: a model is data.
//!
//! A [`Camera`] is a model, a picture size and a flat list of parameters. Everything that differs between models is in
//! its [`Spec`]: names and units of the parameters, projection with analytic Jacobians, examples. Tests, exports,
//! tables and the solver loop over [`Model::ALL`]; to add a model is to write one file and one line here.

mod at;
pub mod brown;
pub mod brown_fewer;
pub mod brown_skew;
pub mod double_sphere;
pub mod eucm;
pub mod kannala_brandt;
mod opencv;
pub mod pinhole;
pub mod rational;
pub mod refit;
mod resize;
pub mod thin_prism;
pub mod tilted;

use nalgebra::{Matrix2x3, Point3, Vector2, Vector3};
use serde::{Deserialize, Serialize};
use std::{fmt, str::FromStr};

use super::{Error, Result};
pub use refit::FitError;

/// Most parameters of a closed-form model.
pub const MAX_PARAMS: usize = 18;

/// One intrinsic parameter of a model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Param {
    /// Name in tables, options and files: `fx`, `k1`, …
    pub name: &'static str,
    /// `px`, or empty for a dimensionless coefficient.
    pub unit: &'static str,
}

/// A projected point with its derivatives.
#[derive(Clone, Debug)]
pub struct Projection {
    /// Where the point appears, px.
    pub px: Vector2<f64>,
    /// ∂px / ∂point in the camera frame.
    pub by_point: Matrix2x3<f64>,
    /// ∂px / ∂parameter, in the order of [`Spec::params`]; entries beyond their number are zero.
    pub by_params: [Vector2<f64>; MAX_PARAMS],
}

/// Points that [`Spec::project_batch`] handles together.
pub const LANES: usize = 8;

/// One number for each of [`LANES`] points.
pub type Lanes = [f64; LANES];

/// Projections of [`LANES`] points with their derivatives, as structure of arrays; of each pair the first is for u, the
/// second for v.
#[derive(Clone, Debug)]
pub struct Batch {
    /// Where the points appear, px; NaN where the model cannot see a point.
    pub px: [Lanes; 2],
    /// ∂px / ∂point in the camera frame.
    pub by_point: [[Lanes; 3]; 2],
    /// ∂px / ∂parameter, in the order of [`Spec::params`]; entries beyond their number are zero.
    pub by_params: [[Lanes; MAX_PARAMS]; 2],
}

impl Batch {
    /// All zero, as [`Spec::project_batch`] expects it: a model never writes derivatives that are always zero.
    pub const ZERO: Self = Self {
        px: [[0.0; LANES]; 2],
        by_point: [[[0.0; LANES]; 3]; 2],
        by_params: [[[0.0; LANES]; MAX_PARAMS]; 2],
    };
}

/// Everything that the rest of the program knows about a camera model.
pub struct Spec {
    /// Name on the command line and in files.
    pub name: &'static str,
    /// Name for people.
    pub title: &'static str,
    /// In one line, for which lenses.
    pub explained: &'static str,
    /// Whether it sees only what lies in front of the plane of the lens (Z > 0), as a picture without distortion does.
    pub perspective: bool,
    /// What follows `fx fy cx cy` where nothing is known of the lens yet.
    pub neutral: &'static [f64],
    /// Names and units; the first four are `fx fy cx cy` in every model.
    pub params: &'static [Param],
    /// Projects a point of the camera frame with all derivatives; `None` where the model cannot see it.
    pub project: fn(&[f64], &Vector3<f64>) -> Option<Projection>,
    /// Projects without derivatives; equal to `project(…).px` to the last digits.
    pub project_px: fn(&[f64], &Vector3<f64>) -> Option<Vector2<f64>>,
    /// [`Spec::project`] for [`LANES`] points `[x, y, z]` of the camera frame at once, for the solver. `u` and `v` must not
    /// depend on `fy cy` and `fx cx` respectively.
    pub project_batch: fn(&[f64], &[Lanes; 3], &mut Batch),
    /// [`Spec::project_px`] for [`LANES`] points at once; NaN where the model cannot see a point.
    pub project_px_batch: fn(&[f64], &[Lanes; 3], &mut [Lanes; 2]),
    /// First guess for the ray of a pixel, not normalised; Newton starts there.
    pub guess_ray: fn(&[f64], &Vector2<f64>) -> Vector3<f64>,
    /// Valid parameters for a 640 × 480 picture: every generic test runs over them.
    pub examples: &'static [&'static [f64]],
    /// Parameters that [`Camera::validate`] must refuse.
    pub invalid: &'static [&'static [f64]],
}

impl Spec {
    /// Position of a parameter by its name.
    pub fn index(&self, name: &str) -> Option<usize> {
        self.params.iter().position(|p| p.name == name)
    }
}

/// A camera model by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Model {
    /// No distortion.
    Pinhole,
    /// k1.
    Radial1,
    /// k1 k2.
    Radial2,
    /// k1 p1 p2.
    Brown3,
    /// k1 k2 k3.
    Radial3,
    /// k1 k2 p1 p2.
    Brown4,
    /// Brown–Conrady with k1 k2 p1 p2 k3 (OpenCV's five).
    Brown5,
    /// Those five and a skew: MATLAB's fullest.
    Brown5Skew,
    /// OpenCV's eight.
    Rational,
    /// OpenCV's twelve.
    ThinPrism,
    /// OpenCV's fourteen.
    Tilted,
    /// Enhanced unified camera model, alpha beta.
    Eucm,
    /// Double sphere, xi alpha.
    Ds,
    /// Kannala–Brandt, k1 k2 k3 k4.
    Kb4,
}

impl Model {
    /// All models, simplest first.
    pub const ALL: [Self; 14] = [
        Self::Pinhole,
        Self::Radial1,
        Self::Radial2,
        Self::Brown3,
        Self::Radial3,
        Self::Brown4,
        Self::Brown5,
        Self::Brown5Skew,
        Self::Rational,
        Self::ThinPrism,
        Self::Tilted,
        Self::Eucm,
        Self::Ds,
        Self::Kb4,
    ];

    /// What is tried where no model is asked for: an ordinary lens, and a fisheye where that is strained.
    pub const USUAL: [Self; 2] = [Self::Brown5, Self::Kb4];

    /// The model's table.
    pub const fn spec(self) -> &'static Spec {
        match self {
            Self::Pinhole => &pinhole::SPEC,
            Self::Radial1 => &brown_fewer::RADIAL1,
            Self::Radial2 => &brown_fewer::RADIAL2,
            Self::Brown3 => &brown_fewer::BROWN3,
            Self::Radial3 => &brown_fewer::RADIAL3,
            Self::Brown4 => &brown_fewer::BROWN4,
            Self::Brown5 => &brown::SPEC,
            Self::Brown5Skew => &brown_skew::SPEC,
            Self::Rational => &rational::SPEC,
            Self::ThinPrism => &thin_prism::SPEC,
            Self::Tilted => &tilted::SPEC,
            Self::Eucm => &eucm::SPEC,
            Self::Ds => &double_sphere::SPEC,
            Self::Kb4 => &kannala_brandt::SPEC,
        }
    }
}

impl fmt::Display for Model {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.spec().name)
    }
}

impl FromStr for Model {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        Self::ALL.into_iter().find(|m| m.spec().name.eq_ignore_ascii_case(text)).ok_or_else(|| {
            let names: Vec<_> = Self::ALL.iter().map(|m| m.spec().name).collect();
            Error::Invalid(format!("\"{text}\" is not a camera model: choose one of {}", names.join(", ")))
        })
    }
}

/// A camera: model, picture size and parameters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Camera {
    /// Which model.
    pub model: Model,
    /// `[width, height]` of the pictures, px.
    pub size_px: [u32; 2],
    /// Values in the order of the model's [`Spec::params`].
    pub params: Vec<f64>,
}

impl Camera {
    /// A camera whose parameters passed [`Camera::validate`].
    ///
    /// # Errors
    /// [`Error::Invalid`] with the parameter that is wrong.
    pub fn new(model: Model, size_px: [u32; 2], params: Vec<f64>) -> Result<Self> {
        let camera = Self { model, size_px, params };
        camera.validate()?;
        Ok(camera)
    }

    /// From named values; parameters that are not named are zero.
    ///
    /// # Errors
    /// [`Error::Invalid`] where a name does not belong to the model or a value is refused.
    pub fn from_named(model: Model, size_px: [u32; 2], values: &[(&str, f64)]) -> Result<Self> {
        let spec = model.spec();
        let mut params = vec![0.0; spec.params.len()];
        for (name, value) in values {
            let i = spec
                .index(name)
                .ok_or_else(|| Error::Invalid(format!("the model {model} has no parameter {name}")))?;
            params[i] = *value;
        }
        Self::new(model, size_px, params)
    }

    /// The model's table.
    pub const fn spec(&self) -> &'static Spec {
        self.model.spec()
    }

    /// Checks numbers and ranges.
    ///
    /// # Errors
    /// [`Error::Invalid`] where the number of parameters is wrong, one is not finite, a focal length is not positive or
    /// the picture is empty.
    pub fn validate(&self) -> Result<()> {
        let spec = self.spec();
        if self.params.len() != spec.params.len() {
            return Err(Error::Invalid(format!(
                "the model {} has {} parameters, {} were given",
                spec.name,
                spec.params.len(),
                self.params.len()
            )));
        }
        for (p, v) in spec.params.iter().zip(&self.params) {
            if !v.is_finite() {
                return Err(Error::Invalid(format!(
                    "{} is {v}: every camera parameter must be a finite number",
                    p.name
                )));
            }
            if matches!(p.name, "fx" | "fy") && *v <= 0.0 {
                return Err(Error::Invalid(format!(
                    "{} is {v}: a focal length must be greater than zero",
                    p.name
                )));
            }
        }
        if self.size_px.contains(&0) {
            let [w, h] = self.size_px;
            return Err(Error::Invalid(format!(
                "a picture of {w} x {h} px is empty: give the size of the photographs"
            )));
        }
        Ok(())
    }

    /// Value of a parameter by name.
    pub fn get(&self, name: &str) -> Option<f64> {
        self.spec().index(name).map(|i| self.params[i])
    }

    /// `[fx, fy, cx, cy]`.
    pub fn intrinsics(&self) -> [f64; 4] {
        [self.params[0], self.params[1], self.params[2], self.params[3]]
    }

    /// `(name, value)` of what follows `fx fy cx cy`.
    pub fn distortion(&self) -> impl Iterator<Item = (&'static str, f64)> + '_ {
        self.spec().params.iter().zip(&self.params).skip(4).map(|(p, v)| (p.name, *v))
    }

    /// Where a point of the camera frame appears, px; `None` where the model cannot see it.
    pub fn project(&self, point_in_camera: &Point3<f64>) -> Option<Vector2<f64>> {
        (self.spec().project_px)(&self.params, &point_in_camera.coords)
    }

    /// Unit ray of a pixel: Newton on the model's own Jacobian.
    ///
    /// `None` where no ray reaches the pixel, and where the only solution lies beyond a fold of the model (there the
    /// image of growing angles turns back, so the answer would be a different, wrong ray).
    pub fn unproject(&self, px: &Vector2<f64>) -> Option<Vector3<f64>> {
        let ray = self.newton(px)?;
        self.unfolded_to(&ray).then_some(ray)
    }

    fn newton(&self, px: &Vector2<f64>) -> Option<Vector3<f64>> {
        let spec = self.spec();
        let tolerance = 1e-15 * (px.norm() + self.params[0]);
        let mut ray = (spec.guess_ray)(&self.params, px).try_normalize(0.0)?;
        let mut at = (spec.project)(&self.params, &ray)?;
        let mut miss = px - at.px;
        for _ in 0..60 {
            if miss.norm() <= tolerance {
                break;
            }
            let [e1, e2] = tangents(&ray);
            let (a, b) = (at.by_point * e1, at.by_point * e2);
            let det = a.x * b.y - a.y * b.x;
            if det.abs() < 1e-12 * self.params[0] * self.params[0] {
                return None;
            }
            let step =
                e1 * ((miss.x * b.y - miss.y * b.x) / det) + e2 * ((a.x * miss.y - a.y * miss.x) / det);
            // A step is halved until it helps; a full step of more than 45° leaves the region where it means anything.
            let mut scale = (1.0 / step.norm()).min(1.0);
            let mut next = None;
            for _ in 0..12 {
                let candidate = (ray + step * scale).normalize();
                if let Some(p) = (spec.project)(&self.params, &candidate)
                    && (px - p.px).norm() < miss.norm()
                {
                    next = Some((candidate, p));
                    break;
                }
                scale *= 0.5;
            }
            let Some((candidate, p)) = next else { break };
            (ray, miss, at) = (candidate, px - p.px, p);
        }
        (miss.norm() <= 1e-9 * (px.norm() + self.params[0])).then_some(ray)
    }

    /// Whether the image grows outwards all the way from the optical axis to `ray` (a unit vector).
    fn unfolded_to(&self, ray: &Vector3<f64>) -> bool {
        const BATCHES: usize = 3;
        let theta = ray.x.hypot(ray.y).atan2(ray.z);
        let side = Vector3::new(ray.x, ray.y, 0.0).try_normalize(0.0).unwrap_or_else(Vector3::x);
        let (sin, cos) = (theta / (BATCHES * LANES) as f64).sin_cos();
        let mut at = [0.0, 1.0];
        let mut batch = Batch::ZERO;
        (0..BATCHES).all(|_| {
            let mut rays = [[0.0; LANES]; 3];
            for l in 0..LANES {
                at = [at[0] * cos + at[1] * sin, at[1] * cos - at[0] * sin];
                [rays[0][l], rays[1][l], rays[2][l]] = [side.x * at[0], side.y * at[0], at[1]];
            }
            (self.spec().project_batch)(&self.params, &rays, &mut batch);
            (0..LANES).all(|l| {
                let [u, v] = batch.by_point.map(|by| Vector3::from(by.map(|d| d[l])));
                let ray = Vector3::from(rays.map(|r| r[l]));
                // [`Self::expansion`]: the tangents e1, e2 and the ray are a right-handed frame.
                batch.px.iter().all(|px| px[l].is_finite()) && u.cross(&v).dot(&ray) > 0.0
            })
        })
    }

    /// Determinant of ∂px/∂(two orthonormal directions beside the unit ray), px² per rad²; ≤ 0 where the model folds,
    /// `None` where it cannot see.
    pub fn expansion(&self, ray: &Vector3<f64>) -> Option<f64> {
        let p = (self.spec().project)(&self.params, ray)?;
        let [e1, e2] = tangents(ray);
        let (a, b) = (p.by_point * e1, p.by_point * e2);
        Some(a.x * b.y - a.y * b.x)
    }

    /// Angle from the optical axis up to which the model does not fold, rad, in the worst direction; at most π.
    ///
    /// The image of rays further out turns back on itself: those pixels cannot be undistorted.
    pub fn fold_rad(&self) -> f64 {
        super::lens::fold_rad(&|ray| self.expansion(ray))
    }
}

/// Two unit vectors that complete the unit vector `ray` to a right-handed frame `(e1, e2, ray)`; at the optical axis
/// they are x and y.
pub fn tangents(ray: &Vector3<f64>) -> [Vector3<f64>; 2] {
    // Duff et al., "Building an Orthonormal Basis, Revisited", JCGT 6(1), 2017.
    let sign = 1.0f64.copysign(ray.z);
    let a = -1.0 / (sign + ray.z);
    let b = ray.x * ray.y * a;
    [
        Vector3::new(1.0 + sign * ray.x * ray.x * a, sign * b, -sign * ray.x),
        Vector3::new(b, sign + ray.y * ray.y * a, -ray.y),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn examples() -> impl Iterator<Item = Camera> {
        Model::ALL.into_iter().flat_map(|model| {
            model.spec().examples.iter().map(move |p| Camera {
                model,
                size_px: [640, 480],
                params: p.to_vec(),
            })
        })
    }

    /// Rays over the picture and a little beyond, unit length.
    fn rays(camera: &Camera) -> Vec<Vector3<f64>> {
        let [w, h] = camera.size_px.map(f64::from);
        let mut rays = Vec::new();
        for j in 0..=10 {
            for i in 0..=10 {
                let px = Vector2::new(w * f64::from(i) / 10.0 - 0.5, h * f64::from(j) / 10.0 - 0.5);
                rays.extend(camera.unproject(&px));
            }
        }
        assert!(rays.len() > 60, "{camera:?}: {} rays", rays.len());
        rays
    }

    #[test]
    fn tables_are_consistent() {
        for model in Model::ALL {
            let spec = model.spec();
            assert_eq!(["fx", "fy", "cx", "cy"], [0, 1, 2, 3].map(|i| spec.params[i].name));
            assert!(spec.params.len() <= MAX_PARAMS && !spec.examples.is_empty());
            assert_eq!(spec.name.parse::<Model>(), Ok(model));
            assert_eq!(serde_json::to_value(model).unwrap(), serde_json::json!(spec.name));
            for p in spec.examples {
                assert!(Camera::new(model, [640, 480], p.to_vec()).is_ok(), "{model} {p:?}");
            }
            for p in spec.invalid {
                assert!(Camera::new(model, [640, 480], p.to_vec()).is_err(), "{model} {p:?}");
            }
        }
        assert!("brown9".parse::<Model>().is_err());
    }

    #[test]
    fn jacobians_agree_with_central_differences() {
        for camera in examples() {
            let spec = camera.spec();
            for ray in rays(&camera) {
                let point = ray * 3.7;
                let p = (spec.project)(&camera.params, &point).unwrap();
                assert!(
                    (p.px - (spec.project_px)(&camera.params, &point).unwrap()).norm()
                        < 1e-12 * p.px.norm().max(1.0)
                );
                let difference = |f: &dyn Fn(f64) -> Vector2<f64>, h: f64| (f(h) - f(-h)) / (2.0 * h);
                for k in 0..3 {
                    let f = |h: f64| {
                        let mut q = point;
                        q[k] += h;
                        (spec.project_px)(&camera.params, &q).unwrap()
                    };
                    let d = difference(&f, 1e-5);
                    let error = (d - p.by_point.column(k)).norm();
                    assert!(error < 2e-6 * (1.0 + d.norm()), "{} d{k}: {error:e}", spec.name);
                }
                for k in 0..camera.params.len() {
                    let h = 1e-6 * camera.params[k].abs().max(1e-2);
                    let f = |h: f64| {
                        let mut q = camera.params.clone();
                        q[k] += h;
                        (spec.project_px)(&q, &point).unwrap()
                    };
                    let d = difference(&f, h);
                    let error = (d - p.by_params[k]).norm();
                    assert!(
                        error < 1e-5 * (1.0 + d.norm()),
                        "{} {}: {error:e}",
                        spec.name,
                        spec.params[k].name
                    );
                }
            }
        }
    }

    #[test]
    fn batches_agree_with_single_points() {
        for camera in examples() {
            let spec = camera.spec();
            let behind = Vector3::new(0.1, 0.2, -1.0);
            let points: Vec<_> = rays(&camera).into_iter().map(|r| r * 3.7).chain([behind]).collect();
            for chunk in points.chunks(LANES) {
                let at = |l: usize, k: usize| chunk[l.min(chunk.len() - 1)][k];
                let lanes = [0, 1, 2].map(|k| std::array::from_fn(|l| at(l, k)));
                let (mut batch, mut px) = (Batch::ZERO, [[0.0; LANES]; 2]);
                (spec.project_batch)(&camera.params, &lanes, &mut batch);
                (spec.project_px_batch)(&camera.params, &lanes, &mut px);
                for (l, point) in chunk.iter().enumerate() {
                    let Some(p) = (spec.project)(&camera.params, point) else {
                        assert!(batch.px[0][l].is_nan() && px[0][l].is_nan(), "{} {point}", spec.name);
                        continue;
                    };
                    let close = |a: f64, b: f64| (a - b).abs() <= 1e-12 * (1.0 + a.abs());
                    for side in 0..2 {
                        assert!(close(p.px[side], batch.px[side][l]) && close(p.px[side], px[side][l]));
                        assert!((0..3).all(|k| close(p.by_point[(side, k)], batch.by_point[side][k][l])));
                        assert!(
                            (0..MAX_PARAMS).all(|k| close(p.by_params[k][side], batch.by_params[side][k][l]))
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn unproject_inverts_project() {
        for camera in examples() {
            for ray in rays(&camera) {
                let px = camera.project(&Point3::from(ray * 2.0)).unwrap();
                let back = camera.unproject(&px).unwrap();
                assert!((back - ray).norm() < 1e-12, "{camera:?} {px:?}: {:e}", (back - ray).norm());
            }
        }
    }

    #[test]
    fn cameras_survive_serialisation() {
        for camera in examples() {
            let text = serde_json::to_string(&camera).unwrap();
            assert_eq!(serde_json::from_str::<Camera>(&text).unwrap(), camera);
        }
    }

    #[test]
    fn the_pixel_origin_is_the_centre_of_the_first_pixel() {
        // A camera that looks at the middle of a 2 × 2 picture has its principal point between the four pixel centres.
        let camera =
            Camera::from_named(Model::Pinhole, [2, 2], &[("fx", 1.0), ("fy", 1.0), ("cx", 0.5), ("cy", 0.5)])
                .unwrap();
        assert_eq!(camera.project(&Point3::new(-0.5, -0.5, 1.0)), Some(Vector2::new(0.0, 0.0)));
        assert_eq!(camera.project(&Point3::new(0.5, 0.5, 1.0)), Some(Vector2::new(1.0, 1.0)));
    }

    #[test]
    fn pixels_beyond_a_fold_have_no_ray() {
        let values = [("fx", 500.0), ("fy", 500.0), ("cx", 320.0), ("cy", 240.0), ("k1", -0.5)];
        let camera = Camera::from_named(Model::Brown5, [640, 480], &values).unwrap();
        // r(1 − r²/2) has its maximum at r = √(2/3): 272 px from the centre.
        let fold = (2.0f64 / 3.0).sqrt().atan();
        assert!((camera.fold_rad() - fold).abs() < 1e-9, "{}", camera.fold_rad() - fold);
        assert!(camera.unproject(&Vector2::new(320.0 + 271.9, 240.0)).is_some());
        assert!(camera.unproject(&Vector2::new(320.0 + 272.5, 240.0)).is_none());
    }

    #[test]
    fn tangents_are_orthonormal() {
        for ray in [Vector3::z(), -Vector3::z(), Vector3::x(), Vector3::new(0.3, -0.5, -0.9).normalize()] {
            let [a, b] = tangents(&ray);
            assert!((a.cross(&b) - ray).norm() < 1e-15 && (a.norm() - 1.0).abs() < 1e-15);
        }
        assert_eq!(tangents(&Vector3::z()), [Vector3::x(), Vector3::y()]);
    }
}
