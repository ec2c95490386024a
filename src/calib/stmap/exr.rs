//! OpenEXR of two channels R and G, 32-bit floats, one uncompressed part of scan lines from the top.
//!
//! Academy Software Foundation, "OpenEXR File Layout". Numbers are little-endian; channels stand in the order of the alphabet.

/// First bytes of every file, and version 2 without flags.
const MAGIC: [u8; 8] = [0x76, 0x2f, 0x31, 0x01, 2, 0, 0, 0];
/// Pixel type of 32-bit floats.
const FLOAT: u32 = 2;

/// Writes a picture of rows of `[R, G]`, all of `width` pixels.
pub(super) fn write(rows: &[Vec<[f32; 2]>], width: usize) -> Vec<u8> {
    let height = rows.len();
    let mut out = MAGIC.to_vec();
    let mut channels = Vec::new();
    for name in [b"G\0", b"R\0"] {
        channels.extend_from_slice(name);
        channels.extend(FLOAT.to_le_bytes());
        channels.extend([0; 4]); // not perceptually linear; reserved
        channels.extend([1u32, 1].map(u32::to_le_bytes).concat()); // every pixel
    }
    channels.push(0);
    let last = [width, height].map(|n| n.saturating_sub(1) as u32);
    let window = [0, 0, last[0], last[1]].map(u32::to_le_bytes).concat();
    let one = 1.0f32.to_le_bytes();
    let attributes: [(&str, &str, &[u8]); 8] = [
        ("channels", "chlist", &channels),
        ("compression", "compression", &[0]),
        ("dataWindow", "box2i", &window),
        ("displayWindow", "box2i", &window),
        ("lineOrder", "lineOrder", &[0]),
        ("pixelAspectRatio", "float", &one),
        ("screenWindowCenter", "v2f", &[0; 8]),
        ("screenWindowWidth", "float", &one),
    ];
    for (name, kind, value) in attributes {
        for text in [name, kind] {
            out.extend_from_slice(text.as_bytes());
            out.push(0);
        }
        out.extend((value.len() as u32).to_le_bytes());
        out.extend_from_slice(value);
    }
    out.push(0);
    let line = 8 * width;
    let first = out.len() + 8 * height;
    for y in 0..height {
        out.extend(((first + y * (8 + line)) as u64).to_le_bytes());
    }
    for (y, row) in rows.iter().enumerate() {
        out.extend((y as u32).to_le_bytes());
        out.extend((line as u32).to_le_bytes());
        for channel in [1, 0] {
            out.extend(row.iter().flat_map(|p| p[channel].to_le_bytes()));
        }
    }
    out
}
