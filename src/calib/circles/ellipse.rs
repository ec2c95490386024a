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

use nalgebra::{SMatrix, SVector, Vector2};

use crate::calib::image::{Plane, Sample};

/// Parameters: centre, W₁₁ W₁₂ W₂₂, ln t, i, o, h.
const N: usize = 10;
type Step = SVector<f64, N>;

/// Blur of a picture that is not blurred: the pixel's own, px.
const SHARPEST: f64 = 0.289;
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

#[derive(Clone, Copy)]
struct Model {
    /// Pixels farther from the boundary are left out, px.
    band: f64,
    c: Vector2<f64>,
    w: [f64; 3],
    t: f64,
    i: f64,
    o: f64,
    h: Vector2<f64>,
}

/// One pixel: residual, derivatives, and where it lies.
struct Pixel {
    residual: f64,
    by: [f64; N],
    /// Derivative by a move of the boundary outwards, in radii, negative; angle in the frame of the ellipse.
    by_radius: f64,
    angle: [f64; 2],
}

/// W of an ellipse.
pub(super) fn root([a, b, c]: [f64; 3]) -> Option<[f64; 3]> {
    // Q⁻¹ = Wᵀ W with W upper triangular.
    let det = a * c - b * b;
    if !(det > 1e-9 && a > 0.0) {
        return None;
    }
    let w11 = (c / det).sqrt();
    let w12 = -b / (det * w11);
    let w22 = (a / det - w12 * w12).max(0.0).sqrt();
    (w11.is_finite() && w22 > 0.0).then_some([w11, w12, w22])
}

impl Model {
    /// Q.
    fn ellipse(&self) -> [f64; 3] {
        let [a, b, c] = self.w;
        // W⁻¹ = [1/a, −b/(a c); 0, 1/c].
        let (p, q, r) = (1.0 / a, -b / (a * c), 1.0 / c);
        [p * p + q * q, q * r, r * r]
    }

    /// Shorter half-axis, px.
    fn minor(&self) -> f64 {
        minor(self.ellipse())
    }

    fn pixel(&self, x: Vector2<f64>, origin: Vector2<f64>, value: f64, reach: f64) -> Option<Pixel> {
        let u = x - self.c;
        let [w11, w12, w22] = self.w;
        let v = Vector2::new(w11 * u.x + w12 * u.y, w22 * u.y);
        let rho = v.norm();
        if rho > reach {
            return None;
        }
        let v = if rho > 1e-9 { v / rho } else { Vector2::x() };
        let g = Vector2::new(w11 * v.x, w12 * v.x + w22 * v.y);
        let steep = g.norm();
        let plain = (rho - 1.0) / steep;
        if plain.abs() > self.band {
            return None;
        }
        let t = self.t;
        let det = (w11 * w22).powi(2);
        let bend = (t * t * det / steep.powi(3)).min(t);
        let z = (plain + 0.5 * bend) / t;
        let (p, density) = normal(z);
        let light = 1.0 + self.h.dot(&(x - origin));
        let level = self.i + (self.o - self.i) * p;
        let contrast = (self.o - self.i) * light;
        // ∂I/∂f, and f by the parameters.
        let by_f = contrast * density / t;
        let k = by_f / steep;
        let u0 = x - origin;
        let by = [
            -k * g.x,
            -k * g.y,
            k * v.x * u.x,
            k * v.x * u.y,
            k * v.y * u.y,
            contrast * density * (bend / t - z),
            (1.0 - p) * light,
            p * light,
            level * u0.x,
            level * u0.y,
        ];
        Some(Pixel { residual: value - level * light, by, by_radius: -k, angle: [v.x, v.y] })
    }
}

pub(super) fn minor([a, b, c]: [f64; 3]) -> f64 {
    let half = 0.5 * (a + c);
    (half - (0.25 * (a - c).powi(2) + b * b).sqrt()).max(0.0).sqrt()
}

/// Φ(z) and φ(z). Abramowitz & Stegun 7.1.26, |error| < 2e-7.
fn normal(z: f64) -> (f64, f64) {
    let e = (-0.5 * z * z).exp();
    let k = 1.0 / (1.0 + 0.327_591_1 * std::f64::consts::FRAC_1_SQRT_2 * z.abs());
    let poly = k
        * (0.254_829_592
            + k * (-0.284_496_736 + k * (1.421_413_741 + k * (-1.453_152_027 + k * 1.061_405_429))));
    let tail = 0.5 * poly * e;
    (if z > 0.0 { 1.0 - tail } else { tail }, 0.398_942_280_401_432_7 * e)
}

/// Pixels of every `stride`-th row and column that lie within the band.
fn pixels<T: Sample>(
    picture: &Plane<T>,
    model: &Model,
    origin: Vector2<f64>,
    reach: f64,
    stride: usize,
    mut each: impl FnMut(&Pixel),
) {
    let band = model.band;
    let short = model.minor().max(1e-6);
    let outer = (1.0 + band / short).min(reach);
    let inner = 1.0 - band / short;
    let [qxx, qxy, qyy] = model.ellipse();
    let tall = outer * qyy.sqrt();
    let first = (model.c.y - tall).ceil().max(0.0);
    let last = (model.c.y + tall).floor().min(picture.height() as f64 - 1.0);
    if first > last || !last.is_finite() {
        return;
    }
    let thin = (qxx - qxy * qxy / qyy).max(0.0);
    let right = picture.width() as f64 - 1.0;
    for y in (first as usize..=last as usize).step_by(stride) {
        let dy = y as f64 - model.c.y;
        let middle = model.c.x + dy * qxy / qyy;
        let half = |rho: f64| (thin * (rho * rho - dy * dy / qyy)).max(0.0).sqrt();
        let (wide, hole) = (half(outer), if inner > 0.0 { half(inner) } else { 0.0 });
        let row = picture.row(y);
        let mut span = |from: f64, to: f64| {
            let (from, to) = (from.ceil().max(0.0), to.floor().min(right));
            if from > to || !to.is_finite() {
                return;
            }
            let from = (from as usize).next_multiple_of(stride);
            for x in (from..=to as usize).step_by(stride) {
                let at = Vector2::new(x as f64, y as f64);
                let Some(value) = row.get(x) else { return };
                if let Some(p) = model.pixel(at, origin, f64::from(value.to_f32()), reach) {
                    each(&p);
                }
            }
        };
        if hole > 1.0 {
            span(middle - wide, middle - hole);
            span((middle + hole).floor() + 0.5, middle + wide);
        } else {
            span(middle - wide, middle + wide);
        }
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

impl Model {
    /// One step on; `None` where it leads nowhere.
    fn moved(&self, d: &Step, start: &Start) -> Option<Self> {
        let mut m = *self;
        let short = m.minor();
        let centre = Vector2::new(d[0], d[1]);
        let scale = (0.4 * short.max(m.t) / centre.norm().max(1e-9)).min(1.0);
        m.c += centre * scale;
        let size = (m.w[0] * m.w[2]).sqrt();
        for k in 0..3 {
            let most = 0.3 * size.max(m.w[k].abs());
            m.w[k] += d[2 + k].clamp(-most, most) * scale;
        }
        m.t = (m.t * d[5].clamp(-0.5, 0.5).exp()).clamp(SHARPEST, short.max(1.0));
        m.i += d[6];
        m.o += d[7];
        m.h += Vector2::new(d[8], d[9]);
        let sane = m.c.iter().chain(&m.w).all(|v| v.is_finite())
            && m.w[0] > 0.0
            && m.w[2] > 0.0
            && m.i.is_finite()
            && m.o.is_finite()
            && (m.c - start.px).norm_squared() < start.ellipse[0] + start.ellipse[2];
        sane.then_some(m)
    }
}

/// The normal equations of a model.
struct Sums {
    /// Lower triangle.
    normal: [[f64; N]; N],
    right: [f64; N],
    rss: f64,
    n: usize,
}

impl Sums {
    fn of<T: Sample>(picture: &Plane<T>, m: &Model, start: &Start, stride: usize) -> Self {
        let (mut normal, mut right, mut rss, mut n) = ([[0.0; N]; N], [0.0; N], 0.0, 0);
        pixels(picture, m, start.px, start.reach, stride, |p| {
            for a in 0..N {
                for b in 0..=a {
                    normal[a][b] += p.by[a] * p.by[b];
                }
                right[a] += p.by[a] * p.residual;
            }
            rss += p.residual * p.residual;
            n += 1;
        });
        Self { normal, right, rss, n }
    }

    fn mean(&self) -> f64 {
        self.rss / self.n.max(1) as f64
    }

    /// Gauss–Newton's step with the diagonal raised by `damping`; `free`: x, y, shape, blur, levels, light.
    fn step(&self, m: &Model, free: [bool; 6], damping: f64) -> Option<Step> {
        if self.n < 2 * N {
            return None;
        }
        let mut held = [0, 1, 2, 2, 2, 3, 4, 4, 5, 5].map(|k: usize| !free[k]);
        let step = self.solve(&held, damping)?;
        // An active bound: the blur is taken out of the system, not cut afterwards.
        if m.t <= SHARPEST * 1.0001 && step[5] < 0.0 {
            held[5] = true;
            return self.solve(&held, damping);
        }
        Some(step)
    }

    /// Solves for the parameters that are not held; the others do not move.
    fn solve(&self, held: &[bool; N], damping: f64) -> Option<Step> {
        let (a, scale) = self.scaled(held, damping)?;
        let b = Step::from_fn(|k, _| if held[k] { 0.0 } else { self.right[k] * scale[k] });
        Some(a.cholesky()?.solve(&b).component_mul(&scale))
    }

    /// The normal matrix with a diagonal of ones, and the scale of each parameter.
    fn scaled(&self, held: &[bool; N], damping: f64) -> Option<(SMatrix<f64, N, N>, Step)> {
        let scale = Step::from_fn(|k, _| if held[k] { 1.0 } else { 1.0 / self.normal[k][k].sqrt() });
        if !scale.iter().all(|s| s.is_finite()) {
            return None;
        }
        let a = SMatrix::from_fn(|r, c| match (r == c, held[r] || held[c]) {
            (true, true) => 1.0,
            (true, false) => 1.0 + 1e-10 + damping,
            (false, true) => 0.0,
            (false, false) => self.normal[r.max(c)][r.min(c)] * scale[r] * scale[c],
        });
        Some((a, scale))
    }
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
