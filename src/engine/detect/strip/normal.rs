//! Normal equations of a corner: sums of products over both strips, and their solution.
//!
//! Unknowns, in this order: `[δo₁ δp₁ δln s₁ δo₂ δp₂ δln s₂ δm δa]`, the first two of each edge as `−δ/h`. Strip k sees
//! the unknowns of edge k, m and a, which gives the exact gradient of the likelihood but for the crossing, which both strips
//! contain; products between unknowns of different edges are odd in both and left out.

use nalgebra::Matrix2;

use super::{
    edge::Edge,
    gather::Strip,
    lanes::{Block, LANES, fma, limit},
    scatter::{Rows, Scatter},
};

/// Columns of one strip: ∂I/∂x, v ∂I/∂x, x ∂I/∂x, ∂I/∂m, ∂I/∂a, residual.
const COLUMNS: usize = 6;
const O: usize = 0;
const P: usize = 1;
const S: usize = 2;
const M: usize = 3;
const A: usize = 4;
const R: usize = 5;
/// Variance that rounding to whole grey levels alone leaves.
pub(super) const ROUNDING: f64 = 1.0 / 12.0;
/// Pairs (i, j), i ≤ j, of columns.
const PAIRS: usize = COLUMNS * (COLUMNS + 1) / 2;

/// Position of the pair i ≤ j.
const fn pair(i: usize, j: usize) -> usize {
    i * COLUMNS - i * (i + 1) / 2 + j
}

/// Levels around a corner in the (u, v) of a strip: mean `m + gᵀ(u, v)`, amplitude `a (1 + hᵀ(u, v))`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Levels {
    pub(super) mean: f32,
    pub(super) amplitude: f32,
    /// Amplitude in the derivatives: 1 in the first pass, which solves for the products a·δo, a·δp.
    pub(super) jacobian: f32,
    pub(super) mean_gradient: [f32; 2],
    pub(super) amplitude_gradient: [f32; 2],
}

/// What is constant in a block of pixels: `x₁ = x + x_step·l`, `x₂ = z + z_step·l`, and so on for lane l.
struct Line {
    v: f32,
    x: f32,
    x_step: f32,
    z: f32,
    z_step: f32,
    mean: f32,
    amplitude: f32,
    skew: f32,
}

/// Sums of products of one strip.
pub(super) struct Sums {
    pairs: [f64; PAIRS],
    /// Factor of column S: ∂P/∂ln s = factor · x P'.
    blur_factor: f64,
    rows: Rows,
}

impl Sums {
    /// Evaluates the model on a strip along `edge`. `FULL`: with the blur and the residuals' sum of squares; `by_rows`: with how its
    /// rows scatter.
    pub(super) fn of<const FULL: bool>(
        strip: &Strip,
        edge: &Edge,
        other: &Edge,
        levels: &Levels,
        by_rows: bool,
    ) -> Self {
        let mut acc = [[0f32; LANES]; PAIRS];
        let mut rows = Rows::default();
        let (x_step, skew, form) = (1.0 / edge.profile.h, edge.skew(other), other.form(edge.steep));
        let width = (LANES * strip.blocks) as f32;
        for i in 0..strip.rows {
            let (v, u0) = (strip.v[i], strip.u0[i]);
            let (z, z_end) = (form.at(u0, v), form.at(u0 + width, v));
            // the other profile is ±1 in the whole row: most rows
            let far = z * z_end > 0.0 && z.abs() >= 1.0 && z_end.abs() >= 1.0;
            let centre = edge.u(v);
            let before = [acc[pair(O, R)], acc[pair(O, O)]];
            for (b, pixels) in strip.row(i).iter().enumerate() {
                let u = u0 + (LANES * b) as f32;
                let line = Line {
                    v,
                    x: (u - centre) * x_step,
                    x_step,
                    z: if far { z.signum() } else { form.at(u, v) },
                    z_step: form.by_u,
                    mean: levels.mean + levels.mean_gradient[0] * u + levels.mean_gradient[1] * v,
                    amplitude: 1.0 + levels.amplitude_gradient[0] * u + levels.amplitude_gradient[1] * v,
                    skew,
                };
                if far {
                    add_block::<FULL, false>(&mut acc, pixels, edge, other, levels, &line);
                } else {
                    add_block::<FULL, true>(&mut acc, pixels, edge, other, levels, &line);
                }
            }
            if FULL && by_rows && far {
                rows.add(v, since(&before[0], &acc[pair(O, R)]), since(&before[1], &acc[pair(O, O)]));
            }
        }
        let mut pairs = acc.map(|lanes| f64::from(lanes.iter().sum::<f32>()));
        pairs[pair(M, M)] = (strip.rows * strip.blocks * LANES) as f64;
        let s2 = edge.s * edge.s;
        Self { pairs, blur_factor: -f64::from(s2 / (edge.sd() * edge.sd())), rows }
    }

    fn of_pair(&self, i: usize, j: usize) -> f64 {
        self.pairs[pair(i, j)]
    }
}

/// What the lanes of a sum have grown by, in pairs, as vectors are added up.
#[inline(always)]
fn since(before: &Block, now: &Block) -> f32 {
    const { assert!(LANES == 8) };
    let mut four = [0f32; 4];
    for l in 0..4 {
        four[l] = (now[l] - before[l]) + (now[l + 4] - before[l + 4]);
    }
    (four[0] + four[2]) + (four[1] + four[3])
}

/// Adds eight pixels. `CROSS`: the other edge varies within them.
#[inline(always)]
fn add_block<const FULL: bool, const CROSS: bool>(
    acc: &mut [Block; PAIRS],
    pixels: &Block,
    edge: &Edge,
    other: &Edge,
    levels: &Levels,
    line: &Line,
) {
    for l in 0..LANES {
        let lane = l as f32;
        let x = limit(fma(line.x_step, lane, line.x), 1.0);
        let (p1, d1) = edge.profile.at(x);
        let factor = fma(levels.amplitude_gradient[0], lane, line.amplitude);
        let (p2, by_a);
        if CROSS {
            let z = limit(fma(line.z_step, lane, line.z), 1.0);
            let (value, slope) = other.profile.at(z);
            p2 = value * factor;
            by_a = fma(p1, p2, line.skew * d1 * slope * factor);
        } else {
            p2 = line.z * factor;
            by_a = p1 * p2;
        }
        let o = levels.jacobian * p2 * d1;
        let p = o * line.v;
        let r = pixels[l] - fma(levels.mean_gradient[0], lane, line.mean) - levels.amplitude * by_a;
        let mut add = |i: usize, j: usize, a: f32, b: f32| acc[pair(i, j)][l] = fma(a, b, acc[pair(i, j)][l]);
        add(O, O, o, o);
        add(O, P, o, p);
        add(O, A, o, by_a);
        add(O, R, o, r);
        add(P, P, p, p);
        add(P, A, p, by_a);
        add(P, R, p, r);
        add(A, A, by_a, by_a);
        add(A, R, by_a, r);
        if FULL {
            let s = x * o;
            add(O, S, o, s);
            add(P, S, p, s);
            add(S, S, s, s);
            add(S, A, s, by_a);
            add(S, R, s, r);
            add(R, R, r, r);
            acc[pair(S, M)][l] += s;
        }
        acc[pair(O, M)][l] += o;
        acc[pair(P, M)][l] += p;
        acc[pair(M, A)][l] += by_a;
        acc[pair(M, R)][l] += r;
    }
}

/// How the blur of an edge enters the system.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Blur {
    /// Not an unknown.
    Fixed,
    /// An unknown that may only grow: it is at its lower bound.
    AtBound,
    /// An unknown.
    Free,
}

type Matrix = [[f64; 8]; 8];
/// A vector of the eight unknowns.
pub(super) type Unknowns = [f64; 8];

/// Normal equations of both edges.
#[derive(Default)]
pub(super) struct System {
    matrix: Matrix,
    right: Unknowns,
    /// Residual sum of squares before the step.
    pub(super) rss: f64,
    /// Pixels, those of the crossing counted twice.
    pub(super) pixels: f64,
    rows: [Rows; 2],
}

impl System {
    /// Adds the sums of the strip along edge `k`.
    pub(super) fn add(&mut self, k: usize, t: &Sums, blur: Blur) {
        let (o, p, s, m, a) = (3 * k, 3 * k + 1, 3 * k + 2, 6, 7);
        let matrix = &mut self.matrix; // lower triangle
        matrix[o][o] = t.of_pair(O, O);
        matrix[p][o] = t.of_pair(O, P);
        matrix[p][p] = t.of_pair(P, P);
        matrix[m][o] = t.of_pair(O, M);
        matrix[m][p] = t.of_pair(P, M);
        matrix[a][o] = t.of_pair(O, A);
        matrix[a][p] = t.of_pair(P, A);
        matrix[m][m] += t.of_pair(M, M);
        matrix[a][m] += t.of_pair(M, A);
        matrix[a][a] += t.of_pair(A, A);
        self.right[o] = t.of_pair(O, R);
        self.right[p] = t.of_pair(P, R);
        self.right[m] += t.of_pair(M, R);
        self.right[a] += t.of_pair(A, R);
        self.rows[k] = t.rows;
        self.rss += t.of_pair(R, R);
        self.pixels += t.of_pair(M, M);
        let f = t.blur_factor;
        // a bound that is active leaves the system: clamping the joint step afterwards would shift the position
        let fixed = match blur {
            Blur::Fixed => true,
            Blur::AtBound => f * t.of_pair(S, R) < 0.0,
            Blur::Free => false,
        };
        if fixed {
            matrix[s][s] = 1.0;
        } else {
            matrix[s][o] = f * t.of_pair(O, S);
            matrix[s][p] = f * t.of_pair(P, S);
            matrix[s][s] = 1.01 * f * f * t.of_pair(S, S); // a little damping: s is the least linear unknown
            matrix[m][s] = f * t.of_pair(S, M);
            matrix[a][s] = f * t.of_pair(S, A);
            self.right[s] = f * t.of_pair(S, R);
        }
    }

    /// Solves for the step; `None` where the pixels do not determine it.
    pub(super) fn solve(mut self) -> Option<Solution> {
        for i in 0..8 {
            self.matrix[i][i] += 1e-9 + 1e-7 * self.matrix[i][i];
        }
        let factor = Factor::new(self.matrix)?;
        let mut step = self.right;
        factor.solve(&mut step);
        let gain: f64 = step.iter().zip(&self.right).map(|(x, b)| x * b).sum();
        let variance = ((self.rss - gain) / (self.pixels - 8.0)).max(ROUNDING);
        Some(Solution { step, factor, variance, rows: self.rows })
    }
}

/// A Gauss–Newton step and what its covariance needs.
pub(super) struct Solution {
    pub(super) step: Unknowns,
    factor: Factor,
    /// Variance of the residuals after the step (valid where the blur was in the sums).
    pub(super) variance: f64,
    rows: [Rows; 2],
}

impl Solution {
    /// What the covariance of a corner is made of; `places[k]` is the place of edge k by the unknowns, of which only its own count.
    pub(super) fn scatter(&self, places: &[Unknowns; 2], corner_from_places: Matrix2<f64>) -> Scatter {
        let mut w = *places;
        for w in &mut w {
            self.factor.solve(w);
        }
        let dot = |i: usize, j: usize| -> f64 { places[i].iter().zip(&w[j]).map(|(a, b)| a * b).sum() };
        Scatter {
            unit: [dot(0, 0), dot(0, 1), dot(1, 1)],
            white: self.variance,
            rows: [0, 1].map(|k| self.rows[k].variance([w[k][3 * k], w[k][3 * k + 1]])),
            corner_from_places,
        }
    }
}

/// Lower Cholesky factor with its diagonal inverted.
struct Factor(Matrix);

impl Factor {
    fn new(mut a: Matrix) -> Option<Self> {
        for j in 0..8 {
            let mut d = a[j][j];
            for k in 0..j {
                d -= a[j][k] * a[j][k];
            }
            if d.is_nan() || d <= 1e-12 {
                return None;
            }
            a[j][j] = 1.0 / d.sqrt();
            for i in j + 1..8 {
                let mut s = a[i][j];
                for k in 0..j {
                    s -= a[i][k] * a[j][k];
                }
                a[i][j] = s * a[j][j];
            }
        }
        Some(Self(a))
    }

    fn solve(&self, b: &mut Unknowns) {
        let a = &self.0;
        for i in 0..8 {
            let mut s = b[i];
            for k in 0..i {
                s -= a[i][k] * b[k];
            }
            b[i] = s * a[i][i];
        }
        for i in (0..8).rev() {
            let mut s = b[i];
            for k in i + 1..8 {
                s -= a[k][i] * b[k];
            }
            b[i] = s * a[i][i];
        }
    }
}
