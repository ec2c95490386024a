//! Sub-pixel corners from gradients alone: the classical refiner, kept to be measured against.
//!
//! At a corner c every gradient g(q) nearby is orthogonal to q − c, because it is non-zero only on edges through c:
//!
//! ```text
//! Σ w(q) g gᵀ (q − c) = 0,     w = exp(−(x² + y²)/half²)
//! ```
//!
//! is solved for c and repeated around the result (Förstner & Gülch 1987; `cv::cornerSubPix`, whose answers it reproduces).

use nalgebra::Vector2;

use super::strip::Start;
use crate::calib::image::{Plane, Sample};

const ITERATIONS: usize = 30;
/// The iteration ends at a smaller step, px.
const STILL: f32 = 0.001;

/// Half size of the window: it has `2 half + 1` pixels a side.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Window {
    /// The same at every corner; 0 counts as 1.
    Half(usize),
    /// Half the distance to the nearest neighbour, from 3 to 11 px: it never reaches the next corner.
    Adaptive,
}

impl Window {
    fn half(self, starts: &[Start], i: usize) -> usize {
        match self {
            Self::Half(half) => half.clamp(1, 255),
            Self::Adaptive => {
                let distance =
                    |j: &u32| starts.get(*j as usize).map_or(f64::INFINITY, |s| (s.px - starts[i].px).norm());
                let nearest = starts[i].neighbours.iter().flatten().map(distance).fold(22.0, f64::min);
                (0.5 * nearest).clamp(3.0, 11.0) as usize
            }
        }
    }
}

/// Refines corners by the orthogonality of gradients; a start that the iteration leaves by more than its window, or that
/// lies outside the picture, comes back unchanged.
pub fn refine<T: Sample>(picture: &Plane<T>, starts: &[Start], window: Window) -> Vec<Vector2<f64>> {
    (0..starts.len()).map(|i| refine_one(picture, starts[i].px, window.half(starts, i))).collect()
}

fn refine_one<T: Sample>(picture: &Plane<T>, start: Vector2<f64>, half: usize) -> Vector2<f64> {
    let (n, reach) = (2 * half + 1, half as f32);
    let weight: Vec<f32> = (0..n).map(|i| (-((i as f32 - reach) / reach).powi(2)).exp()).collect();
    let mut patch = vec![0f32; (n + 2) * (n + 2)];
    let mut c = start.map(|v| v as f32);
    let inside = |c: &Vector2<f32>| {
        c.x >= 0.0 && c.y >= 0.0 && c.x < picture.width() as f32 && c.y < picture.height() as f32
    };
    if !inside(&c) {
        return start; // NaN too
    }
    for _ in 0..ITERATIONS {
        sample_patch(picture, c, half, &mut patch);
        let (mut gxx, mut gxy, mut gyy, mut bx, mut by) = (0f64, 0f64, 0f64, 0f64, 0f64);
        for i in 0..n {
            let at = |row: usize, column: usize| patch[row * (n + 2) + column];
            for j in 0..n {
                let gx = f64::from(at(i + 1, j + 2) - at(i + 1, j));
                let gy = f64::from(at(i + 2, j + 1) - at(i, j + 1));
                let w = f64::from(weight[i] * weight[j]);
                let (xx, xy, yy) = (gx * gx * w, gx * gy * w, gy * gy * w);
                let (x, y) = (j as f64 - half as f64, i as f64 - half as f64);
                gxx += xx;
                gxy += xy;
                gyy += yy;
                bx += xx * x + xy * y;
                by += xy * x + yy * y;
            }
        }
        let det = gxx * gyy - gxy * gxy;
        if det.abs() <= f64::EPSILON * f64::EPSILON {
            break;
        }
        let step = Vector2::new((gyy * bx - gxy * by) / det, (gxx * by - gxy * bx) / det).map(|v| v as f32);
        c += step;
        if !inside(&c) || step.norm() <= STILL {
            break;
        }
    }
    let moved = (c.map(f64::from) - start).amax();
    if moved <= half as f64 { c.map(f64::from) } else { start }
}

/// Bilinear samples of the window and one pixel around it; the border is replicated.
fn sample_patch<T: Sample>(picture: &Plane<T>, c: Vector2<f32>, half: usize, patch: &mut [f32]) {
    let side = 2 * half + 3;
    let corner = c.map(|v| v - (half + 1) as f32);
    let (x0, y0) = (corner.x.floor(), corner.y.floor());
    let (a, b) = (corner.x - x0, corner.y - y0);
    let clamp = |v: i64, size: usize| v.clamp(0, size as i64 - 1) as usize;
    for i in 0..side {
        let y = y0 as i64 + i as i64;
        let rows = [y, y + 1].map(|y| picture.row(clamp(y, picture.height())));
        for j in 0..side {
            let x = x0 as i64 + j as i64;
            let (l, r) = (clamp(x, picture.width()), clamp(x + 1, picture.width()));
            let [top, bottom] = rows.map(|row| (1.0 - a) * row[l].to_f32() + a * row[r].to_f32());
            patch[i * side + j] = (1.0 - b) * top + b * bottom;
        }
    }
}

/// A picture smoothed by a Gaussian of width `sigma` px (to ±4σ, border replicated); σ ≤ 0 or NaN returns it unchanged.
pub fn smooth<T: Sample>(picture: &Plane<T>, sigma: f64) -> Plane<T> {
    if sigma.is_nan() || sigma <= 0.0 {
        return picture.clone();
    }
    smooth_levels(&picture.map(T::to_f32), sigma).map(T::from_f32)
}

/// [`smooth`] without rounding.
pub(super) fn smooth_levels(picture: &Plane<f32>, sigma: f64) -> Plane<f32> {
    let sigma = sigma.min(100.0);
    let reach = (4.0 * sigma).ceil() as i64;
    let kernel: Vec<f32> =
        (-reach..=reach).map(|i| (-0.5 * (i as f64 / sigma).powi(2)).exp() as f32).collect();
    let total: f32 = kernel.iter().sum();
    let (w, h) = (picture.width(), picture.height());
    let clamp = |v: i64, size: usize| v.clamp(0, size as i64 - 1) as usize;
    let sum = |at: &dyn Fn(i64) -> f32| -> f32 {
        kernel.iter().enumerate().map(|(i, k)| k * at(i as i64 - reach)).sum::<f32>() / total
    };
    let across = Plane::from_fn(w, h, |x, y| {
        let row = picture.row(y);
        sum(&|d| row[clamp(x as i64 + d, w)])
    });
    Plane::from_fn(w, h, |x, y| sum(&|d| across.at(x, clamp(y as i64 + d, h))))
}
