//! PNG: the ancillary chunks of the original around newly compressed data.

use image::codecs::png::PngEncoder;
use img_parts::{
    Bytes,
    png::{Png, PngChunk},
};

use super::{Written, encode, exif, xmp};
use crate::calib::image::Photo;

/// Chunks that are true of the new pixels too. What describes the old data (palette, transparency, histogram, animation,
/// significant bits) is not among them.
const KEPT: [&[u8; 4]; 13] = [
    b"cHRM", b"gAMA", b"iCCP", b"sRGB", b"cICP", b"mDCV", b"cLLI", b"pHYs", b"eXIf", b"iTXt", b"tEXt",
    b"zTXt", b"tIME",
];
const XMP: &[u8] = b"XML:com.adobe.xmp\0";

pub(super) fn write(original: &[u8], photo: &Photo) -> Written {
    let coded = encode(photo, |p, out| p.by(PngEncoder::new(out.get_mut())))?;
    let Ok(old) = Png::from_bytes(Bytes::copy_from_slice(original)) else { return Ok(coded) };
    let mut new = Png::from_bytes(Bytes::from(coded)).map_err(|e| e.to_string())?;
    let size_px = [photo.width as u32, photo.height as u32];
    let resized = old.dimensions().is_some_and(|(w, h)| [w, h] != size_px);
    let kept = old.chunks().iter().filter(|c| KEPT.contains(&&c.kind())).map(|chunk| {
        let content = chunk.contents();
        match &chunk.kind() {
            b"eXIf" => PngChunk::new(*b"eXIf", Bytes::from(exif::updated(content, size_px, resized))),
            b"iTXt" if content.starts_with(XMP) && content.get(XMP.len()) == Some(&0) => {
                PngChunk::new(*b"iTXt", Bytes::from(xmp::updated(content, size_px, resized)))
            }
            _ => chunk.clone(),
        }
    });
    let kept: Vec<PngChunk> = kept.collect();
    // After the header: all of them may stand there.
    new.chunks_mut().splice(1..1, kept);
    Ok(new.encoder().bytes().to_vec())
}
