//! Places that may be crossings and their neighbours: what the strip fit wants to know of a grid that need not be regular.

use std::collections::VecDeque;

use nalgebra::Vector2;

use super::crossings::Place;
use crate::{
    detect::strip::{self, Arms, Fit, Start, refine_with},
    image::{Plane, Sample},
};

/// Largest sine between an edge and the step to a neighbour.
const ALONG: f64 = 0.25;

/// Places with the same names for the same directions, and their neighbours.
pub(super) struct Links {
    /// Unit vectors towards +column and +row.
    uv: Vec<[Vector2<f64>; 2]>,
    neighbours: Vec<[Option<u32>; 4]>,
}

impl Links {
    pub(super) fn of(places: &[Place]) -> Self {
        let n = places.len();
        // The nearest in each of four directions: against and along both axes.
        let near: Vec<[Option<usize>; 4]> = (0..n).map(|i| nearest(places, i)).collect();
        let mut uv: Vec<Option<[Vector2<f64>; 2]>> = vec![None; n];
        for seed in 0..n {
            if uv[seed].is_some() {
                continue;
            }
            uv[seed] = Some(places[seed].axes);
            let mut queue = VecDeque::from([seed]);
            while let Some(i) = queue.pop_front() {
                let Some(own) = uv[i] else { continue };
                for j in near[i].into_iter().flatten() {
                    if uv[j].is_none() {
                        uv[j] = Some(named(&places[j].axes, own));
                        queue.push_back(j);
                    }
                }
            }
        }
        let uv: Vec<[Vector2<f64>; 2]> =
            uv.into_iter().zip(places).map(|(a, p)| a.unwrap_or(p.axes)).collect();
        let side = |i: usize, j: usize| {
            let step = places[j].px - places[i].px;
            let k = usize::from(step.dot(&uv[i][1]).abs() > step.dot(&uv[i][0]).abs());
            2 * k + usize::from(step.dot(&uv[i][k]) > 0.0)
        };
        let mut neighbours = vec![[None; 4]; n];
        for i in 0..n {
            for j in near[i].into_iter().flatten() {
                if near[j].contains(&Some(i)) && side(j, i) == side(i, j) ^ 1 {
                    neighbours[i][side(i, j)] = Some(j as u32);
                }
            }
        }
        Self { uv, neighbours }
    }

    /// Lengths of the edges of a place against and along both directions, px.
    fn rooms(&self, i: usize, places: &[Place]) -> [[f64; 2]; 2] {
        let p = &places[i];
        [0, 1].map(|k| {
            let by_mark = p.room.map(|room| {
                let m =
                    usize::from(p.axes[1].dot(&self.uv[i][k]).abs() > p.axes[0].dot(&self.uv[i][k]).abs());
                let mut r = room[m];
                if p.axes[m].dot(&self.uv[i][k]) < 0.0 {
                    r.reverse();
                }
                r
            });
            let linked = [2 * k, 2 * k + 1]
                .map(|s| self.neighbours[i][s].map(|j| (places[j as usize].px - p.px).norm()));
            let other = |s: usize| linked[1 - s].map_or(0.5 * p.side, |d| d.min(p.side) * 0.6);
            [0, 1].map(|s| linked[s].or(by_mark.map(|r| r[s])).unwrap_or_else(|| other(s)))
        })
    }

    /// The shortest of them, px.
    pub(super) fn shortest(&self, i: usize, places: &[Place]) -> f64 {
        self.rooms(i, places).into_iter().flatten().fold(f64::INFINITY, f64::min)
    }

    /// Fits all places; `board_terms`: with the curvature and the gradients that their neighbours show.
    pub(super) fn fit<T: Sample>(&self, picture: &Plane<T>, places: &[Place], board_terms: bool) -> Vec<Fit> {
        let starts: Vec<Start> =
            places.iter().zip(&self.neighbours).map(|(p, n)| Start { px: p.px, neighbours: *n }).collect();
        let arms: Vec<Option<Arms>> = (0..places.len())
            .map(|i| {
                let steps = [0, 1].map(|k| {
                    let end = |s: usize| self.neighbours[i][s].map(|j| places[j as usize].px);
                    match (end(2 * k), end(2 * k + 1)) {
                        (Some(a), Some(b)) => b - a,
                        (Some(a), None) => places[i].px - a,
                        (None, Some(b)) => b - places[i].px,
                        (None, None) => self.uv[i][k] * 10.0,
                    }
                });
                Some(Arms { along: steps, room_px: self.rooms(i, places), clear_px: places[i].clear })
            })
            .collect();
        let options = strip::Options { board_terms, ..strip::Options::default() };
        refine_with(picture, &starts, &arms, &options)
    }
}

/// The axes in the order and with the signs that lie nearest to `like`.
fn named(axes: &[Vector2<f64>; 2], like: [Vector2<f64>; 2]) -> [Vector2<f64>; 2] {
    let fit = |a: Vector2<f64>, b: Vector2<f64>| a.dot(&like[0]).abs() + b.dot(&like[1]).abs();
    let [a, b] = if fit(axes[0], axes[1]) >= fit(axes[1], axes[0]) { *axes } else { [axes[1], axes[0]] };
    [a * a.dot(&like[0]).signum(), b * b.dot(&like[1]).signum()]
}

/// The nearest place against and along both axes of place `i` whose edges lie on the same lines and whose colours are the other
/// way round.
fn nearest(places: &[Place], i: usize) -> [Option<usize>; 4] {
    let p = &places[i];
    let farthest = 2.6 * p.side;
    let mut best: [(f64, Option<usize>); 4] = [(farthest, None); 4];
    for (j, q) in places.iter().enumerate() {
        let step = q.px - p.px;
        let distance = step.norm();
        if distance >= farthest || distance < 3.0 {
            continue;
        }
        for k in 0..2 {
            let on_line = p.axes[k].perp(&step).abs() < ALONG * distance;
            let its = q.axes.iter().map(|a| a.perp(&step).abs() / distance).fold(1.0, f64::min);
            let side = 2 * k + usize::from(step.dot(&p.axes[k]) > 0.0);
            if on_line
                && its < 1.5 * ALONG
                && p.black().dot(&q.black()).abs() < 0.65
                && distance < best[side].0
            {
                best[side] = (distance, Some(j));
            }
        }
    }
    best.map(|b| b.1)
}
