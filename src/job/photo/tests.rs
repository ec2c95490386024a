use std::fs;

use image::{ExtendedColorType, ImageFormat};

use super::*;

/// A picture with edges and gradients, `channels` samples a pixel.
fn scene(width: usize, height: usize, channels: usize) -> Vec<u8> {
    let mut out = Vec::new();
    for y in 0..height {
        for x in 0..width {
            let board = if (x / 8 + y / 8) % 2 == 0 { 70 } else { 150 };
            out.extend((0..channels).map(|c| (board + x * 20 / width + c * y * 20 / height) as u8));
        }
    }
    out
}

fn photo(width: usize, height: usize, channels: usize, wide: bool) -> Photo {
    let s = scene(width, height, channels);
    let samples =
        if wide { Samples::U16(s.iter().map(|v| u16::from(*v) * 256 + 7).collect()) } else { Samples::U8(s) };
    Photo { width, height, channels, samples }
}

fn encode(photo: &Photo, format: ImageFormat) -> Vec<u8> {
    let (kinds, bytes) = match &photo.samples {
        Samples::U8(s) => (
            [
                ExtendedColorType::L8,
                ExtendedColorType::La8,
                ExtendedColorType::Rgb8,
                ExtendedColorType::Rgba8,
            ],
            s.clone(),
        ),
        Samples::U16(s) => (
            [
                ExtendedColorType::L16,
                ExtendedColorType::La16,
                ExtendedColorType::Rgb16,
                ExtendedColorType::Rgba16,
            ],
            s.iter().flat_map(|v| v.to_ne_bytes()).collect(),
        ),
    };
    let mut out = Cursor::new(Vec::new());
    let (w, h) = (photo.width as u32, photo.height as u32);
    image::write_buffer_with_format(&mut out, &bytes, w, h, kinds[photo.channels - 1], format).unwrap();
    out.into_inner()
}

fn jpeg(photo: &Photo) -> Vec<u8> {
    encode(photo, ImageFormat::Jpeg)
}

fn keep(name: &str, bytes: &[u8]) -> Result<Picture> {
    decode(name, bytes, Colours::Keep)
}

fn message(name: &str, bytes: &[u8]) -> String {
    match keep(name, bytes) {
        Err(Error::Picture { file, message }) => {
            assert_eq!(file, name);
            message
        }
        other => panic!("{name}: {other:?}"),
    }
}

#[test]
fn lossless_formats_return_what_was_stored() {
    for (format, name, wide_too, alphas) in [
        (ImageFormat::Png, "a.png", true, &[1, 2, 3, 4][..]),
        (ImageFormat::Tiff, "a.tif", true, &[1, 3, 4]),
        (ImageFormat::Bmp, "a.bmp", false, &[3, 4]),
        (ImageFormat::WebP, "a.webp", false, &[3, 4]),
        (ImageFormat::Pnm, "a.ppm", true, &[1, 3]),
    ] {
        for &channels in alphas {
            for wide in [false, true] {
                if wide && !wide_too {
                    continue;
                }
                for [w, h] in [[37, 21], [1, 1]] {
                    let stored = photo(w, h, channels, wide);
                    let picture = keep(name, &encode(&stored, format)).unwrap();
                    assert_eq!(picture.photo, stored, "{name} {channels} {wide}");
                    assert_eq!(picture.notes, [""; 0]);
                    let gray = decode(name, &encode(&stored, format), Colours::Gray).unwrap().photo;
                    assert_eq!((gray.channels, gray.gray()), (1, stored.gray()));
                }
            }
        }
    }
}

#[test]
fn the_luma_of_a_jpeg_is_its_gray() {
    for [w, h] in [[160, 120], [37, 21], [1, 1], [1, 9], [17, 1]] {
        for channels in [1, 3] {
            let bytes = jpeg(&photo(w, h, channels, false));
            let full = keep("a.jpg", &bytes).unwrap();
            let gray = decode("a.jpg", &bytes, Colours::Gray).unwrap();
            assert_eq!((full.photo.channels, gray.photo.channels), (channels, 1));
            let d = worst(&super::gray(&full.photo), &gray.photo);
            assert!(d <= 1, "{w} {h}: {d}");
            assert_eq!(full.bytes_hash, gray.bytes_hash);
        }
    }
}

fn worst(a: &Photo, b: &Photo) -> u8 {
    let (Samples::U8(x), Samples::U8(y)) = (&a.samples, &b.samples) else { panic!("8 bit") };
    assert_eq!((a.width, a.height, x.len()), (b.width, b.height, y.len()));
    x.iter().zip(y).map(|(x, y)| x.abs_diff(*y)).max().unwrap_or_default()
}

#[test]
fn content_counts_not_the_name() {
    let bytes = encode(&photo(8, 8, 3, false), ImageFormat::Bmp);
    let picture = keep("board.jpg", &bytes).unwrap();
    assert_eq!(picture.format, Format::Bmp);
    assert_eq!(picture.notes, ["it ends in .jpg but holds a BMP picture; it was read as that"]);
    assert!(keep("board", &bytes).unwrap().notes.is_empty());
}

#[test]
fn what_cannot_be_read_is_named_with_a_remedy() {
    let pad = |head: &[u8]| [head, &[0; 64]].concat();
    let mut dng = b"II*\0\x08\0\0\0\x01\0".to_vec();
    dng.extend([0x12, 0xC6, 1, 0, 4, 0, 0, 0, 1, 4, 0, 0, 0, 0, 0, 0]);
    for (name, bytes, words) in [
        ("a.jpg", Vec::new(), "empty (0 bytes)"),
        ("b.jpg", b"hello, this is text".to_vec(), "text file"),
        ("c.heic", pad(b"\0\0\0\x18ftypheic"), "export them as JPEG"),
        ("d.jpg", pad(b"\0\0\0\x18ftypavif"), "AVIF"),
        ("e.mp4", pad(b"\0\0\0\x18ftypisom"), "ffmpeg"),
        ("f.mov", pad(b"\0\0\0\x18ftypqt  "), "QuickTime is a video"),
        ("g.avi", pad(b"RIFF\0\0\0\0AVI LIST"), "AVI is a video"),
        ("h.mkv", pad(b"\x1A\x45\xDF\xA3"), "Matroska"),
        ("i.gif", pad(b"GIF89a"), "GIF"),
        ("j.cr2", pad(b"II*\0\x10\0\0\0CR\x02\0"), "develop it"),
        ("k.dng", dng, "DNG is raw"),
        ("l.cr3", pad(b"\0\0\0\x18ftypcrx "), "Canon CR3"),
        ("m.raf", pad(b"FUJIFILMCCD-RAW 0201"), "Fujifilm"),
        ("n.bin", pad(b"\x01\x02"), "give JPEG"),
        ("o.png", pad(b"\x89PNG\r\n\x1A\n"), "PNG"),
        ("p.tif", pad(b"II*\0\x08\0\0\0"), "TIFF"),
    ] {
        let text = message(name, &bytes);
        assert!(text.contains(words) && text.contains(": ") && !text.contains('\n'), "{name}: {text}");
    }
}

#[test]
fn files_that_are_cut_short_say_so() {
    let stored = photo(96, 64, 3, false);
    for format in [
        ImageFormat::Jpeg,
        ImageFormat::Png,
        ImageFormat::Tiff,
        ImageFormat::Bmp,
        ImageFormat::WebP,
        ImageFormat::Pnm,
    ] {
        let whole = encode(&stored, format);
        for share in [0.1, 0.5, 0.9] {
            let cut = &whole[..(whole.len() as f64 * share) as usize];
            let text = message("a", cut);
            assert!(text.contains("cut short"), "{format:?} {share}: {text}");
        }
    }
    // Only the end marker is missing: the picture is there.
    let whole = jpeg(&stored);
    let picture = keep("a.jpg", &whole[..whole.len() - 2]).unwrap();
    assert_eq!(picture.photo, keep("a.jpg", &whole).unwrap().photo);
    assert!(picture.notes[0].contains("end of the file is missing"));
}

#[test]
fn damage_never_panics() {
    let stored = photo(48, 32, 3, false);
    let mut state = 1u32;
    let mut next = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as usize
    };
    let mut read = 0;
    for format in [
        ImageFormat::Jpeg,
        ImageFormat::Png,
        ImageFormat::Tiff,
        ImageFormat::Bmp,
        ImageFormat::WebP,
        ImageFormat::Pnm,
    ] {
        let whole = encode(&stored, format);
        for _ in 0..150 {
            let mut bytes = whole.clone();
            for _ in 0..=next() % 4 {
                let at = next() % bytes.len();
                bytes[at] = next() as u8;
            }
            match keep("a", &bytes) {
                Ok(_) => read += 1,
                Err(e) => assert!(matches!(e, Error::Picture { .. }), "{e}"),
            }
        }
    }
    assert!(read > 100, "{read}");
}

#[test]
fn bombs_are_refused_before_they_are_decoded() {
    let pnm = b"P6 40000 40000 255\n".to_vec();
    let mut bmp = encode(&photo(2, 2, 3, false), ImageFormat::Bmp);
    bmp[18..26].copy_from_slice(&[0xFF, 0xFF, 0x0F, 0, 0xFF, 0xFF, 0x0F, 0]);
    let mut tiff = encode(&photo(2, 2, 3, false), ImageFormat::Tiff);
    let size = ifd::value_positions(&tiff, &[256, 257]).unwrap();
    for at in size {
        tiff[at..at + 4].copy_from_slice(&60_000u32.to_le_bytes());
    }
    let mut jpeg = jpeg(&photo(16, 16, 3, false));
    let sof = jpeg.windows(2).position(|w| w == [0xFF, 0xC0]).unwrap();
    jpeg[sof + 5..sof + 9].fill(0xFF);
    for (name, bytes) in [("a.ppm", pnm), ("a.bmp", bmp), ("a.tif", tiff), ("a.jpg", jpeg)] {
        let text = message(name, &bytes);
        assert!(text.contains("more than this program opens"), "{name}: {text}");
    }
}

#[test]
fn animations_give_their_first_frame() {
    let mut png = encode(&photo(8, 8, 3, false), ImageFormat::Png);
    let chunk = b"\0\0\0\x08acTL\0\0\0\x05\0\0\0\0";
    let mut with_crc = chunk.to_vec();
    with_crc.extend(crc(&chunk[4..]).to_be_bytes());
    png.splice(33..33, with_crc);
    let picture = keep("a.png", &png).unwrap();
    assert_eq!(picture.photo, photo(8, 8, 3, false));
    assert_eq!(picture.notes, ["an animation of 5 frames: only the first was used"]);
}

fn crc(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0u32, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |c, _| if c & 1 == 1 { c >> 1 ^ 0xEDB8_8320 } else { c >> 1 })
    })
}

#[test]
fn copies_are_known_by_their_pixels() {
    let stored = photo(20, 10, 3, false);
    let [png, ppm] = [ImageFormat::Png, ImageFormat::Pnm].map(|f| keep("a", &encode(&stored, f)).unwrap());
    assert_eq!(png.pixels_hash, ppm.pixels_hash);
    assert_ne!(png.bytes_hash, ppm.bytes_hash);
    let Samples::U8(mut s) = stored.samples.clone() else { panic!("8 bit") };
    s[17] ^= 1;
    let other = keep("a", &encode(&Photo { samples: Samples::U8(s), ..stored }, ImageFormat::Png)).unwrap();
    assert_ne!(png.pixels_hash, other.pixels_hash);
}

#[test]
fn indexed_tiffs_are_looked_up() {
    // 2 × 2 px, 4 bits, indices 1 2 / 3 0, little endian.
    let colours: [[u16; 3]; 16] =
        std::array::from_fn(|i| [i as u16 * 4096, 65280 - i as u16 * 256, 77 * 256]);
    let mut map = Vec::new();
    for c in 0..3 {
        map.extend(colours.iter().flat_map(|rgb| rgb[c].to_le_bytes()));
    }
    let tags: [(u16, u16, u32, u32); 9] = [
        (256, 3, 1, 2),
        (257, 3, 1, 2),
        (258, 3, 1, 4),
        (259, 3, 1, 1),
        (262, 3, 1, 3),
        (273, 4, 1, 8),
        (278, 3, 1, 2),
        (279, 4, 1, 2),
        (320, 3, 48, 10),
    ];
    let mut bytes = b"II*\0".to_vec();
    bytes.extend((10 + map.len() as u32).to_le_bytes());
    bytes.extend([0x12, 0x30]);
    bytes.extend(&map);
    bytes.extend((tags.len() as u16).to_le_bytes());
    for (tag, kind, count, value) in tags {
        bytes.extend([tag.to_le_bytes(), kind.to_le_bytes()].concat());
        bytes.extend([count.to_le_bytes(), value.to_le_bytes()].concat());
    }
    bytes.extend([0; 4]);
    let picture = keep("a.tif", &bytes).unwrap().photo;
    let expected = [1, 2, 3, 0].iter().flat_map(|i| colours[*i as usize].map(|v| (v >> 8) as u8)).collect();
    assert_eq!(picture, Photo { width: 2, height: 2, channels: 3, samples: Samples::U8(expected) });
}

#[test]
fn a_hundred_megapixels_are_read() {
    let (w, h) = (12_000, 8_400);
    let samples = (0..w * h).map(|i| (i / 37) as u8).collect();
    let stored = Photo { width: w, height: h, channels: 1, samples: Samples::U8(samples) };
    let header = format!("P5 {w} {h} 255\n").into_bytes();
    let Samples::U8(s) = &stored.samples else { panic!("8 bit") };
    let picture = keep("a.pgm", &[&header[..], s].concat()).unwrap();
    assert_eq!(picture.photo, stored);
}

fn tiny_png() -> Vec<u8> {
    encode(&photo(4, 4, 1, false), ImageFormat::Png)
}

#[test]
fn folders_are_listed_in_natural_order() {
    let dir = tempfile::tempdir().unwrap();
    let put = |name: &str, bytes: &[u8]| {
        let path = dir.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, bytes).unwrap();
    };
    for name in
        ["set/img10.png", "set/img2.png", "set/.hidden.png", "set/IMG1.png", "set/sub/deep.png", "set/noext"]
    {
        put(name, &tiny_png());
    }
    put("set/notes.txt", b"notes");
    put("set/corners.yml", b"%YAML:1.0\n");
    put("set/broken.jpg", b"not a picture");
    put("set/clip.mov", b"\0\0\0\x18ftypqt  ");
    put("tree/b/x.png", &tiny_png());
    put("tree/a/y.png", &tiny_png());
    put("tree/.DS_Store", b"");
    let names = |paths: &[&str]| -> Vec<String> {
        let paths: Vec<_> = paths.iter().map(|p| dir.path().join(p)).collect();
        let strip =
            |p: &std::path::PathBuf| p.strip_prefix(dir.path()).unwrap().to_string_lossy().into_owned();
        list(&paths).unwrap().iter().map(strip).collect()
    };
    assert_eq!(
        names(&["set"]),
        ["set/broken.jpg", "set/clip.mov", "set/IMG1.png", "set/img2.png", "set/img10.png", "set/noext"]
    );
    assert_eq!(names(&["tree"]), ["tree/a/y.png", "tree/b/x.png"]);
    assert_eq!(names(&["set/notes.txt", "set/img2.png", "set/img2.png"]), ["set/notes.txt", "set/img2.png"]);
    let missing = list(&[dir.path().join("nowhere")]).unwrap_err();
    assert!(matches!(&missing, Error::File { message, .. } if message.contains("no such file")), "{missing}");
    fs::create_dir(dir.path().join("empty")).unwrap();
    assert_eq!(list(&[dir.path().join("empty")]).unwrap(), Vec::<std::path::PathBuf>::new());
}

#[test]
fn real_photographs_are_read() {
    let root = std::env::var_os("STRAIGHTEDGE_DATA")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data"), Into::into);
    if !root.is_dir() {
        println!("skipped: no photographs at {}", root.display());
        return;
    }
    for (set, count, size) in [
        ("opencv_left", 13, [640, 480]),
        ("learning_opencv_phone", 8, [1600, 1200]),
        ("udacity_lane", 20, [1280, 720]),
    ] {
        let files = list(&[root.join(set)]).unwrap();
        assert_eq!(files.len(), count);
        let first = read(&files[0], Colours::Keep).unwrap();
        assert_eq!([first.photo.width, first.photo.height], size);
        assert_eq!(size_px(&files[0]).unwrap(), size.map(|n| n as u32));
        let luma = read(&files[0], Colours::Gray).unwrap();
        let (Samples::U8(a), Samples::U8(b)) = (gray(&first.photo).samples, luma.photo.samples) else {
            panic!("8 bit")
        };
        // OpenCV's two ways of reading grey differ by as much: where a colour is saturated, its luma is lost.
        let off = a.iter().zip(&b).filter(|(a, b)| a.abs_diff(**b) > 1).count();
        assert!(a.len() == b.len() && off * 10_000 < a.len(), "{set}: {off}");
    }
}

/// A TIFF whose first directory says that it is a preview and that more lies in sub-directories.
fn preview_with_sub_directories() -> Vec<u8> {
    let mut bytes = encode(&photo(16, 8, 1, false), ImageFormat::Tiff);
    let start = bytes.len() + bytes.len() % 2;
    bytes.resize(start, 0);
    let first = ifd::Directory::first(&bytes).unwrap();
    let entries = first.entries.iter().filter(|e| ![254, 330].contains(&e.tag));
    let mut list: Vec<(u16, [u8; 12])> =
        entries.map(|e| (e.tag, bytes[e.value_at - 8..e.value_at + 4].try_into().unwrap())).collect();
    for tag in [254u16, 330] {
        let mut entry = [0; 12];
        entry[..2].copy_from_slice(&tag.to_le_bytes());
        entry[2..5].copy_from_slice(&[4, 0, 1]);
        entry[8] = 1;
        list.push((tag, entry));
    }
    list.sort_by_key(|e| e.0);
    bytes.extend((list.len() as u16).to_le_bytes());
    list.iter().for_each(|e| bytes.extend(e.1));
    bytes.extend([0; 4]);
    bytes[4..8].copy_from_slice(&(start as u32).to_le_bytes());
    bytes
}

#[test]
fn raw_files_are_named_and_never_read_as_their_preview() {
    let tiff = encode(&photo(16, 8, 3, false), ImageFormat::Tiff);
    for extension in ["nef", "ARW", "cr2", "dng", "orf", "rw2", "pef", "srw", "raf"] {
        let name = format!("a.{extension}");
        for bytes in [&tiff[..], &tiff[..tiff.len() / 2], &tiff[..8]] {
            let why = message(&name, bytes);
            assert!(why.contains("RAW") && why.contains("develop it to TIFF, PNG or JPEG"), "{name}: {why}");
        }
    }
    assert!(message("a.tif", &preview_with_sub_directories()).contains("RAW"));
    assert!(keep("a.tif", &tiff).is_ok());
}

#[cfg(unix)]
#[test]
fn pipes_are_never_waited_for() {
    let folder = tempfile::tempdir().unwrap();
    let pipe = folder.path().join("pipe.jpg");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    std::fs::write(folder.path().join("a.jpg"), jpeg(&photo(16, 8, 1, false))).unwrap();
    assert_eq!(list(&[folder.path().to_path_buf()]).unwrap(), [folder.path().join("a.jpg")]);
    let error = read(&pipe, Colours::Gray).unwrap_err().to_string();
    assert!(error.contains("pipe.jpg: this is no file but a pipe"), "{error}");
    assert!(size_px(&pipe).is_err());
}

#[test]
fn limits_hold_the_largest_cameras_and_no_bomb() {
    let check = |w, h, bytes| check_size(w, h, bytes);
    assert_eq!(check(11_648, 8_736, 8), Ok(()), "100 megapixels, four channels of 16 bits");
    let error = check(20_000, 20_000, 1).unwrap_err();
    assert!(error.contains("20000 x 20000 px") && error.contains("(200 megapixels)"), "{error}");
}
