//! EXIF of a picture that was changed: its size, and no thumbnail. Changed in place, so that maker notes, whose offsets count
//! from the beginning of the block, stay readable.

use crate::job::photo::ifd::Directory;

const IMAGE_WIDTH: u16 = 256;
const IMAGE_LENGTH: u16 = 257;
const EXIF: u16 = 34665;
/// Width and height in the EXIF directory.
pub(super) const PIXEL_DIMENSIONS: [u16; 2] = [0xA002, 0xA003];
const THUMBNAIL_OFFSET: u16 = 513;
const THUMBNAIL_LENGTH: u16 = 514;
/// A JPEG thumbnail is smaller than one EXIF block.
const MOST_THUMBNAIL: usize = 1 << 16;

/// The block for a picture of `size_px`; `resized` where the original had another size. What is damaged stays as it is.
pub(super) fn updated(block: &[u8], size_px: [u32; 2], resized: bool) -> Vec<u8> {
    let mut out = block.to_vec();
    let Some(main) = Directory::first(block) else { return out };
    if resized {
        let exif = main.find(EXIF).and_then(|e| Directory::at(block, e.value as usize));
        let sizes = [(Some(&main), [IMAGE_WIDTH, IMAGE_LENGTH]), (exif.as_ref(), PIXEL_DIMENSIONS)];
        for (directory, tags) in sizes {
            for (tag, value) in tags.into_iter().zip(size_px) {
                if let Some(entry) = directory.and_then(|d| d.find(tag)).filter(|e| e.count == 1) {
                    let _ = entry.set(&mut out, value);
                }
            }
        }
    }
    if main.next != 0 {
        forget_thumbnail(&mut out, &main);
    }
    out
}

/// Unlinks the second directory, which is the thumbnail's, and removes its picture.
fn forget_thumbnail(block: &mut Vec<u8>, main: &Directory) {
    let range = Directory::at(block, main.next as usize).and_then(|thumbnail| {
        let [from, length] =
            [THUMBNAIL_OFFSET, THUMBNAIL_LENGTH].map(|t| thumbnail.find(t).map(|e| e.value as usize));
        let (from, length) = (from?, length.filter(|n| *n <= MOST_THUMBNAIL)?);
        Some(from..from.checked_add(length)?)
    });
    if let Some(link) = block.get_mut(main.next_at..main.next_at + 4) {
        link.fill(0);
    }
    // Only what is a JPEG: a damaged length must not cost other tags.
    if let Some(range) = range
        && block.get(range.clone()).is_some_and(|b| b.starts_with(&[0xFF, 0xD8]))
    {
        if range.end == block.len() {
            block.truncate(range.start);
        } else {
            block[range].fill(0);
        }
    }
}
