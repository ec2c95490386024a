//! Numbers for people: rounded to what is known.

/// `[value, σ]`, both rounded to two digits of σ.
pub fn with_sigma(value: f64, sigma: f64) -> [String; 2] {
    let decimals = decimals_of(sigma);
    [format!("{value:.decimals$}"), format!("{sigma:.decimals$}")]
}

/// Digits after the point that show two significant digits of `sigma`.
fn decimals_of(sigma: f64) -> usize {
    if !(sigma.is_finite() && sigma > 0.0) {
        return 6;
    }
    // Rounding may carry: 0.0996 has its two digits at 0.10.
    let places = |s: f64| (1.0 - s.log10().floor()).clamp(0.0, 20.0) as usize;
    let first = places(sigma);
    let rounded = format!("{sigma:.first$}").parse().unwrap_or(sigma);
    if rounded > 0.0 { places(rounded) } else { first }
}

/// A positive figure with `digits` significant digits, without an exponent where it stays short.
pub fn significant(value: f64, digits: usize) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    // Rounding may carry: 0.9996 is 1.00.
    let rounded: f64 = format!("{value:.*e}", digits.max(1) - 1).parse().unwrap_or(value);
    let exponent = rounded.abs().log10().floor();
    if exponent < -5.0 {
        return format!("{value:.*e}", digits - 1);
    }
    let decimals = (digits as f64 - 1.0 - exponent).max(0.0) as usize;
    format!("{value:.decimals$}")
}

/// `1 picture`, `13 pictures`: for words that only take an s.
pub fn counted(n: usize, word: &str) -> String {
    format!("{n} {word}{}", if n == 1 { "" } else { "s" })
}

/// What a self-check leaves, for "projects …": `exactly`, or `within 0.31 px`.
pub fn within_px(px: f64) -> String {
    if px < 1e-9 {
        return "exactly".to_owned();
    }
    let decimals = (1.0 - px.log10().floor()).clamp(1.0, 10.0) as usize;
    format!("within {px:.decimals$} px")
}

/// An angle in degrees, one digit after the point.
pub fn degrees(rad: f64) -> String {
    let text = format!("{:.1}", rad.to_degrees());
    if text == "-0.0" { "0.0".to_owned() } else { text }
}

/// A share as a whole per cent.
pub fn percent(fraction: f64) -> String {
    format!("{:.0} %", 100.0 * fraction)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_is_singular() {
        assert_eq!([0, 1, 2].map(|n| counted(n, "view")), ["0 views", "1 view", "2 views"]);
    }

    #[test]
    fn two_digits_of_sigma() {
        for (value, sigma, text) in [
            (536.072_34, 0.1234, ["536.07", "0.12"]),
            (536.072_34, 0.0996, ["536.07", "0.10"]),
            (-0.280_123, 0.001_26, ["-0.2801", "0.0013"]),
            (1234.5, 187.0, ["1234", "187"]),
            (99.96, 9.96, ["100", "10"]),
            (1.0, 3e-13, ["1.00000000000000", "0.00000000000030"]),
        ] {
            assert_eq!(with_sigma(value, sigma), text, "{value} {sigma}");
        }
    }

    #[test]
    fn significant_digits() {
        assert_eq!(significant(0.195_83, 3), "0.196");
        assert_eq!(significant(12.345, 3), "12.3");
        assert_eq!(significant(1234.5, 3), "1234");
        assert_eq!(significant(3.21e-9, 3), "3.21e-9");
        assert_eq!((significant(0.0, 3), significant(0.999_6, 3)), ("0".to_owned(), "1.00".to_owned()));
        assert_eq!(
            [0.0, 3.1, 0.31, 4e-7].map(within_px),
            ["exactly", "within 3.1 px", "within 0.31 px", "within 0.00000040 px"]
        );
        assert_eq!(degrees(-1e-6), "0.0");
    }
}
