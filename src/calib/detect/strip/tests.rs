//! The strip fit on rendered corners whose truth is exact.

use nalgebra::{Matrix3, Vector2, Vector3};
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use super::*;

/// A board of squares of side 1 behind a homography, bent by `k1` around the picture's middle.
#[derive(Clone)]
struct Scene {
    size: [usize; 2],
    px_from_board: Matrix3<f64>,
    grid: [usize; 2],
    k1: f64,
    levels: [f64; 2],
    /// Samples per pixel and axis.
    samples: usize,
    /// Gaussian blur, px.
    blur: f64,
}

impl Scene {
    fn new(grid: [usize; 2], px_from_board: Matrix3<f64>) -> Self {
        let size = [160, 160];
        Self { size, px_from_board, grid, k1: 0.0, levels: [30.0, 220.0], samples: 16, blur: 0.0 }
    }

    fn middle(&self) -> Vector2<f64> {
        Vector2::new(self.size[0] as f64 - 1.0, self.size[1] as f64 - 1.0) / 2.0
    }

    /// The lens: straight picture from bent picture, closed form as a division model.
    fn straight(&self, px: Vector2<f64>) -> Vector2<f64> {
        let d = px - self.middle();
        self.middle() + d / (1.0 + self.k1 * d.norm_squared())
    }

    fn corner(&self, i: f64, j: f64) -> Vector2<f64> {
        let h = self.px_from_board * Vector3::new(i, j, 1.0);
        let want = Vector2::new(h.x / h.z, h.y / h.z);
        let mut px = want;
        for _ in 0..50 {
            px += want - self.straight(px);
        }
        px
    }

    fn truths(&self) -> Vec<Vector2<f64>> {
        let n = self.grid[0] * self.grid[1];
        (0..n).map(|q| self.corner((q % self.grid[0]) as f64, (q / self.grid[0]) as f64)).collect()
    }

    /// Grey levels, not rounded; `mask`: outside the board is white.
    fn render(&self) -> Plane<f32> {
        let inverse = self.px_from_board.try_inverse().unwrap();
        let n = self.samples;
        let sub = |s: usize| (s as f64 + 0.5) / n as f64 - 0.5;
        let sharp = Plane::from_fn(self.size[0], self.size[1], |x, y| {
            let mut white = 0;
            for s in 0..n * n {
                let px = Vector2::new(x as f64 + sub(s % n), y as f64 + sub(s / n));
                let p = self.straight(px);
                let b = inverse * Vector3::new(p.x, p.y, 1.0);
                let parity = ((b.x / b.z).floor() + (b.y / b.z).floor()).rem_euclid(2.0);
                white += usize::from(parity == 1.0);
            }
            let t = white as f64 / (n * n) as f64;
            (self.levels[0] + t * (self.levels[1] - self.levels[0])) as f32
        });
        if self.blur > 0.0 { super::super::gradient::smooth_levels(&sharp, self.blur) } else { sharp }
    }
}

#[expect(dead_code)]
fn noisy(picture: &Plane<f32>, sigma: f32, rng: &mut Pcg64) -> Plane<u8> {
    picture.map(|v| {
        let n: f32 = StandardNormal.sample(rng);
        u8::from_f32(v + sigma * n)
    })
}

fn exact(picture: &Plane<f32>) -> Plane<u8> {
    picture.map(u8::from_f32)
}

/// Starts off by up to `off` px per axis in a full grid.
fn starts(truths: &[Vector2<f64>], cols: usize, off: f64, rng: &mut Pcg64) -> Vec<Start> {
    let link = |ok: bool, q: usize| ok.then_some(q as u32);
    (0..truths.len())
        .map(|q| Start {
            px: truths[q] + Vector2::new(rng.random_range(-off..=off), rng.random_range(-off..=off)),
            neighbours: [
                link(q % cols > 0, q.wrapping_sub(1)),
                link(q % cols + 1 < cols, q + 1),
                link(q >= cols, q.wrapping_sub(cols)),
                link(q + cols < truths.len(), q + cols),
            ],
        })
        .collect()
}

/// A view of squares of about `side` px, turned by `angle`, with perspective.
fn view(side: f64, angle: f64, perspective: f64, offset: [f64; 2]) -> Matrix3<f64> {
    let (s, c) = angle.sin_cos();
    Matrix3::new(
        side * c,
        -side * s,
        offset[0],
        side * s,
        side * c * 0.96,
        offset[1],
        perspective,
        0.6 * perspective,
        1.0,
    )
}

fn rng(seed: u64) -> Pcg64 {
    Pcg64::seed_from_u64(seed)
}

/// Errors of the corners that lie inside the picture, px; every one of them must be accepted.
fn errors(scene: &Scene, picture: &Plane<u8>, starts: &[Start], border: f64) -> Vec<f64> {
    let fits = refine(picture, starts, &Options::default());
    let far = |v: f64, size: usize| v > border && v < size as f64 - 1.0 - border;
    let seen =
        fits.iter().zip(scene.truths()).filter(|(_, t)| far(t.x, scene.size[0]) && far(t.y, scene.size[1]));
    seen.map(|(fit, truth)| {
        assert!(fit.ok, "{truth} {fit:?}");
        (fit.px - truth).norm()
    })
    .collect()
}

fn rms(errors: &[f64]) -> f64 {
    (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt()
}

#[test]
fn sharp_corners_are_found_to_a_hundredth_of_a_pixel() {
    // squares of 30, 18 and 9 px that perspective makes up to a third smaller
    for (side, cols, off, bound, bound_rms) in
        [(30.0, 3, 2.0, 0.01, 0.005), (18.0, 5, 1.5, 0.015, 0.005), (9.0, 8, 0.6, 0.035, 0.01)]
    {
        let mut all = Vec::new();
        for (n, angle) in [0.0, 0.02, 0.3, 0.78, 1.2].into_iter().enumerate() {
            let scene = Scene::new([cols, cols], view(side, angle, 0.002, [70.37, 20.71]));
            let starts = starts(&scene.truths(), cols, off, &mut rng(n as u64));
            all.extend(errors(&scene, &exact(&scene.render()), &starts, 6.0));
        }
        let worst = all.iter().copied().fold(0.0, f64::max);
        println!("squares of {side}: {} corners, rms {:.4}, worst {worst:.4}", all.len(), rms(&all));
        assert!(worst < bound && rms(&all) < bound_rms, "squares of {side}: {} {worst}", rms(&all));
    }
}
