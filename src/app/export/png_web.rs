//! A figure as pixels, drawn by the browser.

use js_sys::Uint8Array;
use wasm_bindgen::{JsCast as _, JsValue, prelude::wasm_bindgen};

use crate::calib::{Error, Result};

/// Pixels for a unit of the figure: sharp in print at the width of a column.
const SCALE: f64 = 3.0;

#[wasm_bindgen(module = "/web/figure.js")]
extern "C" {
    #[wasm_bindgen(catch, js_name = png)]
    async fn draw(svg: &str, scale: f64) -> std::result::Result<JsValue, JsValue>;
}

/// Draws an SVG.
///
/// # Errors
/// [`Error::Invalid`] where it cannot be drawn.
pub(super) async fn png(svg: &str) -> Result<Vec<u8>> {
    let drawn = draw(svg, SCALE).await.ok().and_then(|bytes| bytes.dyn_into::<Uint8Array>().ok());
    let failed = || Error::Invalid("the browser cannot draw the figure: save it as SVG".to_owned());
    drawn.map(|bytes| bytes.to_vec()).ok_or_else(failed)
}
