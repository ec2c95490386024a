//! Homographies between the plane of the board and the picture: normalised direct linear transform, RANSAC.
//!
//! `w (u, v, 1)ᵀ = H (x, y, 1)ᵀ`. Each pair gives two equations linear in H; with `S = Σ p pᵀ`, `U = Σ u p pᵀ`,
//! `V = Σ v p pᵀ`, `Q = Σ (u² + v²) p pᵀ`, `p = (x, y, 1)`, the first two rows of H follow from the third, `h₁ = S⁻¹ U h₃`,
//! `h₂ = S⁻¹ V h₃`, and h₃ is the eigenvector of the smallest eigenvalue of `Q − U S⁻¹ U − V S⁻¹ V`: a 3×3 problem with the
//! same answer as the 9×9 one under the constraint |h₃| = 1. Both point sets are shifted to their centroid and scaled to a
//! mean distance of √2 first.
//!
//! R. Hartley, "In defense of the eight-point algorithm", PAMI 19(6), 1997; M. Fischler, R. Bolles, "Random sample
//! consensus", CACM 24(6), 1981.

use nalgebra::{Matrix3, RealField, SymmetricEigen, Vector2, Vector3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// How homographies are fitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Options {
    /// Shift and scale both point sets before the linear solution.
    pub normalise: bool,
    /// Look for a consensus where the plain fit leaves gross errors.
    pub ransac: bool,
    /// Do the linear algebra in `f32`.
    pub single_precision: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self { normalise: true, ransac: true, single_precision: false }
    }
}

/// A homography and the pairs that support it.
#[derive(Clone, Debug)]
pub struct Fit {
    /// Picture from board, scaled to a third row of unit length, positive at the middle of the points.
    pub matrix: Matrix3<f64>,
    /// Whether each pair was used.
    pub inliers: Vec<bool>,
    /// √(Σ|r|²/n) over the inliers, px.
    pub rms_px: f64,
}

/// Where a homography puts a point of the plane.
pub fn apply(h: &Matrix3<f64>, p: &Vector2<f64>) -> Vector2<f64> {
    let q = h * Vector3::new(p.x, p.y, 1.0);
    Vector2::new(q.x / q.z, q.y / q.z)
}

/// Fits the homography `image ≈ H board`. `None` where fewer than four pairs are given or the points lie on a line.
pub fn fit(board: &[Vector2<f64>], image: &[Vector2<f64>], options: Options) -> Option<Fit> {
    let n = board.len().min(image.len());
    let (board, image) = (&board[..n], &image[..n]);
    let plain = solve(board, image, options)?;
    let errors: Vec<f64> = errors(&plain, board, image);
    let bent = BENT * extent(image);
    if !options.ransac || errors.iter().all(|e| *e <= bent) {
        return Some(Fit { rms_px: rms(errors.iter().copied()), matrix: plain, inliers: vec![true; n] });
    }
    let (consensus, inliers) = consensus(board, image, options, &plain)?;
    let kept = errors_of(&consensus, board, image, &inliers);
    Some(Fit { rms_px: rms(kept.into_iter()), matrix: consensus, inliers })
}

/// A lens may bend the picture of a board by this share of it.
const BENT: f64 = 0.02;

fn extent(image: &[Vector2<f64>]) -> f64 {
    image.iter().map(|p| (p - image[0]).norm()).fold(0.0, f64::max)
}

/// RANSAC on minimal samples of four, then a fit to all that agree, twice.
fn consensus(
    board: &[Vector2<f64>],
    image: &[Vector2<f64>],
    options: Options,
    plain: &Matrix3<f64>,
) -> Option<(Matrix3<f64>, Vec<bool>)> {
    const SAMPLES: usize = 64;
    let n = board.len();
    let mut random = Pcg64Mcg::seed_from_u64(n as u64);
    let mut best = (*plain, median(errors(plain, board, image)));
    for _ in 0..SAMPLES {
        let mut pick = [0usize; 4];
        for k in 0..4 {
            pick[k] = loop {
                let i = random.random_range(0..n);
                if !pick[..k].contains(&i) {
                    break i;
                }
            };
        }
        let (b, i) = (pick.map(|i| board[i]), pick.map(|k| image[k]));
        if let Some(h) = solve(&b, &i, options) {
            // Least median: needs no threshold, stands up to half the pairs being wrong.
            let m = median(errors(&h, board, image));
            if m < best.1 {
                best = (h, m);
            }
        }
    }
    let mut h = best.0;
    let mut inliers = vec![true; n];
    for _ in 0..2 {
        let e = errors(&h, board, image);
        let limit = (5.0 * median(e.clone())).max(BENT * extent(image));
        inliers = e.iter().map(|e| *e <= limit).collect();
        let keep = |v: &[Vector2<f64>]| -> Vec<_> {
            v.iter().zip(&inliers).filter(|(_, k)| **k).map(|(p, _)| *p).collect()
        };
        h = solve(&keep(board), &keep(image), options)?;
    }
    Some((h, inliers))
}

fn errors(h: &Matrix3<f64>, board: &[Vector2<f64>], image: &[Vector2<f64>]) -> Vec<f64> {
    board
        .iter()
        .zip(image)
        .map(|(b, i)| {
            let e = (apply(h, b) - i).norm();
            if e.is_finite() { e } else { f64::MAX }
        })
        .collect()
}

fn errors_of(h: &Matrix3<f64>, board: &[Vector2<f64>], image: &[Vector2<f64>], keep: &[bool]) -> Vec<f64> {
    errors(h, board, image).into_iter().zip(keep).filter(|(_, k)| **k).map(|(e, _)| e).collect()
}

fn rms(errors: impl ExactSizeIterator<Item = f64>) -> f64 {
    let n = errors.len().max(1) as f64;
    (errors.map(|e| e * e).sum::<f64>() / n).sqrt()
}

fn median(mut values: Vec<f64>) -> f64 {
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

fn solve(board: &[Vector2<f64>], image: &[Vector2<f64>], options: Options) -> Option<Matrix3<f64>> {
    if options.single_precision {
        let single = |v: &[Vector2<f64>]| -> Vec<Vector2<f32>> { v.iter().map(|p| p.cast()).collect() };
        dlt(&single(board), &single(image), options.normalise).map(|h| h.cast())
    } else {
        dlt(board, image, options.normalise)
    }
}

/// Shift by `-center`, then scale.
struct Similarity<T> {
    center: Vector2<T>,
    scale: T,
}

impl<T: RealField + Copy> Similarity<T> {
    fn of(points: &[Vector2<T>], normalise: bool) -> Option<Self> {
        if !normalise {
            return Some(Self { center: Vector2::zeros(), scale: T::one() });
        }
        let n: T = nalgebra::convert(points.len() as f64);
        let center = points.iter().fold(Vector2::zeros(), |a, p| a + p) / n;
        let spread = points.iter().fold(T::zero(), |a, p| a + (p - center).norm()) / n;
        let scale = nalgebra::convert::<f64, T>(std::f64::consts::SQRT_2) / spread;
        scale.is_finite().then_some(Self { center, scale })
    }

    fn apply(&self, p: &Vector2<T>) -> Vector2<T> {
        (p - self.center) * self.scale
    }
}

/// Direct linear transform of all pairs; see the module's documentation.
fn dlt<T: RealField + Copy>(
    board: &[Vector2<T>],
    image: &[Vector2<T>],
    normalise: bool,
) -> Option<Matrix3<T>> {
    if board.len() < 4 {
        return None;
    }
    let (from, to) = (Similarity::of(board, normalise)?, Similarity::of(image, normalise)?);
    let zero = Matrix3::<T>::zeros();
    let (mut s, mut u, mut v, mut q) = (zero, zero, zero, zero);
    for (b, i) in board.iter().zip(image) {
        let (b, i) = (from.apply(b), to.apply(i));
        let p = Vector3::new(b.x, b.y, T::one());
        let pp = p * p.transpose();
        s += pp;
        u += pp * i.x;
        v += pp * i.y;
        q += pp * i.norm_squared();
    }
    let inverse = s.cholesky()?.inverse();
    let (a, b) = (inverse * u, inverse * v);
    let reduced = q - u * a - v * b;
    let eigen = SymmetricEigen::try_new(reduced, T::default_epsilon(), 100)?;
    let order = ascending(&eigen.eigenvalues);
    // Corners on a line leave a second solution.
    let (second, largest) = (eigen.eigenvalues[order[1]], eigen.eigenvalues[order[2]]);
    let tiny: T = nalgebra::convert(if normalise { 1e-9 } else { 0.0 });
    if second <= largest * tiny {
        return None;
    }
    let h3 = eigen.eigenvectors.column(order[0]).into_owned();
    let (h1, h2) = (a * h3, b * h3);
    let h = Matrix3::from_rows(&[h1.transpose(), h2.transpose(), h3.transpose()]);
    // The picture of the board is a line.
    if normalise && h.determinant().abs() < nalgebra::convert(1e-6) {
        return None;
    }
    // Undo the normalisation: T_image⁻¹ H T_board.
    let shrink = |c: Vector2<T>, k: T| {
        Matrix3::new(k, T::zero(), -c.x * k, T::zero(), k, -c.y * k, T::zero(), T::zero(), T::one())
    };
    let grow = Matrix3::new(
        T::one() / to.scale,
        T::zero(),
        to.center.x,
        T::zero(),
        T::one() / to.scale,
        to.center.y,
        T::zero(),
        T::zero(),
        T::one(),
    );
    let h = grow * h * shrink(from.center, from.scale);
    let n: T = nalgebra::convert(board.len() as f64);
    let middle = board.iter().fold(Vector2::zeros(), |a, p| a + p) / n;
    let w = (h * Vector3::new(middle.x, middle.y, T::one())).z;
    let scale = h.row(2).norm() * if w < T::zero() { -T::one() } else { T::one() };
    let h = h / scale;
    h.iter().all(|x| x.is_finite()).then_some(h)
}

/// Positions of three numbers from the smallest to the largest.
fn ascending<T: RealField + Copy>(values: &Vector3<T>) -> [usize; 3] {
    let mut order = [0, 1, 2];
    order.sort_by(|a, b| values[*a].partial_cmp(&values[*b]).unwrap_or(std::cmp::Ordering::Equal));
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid() -> Vec<Vector2<f64>> {
        (0..54).map(|i| Vector2::new(f64::from(i % 9) * 25.0, f64::from(i / 9) * 25.0)).collect()
    }

    fn truth() -> Matrix3<f64> {
        Matrix3::new(3.1, -0.4, 120.0, 0.3, 2.8, 95.0, 4e-4, -7e-4, 1.0)
    }

    #[test]
    fn exact_pairs_give_the_homography() {
        let (board, h) = (grid(), truth());
        let image: Vec<_> = board.iter().map(|p| apply(&h, p)).collect();
        for normalise in [true, false] {
            let fit = fit(&board, &image, Options { normalise, ..Options::default() }).unwrap();
            let worst = board.iter().zip(&image).map(|(b, i)| (apply(&fit.matrix, b) - i).norm());
            let bound = if normalise { 1e-10 } else { 1e-4 };
            assert!(worst.fold(0.0, f64::max) < bound && fit.inliers.iter().all(|k| *k), "{normalise}");
        }
    }

    #[test]
    fn single_precision_needs_the_normalisation() {
        let (board, h) = (grid(), truth());
        let image: Vec<_> = board.iter().map(|p| apply(&h, p)).collect();
        let rms = |normalise| {
            let options = Options { normalise, ransac: false, single_precision: true };
            fit(&board, &image, options).map_or(f64::INFINITY, |f| f.rms_px)
        };
        assert!(rms(true) < 1e-4 && rms(false) > 10.0 * rms(true), "{} {}", rms(true), rms(false));
    }

    #[test]
    fn a_consensus_ignores_wrong_corners() {
        let (board, h) = (grid(), truth());
        let mut image: Vec<_> = board.iter().map(|p| apply(&h, p)).collect();
        for i in (0..54).step_by(4) {
            image[i] += Vector2::new(40.0 + i as f64, -30.0);
        }
        let fit = fit(&board, &image, Options::default()).unwrap();
        assert!((0..54).all(|i| fit.inliers[i] == (i % 4 != 0)), "{:?}", fit.inliers);
        assert!((fit.matrix / fit.matrix[(2, 2)] - h).norm() < 1e-9);
        let without = Options { ransac: false, ..Options::default() };
        assert!(super::fit(&board, &image, without).unwrap().rms_px > 10.0);
    }

    #[test]
    fn lines_and_too_few_points_have_none() {
        let line: Vec<_> = (0..9).map(|i| Vector2::new(f64::from(i), 0.0)).collect();
        let image: Vec<_> = line.iter().map(|p| p * 30.0 + Vector2::new(10.0, 20.0)).collect();
        assert!(fit(&line, &image, Options::default()).is_none());
        assert!(fit(&grid()[..3], &grid()[..3], Options::default()).is_none());
        // A board seen exactly from its side: the picture is a line though the board is not.
        let flat: Vec<_> = grid().iter().map(|p| Vector2::new(p.x, 100.0)).collect();
        assert!(fit(&grid(), &flat, Options::default()).is_none());
        assert!(fit(&grid(), &vec![Vector2::new(5.0, 5.0); 54], Options::default()).is_none());
    }
}
