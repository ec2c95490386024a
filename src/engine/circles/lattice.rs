//! From spots to a lattice: a first cell of four, and growth from it by prediction.
//!
//! A spot's own ellipse says how the board is tilted there: in its metric the four nearest dots lie at equal distances and
//! right angles, whatever the perspective. From the first cell on only the places around a cell predict it, so the lens may
//! bend the lattice as it likes.

use std::collections::VecDeque;

use nalgebra::Vector2;

use super::{predict::predict, spot::Spot};
use crate::{
    detect::sheet::{Cell, Guess, STEPS, Sheet, add},
    order,
};

/// Largest distance of a spot from its predicted place, in cells.
const OFF: f64 = 0.35;
/// Smallest and largest ratio of areas and of contrasts of neighbours.
const ALIKE: std::ops::RangeInclusive<f64> = 0.4..=2.5;
/// How much the shapes of neighbours may differ: (r + 1/r)/2 where one is r times as slim as the other.
const SHAPE: f64 = 1.35;
/// Distance of the nearest neighbour, in radii of the dot.
const NEIGHBOUR: std::ops::RangeInclusive<f64> = 2.1..=12.0;
/// Largest ratio of the two steps of the first cell, and largest cosine between them, both in the metric of the spot: small
/// spots have rough ellipses.
const FIRST: [f64; 2] = [1.7, 0.55];
/// Spots around a first one that are looked at.
const NEAREST: usize = 8;
/// Most spots that are looked at: a picture of nothing but texture must not take minutes.
const MOST: usize = 20_000;
/// Side of the buckets that spots are looked up in, px.
const BUCKET: f64 = 16.0;

/// Spots of a level and their lattices.
pub(super) struct Field {
    spots: Vec<Spot>,
    buckets: Vec<Vec<u32>>,
    columns: usize,
    rows: usize,
}

impl Field {
    /// Of a picture of `size` px.
    pub(super) fn new(mut spots: Vec<Spot>, size: [usize; 2]) -> Self {
        let strength = |s: &Spot| s.contrast * s.area().sqrt();
        order::by(&mut spots, |s| [-strength(s)]);
        spots.truncate(MOST);
        let [columns, rows] = size.map(|s| (s as f64 / BUCKET) as usize + 1);
        let mut buckets = vec![Vec::new(); columns * rows];
        for (i, s) in spots.iter().enumerate() {
            let [c, r] = [0, 1].map(|k| (s.px[k].max(0.0) / BUCKET) as usize);
            if let Some(bucket) = buckets.get_mut(r * columns + c) {
                bucket.push(i as u32);
            }
        }
        Self { spots, buckets, columns, rows }
    }

    /// Number of spots.
    pub(super) const fn len(&self) -> usize {
        self.spots.len()
    }

    /// Lattices of at least `fewest` spots, the largest first, each spot in one at most.
    pub(super) fn lattices(&self, fewest: usize) -> Vec<Sheet<Spot>> {
        let mut taken = vec![false; self.spots.len()];
        // What grew from a spot would grow again from its neighbours.
        let mut tried = taken.clone();
        let mut found = Vec::new();
        for seed in 0..self.spots.len() {
            if taken[seed] || tried[seed] {
                continue;
            }
            let Some(first) = self.first_cell(seed, &taken) else { continue };
            let grown = self.grow(first, &mut taken);
            if self.is_sparse(&grown) {
                continue;
            }
            for (_, i) in grown.iter() {
                tried[i] = true;
            }
            if grown.len() >= fewest {
                let mut sheet = Sheet::new();
                for (cell, i) in grown.iter() {
                    taken[i] = true;
                    sheet.set(cell, self.spots[i]);
                }
                found.push(sheet);
            }
        }
        order::by(&mut found, |s| [-(s.len() as f64)]);
        found
    }

    /// Spots within a box of half sizes `reach`.
    fn near(&self, px: Vector2<f64>, reach: [f64; 2]) -> impl Iterator<Item = usize> + '_ {
        let range = |v: f64, reach: f64, n: usize| {
            let at = |v: f64| ((v / BUCKET).max(0.0) as usize).min(n.saturating_sub(1));
            at(v - reach)..=at(v + reach)
        };
        let columns = range(px.x, reach[0], self.columns);
        range(px.y, reach[1], self.rows)
            .flat_map(move |r| columns.clone().map(move |c| r * self.columns + c))
            .flat_map(|b| self.buckets.get(b).into_iter().flatten().map(|i| *i as usize))
            .filter(move |i| {
                let d = self.spots[*i].px - px;
                d.x.abs() <= reach[0] && d.y.abs() <= reach[1]
            })
    }

    /// Four spots around one cell: cells (0, 0), (1, 0), (0, 1), (1, 1), not mirrored.
    fn first_cell(&self, seed: usize, taken: &[bool]) -> Option<[usize; 4]> {
        let s = &self.spots[seed];
        // The nearest in the metric lie within an ellipse of so many radii.
        let far = |radii: f64| [0, 2].map(|k| radii * s.ellipse[k].max(0.0).sqrt());
        let mut around: Vec<(f64, usize)> = Vec::new();
        for radii in [0.35 * NEIGHBOUR.end(), *NEIGHBOUR.end()] {
            around = self
                .near(s.px, far(radii))
                .filter(|i| *i != seed && !taken[*i] && alike(s, &self.spots[*i]))
                .map(|i| (s.radii(self.spots[i].px - s.px), i))
                .filter(|(d, _)| NEIGHBOUR.contains(d) && *d <= radii)
                .collect();
            if around.len() >= 4 {
                break;
            }
        }
        order::by(&mut around, |a| [a.0, a.1 as f64]);
        around.truncate(NEAREST);
        for (n, (far_b, b)) in around.iter().enumerate() {
            for (far_a, a) in &around[..n] {
                let steps = [self.spots[*a].px - s.px, self.spots[*b].px - s.px];
                let cosine = s.product(steps[0], steps[1]) / (far_a * far_b);
                if *far_b > FIRST[0] * far_a || cosine.abs() > FIRST[1] {
                    continue;
                }
                let (steps, a, b) = if steps[0].perp(&steps[1]) > 0.0 {
                    (steps, *a, *b)
                } else {
                    ([steps[1], steps[0]], *b, *a)
                };
                let guess = Guess { px: s.px + steps[0] + steps[1], uv: steps };
                let fits = |i: usize| ![seed, a, b].contains(&i) && !taken[i] && alike(s, &self.spots[i]);
                let Some(last) = self.nearest(&guess, fits) else { continue };
                if !self.has_inside(s.px, steps, |i| i != last && fits(i)) {
                    return Some([seed, a, b, last]);
                }
            }
        }
        None
    }

    /// Whether a cell has more than its corners: then it spans several cells of the board.
    fn has_inside(&self, px: Vector2<f64>, uv: [Vector2<f64>; 2], fits: impl Fn(usize) -> bool) -> bool {
        const WITHIN: std::ops::RangeInclusive<f64> = -0.1..=1.1;
        let middle = Guess { px: px + 0.5 * (uv[0] + uv[1]), uv };
        let area = uv[0].perp(&uv[1]);
        let reach = [0, 1].map(|k| 0.6 * (uv[0][k].abs() + uv[1][k].abs()));
        self.near(middle.px, reach).any(|i| {
            let d = self.spots[i].px - px;
            WITHIN.contains(&(d.perp(&uv[1]) / area)) && WITHIN.contains(&(uv[0].perp(&d) / area)) && fits(i)
        })
    }

    /// Whether a lattice leaves out spots like its own in a quarter of its cells: its cells span several of the board.
    fn is_sparse(&self, grown: &Sheet<usize>) -> bool {
        let mut own: Vec<usize> = grown.iter().map(|(_, i)| i).collect();
        order::by(&mut own, |i| [*i as f64]);
        let (mut cells, mut full) = (0, 0);
        for (cell, i) in grown.iter() {
            let beside = [[1, 0], [0, 1]].map(|d| grown.get(add(cell, d)).map(|j| self.spots[j].px));
            let [Some(right), Some(below)] = beside else { continue };
            let s = &self.spots[i];
            let fits = |j: usize| own.binary_search(&j).is_err() && alike(s, &self.spots[j]);
            cells += 1;
            full += usize::from(self.has_inside(s.px, [right - s.px, below - s.px], fits));
        }
        4 * full > cells
    }

    /// The spot nearest to a guess that fits.
    fn nearest(&self, guess: &Guess, fits: impl Fn(usize) -> bool) -> Option<usize> {
        let [u, v] = guess.uv;
        let reach = [0, 1].map(|k| OFF * (u[k].abs() + v[k].abs()));
        self.near(guess.px, reach)
            .map(|i| (guess.off(self.spots[i].px), i))
            .filter(|(off, i)| *off < OFF && fits(*i))
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .map(|b| b.1)
    }

    /// Grows from a first cell until nothing fits any more; leaves `used` as it was.
    fn grow(&self, first: [usize; 4], used: &mut [bool]) -> Sheet<usize> {
        let mut sheet = Sheet::new();
        let mut queue = VecDeque::new();
        for (cell, i) in [[0, 0], [1, 0], [0, 1], [1, 1]].into_iter().zip(first) {
            sheet.set(cell, i);
            used[i] = true;
        }
        // A cell that nothing fits is tried again when the lattice has grown.
        let mut known = 0;
        while known < sheet.len() {
            known = sheet.len();
            queue.extend(sheet.rim());
            while let Some(cell) = queue.pop_front() {
                if sheet.get(cell).is_none()
                    && let Some(i) = self.fitting(&sheet, cell, used)
                {
                    used[i] = true;
                    sheet.set(cell, i);
                    queue.extend(STEPS.map(|s| add(cell, s)));
                }
            }
        }
        sheet.iter().for_each(|(_, i)| used[i] = false);
        sheet
    }

    fn fitting(&self, sheet: &Sheet<usize>, cell: Cell, used: &[bool]) -> Option<usize> {
        let guess = predict(sheet, cell, |i| self.spots[i].px)?;
        let beside = (-1..=1)
            .flat_map(|r| (-1..=1).map(move |c| [c, r]))
            .find_map(|d| sheet.get(add(cell, d)))
            .map(|i| &self.spots[i])?;
        self.nearest(&guess, |i| !used[i] && alike(beside, &self.spots[i]))
    }
}

/// Whether two spots may be neighbours.
fn alike(a: &Spot, b: &Spot) -> bool {
    let areas = b.area() / a.area();
    let [p, q, r] = a.ellipse;
    let [s, t, u] = b.ellipse;
    // Half the trace of Q_b Q_a⁻¹ scaled to determinant 1.
    let shape = 0.5 * (r * s - 2.0 * q * t + p * u) / (a.area() * b.area());
    a.dark == b.dark && ALIKE.contains(&areas) && ALIKE.contains(&(b.contrast / a.contrast)) && shape < SHAPE
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spot(x: f64, y: f64, ellipse: [f64; 3]) -> Spot {
        Spot { px: Vector2::new(x, y), ellipse, contrast: 50.0, dark: true, filled: 1.0 }
    }

    #[test]
    fn a_tilted_lattice_has_the_cells_of_the_board() {
        // Columns 12 px apart and rows 40 px: the nearest in the picture are two columns away, not the next row.
        let place =
            |c: i32, r: i32| (40.0 + 12.0 * f64::from(c) + 5.0 * f64::from(r), 30.0 + 40.0 * f64::from(r));
        // Discs of 0.35 spacings: 0.35² M Mᵀ.
        let ellipse = [20.7, 24.5, 196.0];
        let spots: Vec<Spot> = (0..4)
            .flat_map(|r| (0..9).map(move |c| place(c, r)))
            .map(|(x, y)| spot(x, y, ellipse))
            .chain([spot(90.0, 50.0, [4.0, 0.0, 4.0]), spot(300.0, 100.0, ellipse)])
            .collect();
        let found = Field::new(spots, [400, 250]).lattices(6);
        assert_eq!(found.iter().map(Sheet::len).collect::<Vec<_>>(), [36]);
        let bounds = found[0].bounds().unwrap();
        let mut sizes = bounds.map(|[a, b]| b - a + 1);
        sizes.sort_unstable();
        assert_eq!(sizes, [4, 9]);
    }

    #[test]
    fn nothing_is_a_lattice_of_nothing() {
        assert!(Field::new(Vec::new(), [0, 0]).lattices(4).is_empty());
    }
}
