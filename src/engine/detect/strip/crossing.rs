//! One corner through the stages of the fit.

use nalgebra::{Matrix2, Vector2};

use crate::image::{Plane, Sample};

use super::{
    Fit, Options,
    axes::Axis,
    edge::Edge,
    gather::{Extent, MAX_BLOCKS, Strip},
    lanes::{LANES, limit},
    normal::{Blur, Levels, Sums, System},
    scatter::Scatter,
};

/// Longest arm of the coarse stage, px.
const COARSE_ARM: f32 = 12.0;
/// Smallest blur, px along u: below it the pixel alone makes the profile.
const SMALLEST_BLUR: f32 = 0.12;
const LARGEST_BLUR: f32 = 8.0;
/// Half width of a strip in widths of the profile.
const STRIP_HALF_WIDTH: f32 = 2.8;
/// Gauss–Newton steps of the fine stage at most.
const FINE_STEPS: usize = 3;
/// The fine stage ends at a step below this part of the blur.
const STILL: f64 = 0.1;
/// Farthest that the fit may move from its whole pixel, px and as a part of the nearest square.
const FARTHEST: (f64, f64) = (5.0, 0.45);
/// Largest trace of the covariance of an accepted corner, px².
const LARGEST_TRACE: f64 = 0.1;
/// Widest profile of an accepted corner as a part of the distance to the next parallel edge: a false corner between
/// squares passes for a very blurred one.
const WIDEST: f32 = 0.25;
/// State of one corner. Positions are relative to `origin`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Crossing {
    origin: [i32; 2],
    /// Edge 0 along the grid row, edge 1 along the grid column.
    pub(super) edges: [Edge; 2],
    pub(super) mean: f32,
    pub(super) amplitude: f32,
    /// Gradient of the mean in (x, y), grey levels per px.
    pub(super) mean_gradient: [f32; 2],
    /// Gradient of the amplitude in (x, y) as a fraction of it, 1/px.
    pub(super) amplitude_gradient: [f32; 2],
    /// Distance to the next corner on edge k at smaller and larger v.
    room: [[f32; 2]; 2],
    /// How far beside the edges there is nothing but their squares, px.
    clear: f32,
    at: Vector2<f64>,
}

impl Crossing {
    /// The corner at `px` with edges along `axes`; `None` for positions that are no place in a picture.
    pub(super) fn new(px: Vector2<f64>, axes: &[Axis; 2]) -> Option<Self> {
        if !px.iter().all(|v| v.abs() < 1e6) {
            return None; // NaN too
        }
        let origin = [px.x.round(), px.y.round()];
        let at = Vector2::new(px.x - origin[0], px.y - origin[1]);
        let edges = axes.map(|a| Edge::through(at.into(), a.along.into()));
        let mut room = axes.map(|a| a.room);
        for k in 0..2 {
            let forward = if edges[k].steep { axes[k].along.y } else { axes[k].along.x };
            if forward < 0.0 {
                room[k].reverse();
            }
        }
        Some(Self {
            origin: origin.map(|v| v as i32),
            edges,
            mean: 0.0,
            amplitude: 0.0,
            mean_gradient: [0.0; 2],
            amplitude_gradient: [0.0; 2],
            room,
            clear: f32::INFINITY,
            at,
        })
    }

    /// The same where something else lies beside the edges, `clear` px from them.
    pub(super) fn with_clear(self, clear: f32) -> Self {
        Self { clear, ..self }
    }

    /// The clear distance from edge `k` along u, px.
    fn clear(&self, k: usize) -> f32 {
        self.clear / self.edges[k].cos()
    }

    /// Position in the picture, px.
    pub(super) fn px(&self) -> Vector2<f64> {
        self.at + Vector2::new(f64::from(self.origin[0]), f64::from(self.origin[1]))
    }

    /// Finds position, slopes, levels and blur from up to about 3 px away.
    pub(super) fn coarse<T: Sample>(
        &mut self,
        picture: &Plane<T>,
        options: &Options,
        strips: &mut [Strip; 2],
    ) -> Option<()> {
        let mut blocks = [2usize; 2];
        for k in 0..2 {
            if self.nearest(1 - k) < 14.0 {
                blocks[k] = 1;
            }
            let e = &mut self.edges[k];
            e.s = if blocks[k] == 2 { 1.5 } else { 0.8 } / e.cos();
            e.set_profile();
        }
        for k in 0..2 {
            let rows = self.reach(k, options.arm, COARSE_ARM, blocks[k]);
            let extent = Extent {
                rows,
                blocks: blocks[k],
                slide: self.slide(k, blocks[k]),
                every: 2,
                clear: self.clear(k),
            };
            strips[k].gather(picture, self.origin, &self.edges[k], &extent);
        }
        self.first_step(strips)?;
        self.step::<false>(strips, false)?;
        for k in 0..2 {
            self.edges[k].s = self.blur_by_area(k, &strips[k]);
        }
        Some(())
    }

    /// Gauss–Newton on everything until it stands still.
    pub(super) fn fine<T: Sample>(
        &mut self,
        picture: &Plane<T>,
        options: &Options,
        strips: &mut [Strip; 2],
    ) -> Option<()> {
        self.gather(picture, options, strips);
        for _ in 0..FINE_STEPS {
            let (at, s) = (self.at, self.edges.map(|e| e.s));
            self.step::<true>(strips, false)?;
            let blur = self.edges[0].s.min(self.edges[1].s);
            // the blur is watched too: under heavy blur the position stands still first
            let steady = |k: usize| (self.edges[k].s - s[k]).abs() < 0.15 * self.edges[k].sd();
            if (self.at - at).norm() < STILL * f64::from(0.3 + blur) && steady(0) && steady(1) {
                break;
            }
        }
        Some(())
    }

    /// One last step with the board's terms, and what its covariance is made of; `None` where this is not an honest corner.
    pub(super) fn score<T: Sample>(
        &mut self,
        picture: &Plane<T>,
        options: &Options,
        strips: &mut [Strip; 2],
    ) -> Option<(Fit, Scatter)> {
        self.gather(picture, options, strips);
        let solution = self.step::<true>(strips, true)?;
        // corner = N⁻¹ (o + p v), N = rows of the normals
        let (_, inverse) = self.normals(self.at)?;
        let mut places = [[0.0; 8]; 2];
        for (k, e) in self.edges.iter().enumerate() {
            let h = f64::from(e.profile.h);
            places[k][3 * k] = h;
            places[k][3 * k + 1] = h * if e.steep { self.at.y } else { self.at.x };
        }
        let scatter = solution.scatter(&places, inverse);
        let sigma_gray = solution.variance.sqrt();
        let fit = Fit {
            px: self.px(),
            cov_px2: [f64::INFINITY, 0.0, f64::INFINITY], // when the others are known
            blur_px: self.edges.map(|e| f64::from(e.s * e.cos())),
            sigma_gray,
            mean: f64::from(self.mean),
            amplitude: f64::from(self.amplitude),
            ok: true,
        };
        let contained = |k: usize| {
            let e = &self.edges[k];
            e.sd() * e.cos() < WIDEST * self.nearest(1 - k)
        };
        let honest = fit.amplitude.abs() > 1.5 * sigma_gray && scatter.plain().trace() < LARGEST_TRACE;
        (honest && contained(0) && contained(1) && fit.px.iter().all(|v| v.is_finite()))
            .then_some((fit, scatter))
    }

    fn gather<T: Sample>(&self, picture: &Plane<T>, options: &Options, strips: &mut [Strip; 2]) {
        for k in 0..2 {
            let e = &self.edges[k];
            let half = (STRIP_HALF_WIDTH * e.sd() + 0.6).min(0.5 * self.nearest(1 - k) / e.cos());
            let blocks = ((half / (LANES / 2) as f32).ceil() as usize).clamp(1, MAX_BLOCKS);
            let rows = self.reach(k, options.arm, options.longest_arm_px, blocks);
            let extent =
                Extent { rows, blocks, slide: self.slide(k, blocks), every: 1, clear: self.clear(k) };
            strips[k].gather(picture, self.origin, e, &extent);
        }
    }

    /// Distance to the nearer of both next corners on edge `k`, px.
    fn nearest(&self, k: usize) -> f32 {
        self.room[k][0].min(self.room[k][1])
    }

    /// How far a row may slide towards smaller and larger u before it would touch the next parallel edge.
    fn slide(&self, k: usize, blocks: usize) -> [f32; 2] {
        let half = (LANES * blocks / 2) as f32;
        let crossed = self.edges[0].steep != self.edges[1].steep;
        // the u axis of this edge is then the v axis of the other
        let room = if crossed { self.room[1 - k] } else { [self.nearest(1 - k); 2] };
        room.map(|d| (0.6 * d / self.edges[k].cos() - half).clamp(0.0, half - 1.0))
    }

    /// Rows before and after the corner on edge `k`, short of the next crossing edge and its blur.
    fn reach(&self, k: usize, arm: f32, longest: f32, blocks: usize) -> [f32; 2] {
        let (e, other) = (&self.edges[k], self.edges[1 - k].form(self.edges[k].steep));
        let along = (other.by_u * e.p + other.by_v).abs() * e.cos();
        let margin = 1.0 + (0.8 + (LANES / 2 * blocks) as f32 * other.by_u.abs()) / along;
        self.room[k].map(|d| (d * arm).min(d - margin).min(longest).max(3.0) * e.cos())
    }

    /// Blur of edge `k` from the area under 1 − J², J = (I − m)/a: it is 2.257 sd for a Gaussian. The two outer lanes
    /// of either side give J² far off the edge, so noise cancels.
    fn blur_by_area(&self, k: usize, strip: &Strip) -> f32 {
        const AREA: f32 = 2.257;
        let e = &self.edges[k];
        let other = self.edges[1 - k].form(e.steep);
        let width = (LANES * strip.blocks) as f32;
        let (scale, last) = (1.0 / self.amplitude, strip.blocks - 1);
        let (mut squares, mut rows) = ([[0f32; LANES]; MAX_BLOCKS], 0);
        for i in 0..strip.rows {
            let (u0, v) = (strip.u0[i], strip.v[i]);
            let (z, z_end) = (other.at(u0, v), other.at(u0 + width, v));
            let crossed = z * z_end < 0.0 || z.abs().min(z_end.abs()) < 0.7;
            let centred = (e.u(v) - u0 - 0.5 * (width - 1.0)).abs() < 3.0;
            if crossed || !centred {
                continue;
            }
            rows += 1;
            for (sum, pixels) in squares.iter_mut().zip(strip.row(i)) {
                for l in 0..LANES {
                    let j = (pixels[l] - self.mean) * scale;
                    sum[l] += j * j;
                }
            }
        }
        if rows < 3 {
            return e.s;
        }
        let far = 0.25 * (squares[0][0] + squares[0][1] + squares[last][6] + squares[last][7]);
        let sum: f32 = squares.iter().flatten().sum();
        let sd = ((far * width - sum) / (rows as f32 * AREA)).clamp(0.1, 6.0);
        let s2 = sd * sd - super::profile::pixel_variance(e.p);
        s2.max(SMALLEST_BLUR * SMALLEST_BLUR).sqrt()
    }

    /// The step that needs no levels: linear in (a·δo, a·δp, m, a), so levels and polarity come out of it.
    fn first_step(&mut self, strips: &[Strip; 2]) -> Option<()> {
        let unit = Levels {
            mean: 0.0,
            amplitude: 0.0,
            jacobian: 1.0,
            mean_gradient: [0.0; 2],
            amplitude_gradient: [0.0; 2],
        };
        let solution = self.solve::<false>(strips, [unit; 2], false)?;
        self.mean = 0.0;
        self.amplitude = 0.0;
        let a = solution.step[7] as f32;
        self.advance::<false>(&solution.step, 1.0 / a)
    }

    /// One Gauss–Newton step; `FULL`: with the blur; `by_rows`: with how the rows scatter.
    fn step<const FULL: bool>(
        &mut self,
        strips: &[Strip; 2],
        by_rows: bool,
    ) -> Option<super::normal::Solution> {
        let levels = self.edges.map(|e| {
            let swap = |g: [f32; 2]| if e.steep { g } else { [g[1], g[0]] };
            Levels {
                mean: self.mean,
                amplitude: self.amplitude,
                jacobian: self.amplitude,
                mean_gradient: swap(self.mean_gradient),
                amplitude_gradient: swap(self.amplitude_gradient),
            }
        });
        let solution = self.solve::<FULL>(strips, levels, by_rows)?;
        self.advance::<FULL>(&solution.step, 1.0)?;
        Some(solution)
    }

    fn solve<const FULL: bool>(
        &mut self,
        strips: &[Strip; 2],
        levels: [Levels; 2],
        by_rows: bool,
    ) -> Option<super::normal::Solution> {
        let mut system = System::default();
        for e in &mut self.edges {
            e.set_profile();
        }
        for k in 0..2 {
            if strips[k].rows < 5 {
                return None;
            }
            let (e, other) = (&self.edges[k], &self.edges[1 - k]);
            let blur = match FULL {
                false => Blur::Fixed,
                true if e.s <= 1.01 * SMALLEST_BLUR => Blur::AtBound,
                true => Blur::Free,
            };
            system.add(k, &Sums::of::<FULL>(&strips[k], e, other, &levels[k], by_rows), blur);
        }
        system.solve()
    }

    /// Applies a step to the parameters; positions and slopes scaled by `scale`.
    fn advance<const FULL: bool>(&mut self, step: &[f64; 8], scale: f32) -> Option<()> {
        self.mean += step[6] as f32;
        self.amplitude += step[7] as f32;
        if self.amplitude.is_nan() || self.amplitude.abs() < 1.0 {
            return None; // less than one grey level
        }
        for (k, e) in self.edges.iter_mut().enumerate() {
            let h = e.profile.h * scale;
            e.o -= limit(step[3 * k] as f32 * h, 2.5);
            e.p -= limit(step[3 * k + 1] as f32 * h, 0.3);
            if FULL {
                let growth = limit(step[3 * k + 2] as f32, 0.5).exp();
                e.s = (e.s * growth).clamp(SMALLEST_BLUR, LARGEST_BLUR);
            }
        }
        self.intersect()
    }

    /// Moves `at` to where both edges meet; `None` where that is too far away.
    fn intersect(&mut self) -> Option<()> {
        let mut at = Vector2::zeros();
        for _ in 0..2 {
            let (distance, inverse) = self.normals(at)?;
            at -= inverse * distance;
        }
        self.at = at;
        let nearest = f64::from(self.nearest(0).min(self.nearest(1)));
        let farthest = FARTHEST.0.min((FARTHEST.1 * nearest).max(1.5));
        (at.amax() < farthest).then_some(())
    }

    /// Residuals of both edge equations at a point, and the inverse of the matrix of their normals.
    fn normals(&self, at: Vector2<f64>) -> Option<(Vector2<f64>, Matrix2<f64>)> {
        let (mut n, mut r) = (Matrix2::zeros(), Vector2::zeros());
        for (i, e) in self.edges.iter().enumerate() {
            let (u, v) = if e.steep { (at.x, at.y) } else { (at.y, at.x) };
            let (o, p, k) = (f64::from(e.o), f64::from(e.p), f64::from(e.k));
            r[i] = u - o - (p + 0.5 * k * v) * v;
            let slope = p + k * v;
            n.set_row(i, &if e.steep { [1.0, -slope].into() } else { [-slope, 1.0].into() });
        }
        let det = n.determinant();
        // edges nearer to parallel than 6° make no corner
        let inverse = Matrix2::new(n[(1, 1)], -n[(0, 1)], -n[(1, 0)], n[(0, 0)]) / det;
        (det.abs() >= 0.1).then_some((r, inverse))
    }
}
