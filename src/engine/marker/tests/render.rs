//! Pictures of boards: every pixel is the mean of the board over its area, through a homography and a radial bend.

use nalgebra::{Matrix3, Vector2, Vector3};

use super::super::board::{Layout, MarkerBoard};
use crate::image::Plane;

/// How a board is seen.
#[derive(Clone)]
pub(super) struct View {
    pub(super) size: [usize; 2],
    /// Picture from board, before the bend.
    pub(super) h: Matrix3<f64>,
    /// A place at distance r from the middle is moved to r (1 + bend r²), r in half diagonals.
    pub(super) bend: f64,
    /// Grey levels of black and white.
    pub(super) levels: [f64; 2],
    /// White on black.
    pub(super) inverted: bool,
    /// Standard deviation of a Gaussian blur, px.
    pub(super) blur: f64,
    /// Standard deviation of the noise, grey levels.
    pub(super) noise: f64,
}

impl View {
    /// The middle of the board, `extent` wide, in the middle of a picture, `scale` px a unit, turned and tilted by degrees.
    pub(super) fn new(size: [usize; 2], extent: Vector2<f64>, scale: f64, turn: f64, tilt: f64) -> Self {
        let [t, a] = [turn, tilt].map(f64::to_radians);
        let middle = Vector2::from(size.map(|n| n as f64 / 2.0 - 0.4));
        // A camera 2.2 times as far as the board is long.
        let far = 2.2 * extent.norm();
        let board = Matrix3::new(1.0, 0.0, -extent.x / 2.0, 0.0, 1.0, -extent.y / 2.0, 0.0, 0.0, 1.0);
        let turned = Matrix3::new(t.cos(), -t.sin(), 0.0, t.sin(), t.cos(), 0.0, 0.0, 0.0, 1.0);
        let tilted = Matrix3::new(a.cos(), 0.0, 0.0, 0.0, 1.0, 0.0, a.sin() / far, 0.0, 1.0);
        let picture = Matrix3::new(scale, 0.0, middle.x, 0.0, scale, middle.y, 0.0, 0.0, 1.0);
        let h = picture * tilted * turned * board;
        Self { size, h, bend: 0.0, levels: [35.0, 215.0], inverted: false, blur: 0.0, noise: 0.0 }
    }

    fn middle(&self) -> (Vector2<f64>, f64) {
        let half = Vector2::from(self.size.map(|n| n as f64 / 2.0));
        (half, half.norm())
    }

    /// Where a point of the board is seen, px.
    pub(super) fn px(&self, p: Vector2<f64>) -> Vector2<f64> {
        let q = self.h * Vector3::new(p.x, p.y, 1.0);
        let (middle, unit) = self.middle();
        let d = (Vector2::new(q.x, q.y) / q.z - middle) / unit;
        middle + d * (1.0 + self.bend * d.norm_squared()) * unit
    }

    fn board(&self, inverse: &Matrix3<f64>, px: Vector2<f64>) -> Vector2<f64> {
        let (middle, unit) = self.middle();
        let bent = (px - middle) / unit;
        let mut d = bent;
        for _ in 0..if self.bend == 0.0 { 0 } else { 12 } {
            d = bent / (1.0 + self.bend * d.norm_squared());
        }
        let p = middle + d * unit;
        let q = inverse * Vector3::new(p.x, p.y, 1.0);
        Vector2::new(q.x, q.y) / q.z
    }

    /// The picture; `white` says whether a point of the board is.
    pub(super) fn render(&self, white: impl Fn(Vector2<f64>) -> bool) -> Plane<u8> {
        let inverse = self.h.try_inverse().unwrap();
        let at = |x: f64, y: f64| white(self.board(&inverse, Vector2::new(x, y))) != self.inverted;
        let [w, h] = self.size;
        let light = Plane::from_fn(w, h, |x, y| {
            let (x, y) = (x as f64, y as f64);
            let some = [(0.0, 0.0), (-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)];
            let count = some.iter().filter(|(dx, dy)| at(x + dx, y + dy)).count();
            let part = if count == 0 || count == 5 {
                count as f64 / 5.0
            } else {
                const N: i32 = 12;
                let off = |i: i32| (f64::from(i) + 0.5) / f64::from(N) - 0.5;
                let whites = (0..N * N).filter(|i| at(x + off(i % N), y + off(i / N))).count();
                whites as f64 / f64::from(N * N)
            };
            (self.levels[0] + part * (self.levels[1] - self.levels[0])) as f32
        });
        let mut state = 12345u32;
        let mut uniform = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(state >> 8) / f64::from(1 << 24)
        };
        let blurred = blur(&light, self.blur);
        blurred.map(|v| {
            let noise = if self.noise > 0.0 {
                ((0..12).map(|_| uniform()).sum::<f64>() - 6.0) * self.noise
            } else {
                0.0
            };
            (f64::from(v) + noise + 0.5) as u8
        })
    }
}

fn blur(picture: &Plane<f32>, sigma: f64) -> Plane<f32> {
    if sigma == 0.0 {
        return picture.clone();
    }
    let reach = (3.0 * sigma).ceil() as i32;
    let kernel: Vec<f64> = (-reach..=reach).map(|i| (-0.5 * (f64::from(i) / sigma).powi(2)).exp()).collect();
    let sum: f64 = kernel.iter().sum();
    let (w, h) = (picture.width() as i32, picture.height() as i32);
    let pass = |p: &Plane<f32>, dx: i32, dy: i32| {
        Plane::from_fn(w as usize, h as usize, |x, y| {
            let of = |(k, i): (&f64, i32)| {
                let (x, y) = ((x as i32 + i * dx).clamp(0, w - 1), (y as i32 + i * dy).clamp(0, h - 1));
                k * f64::from(p.at(x as usize, y as usize))
            };
            (kernel.iter().zip(-reach..=reach).map(of).sum::<f64>() / sum) as f32
        })
    };
    pass(&pass(picture, 1, 0), 0, 1)
}

/// Whether a point of a board is white, with white paper around it.
pub(super) fn white(board: &MarkerBoard) -> impl Fn(Vector2<f64>) -> bool + use<> {
    let board = *board;
    let layout = match &board {
        MarkerBoard::Charuco(b) => b.layout(b.legacy == Some(true)),
        MarkerBoard::AprilGrid(b) => b.layout(),
        MarkerBoard::ArucoGrid(b) => b.layout(),
    };
    let codes: Vec<u64> = (0..layout.marks.len() as u32)
        .map(|i| layout.dictionary.code(layout.first_id + i).unwrap())
        .collect();
    move |p| {
        if let Some(colour) = mark_at(&layout, &codes, p) {
            return colour;
        }
        match &board {
            MarkerBoard::Charuco(b) => {
                let [c, r] = [p.x, p.y].map(|v| (v / b.square).floor());
                let inside = c >= 0.0 && r >= 0.0 && c < f64::from(b.columns) && r < f64::from(b.rows);
                let shift = if b.legacy == Some(true) && b.rows % 2 == 0 { 1.0 } else { 0.0 };
                !inside || (c + r + shift).rem_euclid(2.0) > 0.5
            }
            MarkerBoard::AprilGrid(b) => {
                // Small squares lie in every crossing of the gaps.
                let (step, gap) = (b.tag * (1.0 + b.spacing), b.tag * b.spacing);
                let cell = [(p.x, b.columns), (p.y, b.rows)].map(|(v, n)| {
                    let k = ((v + gap) / step).floor();
                    (0.0..=f64::from(n)).contains(&k) && v + gap - k * step < gap
                });
                !(cell[0] && cell[1])
            }
            MarkerBoard::ArucoGrid(_) => true,
        }
    }
}

/// The colour of the marker at a point.
fn mark_at(layout: &Layout, codes: &[u64], p: Vector2<f64>) -> Option<bool> {
    let n = usize::from(layout.dictionary.cells());
    let border = usize::from(layout.border);
    let total = (n + 2 * border) as f64;
    layout.marks.iter().zip(codes).find_map(|(m, code)| {
        let (u, v) = (m[1] - m[0], m[3] - m[0]);
        let d = p - m[0];
        let (s, t) = (d.dot(&u) / u.norm_squared(), d.dot(&v) / v.norm_squared());
        if !(0.0..1.0).contains(&s) || !(0.0..1.0).contains(&t) {
            return None;
        }
        let [c, r] = [s, t].map(|v| (v * total) as usize);
        let inner = |k: usize| (border..border + n).contains(&k);
        let bit = |r: usize, c: usize| code >> (n * n - 1 - (r - border) * n - (c - border)) & 1 == 1;
        Some(inner(c) && inner(r) && bit(r, c))
    })
}
