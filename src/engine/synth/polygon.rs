//! Convex polygons: what a line and what a circle leave of them.

use nalgebra::Vector2;

/// A convex polygon of at most eight vertices.
#[derive(Clone, Copy)]
pub(super) struct Polygon {
    vertices: [[f64; 2]; 8],
    n: usize,
}

impl Polygon {
    /// The parallelogram `center + j·[−½, ½]²`.
    pub(super) fn parallelogram(center: [f64; 2], j: [[f64; 2]; 2]) -> Self {
        let vertex =
            |u: f64, v: f64| [center[0] + u * j[0][0] + v * j[0][1], center[1] + u * j[1][0] + v * j[1][1]];
        let mut vertices = [[0.0; 2]; 8];
        vertices[..4].copy_from_slice(&[
            vertex(-0.5, -0.5),
            vertex(0.5, -0.5),
            vertex(0.5, 0.5),
            vertex(-0.5, 0.5),
        ]);
        Self { vertices, n: 4 }
    }

    /// The part with `lo ≤ coordinate < hi`.
    pub(super) fn between(&self, axis: usize, lo: f64, hi: f64) -> Self {
        let mut p = *self;
        if lo.is_finite() {
            p = p.clip(axis, lo, 1.0);
        }
        if hi.is_finite() {
            p = p.clip(axis, hi, -1.0);
        }
        p
    }

    /// The part on the side `side · (coordinate − at) ≥ 0` (Sutherland and Hodgman, CACM 17, 1974).
    fn clip(&self, axis: usize, at: f64, side: f64) -> Self {
        let mut out = Self { vertices: [[0.0; 2]; 8], n: 0 };
        for i in 0..self.n {
            let (a, b) = (self.vertices[i], self.vertices[(i + 1) % self.n]);
            let (da, db) = (side * (a[axis] - at), side * (b[axis] - at));
            if da >= 0.0 {
                out.push(a);
            }
            if (da > 0.0 && db < 0.0) || (da < 0.0 && db > 0.0) {
                let t = da / (da - db);
                out.push([a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])]);
            }
        }
        out
    }

    fn push(&mut self, v: [f64; 2]) {
        // Four half-planes add at most one vertex each to the four of the parallelogram.
        if self.n < self.vertices.len() {
            self.vertices[self.n] = v;
            self.n += 1;
        }
    }

    pub(super) fn area(&self) -> f64 {
        let o = self.vertices[0];
        let cross = |i: usize| {
            let (a, b) = (self.vertices[i], self.vertices[i + 1]);
            (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0])
        };
        0.5 * (1..self.n.saturating_sub(1)).map(cross).sum::<f64>().abs()
    }

    /// Area of the part inside of a circle: for each side the signed area between it, cut to the circle, and the centre.
    pub(super) fn area_in_circle(&self, center: [f64; 2], radius: f64) -> f64 {
        let at = |i: usize| Vector2::from(self.vertices[i % self.n]) - Vector2::from(center);
        let sector = |a: &Vector2<f64>, b: &Vector2<f64>| 0.5 * radius * radius * a.perp(b).atan2(a.dot(b));
        let side = |i: usize| {
            let (a, b) = (at(i), at(i + 1));
            let d = b - a;
            // |a + t d| = r.
            let (dd, ad) = (d.norm_squared(), a.dot(&d));
            let root = ad * ad - dd * (a.norm_squared() - radius * radius);
            if root <= 0.0 {
                return sector(&a, &b);
            }
            let [from, to] = [-root.sqrt(), root.sqrt()].map(|r| (r - ad) / dd);
            if to <= 0.0 || from >= 1.0 {
                return sector(&a, &b);
            }
            let (p, q) = (a + d * from.max(0.0), a + d * to.min(1.0));
            0.5 * p.perp(&q) + sector(&a, &p) + sector(&q, &b)
        };
        (0..self.n).map(side).sum::<f64>().abs()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn areas_in_a_circle_agree_with_dense_sampling() {
        let (center, radius) = ([0.3, -0.2], 0.7);
        // Inside, outside, across, around, and with a side that is tangent.
        let cases = [
            ([0.2, -0.1], [[0.1, 0.02], [-0.03, 0.1]]),
            ([1.9, 1.4], [[0.2, 0.1], [0.0, 0.2]]),
            ([0.9, 0.1], [[0.5, 0.2], [-0.3, 0.6]]),
            ([0.4, -0.3], [[4.0, 0.3], [0.1, 3.0]]),
            ([1.25, -0.2], [[0.5, 0.0], [0.0, 0.5]]),
            ([0.3, 0.4], [[3.0, 0.1], [0.1, 0.2]]),
        ];
        for (at, j) in cases {
            const N: i32 = 1000;
            let off = |i: i32| (f64::from(i) + 0.5) / f64::from(N) - 0.5;
            let inside = |i: &i32| {
                let (u, v) = (off(i % N), off(i / N));
                let [x, y] = [0, 1].map(|k| at[k] + j[k][0] * u + j[k][1] * v - center[k]);
                x.hypot(y) < radius
            };
            let share = (0..N * N).filter(inside).count() as f64 / f64::from(N * N);
            let polygon = Polygon::parallelogram(at, j);
            let got = polygon.area_in_circle(center, radius) / polygon.area();
            assert!((got - share).abs() < 1e-4, "{at:?} {j:?}: {got} {share}");
        }
    }
}
