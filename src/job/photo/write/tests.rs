use std::io::Cursor;

use ::exif::{In, Reader, Tag as ExifTag};
use image::ImageFormat;
use img_parts::{Bytes, DynImage, ImageEXIF, ImageICC, jpeg, png, riff, webp};

use super::*;
use crate::job::photo::{Colours, decode, exif::Exif};

/// Smooth, so that JPEG keeps it.
fn photo(width: usize, height: usize, channels: usize, wide: bool) -> Photo {
    let at = |i: usize| {
        let (p, c) = (i / channels, i % channels);
        40 + 150 * (p % width) / width + (c + 1) * 20 * (p / width) / height
    };
    let n = width * height * channels;
    let samples = if wide {
        Samples::U16((0..n).map(|i| (at(i) * 256 + i % 251) as u16).collect())
    } else {
        Samples::U8((0..n).map(|i| at(i) as u8).collect())
    };
    Photo { width, height, channels, samples }
}

fn read(bytes: &[u8]) -> crate::job::photo::Picture {
    decode("a", bytes, Colours::Keep).unwrap()
}

/// An EXIF block in either byte order: make, orientation 6, size 64 x 48, latitude, maker note, and a JPEG thumbnail at its end.
fn exif_block(little: bool) -> Vec<u8> {
    let n16 = |v: u16| if little { v.to_le_bytes() } else { v.to_be_bytes() };
    let n32 = |v: u32| if little { v.to_le_bytes() } else { v.to_be_bytes() };
    let short = |v: u16| [n16(v), [0, 0]].concat();
    let long = |v: u32| n32(v).to_vec();
    let directory = |entries: &[(u16, u16, u32, Vec<u8>)], next: u32| {
        let mut out = n16(entries.len() as u16).to_vec();
        for (tag, kind, count, value) in entries {
            out.extend([&n16(*tag)[..], &n16(*kind), &n32(*count), value].concat());
        }
        out.extend(n32(next));
        out
    };
    let (main, sub, gps, second) = (8, 8 + 66, 8 + 66 + 42, 8 + 66 + 42 + 30);
    let (note, latitude) = (second + 30, second + 30 + 8);
    let thumbnail = latitude + 24;
    let mut out = if little { b"II*\0".to_vec() } else { b"MM\0*".to_vec() };
    out.extend(n32(main));
    out.extend(directory(
        &[
            (256, 4, 1, long(64)),
            (271, 2, 4, b"Cam\0".to_vec()),
            (274, 3, 1, short(6)),
            (34665, 4, 1, long(sub)),
            (34853, 4, 1, long(gps)),
        ],
        second,
    ));
    let sizes = [(0x927C, 7, 8, long(note)), (0xA002, 3, 1, short(64)), (0xA003, 4, 1, long(48))];
    out.extend(directory(&sizes, 0));
    out.extend(directory(&[(1, 2, 2, b"N\0\0\0".to_vec()), (2, 5, 3, long(latitude))], 0));
    out.extend(directory(&[(513, 4, 1, long(thumbnail)), (514, 4, 1, long(6))], 0));
    out.extend(b"MAKERNOT");
    for v in [48, 1, 30, 1, 15, 1] {
        out.extend(n32(v));
    }
    assert_eq!(out.len(), thumbnail as usize);
    out.extend(b"\xFF\xD8TH\xFF\xD9");
    out
}

fn icc(space: &[u8; 4]) -> Vec<u8> {
    let mut profile = vec![7; 200];
    profile[16..20].copy_from_slice(space);
    profile
}

const PACKET: &[u8] = b"<x exif:PixelXDimension=\"64\" tiff:ImageLength=\"48\" dc:title=\"board\"/>";

/// Puts metadata around the pixels of a file.
fn dressed(bytes: Vec<u8>, block: &[u8], profile: &[u8]) -> Vec<u8> {
    let mut file = DynImage::from_bytes(Bytes::from(bytes)).unwrap().unwrap();
    match &mut file {
        DynImage::Jpeg(f) => {
            let add = |marker, content: &[u8]| {
                jpeg::JpegSegment::new_with_contents(marker, Bytes::copy_from_slice(content))
            };
            let extra = [
                add(jpeg::markers::APP1, &[b"http://ns.adobe.com/xap/1.0/\0", PACKET].concat()),
                add(jpeg::markers::APP2, b"MPF\0rest"),
                add(jpeg::markers::APP13, b"Photoshop 3.0\0iptc"),
                add(jpeg::markers::COM, b"a comment"),
            ];
            f.segments_mut().splice(1..1, extra);
        }
        DynImage::Png(f) => {
            let text = [b"XML:com.adobe.xmp\0\0\0\0\0", PACKET].concat();
            let add = |kind, content: &[u8]| png::PngChunk::new(kind, Bytes::copy_from_slice(content));
            f.chunks_mut().splice(
                1..1,
                [
                    add(*b"pHYs", &[0, 0, 46, 35, 0, 0, 46, 35, 1]),
                    add(*b"tEXt", b"Comment\0a comment"),
                    add(*b"iTXt", &text),
                ],
            );
        }
        DynImage::WebP(f) => {
            let data = riff::RiffContent::Data(Bytes::from_static(PACKET));
            f.chunks_mut().push(riff::RiffChunk::new(webp::CHUNK_XMP, data));
        }
    }
    file.set_icc_profile(Some(Bytes::copy_from_slice(profile)));
    file.set_exif(Some(Bytes::copy_from_slice(block)));
    file.encoder().bytes().to_vec()
}

fn kinds() -> Vec<(ImageFormat, usize, bool)> {
    let mut list = Vec::new();
    for (format, channels, wide_too) in [
        (ImageFormat::Jpeg, &[1, 3][..], false),
        (ImageFormat::Png, &[1, 2, 3, 4], true),
        (ImageFormat::Tiff, &[1, 2, 3, 4], true),
        (ImageFormat::Bmp, &[3, 4], false),
        (ImageFormat::WebP, &[3, 4], false),
        (ImageFormat::Pnm, &[1, 3], true),
    ] {
        for &n in channels {
            list.push((format, n, false));
            if wide_too {
                list.push((format, n, true));
            }
        }
    }
    list
}

/// A file of the kind; grey with alpha in TIFF is what the `image` crate cannot write.
fn original(format: ImageFormat, picture: &Photo) -> Vec<u8> {
    match format {
        ImageFormat::Tiff => {
            let mut seed = Cursor::new(Vec::new());
            let mut tiff = ::tiff::encoder::TiffEncoder::new(&mut seed).unwrap();
            tiff.write_image::<::tiff::encoder::colortype::Gray8>(1, 1, &[0]).unwrap();
            like("seed", &seed.into_inner(), picture).unwrap()
        }
        _ => encode(picture, |p, out| {
            image::write_buffer_with_format(out, p.bytes, p.width, p.height, p.kind, format)
        })
        .unwrap(),
    }
}

#[test]
fn pixels_come_back_in_every_format_and_depth() {
    for (format, channels, wide) in kinds() {
        let before = original(format, &photo(64, 48, channels, wide));
        for size in [[64, 48], [40, 30], [1, 1]] {
            let new = photo(size[0], size[1], channels, wide);
            let after = read(&like("a", &before, &new).unwrap());
            assert_eq!(after.format, read(&before).format);
            match (format, &after.photo.samples, &new.samples) {
                (ImageFormat::Jpeg, Samples::U8(a), Samples::U8(b)) => {
                    assert_eq!((a.len(), after.photo.channels), (b.len(), channels));
                    let worst = a.iter().zip(b).map(|(a, b)| a.abs_diff(*b)).max();
                    assert!(worst <= Some(4), "{channels} {size:?}: {worst:?}");
                }
                _ => assert_eq!(after.photo, new, "{format:?} {channels} {wide} {size:?}"),
            }
        }
    }
}

#[test]
fn metadata_are_kept_and_the_size_is_told_truly() {
    for (format, channels, wide) in kinds() {
        if !matches!(format, ImageFormat::Jpeg | ImageFormat::Png | ImageFormat::WebP) {
            continue;
        }
        let profile = icc(if channels < 3 { b"GRAY" } else { b"RGB " });
        for little in [true, false] {
            let before =
                dressed(original(format, &photo(64, 48, channels, wide)), &exif_block(little), &profile);
            for size in [[64, 48], [40, 30]] {
                let what = format!("{format:?} {channels} {little} {size:?}");
                let bytes = like("a", &before, &photo(size[0], size[1], channels, wide)).unwrap();
                let picture = read(&bytes);
                assert_eq!([picture.photo.width, picture.photo.height], size);
                let [w, h] = size.map(|n| n as u32);
                let told = Exif {
                    make: Some("Cam".into()),
                    orientation: Some(6),
                    original_size_px: Some([w, h]),
                    ..Exif::default()
                };
                assert_eq!(picture.exif, told, "{what}");
                let file = DynImage::from_bytes(Bytes::from(bytes.clone())).unwrap().unwrap();
                assert_eq!(file.icc_profile().as_deref(), Some(&profile[..]), "{what}");
                let block = file.exif().unwrap();
                assert!(block.windows(8).any(|w| w == b"MAKERNOT") && !block.windows(2).any(|w| w == b"TH"));
                let tags = Reader::new().read_raw(block.to_vec()).unwrap();
                let latitude = tags.get_field(ExifTag::GPSLatitude, In::PRIMARY).unwrap();
                assert_eq!(latitude.display_value().to_string(), "48 deg 30 min 15 sec");
                assert!(tags.fields().all(|f| f.ifd_num == In::PRIMARY), "a thumbnail is left: {what}");
                let width = tags.get_field(ExifTag::ImageWidth, In::PRIMARY).unwrap();
                assert_eq!(width.value.get_uint(0), Some(w));
                let packet =
                    format!("exif:PixelXDimension=\"{w}\" tiff:ImageLength=\"{h}\" dc:title=\"board\"");
                let has = |words: &[u8]| bytes.windows(words.len()).any(|b| b == words);
                assert!(has(packet.as_bytes()), "{what}");
                if format != ImageFormat::WebP {
                    assert!(has(b"a comment"));
                }
                assert!(format != ImageFormat::Jpeg || has(b"Photoshop 3.0\0iptc") && !has(b"MPF\0"));
                assert!(format != ImageFormat::Png || has(b"pHYs"));
            }
        }
    }
}

#[test]
fn tiff_keeps_its_tags_and_directories() {
    use ::tiff::{
        encoder::{TiffEncoder, colortype::RGB16},
        tags::Tag,
    };
    let picture = photo(64, 48, 3, true);
    let Samples::U16(samples) = &picture.samples else { panic!("16 bit") };
    for big in [false, true] {
        let mut file = Cursor::new(Vec::new());
        macro_rules! fill {
            ($tiff:expr) => {{
                let mut tiff = $tiff.unwrap();
                let mut sub = tiff.extra_directory().unwrap();
                sub.write_tag(Tag::Unknown(0xA002), 64u32).unwrap();
                sub.write_tag(Tag::Unknown(0xA003), 48u32).unwrap();
                sub.write_tag(Tag::Unknown(0x9003), "2024:05:01 12:00:00").unwrap();
                let at = sub.finish_with_offsets().unwrap().pointer.0 as u32;
                let mut image = tiff.new_image::<RGB16>(64, 48).unwrap();
                let tags = image.encoder();
                tags.write_tag(Tag::Unknown(34665), at).unwrap();
                tags.write_tag(Tag::Make, "Cam").unwrap();
                tags.write_tag(Tag::Orientation, 3u16).unwrap();
                tags.write_tag(Tag::Unknown(700), PACKET).unwrap();
                tags.write_tag(Tag::Unknown(34675), &icc(b"RGB ")[..]).unwrap();
                tags.write_tag(Tag::ModelPixelScaleTag, &[1.0, 1.0, 0.0][..]).unwrap();
                image.write_data(samples).unwrap();
            }};
        }
        if big {
            fill!(TiffEncoder::new_big(&mut file));
        } else {
            fill!(TiffEncoder::new(&mut file));
        }
        let before = file.into_inner();
        let new = photo(40, 30, 3, true);
        let bytes = like("a.tif", &before, &new).unwrap();
        assert_eq!((bytes[2], read(&bytes).photo), (if big { 43 } else { 42 }, new));
        let mut tiff = ::tiff::decoder::Decoder::new(Cursor::new(&bytes)).unwrap();
        assert_eq!(tiff.get_tag_ascii_string(Tag::Make).unwrap(), "Cam");
        assert_eq!(tiff.get_tag_u32(Tag::Orientation).unwrap(), 3);
        assert_eq!(tiff.get_tag_u8_vec(Tag::Unknown(34675)).unwrap(), icc(b"RGB "));
        let packet = tiff.get_tag_u8_vec(Tag::Unknown(700)).unwrap();
        assert!(packet.starts_with(b"<x exif:PixelXDimension=\"40\" tiff:ImageLength=\"30\""));
        assert!(tiff.find_tag(Tag::ModelPixelScaleTag).unwrap().is_none());
        if !big {
            let told = read(&bytes).exif;
            assert_eq!((told.make.as_deref(), told.original_size_px), (Some("Cam"), Some([40, 30])));
            assert_eq!(told.time.as_deref(), Some("2024:05:01 12:00:00"));
        }
    }
}

#[test]
fn a_profile_for_other_colours_is_left_out() {
    let before =
        dressed(original(ImageFormat::Jpeg, &photo(16, 16, 3, false)), &exif_block(true), &icc(b"CMYK"));
    let bytes = like("a.jpg", &before, &photo(16, 16, 3, false)).unwrap();
    assert!(DynImage::from_bytes(Bytes::from(bytes)).unwrap().unwrap().icc_profile().is_none());
}

#[test]
fn damaged_metadata_never_panic_and_never_cost_the_picture() {
    let new = photo(20, 20, 3, false);
    let mut state = 7u32;
    let mut next = |n: usize| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as usize % n
    };
    for format in [ImageFormat::Jpeg, ImageFormat::Png, ImageFormat::WebP] {
        for round in 0..200 {
            let mut block = exif_block(round % 2 == 0);
            for _ in 0..3 {
                let at = next(block.len());
                block[at] = next(256) as u8;
            }
            block.truncate(1 + next(block.len()));
            let before = dressed(original(format, &photo(16, 16, 3, false)), &block, &icc(b"RGB "));
            let after = like("a", &before, &new).unwrap();
            assert_eq!(read(&after).photo.width, 20);
        }
    }
}

#[test]
fn what_cannot_hold_the_pixels_says_so() {
    let jpeg = original(ImageFormat::Jpeg, &photo(16, 16, 3, false));
    let error = like("a.jpg", &jpeg, &photo(16, 16, 3, true)).unwrap_err().to_string();
    assert!(error.starts_with("a.jpg: it cannot be written as JPEG"), "{error}");
    assert!(
        like("b", b"text", &photo(1, 1, 1, false)).unwrap_err().to_string().starts_with("b: this is a text")
    );
}

#[test]
fn grey_and_colours_stay_pgm_and_ppm() {
    for (channels, magic) in [(1, b"P5\n"), (3, b"P6\n")] {
        for wide in [false, true] {
            let photo = photo(7, 5, channels, wide);
            let written =
                like("a", format!("P{}\n1 1\n255\n\0\0\0", 4 + channels.min(2)).as_bytes(), &photo).unwrap();
            assert!(written.starts_with(magic), "{:?}", &written[..12]);
            assert_eq!(read(&written).photo, photo);
            let pam = pam(&photo).unwrap();
            assert!(pam.starts_with(b"P7") && like("a", &pam, &photo).unwrap() == pam);
        }
    }
}
