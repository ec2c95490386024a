//! Pictures of boards of circles with exactly known centres: outlines are projected as polygons and their areas accumulated
//! pixel by pixel, exactly.

use nalgebra::{Point3, Vector2};
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;

use crate::{
    camera::Camera,
    circles::CircleBoard,
    image::{Gray, Plane},
    pose::Pose,
};

/// A picture to render.
#[derive(Clone)]
pub(super) struct Shot {
    pub(super) camera: Camera,
    pub(super) camera_from_board: Pose,
    pub(super) board: CircleBoard,
    /// Of the circles, in spacings.
    pub(super) radius: f64,
    /// Dot and paper, grey levels.
    pub(super) levels: [f64; 2],
    pub(super) blur_px: f64,
    pub(super) noise: f64,
    /// Light falls by this much from one side to the other.
    pub(super) slope: f64,
    /// Circles that are left out, by index.
    pub(super) missing: Vec<u32>,
    /// Discs and squares of any size that do not belong to the board.
    pub(super) clutter: usize,
    pub(super) seed: u64,
}

impl Shot {
    /// Where the centres of the circles are, px.
    pub(super) fn centers(&self) -> Vec<Vector2<f64>> {
        let project = |p: Point3<f64>| self.camera.project(&self.camera_from_board.apply(&p)).unwrap();
        self.board.points(1.0).into_iter().map(project).collect()
    }

    /// Centres and largest radii of the circles, px.
    fn discs(&self) -> impl Iterator<Item = (Vector2<f64>, f64)> {
        let at = |p: Point3<f64>| self.camera.project(&self.camera_from_board.apply(&p)).unwrap_or_default();
        self.board.points(1.0).into_iter().map(move |p| {
            let side = |x: f64, y: f64| (at(Point3::new(p.x + x, p.y + y, 0.0)) - at(p)).norm();
            (at(p), side(self.radius, 0.0).max(side(0.0, self.radius)))
        })
    }

    /// Grey levels before rounding.
    pub(super) fn light(&self) -> Plane<f32> {
        let [w, h] = self.camera.size_px.map(|v| v as usize);
        let mut ink = vec![0.0; (w + 2) * h];
        for (i, c) in self.board.points(1.0).into_iter().enumerate() {
            if self.missing.contains(&(i as u32)) {
                continue;
            }
            let outline = (0..720).filter_map(|k| {
                let (s, t) = (f64::from(k) * std::f64::consts::TAU / 720.0).sin_cos();
                let p = Point3::new(c.x + self.radius * t, c.y + self.radius * s, 0.0);
                self.camera.project(&self.camera_from_board.apply(&p))
            });
            fill(&mut ink, [w, h], &outline.collect::<Vec<_>>());
        }
        let mut random = Pcg64Mcg::seed_from_u64(self.seed ^ 0xc1);
        for _ in 0..self.clutter {
            let at = Vector2::new(random.random_range(0.0..w as f64), random.random_range(0.0..h as f64));
            let r = random.random_range(2.0..9.0);
            // Not on the board's own dots.
            if self.discs().any(|(c, own)| (c - at).norm() < own + r + 4.0) {
                continue;
            }
            let n = if random.random_range(0.0..1.0) < 0.5 { 4 } else { 40 };
            let turn = random.random_range(0.0..6.0);
            let outline = (0..n).map(|k| {
                let (s, c) = (turn + f64::from(k) * std::f64::consts::TAU / f64::from(n)).sin_cos();
                at + Vector2::new(c, s) * r
            });
            fill(&mut ink, [w, h], &outline.collect::<Vec<_>>());
        }
        let mut out = Plane::new(w, h);
        for y in 0..h {
            let mut sum = 0.0;
            for x in 0..w {
                sum += ink[y * (w + 2) + x];
                let cover = f64::abs(sum).min(1.0);
                let light =
                    1.0 + self.slope * (x as f64 / w as f64 - 0.5 + 0.5 * (y as f64 / h as f64 - 0.5));
                let level = (self.levels[1] + (self.levels[0] - self.levels[1]) * cover) * light;
                out.row_mut(y)[x] = level as f32;
            }
        }
        blurred(&out, self.blur_px)
    }

    /// The picture, 8 bits.
    pub(super) fn picture(&self) -> Gray {
        let mut random = Pcg64Mcg::seed_from_u64(self.seed);
        Gray::U8(self.light().map(|v| {
            let noise: f64 = StandardNormal.sample(&mut random);
            (f64::from(v) + self.noise * noise).round().clamp(0.0, 255.0) as u8
        }))
    }
}

/// Adds a polygon's cover to rows of differences: the running sum of a row is the share of each pixel that is covered.
fn fill(rows: &mut [f64], [w, h]: [usize; 2], outline: &[Vector2<f64>]) {
    for (i, a) in outline.iter().enumerate() {
        let b = outline[(i + 1) % outline.len()];
        // Pixels are squares from −0.5 to 0.5 about their centres.
        let (a, d) = (a.add_scalar(0.5), b - a);
        let mut cuts = vec![0.0, 1.0];
        for k in 0..2 {
            let (low, high) = (a[k].min(a[k] + d[k]), a[k].max(a[k] + d[k]));
            let mut line = low.ceil();
            while line < high {
                cuts.push((line - a[k]) / d[k]);
                line += 1.0;
            }
        }
        cuts.sort_by(f64::total_cmp);
        for t in cuts.windows(2) {
            let (middle, dy) = (a + d * (0.5 * (t[0] + t[1])), d.y * (t[1] - t[0]));
            let y = middle.y.floor();
            if y < 0.0 || y >= h as f64 {
                continue;
            }
            let x = middle.x.floor().clamp(0.0, w as f64);
            let right = (middle.x - x).clamp(0.0, 1.0);
            let at = y as usize * (w + 2) + x as usize;
            rows[at] += dy * (1.0 - right);
            rows[at + 1] += dy * right;
        }
    }
}

fn blurred(picture: &Plane<f32>, sigma: f64) -> Plane<f32> {
    if sigma <= 0.0 {
        return picture.clone();
    }
    let n = (4.0 * sigma).ceil() as i32;
    let taps: Vec<f64> = (-n..=n).map(|i| (-0.5 * (f64::from(i) / sigma).powi(2)).exp()).collect();
    let sum: f64 = taps.iter().sum();
    let (w, h) = (picture.width() as i32, picture.height() as i32);
    let pass = |p: &Plane<f32>, dx: i32, dy: i32| {
        Plane::from_fn(w as usize, h as usize, |x, y| {
            let tap = |(i, t): (usize, &f64)| {
                let k = i as i32 - n;
                let (x, y) = ((x as i32 + k * dx).clamp(0, w - 1), (y as i32 + k * dy).clamp(0, h - 1));
                t * f64::from(p.at(x as usize, y as usize))
            };
            (taps.iter().enumerate().map(tap).sum::<f64>() / sum) as f32
        })
    };
    pass(&pass(picture, 1, 0), 0, 1)
}
