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
use crate::image::{Plane, Sample};

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

#[cfg(test)]
mod tests {
    use super::*;

    /// A turned checkerboard of squares of about 23 px in whole numbers, so that another language makes the same bytes.
    fn board() -> Plane<u8> {
        Plane::from_fn(96, 80, |x, y| {
            let white = |s: &i64| {
                let (u, v) = (8 * x as i64 + 2 * (s % 4) + 1 - 88, 8 * y as i64 + 2 * (s / 4) + 1 - 72); // ⅛ px
                let unit = 8 * 23 * 256;
                let (i, j) = ((250 * u + 40 * v).div_euclid(unit), (-40 * u + 240 * v).div_euclid(unit));
                (i + j).rem_euclid(2) == 1
            };
            25 + 13 * (0..16).filter(white).count() as u8
        })
    }

    fn start(px: [f64; 2]) -> Start {
        Start { px: px.into(), neighbours: [None; 4] }
    }

    /// Golden figures of OpenCV 5.0.0, with the picture above as the uint8 array `im`:
    /// `cv2.cornerSubPix(im, np.array([[start]], np.float32), (half, half), (-1, -1), (3, 30, 0.001))`
    #[test]
    fn equals_corner_sub_pix() {
        let board = board();
        assert_eq!(board.data().iter().map(|v| u32::from(*v)).sum::<u32>(), 967_983, "not the same picture");
        for (from, half, want) in [
            ([30.0, 36.0], 11, [29.5822, 36.2505]),
            ([30.0, 36.0], 7, [29.5882, 36.2425]),
            ([30.0, 36.0], 3, [29.5700, 36.2651]),
            ([53.0, 40.0], 11, [52.5553, 40.0620]),
            ([53.0, 40.0], 7, [52.5532, 40.0709]),
            ([26.0, 60.0], 11, [25.7586, 60.1614]),
            ([49.0, 64.0], 7, [48.6871, 63.9243]),
            // the window of 11 leaves the picture: the border is replicated
            ([72.0, 67.0], 11, [71.6473, 67.7318]),
            ([72.0, 67.0], 3, [71.6331, 67.6975]),
        ] {
            let got = refine(&board, &[start(from)], Window::Half(half))[0];
            assert!((got - Vector2::from(want)).amax() < 1e-3, "{from:?} {half}: {got} instead of {want:?}");
        }
    }

    #[test]
    fn adaptive_windows_stay_short_of_the_next_corner() {
        let starts: Vec<Start> = (0..3)
            .map(|i: u32| {
                let px = Vector2::new(10.0 + [0.0, 15.0, 80.0][i as usize], 10.0);
                Start { px, neighbours: [i.checked_sub(1), (i < 2).then_some(i + 1), None, Some(77)] }
            })
            .collect();
        assert_eq!([0, 1, 2].map(|i| Window::Adaptive.half(&starts, i)), [7, 7, 11]);
    }

    #[test]
    fn hopeless_starts_come_back_unchanged() {
        let flat = Plane::from_fn(40, 30, |_, _| 9u8);
        for px in [[20.0, 15.0], [-3.0, 5.0], [400.0, 5.0], [f64::NAN, 5.0], [f64::INFINITY, 0.0]] {
            for picture in [&flat, &Plane::new(1, 1), &Plane::new(0, 0)] {
                let got = refine(picture, &[start(px)], Window::Half(11))[0];
                assert!(got == Vector2::from(px) || px[0].is_nan() && got.x.is_nan(), "{px:?} {got}");
            }
        }
        assert!(refine(&flat, &[start([20.0, 15.0])], Window::Half(0)).len() == 1);
    }

    #[test]
    fn smoothing_keeps_the_mean_and_spreads_a_point_as_a_gaussian() {
        let point = Plane::from_fn(41, 41, |x, y| if (x, y) == (20, 20) { 60_000u16 } else { 0 });
        let s = smooth(&point, 2.0);
        let total: f64 = s.data().iter().map(|v| f64::from(*v)).sum();
        assert!((total / 60_000.0 - 1.0).abs() < 2e-3, "{total}");
        let ratio = f64::from(s.at(22, 20)) / f64::from(s.at(20, 20));
        assert!((ratio - (-0.5f64).exp()).abs() < 1e-3, "{ratio}");
        for sigma in [0.0, -1.0, f64::NAN] {
            assert_eq!(smooth(&point, sigma), point);
        }
        assert_eq!(smooth(&Plane::<u8>::new(0, 0), 1.0).data().len(), 0);
        assert_eq!(smooth(&Plane::from_fn(5, 5, |_, _| 200u8), 1e9).at(2, 2), 200);
    }
}
