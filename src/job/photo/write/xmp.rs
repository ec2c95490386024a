//! XMP of a picture whose size changed: `tiff:ImageWidth`, `exif:PixelXDimension` and their partners, as attributes or elements.

const SIZES: [(&str, usize); 4] = [
    ("tiff:ImageWidth", 0),
    ("tiff:ImageLength", 1),
    ("exif:PixelXDimension", 0),
    ("exif:PixelYDimension", 1),
];

/// The packet for a picture of `size_px`; `resized` where the original had another size.
pub(super) fn updated(packet: &[u8], size_px: [u32; 2], resized: bool) -> Vec<u8> {
    let Ok(text) = std::str::from_utf8(packet) else { return packet.to_vec() };
    let mut text = text.to_owned();
    if resized {
        for (name, axis) in SIZES {
            for (open, close) in
                [(format!("{name}=\""), '"'), (format!("{name}='"), '\''), (format!("<{name}>"), '<')]
            {
                replace(&mut text, &open, close, size_px[axis]);
            }
        }
    }
    text.into_bytes()
}

/// Replaces the digits between `open` and `close` wherever they stand.
fn replace(text: &mut String, open: &str, close: char, value: u32) {
    let mut from = 0;
    while let Some(at) = text[from..].find(open) {
        let start = from + at + open.len();
        let Some(length) = text[start..].find(close) else { return };
        if text[start..start + length].bytes().all(|b| b.is_ascii_digit()) {
            text.replace_range(start..start + length, &value.to_string());
        }
        from = start;
    }
}

#[cfg(test)]
mod tests {
    use super::updated;

    #[test]
    fn sizes_are_replaced_in_every_notation() {
        let packet = "<a tiff:ImageWidth=\"640\" exif:PixelYDimension='480'><tiff:ImageLength>480</tiff:ImageLength>\
                      <exif:PixelXDimension>x</exif:PixelXDimension></a>";
        let out = updated(packet.as_bytes(), [600, 44], true);
        assert_eq!(
            String::from_utf8(out).unwrap(),
            "<a tiff:ImageWidth=\"600\" exif:PixelYDimension='44'><tiff:ImageLength>44</tiff:ImageLength>\
             <exif:PixelXDimension>x</exif:PixelXDimension></a>"
        );
        assert_eq!(updated(packet.as_bytes(), [600, 44], false), packet.as_bytes());
        assert_eq!(updated(b"\xFF\xFE<", [1, 1], true), b"\xFF\xFE<");
    }
}
