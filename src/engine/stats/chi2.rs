//! The χ² distribution, for chances.

/// Terms of the continued fraction at most: it ends by itself after some ten times √(freedom).
const MOST_TERMS: f64 = 1e5;

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
    let (mut term, mut sum, mut n) = (1.0, 1.0, a);
    while term > 1e-17 * sum {
        n += 1.0;
        term *= x / n;
        sum += term;
    }
    (a * x.ln() - x - log_factorial(freedom) + sum.ln()).exp().min(1.0)
}

/// Logarithm of the probability that χ² with `freedom` degrees of freedom is above `x`, however small: the continued fraction of
/// Γ(freedom/2, x/2) by Lentz's method where x is above the mean.
pub fn ln_chi2_above(x: f64, freedom: usize) -> f64 {
    let (a, half) = (freedom as f64 / 2.0, x / 2.0);
    if freedom == 0 || x.is_nan() || half <= a {
        return (-chi2_below(x, freedom)).ln_1p();
    }
    let mut b = half + 1.0 - a;
    let mut d = 1.0 / b;
    let (mut c, mut fraction, mut n) = (f64::INFINITY, d, 0.0);
    loop {
        n += 1.0;
        let numerator = n * (a - n);
        b += 2.0;
        d = 1.0 / (b + numerator * d);
        c = b + numerator / c;
        fraction *= c * d;
        if (c * d - 1.0).abs() < 1e-14 || n > MOST_TERMS {
            return (a * half.ln() - half - (log_factorial(freedom) - a.ln()) + fraction.ln()).min(0.0);
        }
    }
}

/// ln Γ(freedom/2 + 1).
fn log_factorial(freedom: usize) -> f64 {
    let (log_gamma, first) =
        if freedom.is_multiple_of(2) { (0.0, 1.0) } else { (0.5 * std::f64::consts::PI.ln(), 0.5) };
    let factors =
        std::iter::successors(Some(first), |k| Some(k + 1.0)).take_while(|k| *k <= freedom as f64 / 2.0);
    log_gamma + factors.map(f64::ln).sum::<f64>()
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
        // mpmath, 40 digits: log(gammainc(k/2, x/2, inf, regularized=True))
        for (x, k, p) in [
            (0.5, 1, -0.7350111298370844),
            (13.0, 1, -8.074140187195215),
            (60.0, 2, -30.0),
            (30.0, 13, -5.358130055408569),
            (12.0, 13, -0.639333738896183),
            (500.0, 9, -233.1145815656839),
            (130.0, 120, -1.382053777212152),
            (400.0, 120, -71.586_452_533_509_1),
            (5000.0, 3, -2495.966994816902),
        ] {
            let got = ln_chi2_above(x, k);
            assert!((got - p).abs() < 1e-9 * p.abs().max(1e-9), "{x} {k}: {got:e}");
        }
        assert_eq!((ln_chi2_above(0.0, 3), ln_chi2_above(-1.0, 3)), (0.0, 0.0));
        assert_eq!((chi2_below(0.0, 3), chi2_below(f64::NAN, 3), chi2_below(1e9, 3)), (0.0, 0.0, 1.0));
    }
}
