//! The board as a surface in its own frame: a plane, or a sheet bent about its y direction.
//!
//! A bent board is the parabolic cylinder `z = a (x − xc)²`, highest in the middle for a positive bend (its ends lie
//! `bend` further from the camera). Paper and thin plates bend without stretching, so printed coordinates are arc
//! lengths: with `q = 2 a (x − xc)`, `s = ((x − xc)·√(1 + q²) + asinh(q)/(2a)) / 2`.

use nalgebra::{Point3, Vector3};

use super::Board;

/// Maps between printed coordinates (board unit, from corner 0) and space.
#[derive(Clone, Copy, Debug)]
pub(super) struct Surface {
    /// Curvature `a` of the parabola, 1/unit; 0 is flat.
    a: f64,
    /// Middle of the board along x.
    xc: f64,
}

impl Surface {
    /// A plane.
    pub(super) const FLAT: Self = Self { a: 0.0, xc: 0.0 };

    /// The board's surface; `bend` is the sag over the width of the squares, in the board's unit.
    pub(super) fn new(board: &Board, bend: f64) -> Self {
        let half = f64::from(board.size.cols + 1) * board.square / 2.0;
        Self { a: bend / (half * half), xc: f64::from(board.size.cols - 1) * board.square / 2.0 }
    }

    /// The point in space of the printed coordinates `(s, y)`.
    pub(super) fn lift(&self, s: f64, y: f64) -> Point3<f64> {
        if self.a == 0.0 {
            return Point3::new(s, y, 0.0);
        }
        let along = s - self.xc;
        let mut dx = along;
        for _ in 0..20 {
            let slope = 2.0 * self.a * dx;
            dx -= (self.arc(dx) - along) / slope.hypot(1.0);
        }
        Point3::new(self.xc + dx, y, self.a * dx * dx)
    }

    /// Printed coordinates where a ray meets the board; NaN where it misses or the board lies behind its origin.
    pub(super) fn hit(&self, origin: &Vector3<f64>, direction: &Vector3<f64>) -> [f64; 2] {
        const MISS: [f64; 2] = [f64::NAN; 2];
        let t = if self.a == 0.0 {
            -origin.z / direction.z
        } else {
            // a (ox + t dx − xc)² = oz + t dz, and of the two roots the one of the nearly flat board.
            let ox = origin.x - self.xc;
            let qa = self.a * direction.x * direction.x;
            let qb = 2.0 * self.a * direction.x * ox - direction.z;
            let qc = self.a * ox * ox - origin.z;
            let disc = qb * qb - 4.0 * qa * qc;
            -2.0 * qc / (qb + disc.sqrt().copysign(qb))
        };
        if !(t > 0.0 && t.is_finite()) {
            return MISS;
        }
        let (x, y) = (origin.x + t * direction.x, origin.y + t * direction.y);
        if self.a == 0.0 { [x, y] } else { [self.xc + self.arc(x - self.xc), y] }
    }

    /// Arc length from the middle to `dx`.
    fn arc(&self, dx: f64) -> f64 {
        let q = 2.0 * self.a * dx;
        if q.abs() < 1e-5 {
            return dx * (1.0 + q * q / 6.0);
        }
        0.5 * (dx * q.hypot(1.0) + q.asinh() / (2.0 * self.a))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synth::Scene;

    #[test]
    fn rays_meet_the_bent_board_where_it_was_lifted() {
        for bend in [-8.0, 0.0, 1e-9, 2.0, 20.0] {
            let surface = Surface::new(&Scene::seed().board, bend);
            let eye = Vector3::new(30.0, -80.0, -600.0);
            for (s, y) in [(-30.0, -30.0), (0.0, 0.0), (120.0, 75.0), (271.3, 11.0)] {
                let p = surface.lift(s, y);
                let [s2, y2] = surface.hit(&eye, &((p.coords - eye) * 0.3));
                assert!((s2 - s).abs() < 1e-10 && (y2 - y).abs() < 1e-10, "bend {bend}: {s2} {y2}");
                assert!(surface.hit(&eye, &(eye - p.coords))[0].is_nan());
            }
        }
    }

    #[test]
    fn bending_does_not_stretch() {
        let surface = Surface::new(&Scene::seed().board, 20.0);
        let n = 20_000;
        let at = |i: i32| surface.lift(-30.0 + 300.0 * f64::from(i) / f64::from(n), 0.0);
        let length: f64 = (0..n).map(|i| (at(i + 1) - at(i)).norm()).sum();
        assert!((length - 300.0).abs() < 1e-6, "{length}");
        // The parabola passes through the ends of the flat board, so the ends of the unstretched one lie a little less deep.
        let sag = at(0).z - at(n / 2).z;
        assert!((19.0..20.0).contains(&sag), "{sag}");
    }
}
