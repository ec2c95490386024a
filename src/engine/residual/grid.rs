//! Where the knots of a field stand, and which of them the data support.

use nalgebra::Vector2;

use super::{Field, field::KNOWN};
use crate::{Result, bspline::Patch};

/// Cells of the grid along the diagonal of the picture.
const CELLS: f64 = 12.0;
/// Sum of weights from which a knot is free: the worth of one corner in the middle of its reach.
const ENOUGH: f64 = 0.5;

/// The knots over a picture.
pub(super) struct Grid {
    pub(super) knots: [usize; 2],
    size_px: [f64; 2],
    step_px: [f64; 2],
}

impl Grid {
    /// Nearly square cells that end with the picture.
    pub(super) fn new(size_px: [u32; 2]) -> Self {
        let size_px = size_px.map(f64::from);
        let wanted = size_px[0].hypot(size_px[1]) / CELLS;
        let cells = size_px.map(|n| (n / wanted).round().max(1.0));
        Self { knots: cells.map(|n| n as usize + 3), step_px: [0, 1].map(|k| size_px[k] / cells[k]), size_px }
    }

    /// Number of knots.
    pub(super) const fn len(&self) -> usize {
        self.knots[0] * self.knots[1]
    }

    /// The knots around a place of the picture.
    pub(super) fn patch(&self, px: &Vector2<f64>) -> Patch {
        Patch::new([0, 1].map(|k| 1.0 + (px[k] + 0.5) / self.step_px[k]), self.knots)
    }

    /// The field with these values of the knots.
    pub(super) fn field(&self, offsets_px: Vec<[f64; 2]>) -> Result<Field> {
        Field::new([-0.5; 2], self.step_px, self.knots, offsets_px)
    }

    /// For each knot its place among the free ones; `None` where no data are near.
    pub(super) fn supported<'a>(
        &self,
        corners: impl Iterator<Item = (&'a Patch, f64)>,
    ) -> (Vec<Option<usize>>, usize) {
        let mut sums = vec![0.0; self.len()];
        for (patch, _) in corners.filter(|c| c.1 > 0.0) {
            for part in patch.parts() {
                sums[part.at] += part.weight;
            }
        }
        let mut count = 0;
        let slots = sums.iter().map(|sum| {
            (*sum >= ENOUGH).then(|| {
                count += 1;
                count - 1
            })
        });
        let slots = slots.collect();
        (slots, count)
    }

    /// Share of the picture where all knots are free.
    pub(super) fn supported_fraction(&self, slots: &[Option<usize>]) -> f64 {
        const SAMPLES: usize = 64;
        let [w, h] = self.size_px;
        let at = |k: usize, n: f64| (k as f64 + 0.5) / SAMPLES as f64 * n - 0.5;
        let inside = (0..SAMPLES * SAMPLES)
            .filter(|k| {
                let px = Vector2::new(at(k % SAMPLES, w), at(k / SAMPLES, h));
                let known: f64 =
                    self.patch(&px).parts().iter().filter(|p| slots[p.at].is_some()).map(|p| p.weight).sum();
                known > KNOWN
            })
            .count();
        inside as f64 / (SAMPLES * SAMPLES) as f64
    }
}
