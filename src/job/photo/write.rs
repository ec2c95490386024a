//! Writing a changed photograph as the original was: format, depth, and what the file says about itself.
//!
//! | kept | changed | left out |
//! |---|---|---|
//! | EXIF with GPS and maker notes, XMP, IPTC, colour profile, comments, resolution | the picture's size in EXIF and XMP where it changed | thumbnails and further pictures of the file |
//!
//! * The embedded **thumbnail** is left out: it shows the picture as it was taken, and viewers would show it for the new one.
//!   Previews inside maker notes cannot be removed safely and stay.
//! * The **orientation** stays, because pixels are in stored order before and after.
//! * JPEG is written without subsampling of the colours at quality [`JPEG_QUALITY`]; WebP is written without loss, also where
//!   the original was not; palettes become colours, and fewer than 8 bits become 8, as reading gave them.

mod exif;
mod jpeg;
mod png;
mod tiff;
mod webp;
mod xmp;

use std::{borrow::Cow, io::Cursor};

use image::{
    ExtendedColorType, ImageEncoder, ImageResult,
    codecs::{bmp::BmpEncoder, pnm::PnmEncoder},
};

use super::{Content, Format, sniff};
use crate::calib::{
    Error, Result,
    image::{Photo, Samples},
};

/// Quality of written JPEG, 1 to 100.
pub const JPEG_QUALITY: u8 = 97;

/// Bytes of a file, or why there are none.
type Written = std::result::Result<Vec<u8>, String>;

/// Pixels as encoders take them.
struct Pixels<'a> {
    bytes: &'a [u8],
    width: u32,
    height: u32,
    kind: ExtendedColorType,
}

impl Pixels<'_> {
    fn by(self, encoder: impl ImageEncoder) -> ImageResult<()> {
        encoder.write_image(self.bytes, self.width, self.height, self.kind)
    }
}

/// Encodes a photograph in the format of the file that it was made from, with that file's metadata.
///
/// `name` is what messages call it, `original` the whole file, `photo` the new pixels: of the same depth and channels, the size
/// may differ.
///
/// # Errors
/// [`Error::Picture`] where the format cannot hold these pixels.
pub fn like(name: &str, original: &[u8], photo: &Photo) -> Result<Vec<u8>> {
    let refuse = |message: String| Error::Picture { file: name.to_owned(), message };
    let format = match sniff(original) {
        Content::Picture(format) => format,
        Content::Foreign(what) | Content::Other(what) => return Err(refuse(what)),
    };
    let written = match format {
        Format::Jpeg => jpeg::write(original, photo),
        Format::Png => png::write(original, photo),
        Format::Tiff => tiff::write(original, photo),
        Format::WebP => webp::write(original, photo),
        Format::Bmp => encode(photo, |p, out| p.by(BmpEncoder::new(out))),
        Format::Pnm => pnm(original, photo),
    };
    written.map_err(|e| {
        refuse(format!("it cannot be written as {format} ({e}): save the original as PNG or TIFF first"))
    })
}

/// Encodes the pixels alone; the error is the reason.
fn encode(
    photo: &Photo,
    encoder: impl FnOnce(Pixels<'_>, &mut Cursor<Vec<u8>>) -> ImageResult<()>,
) -> Written {
    use ExtendedColorType::{L8, L16, La8, La16, Rgb8, Rgb16, Rgba8, Rgba16};
    let (bytes, kinds) = match &photo.samples {
        Samples::U8(s) => (Cow::Borrowed(s.as_slice()), [L8, La8, Rgb8, Rgba8]),
        Samples::U16(s) => {
            (Cow::Owned(s.iter().flat_map(|v| v.to_ne_bytes()).collect()), [L16, La16, Rgb16, Rgba16])
        }
    };
    let wrong = || format!("{} samples a pixel", photo.channels);
    let kind = photo.channels.checked_sub(1).and_then(|i| kinds.get(i)).ok_or_else(wrong)?;
    let mut out = Cursor::new(Vec::new());
    let pixels =
        Pixels { bytes: &bytes, width: photo.width as u32, height: photo.height as u32, kind: *kind };
    encoder(pixels, &mut out).map_err(|e| e.to_string())?;
    Ok(out.into_inner())
}

/// Encodes as PAM.
fn pam(photo: &Photo) -> Written {
    encode(photo, |p, out| p.by(PnmEncoder::new(out)))
}

/// Encodes as PGM or PPM, which everything reads; as PAM only what was PAM, or has alpha.
fn pnm(original: &[u8], photo: &Photo) -> Written {
    let magic = match photo.channels {
        _ if original.starts_with(b"P7") => return pam(photo),
        1 => "P5",
        3 => "P6",
        _ => return pam(photo),
    };
    let (most, samples) = match &photo.samples {
        Samples::U8(s) => (u16::from(u8::MAX), Cow::Borrowed(s.as_slice())),
        Samples::U16(s) => (u16::MAX, Cow::Owned(s.iter().flat_map(|v| v.to_be_bytes()).collect())),
    };
    let mut out = format!("{magic}\n{} {}\n{most}\n", photo.width, photo.height).into_bytes();
    out.extend_from_slice(&samples);
    Ok(out)
}

/// Whether a colour profile is for pixels of so many channels: one for CMYK does not fit what was converted to RGB.
fn fits(profile: &[u8], channels: usize) -> bool {
    profile.get(16..20).is_some_and(|space| (space == b"GRAY") == (channels < 3) && space != b"CMYK")
}

#[cfg(test)]
mod tests;
