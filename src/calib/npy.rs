//! Arrays as NumPy files (`.npy`, version 1.0): what `numpy.load` and through it OpenCV reads.
//!
//! Format: "NEP 1 — A simple file format for NumPy arrays".

use nalgebra::Vector2;

use super::residual::Field;

/// The displacement of every pixel of a picture: `float32`, shape (height, width, 2), `[Δx, Δy]` px; zero without a field.
///
/// Entry `[y, x]` belongs to the pixel (x, y) where the model of the camera shows a point: it is seen at (x + Δx, y + Δy).
pub fn displacement(field: Option<&Field>, [width, height]: [u32; 2]) -> Vec<u8> {
    let mut out = header("<f4", &format!("({height}, {width}, 2)"));
    out.reserve(8 * width as usize * height as usize);
    for y in 0..height {
        for x in 0..width {
            let at = field.map_or_else(Vector2::zeros, |f| f.at(&Vector2::new(f64::from(x), f64::from(y))));
            out.extend((at.x as f32).to_le_bytes());
            out.extend((at.y as f32).to_le_bytes());
        }
    }
    out
}

/// Magic, version, length and dictionary, padded so that the data begin at a multiple of 64.
fn header(kind: &str, shape: &str) -> Vec<u8> {
    const BEFORE: usize = 10;
    let mut text = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}");
    let total = (BEFORE + text.len() + 1).next_multiple_of(64);
    text += &" ".repeat(total - BEFORE - text.len() - 1);
    text.push('\n');
    let mut out = b"\x93NUMPY\x01\x00".to_vec();
    out.extend((text.len() as u16).to_le_bytes());
    out.extend(text.as_bytes());
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pixel_has_its_displacement() {
        let mut offsets = vec![[0.0; 2]; 30];
        offsets[14] = [1.5, -0.6];
        let field = Field::new([-0.5; 2], [10.0; 2], [6, 5], offsets).unwrap();
        let bytes = displacement(Some(&field), [30, 20]);
        // As `numpy.save` begins.
        assert_eq!(&bytes[..10], b"\x93NUMPY\x01\x00\x76\x00");
        assert_eq!(
            std::str::from_utf8(&bytes[10..128]).unwrap().trim_end(),
            "{'descr': '<f4', 'fortran_order': False, 'shape': (20, 30, 2), }"
        );
        assert_eq!((bytes.len(), bytes[127]), (128 + 20 * 30 * 8, b'\n'));
        let at = |x: usize, y: usize| {
            let from = 128 + 8 * (y * 30 + x);
            [0, 4].map(|k| f32::from_le_bytes(bytes[from + k..from + k + 4].try_into().unwrap()))
        };
        let there = field.at(&Vector2::new(11.0, 9.0));
        assert_eq!(at(11, 9), [there.x as f32, there.y as f32]);
        assert!(there.x > 0.3 && there.y < -0.1);
        assert!(displacement(None, [30, 20])[128..].iter().all(|b| *b == 0));
    }
}
