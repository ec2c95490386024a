//! Positions along a row of the output as curves.

use super::map::ONE;
use crate::camera::LANES;

/// Pixels between two nodes of a row.
pub(super) const STEP: usize = 2 * LANES;

/// Adding it leaves an integer in the low bits of the sum: rounding that every lane can do.
pub(super) const TO_INTEGER: f64 = 6_755_399_441_055_744.0; // 1.5 · 2⁵²

/// As [`TO_INTEGER`]: wide enough, for a curve stays within 136 px of its first node.
const TO_INTEGER_F32: f32 = 12_582_912.0; // 1.5 · 2²³

/// Positions of one row: from node to node a cubic, or where that would not be exact one position a pixel.
#[derive(Clone, Debug, Default)]
pub(super) struct Course {
    /// Whether the curves stand for the model, step by step.
    smooth: Vec<bool>,
    /// Of x, of y.
    curves: [Curves; 2],
    /// x and y of the pixels of the steps that are not smooth.
    exact: Vec<[[i32; STEP]; 2]>,
}

impl Course {
    /// Fits the curves to nodes of which the first is one step before the row, px; `within` says which of them may be shown, `last`
    /// are the centres of the last pixels of the photograph. `exact` gives the pixels of a step that no curve describes.
    #[inline(always)]
    pub(super) fn fit(
        &mut self,
        nodes: &[Vec<f64>; 2],
        within: &[bool],
        last: [f64; 2],
        steps: usize,
        exact: impl Fn(usize, &mut [i32; STEP], &mut [i32; STEP]),
    ) {
        // Node 1 is the first pixel.
        self.smooth.clear();
        self.smooth.extend(within.windows(2).skip(1).map(|w| w[0] & w[1]));
        for (axis, curves) in self.curves.iter_mut().enumerate() {
            curves.resize(steps.next_multiple_of(LANES));
            curves.fit(&nodes[axis], last[axis], &mut self.smooth);
        }
        self.exact.clear();
        for k in (0..steps).filter(|k| !self.smooth[*k]) {
            let [mut xs, mut ys] = [[0; STEP]; 2];
            exact(k, &mut xs, &mut ys);
            self.exact.push([xs, ys]);
        }
    }

    /// All pixels, in fixed point.
    #[inline(always)]
    pub(super) fn fill(&self, xs: &mut [[i32; STEP]], ys: &mut [[i32; STEP]]) {
        let mut exact = self.exact.iter();
        let steps = xs.chunks_mut(LANES).zip(ys.chunks_mut(LANES)).zip(self.smooth.chunks(LANES));
        let [across, along] =
            self.curves.each_ref().map(|c| c.base.as_chunks::<LANES>().0.iter().zip(&c.rest));
        for (((xs, ys), smooth), (across, along)) in steps.zip(across.zip(along)) {
            for (l, ((xs, ys), smooth)) in xs.iter_mut().zip(ys).zip(smooth).enumerate().take(LANES) {
                if *smooth {
                    fill(across, l, xs);
                    fill(along, l, ys);
                } else if let Some([x, y]) = exact.next() {
                    (*xs, *ys) = (*x, *y);
                }
            }
        }
    }
}

/// Cubics from node to node of a row.
#[derive(Clone, Debug, Default)]
struct Curves {
    /// The whole part at the first node in fixed point, less what [`TO_INTEGER_F32`] adds.
    base: Vec<i32>,
    /// The rest, and the differences of nodes 0, 2, 3 to node 1, in fixed point.
    rest: Vec<[[f32; LANES]; 4]>,
}

impl Curves {
    fn resize(&mut self, steps: usize) {
        self.base.resize(steps, 0);
        self.rest.resize(steps / LANES, [[0.0; LANES]; 4]);
    }

    /// Fits the cubics through nodes 0 to 3 that fill the pixels between nodes 1 and 2 of each five. `smooth` becomes false where that
    /// could be off by more than 2.4e-5 px (less than the fixed point), or a position be outside of `0..=last`.
    ///
    /// The error of the cubic is at most 3/128 of the fourth difference (Newton's interpolation).
    #[inline(always)]
    fn fit(&mut self, nodes: &[f64], last: f64, smooth: &mut [bool]) {
        const MOST: f64 = 1e-3;
        let to = self.base.as_chunks_mut::<LANES>().0.iter_mut().zip(&mut self.rest);
        let from = nodes.windows(LANES + 4).step_by(LANES).zip(smooth.chunks_mut(LANES));
        for ((base, [rest, to_a, to_c, to_d]), (nodes, smooth)) in to.zip(from) {
            let mut shifted = [[0.0; LANES]; 5];
            for (k, shifted) in shifted.iter_mut().enumerate() {
                shifted.copy_from_slice(&nodes[k..k + LANES]);
            }
            let [a, b, c, d, e] = shifted;
            // Selected, not branched, so that all lanes go together.
            let mut bad = [0.0; LANES];
            for l in 0..LANES {
                let (bend, next) = (a[l] - 2.0 * b[l] + c[l], b[l] - 2.0 * c[l] + d[l]);
                let fourth = bend - 2.0 * next + (c[l] - 2.0 * d[l] + e[l]);
                bad[l] = if fourth.abs() <= MOST { 0.0 } else { 1.0 };
                // Between b and c it leaves their chord by at most an eighth of the larger second difference.
                bad[l] = if bend.abs() <= 8.0 { bad[l] } else { 1.0 };
                bad[l] = if next.abs() <= 8.0 { bad[l] } else { 1.0 };
                bad[l] = if (c[l] - b[l]).abs() <= 128.0 { bad[l] } else { 1.0 };
                for p in [b[l], c[l]] {
                    bad[l] = if p >= 1.0 { bad[l] } else { 1.0 };
                    bad[l] = if p <= last - 1.0 { bad[l] } else { 1.0 };
                }
            }
            let mut whole = [0.0; LANES];
            for l in 0..LANES {
                whole[l] = b[l] * f64::from(ONE) + TO_INTEGER;
                rest[l] = (b[l] * f64::from(ONE) - (whole[l] - TO_INTEGER)) as f32;
                to_a[l] = ((a[l] - b[l]) * f64::from(ONE)) as f32;
                to_c[l] = ((c[l] - b[l]) * f64::from(ONE)) as f32;
                to_d[l] = ((d[l] - b[l]) * f64::from(ONE)) as f32;
            }
            for l in 0..LANES {
                base[l] = (whole[l].to_bits() as i32).wrapping_sub(TO_INTEGER_F32.to_bits() as i32);
            }
            for (smooth, bad) in smooth.iter_mut().zip(bad) {
                *smooth &= bad == 0.0;
            }
        }
    }
}

/// The pixels of step `l` of eight in fixed point.
#[inline(always)]
fn fill((base, rest): (&[i32; LANES], &[[f32; LANES]; 4]), l: usize, out: &mut [i32; STEP]) {
    // Lagrange's weights of nodes 0, 2, 3; with differences to node 1 its own is not needed.
    const WEIGHTS: [[f32; STEP]; 3] = {
        let mut w = [[0.0; STEP]; 3];
        let mut i = 0;
        while i < STEP {
            let t = i as f32 / STEP as f32;
            w[0][i] = -t * (t - 1.0) * (t - 2.0) / 6.0;
            w[1][i] = -(t + 1.0) * t * (t - 2.0) / 2.0;
            w[2][i] = (t + 1.0) * t * (t - 1.0) / 6.0;
            i += 1;
        }
        w
    };
    let (base, [rest, a, c, d]) = (base[l], rest.map(|lanes| lanes[l]));
    for i in 0..STEP {
        let sum = WEIGHTS[0][i] * a + WEIGHTS[1][i] * c + WEIGHTS[2][i] * d;
        out[i] = base.wrapping_add((sum + rest + TO_INTEGER_F32).to_bits() as i32);
    }
}
