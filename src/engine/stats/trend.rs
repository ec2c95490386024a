//! Straight-line trends with their uncertainty: does the error grow with the tilt?

use serde::{Deserialize, Serialize};

/// A least-squares line `y = intercept + slope · x` and what may be said about it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Trend {
    /// Number of points.
    pub n: usize,
    /// Change of y per unit of x.
    pub slope: f64,
    /// y at x = 0.
    pub intercept: f64,
    /// 95 % confidence interval of the slope (Student's t with n − 2 degrees of freedom).
    pub slope_ci95: [f64; 2],
    /// Pearson's correlation.
    pub correlation: f64,
    /// 95 % confidence interval of the correlation (R. A. Fisher's z transform, 1915).
    pub correlation_ci95: [f64; 2],
}

impl Trend {
    /// y on the line.
    pub fn at(&self, x: f64) -> f64 {
        self.intercept + self.slope * x
    }

    /// Whether the slope differs from zero at the 95 % level.
    pub fn is_significant(&self) -> bool {
        self.slope_ci95[0] > 0.0 || self.slope_ci95[1] < 0.0
    }
}

/// Fits a line to `(x, y)`; `None` below four points and where all x are equal.
pub fn trend(points: &[(f64, f64)]) -> Option<Trend> {
    let n = points.len();
    if n < 4 {
        return None;
    }
    let mean = |f: fn(&(f64, f64)) -> f64| points.iter().map(f).sum::<f64>() / n as f64;
    let (mx, my) = (mean(|p| p.0), mean(|p| p.1));
    let (mut sxx, mut sxy, mut syy) = (0.0, 0.0, 0.0);
    for (x, y) in points {
        sxx += (x - mx).powi(2);
        sxy += (x - mx) * (y - my);
        syy += (y - my).powi(2);
    }
    if sxx.is_nan() || sxx <= 0.0 {
        return None;
    }
    let slope = sxy / sxx;
    let freedom = (n - 2) as f64;
    let half = student_95(freedom) * ((syy - slope * sxy).max(0.0) / freedom / sxx).sqrt();
    let correlation = if syy > 0.0 { (sxy / (sxx * syy).sqrt()).clamp(-1.0, 1.0) } else { 0.0 };
    let z = correlation.clamp(-1.0 + 1e-15, 1.0 - 1e-15).atanh();
    let dz = NORMAL_95 / ((n - 3) as f64).sqrt();
    Some(Trend {
        n,
        slope,
        intercept: my - slope * mx,
        slope_ci95: [slope - half, slope + half],
        correlation,
        correlation_ci95: [(z - dz).tanh(), (z + dz).tanh()],
    })
}

const NORMAL_95: f64 = 1.959_963_984_540_054;

/// Two-sided 95 % quantile of Student's t: exact for 1 and 2 degrees of freedom, else the Cornish–Fisher expansion
/// (Abramowitz & Stegun 26.7.5), within 0.5 % from 3 on.
fn student_95(freedom: f64) -> f64 {
    let (x, n) = (NORMAL_95, freedom);
    if n < 1.5 {
        return 12.706_204_736;
    }
    if n < 2.5 {
        return 4.302_652_730;
    }
    let (x3, x5, x7, x9) = (x.powi(3), x.powi(5), x.powi(7), x.powi(9));
    x + (x3 + x) / (4.0 * n)
        + (5.0 * x5 + 16.0 * x3 + 3.0 * x) / (96.0 * n * n)
        + (3.0 * x7 + 19.0 * x5 + 17.0 * x3 - 15.0 * x) / (384.0 * n.powi(3))
        + (79.0 * x9 + 776.0 * x7 + 1482.0 * x5 - 1920.0 * x3 - 945.0 * x) / (92160.0 * n.powi(4))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_of_students_t() {
        // Tables: 3.182, 2.571, 2.228, 2.042.
        for (n, t) in [(3.0, 3.182), (5.0, 2.571), (10.0, 2.228), (30.0, 2.042)] {
            assert!((student_95(n) / t - 1.0).abs() < 5e-3, "{n}: {}", student_95(n));
        }
    }

    #[test]
    fn a_line_with_scatter() {
        // scipy.stats.linregress: slope 0.99, intercept 0.06, rvalue 0.99741, stderr 0.031.
        let points = [(0.0, 0.1), (1.0, 0.9), (2.0, 2.2), (3.0, 3.0), (4.0, 4.0)];
        let t = trend(&points).unwrap();
        assert!((t.slope - 0.99).abs() < 1e-12 && (t.intercept - 0.06).abs() < 1e-12);
        assert!((t.correlation - 0.997_408_334_692_75).abs() < 1e-12);
        assert!(t.is_significant() && t.correlation_ci95[0] > 0.9 && t.correlation_ci95[1] < 1.0);
        assert!(trend(&points[..3]).is_none() && trend(&[(1.0, 2.0); 5]).is_none());
    }
}
