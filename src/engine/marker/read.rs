//! The bits inside an outline.
//!
//! The border is black, what is outside it white, and light falls evenly from side to side: two planes through both rings turn
//! every cell into a number between 0 and 1, whatever the light. The cells of the code then fall into two classes (N. Otsu,
//! 1979), which must be as black as the border and nearly as bright as the outside. Each cell is sampled at five places: where they
//! disagree, or lie between the classes, the bit is in doubt.

use nalgebra::Vector3;

use super::{
    Reading,
    dictionary::Bits,
    outline::{Chart, bilinear},
};
use crate::image::Plane;

/// Cells along a side and width of the border that are tried, by the cells along both borders and the code.
const LAYOUTS: [(usize, &[(u8, u8)]); 6] = [
    (6, &[(4, 1)]),
    (7, &[(5, 1)]),
    (8, &[(6, 1), (4, 2)]),
    (9, &[(7, 1), (5, 2)]),
    (10, &[(6, 2)]),
    (11, &[(7, 2)]),
];
/// Places in a cell, in cells from its middle.
const PLACES: [(f64, f64); 5] = [(0.0, 0.0), (-0.22, -0.22), (0.22, -0.22), (0.22, 0.22), (-0.22, 0.22)];
/// Where the outside is sampled, in sides of the marker.
const OUTSIDE: f64 = 0.05;
/// How black the code's black cells are at most, and how white the white ones at least and at most; outside is 1.
const BLACK: f32 = 0.3;
const WHITE: std::ops::RangeInclusive<f32> = 0.35..=2.5;
/// Bits nearer than this to the threshold are in doubt, in halves of the difference of both classes.
const DOUBT: f32 = 0.3;
/// Share of the bits that may be in doubt; share of the border's cells that may be as bright as white ones.
const IN_DOUBT: f64 = 0.15;
const BRIGHT_BORDER: f64 = 0.06;

/// Everything that can be read in a chart; nothing where it is no marker. `sign` is 1 where the border is dark, −1 where it is
/// bright; `contrast` is the smallest difference of grey values that means anything.
pub(super) fn read(picture: &Plane<u8>, chart: &Chart, sign: f32, contrast: f32) -> Vec<Reading> {
    let Some(light) = Light::of(picture, chart, sign, contrast) else { return Vec::new() };
    let mut found = Vec::new();
    let mut cells = Vec::with_capacity(121);
    for (total, layouts) in LAYOUTS {
        cells.clear();
        let whole = sample(picture, chart, sign, &light, total, &mut cells);
        if whole.is_none() {
            continue;
        }
        found.extend(layouts.iter().filter_map(|(n, border)| {
            code(&cells, total, usize::from(*n), usize::from(*border)).map(|(bits, clarity)| Reading {
                bits,
                border: *border,
                clarity,
                contrast: light.contrast,
            })
        }));
    }
    found
}

/// Planes of black and of white minus black: `v₀ + v₁ s + v₂ t`.
struct Light {
    black: Vector3<f32>,
    white: Vector3<f32>,
    contrast: f32,
}

impl Light {
    fn of(picture: &Plane<u8>, chart: &Chart, sign: f32, contrast: f32) -> Option<Self> {
        // Inside the border of the markers with the thinnest one, 1/11 of the side.
        let inside = ring(picture, chart, sign, 0.05)?;
        let outside = ring(picture, chart, sign, -OUTSIDE)?;
        let white = outside - inside;
        let corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
        let even = corners.iter().all(|(s, t)| white.dot(&Vector3::new(1.0, *s, *t)) > 0.25 * contrast);
        let mean = white.dot(&Vector3::new(1.0, 0.5, 0.5));
        (even && mean >= contrast).then_some(Self { black: inside, white, contrast: mean })
    }

    fn normal(&self, v: f32, s: f64, t: f64) -> f32 {
        let at = Vector3::new(1.0, s as f32, t as f32);
        (v - self.black.dot(&at)) / self.white.dot(&at).max(1e-3)
    }
}

/// The plane through the medians of the four sides of a ring `depth` sides of the marker inside its outline.
fn ring(picture: &Plane<u8>, chart: &Chart, sign: f32, depth: f64) -> Option<Vector3<f32>> {
    const N: usize = 7;
    let side = |place: &dyn Fn(f64) -> (f64, f64)| -> Option<f32> {
        let mut v = [0f32; N];
        for (i, v) in v.iter_mut().enumerate() {
            let (s, t) = place(0.1 + 0.8 * i as f64 / (N - 1) as f64);
            *v = sign * bilinear(picture, chart.px(s, t))?;
        }
        v.sort_by(f32::total_cmp);
        Some(v[N / 2])
    };
    let [top, right, bottom, left] = [
        side(&|u| (u, depth))?,
        side(&|u| (1.0 - depth, u))?,
        side(&|u| (u, 1.0 - depth))?,
        side(&|u| (depth, u))?,
    ];
    let across = (1.0 - 2.0 * depth) as f32;
    let (by_s, by_t) = ((right - left) / across, (bottom - top) / across);
    Some(Vector3::new(0.25 * (top + right + bottom + left) - 0.5 * (by_s + by_t), by_s, by_t))
}

/// Normalised values at the places of all cells; `None` outside the picture or where the outermost cells are not black.
fn sample(
    picture: &Plane<u8>,
    chart: &Chart,
    sign: f32,
    light: &Light,
    total: usize,
    cells: &mut Vec<[f32; 5]>,
) -> Option<()> {
    let step = 1.0 / total as f64;
    let at = |r: usize, c: usize| -> Option<[f32; 5]> {
        let mut v = [0f32; 5];
        for (v, (ds, dt)) in v.iter_mut().zip(PLACES) {
            let (s, t) = ((c as f64 + 0.5 + ds) * step, (r as f64 + 0.5 + dt) * step);
            *v = light.normal(sign * bilinear(picture, chart.px(s, t))?, s, t);
        }
        Some(v)
    };
    for r in 0..total {
        for c in 0..total {
            cells.push(at(r, c)?);
        }
    }
    Some(())
}

/// The code of `n` × `n` cells within `border` cells of black, and how clear it is; `None` where it is none.
fn code(cells: &[[f32; 5]], total: usize, n: usize, border: usize) -> Option<(Bits, f32)> {
    let mean = |v: &[f32; 5]| v.iter().sum::<f32>() / 5.0;
    let inner = |i: usize| {
        let (r, c) = (i / total, i % total);
        (border..border + n).contains(&r) && (border..border + n).contains(&c)
    };
    let mut values: Vec<f32> = (0..cells.len()).filter(|i| inner(*i)).map(|i| mean(&cells[i])).collect();
    let order = values.clone();
    values.sort_by(f32::total_cmp);
    let (black, white) = classes(&values)?;
    if black.abs() > BLACK || !WHITE.contains(&white) {
        return None;
    }
    let (threshold, half) = (0.5 * (black + white), 0.5 * (white - black));
    if half < 0.15 {
        return None;
    }
    let rim = cells.len() - n * n;
    let bright = (0..cells.len()).filter(|i| !inner(*i) && mean(&cells[*i]) > threshold - 0.2 * half).count();
    if bright as f64 > BRIGHT_BORDER * rim as f64 {
        return None;
    }
    let (mut bits, mut clear) = (Bits { cells: n as u8, code: 0, doubt: 0 }, 0.0);
    let codes = (0..cells.len()).filter(|i| inner(*i)).map(|i| &cells[i]);
    for (v, places) in order.iter().zip(codes) {
        let one = *v > threshold;
        let off = ((v - threshold) / half).abs();
        let against = places.iter().filter(|p| (**p > threshold) != one).count();
        let doubt = off < DOUBT || against >= 2;
        bits.code = bits.code << 1 | u64::from(one);
        bits.doubt = bits.doubt << 1 | u64::from(doubt);
        clear += off.min(1.0) * (1.0 - 0.4 * against as f32);
    }
    let allowed = (IN_DOUBT * (n * n) as f64) as u32;
    (bits.doubt.count_ones() <= allowed).then(|| (bits, clear / (n * n) as f32))
}

/// Means of both classes of sorted values, split where the variance between them is largest.
fn classes(sorted: &[f32]) -> Option<(f32, f32)> {
    let total: f32 = sorted.iter().sum();
    let n = sorted.len() as f32;
    let (mut below, mut best) = (0.0, None);
    let mut largest = 0.0;
    for (i, v) in sorted.iter().enumerate().take(sorted.len().checked_sub(1)?) {
        below += v;
        let k = (i + 1) as f32;
        let (low, high) = (below / k, (total - below) / (n - k));
        let between = k * (n - k) * (high - low) * (high - low);
        if between > largest {
            largest = between;
            best = Some((low, high));
        }
    }
    best
}

/// Pixels of a chart that its cells are about as large as samples: how often the picture may be halved.
pub(super) fn halvings(side: f64) -> usize {
    // Three pixels a cell of the densest layout.
    (0..12).take_while(|k| side / f64::from(2u32 << k) >= 36.0).count()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn classes_and_halvings() {
        assert_eq!(classes(&[0.0, 0.5, 2.0, 2.5]), Some((0.25, 2.25)));
        assert_eq!(classes(&[]), None);
        assert_eq!([30.0, 72.0, 80.0, 150.0].map(halvings), [0, 1, 1, 2]);
    }
}
