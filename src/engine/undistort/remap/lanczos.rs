//! Lanczos interpolation, a = 3: L(x) = sinc(x) · sinc(x/3) over 6 × 6 pixels.
//!
//! C. E. Duchon, "Lanczos Filtering in One and Two Dimensions", Journal of Applied Meteorology 18, 1979, pp. 1016–1022.
//!
//! The plain weights move a soft edge by up to 0.02 px. The two in the middle are corrected such that `Σ w = 1` and
//! `Σ w x = 0`: constants and ramps come out exactly, and edges stay where they are.

use super::{FRACTION_BITS, INVALID, ONE, Row, Sample, Source};

const TAPS: usize = 6;
/// Fraction bits of the weight table: the position is rounded to 1/1024 px.
const PHASE_BITS: u32 = 10;

/// Weights of the six taps for each fraction.
pub(super) struct Kernel {
    weights: Vec<[f32; TAPS]>,
}

impl Kernel {
    pub(super) fn new() -> Self {
        let sinc = |x: f64| {
            if x == 0.0 { 1.0 } else { (std::f64::consts::PI * x).sin() / (std::f64::consts::PI * x) }
        };
        let phases = 1 << PHASE_BITS;
        let weights = (0..=phases)
            .map(|i| {
                let t = f64::from(i) / f64::from(phases);
                let x: [f64; TAPS] = std::array::from_fn(|k| k as f64 - 2.0 - t);
                let mut w = x.map(|x| if x.abs() < 3.0 { sinc(x) * sinc(x / 3.0) } else { 0.0 });
                let missing = 1.0 - w.iter().sum::<f64>();
                let moment: f64 = w.iter().zip(&x).map(|(w, x)| w * x).sum();
                let right = t * missing - moment;
                w[2] += missing - right;
                w[3] += right;
                w.map(|w| w as f32)
            })
            .collect();
        Self { weights }
    }

    #[inline(always)]
    fn at(&self, fraction: i32) -> &[f32; TAPS] {
        let shift = FRACTION_BITS - PHASE_BITS;
        &self.weights[((fraction + (1 << (shift - 1))) >> shift) as usize]
    }
}

/// One row of the output, `C` samples a pixel. Beyond the border of the source its outermost pixels repeat.
#[inline(always)]
pub(super) fn row<T: Sample, const C: usize>(
    source: &Source<'_, T>,
    row: &Row,
    kernel: &Kernel,
    out: &mut [T],
) {
    let (w, h) = (source.width, source.height);
    for ((out, &x), &y) in out.as_chunks_mut::<C>().0.iter_mut().zip(&row.x).zip(&row.y) {
        if x == INVALID {
            *out = [T::default(); C];
            continue;
        }
        let (column, line) = ((x >> FRACTION_BITS) as usize, (y >> FRACTION_BITS) as usize);
        let (wx, wy) = (kernel.at(x & (ONE - 1)), kernel.at(y & (ONE - 1)));
        let mut sum = [0.0f32; C];
        if column >= 2 && column + 3 < w && line >= 2 && line + 3 < h {
            let mut start = ((line - 2) * w + column - 2) * C;
            for weight in wy {
                let taps = source.samples[start..start + TAPS * C].as_chunks::<C>().0;
                let mut line_sum = [0.0f32; C];
                for (tap, wx) in taps.iter().zip(wx) {
                    for c in 0..C {
                        line_sum[c] += wx * tap[c].to_f32();
                    }
                }
                for c in 0..C {
                    sum[c] += weight * line_sum[c];
                }
                start += w * C;
            }
        } else {
            for (j, wy) in wy.iter().enumerate() {
                let y = (line + j).saturating_sub(2).min(h - 1);
                for (i, wx) in wx.iter().enumerate() {
                    let x = (column + i).saturating_sub(2).min(w - 1);
                    for c in 0..C {
                        sum[c] += wy * wx * source.samples[(y * w + x) * C + c].to_f32();
                    }
                }
            }
        }
        *out = sum.map(T::from_f32);
    }
}
