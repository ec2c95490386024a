//! Blur of pictures; borders are continued.

use crate::image::Plane;

/// Convolves with the discrete Gaussian of variance `sigma_px²` in both directions.
///
/// Its weights `e^(−t) I_n(t)`, t = σ², have exactly that variance at every σ, which samples of the bell curve have
/// not for σ < 0.6 (T. Lindeberg, "Scale-space for discrete signals", PAMI 12, 1990).
pub(super) fn gaussian(picture: &Plane<f32>, sigma_px: f64) -> Plane<f32> {
    let kernel = discrete_gaussian(sigma_px * sigma_px);
    let (w, h, r) = (picture.width(), picture.height(), kernel.len() - 1);
    if w == 0 || h == 0 {
        return picture.clone();
    }
    let mut across = Plane::new(w, h);
    let mut padded = vec![0.0; w + 2 * r];
    for y in 0..h {
        let row = picture.row(y);
        padded[..r].fill(row[0]);
        padded[r..r + w].copy_from_slice(row);
        padded[r + w..].fill(row[w - 1]);
        for (x, out) in across.row_mut(y).iter_mut().enumerate() {
            let sides: f32 = (1..=r).map(|k| kernel[k] * (padded[x + r - k] + padded[x + r + k])).sum();
            *out = kernel[0] * padded[x + r] + sides;
        }
    }
    let mut out = Plane::new(w, h);
    for y in 0..h {
        let target = out.row_mut(y);
        target.iter_mut().zip(across.row(y)).for_each(|(t, v)| *t = kernel[0] * v);
        for k in 1..=r {
            let (above, below) = (across.row(y.saturating_sub(k)), across.row((y + k).min(h - 1)));
            for (x, t) in target.iter_mut().enumerate() {
                *t += kernel[k] * (above[x] + below[x]);
            }
        }
    }
    out
}

/// Weights at 0, 1, 2, … of the discrete Gaussian of variance `t`, cut where they vanish in 32 bits.
fn discrete_gaussian(t: f64) -> Vec<f32> {
    let radius = (1.0 + 5.5 * t.sqrt()).ceil() as usize;
    // Backward recurrence I_{n−1} = I_{n+1} + (2n/t) I_n from far out (Miller), normalised to sum 1.
    let far = radius + 20;
    let (mut above, mut here) = (0.0f64, 1e-280f64);
    let mut weights = vec![0.0; radius + 1];
    for n in (0..=far).rev() {
        if n <= radius {
            weights[n] = here;
        }
        if here > 1e200 {
            weights.iter_mut().for_each(|w| *w *= 1e-300);
            above *= 1e-300;
            here *= 1e-300;
        }
        let below = above + 2.0 * n as f64 / t * here;
        (above, here) = (here, below);
    }
    let sum: f64 = weights[0] + 2.0 * weights[1..].iter().sum::<f64>();
    weights.iter().map(|w| (w / sum) as f32).collect()
}

/// Mean along a straight path of `length_px` centred on each pixel, `angle_deg` from x towards y.
pub(super) fn motion(picture: &Plane<f32>, length_px: f64, angle_deg: f64) -> Plane<f32> {
    let (w, h) = (picture.width(), picture.height());
    if w == 0 || h == 0 {
        return picture.clone();
    }
    let (sin, cos) = angle_deg.to_radians().sin_cos();
    let n = (2.0 * length_px).ceil().max(1.0) as usize;
    let border = (length_px / 2.0) as usize + 2;
    let padded = Plane::from_fn(w + 2 * border, h + 2 * border, |x, y| {
        picture.at(x.saturating_sub(border).min(w - 1), y.saturating_sub(border).min(h - 1))
    });
    // Each step of the path is the same for all pixels: a shift by whole pixels and a bilinear fraction.
    let mut out = Plane::new(w, h);
    for i in 0..n {
        let s = length_px * ((i as f64 + 0.5) / n as f64 - 0.5);
        let (dx, dy) = (s * cos, s * sin);
        let (fx, fy) = ((dx - dx.floor()) as f32, (dy - dy.floor()) as f32);
        let shift = |d: f64| (border as i64 + d.floor() as i64) as usize;
        let (left, above) = (shift(dx), shift(dy));
        let share = 1.0 / n as f32;
        let weights = [(1.0 - fx) * (1.0 - fy), fx * (1.0 - fy), (1.0 - fx) * fy, fx * fy].map(|w| w * share);
        for y in 0..h {
            let top = &padded.row(y + above)[left..=left + w];
            let bottom = &padded.row(y + above + 1)[left..=left + w];
            for (x, v) in out.row_mut(y).iter_mut().enumerate() {
                *v += weights[0] * top[x]
                    + weights[1] * top[x + 1]
                    + weights[2] * bottom[x]
                    + weights[3] * bottom[x + 1];
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sum, mean and variance of a picture along x and y.
    fn moments(p: &Plane<f32>) -> (f64, [f64; 2], [f64; 2]) {
        let (mut sum, mut first, mut second) = (0.0, [0.0; 2], [0.0; 2]);
        for y in 0..p.height() {
            for x in 0..p.width() {
                let v = f64::from(p.at(x, y));
                sum += v;
                for (k, c) in [x as f64, y as f64].into_iter().enumerate() {
                    first[k] += v * c;
                    second[k] += v * c * c;
                }
            }
        }
        let mean = first.map(|m| m / sum);
        (sum, mean, [0, 1].map(|k| second[k] / sum - mean[k] * mean[k]))
    }

    fn point() -> Plane<f32> {
        Plane::from_fn(61, 61, |x, y| if (x, y) == (30, 30) { 1.0 } else { 0.0 })
    }

    #[test]
    fn the_gaussian_has_the_asked_width() {
        for sigma in [0.05, 0.3, 0.5, 1.0, 2.0, 4.0] {
            let (sum, mean, variance) = moments(&gaussian(&point(), sigma));
            assert!((sum - 1.0).abs() < 1e-5 && mean.iter().all(|m| (m - 30.0).abs() < 1e-5));
            for v in variance {
                assert!((v / (sigma * sigma) - 1.0).abs() < 2e-3, "σ {sigma}: {v}");
            }
        }
    }

    #[test]
    fn motion_smears_along_its_direction_only() {
        let (sum, mean, [vx, vy]) = moments(&motion(&point(), 9.0, 0.0));
        assert!((sum - 1.0).abs() < 1e-5 && (mean[0] - 30.0).abs() < 1e-4);
        // A box of 9 px, and linear interpolation at half a pixel adds 1/16 … 1/6.
        assert!((vx - 81.0 / 12.0).abs() < 0.3 && vy.abs() < 1e-6, "{vx} {vy}");
        let (_, _, [vx, vy]) = moments(&motion(&point(), 9.0, 45.0));
        assert!((vx - vy).abs() < 1e-3);
    }
}
