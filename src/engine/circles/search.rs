//! The order in which a picture is searched, and how a lattice of a level becomes dots of the picture.
//!
//! Spots are found where the picture has been halved to a few hundred thousand pixels, then in finer levels, then in coarser
//! ones; dots are fitted in the picture itself ([`complete`]).

use std::borrow::Cow;

use nalgebra::Vector2;

use super::{
    Detection, Grid, GridDot,
    basis::{median, straighten},
    complete::{Patch, complete, shape_beside},
    ellipse::Dot,
    lattice::Field,
    predict::predict,
    reason::{Searched, why},
    spot::{Spot, spots},
};
use crate::{
    detect::{
        pyramid::{Level, eight_bits, halve, noise},
        sheet::{Cell, STEPS, Sheet, add},
    },
    image::{Gray, Plane, Sample},
};

/// Fewest dots of a lattice, in at least [`FEWEST_LINES`] columns and rows.
pub(super) const FEWEST: usize = 12;
const FEWEST_LINES: i32 = 3;
/// Fewest dots from which a lattice is worth a fit.
const FEWEST_SPOTS: usize = 8;
/// Lattices of a level that are fitted at most.
const MOST_LATTICES: usize = 4;
/// Fewest pixels of the level that is searched first.
const FIRST_LEVEL: usize = 150_000;
/// Fewest pixels of a level that is worth a look.
const SMALLEST: usize = 2_000;
/// Distance of dots in a level below which the next finer level may see more, px.
const CROWDED: f64 = 9.0;
/// Diameter of dots in a level above which the next coarser level may see more, px.
const WIDE: f64 = 28.0;
/// Least median of how spots fill their ellipses: squares 0.955, by whatever perspective, discs 1.
const FILLED: f64 = 0.963;
/// Radius of the dots over their spacing: thinner ones are specks, of larger ones checkerboards are made.
const RADIUS: std::ops::RangeInclusive<f64> = 0.08..=0.44;
/// Largest median amplitude of third and fourth harmonics of the outlines, in radii: squares have 0.1.
pub(super) const ROUND: f64 = 0.045;

/// Searches a picture; `gray` is the same picture.
pub(super) fn search<T: Sample>(picture: &Plane<T>, gray: &Gray) -> Detection {
    let mut levels = vec![Level { level: 0, picture: eight_bits(gray) }];
    while let Some(last) = levels.last()
        && last.picture.data().len() / 4 >= SMALLEST
    {
        let half = halve(&last.picture);
        levels.push(Level { level: last.level + 1, picture: Cow::Owned(half) });
    }
    let pixels = |i: usize| levels[i].picture.data().len();
    let start = (0..levels.len()).rev().find(|i| pixels(*i) >= FIRST_LEVEL).unwrap_or(0);
    let mut searched = Searched::default();
    let mut best: Option<Found> = None;
    for i in (0..=start).rev().chain(start + 1..levels.len()) {
        let found = look(picture, &levels[i], &mut searched);
        let crowded = found.as_ref().is_some_and(|f| f.spacing < CROWDED && i > 0 && i <= start);
        // Where some dots are nearly too wide for the level, others are.
        let roomy = found.as_ref().is_some_and(|f| f.widest > WIDE * levels[i].scale());
        best = larger(best, found);
        if roomy && let Some(coarser) = levels.get(i + 1) {
            best = larger(best, look(picture, coarser, &mut searched));
        }
        if best.is_some() && !crowded {
            break;
        }
    }
    match best {
        Some(found) => Detection { grid: Some(found.grid(picture)), why: String::new() },
        None => Detection { grid: None, why: why(&levels[0].picture, &searched) },
    }
}

/// The largest board of a level.
fn look<T: Sample>(picture: &Plane<T>, level: &Level<'_>, searched: &mut Searched) -> Option<Found> {
    let least = f64::from(2.5 * noise(&level.picture)).clamp(2.0, 40.0);
    let field = Field::new(spots(&level.picture, least), [level.picture.width(), level.picture.height()]);
    searched.spots = searched.spots.max(field.len());
    let mut best: Option<Found> = None;
    for lattice in field.lattices(FEWEST_SPOTS).into_iter().take(MOST_LATTICES) {
        let filled = median(lattice.iter().map(|(_, s)| s.filled).collect()).unwrap_or(0.0);
        if filled < FILLED {
            searched.uneven = true;
            continue;
        }
        if best.as_ref().is_some_and(|b| b.dots.len() >= 2 * lattice.len()) {
            break;
        }
        let spacing = spacing(&lattice);
        let found = complete(picture, level, &lattice, searched).and_then(|dots| {
            searched.dots = searched.dots.max(dots.len());
            board(&dots, spacing, searched)
        });
        best = larger(best, found);
    }
    best
}

/// A lattice that was found and fitted.
struct Found {
    dots: Sheet<Dot>,
    /// Radius over spacing.
    radius: f64,
    /// Median distance of neighbours in the level, px.
    spacing: f64,
    /// Largest extent of a dot, px.
    widest: f64,
}

fn larger(a: Option<Found>, b: Option<Found>) -> Option<Found> {
    match (a, b) {
        (Some(a), Some(b)) => Some(if b.dots.len() > a.dots.len() { b } else { a }),
        (a, b) => a.or(b),
    }
}

fn spacing(lattice: &Sheet<Spot>) -> f64 {
    let step = |cell, px: Vector2<f64>, s| Some((lattice.get(add(cell, s))?.px - px).norm());
    let all = lattice.iter().flat_map(|(cell, p)| [step(cell, p.px, STEPS[1]), step(cell, p.px, STEPS[3])]);
    median(all.flatten().collect()).unwrap_or(0.0)
}

/// Whether dots are a board: enough of them in enough lines, square, round.
fn board(dots: &Sheet<Dot>, spacing: f64, searched: &mut Searched) -> Option<Found> {
    let (dots, shape) = straighten(dots)?;
    let lines = dots.bounds().is_some_and(|b| b.iter().all(|[first, last]| last - first + 1 >= FEWEST_LINES));
    if dots.len() < FEWEST || !lines {
        return None;
    }
    let harmonics = median(dots.iter().map(|(_, d)| d.unevenness()).collect())?;
    searched.uneven |= harmonics > ROUND;
    let radius = 1.0 / shape.spacing;
    searched.skewed |= !shape.is_square || !RADIUS.contains(&radius);
    let widest = dots.iter().map(|(_, d)| 2.0 * d.ellipse[0].max(d.ellipse[2]).sqrt()).fold(0.0, f64::max);
    let is_board = shape.is_square && RADIUS.contains(&radius) && harmonics <= ROUND;
    is_board.then_some(Found { dots, radius, spacing, widest })
}

impl Found {
    /// The lattice as others see it, columns from left to right.
    fn grid<T: Sample>(&self, picture: &Plane<T>) -> Grid {
        let [[c0, c1], [r0, r1]] = self.dots.bounds().unwrap_or_default();
        let dots = self.dots.iter().map(|(cell, d)| GridDot {
            cell: [(cell[0] - c0) as u32, (cell[1] - r0) as u32],
            px: d.px,
            sigma_px: d.sigma_px(),
            ellipse: d.ellipse,
        });
        let blanks = self.dots.rim().into_iter().filter(|cell| self.is_blank(picture, *cell));
        let grid = Grid {
            size: [(c1 - c0 + 1) as u32, (r1 - r0 + 1) as u32],
            dots: dots.collect(),
            blanks: blanks.map(|[c, r]| [c - c0, r - r0]).collect(),
            dark: self.dots.iter().next().is_some_and(|(_, d)| d.contrast() > 0.0),
            radius: self.radius,
        };
        grid.upright()
    }

    /// Whether an empty cell shows nothing but what lies between the dots.
    fn is_blank<T: Sample>(&self, picture: &Plane<T>, cell: Cell) -> bool {
        const FLAT: f64 = 0.35;
        let blank = || {
            let g = predict(&self.dots, cell, |d| d.px)?;
            let (ellipse, _) = shape_beside(&self.dots, cell)?;
            let look = Patch::at(picture, g.px, ellipse)?;
            let around = (-1..=1).flat_map(|r| (-1..=1).map(move |c| [c, r]));
            let near: Vec<Dot> = around.filter_map(|d| self.dots.get(add(cell, d))).collect();
            let mean = |f: fn(&Dot) -> f64| near.iter().map(f).sum::<f64>() / near.len().max(1) as f64;
            let (outer, contrast, noise) =
                (mean(|d| d.levels[1]), mean(Dot::contrast), mean(|d| d.sigma_gray));
            let limit = FLAT * contrast.abs();
            Some((look.core - outer).abs() < limit && look.range < limit.max(6.0 * noise))
        };
        blank().unwrap_or(false)
    }
}
