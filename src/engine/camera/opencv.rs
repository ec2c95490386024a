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
//! documentation of `calib3d`, which is `[cos τx 0 0; −sin τx sin τy  cos τy  0; R20 R21 R22]`. D. Claus, A. Fitzgibbon,
//! "A rational function lens distortion model for general cameras", CVPR 2005; J. Weng et al., "Camera calibration with distortion
//! models and accuracy evaluation", IEEE TPAMI 14(10), 1992 (thin prism); T. Louhichi et al., "Self-calibration of Scheimpflug
//! cameras", Meas. Sci. Technol. 18, 2007 (tilt).
//! Nothing at or behind Z = 0 is seen, nor what lies at or beyond a pole of `c`.

use nalgebra::{Matrix3, Vector3};

use super::{
    Batch, LANES, Lanes,
    at::{self, At},
};

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
    /// How far the terms move them.
    far: [f64; 6],
}

/// For each term, in OpenCV's order, its way ([`Seen::ways`]) and how far it goes ([`Seen::far`]).
const TERMS: [(usize, usize); 14] = [
    (0, 0),
    (0, 1),
    (1, 0),
    (2, 0),
    (0, 2),
    (0, 3),
    (0, 4),
    (0, 5),
    (3, 0),
    (3, 1),
    (4, 0),
    (4, 1),
    (5, 0),
    (6, 0),
];

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
    Bent { xd, yd, ways, far: [1.0, r2, r4, -c, -c * r2, -c * r4] }
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

/// `T` with its derivatives by τx and τy.
#[inline(always)]
fn tilt(tx: f64, ty: f64) -> [Matrix3<f64>; 3] {
    let ((sx, cx), (sy, cy)) = (tx.sin_cos(), ty.sin_cos());
    [
        Matrix3::new(cx, 0.0, 0.0, -sx * sy, cy, 0.0, sy, -cy * sx, cy * cx),
        Matrix3::new(-sx, 0.0, 0.0, -cx * sy, 0.0, 0.0, 0.0, -cy * cx, -cy * sx),
        Matrix3::new(0.0, 0.0, 0.0, -sx * cy, -sy, 0.0, cy, sy * sx, -sy * cx),
    ]
}

/// [`tilt`], if the model has one.
#[inline(always)]
fn tilted<const N: usize>(p: &[f64]) -> Option<[Matrix3<f64>; 3]> {
    (N == 18).then(|| tilt(p[16], p[17]))
}

/// A point in normalised coordinates of the sensor.
struct Seen {
    place: [f64; 2],
    by_point: [[f64; 3]; 2],
    /// Directions in which the terms move it: [`Bent::ways`], then those of the tilt.
    ways: [[f64; 2]; 7],
    far: [f64; 6],
}

#[inline(always)]
fn seen(tilted: Option<&[Matrix3<f64>; 3]>, q: &[f64; 14], point: [f64; 3]) -> Seen {
    let [iz, x, y] = normalised(point);
    let b = bent(q, x, y);
    let by = |[dx, dy]: [f64; 2]| [dx * iz, dy * iz, -(dx * x + dy * y) * iz];
    let [w0, w1, w2, w3, w4] = b.ways;
    let Some([t, t_by_tx, t_by_ty]) = tilted else {
        return Seen {
            place: [b.xd.v, b.yd.v],
            by_point: [by([b.xd.x, b.xd.y]), by([b.yd.x, b.yd.y])],
            ways: [w0, w1, w2, w3, w4, [0.0; 2], [0.0; 2]],
            far: b.far,
        };
    };
    let d = Vector3::new(b.xd.v, b.yd.v, 1.0);
    let h = t * d;
    let iw = 1.0 / h.z;
    let (xt, yt) = (h.x * iw, h.y * iw);
    // How (xt, yt) follows a change of T (xd, yd, 1).
    let moved = |dh: Vector3<f64>| [(dh.x - xt * dh.z) * iw, (dh.y - yt * dh.z) * iw];
    let by_xd = moved(t.column(0).into());
    let by_yd = moved(t.column(1).into());
    let through = |[dx, dy]: [f64; 2]| [by_xd[0] * dx + by_yd[0] * dy, by_xd[1] * dx + by_yd[1] * dy];
    let (by_x, by_y) = (through([b.xd.x, b.yd.x]), through([b.xd.y, b.yd.y]));
    Seen {
        place: [xt, yt],
        by_point: [by([by_x[0], by_y[0]]), by([by_x[1], by_y[1]])],
        ways: [
            through(w0),
            through(w1),
            through(w2),
            through(w3),
            through(w4),
            moved(t_by_tx * d),
            moved(t_by_ty * d),
        ],
        far: b.far,
    }
}

/// The first `N` parameters, four of the pinhole and all terms that there are; 18 with the tilt. What is the same for all points is
/// computed once.
#[inline(always)]
pub(super) fn at<const N: usize>(p: &[f64]) -> impl Fn(&[f64], [f64; 3]) -> At<N> + Copy {
    let tilted = tilted::<N>(p);
    move |p, point| {
        let seen = seen(tilted.as_ref(), &terms::<N>(p), point);
        At::scaled(p, seen.place, seen.by_point, |k| {
            let (way, far) = TERMS[k];
            seen.ways[way].map(|d| d * seen.far[far])
        })
    }
}

/// [`at()`] without derivatives.
#[inline(always)]
pub(super) fn px<const N: usize>(p: &[f64]) -> impl Fn(&[f64], [f64; 3]) -> [f64; 2] + Copy {
    let tilted = tilted::<N>(p);
    #[inline(always)]
    move |p, point| {
        let [_, x, y] = normalised(point);
        let b = bent(&terms::<N>(p), x, y);
        let place = tilted.map_or([b.xd.v, b.yd.v], |[t, ..]| {
            let h = t * Vector3::new(b.xd.v, b.yd.v, 1.0);
            [h.x / h.z, h.y / h.z]
        });
        [p[0] * place[0] + p[2], p[1] * place[1] + p[3]]
    }
}

/// [`super::Spec::project_batch`].
pub(super) fn all<const N: usize>(p: &[f64], points: &[Lanes; 3], out: &mut Batch) {
    if cfg!(target_arch = "wasm32") {
        return at::all(at::<N>(p), p, points, out);
    }
    at::batch(lanes::<N>, p, points, out);
}

/// [`super::Spec::project_px_batch`].
pub(super) fn all_px<const N: usize>(p: &[f64], points: &[Lanes; 3], out: &mut [Lanes; 2]) {
    at::all_px(px::<N>(p), p, points, out);
}

/// [`at()`] over a batch: first what the columns are made of, then the columns, so that both loops run in lanes.
#[inline(always)]
fn lanes<const N: usize>(p: &[f64], points: &[Lanes; 3], out: &mut Batch) {
    let (q, tilted) = (terms::<N>(p), tilted::<N>(p));
    let (mut ways, mut far) = ([[[0.0; LANES]; 7]; 2], [[0.0; LANES]; 6]);
    for l in 0..LANES {
        let seen = seen(tilted.as_ref(), &q, [points[0][l], points[1][l], points[2][l]]);
        for side in 0..2 {
            let (f, c) = (p[side], p[2 + side]);
            out.px[side][l] = f * seen.place[side] + c;
            out.by_params[side][side][l] = seen.place[side];
            out.by_params[side][2 + side][l] = 1.0;
            for k in 0..3 {
                out.by_point[side][k][l] = f * seen.by_point[side][k];
            }
            for k in 0..7 {
                ways[side][k][l] = seen.ways[k][side];
            }
        }
        for k in 0..6 {
            far[k][l] = seen.far[k];
        }
    }
    for side in 0..2 {
        for (to, (way, length)) in out.by_params[side][4..N].iter_mut().zip(TERMS) {
            for l in 0..LANES {
                to[l] = p[side] * (ways[side][way][l] * far[length][l]);
            }
        }
    }
}
