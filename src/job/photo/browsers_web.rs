//! WebP and BMP by the browser, which has decoders: [`decode_ahead`] asks it before a job begins, because it does not answer at once.

use std::cell::RefCell;

use js_sys::{Reflect, Uint8Array};
use wasm_bindgen::{JsCast as _, JsValue, prelude::wasm_bindgen};
use web_sys::File;

use super::{Format, check_size, sniff};
use crate::calib::image::{Photo, Samples};

#[wasm_bindgen(module = "/web/pixels.js")]
extern "C" {
    #[wasm_bindgen(catch)]
    async fn browser_pixels(file: &File) -> Result<JsValue, JsValue>;
}

thread_local! {
    /// Of the file that the present request reads; none where it is of another kind, or the browser cannot read it.
    static PIXELS: RefCell<Option<Photo>> = const { RefCell::new(None) };
}

/// Decodes the file of a request if it is a WebP or BMP picture.
pub async fn decode_ahead(file: &File) {
    let pixels = browser_pixels(file).await.ok().and_then(|pixels| photo(&pixels));
    PIXELS.set(pixels);
}

/// RGBA, or RGB where all of it is opaque.
fn photo(pixels: &JsValue) -> Option<Photo> {
    let get = |name: &str| Reflect::get(pixels, &name.into()).ok();
    let [width, height] = [get("width")?.as_f64()?, get("height")?.as_f64()?].map(|n| n as usize);
    check_size(width as u64, height as u64, 4).ok()?;
    let mut samples = get("rgba")?.dyn_into::<Uint8Array>().ok()?.to_vec();
    let mut channels = 4;
    if samples.iter().skip(3).step_by(4).all(|alpha| *alpha == u8::MAX) {
        for i in 0..width * height {
            samples.copy_within(4 * i..4 * i + 3, 3 * i);
        }
        samples.truncate(3 * width * height);
        channels = 3;
    }
    Some(Photo { width, height, channels, samples: Samples::U8(samples) })
}

pub(super) fn decode(bytes: &[u8], format: Format, notes: &mut Vec<String>) -> Result<Photo, String> {
    if let Some(frames) = sniff::animation(bytes, format) {
        notes.push(format!("an animation of {frames} frames: only the first was used"));
    }
    let pixels = PIXELS.with_borrow(Clone::clone);
    pixels
        .ok_or_else(|| format!("the browser cannot read this {format} file: save the picture as PNG or JPEG"))
}
