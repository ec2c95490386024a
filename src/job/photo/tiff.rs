//! TIFF by the tiff crate, with the kinds that it leaves out: palettes and grey of 1 to 7 bits.

use std::io::Cursor;

use tiff::{
    ColorType, TiffError,
    decoder::{Decoder, DecodingResult, Limits},
    tags::Tag,
};

use super::{
    Format, MAX_BYTES, check_size, cut_short,
    ifd::{self, Order},
};
use crate::calib::image::{Photo, Samples};

const PHOTOMETRIC: u16 = 262;
const COLOUR_MAP: u16 = 320;

/// Decodes the first page; the error is the message for the user.
pub(super) fn decode(bytes: &[u8], notes: &mut Vec<String>) -> std::result::Result<Photo, String> {
    // The crate knows no palettes: read as grey, the indices come out, and are looked up here.
    let palette = ifd::first(bytes, PHOTOMETRIC).filter(|e| e.value == 3).and_then(|at| {
        let colours = colour_map(bytes)?;
        let mut gray = bytes.to_vec();
        at.set(&mut gray, 1)?;
        Some((gray, colours))
    });
    match &palette {
        None => samples(bytes, notes),
        Some((gray, colours)) => Ok(look_up(&samples(gray, notes)?, colours)),
    }
}

fn samples(bytes: &[u8], notes: &mut Vec<String>) -> std::result::Result<Photo, String> {
    let limit = usize::try_from(MAX_BYTES).unwrap_or(usize::MAX);
    let mut limits = Limits::default();
    limits.decoding_buffer_size = limit;
    limits.intermediate_buffer_size = limit;
    let mut decoder = Decoder::new(Cursor::new(bytes)).map_err(|e| failure(&e))?.with_limits(limits);
    let (width, height) = decoder.dimensions().map_err(|e| failure(&e))?;
    let color = decoder.colortype().map_err(|e| failure(&e))?;
    let formats = decoder.find_tag_unsigned_vec::<u16>(Tag::SampleFormat).ok().flatten().unwrap_or_default();
    if formats.iter().any(|f| *f != 1) {
        return Err(
            "its samples are floating-point or signed numbers: save it with 8 or 16 unsigned bits a channel"
                .into(),
        );
    }
    let alpha = decoder.find_tag_unsigned_vec::<u16>(Tag::ExtraSamples).ok().flatten() == Some(vec![2]);
    let (bits, channels, extra) = match color {
        ColorType::Multiband { bit_depth, num_samples: 2 } if alpha => (bit_depth, 2, 0),
        ColorType::Gray(b) => (b, 1, 0),
        ColorType::GrayA(b) => (b, 2, 0),
        ColorType::RGB(b) | ColorType::YCbCr(b) => (b, 3, 0),
        ColorType::RGBA(b) => (b, 4, 0),
        ColorType::CMYK(b) => (b, 4, 0),
        ColorType::CMYKA(b) => (b, 5, 0),
        ColorType::Multiband { bit_depth, num_samples } => {
            // Grey or RGB with extra samples that have no meaning here.
            let colours = if num_samples > 3 { 3 } else { 1 };
            (bit_depth, colours, usize::from(num_samples) - colours)
        }
        other => return Err(unsupported(&format!("{other:?}"))),
    };
    if !(matches!(bits, 8 | 16) || (channels == 1 && extra == 0 && bits < 8)) {
        return Err(unsupported(&format!("{bits} bits a channel")));
    }
    let stored = channels + extra;
    check_size(width.into(), height.into(), (stored * usize::from(bits).div_ceil(8)) as u64)?;
    if decoder.more_images() {
        notes.push("a TIFF of several pages: only the first was used".to_owned());
    }
    let mut buffer = DecodingResult::U8(Vec::new());
    let layout = decoder.read_image_to_buffer(&mut buffer).map_err(|e| failure(&e))?;
    let (width, height) = (width as usize, height as usize);
    let planes = layout.planes;
    let ycbcr = matches!(color, ColorType::YCbCr(_));
    let samples = match buffer {
        DecodingResult::U8(v) if bits < 8 => Samples::U8(unpack(&v, width, bits)),
        DecodingResult::U8(v) => Samples::U8(arrange(v, planes, stored, channels, ycbcr, u8::MAX)),
        DecodingResult::U16(v) => Samples::U16(arrange(v, planes, stored, channels, ycbcr, u16::MAX)),
        _ => return Err(unsupported("its sample type")),
    };
    let cmyk = matches!(color, ColorType::CMYK(_) | ColorType::CMYKA(_));
    let (samples, channels) = match samples {
        Samples::U8(v) if cmyk => (Samples::U8(rgb_of_cmyk(&v, channels)), 3),
        Samples::U16(v) if cmyk => (Samples::U16(rgb_of_cmyk(&v, channels)), 3),
        samples => (samples, channels),
    };
    if cmyk {
        notes.push("a CMYK picture: its colours were converted to RGB, without colour management".to_owned());
    }
    let count = match &samples {
        Samples::U8(v) => v.len(),
        Samples::U16(v) => v.len(),
    };
    if count != width * height * channels {
        return Err(cut_short(Format::Tiff));
    }
    Ok(Photo { width, height, channels, samples })
}

/// Rows of 1 to 7 bits, each padded to a byte, as 8 bits over the full range.
fn unpack(packed: &[u8], width: usize, bits: u8) -> Vec<u8> {
    let bits = usize::from(bits);
    let largest = (1u32 << bits) - 1;
    let stride = (width * bits).div_ceil(8);
    let mut out = Vec::with_capacity(packed.len() / stride.max(1) * width);
    for row in packed.chunks_exact(stride.max(1)) {
        out.extend((0..width).map(|x| {
            let (first, shift) = (x * bits / 8, x * bits % 8);
            let two = u32::from(row[first]) << 8 | row.get(first + 1).map_or(0, |v| u32::from(*v));
            let value = (two >> (16 - bits - shift)) & largest;
            (value * 255 / largest) as u8
        }));
    }
    out
}

/// Interleaves separate planes, drops samples beyond `channels`, and turns YCbCr into RGB.
fn arrange<T: Copy + Into<u32> + TryFrom<u32>>(
    v: Vec<T>,
    planes: usize,
    stored: usize,
    channels: usize,
    ycbcr: bool,
    max: T,
) -> Vec<T> {
    let mut v = if planes > 1 {
        let n = v.len() / planes;
        (0..n)
            .flat_map(|i| (0..channels.min(planes)).map(move |c| (i, c)))
            .map(|(i, c)| v[c * n + i])
            .collect()
    } else if stored > channels {
        v.chunks_exact(stored).flat_map(|p| p[..channels].iter().copied()).collect()
    } else {
        v
    };
    if ycbcr {
        let top = f64::from(max.into());
        let half = (top / 2.0).ceil();
        for p in v.chunks_exact_mut(3) {
            let [y, cb, cr] = [0, 1, 2].map(|i| f64::from(p[i].into()));
            let (cb, cr) = (cb - half, cr - half);
            let rgb = [y + 1.402 * cr, y - 0.344_136 * cb - 0.714_136 * cr, y + 1.772 * cb];
            for (out, value) in p.iter_mut().zip(rgb) {
                *out = T::try_from(value.round().clamp(0.0, top) as u32).unwrap_or(max);
            }
        }
    }
    v
}

fn rgb_of_cmyk<T: Copy + Into<u32> + TryFrom<u32>>(v: &[T], channels: usize) -> Vec<T>
where
    u32: From<T>,
{
    let max: u32 = if size_of::<T>() == 1 { 255 } else { 65535 };
    v.chunks_exact(channels)
        .flat_map(|p| {
            let white = u64::from(max - u32::from(p[3]));
            [0, 1, 2].map(|i| {
                let value = u64::from(max - u32::from(p[i])) * white / u64::from(max);
                T::try_from(value as u32).unwrap_or(p[i])
            })
        })
        .collect()
}

fn unsupported(what: &str) -> String {
    format!("this kind of TIFF is not read ({what}): save it as an 8- or 16-bit PNG or TIFF")
}

fn failure(error: &TiffError) -> String {
    match error {
        TiffError::UnsupportedError(e) => unsupported(&e.to_string()),
        TiffError::LimitsExceeded => {
            "decoding it would need more memory than this program allows: give a smaller copy".to_owned()
        }
        TiffError::IoError(_) => cut_short(Format::Tiff),
        e => format!("the TIFF data is damaged ({e}): copy or save the picture again"),
    }
}

/// RGB of each index.
fn colour_map(bytes: &[u8]) -> Option<Vec<[u16; 3]>> {
    let map = ifd::first(bytes, COLOUR_MAP).filter(|e| e.kind == ifd::SHORT && e.count % 3 == 0)?;
    let order = Order::of(bytes)?;
    let words = bytes.get(map.value as usize..)?.get(..2 * map.count)?;
    let words: Vec<u16> = words.chunks_exact(2).map(|b| order.u16([b[0], b[1]])).collect();
    let n = map.count / 3;
    Some((0..n).map(|i| [words[i], words[n + i], words[2 * n + i]]).collect())
}

fn look_up(indices: &Photo, colours: &[[u16; 3]]) -> Photo {
    // Some writers fill the map with 8-bit values.
    let narrow = colours.iter().flatten().all(|v| *v < 256);
    let rgb = |index: usize| {
        colours.get(index).copied().unwrap_or_default().map(|v| if narrow { v as u8 } else { (v >> 8) as u8 })
    };
    let samples = match &indices.samples {
        // Fewer bits were widened to the full range by `unpack`.
        Samples::U8(v) => {
            v.iter().flat_map(|i| rgb(usize::from(*i) * (colours.len().max(1) - 1) / 255)).collect()
        }
        Samples::U16(v) => v.iter().flat_map(|i| rgb(usize::from(*i))).collect(),
    };
    Photo { channels: 3, samples: Samples::U8(samples), ..*indices }
}
