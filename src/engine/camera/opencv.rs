//! OpenCV's perspective lens with up to 14 terms, `k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4 τx τy`: the common body of the rational,
//! thin-prism and tilted models.
//!
//! With `x = X/Z`, `y = Y/Z`, `r² = x² + y²`:
//!
//! ```text
//! c  = (1 + k1 r² + k2 r⁴ + k3 r⁶) / (1 + k4 r² + k5 r⁴ + k6 r⁶)
//! xd = x c + 2 p1 x y + p2 (r² + 2 x²) + s1 r² + s2 r⁴
//! yd = y c + p1 (r² + 2 y²) + 2 p2 x y + s3 r² + s4 r⁴
//! w (xt, yt, 1) = T(τx, τy) (xd, yd, 1)              u = fx xt + cx, v = fy yt + cy
//! ```
//!
//! `T` is the view of a sensor that is turned by `R = Ry(τy) Rx(τx)`: `T = [R22 0 −R02; 0 R22 −R12; 0 0 1] R`, of the OpenCV
//! documentation of `calib3d`. D. Claus, A. Fitzgibbon, "A rational function lens distortion model for general cameras", CVPR
//! 2005; J. Weng et al., "Camera calibration with distortion models and accuracy evaluation", IEEE TPAMI 14(10), 1992 (thin prism);
//! T. Louhichi et al., "Self-calibration of Scheimpflug cameras", Meas. Sci. Technol. 18, 2007 (tilt).
//! Nothing at or behind Z = 0 is seen, nor what lies at or beyond a pole of `c`.

use nalgebra::{Matrix3, Vector3};

use super::at::At;

/// A value with its derivatives by x and y.
#[derive(Clone, Copy)]
struct By {
    v: f64,
    x: f64,
    y: f64,
}

/// Distorted coordinates before the tilt.
struct Bent {
    xd: By,
    yd: By,
    /// Directions in which the terms move them: along the radius, the two tangential ones, x, y.
    ways: [[f64; 2]; 5],
    /// Derivatives by the terms, in OpenCV's order without the tilt: which way, and how far.
    terms: [(usize, f64); 12],
}

/// `q` has the terms that follow `fx fy cx cy`.
#[inline(always)]
fn bent(q: &[f64; 14], x: f64, y: f64) -> Bent {
    let [k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4, ..] = *q;
    let (xx, yy, xy2) = (x * x, y * y, 2.0 * x * y);
    let r2 = xx + yy;
    let r4 = r2 * r2;
    let above = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
    let below = 1.0 + r2 * (k4 + r2 * (k5 + r2 * k6));
    let ib = if below > 0.0 { 1.0 / below } else { f64::NAN };
    let c = above * ib;
    let dc = ((k1 + r2 * (2.0 * k2 + 3.0 * k3 * r2)) - c * (k4 + r2 * (2.0 * k5 + 3.0 * k6 * r2))) * ib;
    let (tx, ty) = (r2 + 2.0 * xx, r2 + 2.0 * yy);
    let cross = xy2 * dc + 2.0 * (p1 * x + p2 * y);
    let (sx, sy) = (2.0 * (s1 + 2.0 * s2 * r2), 2.0 * (s3 + 2.0 * s4 * r2));
    let xd = By {
        v: x * c + p1 * xy2 + p2 * tx + s1 * r2 + s2 * r4,
        x: c + 2.0 * xx * dc + 2.0 * p1 * y + 6.0 * p2 * x + sx * x,
        y: cross + sx * y,
    };
    let yd = By {
        v: y * c + p1 * ty + p2 * xy2 + s3 * r2 + s4 * r4,
        x: cross + sy * x,
        y: c + 2.0 * yy * dc + 6.0 * p1 * y + 2.0 * p2 * x + sy * y,
    };
    let ways = [[x * ib * r2, y * ib * r2], [xy2, ty], [tx, xy2], [r2, 0.0], [0.0, r2]];
    let terms = [
        (0, 1.0),
        (0, r2),
        (1, 1.0),
        (2, 1.0),
        (0, r4),
        (0, -c),
        (0, -c * r2),
        (0, -c * r4),
        (3, 1.0),
        (3, r2),
        (4, 1.0),
        (4, r2),
    ];
    Bent { xd, yd, ways, terms }
}

/// Ray in front of the camera → `1/z`, `x`, `y`; NaN elsewhere.
#[inline(always)]
fn normalised([x, y, z]: [f64; 3]) -> [f64; 3] {
    let iz = if z > 0.0 { 1.0 / z } else { f64::NAN };
    [iz, x * iz, y * iz]
}

/// The terms of a model with `N` parameters, the rest zero.
#[inline(always)]
fn terms<const N: usize>(p: &[f64]) -> [f64; 14] {
    let mut q = [0.0; 14];
    q[..N - 4].copy_from_slice(&p[4..N]);
    q
}

/// Without tilt; `N` is 12 or 16 parameters, or fewer.
#[inline(always)]
pub(super) fn at<const N: usize>(p: &[f64], point: [f64; 3]) -> At<N> {
    let [iz, x, y] = normalised(point);
    let b = bent(&terms::<N>(p), x, y);
    let by = |d: By| [d.x * iz, d.y * iz, -(d.x * x + d.y * y) * iz];
    At::scaled(p, [b.xd.v, b.yd.v], [by(b.xd), by(b.yd)], |k| {
        let (way, far) = b.terms[k];
        b.ways[way].map(|d| d * far)
    })
}

/// [`at`] without derivatives.
#[inline(always)]
pub(super) fn px<const N: usize>(p: &[f64], point: [f64; 3]) -> [f64; 2] {
    let [_, x, y] = normalised(point);
    let b = bent(&terms::<N>(p), x, y);
    [p[0] * b.xd.v + p[2], p[1] * b.yd.v + p[3]]
}

/// `T` with its derivatives by τx and τy.
#[inline(always)]
fn tilt(tx: f64, ty: f64) -> [Matrix3<f64>; 3] {
    let ((sx, cx), (sy, cy)) = (tx.sin_cos(), ty.sin_cos());
    let rx = Matrix3::new(1.0, 0.0, 0.0, 0.0, cx, sx, 0.0, -sx, cx);
    let drx = Matrix3::new(0.0, 0.0, 0.0, 0.0, -sx, cx, 0.0, -cx, -sx);
    let ry = Matrix3::new(cy, 0.0, -sy, 0.0, 1.0, 0.0, sy, 0.0, cy);
    let dry = Matrix3::new(-sy, 0.0, -cy, 0.0, 0.0, 0.0, cy, 0.0, -sy);
    let view = |r: &Matrix3<f64>, last: f64| {
        Matrix3::new(r[(2, 2)], 0.0, -r[(0, 2)], 0.0, r[(2, 2)], -r[(1, 2)], 0.0, 0.0, last)
    };
    let r = ry * rx;
    let z = view(&r, 1.0);
    let by = |d: Matrix3<f64>| view(&d, 0.0) * r + z * d;
    [z * r, by(ry * drx), by(dry * rx)]
}

/// With tilt, 18 parameters; what is the same for all points is computed once.
#[inline(always)]
pub(super) fn at_tilted(p: &[f64]) -> impl Fn(&[f64], [f64; 3]) -> At<18> + Copy {
    let tilted = tilt(p[16], p[17]);
    move |p, point| at_tilted_by(&tilted, p, point)
}

#[inline(always)]
fn at_tilted_by([t, t_by_tx, t_by_ty]: &[Matrix3<f64>; 3], p: &[f64], point: [f64; 3]) -> At<18> {
    let [iz, x, y] = normalised(point);
    let b = bent(&terms::<18>(p), x, y);
    let d = Vector3::new(b.xd.v, b.yd.v, 1.0);
    let h = t * d;
    let iw = 1.0 / h.z;
    let (xt, yt) = (h.x * iw, h.y * iw);
    // How (xt, yt) follows a change of T (xd, yd, 1).
    let moved = |dh: Vector3<f64>| [(dh.x - xt * dh.z) * iw, (dh.y - yt * dh.z) * iw];
    let by_xd = moved(t.column(0).into());
    let by_yd = moved(t.column(1).into());
    let through = |dx: f64, dy: f64| [0, 1].map(|i| by_xd[i] * dx + by_yd[i] * dy);
    let (by_x, by_y) = (through(b.xd.x, b.yd.x), through(b.xd.y, b.yd.y));
    let by = |i: usize| [by_x[i] * iz, by_y[i] * iz, -(by_x[i] * x + by_y[i] * y) * iz];
    let (by_tx, by_ty) = (moved(t_by_tx * d), moved(t_by_ty * d));
    let ways = b.ways.map(|[dx, dy]| through(dx, dy));
    At::scaled(p, [xt, yt], [by(0), by(1)], |k| match k {
        12 => by_tx,
        13 => by_ty,
        _ => {
            let (way, far) = b.terms[k];
            ways[way].map(|d| d * far)
        }
    })
}

/// [`at_tilted`] without derivatives.
#[inline(always)]
pub(super) fn px_tilted(p: &[f64]) -> impl Fn(&[f64], [f64; 3]) -> [f64; 2] + Copy {
    let [t, ..] = tilt(p[16], p[17]);
    move |p, point| px_tilted_by(&t, p, point)
}

#[inline(always)]
fn px_tilted_by(t: &Matrix3<f64>, p: &[f64], point: [f64; 3]) -> [f64; 2] {
    let [_, x, y] = normalised(point);
    let b = bent(&terms::<18>(p), x, y);
    let h = t * Vector3::new(b.xd.v, b.yd.v, 1.0);
    [p[0] * (h.x / h.z) + p[2], p[1] * (h.y / h.z) + p[3]]
}
