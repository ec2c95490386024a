//! The order in which a picture is searched, and how a lattice of a level becomes dots of the picture.
//!
//! Spots are found where the picture has been halved to a few hundred thousand pixels, then in finer levels, then in coarser
//! ones; dots are fitted in the picture itself. Drop, never invent: what does not stand the fit, or does not lie with its
//! neighbours, goes; holes and rims are tried by prediction.

use std::borrow::Cow;

use nalgebra::Vector2;

use super::{
    Detection, Grid, GridDot,
    basis::{median, straighten},
    ellipse::{Dot, Start, fit, minor},
    lattice::Field,
    predict::predict,
    reason::{Searched, why},
    spot::{Spot, spots},
};
use crate::calib::{
    detect::{
        pyramid::{Level, eight_bits, halve, noise},
        sheet::{Cell, Guess, STEPS, Sheet, add},
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
/// Share of the spots of a lattice that must stand the fit.
const STANDING: f64 = 0.6;
/// Largest distance of a dot from where its neighbours have it, in cells; double at the rim, where perspective shows
/// twice, and three times that where only one neighbour is.
const BESIDE: f64 = 0.12;
/// Least median of how spots fill their ellipses: squares 0.955, by whatever perspective, discs 1.
const FILLED: f64 = 0.963;
/// Spots of a lattice that are fitted first.
const SAMPLE: usize = 12;
/// Smallest and largest ratio of a dot's area to that of its neighbours, largest difference of their shapes, and ratio of the
/// contrasts.
const SIZE: std::ops::RangeInclusive<f64> = 0.5..=2.0;
const SHAPE: f64 = 1.12;
const CONTRAST: std::ops::RangeInclusive<f64> = 0.5..=2.0;
/// What a fit may leave, relative to what the fits of the board usually leave and to the contrast.
const LEFT: [f64; 2] = [4.0, 0.2];
/// Radius of the dots over their spacing: thinner ones are specks, of larger ones checkerboards are made.
const RADIUS: std::ops::RangeInclusive<f64> = 0.08..=0.44;
/// Largest median amplitude of third and fourth harmonics of the outlines, in radii: squares have 0.1.
const ROUND: f64 = 0.045;

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

/// Fits the spots of a lattice in the picture and grows it there.
fn complete<T: Sample>(
    picture: &Plane<T>,
    level: &Level<'_>,
    lattice: &Sheet<Spot>,
    searched: &mut Searched,
) -> Option<Sheet<Dot>> {
    let scale = level.scale();
    let mut dots = Sheet::new();
    let dark = lattice.iter().next()?.1.dark;
    let try_one = |(cell, spot): (Cell, Spot)| {
        let start = Start {
            px: level.to_picture(spot.px),
            ellipse: spot.ellipse.map(|q| q * scale * scale),
            reach: reach(lattice, cell, |s| s.px, spot.ellipse),
            blur_px: None,
        };
        fit(picture, &start).filter(|d| (d.contrast() > 0.0) == dark)
    };
    // A few of them tell whether the others are worth their time.
    let every = lattice.len().div_ceil(SAMPLE);
    let tried = lattice.len().div_ceil(every);
    let (mut some, mut failed) = (Vec::with_capacity(tried), 0);
    for (cell, spot) in lattice.iter().step_by(every) {
        match try_one((cell, spot)) {
            Some(dot) => {
                some.push(dot.unevenness());
                dots.set(cell, dot);
            }
            None => failed += 1,
        }
        if f64::from(failed) > (1.0 - STANDING) * tried as f64 {
            return None;
        }
    }
    if median(some).is_none_or(|uneven| uneven > ROUND) {
        searched.uneven = true;
        return None;
    }
    for (_, one) in lattice.iter().enumerate().filter(|(i, _)| i % every != 0) {
        if let Some(dot) = try_one(one) {
            dots.set(one.0, dot);
        }
    }
    if (dots.len() as f64) < STANDING * lattice.len() as f64 {
        return None;
    }
    drop_unlike(&mut dots);
    drop_strays(&mut dots);
    while grown(picture, &mut dots) {}
    drop_unlike(&mut dots);
    drop_strays(&mut dots);
    Some(dots)
}

/// Half the way to the nearest neighbour's centre, in radii of the dot: up to there the picture is the dot's own.
fn reach<T: Copy>(sheet: &Sheet<T>, cell: Cell, px: impl Fn(T) -> Vector2<f64>, [a, b, c]: [f64; 3]) -> f64 {
    let radii =
        |d: Vector2<f64>| ((c * d.x * d.x - 2.0 * b * d.x * d.y + a * d.y * d.y) / (a * c - b * b)).sqrt();
    let Some(at) = sheet.get(cell).map(&px) else { return 1.6 };
    let around = (-1..=1).flat_map(|r| (-1..=1).map(move |c| [c, r])).filter(|d| *d != [0, 0]);
    let nearest =
        around.filter_map(|d| Some(radii(px(sheet.get(add(cell, d))?) - at))).fold(f64::MAX, f64::min);
    if nearest < f64::MAX { (0.5 * nearest).clamp(1.45, 4.0) } else { 1.6 }
}

/// Median of what fits leave, grey levels.
fn usual_residual(dots: &Sheet<Dot>) -> f64 {
    median(dots.iter().map(|(_, d)| d.sigma_gray).collect()).unwrap_or(0.0)
}

fn area(d: &Dot) -> f64 {
    let [a, b, c] = d.ellipse;
    (a * c - b * b).max(0.0).sqrt()
}

/// Median contrast of the dots around a cell.
fn contrast_beside(dots: &Sheet<Dot>, cell: Cell) -> Option<f64> {
    let cells = (-2..=2).flat_map(|r| (-2..=2).map(move |c| [c, r])).filter(|d| *d != [0, 0]);
    median(cells.filter_map(|d| dots.get(add(cell, d))).map(|d| d.contrast()).collect())
}

/// Whether a dot can be one of the board at a cell.
fn is_alike(dots: &Sheet<Dot>, cell: Cell, dot: &Dot, usual: f64) -> bool {
    let beside = contrast_beside(dots, cell).zip(shape_beside(dots, cell));
    let Some((contrast, ([a, b, c], _))) = beside else { return false };
    let size = (a * c - b * b).max(0.0).sqrt();
    let [d, e, f] = dot.ellipse;
    // (r + 1/r)/2 where one is r times as slim as the other.
    let shape = 0.5 * (c * d - 2.0 * b * e + a * f) / (size * area(dot));
    SIZE.contains(&(area(dot) / size))
        && shape < SHAPE
        && CONTRAST.contains(&(dot.contrast() / contrast))
        && dot.sigma_gray <= (LEFT[0] * usual).max(LEFT[1] * dot.contrast().abs())
}

fn drop_unlike(dots: &mut Sheet<Dot>) {
    let usual = usual_residual(dots);
    let unlike: Vec<Cell> =
        dots.iter().filter(|(cell, dot)| !is_alike(dots, *cell, dot, usual)).map(|(cell, _)| cell).collect();
    for cell in unlike {
        dots.remove(cell);
    }
}

/// Drops dots that do not lie where their neighbours have them, the worst first.
fn drop_strays(dots: &mut Sheet<Dot>) {
    let off = |dots: &Sheet<Dot>, cell: Cell| {
        let (d, g) = dots.get(cell).zip(predict(dots, cell, |d| d.px))?;
        let beside = STEPS.iter().filter(|s| dots.get(add(cell, **s)).is_some()).count();
        Some(g.off(d.px) / (BESIDE * [3.0, 3.0, 2.0, 2.0, 1.0][beside]))
    };
    loop {
        let all: Vec<(Cell, Option<f64>)> = dots.iter().map(|(cell, _)| (cell, off(dots, cell))).collect();
        // What hangs on nothing has no certain place.
        let lone: Vec<Cell> = all.iter().filter(|(_, off)| off.is_none()).map(|(cell, _)| *cell).collect();
        let mut wrong: Vec<(Cell, f64)> = all
            .into_iter()
            .filter_map(|(cell, off)| Some((cell, off?)))
            .filter(|(_, off)| *off > 1.0)
            .collect();
        wrong.sort_by(|a, b| b.1.total_cmp(&a.1));
        // Of wrong ones that see each other only the worst goes at once.
        let mut gone: Vec<Cell> = Vec::new();
        for (cell, _) in wrong {
            if gone.iter().all(|g| (0..2).any(|k| (g[k] - cell[k]).abs() > 3)) {
                gone.push(cell);
            }
        }
        if gone.is_empty() && lone.is_empty() {
            return;
        }
        for cell in gone.into_iter().chain(lone) {
            dots.remove(cell);
        }
    }
}

/// The ellipse and blur that the neighbours of a cell have on average.
fn shape_beside(dots: &Sheet<Dot>, cell: Cell) -> Option<([f64; 3], f64)> {
    let around = (-1..=1).flat_map(|r| (-1..=1).map(move |c| [c, r])).filter(|d| *d != [0, 0]);
    let around = around.filter_map(|d| dots.get(add(cell, d)));
    let (mut sum, mut n) = ([0.0; 4], 0.0);
    for d in around {
        let [a, b, c] = d.ellipse;
        for (s, v) in sum.iter_mut().zip([a, b, c, d.blur_px]) {
            *s += v;
        }
        n += 1.0;
    }
    (n > 0.0).then(|| ([sum[0] / n, sum[1] / n, sum[2] / n], sum[3] / n))
}

/// Tries the empty cells around the dots; whether any held a dot.
fn grown<T: Sample>(picture: &Plane<T>, dots: &mut Sheet<Dot>) -> bool {
    let usual = usual_residual(dots);
    let mut more = Vec::new();
    for cell in dots.rim() {
        let Some(g) = predict(dots, cell, |d| d.px) else { continue };
        let Some((ellipse, blur)) = shape_beside(dots, cell) else { continue };
        let Some(contrast) = contrast_beside(dots, cell) else { continue };
        let Some(look) = Patch::at(picture, g.px, ellipse) else { continue };
        if (look.ring - look.core) / contrast < 0.3 {
            continue;
        }
        let start = Start {
            px: g.px,
            ellipse,
            reach: 0.5 * radii(&g, ellipse).clamp(2.9, 8.0),
            blur_px: Some(blur.max(0.2 * minor(ellipse))),
        };
        let Some(dot) = fit(picture, &start) else { continue };
        if g.off(dot.px) < 2.0 * BESIDE && is_alike(dots, cell, &dot, usual) {
            more.push((cell, dot));
        }
    }
    let found = !more.is_empty();
    for (cell, dot) in more {
        dots.set(cell, dot);
    }
    found
}

/// The shorter step of a guess in radii of an ellipse.
fn radii(g: &Guess, [a, b, c]: [f64; 3]) -> f64 {
    let radii =
        |d: Vector2<f64>| ((c * d.x * d.x - 2.0 * b * d.x * d.y + a * d.y * d.y) / (a * c - b * b)).sqrt();
    radii(g.uv[0]).min(radii(g.uv[1]))
}

/// Grey levels at a place: within an ellipse, and around it.
struct Patch {
    core: f64,
    ring: f64,
    /// Range within both.
    range: f64,
}

impl Patch {
    /// `None` where it is not in the picture.
    fn at<T: Sample>(picture: &Plane<T>, px: Vector2<f64>, ellipse: [f64; 3]) -> Option<Self> {
        let [w11, w12, w22] = super::ellipse::root(ellipse)?;
        let size = [picture.width(), picture.height()].map(|s| s as f64);
        // Points of the unit circle go to the ellipse by W⁻¹.
        let at = |rho: f64, turn: f64| {
            let (s, c) = (turn * std::f64::consts::TAU).sin_cos();
            let y = rho * s / w22;
            let x = (rho * c - w12 * y) / w11;
            let p = px + Vector2::new(x, y);
            let inside = p.x >= 0.0 && p.y >= 0.0 && p.x <= size[0] - 1.0 && p.y <= size[1] - 1.0;
            inside.then(|| f64::from(picture.at((p.x + 0.5) as usize, (p.y + 0.5) as usize).to_f32()))
        };
        let mut values = Vec::with_capacity(37);
        values.push(at(0.0, 0.0)?);
        for rho in [0.3, 0.6, 1.35] {
            for k in 0..12 {
                values.push(at(rho, (f64::from(k) + rho) / 12.0)?);
            }
        }
        let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len().max(1) as f64;
        let (core, ring) = values.split_at(25);
        let (low, high) = values.iter().fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(*v), h.max(*v)));
        Some(Self { core: mean(core), ring: mean(ring), range: high - low })
    }
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
