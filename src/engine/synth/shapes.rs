//! Black shapes on a white sheet, and their mean over a small parallelogram: exact area integration.

use super::{Levels, polygon::Polygon};

/// Something that is printed black.
#[derive(Clone, Copy, Debug)]
pub(super) enum Shape {
    /// Ends along x and y.
    Rectangle([[f64; 2]; 2]),
    /// Centre and radius.
    Disc([f64; 2], f64),
}

/// How a shape lies to a box.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Cover {
    /// Outside of it.
    Nothing,
    /// An edge passes through it, or may.
    Part,
    /// All of it is black.
    All,
}

impl Shape {
    /// Smallest and largest x and y.
    fn ends(&self) -> [[f64; 2]; 2] {
        match *self {
            Self::Rectangle(ends) => ends,
            Self::Disc(center, radius) => center.map(|c| [c - radius, c + radius]),
        }
    }

    fn cover(&self, of: &[[f64; 2]; 2]) -> Cover {
        match *self {
            Self::Rectangle(ends) => {
                let axis = |k: usize| {
                    let ([low, high], [from, to]) = (ends[k], of[k]);
                    (to < low || from >= high, from >= low && to < high)
                };
                let ((out_x, in_x), (out_y, in_y)) = (axis(0), axis(1));
                if out_x || out_y {
                    Cover::Nothing
                } else if in_x && in_y {
                    Cover::All
                } else {
                    Cover::Part
                }
            }
            Self::Disc(center, radius) => {
                let away = |k: usize| [of[k][0] - center[k], center[k] - of[k][1]];
                let (x, y) = (away(0), away(1));
                let least = x[0].max(x[1]).max(0.0).hypot(y[0].max(y[1]).max(0.0));
                let most = x[0].min(x[1]).hypot(y[0].min(y[1]));
                if least >= radius {
                    Cover::Nothing
                } else if most < radius {
                    Cover::All
                } else {
                    Cover::Part
                }
            }
        }
    }

    /// Area of a polygon that is black.
    fn area(&self, of: &Polygon) -> f64 {
        match *self {
            Self::Rectangle(ends) => part(of, &ends).area(),
            Self::Disc(center, radius) => of.area_in_circle(center, radius),
        }
    }
}

/// The part of a polygon in a rectangle.
fn part(of: &Polygon, ends: &[[f64; 2]; 2]) -> Polygon {
    of.between(0, ends[0][0], ends[0][1]).between(1, ends[1][0], ends[1][1])
}

/// A white sheet with black shapes that do not overlap.
pub(super) struct Shapes {
    /// Smallest and largest x and y of the sheet.
    ends: [[f64; 2]; 2],
    levels: Levels,
    list: Vec<Shape>,
    index: Index,
}

impl Shapes {
    /// The shapes with a white border of `margin` around them.
    pub(super) fn new(list: Vec<Shape>, margin: f64, levels: Levels) -> Self {
        let mut ends = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
        for own in list.iter().map(Shape::ends) {
            ends = [0, 1].map(|k| [ends[k][0].min(own[k][0]), ends[k][1].max(own[k][1])]);
        }
        let index = Index::new(ends, &list);
        Self { ends: ends.map(|[low, high]| [low - margin, high + margin]), levels, list, index }
    }

    /// Smallest and largest x and y of the sheet.
    pub(super) const fn ends(&self) -> [[f64; 2]; 2] {
        self.ends
    }

    /// Grey value of a point.
    pub(super) fn at(&self, b: [f64; 2]) -> f32 {
        let here = b.map(|v| [v, v]);
        f32::from(if (0..2).any(|k| !(self.ends[k][0]..self.ends[k][1]).contains(&b[k])) {
            self.levels.background
        } else if self.near(&here).any(|s| s.cover(&here) == Cover::All) {
            self.levels.black
        } else {
            self.levels.white
        })
    }

    /// The grey value of the pixel with the map `center + j·[−½, ½]²` where no edge comes near it (a tenth of a pixel is
    /// left for the curvature of the map).
    pub(super) fn uniform(&self, center: [f64; 2], j: [[f64; 2]; 2]) -> Option<f32> {
        let here = reach(center, j, 0.6);
        if (0..2).any(|k| here[k][1] < self.ends[k][0] || here[k][0] >= self.ends[k][1]) {
            return Some(f32::from(self.levels.background));
        }
        if (0..2).any(|k| here[k][0] < self.ends[k][0] || here[k][1] >= self.ends[k][1]) {
            return None;
        }
        for shape in self.near(&here) {
            match shape.cover(&here) {
                Cover::Nothing => {}
                Cover::Part => return None,
                Cover::All => return Some(f32::from(self.levels.black)),
            }
        }
        Some(f32::from(self.levels.white))
    }

    /// Mean over the parallelogram `center + j·[−½, ½]²`, where `j[axis]` are the derivatives of one board coordinate.
    pub(super) fn mean(&self, center: [f64; 2], j: [[f64; 2]; 2]) -> f32 {
        let here = reach(center, j, 0.5);
        let [black, white, background] =
            [self.levels.black, self.levels.white, self.levels.background].map(f64::from);
        let whole = Polygon::parallelogram(center, j);
        let area = whole.area();
        let [across, down] = here.map(|[from, to]| to - from);
        if area.is_nan() || area < 1e-12 * across * down {
            return (0.5 * (black + white)) as f32;
        }
        let sheet = part(&whole, &self.ends).area();
        let ink: f64 = self.near(&here).map(|s| s.area(&whole)).sum();
        ((background * (area - sheet) + white * (sheet - ink) + black * ink) / area) as f32
    }

    /// The shapes that may touch a box, each once.
    fn near(&self, of: &[[f64; 2]; 2]) -> impl Iterator<Item = &Shape> {
        self.index.near(of).map(|i| &self.list[i as usize])
    }
}

/// The box around `center + j·[−s, s]²`.
fn reach(center: [f64; 2], j: [[f64; 2]; 2], s: f64) -> [[f64; 2]; 2] {
    [0, 1].map(|k| {
        let reach = s * (j[k][0].abs() + j[k][1].abs());
        [center[k] - reach, center[k] + reach]
    })
}

/// Which shapes touch which cell of a lattice over all of them.
struct Index {
    /// Where the lattice begins, and cells in one unit, along x and y.
    start: [f64; 2],
    per_unit: [f64; 2],
    /// Cells each way.
    cells: usize,
    /// Shapes of each cell, row by row, each with the first cell that it touches.
    lists: Vec<Vec<(u32, [usize; 2])>>,
}

impl Index {
    fn new(ends: [[f64; 2]; 2], shapes: &[Shape]) -> Self {
        let cells = (shapes.len() as f64).sqrt().ceil().max(1.0) as usize;
        let per_unit = ends.map(|[low, high]| cells as f64 / (high - low).max(f64::MIN_POSITIVE));
        let start = ends.map(|[low, _]| low);
        let mut index = Self { start, per_unit, cells, lists: vec![Vec::new(); cells * cells] };
        for (i, shape) in (0..).zip(shapes) {
            let [[x, right], [y, bottom]] = index.range(&shape.ends());
            for row in y..=bottom {
                for column in x..=right {
                    index.lists[row * cells + column].push((i, [x, y]));
                }
            }
        }
        index
    }

    /// First and last cell along x and y; what lies beside the lattice belongs to its outermost cells.
    fn range(&self, of: &[[f64; 2]; 2]) -> [[usize; 2]; 2] {
        [0, 1].map(|k| of[k].map(|v| (((v - self.start[k]) * self.per_unit[k]) as usize).min(self.cells - 1)))
    }

    /// Shapes in the cells of a box, each once: in the first cell that both have.
    fn near(&self, of: &[[f64; 2]; 2]) -> impl Iterator<Item = u32> {
        let [[left, right], [top, bottom]] = self.range(of);
        (top..=bottom).flat_map(move |y| {
            (left..=right).flat_map(move |x| {
                self.lists[y * self.cells + x]
                    .iter()
                    .filter(move |(_, first)| [left.max(first[0]), top.max(first[1])] == [x, y])
                    .map(|(shape, _)| *shape)
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sheet() -> Shapes {
        let list = vec![
            Shape::Rectangle([[0.0, 1.0], [0.0, 0.5]]),
            Shape::Rectangle([[1.0, 1.2], [0.5, 2.0]]),
            Shape::Disc([2.0, 1.0], 0.4),
            Shape::Disc([2.5, 1.8], 0.25),
        ];
        Shapes::new(list, 0.3, Levels::default())
    }

    #[test]
    fn points_are_black_white_or_beside_the_sheet() {
        for (at, level) in [
            ([0.5, 0.2], 0.0),
            ([0.5, 0.6], 255.0),
            ([1.1, 1.9], 0.0),
            ([2.3, 1.2], 0.0),
            ([2.35, 1.35], 255.0),
            ([-0.2, -0.2], 255.0),
            ([-0.4, 0.2], 160.0),
            ([1.0, 2.4], 160.0),
        ] {
            assert_eq!(sheet().at(at), level, "{at:?}");
        }
    }

    #[test]
    fn means_agree_with_dense_sampling_and_uniform_ones_are_uniform() {
        let sheet = sheet();
        let maps = [
            [[0.7, 0.2], [-0.3, 0.5]],
            [[0.02, 0.011], [-0.013, 0.019]],
            [[2.1, -1.7], [0.6, 1.9]],
            [[9.0, 0.0], [0.1, 8.0]],
        ];
        let centers =
            [[0.003, -0.004], [1.0, 0.5], [2.28, 1.28], [1.7, 0.3], [-0.3, 2.3], [2.6, 1.6], [0.4, 0.25]];
        let mut uniform = 0;
        for j in maps {
            for center in centers {
                const N: i32 = 1000;
                let off = |i: i32| (f64::from(i) + 0.5) / f64::from(N) - 0.5;
                let at = |i: i32| {
                    let (u, v) = (off(i % N), off(i / N));
                    f64::from(sheet.at([0, 1].map(|k| center[k] + j[k][0] * u + j[k][1] * v)))
                };
                let sampled = (0..N * N).map(at).sum::<f64>() / f64::from(N * N);
                let mean = sheet.mean(center, j);
                assert!((f64::from(mean) - sampled).abs() < 0.15, "{center:?} {j:?}: {mean} {sampled}");
                if let Some(level) = sheet.uniform(center, j) {
                    assert!((level - mean).abs() < 1e-3, "{center:?} {j:?}: {level} {mean}");
                    uniform += 1;
                }
            }
        }
        assert!(uniform > 2, "{uniform}");
    }
}
