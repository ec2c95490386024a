//! What spoils pictures, in the order in which it happens in a camera.
//!
//! bend (of the board, while rendering) → occlusion → blur → motion → light → vignette → contrast → shot noise →
//! noise → 8-bit rounding → JPEG.

use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};
use std::{fmt, str::FromStr};

use super::{Scene, filter, random};
use crate::{
    Error, Result,
    image::{Plane, Sample},
};

/// Degradations of a scene's pictures. The default does nothing.
///
/// As text: `noise=5,blur=1,motion=5@30,jpeg=40`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Degrade {
    /// Sag of the board over its width, in the board's unit; positive: the middle is nearest to the camera.
    pub bend: f64,
    /// Share of the board's area that something covers, 0..=0.9.
    pub occlusion: f64,
    /// σ of the Gaussian defocus, px.
    pub blur: f64,
    /// Length of a straight motion during the exposure, px.
    pub motion: f64,
    /// Its direction, degrees from x towards y; by chance where it is `None`.
    pub motion_deg: Option<f64>,
    /// Loss of light from one side of the picture to the other, 0..=1; the direction is by chance.
    pub light: f64,
    /// Loss of light from the middle to the corners of the picture, with the square of the distance, 0..=1.
    pub vignette: f64,
    /// Factor on the difference to middle grey; 1 changes nothing.
    pub contrast: f64,
    /// σ of the shot noise on white, grey levels; its variance is in proportion to the light.
    pub shot: f64,
    /// σ of the Gaussian noise, grey levels.
    pub noise: f64,
    /// Quality of JPEG compression, 1..=100.
    pub jpeg: Option<u8>,
}

impl Default for Degrade {
    fn default() -> Self {
        Self {
            bend: 0.0,
            occlusion: 0.0,
            blur: 0.0,
            motion: 0.0,
            motion_deg: None,
            light: 0.0,
            vignette: 0.0,
            contrast: 1.0,
            shot: 0.0,
            noise: 0.0,
            jpeg: None,
        }
    }
}

/// Name, smallest and largest value, and what does nothing.
const RANGES: [(&str, f64, f64); 9] = [
    ("bend", -1e6, 1e6),
    ("occlusion", 0.0, 0.9),
    ("blur", 0.0, 50.0),
    ("motion", 0.0, 200.0),
    ("light", 0.0, 1.0),
    ("vignette", 0.0, 1.0),
    ("contrast", 0.0, 10.0),
    ("shot", 0.0, 1000.0),
    ("noise", 0.0, 1000.0),
];

/// Effect numbers of the streams of random numbers: never renumber, or pictures change.
#[derive(Clone, Copy)]
enum Stream {
    Occlusion = 1,
    Motion = 2,
    Light = 3,
    Shot = 4,
    Noise = 5,
}

impl Degrade {
    /// The values in the order of [`RANGES`].
    fn values(&mut self) -> [&mut f64; 9] {
        [
            &mut self.bend,
            &mut self.occlusion,
            &mut self.blur,
            &mut self.motion,
            &mut self.light,
            &mut self.vignette,
            &mut self.contrast,
            &mut self.shot,
            &mut self.noise,
        ]
    }

    /// Checks the ranges.
    ///
    /// # Errors
    /// [`Error::Invalid`] with the name, the value and the range.
    pub fn validate(&self) -> Result<()> {
        let mut copy = self.clone();
        for (value, (name, lo, hi)) in copy.values().into_iter().zip(RANGES) {
            if !(lo..=hi).contains(value) {
                return Err(Error::Invalid(format!("{name}={value}: give a number from {lo} to {hi}")));
            }
        }
        if self.motion_deg.is_some_and(|a| !a.is_finite()) {
            return Err(Error::Invalid("motion: the direction must be a finite number of degrees".into()));
        }
        if self.jpeg.is_some_and(|q| !(1..=100).contains(&q)) {
            return Err(Error::Invalid("jpeg: give a quality from 1 to 100".into()));
        }
        Ok(())
    }

    /// Applies everything but the bend to the light of a view, and rounds it to 8 bits.
    ///
    /// # Errors
    /// [`Error::Unsupported`] where JPEG cannot hold a picture of this size.
    pub fn apply(&self, mut light: Plane<f32>, scene: &Scene, view: usize) -> Result<Plane<u8>> {
        if self.occlusion > 0.0 {
            let mut rng = random::stream(scene.seed, view, Stream::Occlusion as u64);
            occlude(&mut light, self.occlusion, scene, view, &mut rng);
        }
        self.expose(light, scene.seed, view)
    }

    /// What lens and camera make of the light of a view: all that follows the occlusion.
    ///
    /// # Errors
    /// [`Error::Unsupported`] where JPEG cannot hold a picture of this size.
    pub fn expose(&self, mut light: Plane<f32>, seed: u64, view: usize) -> Result<Plane<u8>> {
        let stream = |s: Stream| random::stream(seed, view, s as u64);
        if self.blur > 0.0 {
            light = filter::gaussian(&light, self.blur);
        }
        if self.motion > 0.0 {
            let by_chance = 180.0 * stream(Stream::Motion).random::<f64>();
            light = filter::motion(&light, self.motion, self.motion_deg.unwrap_or(by_chance));
        }
        if self.light > 0.0 || self.vignette > 0.0 {
            let angle = std::f64::consts::TAU * stream(Stream::Light).random::<f64>();
            illuminate(&mut light, self.light, self.vignette, angle);
        }
        if self.contrast != 1.0 {
            let c = self.contrast as f32;
            light.data_mut().iter_mut().for_each(|v| *v = 127.5 + c * (*v - 127.5));
        }
        let mut normal = |s: Stream, sigma: &dyn Fn(f32) -> f32| {
            let mut rng = stream(s);
            for v in light.data_mut() {
                let n: f32 = StandardNormal.sample(&mut rng);
                *v += sigma(*v) * n;
            }
        };
        if self.shot > 0.0 {
            normal(Stream::Shot, &|v| self.shot as f32 * (v.max(0.0) / 255.0).sqrt());
        }
        if self.noise > 0.0 {
            normal(Stream::Noise, &|_| self.noise as f32);
        }
        let picture = light.map(u8::from_f32);
        match self.jpeg {
            Some(quality) => jpeg(&picture, quality),
            None => Ok(picture),
        }
    }
}

/// Covers a share of the board with a grey ellipse somewhere on it.
fn occlude(light: &mut Plane<f32>, share: f64, scene: &Scene, view: usize, rng: &mut rand_pcg::Pcg64) {
    let corners: Vec<_> = scene.corners_px(view).into_iter().flatten().collect();
    let (cols, rows) = (scene.board.size.cols as usize, scene.board.size.rows as usize);
    if corners.len() != cols * rows {
        return;
    }
    let (a, b, c) = (corners[0], corners[cols - 1], corners[cols * (rows - 1)]);
    let whole = f64::from(scene.board.size.cols + 1) * f64::from(scene.board.size.rows + 1)
        / (f64::from(scene.board.size.cols - 1) * f64::from(scene.board.size.rows - 1));
    let area = (b - a).perp(&(c - a)).abs() * whole;
    let center = corners[rng.random_range(0..corners.len())];
    let aspect = rng.random_range(1.0..2.0f64);
    let (sin, cos) = (std::f64::consts::PI * rng.random::<f64>()).sin_cos();
    let level = rng.random_range(40.0..120.0f32);
    let long = (share * area * aspect / std::f64::consts::PI).sqrt().max(1e-3);
    let short = long / aspect;
    for y in 0..light.height() {
        for (x, v) in light.row_mut(y).iter_mut().enumerate() {
            let (dx, dy) = (x as f64 - center.x, y as f64 - center.y);
            let (u, w) = ((cos * dx + sin * dy) / long, (cos * dy - sin * dx) / short);
            // Distance to the outline, to first order, px: a soft edge of one pixel.
            let r = u.hypot(w).max(1e-9);
            let slope = (u / long).hypot(w / short) / r;
            let cover = (0.5 - (r - 1.0) / slope).clamp(0.0, 1.0) as f32;
            *v += cover * (level - *v);
        }
    }
}

/// Light that falls off to one side by `loss` and to the corners by `vignette`.
fn illuminate(light: &mut Plane<f32>, loss: f64, vignette: f64, angle: f64) {
    let (w, h) = (light.width() as f64, light.height() as f64);
    let (sin, cos) = angle.sin_cos();
    let (cx, cy) = ((w - 1.0) / 2.0, (h - 1.0) / 2.0);
    let reach = (cos * w).abs() + (sin * h).abs();
    let corner2 = cx * cx + cy * cy;
    for y in 0..light.height() {
        for (x, v) in light.row_mut(y).iter_mut().enumerate() {
            let (dx, dy) = (x as f64 - cx, y as f64 - cy);
            let side = 0.5 + (cos * dx + sin * dy) / reach;
            let r2 = (dx * dx + dy * dy) / corner2.max(1.0);
            *v *= ((1.0 - loss * side) * (1.0 - vignette * r2)) as f32;
        }
    }
}

/// Through a JPEG encoder and back.
fn jpeg(picture: &Plane<u8>, quality: u8) -> Result<Plane<u8>> {
    use image::{ExtendedColorType, codecs::jpeg::JpegEncoder};
    use zune_jpeg::zune_core::colorspace::ColorSpace;
    let (w, h) = (picture.width(), picture.height());
    let wrong = |e: String| {
        Error::Unsupported(format!("JPEG cannot hold a picture of {w} x {h} px ({e}): leave jpeg out"))
    };
    let mut bytes = Vec::new();
    JpegEncoder::new_with_quality(&mut bytes, quality)
        .encode(picture.data(), w as u32, h as u32, ExtendedColorType::L8)
        .map_err(|e| wrong(e.to_string()))?;
    let back = crate::jpeg::decode(bytes, false, ColorSpace::Luma).map_err(|e| wrong(format!("{e:?}")))?;
    Plane::from_vec(w, h, back)
        .ok_or_else(|| Error::Unsupported(format!("JPEG changed the size of a picture of {w} x {h} px")))
}

impl FromStr for Degrade {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let mut d = Self::default();
        for item in text.split(',').map(str::trim).filter(|i| !i.is_empty()) {
            let (name, value) = item.split_once('=').map(|(n, v)| (n.trim(), v.trim())).unwrap_or((item, ""));
            let wrong = |what: &str| Error::Invalid(format!("\"{item}\": {what}"));
            let number = |s: &str| {
                s.trim().parse::<f64>().map_err(|_| wrong("write name=number, for example noise=5"))
            };
            if name == "jpeg" {
                d.jpeg = Some(value.parse().map_err(|_| wrong("give a whole quality from 1 to 100"))?);
                continue;
            }
            let Some(k) = RANGES.iter().position(|r| r.0 == name) else {
                let names: Vec<_> = RANGES.iter().map(|r| r.0).chain(["jpeg"]).collect();
                return Err(wrong(&format!("not a degradation: choose from {}", names.join(", "))));
            };
            let value = match value.split_once('@') {
                Some((length, angle)) if name == "motion" => {
                    d.motion_deg = Some(number(angle)?);
                    length
                }
                _ => value,
            };
            *d.values()[k] = number(value)?;
        }
        d.validate()?;
        Ok(d)
    }
}

impl fmt::Display for Degrade {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (mut copy, mut plain) = (self.clone(), Self::default());
        let mut parts = Vec::new();
        for ((value, neutral), (name, ..)) in copy.values().into_iter().zip(plain.values()).zip(RANGES) {
            if value != neutral {
                let angle = self.motion_deg.filter(|_| name == "motion").map(|a| format!("@{a}"));
                parts.push(format!("{name}={value}{}", angle.unwrap_or_default()));
            }
        }
        parts.extend(self.jpeg.map(|q| format!("jpeg={q}")));
        f.write_str(&parts.join(","))
    }
}
