//! A grid from a level, refined in the picture: corners that do not stand the fit go, holes and rims are tried, and what does
//! not lie with its neighbours is dropped. Drop, never invent.

use nalgebra::Vector2;

use super::{
    grow::Lattice,
    pyramid::Level,
    sheet::{Cell, GUESS_REACH, Guess, STEPS, Sheet, add, guess, is_black},
    strip::{self, Fit, Start},
};
use crate::image::{Plane, Sample};

/// A fit may move a corner by this much of a cell from where the grid had it.
const MOVE: f64 = 0.3;
/// Largest distance from the place that the neighbours give, in cells.
const BESIDE: f64 = 0.12;
/// What a fit may leave, relative to what the fits of the board usually leave, and relative to half the contrast: more is left where
/// something lies over the edges.
const LEFT: f64 = 4.0;
const LEFT_OF_CONTRAST: f64 = 0.16;
/// Where the squares around a corner are looked at, in cells along both axes.
const LOOK: f64 = 0.25;
/// How much darker or brighter than the mean at their corner, in halves of the contrast, a square is at least, and the four are on
/// average. Where two squares end at a grey background, the average is 0.5.
const SQUARE: [f64; 2] = [-0.1, 0.6];
/// Nearest to the border of the picture that a corner is looked for, px.
const NEAREST: f64 = 3.0;
/// Smallest and largest ratio of a corner's contrast to that of its neighbours.
const CONTRAST: std::ops::RangeInclusive<f64> = 0.33..=3.0;
/// Share of a line at the rim that must be seen of what of it lies in the picture.
const SEEN: f64 = 0.4;
/// Share of the grid's corners that must stand the fit.
const STANDING: f64 = 0.6;

/// Corners of a grid with their fits.
pub(super) type Fitted = Sheet<Fit>;

/// Refines a grid in a picture of which `lattice` was found in `level`; with it, whether corners were dropped beyond its first
/// column, last column, first row, last row.
pub(super) fn complete<T: Sample>(
    picture: &Plane<T>,
    level: &Level<'_>,
    lattice: &Lattice,
) -> Option<(Fitted, [bool; 4])> {
    let mut cells = lattice.cells.clone();
    let whole = cells.iter().filter(|(cell, _)| stands_out(level, lattice, *cell)).count();
    if (whole as f64) < STANDING * cells.len() as f64 {
        return None;
    }
    if level.level >= 2 {
        // One pixel of the level is many of the picture: the fit in the level brings the start near enough.
        let near = fit(&level.picture, &cells);
        for (cell, f) in near.iter().filter(|(_, f)| f.ok) {
            cells.set(cell, f.px);
        }
    }
    let mut places = Sheet::new();
    for (cell, px) in cells.iter() {
        places.set(cell, level.to_picture(px));
    }
    let mut fitted = accepted(picture, &fit(picture, &places), &places);
    if (fitted.len() as f64) < STANDING * cells.len() as f64 {
        return None;
    }
    let mut added = false;
    while let Some(more) = grown(picture, &fitted) {
        fitted = more;
        added = true;
    }
    if added {
        let places = places_of(&fitted);
        fitted = accepted(picture, &fit(picture, &places), &places);
    }
    drop_strays(&mut fitted);
    let dropped = drop_thin_lines(&mut fitted, [picture.width(), picture.height()]);
    Some((fitted, dropped))
}

/// Whether in the level both white squares around a corner are brighter than both black ones: what costs little and tells
/// a board from texture.
fn stands_out(level: &Level<'_>, lattice: &Lattice, cell: Cell) -> bool {
    let Some((g, px)) = guess(&lattice.cells, cell, |p| p).zip(lattice.cells.get(cell)) else { return false };
    let at = |su: f64, sv: f64| {
        level_at(&*level.picture, px + g.uv[0] * (LOOK * su) + g.uv[1] * (LOOK * sv)).unwrap_or(f64::NAN)
    };
    let (along, across) = ([at(1.0, 1.0), at(-1.0, -1.0)], [at(1.0, -1.0), at(-1.0, 1.0)]);
    let (dark, bright) = if is_black(cell) { (along, across) } else { (across, along) };
    dark[0].max(dark[1]) < bright[0].min(bright[1])
}

fn places_of(fitted: &Fitted) -> Sheet<Vector2<f64>> {
    let mut places = Sheet::new();
    for (cell, f) in fitted.iter() {
        places.set(cell, f.px);
    }
    places
}

/// The strip fit of every cell.
fn fit<T: Sample>(picture: &Plane<T>, places: &Sheet<Vector2<f64>>) -> Fitted {
    fit_some(picture, places, &places.iter().map(|(cell, _)| cell).collect::<Vec<_>>(), true)
}

/// The strip fit of some cells, which may name their neighbours among themselves only.
fn fit_some<T: Sample>(
    picture: &Plane<T>,
    places: &Sheet<Vector2<f64>>,
    cells: &[Cell],
    board_terms: bool,
) -> Fitted {
    let mut number = Sheet::new();
    for (i, cell) in cells.iter().enumerate() {
        number.set(*cell, i as u32);
    }
    let starts: Vec<Start> = cells
        .iter()
        .filter_map(|cell| {
            let neighbours = STEPS.map(|step| number.get(add(*cell, step)));
            Some(Start { px: places.get(*cell)?, neighbours })
        })
        .collect();
    let options = strip::Options { board_terms, ..strip::Options::default() };
    let mut fitted = Sheet::new();
    if starts.len() == cells.len() {
        for (cell, f) in cells.iter().zip(strip::refine(picture, &starts, &options)) {
            fitted.set(*cell, f);
        }
    }
    fitted
}

/// Fits that are corners: they stayed where the grid had them, have the contrast of their neighbours, and four squares around
/// them.
fn accepted<T: Sample>(picture: &Plane<T>, fitted: &Fitted, places: &Sheet<Vector2<f64>>) -> Fitted {
    let mut kept = Sheet::new();
    let usual = usual_residual(fitted);
    for (cell, f) in fitted.iter().filter(|(_, f)| f.ok) {
        let Some((g, start)) = guess(places, cell, |p| p).zip(places.get(cell)) else { continue };
        let stayed = Guess { px: start, ..g }.off(f.px) < MOVE;
        let alike = contrast_beside(fitted, cell).is_none_or(|c| CONTRAST.contains(&(f.amplitude.abs() / c)));
        let explained = f.sigma_gray <= (LEFT * usual).max(LEFT_OF_CONTRAST * f.amplitude.abs());
        if stayed && alike && explained && has_squares(picture, &Guess { px: f.px, ..g }, &f, is_black(cell))
        {
            kept.set(cell, f);
        }
    }
    kept
}

/// Median of what the fits leave, in units of the samples.
fn usual_residual(fitted: &Fitted) -> f64 {
    let mut list: Vec<f64> = fitted.iter().filter(|(_, f)| f.ok).map(|(_, f)| f.sigma_gray).collect();
    list.sort_by(f64::total_cmp);
    list.get(list.len() / 2).copied().unwrap_or(0.0)
}

/// Median of half the contrast of a cell's fitted neighbours.
fn contrast_beside(fitted: &Fitted, cell: Cell) -> Option<f64> {
    let around = (-1..=1).flat_map(|r| (-1..=1).map(move |c| [c, r])).filter(|d| *d != [0, 0]);
    let mut list: Vec<f64> =
        around.filter_map(|d| fitted.get(add(cell, d)).filter(|f| f.ok).map(|f| f.amplitude.abs())).collect();
    list.sort_by(f64::total_cmp);
    list.get(list.len() / 2).copied()
}

/// Tries the empty cells around the grid; `None` where none is a corner.
fn grown<T: Sample>(picture: &Plane<T>, fitted: &Fitted) -> Option<Fitted> {
    let mut places = places_of(fitted);
    let mut tried = Vec::new();
    for cell in fitted.rim() {
        let Some(g) = guess(fitted, cell, |f| f.px) else { continue };
        let Some(like) = any_beside(fitted, cell) else { continue };
        if has_squares(picture, &g, &like, is_black(cell)) {
            places.set(cell, g.px);
            tried.push(cell);
        }
    }
    if tried.is_empty() {
        return None;
    }
    // The neighbours give the tried ones their directions.
    let mut cells = tried.clone();
    let mut listed = Sheet::new();
    tried.iter().for_each(|cell| listed.set(*cell, ()));
    for cell in &tried {
        for c in (-1..=1).flat_map(|r| (-1..=1).map(move |c| add(*cell, [c, r]))) {
            if places.get(c).is_some() && listed.get(c).is_none() {
                listed.set(c, ());
                cells.push(c);
            }
        }
    }
    let near = accepted(picture, &fit_some(picture, &places, &cells, false), &places);
    let mut more = fitted.clone();
    let mut found = false;
    for cell in tried {
        if let Some(f) = near.get(cell) {
            more.set(cell, f);
            found = true;
        }
    }
    found.then_some(more)
}

/// The fit of a neighbour.
fn any_beside(fitted: &Fitted, cell: Cell) -> Option<Fit> {
    STEPS.iter().find_map(|s| fitted.get(add(cell, *s)))
}

/// Whether there are four squares of the right colours around a place, by the levels of `like`. Beside the last row of a board two
/// of them are missing. Near the border of the picture they are looked at nearer to the corner; all must be seen.
fn has_squares<T: Sample>(picture: &Plane<T>, g: &Guess, like: &Fit, black: bool) -> bool {
    let size = [picture.width(), picture.height()].map(|s| s as f64);
    let mut sum = 0.0;
    for (su, sv) in [(1.0, 1.0), (-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0)] {
        let out = g.uv[0] * (LOOK * su) + g.uv[1] * (LOOK * sv);
        let room = |k: usize| if out[k] > 0.0 { size[k] - 2.0 - g.px[k] } else { g.px[k] - 1.0 };
        let part = (0..2).map(|k| room(k) / out[k].abs().max(1e-9)).fold(1.0, f64::min);
        if part < 1.0 && (0..2).any(|k| room(k) < NEAREST) {
            return false;
        }
        let Some(level) = level_at(picture, g.px + out * part) else { return false };
        let bright = (level - like.mean) / like.amplitude.abs();
        let right = if (su * sv > 0.0) == black { -bright } else { bright };
        if right < SQUARE[0] {
            return false;
        }
        sum += right.min(1.5);
    }
    sum > 4.0 * SQUARE[1]
}

/// Mean of 3 × 3 pixels; `None` outside the picture.
pub(super) fn level_at<T: Sample>(picture: &Plane<T>, at: Vector2<f64>) -> Option<f64> {
    let (x, y) = (at.x.round(), at.y.round());
    let (w, h) = (picture.width() as f64, picture.height() as f64);
    if !(x >= 1.0 && y >= 1.0 && x <= w - 2.0 && y <= h - 2.0) {
        return None;
    }
    let (x, y) = (x as usize, y as usize);
    let sum: f32 = (y - 1..=y + 1).flat_map(|j| &picture.row(j)[x - 1..=x + 1]).map(|v| v.to_f32()).sum();
    Some(f64::from(sum) / 9.0)
}

/// Drops corners that do not lie where their neighbours have them, the worst first.
fn drop_strays(fitted: &mut Fitted) {
    let mut off = Sheet::new();
    let measure = |fitted: &Fitted, off: &mut Sheet<f64>, cell: Cell| match off_place(fitted, cell) {
        Some(value) => off.set(cell, value),
        None => off.remove(cell),
    };
    for (cell, _) in fitted.iter() {
        measure(fitted, &mut off, cell);
    }
    while let Some((worst, _)) = off.iter().max_by(|a, b| a.1.total_cmp(&b.1)).filter(|(_, off)| *off > 1.0) {
        fitted.remove(worst);
        // Only what was guessed from the dropped one changes: a board of 40 000 corners must not be measured anew each time.
        let near = -GUESS_REACH..=GUESS_REACH;
        for cell in near.clone().flat_map(|r| near.clone().map(move |c| add(worst, [c, r]))) {
            measure(fitted, &mut off, cell);
        }
    }
    // What hangs on nothing has no certain place.
    let lone: Vec<Cell> =
        fitted.iter().map(|(cell, _)| cell).filter(|cell| guess(fitted, *cell, |f| f.px).is_none()).collect();
    for cell in lone {
        fitted.remove(cell);
    }
}

/// How far a corner lies from where its neighbours have it, as a share of what is allowed; `None` where they are too few.
fn off_place(fitted: &Fitted, cell: Cell) -> Option<f64> {
    let (f, g) = fitted.get(cell).zip(guess(fitted, cell, |f| f.px))?;
    // A cell at the rim is extrapolated: perspective and bend show there twice.
    let inner = STEPS.iter().all(|s| fitted.get(add(cell, *s)).is_some());
    Some(g.off(f.px) / if inner { BESIDE } else { 2.0 * BESIDE })
}

/// Drops lines at the rim of which little is seen although they lie in the picture: they may be chance. Tells at which sides.
fn drop_thin_lines(fitted: &mut Fitted, size: [usize; 2]) -> [bool; 4] {
    let mut dropped = [false; 4];
    while let Some(bounds) = fitted.bounds() {
        let thin = |side: &usize| is_thin(fitted, size, *side, bounds[side / 2][side % 2]);
        let Some(side) = (0..4).find(thin) else { break };
        let (k, at) = (side / 2, bounds[side / 2][side % 2]);
        let line: Vec<Cell> = fitted.iter().map(|(cell, _)| cell).filter(|c| c[k] == at).collect();
        for cell in line {
            fitted.remove(cell);
        }
        dropped[side] = true;
    }
    dropped
}

/// Whether little is seen of the outermost line `at` of a side. Only cells beside others of the grid are missed: where
/// something lies over the board, several lines end together.
fn is_thin(fitted: &Fitted, size: [usize; 2], side: usize, at: i32) -> bool {
    let (k, inward) = (side / 2, STEPS[side ^ 1]);
    let seen = fitted.iter().filter(|(cell, _)| cell[k] == at).count();
    let missing =
        fitted.rim().into_iter().filter(|cell| cell[k] == at && fitted.get(add(*cell, inward)).is_some());
    let inside =
        |g: &Guess| (0..2).all(|k| g.px[k] > 2.0 * NEAREST && g.px[k] < size[k] as f64 - 2.0 * NEAREST);
    let missing = missing.filter_map(|c| guess(fitted, c, |f| f.px)).filter(inside).count();
    (seen as f64) < SEEN * (seen + missing) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A board of corners 20 px apart.
    fn flat(columns: i32, rows: i32) -> Fitted {
        let mut fitted = Sheet::new();
        for cell in (0..rows).flat_map(|r| (0..columns).map(move |c| [c, r])) {
            let px = Vector2::from(cell.map(f64::from)) * 20.0;
            let (cov_px2, blur_px) = ([1e-4, 0.0, 1e-4], [1.0; 2]);
            let fit = Fit { px, cov_px2, blur_px, sigma_gray: 1.0, mean: 128.0, amplitude: 90.0, ok: true };
            fitted.set(cell, fit);
        }
        fitted
    }

    #[test]
    fn strays_go_one_by_one_and_the_rest_of_a_large_board_stays() {
        let board = flat(160, 160);
        let mut fitted = board.clone();
        let is_stray = |[c, r]: Cell| c % 4 == 1 && r % 4 == 2;
        for (cell, f) in board.iter().filter(|(cell, _)| is_stray(*cell)) {
            // Each by another amount, so that the order matters.
            let px = f.px + Vector2::new(8.0, f64::from(cell[0] - cell[1]) / 100.0);
            fitted.set(cell, Fit { px, ..f });
        }
        drop_strays(&mut fitted);
        let (kept, strays): (Vec<Cell>, Vec<Cell>) =
            board.iter().map(|(cell, _)| cell).partition(|cell| fitted.get(*cell).is_some());
        assert_eq!((kept.len(), strays.len()), (24_000, 1_600));
        assert!(strays.into_iter().all(is_stray));
    }
}
