//! Where a cell of a lattice should be.

use nalgebra::Vector2;

use crate::detect::sheet::{Cell, Guess, STEPS, Sheet, add, guess};

/// Spacing above which places are exact enough to be extrapolated to third order, px.
const WIDE: f64 = 12.0;

/// [`guess`], and where that has too little around, one step from the neighbours: at the corners of an asymmetric board a dot has
/// one neighbour, and the diagonals there are short.
pub(super) fn predict<T: Copy>(
    sheet: &Sheet<T>,
    cell: Cell,
    place: impl Fn(T) -> Vector2<f64>,
) -> Option<Guess> {
    let at = |c: Cell| sheet.get(c).map(&place);
    if let Some(guess) = guess(sheet, cell, &place) {
        // Of a corner only its own line tells: with four places of it, to third order, which wide lenses need at their rim.
        let mut beside = STEPS.iter().filter(|s| sheet.get(add(cell, **s)).is_some());
        let line = |[c, r]: Cell| {
            let q = |n: i32| at(add(cell, [n * c, n * r]));
            Some(4.0 * (q(1)? + q(3)?) - 6.0 * q(2)? - q(4)?)
        };
        return match (beside.next(), beside.next()) {
            (Some(step), None) if guess.spacing() > WIDE => {
                Some(Guess { px: line(*step).unwrap_or(guess.px), ..guess })
            }
            _ => Some(guess),
        };
    }
    let mean = |list: &[Vector2<f64>]| {
        (!list.is_empty()).then(|| list.iter().sum::<Vector2<f64>>() / list.len() as f64)
    };
    let around = || (-2..=2).flat_map(|r| (-2..=2).map(move |c| add(cell, [c, r]))).filter(|c| *c != cell);
    let steps = |step: Cell| -> Vec<Vector2<f64>> {
        let ends = around().filter(|c| add(*c, step) != cell);
        ends.filter_map(|c| Some(at(add(c, step))? - at(c)?)).collect()
    };
    let (u, v) = (mean(&steps([1, 0]))?, mean(&steps([0, 1]))?);
    let from =
        STEPS.iter().filter_map(|s| Some(at(add(cell, *s))? - u * f64::from(s[0]) - v * f64::from(s[1])));
    let px = mean(&from.collect::<Vec<_>>())?;
    (u.perp(&v) > 1e-6).then_some(Guess { px, uv: [u, v] })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_corner_hangs_on_one_neighbour() {
        let mut sheet = Sheet::new();
        for [c, r] in [[1, 0], [1, 1], [2, 1], [1, -1]] {
            sheet.set([c, r], Vector2::new(f64::from(10 * c + r), f64::from(12 * r)));
        }
        assert!(guess(&sheet, [0, 0], |p| p).is_none());
        let g = predict(&sheet, [0, 0], |p| p).unwrap();
        assert!((g.px - Vector2::new(0.0, 0.0)).norm() < 1e-9, "{g:?}");
        assert!(predict(&sheet, [6, 6], |p| p).is_none());
    }
}
