//! Why there is no grid of circles in a picture, in words that help.

use super::search::FEWEST;
use crate::image::Plane;

/// What the search saw on its way.
#[derive(Debug, Default)]
pub(super) struct Searched {
    /// Most possible dots in a level.
    pub(super) spots: usize,
    /// Most dots that stood the fit in one lattice.
    pub(super) dots: usize,
    /// A lattice was found whose dots are not round.
    pub(super) uneven: bool,
    /// A lattice was found that is not square in the metric of its dots, or whose dots nearly touch.
    pub(super) skewed: bool,
}

/// Smallest side of a picture that can show a board, px.
const SMALLEST_SIDE: usize = 24;
/// Smallest difference between dark and bright places, grey levels of 255.
const FAINT: u8 = 8;

/// The reason.
pub(super) fn why(picture: &Plane<u8>, searched: &Searched) -> String {
    let (w, h) = (picture.width(), picture.height());
    if w.min(h) < SMALLEST_SIDE {
        return format!("the picture is too small for a grid of circles ({w}x{h} px)");
    }
    let step = (picture.data().len() / 50_000).max(1);
    let some = || picture.data().iter().step_by(step);
    if some().max().copied().unwrap_or(0) - some().min().copied().unwrap_or(0) < FAINT {
        return "the picture is nearly uniform: no dots can be told from their surroundings".to_owned();
    }
    if searched.uneven {
        return "no grid of circles: what lies on a grid in this picture is not round".to_owned();
    }
    if searched.skewed {
        return "no grid of circles: the spots in this picture are not circles on a square grid".to_owned();
    }
    if searched.dots >= 4 {
        return format!(
            "only {} dots in a grid, at least {FEWEST} in 3x3 are needed: show more of the board, larger and sharper",
            searched.dots
        );
    }
    match searched.spots {
        0 => "no dots".to_owned(),
        _ => "no grid of circles: no dots in the picture lie on a grid".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reasons_name_what_is_wrong() {
        let plain = Plane::from_fn(100, 100, |x, _| x as u8);
        let say = |dots: usize, uneven: bool, skewed: bool| {
            why(&plain, &Searched { spots: 9, dots, uneven, skewed })
        };
        assert!(say(7, false, false).contains("only 7"));
        assert!(say(20, true, false).contains("not round"));
        assert!(say(20, false, true).contains("square grid"));
        assert!(say(0, false, false).contains("no dots in the picture lie"));
        assert!(why(&Plane::new(0, 0), &Searched::default()).contains("0x0"));
        assert!(why(&Plane::from_fn(99, 99, |_, _| 7), &Searched::default()).contains("uniform"));
    }
}
