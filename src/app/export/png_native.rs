//! A figure as pixels.

use std::sync::{Arc, OnceLock};

use resvg::{
    tiny_skia::{Pixmap, Transform},
    usvg::{Options, Tree, fontdb::Database},
};

use crate::calib::{Error, Result};

/// Pixels for a unit of the figure: sharp in print at the width of a column.
const SCALE: f32 = 3.0;

/// The window's own fonts, so that a figure looks alike on every machine.
fn fonts() -> Arc<Database> {
    static FONTS: OnceLock<Arc<Database>> = OnceLock::new();
    let load = || {
        let mut fonts = Database::new();
        for font in [
            &include_bytes!("../../../assets/fonts/IBMPlexSans-Regular.ttf")[..],
            include_bytes!("../../../assets/fonts/IBMPlexSans-SemiBold.ttf"),
        ] {
            fonts.load_font_data(font.to_vec());
        }
        fonts.set_sans_serif_family("IBM Plex Sans");
        Arc::new(fonts)
    };
    FONTS.get_or_init(load).clone()
}

/// Draws an SVG.
///
/// # Errors
/// [`Error::Invalid`] where it cannot be drawn.
pub(super) fn png(svg: &str) -> Result<Vec<u8>> {
    let failed = |e: &dyn std::fmt::Display| {
        Error::Invalid(format!("the figure cannot be drawn ({e}): save it as SVG"))
    };
    let options = Options { fontdb: fonts(), font_family: "IBM Plex Sans".to_owned(), ..Options::default() };
    let tree = Tree::from_str(svg, &options).map_err(|e| failed(&e))?;
    let size = tree.size();
    let [width, height] = [size.width(), size.height()].map(|n| (n * SCALE).ceil() as u32);
    let mut pixels = Pixmap::new(width, height).ok_or_else(|| failed(&"it has no size"))?;
    resvg::render(&tree, Transform::from_scale(SCALE, SCALE), &mut pixels.as_mut());
    pixels.encode_png().map_err(|e| failed(&e))
}
