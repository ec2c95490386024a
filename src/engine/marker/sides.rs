//! Corners of markers where nothing else touches them: crossings of their sides, each fitted by maximum likelihood ([`Side`]).

use nalgebra::{SMatrix, SVector, Vector2};

use super::{Mark, dictionary::Dictionary};
use crate::{
    detect::strip::side::{Curvature, Side, Start},
    image::{Plane, Sample},
};

/// Fewest sides that say together how lines bend.
const FEWEST: usize = 24;

type Terms = SVector<f64, 14>;
type Square = SMatrix<f64, 14, 14>;

/// Moves corners to where the sides meet, with their σ; where a side is not fitted the corner stays.
pub(super) fn sharpen<T: Sample>(picture: &Plane<T>, marks: &mut [Mark]) {
    let mut sides: Vec<[Option<Side>; 4]> =
        marks.iter().map(|m| [0, 1, 2, 3].map(|k| Side::fit(picture, &start(m, k)))).collect();
    let mut scatters: Vec<f64> = sides.iter().flatten().flatten().map(Side::scatter).collect();
    scatters.sort_by(f64::total_cmp);
    bend(&mut sides, [picture.width(), picture.height()]);
    let usual = scatters.get(scatters.len() / 2).copied().unwrap_or(1.0);
    for (mark, sides) in marks.iter_mut().zip(&sides) {
        for k in 0..4 {
            let Some((before, after)) = sides[(k + 3) % 4].as_ref().zip(sides[k].as_ref()) else { continue };
            if let Some((px, sigma_px)) = before.crossing(after, mark.corners[k], usual) {
                (mark.corners[k], mark.sigma_px[k]) = (px, sigma_px);
            }
        }
    }
}

/// Lets all sides say together how they bend: straight lines that a lens bends follow the second derivative of its distortion, here of a
/// polynomial of third degree over the picture.
fn bend(sides: &mut [[Option<Side>; 4]], size: [usize; 2]) {
    let all: Vec<Curvature> = sides.iter().flatten().flatten().map(Side::curvature).collect();
    if all.len() < FEWEST {
        return;
    }
    let unit = 0.5 * size[0].max(size[1]) as f64;
    let rows: Vec<Terms> = all.iter().map(|c| terms(c, size.map(|n| 0.5 * n as f64), unit)).collect();
    // What the polynomial leaves is scatter of its own, found in two rounds.
    let mut own = 0.0;
    let mut fitted = None;
    for _ in 0..3 {
        let (mut matrix, mut right) = (Square::identity() * 1e-12, Terms::zeros());
        for (row, c) in rows.iter().zip(&all) {
            let weight = (c.variance + own).recip();
            matrix += row * row.transpose() * weight;
            right += row * (c.value * weight);
        }
        // As good as nothing is known of the coefficients: a line across the picture bends by less than its length.
        matrix += Square::identity() * (unit * unit);
        let Some(inverse) = matrix.cholesky().map(|m| m.inverse()) else { return };
        let found = inverse * right;
        let mut left: Vec<f64> =
            rows.iter().zip(&all).map(|(row, c)| (c.value - row.dot(&found)).powi(2) - c.variance).collect();
        left.sort_by(f64::total_cmp);
        let few = left.len() / 20;
        let kept = &left[few..left.len() - few];
        own = (kept.iter().sum::<f64>() / kept.len() as f64).max(0.0);
        fitted = Some((inverse, found));
    }
    let Some((inverse, found)) = fitted else { return };
    for (side, row) in sides.iter_mut().flatten().flatten().zip(&rows) {
        *side = side.bent(row.dot(&found), row.dot(&(inverse * row)) + own);
    }
}

/// Curvature of a line by each coefficient of the polynomial.
fn terms(c: &Curvature, middle: [f64; 2], unit: f64) -> Terms {
    let p = (c.at - Vector2::from(middle)) / unit;
    let (dx, dy) = (c.along.x, c.along.y);
    let [xx, xy, yy] = [dx * dx, 2.0 * dx * dy, dy * dy];
    let one = [xx, xy, yy, p.x * xx, p.y * xx + p.x * xy, p.x * yy + p.y * xy, p.y * yy];
    Terms::from_fn(|i, _| one[i % 7] * if i < 7 { c.normal.x } else { c.normal.y } / unit)
}

/// Side k of a mark, from corner k on.
fn start(mark: &Mark, k: usize) -> Start {
    let ends = [mark.corners[k], mark.corners[(k + 1) % 4]];
    let along = (ends[1] - ends[0]).normalize();
    // Width of the border, and of a cell: the margin is at least as wide.
    let real = mark.readings.iter().filter(|r| Dictionary::any_has(r.bits));
    let cells = real.map(|r| (f64::from(r.border), f64::from(r.bits.cells + 2 * r.border)));
    let share = |of: fn((f64, f64)) -> f64| cells.clone().map(of).fold(1.0, f64::min);
    let side = mark.side_px();
    Start {
        ends,
        bulge: Vector2::zeros(),
        // Clockwise, so outwards is to the left of the way where y runs down.
        outwards: Vector2::new(along.y, -along.x),
        clear_px: [share(|(border, cells)| border / cells), share(|(_, cells)| 1.0 / cells)]
            .map(|c| c * side),
        dark: !mark.inverted,
    }
}
