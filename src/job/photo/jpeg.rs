//! JPEG by zune-jpeg, which can leave out the colours.

use zune_jpeg::{errors::DecodeErrors, zune_core::colorspace::ColorSpace};

use super::{Colours, Format, check_size, cut_short};
use crate::calib::{
    image::{Photo, Samples},
    jpeg,
};

/// Decodes; the error is the message for the user.
pub(super) fn decode(
    bytes: &[u8],
    colours: Colours,
    notes: &mut Vec<String>,
) -> std::result::Result<Photo, String> {
    let complete = has_end(bytes);
    let failed = |e: &DecodeErrors| {
        if complete { damaged(e) } else { cut_short(Format::Jpeg) }
    };
    let header = jpeg::header(bytes.to_vec()).map_err(|e| failed(&e))?;
    let ([width, height], stored) = header.ok_or_else(|| cut_short(Format::Jpeg))?;
    let (space, channels) = match (stored, colours) {
        (ColorSpace::Luma, _) | (ColorSpace::YCbCr, Colours::Gray) => (ColorSpace::Luma, 1),
        _ => (ColorSpace::RGB, 3),
    };
    check_size(width as u64, height as u64, channels as u64)?;
    if matches!(stored, ColorSpace::CMYK | ColorSpace::YCCK) {
        notes.push("a CMYK picture: its colours were converted to RGB, without colour management".to_owned());
    }
    let run = |strict: bool| jpeg::decode(bytes.to_vec(), strict, space);
    // What the strict decoder refuses may still be a whole picture with a flaw: worth a note, not a refusal.
    let samples = match run(true) {
        Ok(samples) => {
            if !complete {
                notes.push("the end of the file is missing: its last rows may be damaged".to_owned());
            }
            samples
        }
        Err(_) if !complete => return Err(cut_short(Format::Jpeg)),
        Err(strict) => {
            let samples = run(false).map_err(|_| damaged(&strict))?;
            notes.push(format!("the JPEG data has a flaw ({strict:?}): parts of the picture may be damaged"));
            samples
        }
    };
    if samples.len() != width * height * channels {
        return Err(damaged(&DecodeErrors::FormatStatic("wrong number of samples")));
    }
    Ok(Photo { width, height, channels, samples: Samples::U8(samples) })
}

fn damaged(error: &DecodeErrors) -> String {
    let text = format!("{error:?}");
    let text = text.trim().trim_matches('"');
    format!(
        "the JPEG data cannot be decoded ({text}): save the picture again as a plain 8-bit JPEG or as PNG"
    )
}

/// Whether the end marker follows the compressed data.
fn has_end(bytes: &[u8]) -> bool {
    let mut at = 2;
    loop {
        // In compressed data a 0xFF is followed by 0 or a restart marker; everything else is a marker with a length.
        let Some(skip) = bytes.get(at..).and_then(|b| b.iter().position(|v| *v == 0xFF)) else {
            return false;
        };
        at += skip;
        match bytes.get(at + 1) {
            None => return false,
            Some(0xD9) => return true,
            Some(0xFF) => at += 1,
            Some(0x00 | 0x01 | 0xD0..=0xD8) => at += 2,
            Some(_) => {
                let Some(length) = bytes.get(at + 2..at + 4) else { return false };
                at += 2 + usize::from(u16::from_be_bytes([length[0], length[1]])).max(2);
            }
        }
    }
}
