//! Photographs: bytes in, pixels and what the file says about its camera out.
//!
//! Everything is decided by content, never by the extension. **Geometry is always in stored pixels**: the EXIF
//! orientation is reported and not applied, because the lens knows nothing of how the camera was held.
//!
//! Samples keep their depth (8 or 16 bit) and colours; fewer bits are widened to 8 and palettes are looked up.
//! Colour profiles are carried along when a picture is written, never applied.

#[cfg_attr(not(target_arch = "wasm32"), path = "photo/browsers_native.rs")]
#[cfg_attr(target_arch = "wasm32", path = "photo/browsers_web.rs")]
mod browsers;
pub mod exif;
mod ifd;
mod jpeg;
mod list;
mod sniff;
mod tiff;
pub mod write;

use std::{
    io::Cursor,
    panic::{AssertUnwindSafe, catch_unwind},
    path::Path,
};

use image::{
    ImageDecoder, ImageError, ImageReader, ImageResult, Limits,
    codecs::{png::PngDecoder, pnm::PnmDecoder},
};
use serde::{Deserialize, Serialize};
use siphasher::sip128::{Hasher128, SipHasher13};
use std::hash::Hasher;

use crate::calib::{
    Error, Result,
    image::{Photo, Samples},
};

pub use self::exif::Exif;
#[cfg(target_arch = "wasm32")]
pub use browsers::decode_ahead;
pub use list::{bytes, exists, is_folder, list};
#[cfg(target_arch = "wasm32")]
pub use list::{file, hash_of, offer, text, written};
pub use sniff::{Content, Format, sniff, sniff_named};

/// Most pixels of one picture; more is refused before anything is decoded. Twice what the largest cameras give: several
/// pictures are open at the same time.
pub const MAX_PIXELS: u64 = if cfg!(target_pointer_width = "32") { 120_000_000 } else { 200_000_000 };
/// Most bytes of one decoded picture: [`MAX_PIXELS`] with four channels of 16 bits.
pub const MAX_BYTES: u64 = if cfg!(target_pointer_width = "32") { 800_000_000 } else { 1_600_000_000 };

/// A photograph that was read.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Stored pixels.
    pub photo: Photo,
    /// What the bytes are, whatever the file is called.
    pub format: Format,
    /// What the file says about camera, lens and time; empty where it says nothing.
    pub exif: Exif,
    /// 128-bit hash of the file.
    pub bytes_hash: u128,
    /// 128-bit hash of size, channels and samples: equal for copies of one picture under other names. It differs between
    /// [`Colours::Keep`] and [`Colours::Gray`].
    pub pixels_hash: u128,
    /// What the user may want to know: wrong extension, first frame of an animation, converted colours, …
    pub notes: Vec<String>,
}

/// Which samples are wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Colours {
    /// As stored.
    Keep,
    /// One channel: what detection needs. Of a JPEG the luma is decoded directly, which saves the colours' time and memory
    /// and agrees with [`Photo::gray`] within one level where no colour is saturated (there the luma is the truer); other
    /// formats give [`Photo::gray`].
    Gray,
}

impl Picture {
    /// A picture that comes from no file.
    pub(super) fn rendered(photo: Photo) -> Self {
        let pixels_hash = hash_pixels(&photo);
        let (format, exif) = (Format::Png, Exif::default());
        Self { photo, format, exif, bytes_hash: pixels_hash, pixels_hash, notes: Vec::new() }
    }
}

/// Reads and decodes a file.
///
/// # Errors
/// [`Error::File`] where the file cannot be read, [`Error::Picture`] where it is not a picture that can be used.
pub fn read(path: &Path, colours: Colours) -> Result<Picture> {
    let name = path.display().to_string();
    let bytes = bytes(path)?;
    decode(&name, &bytes, colours)
}

/// `[width, height]` of a picture file, in stored pixels; the pixels are not decoded where the format allows.
///
/// # Errors
/// As [`read`].
pub fn size_px(path: &Path) -> Result<[u32; 2]> {
    let name = path.display().to_string();
    let bytes = bytes(path)?;
    let reader = ImageReader::new(Cursor::new(&bytes)).with_guessed_format();
    match reader.ok().and_then(|r| r.into_dimensions().ok()) {
        Some((w, h)) if matches!(sniff_named(&name, &bytes), Content::Picture(_)) => Ok([w, h]),
        _ => decode(&name, &bytes, Colours::Gray).map(|p| [p.photo.width as u32, p.photo.height as u32]),
    }
}

/// Decodes the bytes of a file; `name` is what messages call it.
///
/// # Errors
/// [`Error::Picture`] with the reason and the remedy.
pub fn decode(name: &str, bytes: &[u8], colours: Colours) -> Result<Picture> {
    let refuse = |message: String| Error::Picture { file: name.to_owned(), message };
    let format = match sniff_named(name, bytes) {
        Content::Picture(format) => format,
        Content::Foreign(what) | Content::Other(what) => return Err(refuse(what)),
    };
    let mut notes = Vec::new();
    if let Some(extension) = sniff::wrong_extension(name, format) {
        notes.push(format!("it ends in .{extension} but holds a {format} picture; it was read as that"));
    }
    // Decoders are other people's code under other people's bytes: a crash in one costs one picture, not the rest.
    let decoded =
        catch_unwind(AssertUnwindSafe(|| pixels(bytes, format, colours, &mut notes))).unwrap_or_else(|_| {
            Err(format!(
                "the {format} data is damaged in a way that the decoder does not survive: save the picture again"
            ))
        });
    let photo = decoded.map_err(refuse)?;
    Ok(Picture {
        bytes_hash: hash(&[bytes]),
        pixels_hash: hash_pixels(&photo),
        exif: Exif::read(bytes, format),
        format,
        photo,
        notes,
    })
}

/// Decodes pixels; the error is the message for the user.
fn pixels(
    bytes: &[u8],
    format: Format,
    colours: Colours,
    notes: &mut Vec<String>,
) -> std::result::Result<Photo, String> {
    let photo = match format {
        Format::Jpeg => jpeg::decode(bytes, colours, notes)?,
        Format::Tiff => tiff::decode(bytes, notes)?,
        Format::Png => {
            common(bytes, format, notes, |at, most| Ok(Box::new(PngDecoder::with_limits(at, most)?)))?
        }
        Format::Bmp | Format::WebP => browsers::decode(bytes, format, notes)?,
        Format::Pnm => common(bytes, format, notes, |at, _| Ok(Box::new(PnmDecoder::new(at)?)))?,
    };
    Ok(match colours {
        Colours::Gray if photo.channels > 1 => gray(&photo),
        _ => photo,
    })
}

/// A decoder of the `image` crate, by name: asked for by format, those of JPEG and TIFF would be in the program a second time.
type Opened<'a> = fn(Cursor<&'a [u8]>, Limits) -> ImageResult<Box<dyn ImageDecoder + 'a>>;

/// What the `image` crate reads without help.
fn common<'a>(
    bytes: &'a [u8],
    format: Format,
    notes: &mut Vec<String>,
    open: Opened<'a>,
) -> std::result::Result<Photo, String> {
    if let Some(frames) = sniff::animation(bytes, format) {
        notes.push(format!("an animation of {frames} frames: only the first was used"));
    }
    decoded(bytes, format, open)
        .map_err(|e| if sniff::shorter_than_it_says(bytes) { cut_short(format) } else { e })
}

fn decoded<'a>(bytes: &'a [u8], format: Format, open: Opened<'a>) -> std::result::Result<Photo, String> {
    let failed = |error: ImageError| failure(&error, format);
    let mut limits = Limits::no_limits();
    limits.max_alloc = Some(MAX_BYTES);
    let mut decoder = open(Cursor::new(bytes), limits.clone()).map_err(failed)?;
    decoder.set_limits(limits).map_err(failed)?;
    let ((width, height), color) = (decoder.dimensions(), decoder.color_type());
    check_size(width.into(), height.into(), color.bytes_per_pixel().into())?;
    let mut raw = vec![0; decoder.total_bytes() as usize];
    decoder.read_image(&mut raw).map_err(failed)?;
    let channels = usize::from(color.channel_count());
    let samples = match usize::from(color.bytes_per_pixel()) / channels {
        1 => Samples::U8(raw),
        2 => Samples::U16(raw.chunks_exact(2).map(|v| u16::from_ne_bytes([v[0], v[1]])).collect()),
        _ => {
            return Err("floating-point samples are not read: save it with 8 or 16 bits a channel".to_owned());
        }
    };
    Ok(Photo { width: width as usize, height: height as usize, channels, samples })
}

/// Refuses what would not fit into memory, before it is decoded.
fn check_size(width: u64, height: u64, bytes_per_pixel: u64) -> std::result::Result<(), String> {
    if width == 0 || height == 0 {
        return Err(format!("the picture is empty ({width} x {height} px): save it again"));
    }
    let pixels = width.saturating_mul(height);
    if pixels > MAX_PIXELS || pixels.saturating_mul(bytes_per_pixel) > MAX_BYTES {
        return Err(too_large(&format!("{width} x {height} px")));
    }
    Ok(())
}

fn too_large(what: &str) -> String {
    let most = MAX_PIXELS / 1_000_000;
    format!("{what} is more than this program opens ({most} megapixels): give a smaller copy")
}

fn gray(photo: &Photo) -> Photo {
    use crate::calib::image::Gray;
    let samples = match photo.gray() {
        Gray::U8(p) => Samples::U8(p.into_vec()),
        Gray::U16(p) => Samples::U16(p.into_vec()),
    };
    Photo { width: photo.width, height: photo.height, channels: 1, samples }
}

/// A decoder's error in words that help.
fn failure(error: &ImageError, format: Format) -> String {
    match error {
        ImageError::IoError(e) if e.kind() == std::io::ErrorKind::UnexpectedEof => cut_short(format),
        ImageError::Unsupported(e) => {
            format!("this kind of {format} is not read ({e}): save it as an 8- or 16-bit PNG")
        }
        ImageError::Limits(_) => {
            "decoding it would need more memory than this program allows: give a smaller copy".to_owned()
        }
        e => {
            let text = e.to_string();
            if text.contains("too large") {
                return too_large("the picture");
            }
            let lower = text.to_lowercase();
            if ["unexpected end", "eof", "failed to fill", "premature", "truncated"]
                .iter()
                .any(|w| lower.contains(w))
            {
                return cut_short(format);
            }
            format!("the {format} data is damaged ({text}): copy or save the picture again")
        }
    }
}

fn cut_short(format: Format) -> String {
    format!("the {format} file is cut short: copy it again from the camera")
}

/// [`Picture::bytes_hash`] of a file's bytes.
pub fn hash_bytes(bytes: &[u8]) -> u128 {
    hash(&[bytes])
}

fn hash(parts: &[&[u8]]) -> u128 {
    let mut hasher = SipHasher13::new();
    for part in parts {
        hasher.write(part);
    }
    hasher.finish128().as_u128()
}

fn hash_pixels(photo: &Photo) -> u128 {
    let mut hasher = SipHasher13::new();
    for n in [photo.width, photo.height, photo.channels] {
        hasher.write_u64(n as u64);
    }
    match &photo.samples {
        Samples::U8(s) => hasher.write(s),
        Samples::U16(s) => {
            let mut row = Vec::with_capacity(2 * 4096);
            for chunk in s.chunks(4096) {
                row.clear();
                row.extend(chunk.iter().flat_map(|v| v.to_le_bytes()));
                hasher.write(&row);
            }
        }
    }
    hasher.finish128().as_u128()
}

#[cfg(test)]
mod tests;
