//! The picture of a dot as a function of its parameters, with derivatives, over the pixels along its boundary.

use nalgebra::Vector2;

use super::{
    Start,
    normal::{N, SHARPEST, Step},
};
use crate::image::{Plane, Sample};

/// What a picture of a dot is made from.
#[derive(Clone, Copy)]
pub(super) struct Model {
    /// Pixels farther from the boundary are left out, px.
    pub(super) band: f64,
    pub(super) c: Vector2<f64>,
    pub(super) w: [f64; 3],
    pub(super) t: f64,
    pub(super) i: f64,
    pub(super) o: f64,
    pub(super) h: Vector2<f64>,
}

/// One pixel: residual, derivatives, and where it lies.
pub(super) struct Pixel {
    pub(super) residual: f64,
    pub(super) by: [f64; N],
    /// Derivative by a move of the boundary outwards, in radii, negative; angle in the frame of the ellipse.
    pub(super) by_radius: f64,
    pub(super) angle: [f64; 2],
}

/// W of an ellipse.
pub(in crate::circles) fn root([a, b, c]: [f64; 3]) -> Option<[f64; 3]> {
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
    pub(super) fn ellipse(&self) -> [f64; 3] {
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

pub(in crate::circles) fn minor([a, b, c]: [f64; 3]) -> f64 {
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
pub(super) fn pixels<T: Sample>(
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

impl Model {
    /// One step on; `None` where it leads nowhere.
    pub(super) fn moved(&self, d: &Step, start: &Start) -> Option<Self> {
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
