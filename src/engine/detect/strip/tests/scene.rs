//! Rendered corners whose truth is exact.

use nalgebra::{Matrix3, Vector2, Vector3};
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use crate::{
    detect::{gradient, strip::Start},
    image::{Plane, Sample},
};

/// Pixels of the picture that a blur works on, per pixel and axis.
const FINE: usize = 3;

/// An endless board of squares of side 1 behind a homography and a lens; `grid` corners from (0, 0) count.
#[derive(Clone)]
pub(crate) struct Scene {
    pub(crate) size: [usize; 2],
    pub(crate) px_from_board: Matrix3<f64>,
    pub(crate) grid: [usize; 2],
    /// Division model around the middle of the picture: straight = bent / (1 + k1 r²).
    pub(crate) k1: f64,
    pub(crate) levels: [f64; 2],
    /// Samples per pixel, with blur per ninth of a pixel: a Fibonacci number.
    pub(crate) samples: usize,
    /// Gaussian blur, px.
    pub(crate) blur: f64,
}

impl Scene {
    pub(crate) fn new(grid: [usize; 2], px_from_board: Matrix3<f64>) -> Self {
        let size = [160, 160];
        Self { size, px_from_board, grid, k1: 0.0, levels: [30.0, 220.0], samples: 233, blur: 0.0 }
    }

    /// Sets the blur, px, and a number of samples to go with it.
    pub(crate) fn blurred(mut self, blur: f64) -> Self {
        (self.blur, self.samples) = (blur, if blur > 0.0 { 34 } else { 233 });
        self
    }

    fn straight(&self, px: Vector2<f64>) -> Vector2<f64> {
        let middle = Vector2::new(self.size[0] as f64 - 1.0, self.size[1] as f64 - 1.0) / 2.0;
        let d = px - middle;
        middle + d / (1.0 + self.k1 * d.norm_squared())
    }

    fn corner(&self, i: f64, j: f64) -> Vector2<f64> {
        let h = self.px_from_board * Vector3::new(i, j, 1.0);
        let want = Vector2::new(h.x / h.z, h.y / h.z);
        let mut px = want;
        for _ in 0..100 {
            px += want - self.straight(px);
        }
        px
    }

    /// Point (i, j) of the grid, in row-major order.
    pub(crate) fn truths(&self) -> Vec<Vector2<f64>> {
        let n = self.grid[0] * self.grid[1];
        (0..n).map(|q| self.corner((q % self.grid[0]) as f64, (q / self.grid[0]) as f64)).collect()
    }

    /// Grey levels, not rounded.
    ///
    /// The blur acts before the pixels sample it: blurring whole pixels would leave some of the aliasing of the sharp
    /// picture, which moves edges along the pixel grid by 0.02 px at σ 0.7.
    pub(crate) fn render(&self) -> Plane<f32> {
        if self.blur == 0.0 {
            return self.sample(1, self.samples);
        }
        let fine = gradient::smooth_levels(&self.sample(FINE, self.samples), self.blur * FINE as f64);
        Plane::from_fn(self.size[0], self.size[1], |x, y| {
            let row = |j: usize| &fine.row(FINE * y + j)[FINE * x..FINE * (x + 1)];
            (0..FINE).flat_map(row).sum::<f32>() / (FINE * FINE) as f32
        })
    }

    /// The sharp picture at `scale` times the size, the mean of `n` samples in each of its pixels.
    fn sample(&self, scale: usize, n: usize) -> Plane<f32> {
        let inverse = self.px_from_board.try_inverse().unwrap();
        // a Fibonacci lattice: no two samples share a row or a column, so that edges along the pixel grid are integrated
        // as well as others, and the mean of the samples is the centre
        let next = (n as f64 * 0.618).round() as usize;
        let sub = |s: usize| Vector2::new(s as f64 + 0.5, (s * next % n) as f64 + 0.5) / n as f64;
        let (black, white) = (self.levels[0], self.levels[1]);
        Plane::from_fn(scale * self.size[0], scale * self.size[1], |x, y| {
            let square = |within: Vector2<f64>| {
                let px = (Vector2::new(x as f64, y as f64) + within) / scale as f64;
                let p = self.straight(px.add_scalar(-0.5));
                let b = inverse * Vector3::new(p.x, p.y, 1.0);
                [(b.x / b.z).floor() as i64, (b.y / b.z).floor() as i64]
            };
            let is_white = |[i, j]: [i64; 2]| (i + j) & 1 == 1;
            let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]].map(|c| square(c.into()));
            let t = if corners.iter().all(|c| *c == corners[0]) {
                f64::from(u8::from(is_white(corners[0])))
            } else {
                (0..n).filter(|s| is_white(square(sub(*s)))).count() as f64 / n as f64
            };
            (black + t * (white - black)) as f32
        })
    }

    /// Links of the full grid.
    pub(crate) fn links(&self, q: usize) -> [Option<u32>; 4] {
        let [cols, rows] = self.grid;
        let link = |ok: bool, q: usize| ok.then_some(q as u32);
        let (i, j) = (q % cols, q / cols);
        [
            link(i > 0, q.wrapping_sub(1)),
            link(i + 1 < cols, q + 1),
            link(j > 0, q.wrapping_sub(cols)),
            link(j + 1 < rows, q + cols),
        ]
    }

    /// Starts off by up to `off` px per axis.
    pub(crate) fn starts(&self, off: f64, rng: &mut Pcg64) -> Vec<Start> {
        let mut shift = || Vector2::new(rng.random_range(-off..=off), rng.random_range(-off..=off));
        let start =
            |(q, truth): (usize, Vector2<f64>)| Start { px: truth + shift(), neighbours: self.links(q) };
        self.truths().into_iter().enumerate().map(start).collect()
    }

    /// Whether a point is more than `border` px inside the picture.
    pub(crate) fn sees(&self, p: Vector2<f64>, border: f64) -> bool {
        let far = |v: f64, size: usize| v > border && v < size as f64 - 1.0 - border;
        far(p.x, self.size[0]) && far(p.y, self.size[1])
    }
}

/// Squares of about `side` px, turned by `angle`, with perspective; corner (0, 0) is at `at`.
pub(crate) fn view(side: f64, angle: f64, perspective: f64, at: [f64; 2]) -> Matrix3<f64> {
    let (s, c) = angle.sin_cos();
    let (a, b) = ([side * c, side * s], [-side * s, 0.96 * side * c]);
    let (g, h) = (perspective, 0.6 * perspective);
    Matrix3::new(a[0], b[0], at[0], a[1], b[1], at[1], g, h, 1.0)
}

pub(crate) fn rounded<T: Sample>(picture: &Plane<f32>) -> Plane<T> {
    picture.map(T::from_f32)
}

pub(crate) fn noisy(picture: &Plane<f32>, sigma: f32, rng: &mut Pcg64) -> Plane<u8> {
    picture.map(|v| {
        let n: f32 = StandardNormal.sample(rng);
        u8::from_f32(v + sigma * n)
    })
}

pub(crate) fn rng(seed: u64) -> Pcg64 {
    Pcg64::seed_from_u64(seed)
}
