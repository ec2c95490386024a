//! The brightness across a blurred edge, integrated over the pixel, as a polynomial.
//!
//! `P(u)` runs from −1 to 1: a Gaussian of width s convolved with a box of width 1 (the pixel across the edge) and
//! with a box of width |p| (an edge `u = o + p v` moves by p within one row of pixels). Its variance is
//!
//! ```text
//! sd² = s² + (1 + p²)/12
//! ```
//!
//! On `|x| ≤ 1`, `x = u/h`, the profile is `P = x Σ c_j x^{2j}`, j < 7, and outside it is ±1: the inner loop of the fit
//! then needs no exponential and no division, whatever the blur. The coefficients interpolate the exact profile at
//! the six points `sin(iπ/12)`, i = 1 … 6, with slope 0 at 1; the error is below 3e-3.

use super::lanes::{Block, LANES, fma, limit, polynomial};

const COEFFICIENTS: usize = 7;

/// `sin(iπ/12)`, padded to whole lanes.
const POINTS: Block =
    [0.258_819, 0.5, std::f32::consts::FRAC_1_SQRT_2, 0.866_025_4, 0.965_925_8, 1.0, 1.0, 1.0];

/// Coefficients from the values at [`POINTS`]: the inverse of the 7 × 7 system of the six values and the end slope,
/// without the column of the slope, which is zero.
#[rustfmt::skip]
const INTERPOLATE: [[f64; 6]; COEFFICIENTS] = [
    [8.282209, -5.333333, 5.656854, -9.237604, 30.909626, -24.833333],
    [-86.177467, 113.777778, -131.993266, 221.702503, -749.915032, 603.277778],
    [345.120522, -595.555556, 850.413756, -1524.204711, 5285.439900, -4264.555556],
    [-695.210574, 1383.111111, -2292.911589, 4489.475693, -16157.278856, 13095.111111],
    [753.044752, -1635.555556, 3016.988933, -6429.372598, 24225.218652, -19747.555556],
    [-419.745793, 967.111111, -1930.872917, 4434.050067, -17556.242933, 14407.111111],
    [94.686350, -227.555556, 482.718229, -1182.413351, 4921.868643, -4067.555556],
];

/// Gauss–Legendre nodes and weights on [−½, ½].
const ACROSS: [(f32, f32); 4] = [
    (-0.430_568_16, 0.173_927_42),
    (-0.169_990_52, 0.326_072_58),
    (0.169_990_52, 0.326_072_58),
    (0.430_568_16, 0.173_927_42),
];
const ALONG: [(f32, f32); 3] =
    [(-0.387_298_33, 0.277_777_8), (0.0, 0.444_444_44), (0.387_298_33, 0.277_777_8)];

/// Edge profile for one blur and slope.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Profile {
    /// Half width, px along u: ±1 is reached here.
    pub(super) h: f32,
    /// `P = x Σ value_j x^{2j}`.
    value: [f32; COEFFICIENTS],
    /// `dP/dx = Σ slope_j x^{2j}`.
    slope: [f32; COEFFICIENTS],
}

impl Profile {
    /// The profile of an edge with blur `s` (px along u) and slope `p`.
    pub(super) fn new(s: f32, p: f32) -> Self {
        let p = p.abs();
        let mut f = [0f32; LANES];
        let h;
        if s > 1.0 {
            // a pure Gaussian of the same variance is as good and costs a twelfth
            h = 3.0 * (s * s + pixel_variance(p)).sqrt();
            for l in 0..LANES {
                f[l] = erf(POINTS[l] * (3.0 * std::f32::consts::FRAC_1_SQRT_2));
            }
        } else {
            let q = std::f32::consts::FRAC_1_SQRT_2 / s;
            h = 0.5 * (1.0 + p) * (0.6 / s).min(1.0) + 3.0 * s;
            for (a, wa) in ACROSS {
                for (b, wb) in ALONG {
                    let (w, t) = (wa * wb, (a + b * p) * q);
                    for l in 0..LANES {
                        f[l] = fma(w, erf(fma(POINTS[l] * h, q, t)), f[l]);
                    }
                }
            }
        }
        let (mut value, mut slope) = ([0f32; COEFFICIENTS], [0f32; COEFFICIENTS]);
        for (j, row) in INTERPOLATE.iter().enumerate() {
            let c: f64 = row.iter().zip(&f).map(|(m, value)| m * f64::from(value / f[5])).sum(); // f64: the entries cancel
            value[j] = c as f32;
            slope[j] = (c * (2 * j + 1) as f64) as f32;
        }
        Self { h, value, slope }
    }

    /// P and dP/dx at `x` in [−1, 1].
    #[inline(always)]
    pub(super) fn at(&self, x: f32) -> (f32, f32) {
        let y = x * x;
        (x * polynomial(&self.value, y), polynomial(&self.slope, y))
    }
}

/// Variance that the integration over the pixel adds to an edge of slope p: two boxes of width 1 and |p|.
pub(super) fn pixel_variance(p: f32) -> f32 {
    (1.0 + p * p) / 12.0
}

/// erf with its tail cut at 2.7; |error| < 3e-4.
#[inline(always)]
fn erf(x: f32) -> f32 {
    const C: [f32; 7] =
        [1.126_989_4, -2.690_375_9, 5.429_746, -7.537_012, 6.651_847_4, -3.314_293, 0.703_468_3];
    let x = limit(x, 2.7);
    x * polynomial(&C, x * x * (1.0 / 7.29))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The profile by brute force: the mean of a Gaussian edge over 200 × 200 points of the two boxes; erf by its
    /// integral.
    fn exact(u: f64, s: f64, p: f64) -> f64 {
        let step = |x: f64| {
            let (n, t) = (400, x / s);
            let t = t.clamp(-8.0, 8.0);
            let sum: f64 = (0..n).map(|i| (-0.5 * (t * (i as f64 + 0.5) / n as f64).powi(2)).exp()).sum();
            2.0 * sum * t / n as f64 / (2.0 * std::f64::consts::PI).sqrt()
        };
        let n = 60;
        let grid = |i: i32| (f64::from(i) + 0.5) / f64::from(n) - 0.5;
        let sum: f64 = (0..n)
            .flat_map(|i| (0..n).map(move |j| (i, j)))
            .map(|(i, j)| step(u + grid(i) + p * grid(j)))
            .sum();
        sum / f64::from(n * n)
    }

    #[test]
    fn the_polynomial_follows_the_integrated_edge() {
        for (s, p) in [(0.15, 0.05), (0.3, 0.7), (0.7, 1.0), (0.95, 0.0), (1.3, 0.4), (4.0, 0.9)] {
            let profile = Profile::new(s, p);
            for i in -12..=12 {
                let x = i as f32 / 12.0;
                let want = exact(f64::from(x * profile.h), f64::from(s), f64::from(p));
                let (got, slope) = profile.at(x);
                assert!((f64::from(got) - want).abs() < 6e-3, "s {s} p {p} x {x}: {got} instead of {want}");
                let e = 1e-2;
                if x.abs() < 0.98 {
                    let secant = (profile.at(x + e).0 - profile.at(x - e).0) / (2.0 * e);
                    assert!((slope - secant).abs() < 0.02 * (1.0 + slope.abs()), "{slope} {secant}");
                }
            }
            assert!((profile.at(1.0).0 - 1.0).abs() < 1e-4 && profile.at(1.0).1.abs() < 1e-2);
        }
    }
}
