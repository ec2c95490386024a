//! Curvature of the edges and gradients of the levels, from the neighbouring corners.
//!
//! They are too weak to be fitted at one corner without loss, and biases if left out: a curvature κ shifts a corner by about
//! κ r²/6. The grid gives them for nothing: the second divided difference of u over v along a grid line, and central
//! differences of the mean and the absolute amplitude, averaged over 3 × 3 corners. Corners at the rim take those of their
//! neighbours. One-sided differences are of no use: the fitted mean has a small part that alternates with the polarity.

use nalgebra::{Matrix2, Vector2};

use super::{Start, axes::linked, crossing::Crossing};

/// Largest believable curvature, 1/px: a radius of 100 px.
const LARGEST_CURVATURE: f64 = 0.01;

/// What a corner tells about its surroundings.
#[derive(Clone, Copy)]
struct Knot {
    px: Vector2<f64>,
    mean: f64,
    contrast: f64,
}

/// Sets curvature and gradients of all corners that have been fitted.
pub(super) fn set(corners: &mut [Option<Crossing>], starts: &[Start]) {
    let knots: Vec<Option<Knot>> = corners
        .iter()
        .map(|c| {
            c.as_ref().map(|c| Knot {
                px: c.px(),
                mean: f64::from(c.mean),
                contrast: f64::from(c.amplitude.abs()),
            })
        })
        .collect();
    for (i, corner) in corners.iter_mut().enumerate() {
        let Some(corner) = corner else { continue };
        let around = surroundings(starts, i);
        let mut steps = Matrix2::zeros();
        let (mut by_mean, mut by_contrast) = (Vector2::zeros(), Vector2::zeros());
        for k in 0..2 {
            let (mut n, mut curvature, mut bends) = (0.0, 0.0, 0.0);
            let triple = |&j: &usize| {
                let [before, after] = linked(starts, j, k);
                Some([knots[before?]?, knots[j]?, knots[after?]?])
            };
            for [a, c, b] in around.iter().flatten().filter_map(triple) {
                let step = b.px - a.px;
                steps[(k, 0)] += step.x;
                steps[(k, 1)] += step.y;
                by_mean[k] += b.mean - a.mean;
                by_contrast[k] += b.contrast - a.contrast;
                n += 1.0;
                if let Some(bend) = bend([a.px, c.px, b.px], corner.edges[k].steep) {
                    curvature += bend;
                    bends += 1.0;
                }
            }
            if n == 0.0 {
                continue;
            }
            if bends > 0.0 {
                corner.edges[k].k = (curvature / bends).clamp(-LARGEST_CURVATURE, LARGEST_CURVATURE) as f32;
            }
            steps.set_row(k, &(steps.row(k) / n));
            by_mean[k] /= n;
            by_contrast[k] /= n;
        }
        if steps.determinant().abs() > 1.0
            && let Some(inverse) = steps.try_inverse()
        {
            corner.mean_gradient = (inverse * by_mean).map(|v| v as f32).into();
            let relative = inverse * by_contrast / f64::from(corner.amplitude.abs());
            corner.amplitude_gradient = relative.map(|v| v as f32).into();
        }
    }
}

/// The corner and its up to eight neighbours.
fn surroundings(starts: &[Start], i: usize) -> [Option<usize>; 9] {
    let row = |j: Option<usize>| -> [Option<usize>; 3] {
        let [before, after] = j.map_or([None; 2], |j| linked(starts, j, 0));
        [before, j, after]
    };
    let [above, below] = linked(starts, i, 1);
    let (mut top, mut bottom) = (row(above), row(below));
    // a diagonal may be linked by the other way around only
    for (side, beside) in [(0, linked(starts, i, 0)[0]), (2, linked(starts, i, 0)[1])] {
        let [above, below] = beside.map_or([None; 2], |j| linked(starts, j, 1));
        top[side] = top[side].or(above);
        bottom[side] = bottom[side].or(below);
    }
    let middle = row(Some(i));
    let mut all = [None; 9];
    for (to, from) in all.iter_mut().zip([top, middle, bottom].into_iter().flatten()) {
        *to = from;
    }
    all
}

/// d²u/dv² through three points of a grid line; `None` where the line runs across the frame.
fn bend([a, c, b]: [Vector2<f64>; 3], steep: bool) -> Option<f64> {
    let (u, v) = if steep { (0, 1) } else { (1, 0) };
    let (first, second) = (c - a, b - c);
    let runs = |d: Vector2<f64>| d[v].abs() > 0.5 * d[u].abs();
    let forward = first[v] * second[v] > 0.0 && runs(first) && runs(second);
    forward.then(|| 2.0 * (second[u] / second[v] - first[u] / first[v]) / (first[v] + second[v]))
}
