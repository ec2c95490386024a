//! A solution and what could be added to it, linearised: the least-squares problem with columns for every fault.
//!
//! For each corner the columns are those of the free intrinsics, then the elementary columns of all faults ([`Column`]), then smooth
//! displacements of the view (to measure noise that neighbours share), then the residual. The pose of each view is eliminated, so
//! that what is left of a view is one small matrix of products,
//!
//! ```text
//! S = RᵀWR − RᵀWP (PᵀWP)⁻¹ PᵀWR,    R = [intrinsics | columns | smooth | residual],  P = ∂px/∂pose
//! ```
//!
//! A fault is a set of [`Term`]s: an elementary column with a factor for each view. Its normal equations are sums of entries of S, so
//! any number of faults costs one pass over the corners.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn, Matrix2x6, Matrix6xX, Point3, Vector2, Vector3};

use super::column::{Column, Place};
use crate::calib::{
    camera::{Camera, Projection},
    pose::Pose,
    refine::block::Block,
    solution::Calibration,
    target::Target,
};

/// Degree of the polynomials of a view's smooth displacements.
const SMOOTH_DEGREE: i32 = 2;
/// Their number: (degree + 1)(degree + 2)/2 for each coordinate.
const SMOOTH: usize = 12;
/// Share of a column (of its square) that must be left beside the others for it to count.
const INDEPENDENT: f64 = 1e-4;
/// Halvings of its variance at which a scatter is tried.
const WIDTHS: i32 = 6;

/// One elementary column, the same unknown in several views, each with its factor.
#[derive(Clone, Debug)]
pub(super) struct Term {
    pub(super) column: Column,
    /// One for each view; 0 where it is no matter.
    pub(super) factors: Vec<f64>,
}

impl Term {
    /// Whether it is about one view.
    pub(super) fn is_alone(&self) -> bool {
        self.factors.iter().filter(|f| **f != 0.0).count() == 1
    }
}

/// Corners of one view.
#[derive(Clone)]
pub(in crate::calib::diagnose) struct Seen {
    pub(in crate::calib::diagnose) points: Vec<Point3<f64>>,
    pub(in crate::calib::diagnose) observed: Vec<Vector2<f64>>,
    pub(in crate::calib::diagnose) weights: Vec<f64>,
}

impl Seen {
    /// As the refinement wants it.
    pub(in crate::calib::diagnose) fn block(&self) -> Block {
        let mut block = Block::new(&self.points, &self.observed);
        block.set_weights(self.weights.iter().copied());
        block
    }
}

/// Where the unknowns are.
#[derive(Clone)]
pub(super) struct At {
    pub(super) camera: Camera,
    pub(super) poses: Vec<Pose>,
    /// Value of each term that is in.
    pub(super) theta: Vec<f64>,
}

/// What of the calibration does not move.
pub(in crate::calib::diagnose) struct Fixed {
    /// For each parameter its place among the free ones.
    pub(in crate::calib::diagnose) slots: Vec<Option<usize>>,
    pub(in crate::calib::diagnose) free: usize,
    pub(in crate::calib::diagnose) views: Vec<Seen>,
    /// Middle of the board, and half its longer side.
    pub(super) middle: Point3<f64>,
    pub(in crate::calib::diagnose) half: f64,
    pub(in crate::calib::diagnose) normal: Vector3<f64>,
}

impl Fixed {
    /// `None` where the camera does not see one of its corners.
    pub(in crate::calib::diagnose) fn new(calibration: &Calibration, target: &Target) -> Option<Self> {
        let slots = calibration.slots();
        let views: Option<Vec<Seen>> = calibration
            .views
            .iter()
            .map(|view| {
                let points: Option<Vec<_>> = view.indices.iter().map(|i| target.point_in_board(*i)).collect();
                let points = points?;
                let camera = &calibration.camera;
                let observed: Option<Vec<_>> = points
                    .iter()
                    .zip(&view.residuals_px)
                    .map(|(p, r)| {
                        let place = view.camera_from_board.apply(p).coords;
                        Some((camera.spec().project_px)(&camera.params, &place)? + r)
                    })
                    .collect();
                Some(Seen { points, observed: observed?, weights: view.weights.clone() })
            })
            .collect();
        let [[x0, y0], [x1, y1]] = target.extent();
        Some(Self {
            slots,
            free: calibration.free.len(),
            views: views?,
            middle: target.center_in_board(),
            half: (0.5 * (x1 - x0).max(y1 - y0)).max(f64::MIN_POSITIVE),
            normal: target.normal_in_board(),
        })
    }
}

/// What is left of a view.
pub(super) struct Reduced {
    /// Products of all columns, the pose eliminated.
    s: DMatrix<f64>,
    /// How the pose answers to each column.
    answer: Matrix6xX<f64>,
    /// Middle of the corners in the camera frame.
    center: Vector3<f64>,
    corners: usize,
}

/// All views at one point.
pub(super) struct Linear<'a> {
    fixed: &'a Fixed,
    views: Vec<Reduced>,
}

/// Normal equations of some terms, the poses and intrinsics eliminated from `s_ee` and `g_e`.
struct Normal {
    own: Cholesky<f64, Dyn>,
    s_be: DMatrix<f64>,
    s_ee: DMatrix<f64>,
    g_b: DVector<f64>,
    g_e: DVector<f64>,
    /// How the intrinsics answer to each term.
    answer: DMatrix<f64>,
    /// Diagonal of `s_ee` before the intrinsics were eliminated.
    before: Vec<f64>,
    /// Sum of weighted squares, px².
    squares: f64,
}

/// The best values of some terms.
#[derive(Clone, Debug)]
pub(super) struct Fit {
    /// Of each term.
    pub(super) theta: Vec<f64>,
    /// How the free intrinsics move.
    pub(super) intrinsics: DVector<f64>,
    /// How the free intrinsics scatter with the terms, for noise of 1: one row for each term, whose squares add up.
    pub(super) scatter: DMatrix<f64>,
    /// Sum of weighted squares that is left, px².
    pub(super) left: f64,
    /// Terms that are determined.
    pub(super) rank: usize,
    /// Variance of a coordinate that is left, as smooth displacements of a view see it, px².
    pub(super) noise: f64,
}

impl<'a> Linear<'a> {
    /// `None` where a corner is not seen or a pose not determined. `terms` are in already, with the values of `at`.
    pub(super) fn new(fixed: &'a Fixed, at: &At, terms: &[Term]) -> Option<Self> {
        let view = |i: usize| reduced(fixed, at, terms, i);
        Some(Self { fixed, views: (0..fixed.views.len()).map(view).collect::<Option<_>>()? })
    }

    fn column(&self, column: Column) -> usize {
        self.fixed.free + column.index()
    }

    fn residual(&self) -> usize {
        self.fixed.free + Column::COUNT + SMOOTH
    }

    /// Corners of all views.
    pub(super) fn corners(&self) -> usize {
        self.views.iter().map(|v| v.corners).sum()
    }

    /// Normal matrix of the intrinsics.
    fn intrinsics(&self) -> DMatrix<f64> {
        let b = self.fixed.free;
        let zero = DMatrix::zeros(b, b);
        self.views.iter().fold(zero, |sum, v| sum + v.s.view((0, 0), (b, b)))
    }

    /// Normal equations of terms beside the intrinsics and all poses; `None` where those are not determined.
    fn normal(&self, terms: &[Term]) -> Option<Normal> {
        let (b, m, r) = (self.fixed.free, terms.len(), self.residual());
        let own = self.intrinsics().cholesky()?;
        let (mut s_be, mut s_ee) = (DMatrix::zeros(b, m), DMatrix::zeros(m, m));
        let (mut g_b, mut g_e) = (DVector::zeros(b), DVector::zeros(m));
        let mut squares = 0.0;
        for (i, view) in self.views.iter().enumerate() {
            let s = &view.s;
            squares += s[(r, r)];
            g_b += s.view((0, r), (b, 1));
            let here: Vec<(usize, usize, f64)> = terms
                .iter()
                .enumerate()
                .filter(|(_, t)| t.factors[i] != 0.0)
                .map(|(k, t)| (k, self.column(t.column), t.factors[i]))
                .collect();
            for &(k, column, factor) in &here {
                g_e[k] += factor * s[(column, r)];
                for c in 0..b {
                    s_be[(c, k)] += factor * s[(c, column)];
                }
                for &(l, other, by) in &here {
                    s_ee[(k, l)] += factor * by * s[(column, other)];
                }
            }
        }
        let answer = own.solve(&s_be);
        let before: Vec<f64> = s_ee.diagonal().iter().copied().collect();
        s_ee -= s_be.transpose() * &answer;
        g_e -= answer.transpose() * &g_b;
        Some(Normal { own, s_be, s_ee, g_b, g_e, answer, before, squares })
    }

    /// Fits terms beside the intrinsics and all poses; `None` where those are not determined.
    pub(super) fn fit(&self, terms: &[Term]) -> Option<Fit> {
        let (b, m) = (self.fixed.free, terms.len());
        let Normal { own, s_be, s_ee, g_b, g_e, answer, before, squares } = self.normal(terms)?;
        let mut right = DMatrix::zeros(m, 1 + b);
        right.set_column(0, &g_e);
        right.columns_mut(1, b).copy_from(&answer.transpose());
        let Solved { theta, gain, rank, right, .. } = solve(s_ee, &before, right);
        let scatter = right.columns(1, b).into_owned();
        let intrinsics = own.solve(&(&g_b - &s_be * DVector::from_vec(theta.clone())));
        let unknowns = b + 6 * self.views.len() + rank;
        let freedom = (2 * self.corners()).checked_sub(unknowns).filter(|n| *n > 0)?;
        let left = (squares - g_b.dot(&own.solve(&g_b)) - gain).max(0.0);
        let white = left / freedom as f64;
        let noise = self.shared_noise(terms, &theta, &intrinsics).max(white);
        Some(Fit { theta, intrinsics, scatter, left, rank, noise })
    }

    /// Twice the logarithm of the likelihood that the values of `own` are drawn from a normal distribution about 0, as wide as makes it
    /// largest, over that of none of them, beside terms that are in: what a scatter explains without any value of its own
    /// (N. M. Laird, J. H. Ware, "Random-effects models for longitudinal data", Biometrics 38, 1982). `theta` are their free values,
    /// `noise` is the variance of a coordinate, px².
    pub(super) fn scatter_likelihood(
        &self,
        base: &[Term],
        own: &[Term],
        theta: &[f64],
        noise: f64,
    ) -> Option<f64> {
        let normal = self.normal(&[base, own].concat())?;
        let (from, m) = (base.len(), base.len() + own.len());
        let first = |n: usize, s_ee: DMatrix<f64>| {
            solve(s_ee, &normal.before[..n], DMatrix::from_column_slice(n, 1, &normal.g_e.as_slice()[..n]))
        };
        let known = first(from, normal.s_ee.view((0, 0), (from, from)).into_owned()).gain;
        // As wide as the values are, where they are known best, and narrower.
        let known_by: Vec<f64> = (from..m).map(|k| normal.s_ee[(k, k)]).collect();
        let widest =
            known_by.iter().zip(theta).map(|(a, v)| a * v * v).sum::<f64>() / known_by.iter().sum::<f64>();
        let likelihood = |variance: f64| {
            let mut s_ee = normal.s_ee.clone();
            (from..m).for_each(|k| s_ee[(k, k)] += noise / variance);
            let solved = first(m, s_ee);
            let roots = solved.roots[from..].iter().filter(|r| **r > 0.0);
            let widths: f64 = roots.map(|r| (r * r * variance / noise).ln()).sum();
            (solved.gain - known) / noise - widths
        };
        (-1..WIDTHS)
            .map(|k| likelihood(widest * 0.5f64.powi(k)))
            .filter(|l| l.is_finite())
            .max_by(f64::total_cmp)
    }

    /// Variance of a coordinate in what is left, from smooth displacements of each view: where neighbours err alike it is larger than
    /// that of single corners. The median over the views, so that one that is spoilt does not count.
    fn shared_noise(&self, terms: &[Term], theta: &[f64], intrinsics: &DVector<f64>) -> f64 {
        let (b, r) = (self.fixed.free, self.residual());
        let from = b + Column::COUNT;
        let mut all: Vec<f64> = self
            .views
            .iter()
            .enumerate()
            .filter_map(|(i, view)| {
                let s = &view.s;
                let mut right = s.view((from, r), (SMOOTH, 1)).into_owned();
                right -= s.view((from, 0), (SMOOTH, b)) * intrinsics;
                let mut alone = 0;
                for (term, value) in terms.iter().zip(theta).filter(|(t, _)| t.factors[i] != 0.0) {
                    let column = s.view((from, self.column(term.column)), (SMOOTH, 1));
                    right -= column * (value * term.factors[i]);
                    alone += usize::from(term.is_alone());
                }
                let matrix = s.view((from, from), (SMOOTH, SMOOTH)).into_owned();
                let before: Vec<f64> = (0..SMOOTH).map(|k| matrix[(k, k)]).collect();
                let solved = solve(matrix, &before, DMatrix::from_column_slice(SMOOTH, 1, right.as_slice()));
                let freedom = solved.rank.checked_sub(alone).filter(|n| *n > 1)? as f64;
                // Median of χ² over its mean (Wilson and Hilferty).
                Some(solved.gain / freedom / (1.0 - 2.0 / (9.0 * freedom)).powi(3))
            })
            .collect();
        all.sort_by(f64::total_cmp);
        if all.is_empty() { 0.0 } else { crate::calib::stats::quantile(&all, 0.5) }
    }

    /// The point that a fit leads to; `terms` are those of the fit.
    pub(super) fn step(&self, at: &At, terms: &[Term], fit: &Fit) -> At {
        let mut next = at.clone();
        for (k, value) in next.camera.params.iter_mut().enumerate() {
            *value += self.fixed.slots[k].map_or(0.0, |slot| fit.intrinsics[slot]);
        }
        for (i, (view, pose)) in self.views.iter().zip(&mut next.poses).enumerate() {
            let mut step = view.answer.column(self.residual()).into_owned();
            step -= view.answer.columns(0, self.fixed.free) * &fit.intrinsics;
            for (term, value) in terms.iter().zip(&fit.theta) {
                step -= view.answer.column(self.column(term.column)) * (value * term.factors[i]);
            }
            let turn = nalgebra::Rotation3::from_scaled_axis(step.fixed_rows::<3>(0).into_owned());
            let shift = step.fixed_rows::<3>(3);
            pose.translation = turn * (pose.translation - view.center) + view.center + shift;
            pose.rotation = turn * pose.rotation;
        }
        next.theta.resize(terms.len(), 0.0);
        for (value, by) in next.theta.iter_mut().zip(&fit.theta) {
            *value += by;
        }
        next
    }
}

/// Covariance of the free intrinsics for σ₀ = 1 of boards that stand as `poses`; `None` where they do not determine them.
pub(in crate::calib::diagnose) fn covariance(
    camera: &Camera,
    fixed: &Fixed,
    views: &[(Pose, Vec<(Point3<f64>, f64)>)],
) -> Option<DMatrix<f64>> {
    let b = fixed.free;
    let mut sum = DMatrix::zeros(b, b);
    for (pose, points) in views {
        let center = points.iter().map(|(p, _)| pose.apply(p).coords).sum::<Vector3<f64>>()
            / points.len().max(1) as f64;
        let (mut u, mut v, mut w) = (DMatrix::zeros(b, b), nalgebra::Matrix6::zeros(), Matrix6xX::zeros(b));
        for (point, weight) in points {
            let place = pose.apply(point).coords;
            let Some(there) = (camera.spec().project)(&camera.params, &place) else { continue };
            let by_pose = by_pose(&there, &(place - center));
            let mut by_free = DMatrix::zeros(2, b);
            intrinsics(&there, &fixed.slots, |slot, c| {
                let mut to = by_free.column_mut(slot);
                to += c;
            });
            u += by_free.transpose() * &by_free * *weight;
            v += by_pose.transpose() * by_pose * *weight;
            w += by_pose.transpose() * &by_free * *weight;
        }
        let Some(v) = v.cholesky() else { continue };
        sum += u - w.transpose() * v.solve(&w);
    }
    Some(sum.cholesky()?.inverse())
}

fn by_pose(there: &Projection, arm: &Vector3<f64>) -> Matrix2x6<f64> {
    let mut by = Matrix2x6::zeros();
    by.fixed_view_mut::<2, 3>(0, 0).copy_from(&(there.by_point * -arm.cross_matrix()));
    by.fixed_view_mut::<2, 3>(0, 3).copy_from(&there.by_point);
    by
}

fn intrinsics(there: &Projection, slots: &[Option<usize>], mut to: impl FnMut(usize, &Vector2<f64>)) {
    for (slot, column) in slots.iter().zip(&there.by_params) {
        if let Some(slot) = slot {
            to(*slot, column);
        }
    }
}

fn reduced(fixed: &Fixed, at: &At, terms: &[Term], i: usize) -> Option<Reduced> {
    let seen = &fixed.views[i];
    let pose = &at.poses[i];
    let n = seen.points.len();
    let width = fixed.free + Column::COUNT + SMOOTH + 1;
    let (mut rows, mut poses) = (DMatrix::zeros(2 * n, width), DMatrix::zeros(2 * n, 6));
    let center = seen.points.iter().map(|p| pose.apply(p).coords).sum::<Vector3<f64>>() / n.max(1) as f64;
    let values: Vec<(Column, f64)> = terms
        .iter()
        .zip(&at.theta)
        .filter(|(t, _)| t.factors[i] != 0.0)
        .map(|(t, v)| (t.column, v * t.factors[i]))
        .collect();
    for (j, (point, observed)) in seen.points.iter().zip(&seen.observed).enumerate() {
        let flat = (point - fixed.middle) / fixed.half;
        let mut camera = at.camera.params.clone();
        let mut lifted = *point;
        for (column, value) in &values {
            column.apply(*value, &flat, &fixed.normal, &mut camera, &mut lifted, fixed.half);
        }
        let place = pose.apply(&lifted).coords;
        let there = (at.camera.spec().project)(&camera, &place)?;
        let of = Place {
            there: &there,
            params: &camera,
            size_px: at.camera.size_px,
            flat,
            normal: pose.rotation * fixed.normal,
            along: pose.rotation * Vector3::x() * fixed.half,
        };
        let px: Vector2<f64> = there.px
            + values
                .iter()
                .filter(|(c, _)| c.in_picture())
                .map(|(c, v)| of.column(*c) * *v)
                .sum::<Vector2<f64>>();
        let root = seen.weights[j].sqrt();
        let mut put = |column: usize, value: Vector2<f64>| {
            rows[(2 * j, column)] += root * value.x;
            rows[(2 * j + 1, column)] += root * value.y;
        };
        intrinsics(&there, &fixed.slots, |slot, c| put(slot, *c));
        for column in Column::ALL {
            put(fixed.free + column.index(), of.column(column));
        }
        let mut k = fixed.free + Column::COUNT;
        for a in 0..=SMOOTH_DEGREE {
            for b in 0..=SMOOTH_DEGREE - a {
                let value = flat.x.powi(a) * flat.y.powi(b);
                put(k, Vector2::new(value, 0.0));
                put(k + 1, Vector2::new(0.0, value));
                k += 2;
            }
        }
        put(k, observed - px);
        let by = by_pose(&there, &(place - center)) * root;
        poses.fixed_view_mut::<2, 6>(2 * j, 0).copy_from(&by);
    }
    let v = nalgebra::Matrix6::from_iterator((poses.transpose() * &poses).iter().copied()).cholesky()?;
    let w: Matrix6xX<f64> = Matrix6xX::from_iterator(width, (poses.transpose() * &rows).iter().copied());
    let answer = v.solve(&w);
    let s = rows.transpose() * &rows - w.transpose() * &answer;
    Some(Reduced { s, answer, center, corners: n })
}

struct Solved {
    /// Diagonal of L; 0 where an unknown is left out.
    roots: Vec<f64>,
    theta: Vec<f64>,
    gain: f64,
    rank: usize,
    right: DMatrix<f64>,
}

/// Solves normal equations; unknowns that those before them (or what was eliminated; `before` are the diagonals before that) leave next
/// to nothing of are left at 0.
/// Of several right sides the first is solved; all come back as L⁻¹ times themselves, with zeros where an unknown is left out.
fn solve(mut a: DMatrix<f64>, before: &[f64], mut h: DMatrix<f64>) -> Solved {
    let m = a.nrows();
    let mut kept = vec![false; m];
    let (mut gain, mut rank) = (0.0, 0);
    // L Lᵀ by columns; L overwrites the lower triangle.
    for k in 0..m {
        let d = a[(k, k)];
        if !(before[k] > 0.0 && d > INDEPENDENT * before[k]) {
            h.row_mut(k).fill(0.0);
            continue;
        }
        kept[k] = true;
        rank += 1;
        let root = d.sqrt();
        a[(k, k)] = root;
        h.row_mut(k).unscale_mut(root);
        gain += h[(k, 0)] * h[(k, 0)];
        for i in k + 1..m {
            a[(i, k)] /= root;
        }
        for j in k + 1..m {
            let by = a[(j, k)];
            if by == 0.0 {
                continue;
            }
            for c in 0..h.ncols() {
                h[(j, c)] -= by * h[(k, c)];
            }
            for i in j..m {
                a[(i, j)] -= a[(i, k)] * by;
            }
        }
    }
    let mut theta = vec![0.0; m];
    for k in (0..m).rev().filter(|k| kept[*k]) {
        let later: f64 = (k + 1..m).map(|i| a[(i, k)] * theta[i]).sum();
        theta[k] = (h[(k, 0)] - later) / a[(k, k)];
    }
    let roots = (0..m).map(|k| if kept[k] { a[(k, k)] } else { 0.0 }).collect();
    Solved { roots, theta, gain, rank, right: h }
}
