//! Why there is no board in a picture, in words that help.

use super::{pyramid::Level, search::FEWEST};
use crate::image::Plane;

/// What the search saw on its way.
#[derive(Debug, Default)]
pub(super) struct Searched {
    /// Most possible corners in a level.
    pub(super) saddles: usize,
    /// Most corners that fitted into one grid.
    pub(super) corners: usize,
}

/// Smallest side of a picture that can show a board, px.
const SMALLEST_SIDE: usize = 24;
/// Smallest difference between dark and bright places, grey levels of 255.
const FAINT: u8 = 10;
/// A strong edge rises by this share of its height from pixel to pixel, at most, where the picture is too blurred: a blur of
/// about 5 px.
const BLURRED: f64 = 0.09;

/// The reason; `levels` from the finest on.
pub(super) fn why(levels: &[Level<'_>], searched: &Searched) -> String {
    let picture = &levels[0].picture;
    let (w, h) = (picture.width(), picture.height());
    if w.min(h) < SMALLEST_SIDE {
        return format!("the picture is too small for a board ({w}x{h} px)");
    }
    let (low, high) = range(picture);
    if high - low < FAINT {
        return "the picture is nearly uniform: no board can be told from its surroundings".to_owned();
    }
    if searched.corners >= 4 {
        return format!(
            "only {} checkerboard corners in a grid, at least {FEWEST} in 3x3 are needed: show more of the board, larger and sharper",
            searched.corners
        );
    }
    if steepest(picture) < BLURRED * f64::from(high - low) {
        return "too blurred to find corners: hold the camera still, focus on the board".to_owned();
    }
    match searched.saddles {
        0 => "no checkerboard corners".to_owned(),
        _ => "no checkerboard: nothing in the picture lies on a grid of squares".to_owned(),
    }
}

/// Grey values below which a two-hundredth of the pixels lies, and above which one does.
fn range(picture: &Plane<u8>) -> (u8, u8) {
    let mut counts = [0usize; 256];
    let mut total = 0;
    for y in (0..picture.height()).step_by(1 + picture.height() / 200) {
        for v in picture.row(y) {
            counts[usize::from(*v)] += 1;
            total += 1;
        }
    }
    let cut = total / 200;
    let from = |first: usize, step: fn(usize, usize) -> usize| {
        let mut below = 0;
        let reached = |v: &usize| {
            below += counts[*v];
            below > cut
        };
        (0..256).map(|i| step(first, i)).find(reached).unwrap_or(first) as u8
    };
    (from(0, |first, i| first + i), from(255, |first, i| first - i))
}

/// Slope along the rows that one pixel in a thousand exceeds, grey levels per px.
fn steepest(picture: &Plane<u8>) -> f64 {
    let mut counts = [0usize; 256];
    let mut total = 0;
    for y in (0..picture.height()).step_by(1 + picture.height() / 200) {
        for t in picture.row(y).windows(3) {
            counts[usize::from(t[0].abs_diff(t[2]))] += 1;
            total += 1;
        }
    }
    let mut above = 0;
    let steep = (0..256).rev().find(|v| {
        above += counts[*v];
        1000 * above > total
    });
    0.5 * steep.unwrap_or(0) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::borrow::Cow;

    fn reason(picture: Plane<u8>, corners: usize) -> String {
        let searched = Searched { saddles: 9, corners };
        why(&[Level { level: 0, picture: Cow::Owned(picture) }], &searched)
    }

    #[test]
    fn reasons_name_what_is_wrong() {
        let edge = |width: f64| {
            Plane::from_fn(200, 100, move |x, _| {
                (128.0 + 100.0 * ((x as f64 - 100.0) / width).clamp(-1.0, 1.0)) as u8
            })
        };
        assert!(reason(Plane::new(10, 200), 0).contains("10x200"));
        assert!(reason(Plane::from_fn(200, 100, |_, _| 77), 0).contains("uniform"));
        assert!(reason(edge(60.0), 0).contains("blurred"));
        assert!(reason(edge(0.5), 0).contains("no checkerboard"));
        assert!(reason(edge(0.5), 7).contains("only 7"));
    }
}
