//! What a photograph says about its camera: the EXIF tags that calibration can use.

use std::io::Cursor;

use exif::{Field, In, Reader, Tag, Value};
use serde::{Deserialize, Serialize};

use super::Format;

/// Diagonal of the 36 × 24 mm frame to which "35 mm equivalent" focal lengths refer (CIPA DCG-001).
const DIAGONAL_35MM: f64 = 43.266_615_305_567_87;

/// Camera, lens and time of a photograph; what the file does not say is `None`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Exif {
    /// Maker of the camera.
    pub make: Option<String>,
    /// Camera model.
    pub model: Option<String>,
    /// Serial number of the body.
    pub serial: Option<String>,
    /// Lens model.
    pub lens: Option<String>,
    /// Focal length, mm.
    pub focal_mm: Option<f64>,
    /// Focal length of a 36 × 24 mm camera with the same diagonal angle of view, mm.
    pub focal_35mm: Option<f64>,
    /// Pixels per mm of the sensor along x, at the size that the camera wrote.
    pub sensor_px_per_mm: Option<f64>,
    /// Size that the camera wrote, px: differs from the picture's where it was resized.
    pub original_size_px: Option<[u32; 2]>,
    /// How to turn the stored picture for display, 1 to 8; never applied to geometry.
    pub orientation: Option<u8>,
    /// When it was taken, as written: `2024:05:01 12:00:00`.
    pub time: Option<String>,
}

impl Exif {
    /// Reads the tags of a picture; empty where there are none, or where they are damaged.
    pub(super) fn read(bytes: &[u8], format: Format) -> Self {
        if matches!(format, Format::Bmp | Format::Pnm) {
            return Self::default();
        }
        let mut reader = Reader::new();
        reader.continue_on_error(true);
        let tags = match reader.read_from_container(&mut Cursor::new(bytes)) {
            Ok(tags) => tags,
            Err(e) => match e.distill_partial_result(|_| {}) {
                Ok(tags) => tags,
                Err(_) => return Self::default(),
            },
        };
        let field = |tag: Tag| tags.get_field(tag, In::PRIMARY);
        let text = |tag| field(tag).and_then(text);
        let number = |tag| field(tag).and_then(number).filter(|v| v.is_finite() && *v > 0.0);
        let unit_mm = match field(Tag::FocalPlaneResolutionUnit).and_then(|f| f.value.get_uint(0)) {
            Some(3) => 10.0,
            Some(4) => 1.0,
            Some(5) => 0.001,
            _ => 25.4,
        };
        let size = |tag| field(tag).and_then(|f| f.value.get_uint(0)).filter(|v| *v > 0);
        Self {
            make: text(Tag::Make),
            model: text(Tag::Model),
            serial: text(Tag::BodySerialNumber),
            lens: text(Tag::LensModel),
            focal_mm: number(Tag::FocalLength),
            focal_35mm: number(Tag::FocalLengthIn35mmFilm),
            sensor_px_per_mm: number(Tag::FocalPlaneXResolution).map(|v| v / unit_mm),
            original_size_px: size(Tag::PixelXDimension).zip(size(Tag::PixelYDimension)).map(|(w, h)| [w, h]),
            orientation: field(Tag::Orientation)
                .and_then(|f| f.value.get_uint(0))
                .filter(|v| (1..=8).contains(v))
                .map(|v| v as u8),
            time: text(Tag::DateTimeOriginal).or_else(|| text(Tag::DateTime)),
        }
    }

    /// Focal length in pixels of a picture of `width` × `height`, as the tags imply it; good to some per cent, for a start
    /// value and a sanity check only.
    ///
    /// The 35 mm equivalent refers to the diagonal, which makes it independent of resizing and of the way the camera was
    /// held. Without it, focal length × pixels per mm of the sensor, scaled where the picture was resized.
    pub fn focal_hint_px(&self, width: u32, height: u32) -> Option<f64> {
        let (w, h) = (f64::from(width), f64::from(height));
        let by_equivalent = || Some(self.focal_35mm? / DIAGONAL_35MM * w.hypot(h));
        let by_sensor = || {
            let [ow, oh] = self.original_size_px.map_or([w, h], |s| s.map(f64::from));
            Some(self.focal_mm? * self.sensor_px_per_mm? * w.max(h) / ow.max(oh))
        };
        // Outside 1.2° to 143° of diagonal view the tags are wrong.
        by_equivalent().or_else(by_sensor).filter(|f| (1.0 / 6.0..50.0).contains(&(f / w.hypot(h))))
    }
}

fn text(field: &Field) -> Option<String> {
    let Value::Ascii(parts) = &field.value else { return None };
    let text = parts.iter().map(|p| String::from_utf8_lossy(p)).collect::<Vec<_>>().join(" ");
    let text: String = text.chars().filter(|c| !c.is_control()).collect();
    let text = text.trim();
    (!text.is_empty()).then(|| text.to_owned())
}

fn number(field: &Field) -> Option<f64> {
    match &field.value {
        Value::Rational(v) => v.first().map(|r| r.to_f64()),
        Value::SRational(v) => v.first().map(|r| r.to_f64()),
        v => v.get_uint(0).map(f64::from),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_focal_length_follows_from_either_kind_of_tag() {
        let close = |a: Option<f64>, b: f64| assert!((a.unwrap() / b - 1.0).abs() < 0.005, "{a:?} {b}");
        // iPhone 6: 4.15 mm before a sensor of 4.89 × 3.67 mm.
        let phone = Exif { focal_35mm: Some(29.0), ..Exif::default() };
        close(phone.focal_hint_px(3264, 2448), 2735.0);
        close(phone.focal_hint_px(1224, 1632), 2735.0 / 2.0);
        // Canon EOS 5D Mark II: 50 mm, 5616 px on 36 mm; then the picture at half size.
        let camera = Exif {
            focal_mm: Some(50.0),
            sensor_px_per_mm: Some(3849.211 / 25.4),
            original_size_px: Some([5616, 3744]),
            ..Exif::default()
        };
        close(camera.focal_hint_px(5616, 3744), 7577.0);
        close(camera.focal_hint_px(2808, 1872), 3788.5);
        assert_eq!(Exif { focal_35mm: Some(4e5), ..Exif::default() }.focal_hint_px(640, 480), None);
        assert_eq!(Exif::default().focal_hint_px(640, 480), None);
    }
}
