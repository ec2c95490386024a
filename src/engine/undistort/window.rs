//! The view of the output: a window in the plane of its projection, chosen by α.
//!
//! y is scaled so that the window is a square; then the view for α = 0 is the largest axis-parallel square inside the region
//! (the point whose distance to the border is largest, in the norm max(|x|, |y|)), that for α = 1 the smallest around it.

use std::collections::VecDeque;

use nalgebra::Vector2;

use super::{Map, Projection, View, region::Region};
use crate::{Result, lens::Lens};

/// Centre and half the side of a square in the scaled plane.
#[derive(Clone, Copy, Debug)]
struct Square {
    centre: Vector2<f64>,
    half: f64,
}

/// `fx fy cx cy` of the output.
pub(super) fn intrinsics(
    camera: &dyn Lens,
    projection: Projection,
    region: &Region,
    alpha: f64,
) -> Result<[f64; 4]> {
    let [fx, fy, _, _] = camera.intrinsics();
    let [w, h] = camera.size_px().map(|n| f64::from(n) - 1.0);
    if w == 0.0 || h == 0.0 {
        // A line or a single pixel has no view to fit: the middle stays where it is.
        return Ok([fx, fy, 0.5 * w - fx * region.inside.x, 0.5 * h - fy * region.inside.y]);
    }
    let aspect = (w / fx) / (h / fy);
    let scale = |p: &Vector2<f64>| Vector2::new(p.x, p.y * aspect);
    let border: Vec<Vector2<f64>> = region.border.iter().map(scale).collect();
    let outer = around(&border);
    let mut inner = inside(&border, scale(&region.inside), outer);
    // Chords between border points may leave the region by a hair: no pixel may be black.
    let of_square = |s: Square| {
        let f = 0.5 * w / s.half;
        let fy = f * fy / fx;
        [f, fy, 0.5 * w - f * s.centre.x, 0.5 * h - fy * s.centre.y / aspect]
    };
    for _ in 0..40 {
        let view = View { projection, size_px: camera.size_px(), intrinsics: of_square(inner) };
        if Map::within(camera, &view, region.limit_rad)?.border_is_valid() {
            break;
        }
        inner.half *= 1.0 - 1e-4;
    }
    // Edges move linearly from the one square to the other.
    Ok(of_square(Square {
        centre: inner.centre.lerp(&outer.centre, alpha),
        half: inner.half + (outer.half - inner.half) * alpha,
    }))
}

/// The smallest square that holds all points.
fn around(border: &[Vector2<f64>]) -> Square {
    let first = border.first().copied().unwrap_or_default();
    let low = border.iter().fold(first, |a, b| a.inf(b));
    let high = border.iter().fold(first, |a, b| a.sup(b));
    Square { centre: (low + high) * 0.5, half: 0.5 * (high - low).max() }
}

/// The largest square inside the polygon; where it could be moved without touching the border it is kept near `wish`.
fn inside(border: &[Vector2<f64>], wish: Vector2<f64>, outer: Square) -> Square {
    let clearance = |p: &Vector2<f64>| clearance(border, p);
    // Branch and bound over cells ("pole of inaccessibility"): the clearance changes by at most the way moved.
    let mut best = Square { centre: wish, half: clearance(&wish) };
    let mut cells = VecDeque::from([outer]);
    let precision = 1e-3 * outer.half;
    while let Some(cell) = cells.pop_front() {
        let here = clearance(&cell.centre);
        if here > best.half {
            best = Square { centre: cell.centre, half: here };
        }
        if here + cell.half <= best.half + precision {
            continue;
        }
        let half = 0.5 * cell.half;
        cells.extend(
            [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]]
                .map(|[i, j]| Square { centre: cell.centre + Vector2::new(i, j) * half, half }),
        );
    }
    // The clearance is piecewise linear with slopes along the axes: these eight directions reach its summit.
    let mut step = precision;
    while step > 1e-14 * outer.half {
        let moves = [
            [1.0, 0.0],
            [-1.0, 0.0],
            [0.0, 1.0],
            [0.0, -1.0],
            [1.0, 1.0],
            [1.0, -1.0],
            [-1.0, 1.0],
            [-1.0, -1.0],
        ];
        let better = moves
            .map(|[i, j]| best.centre + Vector2::new(i, j) * step)
            .map(|centre| Square { centre, half: clearance(&centre) })
            .into_iter()
            .max_by(|a, b| a.half.total_cmp(&b.half));
        match better {
            Some(b) if b.half > best.half => best = b,
            _ => step *= 0.5,
        }
    }
    settle(best, wish, &clearance)
}

/// Slides a square along the axis in which it has play towards `wish`.
fn settle(best: Square, wish: Vector2<f64>, clearance: &impl Fn(&Vector2<f64>) -> f64) -> Square {
    let mut square = best;
    let enough = best.half * (1.0 - 1e-9);
    for axis in 0..2 {
        let from = square.centre;
        let at = |t: f64| {
            let mut p = from;
            p[axis] += (wish[axis] - from[axis]) * t;
            p
        };
        let (mut good, mut bad) = (0.0, 1.0);
        if clearance(&at(1.0)) >= enough {
            good = 1.0;
        }
        while good < 1.0 && bad - good > 1e-9 {
            let t = 0.5 * (good + bad);
            if clearance(&at(t)) >= enough { good = t } else { bad = t }
        }
        square.centre = at(good);
    }
    Square { centre: square.centre, half: clearance(&square.centre) }
}

/// Distance to the border in the norm max(|x|, |y|), negative outside: half the side of the largest square around `p`.
fn clearance(border: &[Vector2<f64>], p: &Vector2<f64>) -> f64 {
    let mut within = false;
    let mut nearest = f64::INFINITY;
    let mut a = border.last().copied().unwrap_or_default() - p;
    for b in border {
        let b = b - p;
        if (a.y > 0.0) != (b.y > 0.0) && a.x + (b.x - a.x) * (a.y / (a.y - b.y)) > 0.0 {
            within = !within;
        }
        let length = (b - a).amax();
        if b.amax() - length < nearest {
            nearest = nearest.min(to_segment(&a, &b));
        }
        a = b;
    }
    if within { nearest } else { -nearest }
}

/// Distance of the origin to a segment: the distance is piecewise linear along it, with its kinks where |x| = |y|, x = 0 or
/// y = 0.
fn to_segment(a: &Vector2<f64>, b: &Vector2<f64>) -> f64 {
    let d = b - a;
    let kinks = [(-a.x, d.x), (-a.y, d.y), (a.y - a.x, d.x - d.y), (-a.y - a.x, d.x + d.y)];
    kinks
        .into_iter()
        .filter(|(_, slope)| *slope != 0.0)
        .map(|(value, slope)| (a + d * (value / slope).clamp(0.0, 1.0)).amax())
        .fold(a.amax().min(b.amax()), f64::min)
}
