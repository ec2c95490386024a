//! WebP and BMP by the `image` crate.

use image::codecs::{bmp::BmpDecoder, webp::WebPDecoder};

use super::{Format, common};
use crate::calib::image::Photo;

pub(super) fn decode(bytes: &[u8], format: Format, notes: &mut Vec<String>) -> Result<Photo, String> {
    if format == Format::Bmp {
        common(bytes, format, notes, |at, _| Ok(Box::new(BmpDecoder::new(at)?)))
    } else {
        common(bytes, format, notes, |at, _| Ok(Box::new(WebPDecoder::new(at)?)))
    }
}
