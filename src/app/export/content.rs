//! What a file will hold.

use std::{borrow::Cow, sync::Arc};

use super::png::png;
use crate::calib::{
    Result,
    camera::Camera,
    html,
    report::Report,
    solution::Calibration,
    stmap::{self, Storage, Way},
    target::Target,
    undistort::Framing,
};
#[cfg(not(target_arch = "wasm32"))]
use crate::job::evidence::splined_camera;

/// The content of a file. What takes time to make is made where it is written, off the thread of the window.
#[derive(Clone, Debug, PartialEq)]
pub enum Content {
    /// As it is.
    Bytes(Arc<Vec<u8>>),
    /// An SVG, drawn as PNG.
    Png(Arc<String>),
    /// The report as a page.
    Page(Arc<Report>),
    /// An STMap.
    Map(Box<Map>),
    /// A splined camera, to be fitted from a calibration with its board.
    Splined(Box<(Calibration, Target)>),
}

/// A map that takes a lens out of a picture, or puts it back.
#[derive(Clone, Debug, PartialEq)]
pub struct Map {
    /// The lens.
    pub camera: Camera,
    /// What straightened pictures show.
    pub framing: Framing,
    /// Which way it leads.
    pub way: Way,
    /// As what it is stored.
    pub storage: Storage,
}

impl Content {
    /// Made already.
    pub fn bytes(bytes: Vec<u8>) -> Self {
        Self::Bytes(Arc::new(bytes))
    }

    /// The bytes of the file.
    ///
    /// # Errors
    /// [`crate::calib::Error::Invalid`] where a figure cannot be drawn.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn make(&self) -> Result<Cow<'_, [u8]>> {
        Ok(match self {
            Self::Bytes(bytes) => Cow::Borrowed(bytes),
            Self::Png(svg) => Cow::Owned(png(svg)?),
            Self::Page(report) => Cow::Owned(html::page(report).into_bytes()),
            Self::Map(map) => Cow::Owned(stmap::map(&map.camera, &map.framing, map.way, map.storage)?),
            Self::Splined(from) => Cow::Owned(splined_camera(&from.0, &from.1)?.0.into_bytes()),
        })
    }

    /// The bytes of the file; the browser takes its time to draw.
    ///
    /// # Errors
    /// [`crate::calib::Error::Invalid`] where a figure cannot be drawn.
    #[cfg(target_arch = "wasm32")]
    pub async fn make(&self) -> Result<Cow<'_, [u8]>> {
        Ok(match self {
            Self::Bytes(bytes) => Cow::Borrowed(bytes),
            Self::Png(svg) => Cow::Owned(png(svg).await?),
            Self::Page(report) => Cow::Owned(html::page(report).into_bytes()),
            Self::Map(map) => Cow::Owned(stmap::map(&map.camera, &map.framing, map.way, map.storage)?),
            // Never asked for: a page has no splined camera.
            Self::Splined(_) => Cow::Borrowed(&[]),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calib::report::Settings;

    #[test]
    fn what_is_made_late_is_made() {
        let report = Report::new(Settings::default(), Vec::new(), Vec::new(), Vec::new());
        let page = Content::Page(Arc::new(report)).make().unwrap().into_owned();
        assert!(page.starts_with(b"<!doctype html>"));
        let svg = r#"<svg xmlns="http://www.w3.org/2000/svg" width="4" height="2"/>"#.to_owned();
        let picture = image::load_from_memory(&Content::Png(Arc::new(svg)).make().unwrap()).unwrap();
        assert_eq!([picture.width(), picture.height()], [12, 6]);
        assert!(Content::Png(Arc::new("<svg".to_owned())).make().is_err());
    }
}
