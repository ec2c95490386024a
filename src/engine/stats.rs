//! Statistics of a solution: errors, coverage, poses, trends, comparison with the truth.
//!
//! Names and meanings are those of `docs/interface.md`: errors are lengths of the residuals of single corners, coverage is
//! over the corners that were used.

pub mod chi2;
mod indistinct;
pub mod regions;
pub mod spatial;
pub mod trend;

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

use super::{Error, Result, camera::Camera, order, pose::Pose, solution::Calibration, target::Target};
pub use chi2::{chi2_below, ln_chi2_above};
pub use indistinct::indistinct;
pub use trend::{Trend, trend};

/// Summary of per-corner errors, all in px but `n` (Table IV of the source document).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ErrorStats {
    /// Number of corners.
    pub n: usize,
    /// √(Σ e²/n).
    pub rms: f64,
    /// Mean.
    pub mean: f64,
    /// Median.
    pub median: f64,
    /// Smallest.
    pub min: f64,
    /// Largest.
    pub max: f64,
    /// Standard deviation about the mean with divisor n, so that rms² = mean² + std².
    pub std: f64,
    /// 95th percentile, interpolated.
    pub p95: f64,
}

/// Summary of per-corner errors; all zero for none.
pub fn errors(errors_px: &[f64]) -> ErrorStats {
    if errors_px.is_empty() {
        return ErrorStats::default();
    }
    let mut sorted = errors_px.to_vec();
    sorted.sort_by(f64::total_cmp);
    let n = sorted.len();
    let mean = sorted.iter().sum::<f64>() / n as f64;
    ErrorStats {
        n,
        rms: (sorted.iter().map(|e| e * e).sum::<f64>() / n as f64).sqrt(),
        mean,
        median: quantile(&sorted, 0.5),
        min: sorted[0],
        max: sorted[n - 1],
        std: (sorted.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / n as f64).sqrt(),
        p95: quantile(&sorted, 0.95),
    }
}

/// Quantile of sorted numbers, linear between neighbours; NaN for none.
pub fn quantile(sorted: &[f64], q: f64) -> f64 {
    if sorted.is_empty() {
        return f64::NAN;
    }
    let at = q.clamp(0.0, 1.0) * (sorted.len() - 1) as f64;
    let (low, part) = (at.floor() as usize, at.fract());
    sorted[low] + part * (sorted[(low + 1).min(sorted.len() - 1)] - sorted[low])
}

/// Cells per side of the grid that coverage counts in.
pub const CELLS: usize = 10;

/// How much of the picture the corners cover.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Coverage {
    /// (largest − smallest x) / width.
    pub width_fraction: f64,
    /// (largest − smallest y) / height.
    pub height_fraction: f64,
    /// Area of the convex hull / area of the picture.
    pub hull_fraction: f64,
    /// Share of the cells of a 10 × 10 grid with a corner in them.
    pub cells_fraction: f64,
    /// Corners in each cell, rows from the top; corners outside the picture count in the nearest cell.
    pub cells: Vec<Vec<u32>>,
}

/// Coverage of a picture of `size_px` by corners; all zero for none.
pub fn coverage(points: &[Vector2<f64>], size_px: [u32; 2]) -> Coverage {
    let [w, h] = size_px.map(|s| f64::from(s.max(1)));
    let mut cells = vec![vec![0; CELLS]; CELLS];
    let range = |k: usize| {
        let (low, high) =
            points.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), p| (l.min(p[k]), h.max(p[k])));
        (high - low).max(0.0)
    };
    for p in points {
        // The picture reaches half a pixel beyond the centres of its border pixels.
        let cell = |v: f64, size: f64| (((v + 0.5) / size * CELLS as f64).max(0.0) as usize).min(CELLS - 1);
        cells[cell(p.y, h)][cell(p.x, w)] += 1;
    }
    let hit = cells.iter().flatten().filter(|n| **n > 0).count();
    Coverage {
        width_fraction: range(0) / w,
        height_fraction: range(1) / h,
        hull_fraction: area(&convex_hull(points)) / (w * h),
        cells_fraction: hit as f64 / (CELLS * CELLS) as f64,
        cells,
    }
}

/// Convex hull, without repeated or collinear points (A. Andrew's monotone chain, 1979).
pub fn convex_hull(points: &[Vector2<f64>]) -> Vec<Vector2<f64>> {
    let mut sorted = points.to_vec();
    order::by(&mut sorted, |p| [p.x, p.y]);
    sorted.dedup();
    if sorted.len() < 3 {
        return sorted;
    }
    let half = |points: &mut dyn Iterator<Item = Vector2<f64>>| {
        let mut chain: Vec<Vector2<f64>> = Vec::new();
        for p in points {
            while let [.., a, b] = chain[..]
                && (b - a).perp(&(p - a)) <= 0.0
            {
                chain.pop();
            }
            chain.push(p);
        }
        chain.pop();
        chain
    };
    let mut hull = half(&mut sorted.iter().copied());
    hull.extend(half(&mut sorted.iter().rev().copied()));
    hull
}

/// Area of a simple polygon.
pub fn area(polygon: &[Vector2<f64>]) -> f64 {
    let next = polygon.iter().cycle().skip(1);
    0.5 * polygon.iter().zip(next).map(|(a, b)| a.perp(b)).sum::<f64>().abs()
}

/// How a board stands in front of the camera.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Stance {
    /// Angle between the board's normal and the optical axis.
    pub tilt_rad: f64,
    /// Rotation about the optical axis, `atan2(R21, R11)`.
    pub roll_rad: f64,
    /// Distance of the middle of the board from the camera, in the board's unit.
    pub distance: f64,
}

/// Tilt, roll and distance of a board.
pub fn stance(camera_from_board: &Pose, target: &Target) -> Stance {
    // Surveyed points may have been written down with z towards the camera.
    let tilt_rad = match target {
        Target::Points { .. } => {
            let normal = camera_from_board.rotation * target.normal_in_board();
            normal.x.hypot(normal.y).atan2(normal.z.abs())
        }
        _ => camera_from_board.tilt_rad(),
    };
    Stance {
        tilt_rad,
        roll_rad: camera_from_board.roll_rad(),
        distance: camera_from_board.apply(&target.center_in_board()).coords.norm(),
    }
}

/// A parameter beside its true value.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Comparison {
    /// Name of the parameter.
    pub name: String,
    /// Calibrated value.
    pub estimate: f64,
    /// True value.
    pub truth: f64,
    /// |estimate − truth|.
    pub absolute: f64,
    /// |estimate − truth| / |truth|; none where the truth is zero.
    pub relative: Option<f64>,
    /// |estimate − truth| / σ; none where the parameter was fixed.
    pub in_sigma: Option<f64>,
}

/// Compares a calibration with the truth, parameter by parameter; a term that one of the two models lacks counts as zero.
///
/// # Errors
/// [`Error::Invalid`] where the pictures have another size.
pub fn compare(calibration: &Calibration, truth: &Camera) -> Result<Vec<Comparison>> {
    let camera = &calibration.camera;
    if camera.size_px != truth.size_px {
        let ([a, b], [c, d]) = (camera.size_px, truth.size_px);
        return Err(Error::Invalid(format!(
            "the pictures are {a} x {b} px, the truth is for {c} x {d} px: give the truth of these pictures"
        )));
    }
    let (ours, theirs) = (camera.spec().params, truth.spec().params);
    let names = ours.iter().chain(theirs.iter().filter(|p| camera.get(p.name).is_none())).map(|p| p.name);
    Ok(names
        .map(|name| {
            let (estimate, truth) = (camera.get(name).unwrap_or(0.0), truth.get(name).unwrap_or(0.0));
            let absolute = (estimate - truth).abs();
            let sigma = camera.spec().index(name).and_then(|i| calibration.sigma[i]);
            Comparison {
                name: name.to_owned(),
                estimate,
                truth,
                absolute,
                relative: (truth != 0.0).then(|| absolute / truth.abs()),
                in_sigma: sigma.filter(|s| *s > 0.0).map(|s| absolute / s),
            }
        })
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn error_statistics_are_numpys() {
        // numpy: mean, median, std, percentile 95 of [3, 1, 2, 10, 4].
        let s = errors(&[3.0, 1.0, 2.0, 10.0, 4.0]);
        assert_eq!((s.n, s.mean, s.median, s.min, s.max), (5, 4.0, 3.0, 1.0, 10.0));
        assert!((s.std - 3.162_277_660_168_379_5).abs() < 1e-15 && (s.p95 - 8.8).abs() < 1e-12);
        assert!((s.rms.powi(2) - s.mean.powi(2) - s.std.powi(2)).abs() < 1e-12);
        assert_eq!(errors(&[]), ErrorStats::default());
    }

    #[test]
    fn coverage_of_a_rectangle() {
        let points = [[-0.5, -0.5], [49.5, -0.5], [49.5, 19.5], [-0.5, 19.5], [20.0, 10.0], [49.5, 5.0]];
        let c = coverage(&points.map(Vector2::from), [100, 40]);
        assert_eq!((c.width_fraction, c.height_fraction, c.hull_fraction), (0.5, 0.5, 0.25));
        assert_eq!((c.cells_fraction, c.cells[0][0], c.cells[5][5]), (0.06, 1, 1));
        assert_eq!(coverage(&[], [100, 40]).hull_fraction, 0.0);
    }

    #[test]
    fn hulls_drop_inner_and_collinear_points() {
        let square = [[0.0, 0.0], [2.0, 0.0], [1.0, 1.0], [2.0, 2.0], [0.0, 2.0], [1.0, 0.0], [0.0, 0.0]];
        let hull = convex_hull(&square.map(Vector2::from));
        assert_eq!((hull.len(), area(&hull)), (4, 4.0));
        assert_eq!(area(&convex_hull(&[Vector2::zeros(); 5])), 0.0);
    }
}
