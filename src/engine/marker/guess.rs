//! Kind, dictionary and size of a board from what a set of pictures shows.
//!
//! The dictionary is the one that names most marks. Each recognised marker is a small frame in which its neighbours stand at whole
//! multiples of a step, along its sides on a grid, along its diagonals on a ChArUco board; how ids change from step to step
//! gives the number of columns and the layout, the largest id the number of rows. Where nothing decides, what was considered is said.

use nalgebra::{Vector2, Vector3};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

use super::{
    Sighting,
    board::{AprilGrid, ArucoGrid, Charuco, MarkerBoard},
    dictionary::Dictionary,
    outline::square_to,
};
use crate::order;

/// Fewest recognised markers, and fewest steps between neighbours.
const FEWEST: (usize, usize) = (4, 3);
/// Farthest neighbour, in sides.
const FARTHEST: f64 = 4.2;
/// How far a neighbour may lie off a whole number of steps.
const OFF: f64 = 0.25;
/// Share of the votes that the winner has at least to be certain.
const CLEAR: f64 = 0.8;

/// A board that was guessed. Lengths are in markers (AprilGrid, ArUco grid) or squares (ChArUco).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Guess {
    /// The board; `None` where there is too little to say.
    pub board: Option<MarkerBoard>,
    /// Whether nothing else comes near.
    pub certain: bool,
    /// What else was considered, and what was assumed, in words.
    pub considered: Vec<String>,
}

/// A recognised marker: its picture, its id, and its corners in the order of the code.
struct Named {
    picture: usize,
    id: u32,
    corners: [Vector2<f64>; 4],
    center: Vector2<f64>,
    side: f64,
}

/// From one marker to another of the same picture, in sides of the first, x and y as its code.
struct Step {
    from: u32,
    to: u32,
    by: Vector2<f64>,
}

/// Guesses the board of a set of pictures.
pub fn guess(sightings: &[Sighting]) -> Guess {
    let mut considered = Vec::new();
    let Some((family, border, marks)) = dictionary(sightings, &mut considered) else {
        considered.push(format!(
            "{} pictures show no {} markers of one dictionary",
            sightings.len(),
            FEWEST.0
        ));
        return Guess { board: None, certain: false, considered };
    };
    let steps = steps(&marks);
    let Some((diagonal, step)) = lattice(&marks, &steps) else {
        considered.push("the markers have no neighbours to tell the board from".to_owned());
        return Guess { board: None, certain: false, considered };
    };
    let found = if diagonal {
        charuco(&steps, step, family, border, &mut considered)
    } else {
        grid(sightings, &marks, &steps, step, family, border, &mut considered)
    };
    match found {
        Some((board, certain)) => Guess { board: Some(board), certain, considered },
        None => Guess { board: None, certain: false, considered },
    }
}

/// The family and border that name most marks, and those marks.
fn dictionary(sightings: &[Sighting], considered: &mut Vec<String>) -> Option<(Dictionary, u8, Vec<Named>)> {
    let mut best: Option<(Dictionary, u8, Vec<Named>)> = None;
    let mut counts = Vec::new();
    for family in Dictionary::families() {
        for border in 1..=2 {
            let marks = named(sightings, family, border);
            if !marks.is_empty() {
                counts.push((marks.len(), family, border));
            }
            if best.as_ref().is_none_or(|b| marks.len() > b.2.len()) {
                best = Some((family, border, marks));
            }
        }
    }
    let best = best.filter(|b| b.2.len() >= FEWEST.0)?;
    order::by(&mut counts, |c| [-(c.0 as f64)]);
    for (n, family, border) in counts.iter().skip(1).take(2).filter(|c| 5 * c.0 >= best.2.len()) {
        considered.push(format!(
            "{family} with a border of {border} names {n} of the marks, {} names {}",
            best.0,
            best.2.len()
        ));
    }
    Some(best)
}

fn named(sightings: &[Sighting], dictionary: Dictionary, border: u8) -> Vec<Named> {
    let mut list = Vec::new();
    for (picture, sighting) in sightings.iter().enumerate() {
        for mark in &sighting.marks {
            let ids = mark
                .readings
                .iter()
                .filter(|r| r.border == border)
                .filter_map(|r| dictionary.identify(r.bits));
            let Some(found) = ids.min_by_key(|i| i.errors) else { continue };
            let corners = [0, 1, 2, 3].map(|k| mark.corners[(usize::from(found.turns) + k) % 4]);
            list.push(Named { picture, id: found.id, corners, center: mark.center(), side: mark.side_px() });
        }
    }
    list
}

/// The smallest dictionary of a family that has an id.
fn smallest(family: Dictionary, largest: u32, considered: &mut Vec<String>) -> Dictionary {
    let has_all = |d: &Dictionary| d.is_kin_of(family) && d.len() > largest;
    let found = Dictionary::all().filter(has_all).min_by_key(|d| d.len()).unwrap_or(family);
    if found != family {
        considered
            .push(format!("{found}: the smallest dictionary of its family that has all ids up to {largest}"));
    }
    found
}

/// Column and row of a marker on a ChArUco board of so many columns.
fn square_of(id: u32, columns: u32, legacy: bool) -> [i64; 2] {
    let (pair, rest) = (id / columns, id % columns);
    let first = (columns + u32::from(legacy)) / 2;
    let (row, column) = if rest < first {
        (2 * pair, 2 * rest + u32::from(!legacy))
    } else {
        (2 * pair + 1, 2 * (rest - first) + u32::from(legacy))
    };
    [column, row].map(i64::from)
}

fn steps(marks: &[Named]) -> Vec<Step> {
    let mut list = Vec::new();
    for a in marks {
        let Some(square_from_picture) = square_to(&a.corners).and_then(|h| h.try_inverse()) else { continue };
        let near = |b: &&Named| {
            b.picture == a.picture && b.id != a.id && (b.center - a.center).norm() < 1.5 * FARTHEST * a.side
        };
        for b in marks.iter().filter(near) {
            let q = square_from_picture * Vector3::new(b.center.x, b.center.y, 1.0);
            let by = Vector2::new(q.x / q.z - 0.5, q.y / q.z - 0.5);
            if by.norm() < FARTHEST {
                list.push(Step { from: a.id, to: b.id, by });
            }
        }
    }
    list
}

/// Whether nearest neighbours stand along the diagonals, and the step along each axis, in sides.
fn lattice(marks: &[Named], steps: &[Step]) -> Option<(bool, f64)> {
    if steps.len() < FEWEST.1 || marks.len() < FEWEST.0 {
        return None;
    }
    let shortest = steps.iter().map(|s| s.by.norm()).fold(f64::INFINITY, f64::min);
    // Perspective shrinks steps by less than a third; the next longer ones are 1.41 times as long.
    let mut nearest: Vec<&Step> = steps.iter().filter(|s| s.by.norm() < 1.3 * shortest.max(1.0)).collect();
    if nearest.len() < FEWEST.1 {
        nearest = steps.iter().collect();
    }
    let is_diagonal = |s: &&&Step| s.by.x.abs().min(s.by.y.abs()) > 0.5 * s.by.x.abs().max(s.by.y.abs());
    let diagonal = 2 * nearest.iter().filter(is_diagonal).count() > nearest.len();
    let lengths = nearest.iter().filter(|s| is_diagonal(s) == diagonal).map(|s| {
        let v = s.by.abs();
        if diagonal { 0.5 * (v.x + v.y) } else { v.x.max(v.y) }
    });
    let mut lengths: Vec<f64> = lengths.collect();
    lengths.sort_by(f64::total_cmp);
    lengths.get(lengths.len() / 2).map(|l| (diagonal, *l))
}

/// Steps as whole numbers.
fn whole(steps: &[Step], step: f64) -> impl Iterator<Item = (&Step, [i32; 2])> {
    steps.iter().filter_map(move |s| {
        let v = s.by / step;
        let near = v.map(f64::round);
        // What is far is less exact: perspective and bend.
        ((v - near).amax() < OFF).then_some((s, [near.x as i32, near.y as i32]))
    })
}

/// The most frequent value and its share; the smaller of equal ones.
fn most(values: impl Iterator<Item = i64>) -> Option<(i64, f64)> {
    let mut counts: BTreeMap<i64, usize> = BTreeMap::new();
    values.for_each(|v| *counts.entry(v).or_default() += 1);
    let total: usize = counts.values().sum();
    let best = counts.iter().max_by(|a, b| a.1.cmp(b.1).then(b.0.cmp(a.0)))?;
    Some((*best.0, *best.1 as f64 / total as f64))
}

/// How ids change along a step `[i, j]` and its reverse.
fn change(steps: &[Step], step: f64, along: [i32; 2]) -> Option<(i64, f64)> {
    most(whole(steps, step).filter_map(|(s, v)| {
        let by = i64::from(s.to) - i64::from(s.from);
        if v == along {
            Some(by)
        } else if v == along.map(|n| -n) {
            Some(-by)
        } else {
            None
        }
    }))
}

/// A ratio as it is usually chosen, where one is near.
fn round(ratio: f64, considered: &mut Vec<String>, what: &str) -> f64 {
    let near = (20.0 * ratio).round() / 20.0;
    let rounded = if (near - ratio).abs() < 0.02 { near } else { (1000.0 * ratio).round() / 1000.0 };
    considered.push(format!("{what} {rounded:.3}, measured in the pictures as {ratio:.3}"));
    rounded
}

fn charuco(
    steps: &[Step],
    step: f64,
    family: Dictionary,
    border: u8,
    considered: &mut Vec<String>,
) -> Option<(MarkerBoard, bool)> {
    let Some((columns, share)) = change(steps, step, [0, 2]).filter(|c| (2..=1000).contains(&c.0)) else {
        considered.push(
            "a ChArUco board, of which no two markers are seen one above the other to tell its columns"
                .to_owned(),
        );
        return None;
    };
    let columns = columns as u32;
    let marker = round(1.0 / step, considered, "marker / square").min(0.99);
    // Which layout explains more steps, and the largest id in them: a lone id may be chance.
    let explained = |legacy: bool| {
        let steps = whole(steps, step).filter(|(s, v)| {
            let [a, b] = [s.from, s.to].map(|id| square_of(id, columns, legacy));
            [b[0] - a[0], b[1] - a[1]] == v.map(i64::from)
        });
        steps.fold((0, 0), |(n, id): (usize, u32), (s, _)| (n + 1, id.max(s.from).max(s.to)))
    };
    let (new, old) = (explained(false), explained(true));
    let legacy = old.0 > new.0;
    let (agree, largest) = if legacy { old } else { new };
    considered.push(format!(
        "the layout of OpenCV 4.6 and later explains {} steps between markers, the one before {}",
        new.0, old.0
    ));
    let dictionary = smallest(family, largest, considered);
    // The first square can be white where rows are even only.
    let board = |rows: u32| Charuco {
        columns,
        rows,
        square: 1.0,
        marker,
        dictionary,
        border,
        first_id: 0,
        legacy: Some(legacy),
    };
    let markers = |rows: u32| board(rows).layout(legacy).marks.len() as u32;
    let rows = (2..=1000).filter(|r| !legacy || r % 2 == 0).find(|r| markers(*r) > largest)?;
    let all_seen = markers(rows) == largest + 1;
    if !all_seen {
        considered.push(format!("{rows} rows: ids up to {largest} were seen, there may be more rows"));
    }
    let total = whole(steps, step).count();
    let certain = all_seen && share >= CLEAR && agree as f64 >= CLEAR * total as f64;
    Some((MarkerBoard::Charuco(board(rows)), certain))
}

fn grid(
    sightings: &[Sighting],
    marks: &[Named],
    steps: &[Step],
    step: f64,
    family: Dictionary,
    border: u8,
    considered: &mut Vec<String>,
) -> Option<(MarkerBoard, bool)> {
    let ((across, share), (down, share_down)) = (change(steps, step, [1, 0])?, change(steps, step, [0, 1])?);
    let columns = down.unsigned_abs() as u32;
    if across.abs() != 1 || !(1..=1000).contains(&columns) {
        considered.push(format!("a grid of {family} whose ids change by {across} across and {down} down: not one of the known layouts"));
        return None;
    }
    let agrees = |s: &Step, v: [i32; 2]| {
        i64::from(s.to) - i64::from(s.from) == across * i64::from(v[0]) + down * i64::from(v[1])
    };
    let largest =
        whole(steps, step).filter(|(s, v)| agrees(s, *v)).map(|(s, _)| s.from.max(s.to)).max().unwrap_or(0);
    let dictionary = smallest(family, largest, considered);
    let touched = marks.iter().flat_map(|m| m.corners.iter().map(move |c| (m, c))).filter(|(m, c)| {
        let near = |x: &super::Crossing| (x.px - **c).norm() < (0.1 * m.side).max(1.5);
        sightings.get(m.picture).is_some_and(|s| s.crossings.iter().any(near))
    });
    let touched = touched.count() as f64 / (4 * marks.len()) as f64;
    let gap = round(step - 1.0, considered, "gap / marker");
    let rows = (largest + 1).div_ceil(columns);
    let all_seen = rows * columns == largest + 1;
    if !all_seen {
        considered.push(format!("{rows} rows: ids up to {largest} were seen"));
    }
    let kalibr = touched > 0.4;
    considered.push(format!("black squares touch {:.0} % of the markers' corners", 100.0 * touched));
    let usual = if kalibr { across == -1 && down > 0 } else { across == 1 && down > 0 };
    if !usual {
        considered.push(format!(
            "ids change by {across} across and {down} down, which is not the order of {}",
            if kalibr { "Kalibr" } else { "OpenCV" }
        ));
        return None;
    }
    let board = if kalibr {
        MarkerBoard::AprilGrid(AprilGrid {
            columns,
            rows,
            tag: 1.0,
            spacing: gap,
            dictionary,
            border,
            first_id: 0,
        })
    } else {
        MarkerBoard::ArucoGrid(ArucoGrid { columns, rows, marker: 1.0, gap, dictionary, border, first_id: 0 })
    };
    Some((board, all_seen && share.min(share_down) >= CLEAR && (touched - 0.4).abs() > 0.2))
}
