//! A lattice of a level fitted in the picture: dots that do not stand the fit, or do not lie with their neighbours, go; holes and
//! rims are tried by prediction. Drop, never invent.

use nalgebra::Vector2;

use super::{
    basis::median,
    ellipse::{Dot, Start, fit, minor, root},
    predict::predict,
    reason::Searched,
    search::ROUND,
    spot::Spot,
};
use crate::{
    detect::{
        pyramid::Level,
        sheet::{Cell, Guess, STEPS, Sheet, add},
    },
    image::{Plane, Sample},
    order,
};

/// Share of the spots of a lattice that must stand the fit.
const STANDING: f64 = 0.6;
/// Spots of a lattice that are fitted first.
const SAMPLE: usize = 12;
/// Largest distance of a dot from where its neighbours have it, in cells; double at the rim, where perspective shows
/// twice, and three times that where only one neighbour is.
const BESIDE: f64 = 0.12;
/// Smallest and largest ratio of a dot's area to that of its neighbours, largest difference of their shapes, and ratio of the
/// contrasts.
const SIZE: std::ops::RangeInclusive<f64> = 0.5..=2.0;
const SHAPE: f64 = 1.12;
const CONTRAST: std::ops::RangeInclusive<f64> = 0.5..=2.0;
/// What a fit may leave, relative to what the fits of the board usually leave and to the contrast.
const LEFT: [f64; 2] = [4.0, 0.2];

/// Fits the spots of a lattice in the picture and grows it there.
pub(super) fn complete<T: Sample>(
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
        order::by(&mut wrong, |w| [-w.1]);
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
pub(super) fn shape_beside(dots: &Sheet<Dot>, cell: Cell) -> Option<([f64; 3], f64)> {
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
pub(super) struct Patch {
    pub(super) core: f64,
    pub(super) ring: f64,
    /// Range within both.
    pub(super) range: f64,
}

impl Patch {
    /// `None` where it is not in the picture.
    pub(super) fn at<T: Sample>(picture: &Plane<T>, px: Vector2<f64>, ellipse: [f64; 3]) -> Option<Self> {
        let [w11, w12, w22] = root(ellipse)?;
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
