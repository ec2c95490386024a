//! The grammar `[FORMAT:]FILE`.

use std::{fmt, str::FromStr};

use super::{FORMATS, Format, by_name, names};
use crate::calib::{Error, Result};

/// Where a camera file goes and in which format: `[FORMAT:]FILE`.
#[derive(Clone, Debug)]
pub struct Destination {
    /// By the name before the colon, else by the extension.
    pub format: &'static Format,
    /// The path.
    pub path: String,
}

impl Destination {
    /// The format that an extension means.
    ///
    /// # Errors
    /// [`Error::Invalid`] with the list of formats.
    pub fn by_extension(path: &str) -> Result<&'static Format> {
        extension(path).and_then(|e| FORMATS.iter().find(|f| f.extensions.contains(&e.as_str()))).ok_or_else(
            || {
                Error::Invalid(format!(
                    "{path}: the extension does not say which format: write FORMAT:{path} with one of {}",
                    names()
                ))
            },
        )
    }
}

/// Extension of a path in lower case.
pub(super) fn extension(path: &str) -> Option<String> {
    let name = path.rsplit(['/', '\\']).next().unwrap_or(path);
    name.rsplit_once('.').filter(|(stem, e)| !stem.is_empty() && !e.is_empty()).map(|(_, e)| e.to_lowercase())
}

impl FromStr for Destination {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        // One letter before the colon is a drive; a separator or a dot before it belongs to a path.
        let prefix =
            text.split_once(':').filter(|(before, _)| before.len() > 1 && !before.contains(['/', '\\', '.']));
        let (format, path) = match prefix {
            Some((name, path)) => (by_name(name)?, path),
            None => (Self::by_extension(text)?, text),
        };
        if path.is_empty() || path.ends_with(['/', '\\']) {
            return Err(Error::Invalid(format!(
                "\"{text}\" names no file: write for example {}:camera.{}",
                format.name, format.usual[0]
            )));
        }
        Ok(Self { format, path: path.to_owned() })
    }
}

impl fmt::Display for Destination {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", self.format.name, self.path)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_extensions_choose_the_format() {
        for (text, format, path) in [
            ("out.yaml", "opencv", "out.yaml"),
            ("OUT.YML", "opencv", "OUT.YML"),
            ("ros:out.yaml", "ros", "out.yaml"),
            ("Kalibr:chain.yaml", "kalibr", "chain.yaml"),
            ("cameras.txt", "colmap", "cameras.txt"),
            ("nerfstudio:transforms.json", "nerfstudio", "transforms.json"),
            ("out.json", "straightedge", "out.json"),
            ("basalt:out.json", "basalt", "out.json"),
            ("a.cameramodel", "mrcal", "a.cameramodel"),
            ("intrinsics.m", "matlab", "intrinsics.m"),
            ("lens.xml", "metashape", "lens.xml"),
            (r"C:\results\out.yaml", "opencv", r"C:\results\out.yaml"),
            (r"C:out.yaml", "opencv", "C:out.yaml"),
            (r"ros:C:\results\out.yaml", "ros", r"C:\results\out.yaml"),
            ("./a:b.yaml", "opencv", "./a:b.yaml"),
            ("opencv:no_extension", "opencv", "no_extension"),
        ] {
            let d: Destination = text.parse().unwrap();
            assert_eq!((d.format.name, d.path.as_str()), (format, path), "{text}");
        }
    }

    #[test]
    fn what_is_no_destination_is_explained() {
        for text in ["", "camera", "camera.docx", "caffe:out.yaml", "ros:", "ros:out/", ".yaml", ":"] {
            let error = text.parse::<Destination>().unwrap_err().to_string();
            assert!(
                error.contains("opencv, ros, kalibr") || error.contains("names no file"),
                "{text}: {error}"
            );
        }
    }
}
