//! TIFF: a new file with the tags of the original that describe the photograph, and its EXIF and GPS directories.
//!
//! Tags of the layout of the old data, of further pages and of map projections (which hold no longer) are left out.

use std::io::{Cursor, Seek, Write};

use tiff::{
    TiffError,
    decoder::Decoder,
    encoder::{
        Compression, DeflateLevel, DirectoryEncoder, Predictor, TiffEncoder, TiffKind, TiffKindBig,
        TiffKindStandard, TiffValue, colortype,
    },
    tags::{ByteOrder, ExtraSamples, IfdPointer, Tag, Type, ValueBuffer},
};

use super::{Written, exif::PIXEL_DIMENSIONS, fits, xmp};
use crate::calib::image::{Photo, Samples};

/// Tags of the main directory that are copied: name, description, make, model, orientation, resolution, software, time,
/// artist, host, resolution unit, XMP, copyright, IPTC, Photoshop, colour profile.
const KEPT: [u16; 17] =
    [269, 270, 271, 272, 274, 282, 283, 296, 305, 306, 315, 316, XMP, 33432, 33723, 34377, PROFILE];
const XMP: u16 = 700;
const PROFILE: u16 = 34675;
/// Directories that are copied whole: EXIF, GPS.
const DIRECTORIES: [u16; 2] = [34665, 34853];
/// Pointer to a directory inside the EXIF directory that says nothing about the photograph.
const INTEROPERABILITY: u16 = 40965;
/// Above this many bytes a classic TIFF might not hold the pixels.
const CLASSIC: usize = 3_900_000_000;

/// What goes from the old file to the new.
#[derive(Default)]
struct Kept {
    main: Vec<(u16, ValueBuffer)>,
    directories: Vec<(u16, Vec<(u16, ValueBuffer)>)>,
    compression: Option<u16>,
}

pub(super) fn write(original: &[u8], photo: &Photo) -> Written {
    let kept = read(original, photo).map_err(|e| e.to_string())?;
    let bytes = match &photo.samples {
        Samples::U8(s) => s.len(),
        Samples::U16(s) => 2 * s.len(),
    };
    let mut out = Cursor::new(Vec::new());
    // BigTIFF stays BigTIFF, but in a page, whose memory no large one fits: it need not load the writer.
    let big = original.get(2..4).is_some_and(|v| v.contains(&43)) || bytes > CLASSIC;
    let written = if big && cfg!(not(target_arch = "wasm32")) {
        TiffEncoder::<_, TiffKindBig>::new_generic(&mut out).and_then(|t| file(t, photo, &kept))
    } else {
        TiffEncoder::<_, TiffKindStandard>::new_generic(&mut out).and_then(|t| file(t, photo, &kept))
    };
    written.map_err(|e| e.to_string())?;
    Ok(out.into_inner())
}

fn read(original: &[u8], photo: &Photo) -> Result<Kept, TiffError> {
    let mut old = Decoder::new(Cursor::new(original))?;
    let size_px = [photo.width as u32, photo.height as u32];
    let (w, h) = old.dimensions()?;
    let resized = [w, h] != size_px;
    let mut kept = Kept { compression: old.find_tag_unsigned(Tag::Compression)?, ..Kept::default() };
    for tag in KEPT {
        let mut value = ValueBuffer::empty(Type::BYTE);
        if matches!(old.image_ifd().find_tag_buf(Tag::from_u16_exhaustive(tag), &mut value), Ok(Some(_))) {
            value.set_byte_order(ByteOrder::native());
            match tag {
                PROFILE if !fits(value.as_bytes(), photo.channels) => continue,
                XMP if resized => {
                    let packet = xmp::updated(value.as_bytes(), size_px, resized);
                    value = ValueBuffer::from_value(&packet.as_slice());
                }
                _ => {}
            }
            kept.main.push((tag, value));
        }
    }
    for tag in DIRECTORIES {
        let Ok(Some(offset)) = old.find_tag_unsigned::<u64>(Tag::from_u16_exhaustive(tag)) else { continue };
        let Ok(directory) = old.read_directory(IfdPointer(offset)) else { continue };
        let mut entries = Vec::new();
        for (name, _) in directory.iter() {
            let mut value = ValueBuffer::empty(Type::BYTE);
            let found = old.read_directory_tags(&directory).find_tag_buf(name, &mut value);
            if name.to_u16() == INTEROPERABILITY || !matches!(found, Ok(Some(_))) {
                continue;
            }
            value.set_byte_order(ByteOrder::native());
            if let Some(axis) = PIXEL_DIMENSIONS.iter().position(|t| resized && *t == name.to_u16()) {
                value = ValueBuffer::from_value(&size_px[axis]);
            }
            entries.push((name.to_u16(), value));
        }
        kept.directories.push((tag, entries));
    }
    Ok(kept)
}

fn file<W: Write + Seek, K: TiffKind>(
    tiff: TiffEncoder<W, K>,
    photo: &Photo,
    kept: &Kept,
) -> Result<(), TiffError> {
    use colortype::{Gray8, Gray16, RGB8, RGB16, RGBA8, RGBA16};
    let (compression, predictor) = match kept.compression {
        None | Some(1) => (Compression::Uncompressed, Predictor::None),
        Some(5) => (Compression::Lzw, Predictor::Horizontal),
        Some(32773) => (Compression::Packbits, Predictor::None),
        _ => (Compression::Deflate(DeflateLevel::default()), Predictor::Horizontal),
    };
    // The predictor of this encoder does not know extra samples.
    let predictor = if photo.channels == 2 { Predictor::None } else { predictor };
    let mut tiff = tiff.with_compression(compression).with_predictor(predictor);
    let mut pointers = Vec::new();
    for (tag, entries) in &kept.directories {
        let mut directory = tiff.extra_directory()?;
        copy(&mut directory, entries)?;
        pointers.push((*tag, directory.finish_with_offsets()?));
    }
    let pointers: Vec<(u16, u64)> = pointers.iter().map(|(tag, at)| (*tag, at.pointer.0)).collect();
    match (&photo.samples, photo.channels) {
        (Samples::U8(s), 1 | 2) => picture::<W, K, Gray8>(tiff, photo, s, kept, &pointers),
        (Samples::U8(s), 3) => picture::<W, K, RGB8>(tiff, photo, s, kept, &pointers),
        (Samples::U8(s), _) => picture::<W, K, RGBA8>(tiff, photo, s, kept, &pointers),
        (Samples::U16(s), 1 | 2) => picture::<W, K, Gray16>(tiff, photo, s, kept, &pointers),
        (Samples::U16(s), 3) => picture::<W, K, RGB16>(tiff, photo, s, kept, &pointers),
        (Samples::U16(s), _) => picture::<W, K, RGBA16>(tiff, photo, s, kept, &pointers),
    }
}

fn picture<W: Write + Seek, K: TiffKind, C: colortype::ColorType>(
    mut tiff: TiffEncoder<W, K>,
    photo: &Photo,
    samples: &[C::Inner],
    kept: &Kept,
    pointers: &[(u16, u64)],
) -> Result<(), TiffError>
where
    [C::Inner]: TiffValue,
{
    let mut image = tiff.new_image::<C>(photo.width as u32, photo.height as u32)?;
    match photo.channels {
        2 => image.extra_samples(&[ExtraSamples::UnassociatedAlpha])?,
        4 => image.encoder().write_tag(Tag::ExtraSamples, ExtraSamples::UnassociatedAlpha.to_u16())?,
        _ => {}
    }
    copy(image.encoder(), &kept.main)?;
    for (tag, at) in pointers {
        // A LONG where it fits: readers of EXIF expect one, also in a BigTIFF.
        let tag = Tag::from_u16_exhaustive(*tag);
        match u32::try_from(*at) {
            Ok(at) => image.encoder().write_tag(tag, at)?,
            Err(_) => image.encoder().write_tag(tag, *at)?,
        }
    }
    image.write_data(samples)
}

fn copy<W: Write + Seek, K: TiffKind>(
    directory: &mut DirectoryEncoder<'_, W, K>,
    entries: &[(u16, ValueBuffer)],
) -> Result<(), TiffError> {
    entries.iter().try_for_each(|(tag, value)| directory.write_tag_buf(Tag::from_u16_exhaustive(*tag), value))
}
