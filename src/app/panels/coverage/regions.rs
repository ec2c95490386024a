//! Parts of the picture in which no corner lies.

/// An empty part.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Region {
    /// With its article.
    pub(super) name: &'static str,
    /// Left, top, right, bottom in shares of the picture.
    pub(super) share: [f32; 4],
}

/// Parts that are looked at, larger ones first.
const REGIONS: [(&str, [f32; 4]); 12] = [
    ("the left quarter", [0.0, 0.0, 0.25, 1.0]),
    ("the right quarter", [0.75, 0.0, 1.0, 1.0]),
    ("the upper quarter", [0.0, 0.0, 1.0, 0.25]),
    ("the lower quarter", [0.0, 0.75, 1.0, 1.0]),
    ("the left edge", [0.0, 0.0, 0.12, 1.0]),
    ("the right edge", [0.88, 0.0, 1.0, 1.0]),
    ("the upper edge", [0.0, 0.0, 1.0, 0.12]),
    ("the lower edge", [0.0, 0.88, 1.0, 1.0]),
    ("the upper left corner", [0.0, 0.0, 0.2, 0.2]),
    ("the upper right corner", [0.8, 0.0, 1.0, 0.2]),
    ("the lower left corner", [0.0, 0.8, 0.2, 1.0]),
    ("the lower right corner", [0.8, 0.8, 1.0, 1.0]),
];

/// The empty ones; what lies inside a larger empty one is not said again.
pub(super) fn empty(points: &[[f64; 2]], [w, h]: [f64; 2]) -> Vec<Region> {
    let mut found: Vec<Region> = Vec::new();
    for (name, share) in REGIONS {
        let [x0, y0, x1, y1] = share;
        let holds = |[x, y]: &[f64; 2]| {
            let (u, v) = (((x + 0.5) / w) as f32, ((y + 0.5) / h) as f32);
            (x0..=x1).contains(&u) && (y0..=y1).contains(&v)
        };
        let within = |r: &Region| r.share[0] <= x0 && r.share[1] <= y0 && r.share[2] >= x1 && r.share[3] >= y1;
        if !points.iter().any(holds) && !found.iter().any(within) {
            found.push(Region { name, share });
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn empty_parts_are_named_once() {
        let points: Vec<[f64; 2]> =
            (30..100).flat_map(|x| (0..100).map(move |y| [f64::from(x), f64::from(y)])).collect();
        let names: Vec<_> = empty(&points, [100.0, 100.0]).iter().map(|r| r.name).collect();
        assert_eq!(names, ["the left quarter"]);
        let all: Vec<[f64; 2]> = (0..100).flat_map(|x| (0..100).map(move |y| [f64::from(x), f64::from(y)])).collect();
        assert!(empty(&all, [100.0, 100.0]).is_empty());
        assert_eq!(empty(&[[50.0, 50.0]], [100.0, 100.0]).len(), 4);
    }
}
