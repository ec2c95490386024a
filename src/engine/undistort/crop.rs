//! The largest rectangle of valid pixels.

use super::{
    Map, Rect,
    map::{INVALID, Row},
};

/// The largest rectangle of the output in which every pixel is valid: the first in reading order of the largest area.
///
/// One pass over the rows; in each, the largest rectangle under the skyline of valid runs that end there, by a stack (the
/// classical maximal-rectangle method).
pub(super) fn largest(map: &Map) -> Option<Rect> {
    let [w, h] = map.size();
    let mut row = Row::default();
    let mut heights = vec![0usize; w];
    let mut best: Option<(usize, Rect)> = None;
    let mut stack: Vec<(usize, usize)> = Vec::new(); // first column, height: both ascending
    for v in 0..h {
        map.row(v, &mut row);
        for (height, x) in heights.iter_mut().zip(&row.x) {
            *height = if *x == INVALID { 0 } else { *height + 1 };
        }
        stack.clear();
        for u in 0..=w {
            let height = heights.get(u).copied().unwrap_or(0);
            let mut first = u;
            while let Some(&(start, tall)) = stack.last().filter(|top| top.1 >= height) {
                stack.pop();
                first = start;
                let area = tall * (u - start);
                if tall > 0 && best.as_ref().is_none_or(|b| area > b.0) {
                    let (x, y) = (start as u32, (v + 1 - tall) as u32);
                    best = Some((area, Rect { x, y, width: (u - start) as u32, height: tall as u32 }));
                }
            }
            stack.push((first, height));
        }
    }
    best.map(|b| b.1)
}
