//! JPEG: the segments of the original around newly compressed data.

use image::codecs::jpeg::JpegEncoder;
use img_parts::{
    Bytes, ImageEXIF, ImageICC,
    jpeg::{Jpeg, JpegSegment, markers},
};

use super::{JPEG_QUALITY, Written, encode, exif, fits, xmp};
use crate::calib::image::Photo;

const XMP: &[u8] = b"http://ns.adobe.com/xap/1.0/\0";
const EXIF: &[u8] = b"Exif\0\0";
/// Bytes of a JFIF segment without its thumbnail.
const JFIF: usize = 14;
/// Largest content of a segment.
const MOST: usize = 65_533;

pub(super) fn write(original: &[u8], photo: &Photo) -> Written {
    let coded = encode(photo, |p, out| {
        JpegEncoder::new_with_quality(out, JPEG_QUALITY).encode(p.bytes, p.width, p.height, p.kind)
    })?;
    // A file that decodes may still have a tail that this crate does not take apart: the picture is worth more.
    let Ok(old) = Jpeg::from_bytes(Bytes::copy_from_slice(original)) else { return Ok(coded) };
    let mut new = Jpeg::from_bytes(Bytes::from(coded)).map_err(|e| e.to_string())?;
    let size_px = [photo.width as u32, photo.height as u32];
    let resized = old.dimensions().is_some_and(|(w, h)| [u32::from(w), u32::from(h)] != size_px);
    let icc = old.icc_profile().filter(|p| fits(p, photo.channels));
    let block = old.exif().map(|block| exif::updated(&block, size_px, resized));
    let kept: Vec<JpegSegment> = old.segments().iter().filter_map(|s| kept(s, size_px, resized)).collect();
    if kept.iter().any(|s| s.marker() == markers::APP0) {
        new.remove_segments_by_marker(markers::APP0);
    }
    new.segments_mut().splice(0..0, kept);
    new.set_exif(block.map(Bytes::from));
    new.set_icc_profile(icc);
    Ok(new.encoder().bytes().to_vec())
}

/// A segment as it goes into the new file; EXIF and the colour profile go their own way.
fn kept(segment: &JpegSegment, size_px: [u32; 2], resized: bool) -> Option<JpegSegment> {
    let content = segment.contents();
    match segment.marker() {
        markers::APP0 => {
            let mut jfif = content.get(..JFIF).filter(|b| b.starts_with(b"JFIF\0"))?.to_vec();
            jfif[12..].fill(0);
            Some(JpegSegment::new_with_contents(markers::APP0, Bytes::from(jfif)))
        }
        markers::APP1 if content.starts_with(EXIF) => None,
        markers::APP1 if content.starts_with(XMP) => {
            let packet = xmp::updated(&content[XMP.len()..], size_px, resized);
            let whole = [XMP, &packet].concat();
            Some(if whole.len() <= MOST {
                JpegSegment::new_with_contents(markers::APP1, Bytes::from(whole))
            } else {
                segment.clone()
            })
        }
        // The list of further pictures, which are left out, and of the colours of the old data.
        markers::APP2 if content.starts_with(b"MPF\0") || content.starts_with(b"ICC_PROFILE\0") => None,
        markers::APP14 => None,
        markers::APP1..=markers::APP15 | markers::COM => Some(segment.clone()),
        _ => None,
    }
}
