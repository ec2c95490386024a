//! The strength of the smoothing by cross-validation, and what is left of pictures held out.

use nalgebra::{DVector, Vector2};

use super::{Field, HeldOut, grid::Grid};
use crate::{
    Error, Result,
    surface::{System, ViewRows, penalty},
};

/// Parts into which the groups of pictures are split.
const FOLDS: usize = 6;
/// Strengths of the smoothing, in units of the information about a usual knot.
const STRENGTHS: [f64; 8] = [1e-3, 1e-2, 3e-2, 1e-1, 3e-1, 1.0, 1e1, 1e2];
/// Pull of every knot to zero, in the same units: what boards cannot tell from a turn of the camera stays zero.
const PULL: f64 = 1e-5;

/// A field with what it leaves.
pub(super) struct Found {
    pub(super) field: Field,
    pub(super) supported_fraction: f64,
    pub(super) held_out: HeldOut,
    /// What a field that was fitted without the picture leaves of each corner, px.
    pub(super) left: Vec<Vec<Vector2<f64>>>,
}

/// Tries all strengths and fits the best to everything.
pub(super) fn search(views: &[ViewRows], grid: &Grid, groups: usize) -> Result<Found> {
    let undetermined = || {
        Error::Degenerate(
            "the corners do not determine a residual map: add pictures with the board all over the picture"
                .to_owned(),
        )
    };
    let corners = views.iter().flat_map(|v| &v.rows).map(|r| (&r.patch, r.weight));
    let (slots, free) = grid.supported(corners);
    if free == 0 {
        return Err(undetermined());
    }
    let folds = FOLDS.min(groups);
    let mut parts = vec![System::zero(free); folds];
    for view in views {
        parts[view.group % folds].add(view, &slots);
    }
    let mut whole = System::zero(free);
    parts.iter().for_each(|part| whole.add_all(part));
    let scale = whole.scale();
    let penalty = |strength: f64| penalty(grid.knots, &slots, free, strength, PULL);
    let trained: Vec<System> = parts.iter().map(|part| whole.without(part)).collect();

    let mut best: Option<(f64, f64, Vec<Vec<Vector2<f64>>>)> = None;
    for strength in STRENGTHS {
        let penalty = penalty(strength);
        let fields: Option<Vec<_>> = trained.iter().map(|t| t.solve(&penalty, scale)).collect();
        let Some(fields) = fields else { continue };
        let left: Vec<_> = views
            .iter()
            .map(|v| left_of(v, &slots, &fields[v.group % folds]))
            .collect::<Option<_>>()
            .ok_or_else(undetermined)?;
        let cost: f64 = views.iter().zip(&left).map(|(v, l)| squares(v, l)).sum();
        if best.as_ref().is_none_or(|b| cost < b.0) {
            best = Some((cost, strength, left));
        }
    }
    let (_, strength, left) = best.ok_or_else(undetermined)?;
    let knots = whole.solve(&penalty(strength), scale).ok_or_else(undetermined)?;
    let offsets = slots.iter().map(|s| s.map_or([0.0; 2], |s| [knots[2 * s], knots[2 * s + 1]]));
    let none = DVector::zeros(2 * free);
    let alone: Vec<_> =
        views.iter().map(|v| left_of(v, &slots, &none)).collect::<Option<_>>().ok_or_else(undetermined)?;
    Ok(Found {
        field: grid.field(offsets.collect())?,
        supported_fraction: grid.supported_fraction(&slots),
        held_out: judge(views, &alone, &left, groups, folds),
        left,
    })
}

/// What a field leaves of a view whose pose is free, px.
fn left_of(view: &ViewRows, slots: &[Option<usize>], knots: &DVector<f64>) -> Option<Vec<Vector2<f64>>> {
    let residuals = view.rows.iter().map(|row| {
        let mut r = row.residual;
        for part in row.patch.parts() {
            if let Some(s) = slots[part.at] {
                r -= part.weight * Vector2::new(knots[2 * s], knots[2 * s + 1]);
            }
        }
        r
    });
    view.with_pose_free(residuals.collect())
}

/// Σ w |r|².
fn squares(view: &ViewRows, left: &[Vector2<f64>]) -> f64 {
    view.rows.iter().zip(left).map(|(row, r)| row.weight * r.norm_squared()).sum()
}

/// Compares what is left without and with a field; the groups of pictures are the independent samples.
fn judge(
    views: &[ViewRows],
    without: &[Vec<Vector2<f64>>],
    with: &[Vec<Vector2<f64>>],
    groups: usize,
    folds: usize,
) -> HeldOut {
    let mut sums = [0.0; 3];
    let mut gains = vec![[0.0; 2]; groups];
    for (view, (without, with)) in views.iter().zip(without.iter().zip(with)) {
        let weight: f64 = view.rows.iter().map(|r| r.weight).sum();
        let [a, b] = [without, with].map(|left| squares(view, left));
        sums = [sums[0] + a, sums[1] + b, sums[2] + weight];
        let gain = &mut gains[view.group];
        *gain = [gain[0] + a - b, gain[1] + weight];
    }
    // A group counts by its mean corner, so that no long burst decides.
    let gains: Vec<f64> = gains.iter().filter(|g| g[1] > 0.0).map(|g| g[0] / g[1]).collect();
    let n = gains.len() as f64;
    let mean = gains.iter().sum::<f64>() / n;
    let variance = gains.iter().map(|g| (g - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
    let error = (variance / n).sqrt();
    let rms = |sum: f64| (sum / sums[2].max(f64::MIN_POSITIVE)).sqrt();
    HeldOut {
        without_px: rms(sums[0]),
        with_px: rms(sums[1]),
        standard_errors: if error > 0.0 { mean / error } else { 0.0 },
        groups,
        folds,
    }
}
