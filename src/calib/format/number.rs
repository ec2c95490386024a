//! Numbers as every reader understands them.

/// The shortest text that gives back the same `f64`, always with a decimal point and a signed exponent: `1000.0`,
/// `1.0e-7`.
///
/// YAML 1.1 readers (`PyYAML`) take `1e-7` for a string and Kalibr refuses `1000`.
pub(super) fn number(value: f64) -> String {
    let text = format!("{value:?}");
    let Some((mantissa, exponent)) = text.split_once('e') else { return text };
    let point = if mantissa.contains('.') { "" } else { ".0" };
    let sign = if exponent.starts_with('-') { "" } else { "+" };
    format!("{mantissa}{point}e{sign}{exponent}")
}

/// Numbers with a separator between them.
pub(super) fn joined<'a>(values: impl IntoIterator<Item = &'a f64>, separator: &str) -> String {
    values.into_iter().map(|v| number(*v)).collect::<Vec<_>>().join(separator)
}

/// Points as `[x, y], [x, y]`.
pub(super) fn points(list: &[[f64; 2]]) -> String {
    list.iter().map(|p| format!("[{}]", joined(p, ", "))).collect::<Vec<_>>().join(", ")
}

/// Exactly `N` numbers.
pub(super) fn array<const N: usize>(values: &[f64]) -> Option<[f64; N]> {
    values.try_into().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_round_trip_and_have_a_point() {
        for v in [0.0, -0.0, 1000.0, 0.1, -0.28, 1e-7, -3.25e-12, 1e16, 1.5e300, f64::MIN_POSITIVE, 1.0 / 3.0]
        {
            let text = number(v);
            assert!(text.contains('.'), "{text}");
            assert_eq!(text.parse::<f64>().unwrap().to_bits(), v.to_bits(), "{text}");
        }
        assert_eq!([number(1e-7), number(1e16), number(2.5e-7)], ["1.0e-7", "1.0e+16", "2.5e-7"]);
        assert_eq!(joined(&[1.0, 2.5], ", "), "1.0, 2.5");
    }
}
