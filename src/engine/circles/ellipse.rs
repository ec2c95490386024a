//! An elliptic dot below the pixel: maximum likelihood on the pixels along its boundary.
//!
//! ```text
//! I(x) = (i + (o − i) Φ(f/t)) (1 + h·u)      f = (ρ − 1)/|∇ρ| + t² κ/2      ρ = |W u|, u = x − c
//! ```
//!
//! with the level i inside and o outside, the light's slope h, the blur t (pixel included: t² = s² + 1/12), the ellipse
//! `|W u| = 1` about c, its curvature κ there, and the normal distribution Φ. f is the distance from the ellipse to first
//! order, plus what blur moves a curved edge by. Gauss–Newton on ten parameters; under white noise the covariance of c is
//! the Cramér–Rao bound of these pixels. Model and picture are symmetric about the centre, so what the model neglects
//! moves no centre; that light has a slope must be in it.
//!
//! Gradients instead of grey values (J.-N. Ouellet, P. Hébert, "Precise ellipse estimation without contour point
//! extraction", MVA 21, 2009) err by 1.2 to 3 times as much; moments of the grey values are more exact without noise and
//! slope of the light, and useless with (`tests/estimators.rs`).

mod model;
mod normal;

use nalgebra::Vector2;

use crate::image::{Plane, Sample};
use model::{Model, pixels};
pub(super) use model::{minor, root};
use normal::{N, SHARPEST, Sums};

/// Pixels farther from the boundary than this many blurs plus one pixel say nothing of it.
const BAND: f64 = 3.0;
/// Most iterations with free blur.
const ITERATIONS: usize = 20;
/// Variance of a centre that no fit is better than, px².
const FLOOR: f64 = 4e-6;
/// What a fit may leave of the contrast.
const LEFT: f64 = 0.35;

/// Where a fit starts.
#[derive(Clone, Copy, Debug)]
pub(super) struct Start {
    /// Centre, px.
    pub(super) px: Vector2<f64>,
    /// Ellipse `[xx, xy, yy]`, px²: the boundary is `dᵀ Q⁻¹ d = 1`.
    pub(super) ellipse: [f64; 3],
    /// Pixels farther from the centre than this many radii belong to other dots.
    pub(super) reach: f64,
    /// Blur if it is known, px; otherwise the fit begins blurred.
    pub(super) blur_px: Option<f64>,
}

/// A fitted dot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Dot {
    /// Centre of the ellipse, px.
    pub(super) px: Vector2<f64>,
    /// Its covariance `[xx, xy, yy]`, px².
    pub(super) cov_px2: [f64; 3],
    /// Ellipse `[xx, xy, yy]`, px²: the boundary is `dᵀ Q⁻¹ d = 1`.
    pub(super) ellipse: [f64; 3],
    /// Blur with the pixel's own, px.
    pub(super) blur_px: f64,
    /// Levels inside and outside, grey levels of the picture.
    pub(super) levels: [f64; 2],
    /// What the fit leaves, standard deviation in grey levels.
    pub(super) sigma_gray: f64,
    /// How much the outline differs from an ellipse: amplitude of its third and fourth harmonics, in radii.
    pub(super) harmonics: [f64; 4],
}

impl Dot {
    /// Predicted standard deviation per axis, px.
    pub(super) fn sigma_px(&self) -> f64 {
        (0.5 * (self.cov_px2[0] + self.cov_px2[2])).sqrt()
    }

    /// How much the outline differs from an ellipse, in radii.
    pub(super) fn unevenness(&self) -> f64 {
        self.harmonics.iter().map(|h| h * h).sum::<f64>().sqrt()
    }

    /// Outside minus inside.
    pub(super) fn contrast(&self) -> f64 {
        self.levels[1] - self.levels[0]
    }
}

/// Levels inside and outside from what surely lies there.
fn levels<T: Sample>(picture: &Plane<T>, start: &Start, w: [f64; 3]) -> Option<[f64; 2]> {
    let tall = start.reach * start.ellipse[2].sqrt();
    let wide = start.reach * start.ellipse[0].sqrt();
    let range = |c: f64, half: f64, n: usize| {
        let (low, high) = ((c - half).ceil().max(0.0), (c + half).floor().min(n as f64 - 1.0));
        (low <= high).then_some(low as usize..=high as usize)
    };
    let stride = (tall.min(wide) / 10.0) as usize + 1;
    let outer = (0.4 + 0.6 * start.reach).min(1.3);
    let mut sums = [[0.0; 2]; 2];
    for y in range(start.px.y, tall, picture.height())?.step_by(stride) {
        for x in range(start.px.x, wide, picture.width())?.step_by(stride) {
            let u = Vector2::new(x as f64, y as f64) - start.px;
            let rho = (w[0] * u.x + w[1] * u.y).hypot(w[2] * u.y);
            let side = if rho < 0.65 {
                0
            } else if rho > outer && rho < start.reach {
                1
            } else {
                continue;
            };
            sums[side][0] += f64::from(picture.at(x, y).to_f32());
            sums[side][1] += 1.0;
        }
    }
    sums.iter().all(|s| s[1] > 0.0).then(|| sums.map(|s| s[0] / s[1]))
}

/// Fits the dot at a place; `None` where there is none.
pub(super) fn fit<T: Sample>(picture: &Plane<T>, start: &Start) -> Option<Dot> {
    let w = root(start.ellipse)?;
    let [i, o] = levels(picture, start, w)?;
    let short = minor(start.ellipse);
    let mut m = Model { band: 0.0, c: start.px, w, t: 0.0, i, o, h: Vector2::zeros() };
    m.t = match start.blur_px {
        Some(blur) => blur.max(SHARPEST),
        None => {
            // From a blur as wide as the start may be wrong down to a usual one; not every pixel is needed for it.
            let mut t = (0.2 * short).max(0.8);
            loop {
                (m.t, m.band) = (t, BAND * t + 1.0);
                let stride = (t / 1.5) as usize + 1;
                for _ in 0..2 {
                    let sums = Sums::of(picture, &m, start, stride);
                    m = m.moved(&sums.step(&m, [true, true, true, false, true, false], 0.0)?, start)?;
                }
                if t <= 1.6 {
                    break t;
                }
                t = (0.3 * t).max(0.8);
            }
        }
    };
    descend(picture, m, start)
}

/// Levenberg–Marquardt with all parameters free.
fn descend<T: Sample>(picture: &Plane<T>, mut m: Model, start: &Start) -> Option<Dot> {
    m.band = BAND * m.t + 1.0;
    let mut sums = Sums::of(picture, &m, start, 1);
    let mut damping = 0.0;
    for _ in 0..ITERATIONS {
        let step = sums.step(&m, [true; 6], damping)?;
        let next = m.moved(&step, start)?;
        let trial = Sums::of(picture, &next, start, 1);
        let small = step[0].hypot(step[1]) < 0.02 * (0.1 + m.t) && step[5].abs() < 0.1;
        if trial.mean() > 1.001 * sums.mean() {
            if small {
                return finish(picture, &m, start, &sums);
            }
            damping = (8.0f64 * damping).max(0.05);
            if damping > 1e4 {
                return None;
            }
            continue;
        }
        (m, sums) = (next, trial);
        damping = if damping > 0.01 { 0.25 * damping } else { 0.0 };
        if small && damping == 0.0 {
            return finish(picture, &m, start, &sums);
        }
        // The same pixels as long as possible: sums of different ones cannot be compared.
        let band = BAND * m.t + 1.0;
        if band > 1.25 * m.band || band < 0.6 * m.band {
            m.band = band;
            sums = Sums::of(picture, &m, start, 1);
        }
    }
    None
}

/// Covariance, residual and the shape of the outline at the solution; `None` where it is no dot.
fn finish<T: Sample>(picture: &Plane<T>, m: &Model, start: &Start, sums: &Sums) -> Option<Dot> {
    let mut held = [false; N];
    held[5] = m.t <= SHARPEST * 1.0001;
    let (a, scale) = sums.scaled(&held, 0.0)?;
    let inverse = a.cholesky()?.inverse();
    let variance = (sums.rss / sums.n.checked_sub(N)?.max(1) as f64).max(1.0 / 12.0);
    let cov = |r: usize, c: usize| variance * inverse[(r, c)] * scale[r] * scale[c];
    let (sigma_gray, contrast) = (variance.sqrt(), m.o - m.i);
    let ellipse = m.ellipse();
    let area = |[a, b, c]: [f64; 3]| (a * c - b * b).max(0.0).sqrt();
    let grown = area(ellipse) / area(start.ellipse);
    let size = [picture.width(), picture.height()].map(|s| s as f64);
    let inside = (0..2).all(|k| {
        let half = ellipse[2 * k].sqrt() + 0.5;
        m.c[k] - half > 0.0 && m.c[k] + half < size[k] - 1.0
    });
    let is_dot = inside
        && contrast.abs() > 3.0 * sigma_gray
        && sigma_gray < LEFT * contrast.abs()
        && (0.25..4.0).contains(&grown)
        && minor(ellipse) > 0.8;
    is_dot.then(|| Dot {
        px: m.c,
        cov_px2: [cov(0, 0) + FLOOR, cov(0, 1), cov(1, 1) + FLOOR],
        ellipse,
        blur_px: m.t,
        levels: [m.i, m.o],
        sigma_gray,
        harmonics: harmonics(picture, m, start),
    })
}

/// What third and fourth harmonics of the outline `[cos 3φ, sin 3φ, cos 4φ, sin 4φ]` would explain, in radii.
fn harmonics<T: Sample>(picture: &Plane<T>, m: &Model, start: &Start) -> [f64; 4] {
    let (mut top, mut bottom) = ([0.0; 4], [0.0f64; 4]);
    pixels(picture, m, start.px, start.reach, 1, |p| {
        let [c, s] = p.angle;
        let (c2, s2) = (c * c - s * s, 2.0 * c * s);
        let (c3, s3) = (c2 * c - s2 * s, s2 * c + c2 * s);
        let (c4, s4) = (c2 * c2 - s2 * s2, 2.0 * c2 * s2);
        for (k, h) in [c3, s3, c4, s4].into_iter().enumerate() {
            let by = p.by_radius * h;
            top[k] += by * p.residual;
            bottom[k] += by * by;
        }
    });
    [0, 1, 2, 3].map(|k| if bottom[k] > 0.0 { top[k] / bottom[k] } else { 0.0 })
}
