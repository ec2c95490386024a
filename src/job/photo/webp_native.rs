//! WebP by the `image` crate.

use image::codecs::webp::WebPDecoder;

use super::{Format, common};
use crate::calib::image::Photo;

pub(super) fn decode(bytes: &[u8], notes: &mut Vec<String>) -> Result<Photo, String> {
    common(bytes, Format::WebP, notes, |at, _| Ok(Box::new(WebPDecoder::new(at)?)))
}
