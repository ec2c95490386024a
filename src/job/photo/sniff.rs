//! What the bytes of a file are, whatever it is called.

use std::{fmt, path::Path};

use serde::{Deserialize, Serialize};

/// Picture formats that are read and written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Format {
    /// JPEG, also as MPO.
    Jpeg,
    /// PNG.
    Png,
    /// TIFF and BigTIFF.
    Tiff,
    /// Windows bitmap.
    Bmp,
    /// WebP.
    WebP,
    /// PBM, PGM, PPM, PAM.
    Pnm,
}

impl Format {
    /// Extensions that people give to it, lower case; the first is the usual one.
    pub const fn extensions(self) -> &'static [&'static str] {
        match self {
            Self::Jpeg => &["jpg", "jpeg", "jpe", "jfif", "mpo"],
            Self::Png => &["png", "apng"],
            Self::Tiff => &["tif", "tiff"],
            Self::Bmp => &["bmp", "dib"],
            Self::WebP => &["webp"],
            Self::Pnm => &["ppm", "pgm", "pbm", "pnm", "pam"],
        }
    }

    const ALL: [Self; 6] = [Self::Jpeg, Self::Png, Self::Tiff, Self::Bmp, Self::WebP, Self::Pnm];
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Jpeg => "JPEG",
            Self::Png => "PNG",
            Self::Tiff => "TIFF",
            Self::Bmp => "BMP",
            Self::WebP => "WebP",
            Self::Pnm => "PNM",
        })
    }
}

/// What a file holds, by its first bytes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Content {
    /// A picture that can be read.
    Picture(Format),
    /// A picture or video that cannot: the reason and the remedy.
    Foreign(String),
    /// Something else: the reason why it is no picture.
    Other(String),
}

/// Looks at the first bytes, and where they are those of a TIFF also at the name: in many a raw file, above all one that is cut
/// short, nothing but its extension tells the preview from a picture.
pub fn sniff_named(name: &str, bytes: &[u8]) -> Content {
    const RAW: [&str; 21] = [
        "nef", "nrw", "arw", "srf", "sr2", "cr2", "cr3", "crw", "dng", "orf", "rw2", "raf", "pef", "srw",
        "x3f", "3fr", "fff", "iiq", "erf", "mef", "mos",
    ];
    let extension = Path::new(name).extension().and_then(|e| e.to_str()).unwrap_or_default();
    match sniff(bytes) {
        Content::Picture(Format::Tiff) if RAW.contains(&extension.to_ascii_lowercase().as_str()) => {
            raw(&extension.to_ascii_uppercase())
        }
        content => content,
    }
}

fn raw(name: &str) -> Content {
    Content::Foreign(format!(
        "{name} is raw sensor data (RAW), which is not read: develop it to TIFF, PNG or JPEG at full size, without lens correction"
    ))
}

/// Looks at the first bytes (64 KiB are plenty, 4 KiB do for all but some raw files).
pub fn sniff(bytes: &[u8]) -> Content {
    use Content::{Foreign, Other, Picture};
    let at = |offset: usize, magic: &[u8]| bytes.get(offset..).is_some_and(|b| b.starts_with(magic));
    let still = |name: &str| {
        Foreign(format!("{name} pictures are not read: export them as JPEG or PNG at full size"))
    };
    let video = |name: &str| {
        Foreign(format!(
            "{name} is a video: save some sharp frames as PNG, for example `ffmpeg -i FILE -vf fps=1 frame_%03d.png`"
        ))
    };
    if bytes.is_empty() {
        return Other("the file is empty (0 bytes): copy it again".to_owned());
    }
    if at(0, b"\xFF\xD8\xFF") {
        return Picture(Format::Jpeg);
    }
    if at(0, b"\x89PNG\r\n\x1A\n") {
        return Picture(Format::Png);
    }
    if at(0, b"BM") && bytes.len() >= 26 && matches!(bytes[14], 12 | 16 | 40 | 52 | 56 | 64 | 108 | 124) {
        return Picture(Format::Bmp);
    }
    if at(0, b"RIFF") {
        if at(8, b"WEBP") {
            return Picture(Format::WebP);
        }
        if at(8, b"AVI ") {
            return video("AVI");
        }
    }
    if bytes[0] == b'P' && bytes.len() > 2 && (bytes[2].is_ascii_whitespace() || bytes[2] == b'#') {
        match bytes[1] {
            b'1'..=b'7' => return Picture(Format::Pnm),
            b'f' | b'F' => return still("PFM (floating point)"),
            _ => {}
        }
    }
    if at(0, b"II*\0") || at(0, b"MM\0*") || at(0, b"II+\0") || at(0, b"MM\0+") {
        return match raw_tiff(bytes) {
            Some(name) => raw(name),
            None => Picture(Format::Tiff),
        };
    }
    for (magic, name) in [
        (&b"IIRO"[..], "Olympus ORF"),
        (b"IIRS", "Olympus ORF"),
        (b"MMOR", "Olympus ORF"),
        (b"IIU\0", "Panasonic RW2"),
        (b"FUJIFILMCCD-RAW", "Fujifilm RAF"),
        (b"FOVb", "Sigma X3F"),
        (b"\0MRM", "Minolta MRW"),
    ] {
        if at(0, magic) {
            return raw(name);
        }
    }
    if at(4, b"ftyp") {
        let brand = bytes.get(8..12).unwrap_or_default();
        return match brand {
            b"crx " => raw("Canon CR3"),
            b"avif" | b"avis" => still("AVIF"),
            b"heic" | b"heix" | b"hevc" | b"hevx" | b"heim" | b"heis" | b"mif1" | b"msf1" => Foreign(
                "HEIC pictures are not read: export them as JPEG at full size (iPhone: Settings, Camera, Formats, Most Compatible)"
                    .to_owned(),
            ),
            b"qt  " => video("QuickTime"),
            _ => video("MP4"),
        };
    }
    for (magic, name) in [
        (&b"GIF87a"[..], "GIF"),
        (b"GIF89a", "GIF"),
        (b"\0\0\0\x0CJXL ", "JPEG XL"),
        (b"\xFF\x0A", "JPEG XL"),
        (b"\0\0\0\x0CjP  ", "JPEG 2000"),
        (b"\xFF\x4F\xFF\x51", "JPEG 2000"),
        (b"8BPS", "Photoshop"),
        (b"v/1\x01", "OpenEXR"),
        (b"#?RADIANCE", "Radiance HDR"),
        (b"qoif", "QOI"),
        (b"gimp xcf", "GIMP"),
        (b"DDS ", "DDS"),
    ] {
        if at(0, magic) {
            return still(name);
        }
    }
    for (magic, name) in [
        (&b"\x1A\x45\xDF\xA3"[..], "Matroska or WebM"),
        (b"\0\0\x01\xBA", "MPEG"),
        (b"\0\0\x01\xB3", "MPEG"),
        (b"FLV\x01", "FLV"),
        (b"\x30\x26\xB2\x75\x8E\x66\xCF\x11", "WMV"),
    ] {
        if at(0, magic) {
            return video(name);
        }
    }
    if at(4, b"moov") || at(4, b"mdat") || at(4, b"wide") {
        return video("QuickTime");
    }
    let head = &bytes[..bytes.len().min(512)];
    if head.iter().all(|b| *b >= 0x20 || b.is_ascii_whitespace()) {
        return Other(
            "this is a text file, not a picture: give JPEG, PNG, TIFF, BMP, WebP or PNM".to_owned(),
        );
    }
    Other("this is not a picture of a known kind: give JPEG, PNG, TIFF, BMP, WebP or PNM".to_owned())
}

/// Whether the extension says that the file should be a picture or video, read or not.
pub(super) fn named_like_a_picture(path: &Path) -> bool {
    const FOREIGN: [&str; 33] = [
        "heic", "heif", "avif", "jxl", "jp2", "j2k", "gif", "exr", "hdr", "qoi", "pfm", "dng", "cr2", "cr3",
        "crw", "nef", "nrw", "arw", "srf", "sr2", "raf", "orf", "rw2", "pef", "srw", "x3f", "mp4", "mov",
        "avi", "mkv", "webm", "m4v", "mts",
    ];
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    FOREIGN.contains(&extension.as_str())
        || Format::ALL.iter().any(|f| f.extensions().contains(&extension.as_str()))
}

/// The extension of `name` where it belongs to another kind of picture than `format`.
pub(super) fn wrong_extension(name: &str, format: Format) -> Option<String> {
    let path = Path::new(name);
    let extension = path.extension()?.to_str()?.to_ascii_lowercase();
    (!format.extensions().contains(&extension.as_str()) && named_like_a_picture(path)).then_some(extension)
}

/// Number of frames of an animated PNG or WebP.
pub(super) fn animation(bytes: &[u8], format: Format) -> Option<u32> {
    match format {
        Format::Png => {
            // acTL stands before the first IDAT.
            let mut at = 8;
            loop {
                let head = bytes.get(at..at + 8)?;
                let length = u32::from_be_bytes(head[..4].try_into().ok()?) as usize;
                match &head[4..] {
                    b"acTL" => {
                        let frames = u32::from_be_bytes(bytes.get(at + 8..at + 12)?.try_into().ok()?);
                        return (frames > 1).then_some(frames);
                    }
                    b"IDAT" | b"IEND" => return None,
                    _ => at = at.checked_add(length)?.checked_add(12)?,
                }
            }
        }
        Format::WebP => {
            let mut at = 12usize;
            let mut frames = 0;
            while let Some(head) = bytes.get(at..at + 8) {
                frames += u32::from(head.starts_with(b"ANMF"));
                let length = u32::from_le_bytes(head[4..].try_into().ok()?) as usize;
                at = at.checked_add(8)?.checked_add(length)?.checked_add(length & 1)?;
            }
            (frames > 1).then_some(frames)
        }
        _ => None,
    }
}

/// Whether a RIFF file (WebP) lacks bytes that its header promises.
pub(super) fn shorter_than_it_says(bytes: &[u8]) -> bool {
    let length = bytes.get(4..8).and_then(|b| b.try_into().ok()).map(u32::from_le_bytes);
    bytes.starts_with(b"RIFF") && length.is_some_and(|n| u64::from(n) + 8 > bytes.len() as u64)
}

/// The raw format that hides behind a TIFF header: cameras put a thumbnail first and the sensor data in a sub-directory.
fn raw_tiff(bytes: &[u8]) -> Option<&'static str> {
    const NEW_SUBFILE_TYPE: u16 = 254;
    const PHOTOMETRIC: u16 = 262;
    const SUB_IFDS: u16 = 330;
    const DNG_VERSION: u16 = 50706;
    if bytes.get(8..10) == Some(b"CR") {
        return Some("Canon CR2");
    }
    let directory = super::ifd::Directory::first(bytes)?;
    let value = |tag: u16| directory.find(tag).map(|e| e.value);
    if value(DNG_VERSION).is_some() {
        return Some("DNG");
    }
    if matches!(value(PHOTOMETRIC), Some(32803 | 34892)) {
        return Some("This file");
    }
    let preview = value(NEW_SUBFILE_TYPE).is_some_and(|v| v & 1 == 1);
    (preview && value(SUB_IFDS).is_some()).then_some("A TIFF that begins with a preview (NEF, ARW or alike)")
}
