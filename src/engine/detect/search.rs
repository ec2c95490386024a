//! The order in which a picture is searched: where a board is found at once, and what is tried when it is not.

use std::borrow::Cow;

use nalgebra::Vector2;

use super::{
    Detection, Grid, GridCorner, Light, Refinement,
    complete::{Fitted, complete},
    dots::dots,
    ends::ends,
    gradient,
    grow::{Field, Lattice},
    pyramid::{Level, eight_bits, halve, is_peppered, median, noise},
    reason::{Searched, why},
    response::{RING, Ring, SMALL_RING},
    sheet::{STEPS, Sheet, add, is_black},
    strip::{Fit, Start},
};
use crate::image::{Gray, Plane, Sample};

/// Fewest corners of a grid, in at least [`FEWEST_LINES`] columns and rows.
pub(super) const FEWEST: usize = 12;
const FEWEST_LINES: i32 = 3;
/// Fewest pixels of the level that is searched first, and most of any level that is searched.
const LEVEL_PIXELS: [usize; 2] = [150_000, 1_300_000];
/// Fewest pixels of a level that is worth a look.
const SMALLEST: usize = 4_000;
/// Distance of corners in a level below which the next finer level may see more, px.
const CROWDED: f64 = 9.0;

/// Searches a picture; `gray` is the same picture.
pub(super) fn search<T: Sample>(picture: &Plane<T>, gray: &Gray, refinement: Refinement) -> Detection {
    let first = Level { level: 0, picture: eight_bits(gray) };
    let mut levels = vec![first];
    while let Some(last) = levels.last()
        && last.picture.data().len() / 4 >= SMALLEST
    {
        let half = halve(&last.picture);
        levels.push(Level { level: last.level + 1, picture: Cow::Owned(half) });
    }
    let pixels = |i: usize| levels[i].picture.data().len();
    let start = (0..levels.len()).rev().find(|i| pixels(*i) >= LEVEL_PIXELS[0]).unwrap_or(0);
    let finest = (0..levels.len()).find(|i| pixels(*i) <= LEVEL_PIXELS[1]).unwrap_or(0);

    let mut searched = Searched::default();
    let mut look = |level: &Level<'_>, ring: &'static Ring| -> Option<Found> {
        let mut field = Field::new(&level.picture, ring, noise(&level.picture));
        searched.saddles = searched.saddles.max(field.len());
        let (lattice, next) = field.largest(FEWEST / 2, FEWEST)?;
        let (fitted, goes_on) = complete(picture, level, &lattice)?;
        searched.corners = searched.corners.max(fitted.len());
        if !is_board(&fitted) {
            return None;
        }
        let next = next.and_then(|lattice| complete(picture, level, &lattice));
        let passed_over = next.filter(|(other, _)| is_board(other) && apart(other, &fitted)).is_some();
        Some(Found { spacing: spacing(&lattice), fitted, goes_on, passed_over })
    };
    // From the start to finer levels, then to coarser ones, which see through blur and noise.
    let order = (finest..=start).rev().chain(start + 1..levels.len());
    let mut best: Option<Found> = None;
    for i in order {
        let found = look(&levels[i], &RING);
        let crowded = found.as_ref().is_some_and(|f| f.spacing < CROWDED && i > finest && i <= start);
        best = larger(best, found);
        if best.is_some() && !crowded {
            break;
        }
    }
    if best.is_none() {
        best = look(&levels[finest], &SMALL_RING);
    }
    if best.is_none() && is_peppered(&levels[finest].picture) {
        let clean =
            Level { level: levels[finest].level, picture: Cow::Owned(median(&levels[finest].picture)) };
        best = look(&clean, &RING);
    }
    match best {
        Some(found) => {
            let grid = Some(found.grid(picture, refinement));
            let light = found.light::<T>();
            Detection { grid, why: String::new(), passed_over: found.passed_over, light }
        }
        None => Detection { grid: None, why: why(&levels, &searched), passed_over: false, light: None },
    }
}

/// A grid that was found and refined.
struct Found {
    fitted: Fitted,
    /// Whether something was seen of the board beyond the first column, last column, first row, last row.
    goes_on: [bool; 4],
    /// Median distance of neighbours in the level, px.
    spacing: f64,
    /// Whether another board with fewer corners was seen.
    passed_over: bool,
}

fn larger(a: Option<Found>, b: Option<Found>) -> Option<Found> {
    match (a, b) {
        (Some(a), Some(b)) => Some(if b.fitted.len() > a.fitted.len() { b } else { a }),
        (a, b) => a.or(b),
    }
}

/// Whether no corner of one is a corner of the other: what grew twice from one board is one.
fn apart(a: &Fitted, b: &Fitted) -> bool {
    /// Squared, px².
    const NEAR: f64 = 9.0;
    a.iter().all(|(_, p)| b.iter().all(|(_, q)| (p.px - q.px).norm_squared() > NEAR))
}

/// Enough corners in enough lines.
fn is_board<T: Copy>(cells: &Sheet<T>) -> bool {
    cells.len() >= FEWEST
        && cells.bounds().is_some_and(|b| b.iter().all(|[first, last]| last - first + 1 >= FEWEST_LINES))
}

fn spacing(lattice: &Lattice) -> f64 {
    let cells = &lattice.cells;
    let step = |cell, px: Vector2<f64>, s| Some((cells.get(add(cell, s))? - px).norm());
    let mut list: Vec<f64> = cells
        .iter()
        .flat_map(|(cell, px)| [step(cell, px, STEPS[1]), step(cell, px, STEPS[3])].into_iter().flatten())
        .collect();
    list.sort_by(f64::total_cmp);
    list.get(list.len() / 2).copied().unwrap_or(0.0)
}

impl Found {
    fn light<T: Sample>(&self) -> Option<Light> {
        let to_8_bits = 255.0 / f64::from(T::MAX);
        let middle = |of: &dyn Fn(&Fit) -> f64| {
            let mut all: Vec<f64> = self.fitted.iter().map(|(_, fit)| of(&fit)).collect();
            all.sort_by(f64::total_cmp);
            all.get(all.len() / 2).copied()
        };
        Some(Light {
            black: to_8_bits * middle(&|f| f.mean - f.amplitude.abs())?,
            white: to_8_bits * middle(&|f| f.mean + f.amplitude.abs())?,
            blur_px: middle(&|f| 0.5 * (f.blur_px[0] + f.blur_px[1]))?,
            noise: to_8_bits * middle(&|f| f.sigma_gray)?,
        })
    }

    /// The grid as others see it, first row uppermost, columns from left to right.
    fn grid<T: Sample>(&self, picture: &Plane<T>, refinement: Refinement) -> Grid {
        let [[c0, c1], [r0, r1]] = self.fitted.bounds().unwrap_or_default();
        let mut corners: Vec<GridCorner> = self
            .fitted
            .iter()
            .map(|(cell, f)| GridCorner {
                cell: [(cell[0] - c0) as u32, (cell[1] - r0) as u32],
                px: f.px,
                sigma_px: f.sigma_px(),
            })
            .collect();
        refine_again(picture, &self.fitted, refinement, &mut corners);
        let dots = dots(picture, &corners);
        let grid = Grid {
            size: [(c1 - c0 + 1) as u32, (r1 - r0 + 1) as u32],
            corners,
            black_first: is_black([c0, r0]),
            ends: ends(picture, &self.fitted, self.goes_on),
            dots,
        };
        grid.upright()
    }
}

/// The ablations: corners refined another way, from whole pixels as other detectors give them.
fn refine_again<T: Sample>(
    picture: &Plane<T>,
    fitted: &Fitted,
    refinement: Refinement,
    corners: &mut [GridCorner],
) {
    let window = match refinement {
        Refinement::Strip => return,
        Refinement::Off => {
            for corner in corners {
                corner.px = corner.px.map(f64::round);
            }
            return;
        }
        Refinement::Gradient(window) => window,
    };
    let mut number = Sheet::new();
    for (i, (cell, _)) in fitted.iter().enumerate() {
        number.set(cell, i as u32);
    }
    let starts: Vec<Start> = fitted
        .iter()
        .map(|(cell, f)| Start {
            px: f.px.map(f64::round),
            neighbours: STEPS.map(|s| number.get(add(cell, s))),
        })
        .collect();
    for (corner, px) in corners.iter_mut().zip(gradient::refine(picture, &starts, window)) {
        corner.px = px;
    }
}
