//! Parts of the picture in which no corner lies.

use nalgebra::Vector2;

/// A part of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Region {
    /// With preposition and article.
    pub name: &'static str,
    /// Left, top, right, bottom in shares of the picture.
    pub share: [f64; 4],
}

impl Region {
    /// The name alone: `left quarter`.
    pub fn place(&self) -> &'static str {
        ["in the ", "at the "].into_iter().find_map(|p| self.name.strip_prefix(p)).unwrap_or(self.name)
    }

    /// Whether it is a quarter of the picture.
    pub fn is_quarter(&self) -> bool {
        let [x0, y0, x1, y1] = self.share;
        (x1 - x0) * (y1 - y0) >= 0.25
    }

    /// Whether a place, in shares of the picture, lies in it.
    pub fn holds(&self, [u, v]: [f64; 2]) -> bool {
        let [x0, y0, x1, y1] = self.share;
        (x0..=x1).contains(&u) && (y0..=y1).contains(&v)
    }
}

/// Parts that are looked at, larger ones first.
const REGIONS: [(&str, [f64; 4]); 12] = [
    ("in the left quarter", [0.0, 0.0, 0.25, 1.0]),
    ("in the right quarter", [0.75, 0.0, 1.0, 1.0]),
    ("in the upper quarter", [0.0, 0.0, 1.0, 0.25]),
    ("in the lower quarter", [0.0, 0.75, 1.0, 1.0]),
    ("at the left edge", [0.0, 0.0, 0.12, 1.0]),
    ("at the right edge", [0.88, 0.0, 1.0, 1.0]),
    ("at the upper edge", [0.0, 0.0, 1.0, 0.12]),
    ("at the lower edge", [0.0, 0.88, 1.0, 1.0]),
    ("in the upper left corner", [0.0, 0.0, 0.2, 0.2]),
    ("in the upper right corner", [0.8, 0.0, 1.0, 0.2]),
    ("in the lower left corner", [0.0, 0.8, 0.2, 1.0]),
    ("in the lower right corner", [0.8, 0.8, 1.0, 1.0]),
];

/// The parts without a corner; what lies inside a larger one is not said again. Points in px.
pub fn empty(points: &[Vector2<f64>], size_px: [u32; 2]) -> Vec<Region> {
    let [w, h] = size_px.map(|n| f64::from(n.max(1)));
    let mut found: Vec<Region> = Vec::new();
    for (name, share) in REGIONS {
        let region = Region { name, share };
        let within = |r: &Region| {
            r.share[0] <= share[0]
                && r.share[1] <= share[1]
                && r.share[2] >= share[2]
                && r.share[3] >= share[3]
        };
        let is_empty = !points.iter().any(|p| region.holds([(p.x + 0.5) / w, (p.y + 0.5) / h]));
        if is_empty && !found.iter().any(within) {
            found.push(region);
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn empty_parts_are_named_once() {
        let points = |from: u32| -> Vec<Vector2<f64>> {
            (from..100)
                .flat_map(|x| (0..100).map(move |y| Vector2::new(f64::from(x), f64::from(y))))
                .collect()
        };
        let names: Vec<_> = empty(&points(30), [100, 100]).iter().map(|r| r.name).collect();
        assert_eq!(names, ["in the left quarter"]);
        assert!(empty(&points(0), [100, 100]).is_empty());
        assert_eq!(empty(&[Vector2::new(50.0, 50.0)], [100, 100]).len(), 4);
    }
}
