//! One tree for YAML, JSON and Python literals, with getters whose errors name the field.

use saphyr::{LoadableYamlNode, Scalar, Yaml};
use serde_json::Value;

use super::number;
use crate::calib::{Error, Result};

/// Deepest nesting that is read; camera files need six levels.
const MAX_DEPTH: usize = 64;

/// A value of a file.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Node {
    Null,
    Number(f64),
    Text(String),
    List(Vec<Self>),
    Map(Vec<(String, Self)>),
}

fn wrong(message: impl Into<String>) -> Error {
    Error::Invalid(message.into())
}

impl Node {
    /// Reads JSON.
    pub(super) fn from_json(text: &str) -> Result<Self> {
        let value: Value = serde_json::from_str(text).map_err(|e| wrong(format!("not valid JSON: {e}")))?;
        Ok(value.into())
    }

    /// Reads YAML, OpenCV's dialect included.
    pub(super) fn from_yaml(text: &str) -> Result<Self> {
        // OpenCV writes "%YAML:1.0", which is no YAML directive; no version changes the meaning of a camera file.
        let (header, rest) = text.split_once('\n').unwrap_or((text, ""));
        let body = if header.starts_with("%YAML") { rest } else { text };
        guard_depth(body)?;
        let documents = Yaml::load_from_str(body).map_err(|e| wrong(format!("not valid YAML: {e}")))?;
        documents.first().map(|y| Self::from_yaml_node(y, 0)).ok_or_else(|| wrong("the file is empty"))
    }

    fn from_yaml_node(yaml: &Yaml<'_>, depth: usize) -> Self {
        match yaml {
            _ if depth > 2 * MAX_DEPTH => Self::Null,
            Yaml::Value(Scalar::Integer(i)) => Self::Number(*i as f64),
            Yaml::Value(Scalar::FloatingPoint(f)) => Self::Number(f.into_inner()),
            Yaml::Value(Scalar::Boolean(b)) => Self::Text(b.to_string()),
            Yaml::Value(Scalar::String(s)) | Yaml::Representation(s, ..) => Self::Text(s.to_string()),
            Yaml::Sequence(items) => {
                Self::List(items.iter().map(|y| Self::from_yaml_node(y, depth + 1)).collect())
            }
            Yaml::Mapping(map) => Self::Map(
                map.iter()
                    .filter_map(|(k, v)| {
                        let key = match k {
                            Yaml::Value(Scalar::String(s)) => s.to_string(),
                            Yaml::Value(Scalar::Integer(i)) => i.to_string(),
                            _ => return None,
                        };
                        Some((key, Self::from_yaml_node(v, depth + 1)))
                    })
                    .collect(),
            ),
            Yaml::Tagged(_, inner) => Self::from_yaml_node(inner, depth + 1),
            Yaml::Value(Scalar::Null) | Yaml::Alias(_) | Yaml::BadValue => Self::Null,
        }
    }

    /// The value under `key`; `None` where it is absent or null, and where this is no map.
    pub(super) fn find(&self, key: &str) -> Option<&Self> {
        self.field(key).filter(|v| **v != Self::Null)
    }

    /// What stands under `key`, null included.
    pub(super) fn field(&self, key: &str) -> Option<&Self> {
        let Self::Map(entries) = self else { return None };
        entries.iter().find(|(k, _)| k == key).map(|(_, v)| v)
    }

    /// This map with the values that `other` has under `keys` in place of its own.
    pub(super) fn overridden(&self, other: &Self, keys: &[&str]) -> Self {
        let Self::Map(entries) = self else { return self.clone() };
        let given = keys.iter().filter_map(|k| other.field(k).map(|v| ((*k).to_owned(), v.clone())));
        let own = entries.iter().filter(|(k, _)| !keys.contains(&k.as_str()) || other.field(k).is_none());
        Self::Map(given.chain(own.cloned()).collect())
    }

    /// The value under the first of several names, with that name.
    pub(super) fn find_any<'k>(&self, keys: &[&'k str]) -> Option<(&'k str, &Self)> {
        keys.iter().find_map(|k| self.find(k).map(|v| (*k, v)))
    }

    /// The value under `key`, or an error that names it.
    pub(super) fn get(&self, key: &str) -> Result<&Self> {
        self.find(key).ok_or_else(|| wrong(format!("the field {key} is missing")))
    }

    /// A finite number; text that is a number counts.
    pub(super) fn number(&self, field: &str) -> Result<f64> {
        let value = match self {
            Self::Number(v) => Some(*v),
            Self::Text(t) => yaml_number(t),
            _ => None,
        };
        match value {
            Some(v) if v.is_finite() => Ok(v),
            Some(v) => Err(wrong(format!("{field} is {v}: it must be a finite number"))),
            None => Err(wrong(format!("{field} must be a number"))),
        }
    }

    /// `key` as a finite number.
    pub(super) fn number_at(&self, key: &str) -> Result<f64> {
        self.get(key)?.number(key)
    }

    /// `key` as a finite number, zero where it is absent.
    pub(super) fn number_or_zero(&self, key: &str) -> Result<f64> {
        self.find(key).map_or(Ok(0.0), |v| v.number(key))
    }

    /// A list of finite numbers, nested lists in order; text is split at blanks and commas.
    pub(super) fn numbers(&self, field: &str) -> Result<Vec<f64>> {
        let mut out = Vec::new();
        self.collect(field, &mut out)?;
        Ok(out)
    }

    fn collect(&self, field: &str, out: &mut Vec<f64>) -> Result<()> {
        match self {
            Self::List(items) => items.iter().try_for_each(|n| n.collect(field, out))?,
            Self::Text(t) => {
                for word in t.split(|c: char| c.is_whitespace() || c == ',').filter(|w| !w.is_empty()) {
                    out.push(Self::Text(word.to_owned()).number(field)?);
                }
            }
            Self::Number(_) => out.push(self.number(field)?),
            Self::Null | Self::Map(_) => return Err(wrong(format!("{field} must be a list of numbers"))),
        }
        Ok(())
    }

    /// `key` as exactly `N` finite numbers.
    pub(super) fn array_at<const N: usize>(&self, key: &str) -> Result<[f64; N]> {
        let values = self.get(key)?.numbers(key)?;
        number::array(&values)
            .ok_or_else(|| wrong(format!("{key} has {} numbers, {N} are expected", values.len())))
    }

    /// `key` as text.
    pub(super) fn text_at(&self, key: &str) -> Option<&str> {
        match self.find(key) {
            Some(Self::Text(t)) => Some(t),
            _ => None,
        }
    }

    /// The items of a list; none where it is no list.
    pub(super) fn items(&self) -> &[Self] {
        match self {
            Self::List(items) => items,
            _ => &[],
        }
    }
}

impl From<Value> for Node {
    fn from(value: Value) -> Self {
        match value {
            Value::Null => Self::Null,
            Value::Bool(b) => Self::Text(b.to_string()),
            Value::Number(n) => n.as_f64().map_or(Self::Null, Self::Number),
            Value::String(s) => Self::Text(s),
            Value::Array(items) => Self::List(items.into_iter().map(Self::from).collect()),
            Value::Object(map) => Self::Map(map.into_iter().map(|(k, v)| (k, Self::from(v))).collect()),
        }
    }
}

/// A list of points `[x, y]`, px.
///
/// # Errors
/// [`Error::Invalid`] with the field.
pub(super) fn polygon(node: &Node, field: &str) -> Result<Vec<[f64; 2]>> {
    let numbers = node.numbers(field)?;
    let (pairs, rest) = numbers.as_chunks::<2>();
    if !rest.is_empty() || !numbers.iter().all(|v| v.is_finite()) {
        return Err(Error::Invalid(format!("{field} must hold points [x, y]")));
    }
    Ok(pairs.to_vec())
}

/// A width and a height as whole numbers of pixels.
pub(super) fn size_px(width: f64, height: f64) -> Result<[u32; 2]> {
    let whole = |v: f64| {
        ((1.0..=1e6).contains(&v) && v.fract() == 0.0).then_some(v as u32).ok_or_else(|| {
            wrong(format!(
                "the picture size {width} x {height} must be two whole numbers of pixels, at least 1"
            ))
        })
    };
    Ok([whole(width)?, whole(height)?])
}

/// Numbers as YAML and C programs spell them: `30.`, `.5`, `.NaN`, `-.Inf`.
fn yaml_number(text: &str) -> Option<f64> {
    let t = text.trim();
    t.parse().ok().or_else(|| {
        let lower = t.to_ascii_lowercase();
        match lower.trim_start_matches(['+', '-']) {
            ".nan" => Some(f64::NAN),
            ".inf" => Some(f64::INFINITY),
            _ => None,
        }
    })
}

/// Refuses nesting that no camera file has, before a recursive parser or drop meets it.
fn guard_depth(text: &str) -> Result<()> {
    let too_deep = || wrong("nested too deeply for a camera file");
    let mut depth = 0usize;
    for b in text.bytes() {
        match b {
            b'[' | b'{' => depth += 1,
            b']' | b'}' => depth = depth.saturating_sub(1),
            _ => {}
        }
        if depth > MAX_DEPTH {
            return Err(too_deep());
        }
    }
    let markers =
        |line: &str| line.bytes().take_while(|b| matches!(b, b' ' | b'\t' | b'-' | b'?' | b':')).count();
    if text.lines().any(|line| markers(line) > 2 * MAX_DEPTH && !line.trim().is_empty()) {
        return Err(too_deep());
    }
    Ok(())
}
