//! Corners on an unbounded grid of whole numbers, and what its geometry predicts.

use nalgebra::Vector2;

use crate::order;

/// `[column, row]`, any sign.
pub(crate) type Cell = [i32; 2];

/// The four steps to the next cells.
pub(crate) const STEPS: [Cell; 4] = [[-1, 0], [1, 0], [0, -1], [0, 1]];

pub(crate) fn add([a, b]: Cell, [c, d]: Cell) -> Cell {
    [a + c, b + d]
}

/// Whether the square between +column and +row of a cell is black: that of cell (0, 0) is, and colours alternate.
pub(crate) const fn is_black(cell: Cell) -> bool {
    (cell[0] + cell[1]).rem_euclid(2) == 0
}

/// Values on cells.
#[derive(Clone, Debug)]
pub(crate) struct Sheet<T> {
    /// First column and row that `values` hold.
    first: Cell,
    size: [usize; 2],
    values: Vec<Option<T>>,
    count: usize,
}

/// A guess of a place from the places around it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Guess {
    pub(crate) px: Vector2<f64>,
    /// Steps to the next column and to the next row, px.
    pub(crate) uv: [Vector2<f64>; 2],
}

impl Guess {
    /// How far a place is off, in cells: the larger of columns and rows.
    pub(crate) fn off(&self, px: Vector2<f64>) -> f64 {
        let ([u, v], d) = (self.uv, px - self.px);
        let area = u.perp(&v);
        (d.perp(&v) / area).abs().max((u.perp(&d) / area).abs())
    }

    /// Length of the shorter step, px.
    pub(crate) fn spacing(&self) -> f64 {
        self.uv[0].norm().min(self.uv[1].norm())
    }
}

impl<T: Copy> Sheet<T> {
    pub(crate) const fn new() -> Self {
        Self { first: [0, 0], size: [0, 0], values: Vec::new(), count: 0 }
    }

    /// Number of cells that hold something.
    pub(crate) const fn len(&self) -> usize {
        self.count
    }

    fn place(&self, cell: Cell) -> Option<usize> {
        let c = usize::try_from(cell[0] - self.first[0]).ok().filter(|c| *c < self.size[0])?;
        let r = usize::try_from(cell[1] - self.first[1]).ok().filter(|r| *r < self.size[1])?;
        Some(r * self.size[0] + c)
    }

    pub(crate) fn get(&self, cell: Cell) -> Option<T> {
        self.values[self.place(cell)?]
    }

    pub(crate) fn set(&mut self, cell: Cell, value: T) {
        let at = match self.place(cell) {
            Some(at) => at,
            None => {
                self.widen(cell);
                let [c, r] = [0, 1].map(|k| (cell[k] - self.first[k]) as usize);
                r * self.size[0] + c
            }
        };
        self.count += usize::from(self.values[at].replace(value).is_none());
    }

    pub(crate) fn remove(&mut self, cell: Cell) {
        if let Some(at) = self.place(cell) {
            self.count -= usize::from(self.values[at].take().is_some());
        }
    }

    fn widen(&mut self, cell: Cell) {
        const ROOM: i32 = 6;
        let mut wide = Self::new();
        for k in 0..2 {
            let end = self.first[k] + self.size[k] as i32;
            let (low, high) =
                if self.values.is_empty() { (cell[k], cell[k] + 1) } else { (self.first[k], end) };
            wide.first[k] = if cell[k] < low || self.values.is_empty() { cell[k] - ROOM } else { low };
            let high = if cell[k] >= high || self.values.is_empty() { cell[k] + 1 + ROOM } else { high };
            wide.size[k] = (high - wide.first[k]) as usize;
        }
        wide.values = vec![None; wide.size[0] * wide.size[1]];
        for (cell, value) in self.iter() {
            wide.set(cell, value);
        }
        *self = wide;
    }

    /// Cells that hold something, by row, then column.
    pub(crate) fn iter(&self) -> impl Iterator<Item = (Cell, T)> + '_ {
        let ([w, _], [c, r]) = (self.size, self.first);
        self.values
            .iter()
            .enumerate()
            .filter_map(move |(i, v)| Some(([c + (i % w) as i32, r + (i / w) as i32], (*v)?)))
    }

    /// First and last column and row that hold something: `[[first, last], [first, last]]`.
    pub(crate) fn bounds(&self) -> Option<[[i32; 2]; 2]> {
        let mut bounds: Option<[[i32; 2]; 2]> = None;
        for (cell, _) in self.iter() {
            let b = bounds.get_or_insert([[cell[0]; 2], [cell[1]; 2]]);
            for k in 0..2 {
                b[k] = [b[k][0].min(cell[k]), b[k][1].max(cell[k])];
            }
        }
        bounds
    }

    /// Empty cells beside those that hold something, by row, then column, each once.
    pub(crate) fn rim(&self) -> Vec<Cell> {
        let mut rim: Vec<Cell> = self
            .iter()
            .flat_map(|(cell, _)| STEPS.map(|s| add(cell, s)))
            .filter(|cell| self.get(*cell).is_none())
            .collect();
        order::by(&mut rim, |[c, r]| [*r, *c].map(f64::from));
        rim.dedup();
        rim
    }
}

/// Farthest column or row of a cell that a [`guess`] looks at.
pub(crate) const GUESS_REACH: i32 = 3;

/// Where a cell should be, from cells around it alone (not from itself); `place` gives the place of what a cell holds. `None`
/// with too little around.
///
/// Of each side, the parallelogram with a neighbouring line counts twice (it knows perspective and bend), the continuation of
/// its own line once.
pub(crate) fn guess<T: Copy>(
    sheet: &Sheet<T>,
    cell: Cell,
    place: impl Fn(T) -> Vector2<f64>,
) -> Option<Guess> {
    let around = |c: i32, r: i32| sheet.get(add(cell, [c, r])).map(&place);
    let mean = |pairs: &[Option<Vector2<f64>>]| {
        let (n, sum) =
            pairs.iter().flatten().fold((0, Vector2::zeros()), |(n, s), d: &Vector2<f64>| (n + 1, s + d));
        (n > 0).then(|| sum / f64::from(n))
    };
    let step = |a: Option<Vector2<f64>>, b: Option<Vector2<f64>>| Some(b? - a?);
    // Differences along axis k beside the cell; `q(i, j)` is i cells along k and j across.
    let uv = [0, 1].map(|k| {
        let q = |i: i32, j: i32| if k == 0 { around(i, j) } else { around(j, i) };
        mean(&[
            step(q(-2, 0), q(-1, 0)),
            step(q(1, 0), q(2, 0)),
            step(q(-1, -1), q(0, -1)),
            step(q(0, -1), q(1, -1)),
            step(q(-1, 1), q(0, 1)),
            step(q(0, 1), q(1, 1)),
        ])
    });
    let [Some(u), Some(v)] = uv else { return None };
    let (mut sum, mut weight) = (Vector2::zeros(), 0.0);
    let mut vote = |p: Vector2<f64>, w: f64| {
        sum += p * w;
        weight += w;
    };
    for [c, r] in STEPS {
        let Some(next) = around(c, r) else { continue };
        for side in [-1, 1] {
            let [sc, sr] = [side * r, side * c];
            if let (Some(a), Some(b)) = (around(c + sc, r + sr), around(sc, sr)) {
                vote(next + b - a, 2.0);
            }
        }
        if let Some(second) = around(2 * c, 2 * r) {
            match around(3 * c, 3 * r) {
                Some(third) => vote(3.0 * (next - second) + third, 1.0),
                None => vote(2.0 * next - second, 1.0),
            }
        }
    }
    (weight > 0.0 && u.perp(&v) > 1e-6).then(|| Guess { px: sum / weight, uv: [u, v] })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sheets_grow_to_all_sides() {
        let mut sheet = Sheet::new();
        let cells = [[0, 0], [-9, 3], [40, -20], [1, 0]];
        for (i, cell) in cells.into_iter().enumerate() {
            sheet.set(cell, i);
        }
        assert!(cells.iter().enumerate().all(|(i, c)| sheet.get(*c) == Some(i)));
        assert_eq!((sheet.len(), sheet.get([2, 2])), (4, None));
        assert_eq!(sheet.bounds(), Some([[-9, 40], [-20, 3]]));
        sheet.remove([40, -20]);
        sheet.remove([-9, 3]);
        assert_eq!((sheet.len(), sheet.rim().len()), (2, 6));
        assert_eq!(sheet.iter().map(|(c, _)| c).collect::<Vec<_>>(), [[0, 0], [1, 0]]);
    }

    #[test]
    fn guesses_follow_perspective() {
        let px = |c: f64, r: f64| {
            let w = 1.0 + 0.03 * c + 0.02 * r;
            Vector2::new((100.0 + 20.0 * c + 3.0 * r) / w, (80.0 - 2.0 * c + 18.0 * r) / w)
        };
        let mut sheet = Sheet::new();
        for (c, r) in (0..4).flat_map(|c| (0..4).map(move |r| (c, r))) {
            sheet.set([c, r], px(f64::from(c), f64::from(r)));
        }
        for (cell, want) in [([4, 1], px(4.0, 1.0)), ([2, 2], px(2.0, 2.0)), ([0, -1], px(0.0, -1.0))] {
            let g = guess(&sheet, cell, |p| p).unwrap();
            assert!((g.px - want).norm() < 1.5 && g.off(want) < 0.1, "{cell:?} {:?} {want}", g.px);
        }
        assert!(guess(&sheet, [8, 8], |p: Vector2<f64>| p).is_none());
        let g = Guess { px: Vector2::zeros(), uv: [Vector2::new(10.0, 0.0), Vector2::new(5.0, 20.0)] };
        assert!((g.off(Vector2::new(7.5, 10.0)) - 0.5).abs() < 1e-12);
    }
}
