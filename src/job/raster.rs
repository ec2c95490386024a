//! Pictures to be shown: 8 bits, grey or RGB.

use serde::{Deserialize, Serialize};

use crate::calib::image::{Gray, Photo, Samples};

/// Pixels for a screen.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Raster {
    /// `[width, height]`, px.
    pub size_px: [usize; 2],
    /// 1 grey, 3 RGB.
    pub channels: usize,
    /// Row-major, interleaved.
    #[serde(with = "serde_bytes")]
    pub data: Vec<u8>,
}

impl Raster {
    /// A photograph without its alpha; 16 bits are stretched from 0 to their largest value, because cameras store 10 or 12 bits
    /// in them.
    pub fn of(photo: Photo) -> Self {
        let Photo { width, height, channels, samples } = photo;
        let bytes = match samples {
            Samples::U8(bytes) => bytes,
            Samples::U16(words) => {
                let most = f32::from(words.iter().copied().max().unwrap_or(1).max(1));
                words.iter().map(|w| (f32::from(*w) * 255.0 / most + 0.5) as u8).collect()
            }
        };
        let (channels, data) = match channels {
            2 => (1, bytes.chunks_exact(2).map(|p| p[0]).collect()),
            4 => (3, bytes.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect()),
            n => (n, bytes),
        };
        Self { size_px: [width, height], channels, data }
    }

    /// A small grey copy whose longer side is `longest` px or less, each pixel the mean of the box that it covers.
    pub fn thumbnail(gray: &Gray, longest: usize) -> Self {
        match gray {
            Gray::U8(plane) => shrink(plane.data(), gray.size(), longest, 255.0),
            Gray::U16(plane) => {
                let most = f64::from(plane.data().iter().copied().max().unwrap_or(1).max(1));
                shrink(plane.data(), gray.size(), longest, most)
            }
        }
    }
}

fn shrink<T: Copy + Into<f64>>(data: &[T], [width, height]: [usize; 2], longest: usize, most: f64) -> Raster {
    let scale = (longest as f64 / width.max(height) as f64).min(1.0);
    let size_px = [width, height].map(|n| ((n as f64 * scale).round() as usize).max(1));
    let span = |i: usize, n: usize, of: usize| {
        let from = i * of / n;
        from..((i + 1) * of / n).max(from + 1)
    };
    let pixel = |u: usize, v: usize| {
        let (columns, rows) = (span(u, size_px[0], width), span(v, size_px[1], height));
        let count = (columns.len() * rows.len()) as f64;
        let row = |y: usize| data[y * width + columns.start..y * width + columns.end].iter();
        let sum: f64 = rows.flat_map(row).map(|s| (*s).into()).sum();
        (sum / count * 255.0 / most + 0.5) as u8
    };
    let data = (0..size_px[1])
        .flat_map(|v| (0..size_px[0]).map(move |u| (u, v)))
        .map(|(u, v)| pixel(u, v))
        .collect();
    Raster { size_px, channels: 1, data }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calib::image::Plane;

    #[test]
    fn thumbnails_are_means() {
        let gray = Gray::U8(Plane::from_fn(8, 4, |x, y| if (x + y) % 2 == 0 { 0 } else { 200 }));
        let small = Raster::thumbnail(&gray, 4);
        assert_eq!((small.size_px, small.data.as_slice()), ([4, 2], &[100u8; 8][..]));
        assert_eq!(Raster::thumbnail(&gray, 100).size_px, [8, 4]);
        let deep = Gray::U16(Plane::from_fn(4, 4, |_, _| 1023));
        assert_eq!(Raster::thumbnail(&deep, 2).data, [255; 4]);
    }

    #[test]
    fn alpha_is_left_out() {
        let photo = Photo { width: 1, height: 1, channels: 4, samples: Samples::U8(vec![1, 2, 3, 4]) };
        assert_eq!(Raster::of(photo), Raster { size_px: [1, 1], channels: 3, data: vec![1, 2, 3] });
    }
}
