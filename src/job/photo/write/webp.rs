//! WebP: the chunks of the original around newly compressed data, without loss.

use image::codecs::webp::WebPEncoder;
use img_parts::{
    Bytes, ImageEXIF, ImageICC,
    riff::{RiffChunk, RiffContent},
    webp::{CHUNK_EXIF, CHUNK_XMP, WebP},
};

use super::{Written, encode, exif, fits, xmp};
use crate::calib::image::Photo;

pub(super) fn write(original: &[u8], photo: &Photo) -> Written {
    let coded = encode(photo, |p, out| p.by(WebPEncoder::new_lossless(out)))?;
    let Ok(old) = WebP::from_bytes(Bytes::copy_from_slice(original)) else { return Ok(coded) };
    let mut new = WebP::from_bytes(Bytes::from(coded)).map_err(|e| e.to_string())?;
    let size_px = [photo.width as u32, photo.height as u32];
    let resized = old.dimensions().is_some_and(|(w, h)| [w, h] != size_px);
    let mut push = |id, content: Vec<u8>| {
        new.chunks_mut().push(RiffChunk::new(id, RiffContent::Data(Bytes::from(content))));
    };
    if let Some(block) = old.exif() {
        push(CHUNK_EXIF, exif::updated(&block, size_px, resized));
    }
    if let Some(packet) = old.chunk_by_id(CHUNK_XMP).and_then(|c| c.content().data()) {
        push(CHUNK_XMP, xmp::updated(packet, size_px, resized));
    }
    // This also writes the header that lists what is there.
    new.set_icc_profile(old.icc_profile().filter(|p| fits(p, photo.channels)));
    Ok(new.encoder().bytes().to_vec())
}
