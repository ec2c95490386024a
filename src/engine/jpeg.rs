//! JPEG decoding by zune-jpeg. Its decoder is generic, so it is compiled where it is used: here, for speed.

use zune_jpeg::{
    JpegDecoder,
    errors::DecodeErrors,
    zune_core::{bytestream::ZCursor, colorspace::ColorSpace, options::DecoderOptions},
};

/// Width, height and colours that a file tells of; `None` where it ends before.
///
/// # Errors
/// The decoder's own, where the file is none of its kind.
pub fn header(bytes: Vec<u8>) -> Result<Option<([usize; 2], ColorSpace)>, DecodeErrors> {
    let mut decoder = decoder(bytes, options(false));
    decoder.decode_headers()?;
    let colours = decoder.input_colorspace().unwrap_or(ColorSpace::YCbCr);
    Ok(decoder.dimensions().map(|(width, height)| ([width, height], colours)))
}

/// The samples in other colours; `strict` refuses what is damaged.
///
/// # Errors
/// The decoder's own.
pub fn decode(bytes: Vec<u8>, strict: bool, colours: ColorSpace) -> Result<Vec<u8>, DecodeErrors> {
    decoder(bytes, options(strict).jpeg_set_out_colorspace(colours)).decode()
}

fn options(strict: bool) -> DecoderOptions {
    DecoderOptions::default().set_max_width(usize::MAX).set_max_height(usize::MAX).set_strict_mode(strict)
}

// A copy costs little beside decoding, and the tiff crate reads vectors too: one decoder less in the program.
fn decoder(bytes: Vec<u8>, options: DecoderOptions) -> JpegDecoder<ZCursor<Vec<u8>>> {
    JpegDecoder::new_with_options(ZCursor::new(bytes), options)
}
