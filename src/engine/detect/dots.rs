//! Dots on a checkerboard: squares with a disc of the other colour in their middle, as OpenCV's radon checkerboard has three. They
//! tell which part of the board a picture shows, and which way round.

use std::collections::BTreeMap;

use super::{Grid, GridCorner, complete::level_at};
use crate::{
    image::{Plane, Sample},
    order,
    target::BoardSize,
};

/// Where around the middle of a square its own colour is looked at, in squares: OpenCV's discs have a radius of 0.17.
const AROUND: [[f64; 2]; 4] = [[-0.32, 0.0], [0.32, 0.0], [0.0, -0.32], [0.0, 0.32]];
/// Share of the contrast by which a dot differs from its square, at least, and a square from its like, at most.
const DOT: f64 = 0.5;
const ALIKE: f64 = 0.3;
/// Smallest square, px: a dot has four pixels across.
const SMALLEST: f64 = 12.0;

/// Squares of a grid that bear a dot, by the cell of their first corner, by row, then column.
pub(super) fn dots<T: Sample>(picture: &Plane<T>, corners: &[GridCorner]) -> Vec<[u32; 2]> {
    let at = order::map(corners.iter().map(|c| (c.cell, c.px)));
    let mut squares = Vec::new();
    let (mut light, mut count) = ([0.0; 2], [0.0; 2]);
    for ([c, r], first) in &at {
        let others = [[c + 1, *r], [*c, r + 1], [c + 1, r + 1]].map(|cell| at.get(&cell));
        let [Some(right), Some(below), Some(across)] = others else { continue };
        if (across - first).norm().min((right - below).norm()) < SMALLEST {
            continue;
        }
        let level = |[x, y]: [f64; 2]| {
            let (u, v) = (0.5 + x, 0.5 + y);
            let px = first * ((1.0 - u) * (1.0 - v))
                + right * (u * (1.0 - v))
                + below * ((1.0 - u) * v)
                + across * (u * v);
            level_at(picture, px)
        };
        let (Some(middle), [Some(a), Some(b), Some(d), Some(e)]) = (level([0.0; 2]), AROUND.map(level))
        else {
            continue;
        };
        let around = (a + b + d + e) / 4.0;
        let colour = ((c + r) % 2) as usize;
        light[colour] += around;
        count[colour] += 1.0;
        squares.push(([*c, *r], colour, middle, around));
    }
    let own = [0, 1].map(|k| light[k] / count[k]);
    let is_dot = |(_, colour, middle, around): &([u32; 2], usize, f64, f64)| {
        let contrast = own[1 - colour] - own[*colour];
        (middle - around) / contrast > DOT && ((around - own[*colour]) / contrast).abs() < ALIKE
    };
    let mut dots: Vec<[u32; 2]> = squares.into_iter().filter(is_dot).map(|s| s.0).collect();
    order::by(&mut dots, |d| [d[1], d[0]].map(f64::from));
    dots
}

/// Squares of a board that bear a dot, by the column and row of their first corner, as the pictures show it that show the whole board;
/// none where most of these show none, or others. A board that looks the same in several orders has that of which the list comes first.
pub fn dots_of(grids: &[&Grid], size: BoardSize) -> Vec<[u32; 2]> {
    let mut votes = BTreeMap::<Vec<[u32; 2]>, usize>::new();
    let mut whole = 0;
    for grid in grids.iter().filter(|g| g.corners.len() == size.len()) {
        if let Some(dots) = grid.dots_on(size).into_iter().min() {
            *votes.entry(dots).or_default() += 1;
            whole += 1;
        }
    }
    let most = votes.into_iter().max_by_key(|(_, n)| *n);
    most.filter(|(_, n)| 2 * n > whole).map_or_else(Vec::new, |(dots, _)| dots)
}
