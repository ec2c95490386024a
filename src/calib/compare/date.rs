//! Dates as photographs, programs and people write them.

/// Days since 1 January 1970, of `2026:05:01 12:00:00` (EXIF), `2026-05-01T12:00`, `Sun May  3 10:00:00 2026` (C); `None` for others.
pub fn days(text: &str) -> Option<f64> {
    const MONTHS: [&str; 12] =
        ["jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec"];
    let lower = text.trim().to_lowercase();
    let words: Vec<&str> = lower.split(|c: char| !c.is_alphanumeric()).filter(|w| !w.is_empty()).collect();
    let named = words.iter().find_map(|w| MONTHS.iter().position(|m| w.get(..3) == Some(*m)));
    // A T may stand between date and time.
    let numbers = words.iter().flat_map(|w| w.split(|c: char| !c.is_ascii_digit()));
    let numbers: Vec<u32> = numbers.filter_map(|n| n.parse().ok()).collect();
    let (year, month, day, time) = match (named, numbers.as_slice()) {
        (Some(month), [day, h, m, s, year, ..]) => (*year, month as u32 + 1, *day, [*h, *m, *s]),
        (None, [year, month, day, time @ ..]) => {
            let at = |i: usize| time.get(i).copied().unwrap_or(0);
            (*year, *month, *day, [at(0), at(1), at(2)])
        }
        _ => return None,
    };
    let good = (1900..=9999).contains(&year) && (1..=12).contains(&month) && (1..=31).contains(&day);
    let [h, m, s] = time.map(f64::from);
    (good && h < 24.0 && m < 60.0 && s < 61.0)
        .then(|| civil(year, month, day) + (h + (m + s / 60.0) / 60.0) / 24.0)
}

/// A day as `2026-05-01`.
pub fn iso(days: f64) -> String {
    let (mut year, mut month) = (1970 + (days / 365.25).floor() as i64, 1);
    let start = |year: i64, month: u32| civil(year.clamp(1, 99_999) as u32, month, 1);
    while start(year + 1, 1) <= days {
        year += 1;
    }
    while start(year, 1) > days {
        year -= 1;
    }
    while month < 12 && start(year, month + 1) <= days {
        month += 1;
    }
    format!("{year:04}-{month:02}-{:02}", (days - start(year, month)).floor() as i64 + 1)
}

/// Days since 1970 of the Gregorian calendar; a year begins with March here, so that the leap day is its last.
fn civil(year: u32, month: u32, day: u32) -> f64 {
    let (y, m) = if month > 2 { (i64::from(year), month - 3) } else { (i64::from(year) - 1, month + 9) };
    let of_year = (153 * i64::from(m) + 2) / 5 + i64::from(day) - 1;
    (365 * y + y.div_euclid(4) - y.div_euclid(100) + y.div_euclid(400) + of_year - 719_468) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_in_three_hands() {
        let may = days("2026-05-03").unwrap();
        assert_eq!((days("1970-01-01"), days("2000-03-01")), (Some(0.0), Some(11_017.0)));
        assert_eq!(days("2026:05:03 12:00:00"), Some(may + 0.5));
        assert_eq!(days("2026-05-03T18:00:00Z"), Some(may + 0.75));
        assert_eq!(days("Sun May  3 06:00:00 2026"), Some(may + 0.25));
        for text in ["", "yesterday", "2026-13-01", "2026-05", "0000:00:00 00:00:00", "12:30:00"] {
            assert_eq!(days(text), None, "{text}");
        }
        for text in ["1970-01-01", "1999-12-31", "2000-02-29", "2024-03-01", "2026-11-29"] {
            assert_eq!(iso(days(text).unwrap() + 0.4), text);
        }
    }
}
