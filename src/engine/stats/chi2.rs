//! The χ² distribution, for chances.

/// Probability that χ² with `freedom` degrees of freedom is at most `x`: the regularised incomplete gamma function
/// P(freedom/2, x/2) by its power series. With one degree of freedom, that a normal deviation is at most √x σ.
pub fn chi2_below(x: f64, freedom: usize) -> f64 {
    if freedom == 0 || x.is_nan() || x <= 0.0 {
        return 0.0;
    }
    let (a, x) = (freedom as f64 / 2.0, x / 2.0);
    if x > 700.0 + 10.0 * a {
        return 1.0;
    }
    // ln Γ(a + 1) of whole and half numbers.
    let (mut log_gamma, mut k) =
        if freedom.is_multiple_of(2) { (0.0, 1.0) } else { (0.5 * std::f64::consts::PI.ln(), 0.5) };
    while k <= a {
        log_gamma += f64::ln(k);
        k += 1.0;
    }
    let (mut term, mut sum, mut n) = (1.0, 1.0, a);
    while term > 1e-17 * sum {
        n += 1.0;
        term *= x / n;
        sum += term;
    }
    (a * x.ln() - x - log_gamma + sum.ln()).exp().min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn probabilities_of_tables() {
        // scipy.stats.chi2.cdf
        for (x, k, p) in [
            (1.0, 1, 0.682_689_492_137_085_9),
            (3.841_458_820_694_124, 1, 0.95),
            (5.991_464_547_107_979, 2, 0.95),
            (16.918_977_604_620_448, 9, 0.95),
            (0.01, 9, 8.408_755_4e-13),
            (1000.0, 9, 1.0),
        ] {
            let got = chi2_below(x, k);
            assert!((got - p).abs() < 1e-4 * p.min(1e-8), "{x} {k}: {got:e}");
        }
        assert_eq!((chi2_below(0.0, 3), chi2_below(f64::NAN, 3), chi2_below(1e9, 3)), (0.0, 0.0, 1.0));
    }
}
