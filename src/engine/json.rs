//! JSON as people read it.

use serde::Serialize;

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
