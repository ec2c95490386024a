//! Projections of straightened pictures: from directions to the plane of the picture, in units of its focal length.
//!
//! With the ray `(X, Y, Z)`, `ρ = √(X² + Y²)` and `θ = atan2(ρ, Z)`:
//!
//! ```text
//! perspective     x = X/Z                    y = Y/Z              straight lines stay straight
//! cylindrical     x = atan2(X, Z)            y = Y/√(X² + Z²)     vertical lines stay straight and vertical
//! equidistant     x = θ X/ρ                  y = θ Y/ρ            angles from the axis are lengths
//! stereographic   x = 2 tan(θ/2) X/ρ         y = 2 tan(θ/2) Y/ρ   circles stay circles, small shapes keep their form
//! ```
//!
//! J. P. Snyder, "Map Projections: A Working Manual", USGS Professional Paper 1395, 1987 (gnomonic, central cylindrical, azimuthal
//! equidistant, stereographic).

use std::{f64::consts::PI, fmt, str::FromStr};

use nalgebra::{Vector2, Vector3};
use serde::{Deserialize, Serialize};

use super::MAX_ANGLE_RAD;
use crate::{
    Error, Result,
    camera::{LANES, Lanes, Model},
};

/// How directions are laid out in a straightened picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Projection {
    /// As a camera without distortion.
    #[default]
    Perspective,
    /// On a cylinder with a vertical axis.
    Cylindrical,
    /// Angles from the axis are lengths.
    Equidistant,
    /// Shapes keep their form.
    Stereographic,
}

/// Everything that the rest of the program knows about a projection.
#[derive(Debug)]
pub struct Spec {
    /// Name on the command line and in files.
    pub name: &'static str,
    /// Name for people.
    pub title: &'static str,
    /// In one line, what it keeps and for which lenses.
    pub explained: &'static str,
    /// Largest angle from the axis that it shows, rad.
    pub max_angle_rad: f64,
    /// Largest |y| that it shows.
    pub max_y: f64,
    /// From a ray, not normalised, to the plane; `None` where the projection has no such point.
    pub point: fn(&Vector3<f64>) -> Option<Vector2<f64>>,
    /// From points of the plane, all with the same y, to rays, not normalised; NaN beyond what it shows.
    pub rays: fn(&Lanes, f64, &mut [Lanes; 3]),
    /// The camera model with such pictures, and its parameters after `fx fy cx cy`.
    pub model: Option<(Model, &'static [f64])>,
}

/// 179°: straight backwards is no direction in the plane.
const BACKWARDS: f64 = 179.0 / 180.0 * PI;
/// Farthest from the axis in a stereographic picture, rad: there everything is 33 times as large as in the middle.
const STEREOGRAPHIC: f64 = 160.0 / 180.0 * PI;
/// tan 80°: the elevation on a cylinder is limited as the angle of a flat picture.
const MAX_ELEVATION: f64 = 5.671_281_819_617_709;

static PERSPECTIVE: Spec = Spec {
    name: "perspective",
    title: "Perspective",
    explained: "Straight lines stay straight; up to about 120°, beyond the edges are stretched",
    max_angle_rad: MAX_ANGLE_RAD,
    max_y: f64::INFINITY,
    point: |r| (r.z > 0.0).then(|| r.xy() / r.z),
    rays: |x, y, out| *out = [*x, [y; LANES], [1.0; LANES]],
    model: Some((Model::Pinhole, &[])),
};

static CYLINDRICAL: Spec = Spec {
    name: "cylindrical",
    title: "Cylindrical",
    explained: "Vertical lines stay straight; wide rooms and streets, all around",
    max_angle_rad: BACKWARDS,
    max_y: MAX_ELEVATION,
    point: |r| {
        let y = r.y / r.x.hypot(r.z);
        y.is_finite().then(|| Vector2::new(r.x.atan2(r.z), y))
    },
    rays: |x, y, out| {
        each(x, y, out, |x, y| {
            if x.abs() <= PI && y.abs() <= MAX_ELEVATION {
                let (sin, cos) = x.sin_cos();
                [sin, y, cos]
            } else {
                NOWHERE
            }
        });
    },
    model: None,
};

static EQUIDISTANT: Spec = Spec {
    name: "equidistant",
    title: "Equidistant",
    explained: "Angles from the axis are lengths; fisheye lenses beyond 180°, measurements of directions",
    max_angle_rad: BACKWARDS,
    max_y: f64::INFINITY,
    point: |r| {
        let rho = r.x.hypot(r.y);
        let theta = rho.atan2(r.z);
        match (rho > 0.0, r.z > 0.0) {
            (true, _) => Some(r.xy() * (theta / rho)),
            (false, true) => Some(Vector2::zeros()),
            (false, false) => None,
        }
    },
    rays: |x, y, out| {
        each(x, y, out, |x, y| {
            let theta = x.hypot(y);
            let (sin, cos) = theta.sin_cos();
            let scale = if theta > 0.0 { sin / theta } else { 1.0 };
            if theta < PI { [x * scale, y * scale, cos] } else { NOWHERE }
        });
    },
    model: Some((Model::Kb4, &[0.0; 4])),
};

static STEREOGRAPHIC_SPEC: Spec = Spec {
    name: "stereographic",
    title: "Stereographic",
    explained: "Circles stay circles and faces keep their form; fisheye lenses beyond 180°",
    max_angle_rad: STEREOGRAPHIC,
    max_y: f64::INFINITY,
    point: |r| {
        let depth = r.norm() + r.z;
        (depth > 0.0).then(|| r.xy() * (2.0 / depth))
    },
    // tan(θ/2) = r/2: (sin θ, cos θ) ∝ (r, 1 − r²/4).
    rays: |x, y, out| each(x, y, out, |x, y| [x, y, 1.0 - 0.25 * (x * x + y * y)]),
    // The unified model with its centre on the sphere: n = (d + Z)/2.
    model: Some((Model::Eucm, &[0.5, 1.0])),
};

/// No ray.
const NOWHERE: [f64; 3] = [f64::NAN; 3];

/// A projection that is written for one point, for all lanes.
#[inline(always)]
fn each(x: &Lanes, y: f64, out: &mut [Lanes; 3], ray: impl Fn(f64, f64) -> [f64; 3]) {
    for (l, x) in x.iter().enumerate() {
        let [a, b, c] = ray(*x, y);
        (out[0][l], out[1][l], out[2][l]) = (a, b, c);
    }
}

impl Projection {
    /// All projections.
    pub const ALL: [Self; 4] = [Self::Perspective, Self::Cylindrical, Self::Equidistant, Self::Stereographic];

    /// Its table.
    pub fn spec(self) -> &'static Spec {
        match self {
            Self::Perspective => &PERSPECTIVE,
            Self::Cylindrical => &CYLINDRICAL,
            Self::Equidistant => &EQUIDISTANT,
            Self::Stereographic => &STEREOGRAPHIC_SPEC,
        }
    }

    /// The ray of a point of the plane, not normalised; `None` beyond what the projection shows.
    pub fn ray(self, point: &Vector2<f64>) -> Option<Vector3<f64>> {
        let mut rays = [[0.0; LANES]; 3];
        (self.spec().rays)(&[point.x; LANES], point.y, &mut rays);
        let ray = Vector3::from(rays.map(|lane| lane[0]));
        ray.iter().all(|v| v.is_finite()).then_some(ray)
    }

    /// Half the width of a picture with this horizontal field of view, in focal lengths.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a field of view that the projection cannot show.
    pub fn half_width(self, fov_rad: f64) -> Result<f64> {
        let spec = self.spec();
        let half = 0.5 * fov_rad;
        let refused = || {
            Error::Invalid(format!(
                "a field of view of {:.0}° does not fit a {} picture: give more than 0° and at most {:.0}°{}",
                fov_rad.to_degrees(),
                spec.name,
                2.0 * spec.max_angle_rad.to_degrees(),
                if self == Self::Perspective { ", or another projection" } else { "" }
            ))
        };
        // A degree is typed rounded.
        if !(half > 0.0 && half <= spec.max_angle_rad * (1.0 + 1e-12)) {
            return Err(refused());
        }
        (spec.point)(&Vector3::new(half.sin(), 0.0, half.cos())).map(|p| p.x).ok_or_else(refused)
    }
}

impl fmt::Display for Projection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.spec().name)
    }
}

impl FromStr for Projection {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        Self::ALL.into_iter().find(|p| p.spec().name.eq_ignore_ascii_case(text)).ok_or_else(|| {
            let names: Vec<_> = Self::ALL.iter().map(|p| p.spec().name).collect();
            Error::Invalid(format!("\"{text}\" is not a projection: choose one of {}", names.join(", ")))
        })
    }
}
