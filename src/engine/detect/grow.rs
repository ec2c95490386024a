//! From saddles to a grid: neighbours along the edges make a first cell, and the grid grows from it by prediction.
//!
//! From corner to neighbouring corner the colours swap, which tells a checkerboard from other rows of dots. A place that the
//! grid predicts and that no saddle fills is looked at again with a lower threshold. A grid has only cells that were seen;
//! cells may be missing inside.

use std::collections::VecDeque;

use nalgebra::Vector2;

use super::{
    response::{Ring, peaks, response, vertex},
    saddle::Saddle,
    sheet::{Cell, STEPS, Sheet, add, guess, is_black},
};
use crate::{image::Plane, order};

/// Largest sine between an edge and the step to a neighbour: 30°.
pub(super) const ALONG: f64 = 0.5;
/// Largest sine between the first cell's edges and its steps: 20°.
const ALONG_FIRST: f64 = 0.35;
/// Largest distance from a predicted place, in cells.
const OFF: f64 = 0.3;
/// Smallest and largest ratio of the contrasts of neighbours.
pub(super) const CONTRAST: std::ops::RangeInclusive<f32> = 0.35..=2.9;
/// Smallest quality of a saddle, as found and where the grid predicts it.
const QUALITY: [f32; 2] = [0.6, 0.45];
/// Most saddles that are looked at: a picture of nothing but texture must not take minutes.
const MOST: usize = 20_000;
/// A neighbour that is not among this many saddles is none: squares have nothing inside.
const CROWD: usize = 24;
/// Side of the buckets that saddles are looked up in, px.
const BUCKET: f64 = 16.0;

/// A grid of saddles in a level.
#[derive(Clone, Debug)]
pub(super) struct Lattice {
    /// Places in the level, px.
    pub(super) cells: Sheet<Vector2<f64>>,
}

/// Saddles of a level and their grids.
pub(super) struct Field<'a> {
    picture: &'a Plane<u8>,
    ring: &'static Ring,
    response: Plane<i16>,
    threshold: i16,
    pub(super) saddles: Vec<Saddle>,
    buckets: Vec<Vec<u32>>,
    columns: usize,
}

impl<'a> Field<'a> {
    /// Finds the saddles; `noise` is the standard deviation of the grey values.
    pub(super) fn new(picture: &'a Plane<u8>, ring: &'static Ring, noise: f32) -> Self {
        let response = response(picture, ring);
        // Eight times the noise lies three of its own deviations above the response of pure noise.
        let threshold = (8.0 * noise).clamp(24.0, 2000.0) as i16;
        let mut at = peaks(&response, threshold);
        if at.len() > MOST {
            order::by(&mut at, |[x, y]| [-f64::from(response.at(*x, *y)), *y as f64, *x as f64]);
            at.truncate(MOST);
        }
        let weakest = 2.0 * noise + 3.0;
        let saddles: Vec<Saddle> = at
            .into_iter()
            .filter_map(|[x, y]| {
                let [dx, dy] = vertex(&response, x, y);
                let place = Vector2::new(x as f64 + dx, y as f64 + dy);
                Saddle::at(picture, ring, [x, y], place)
                    .filter(|s| s.quality >= QUALITY[0] && s.contrast >= weakest)
            })
            .collect();
        let columns = (picture.width() as f64 / BUCKET) as usize + 1;
        let rows = (picture.height() as f64 / BUCKET) as usize + 1;
        let mut buckets = vec![Vec::new(); columns * rows];
        for (i, s) in saddles.iter().enumerate() {
            let [c, r] = [0, 1].map(|k| (s.px[k] / BUCKET) as usize);
            buckets[r * columns + c].push(i as u32);
        }
        Self { picture, ring, response, threshold, saddles, buckets, columns }
    }

    /// Number of saddles.
    pub(super) const fn len(&self) -> usize {
        self.saddles.len()
    }

    /// The grid with the most corners, if it has at least `fewest`, and the next largest that is no part of it, if it has at least
    /// `second`.
    pub(super) fn largest(&mut self, fewest: usize, second: usize) -> Option<(Lattice, Option<Lattice>)> {
        let n = self.saddles.len();
        let mut order: Vec<usize> = (0..n).collect();
        let strength = |i: &usize| self.saddles[*i].quality * self.saddles[*i].contrast;
        order::by(&mut order, |i| [-f64::from(strength(i))]);
        let mut taken = vec![false; n];
        let mut left = n;
        let mut best: Option<(Sheet<usize>, Vec<Saddle>)> = None;
        let mut next: Option<(Sheet<usize>, Lattice)> = None;
        for seed in order {
            let least = best.as_ref().map_or(fewest, |(sheet, _)| sheet.len() + 1);
            let least_next = next.as_ref().map_or(second, |(sheet, _)| sheet.len() + 1);
            if left < least.min(if best.is_some() { least_next } else { least }) {
                break;
            }
            if taken[seed] {
                continue;
            }
            taken[seed] = true;
            left -= 1;
            let Some(first) = self.first_cell(seed, &taken) else { continue };
            let mut grown = Sheet::new();
            for (cell, i) in [[0, 0], [1, 0], [0, 1], [1, 1]].into_iter().zip(first) {
                grown.set(cell, i);
            }
            self.grow(&mut grown, &taken);
            if grown.len() >= fewest.min(9) {
                for (_, i) in grown.iter().filter(|(_, i)| *i != seed) {
                    // Saddles that the growing added are beyond the list.
                    if taken.get(i).is_some_and(|t| !t) {
                        taken[i] = true;
                        left -= 1;
                    }
                }
            }
            let added = self.saddles.split_off(n);
            let passed =
                if grown.len() >= least { best.replace((grown, added)) } else { Some((grown, added)) };
            if let Some((sheet, added)) = passed.filter(|(sheet, _)| sheet.len() >= least_next) {
                let lattice = self.lattice(&sheet, &added);
                next = Some((sheet, lattice));
            }
        }
        let (mut sheet, added) = best?;
        self.saddles.extend(added);
        while self.bridge(&mut sheet) {
            self.grow(&mut sheet, &[]);
        }
        // What was bridged is one board.
        let mut in_sheet = vec![false; self.saddles.len()];
        sheet.iter().for_each(|(_, i)| in_sheet[i] = true);
        let apart = |s: &Sheet<usize>| !s.iter().any(|(_, i)| i < n && in_sheet[i]);
        let next = next.filter(|(sheet, _)| apart(sheet)).map(|(_, lattice)| lattice);
        Some((self.lattice(&sheet, &[]), next))
    }

    /// Where the saddles of a sheet are; `added` are beyond the list.
    fn lattice(&self, sheet: &Sheet<usize>, added: &[Saddle]) -> Lattice {
        let n = self.saddles.len();
        let mut cells = Sheet::new();
        sheet
            .iter()
            .for_each(|(cell, i)| cells.set(cell, self.saddles.get(i).unwrap_or_else(|| &added[i - n]).px));
        Lattice { cells }
    }

    /// Saddles within a box of half size `reach`.
    fn near(&self, px: Vector2<f64>, reach: f64) -> impl Iterator<Item = usize> + '_ {
        let rows = self.buckets.len() / self.columns;
        let range = |v: f64, n: usize| {
            let at = |v: f64| ((v / BUCKET).max(0.0) as usize).min(n - 1);
            at(v - reach)..=at(v + reach)
        };
        let columns = range(px.x, self.columns);
        range(px.y, rows)
            .flat_map(move |r| columns.clone().map(move |c| r * self.columns + c))
            .flat_map(|b| self.buckets[b].iter().map(|i| *i as usize))
    }

    /// The nearest saddles along the edges of `from`, in the directions of its axes and against them, whose colours are the
    /// other way round.
    fn neighbours(&self, from: usize, taken: &[bool]) -> [[Option<usize>; 2]; 2] {
        let s = &self.saddles[from];
        let largest = (self.picture.width().max(self.picture.height()) / 3) as f64;
        let mut reach = 24.0;
        loop {
            let mut best = [[None; 2]; 2];
            let mut nearest = [[reach * reach; 2]; 2];
            let mut seen = 0;
            for i in self.near(s.px, reach) {
                seen += 1;
                let step = self.saddles[i].px - s.px;
                let distance = step.norm_squared();
                let across = |k: usize| step.perp(&s.axes[k]).powi(2) < ALONG_FIRST * ALONG_FIRST * distance;
                let Some(k) = (0..2).find(|k| across(*k)) else { continue };
                let side = usize::from(step.dot(&s.axes[k]) < 0.0);
                if distance >= nearest[k][side] || taken[i] || i == from {
                    continue;
                }
                // Black lies between the first axis and the second here, so beside them there; the frame stays right-handed.
                let along = if side == 0 { step } else { -step };
                let uv = if k == 0 { [along, s.axes[1]] } else { [s.axes[0], along] };
                if CONTRAST.contains(&(self.saddles[i].contrast / s.contrast))
                    && self.saddles[i].mismatch(uv, false).is_some_and(|m| m < ALONG)
                {
                    (nearest[k][side], best[k][side]) = (distance, Some(i));
                }
            }
            let cell = best.iter().all(|b| b.iter().any(Option::is_some));
            reach *= 2.0;
            if cell || reach > largest || seen > CROWD {
                return best;
            }
        }
    }

    /// Four corners around one square at a saddle: cells (0, 0), (1, 0), (0, 1), (1, 1), black between (0, 0)'s +column and +row.
    fn first_cell(&self, seed: usize, taken: &[bool]) -> Option<[usize; 4]> {
        let [along, across] = self.neighbours(seed, taken);
        for side in 0..2 {
            let (Some(right), Some(below)) = (along[side], across[side]) else { continue };
            let [p, q, r] = [seed, right, below].map(|i| self.saddles[i].px);
            let steps = [q - p, r - p];
            if steps[0].perp(&steps[1]) <= 0.0 {
                continue;
            }
            let reach = 0.5 * steps[0].norm().max(steps[1].norm());
            let guess = super::sheet::Guess { px: q + r - p, uv: steps };
            let fits = |i: &usize| {
                guess.off(self.saddles[*i].px) < 0.4
                    && ![seed, right, below].contains(i)
                    && !taken[*i]
                    && self.saddles[*i].mismatch(steps, true).is_some_and(|m| m < ALONG)
            };
            let off = |i: usize| guess.off(self.saddles[i].px);
            let last = self.near(guess.px, reach).filter(fits).min_by(|i, j| off(*i).total_cmp(&off(*j)));
            if let Some(last) = last {
                return Some([seed, right, below, last]);
            }
        }
        None
    }

    /// Grows a grid until nothing fits any more; not with saddles that are taken.
    fn grow(&mut self, sheet: &mut Sheet<usize>, taken: &[bool]) {
        let mut used = taken.to_vec();
        used.resize(self.saddles.len(), false);
        sheet.iter().for_each(|(_, i)| used[i] = true);
        let mut queue = VecDeque::from(sheet.rim());
        let mut looked_again = Sheet::new();
        loop {
            while let Some(cell) = queue.pop_front() {
                if sheet.get(cell).is_none()
                    && let Some(i) = self.fitting(sheet, cell, &used)
                {
                    used[i] = true;
                    sheet.set(cell, i);
                    queue.extend(STEPS.map(|s| add(cell, s)));
                }
            }
            for cell in sheet.rim() {
                // Looked at anew only where more is known about its place.
                let around = STEPS.iter().filter(|s| sheet.get(add(cell, **s)).is_some()).count();
                if looked_again.get(cell) == Some(around) {
                    continue;
                }
                looked_again.set(cell, around);
                if let Some(saddle) = self.look_again(sheet, cell) {
                    let i = self.saddles.len();
                    self.saddles.push(saddle);
                    used.push(true);
                    sheet.set(cell, i);
                    queue.extend(STEPS.map(|s| add(cell, s)));
                }
            }
            if queue.is_empty() {
                return;
            }
        }
    }

    /// Whether a saddle can be the corner of a cell; its distance from the predicted place, in cells.
    fn fits(&self, sheet: &Sheet<usize>, cell: Cell, guess: &super::sheet::Guess, s: &Saddle) -> Option<f64> {
        let off = guess.off(s.px);
        let beside = STEPS.iter().filter_map(|step| sheet.get(add(cell, *step)));
        let (n, contrast) = beside.fold((0.0, 0.0), |(n, c), i| (n + 1.0, c + self.saddles[i].contrast));
        (off < OFF
            && CONTRAST.contains(&(s.contrast * n / contrast))
            && s.mismatch(guess.uv, is_black(cell)).is_some_and(|m| m < ALONG))
        .then_some(off)
    }

    fn fitting(&self, sheet: &Sheet<usize>, cell: Cell, used: &[bool]) -> Option<usize> {
        let guess = guess(sheet, cell, |i| self.saddles[i].px)?;
        let reach = OFF * (guess.uv[0].norm() + guess.uv[1].norm());
        self.near(guess.px, reach)
            .filter(|i| !used[*i])
            .filter_map(|i| Some((self.fits(sheet, cell, &guess, &self.saddles[i])?, i)))
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .map(|b| b.1)
    }

    /// The strongest response near a predicted place, if it is a corner after all.
    fn look_again(&self, sheet: &Sheet<usize>, cell: Cell) -> Option<Saddle> {
        let guess = guess(sheet, cell, |i| self.saddles[i].px)?;
        let reach = (0.25 * guess.spacing()).clamp(1.0, 6.0);
        let (w, h, r) = (self.picture.width() as f64, self.picture.height() as f64, self.ring.radius as f64);
        let range = |v: f64, size: f64| {
            let (low, high) = ((v - reach).max(r), (v + reach).min(size - 1.0 - r));
            (low <= high).then(|| low.round() as usize..=high.round() as usize)
        };
        let (columns, rows) = (range(guess.px.x, w)?, range(guess.px.y, h)?);
        let at = rows
            .flat_map(|y| columns.clone().map(move |x| [x, y]))
            .max_by_key(|[x, y]| (self.response.at(*x, *y), std::cmp::Reverse((*y, *x))))?;
        let [x, y] = at;
        if self.response.at(x, y) <= self.threshold / 3 {
            return None;
        }
        let [dx, dy] = vertex(&self.response, x, y);
        let place = Vector2::new(x as f64 + dx, y as f64 + dy);
        let near = |i: usize| (self.saddles[i].px - place).norm() < 0.5 * guess.spacing();
        let saddle = Saddle::at(self.picture, self.ring, at, place).filter(|s| s.quality >= QUALITY[1])?;
        self.fits(sheet, cell, &guess, &saddle)?;
        // Not a corner that the grid already has.
        let own = STEPS.iter().any(|s| sheet.get(add(cell, *s)).is_some_and(near));
        (!own).then_some(saddle)
    }
}
