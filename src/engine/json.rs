//! JSON as people read it, and back.

mod objects;

use serde::{Serialize, de::DeserializeOwned};

/// What a field holds, or the sentence that it is missing: for records that are read as the sum of several.
///
/// # Errors
/// The sentence.
pub fn need<T>(value: Option<T>, name: &str) -> Result<T, String> {
    value.ok_or_else(|| format!("missing field `{name}`"))
}

/// A value as an indented JSON text with a newline at its end.
///
/// It is written close together and then set out from its parts: otherwise every type that a file holds would be in the page's
/// program with two serializers. Integers beyond 64 bits are not for files.
pub fn text(value: &impl Serialize) -> String {
    // Fails only for keys that are not text, and there are none.
    let close = serde_json::to_string(value).unwrap_or_default();
    let parts: Option<serde_json::Value> = serde_json::from_str(&close).ok();
    parts.and_then(|parts| serde_json::to_string_pretty(&parts).ok()).unwrap_or(close) + "\n"
}

/// A value from a JSON text. Records are objects; lists of their values are refused.
///
/// # Errors
/// What is wrong with the text, and where.
pub fn read<T: DeserializeOwned>(text: &str) -> serde_json::Result<T> {
    let mut source = serde_json::Deserializer::from_str(text);
    let value = T::deserialize(objects::Objects(&mut source))?;
    source.end()?;
    Ok(value)
}

#[cfg(test)]
mod tests {
    use serde::Deserialize;

    use super::*;

    #[derive(Debug, PartialEq, Serialize, Deserialize)]
    struct Point {
        x: f64,
        y: Option<Box<Point>>,
    }

    #[derive(Debug, PartialEq, Serialize, Deserialize)]
    enum Shape {
        Nothing,
        Size(u8),
        Pair(u8, Point),
        Named { at: Point },
    }

    #[derive(Debug, PartialEq, Serialize, Deserialize)]
    struct Wrapped(Vec<(Shape, Point)>);

    #[test]
    fn reads_what_was_written() {
        let point = || Point { x: 0.1, y: Some(Box::new(Point { x: -2.0, y: None })) };
        let shapes = [Shape::Nothing, Shape::Size(3), Shape::Pair(1, point()), Shape::Named { at: point() }];
        let value = Wrapped(shapes.into_iter().map(|s| (s, point())).collect());
        assert_eq!(read::<Wrapped>(&text(&value)).unwrap(), value);
        assert!(read::<Point>("{\"x\": 1, \"y\": null} 2").unwrap_err().to_string().contains("trailing"));
    }

    #[test]
    fn a_list_is_no_record_at_any_depth() {
        for (broken, record) in [("[1, null]", "Point"), ("{\"x\": 1, \"y\": [1, null]}", "Point")] {
            let error = read::<Point>(broken).unwrap_err().to_string();
            assert!(error.contains("sequence") && error.contains(record), "{error}");
            assert!(serde_json::from_str::<Point>(broken).is_ok());
        }
        for broken in ["{\"Named\": [[1, null]]}", "{\"Pair\": [1, [1, null]]}"] {
            assert!(read::<Shape>(broken).is_err(), "{broken}");
        }
    }
}
