//! From the hull of a region to a quadrangle.

use nalgebra::Vector2;

use super::regions::Region;

/// Share of the hull's area that its largest quadrangle must fill: of a disc it fills 0.64, of a hexagon 0.75.
const FILLED: f64 = 0.82;
/// Smallest area, px²; smallest side, px.
const SMALLEST: (f64, f64) = (45.0, 5.0);
/// Smallest sine of the angle at a corner: 14°.
const SHARPEST: f64 = 0.25;

/// A quadrangle that may be the outline of a marker.
#[derive(Clone, Copy, Debug)]
pub(super) struct Quad {
    /// Darker than its surroundings.
    pub(super) dark: bool,
    /// Corners, clockwise as seen in the picture, px, within about 2 px.
    pub(super) corners: [Vector2<f64>; 4],
}

impl Quad {
    /// Mean of the corners.
    pub(super) fn center(&self) -> Vector2<f64> {
        center(&self.corners)
    }

    /// Root of the area, px.
    pub(super) fn side(&self) -> f64 {
        side(&self.corners)
    }
}

pub(super) fn center(corners: &[Vector2<f64>; 4]) -> Vector2<f64> {
    corners.iter().sum::<Vector2<f64>>() / 4.0
}

pub(super) fn side(corners: &[Vector2<f64>; 4]) -> f64 {
    area(corners).abs().sqrt()
}

fn area(p: &[Vector2<f64>]) -> f64 {
    let next = p.iter().cycle().skip(1);
    0.5 * p.iter().zip(next).map(|(p, q)| p.perp(q)).sum::<f64>()
}

/// The quadrangle of a region; `None` where it is of another shape.
pub(super) fn quad(region: &Region) -> Option<Quad> {
    let whole = area(&region.hull);
    if region.hull.len() < 4 || whole < SMALLEST.0 {
        return None;
    }
    // Again and again the corner goes that cuts off least (M. Visvalingam & J. Whyatt, 1993).
    let mut p = region.hull.clone();
    while p.len() > 4 {
        let n = p.len();
        let cut = |i: usize| (p[i] - p[(i + n - 1) % n]).perp(&(p[(i + 1) % n] - p[i]));
        let least = (0..n).min_by(|a, b| cut(*a).total_cmp(&cut(*b)))?;
        p.remove(least);
    }
    let corners: [Vector2<f64>; 4] = p.try_into().ok()?;
    let fine = |i: usize| {
        let (a, b) = (corners[(i + 1) % 4] - corners[i], corners[(i + 2) % 4] - corners[(i + 1) % 4]);
        a.norm() >= SMALLEST.1 && a.perp(&b) >= SHARPEST * a.norm() * b.norm()
    };
    let filled = area(&corners) >= FILLED * whole;
    (filled && (0..4).all(fine)).then_some(Quad { dark: region.dark, corners })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cut_corners_and_other_shapes() {
        let v = |x: f64, y: f64| Vector2::new(x, y);
        let region = |hull: Vec<Vector2<f64>>| Region { dark: true, hull };
        let square = vec![v(1.0, 0.0), v(20.0, 0.0), v(20.0, 19.0), v(19.0, 20.0), v(0.0, 20.0), v(0.0, 1.0)];
        let q = quad(&region(square)).unwrap();
        assert!((q.side() - 20.0).abs() < 1.0 && (q.center() - v(10.0, 10.0)).norm() < 1.0);
        let disc = (0..40).map(|i| f64::from(i) * 0.157_08).map(|a| v(30.0 * a.cos(), 30.0 * a.sin()));
        assert!(quad(&region(disc.collect())).is_none());
        assert!(quad(&region(vec![v(0.0, 0.0), v(20.0, 0.0), v(0.0, 20.0)])).is_none());
        assert!(quad(&region(Vec::new())).is_none());
    }
}
