//! What keeps a surface smooth where data are few.

use nalgebra::DMatrix;

/// Bending of strength `bend` and a pull of every knot to zero of strength `pull`, of one coordinate, for the free knots of a grid
/// of `[columns, rows]`; lower triangle.
///
/// P. Eilers, B. Marx, "Flexible smoothing with B-splines and penalties", Statistical Science 11(2), 1996.
pub(crate) fn penalty(
    knots: [usize; 2],
    slots: &[Option<usize>],
    free: usize,
    bend: f64,
    pull: f64,
) -> DMatrix<f64> {
    let mut penalty = DMatrix::from_diagonal_element(free, free, pull);
    for terms in bends(knots, slots) {
        for (i, a) in &terms {
            for (j, b) in terms.iter().filter(|other| other.0 <= *i) {
                penalty[(*i, *j)] += bend * a * b;
            }
        }
    }
    penalty
}

/// Second differences of the free knots along the columns, the rows and both, as `(knot's slot, factor)`: their squares sum to the
/// bending energy of the surface, in units of the step.
fn bends(knots: [usize; 2], slots: &[Option<usize>]) -> Vec<Vec<(usize, f64)>> {
    let [columns, rows] = knots;
    let root2 = std::f64::consts::SQRT_2;
    let mut bends = Vec::new();
    let mut push = |terms: &[(usize, f64)]| {
        let all: Option<Vec<_>> = terms.iter().map(|(at, f)| Some((slots[*at]?, *f))).collect();
        bends.extend(all);
    };
    for j in 0..rows {
        for i in 0..columns {
            let at = j * columns + i;
            if i + 2 < columns {
                push(&[(at, 1.0), (at + 1, -2.0), (at + 2, 1.0)]);
            }
            if j + 2 < rows {
                push(&[(at, 1.0), (at + columns, -2.0), (at + 2 * columns, 1.0)]);
            }
            if i + 1 < columns && j + 1 < rows {
                let below = at + columns;
                push(&[(at, root2), (at + 1, -root2), (below, -root2), (below + 1, root2)]);
            }
        }
    }
    bends
}
