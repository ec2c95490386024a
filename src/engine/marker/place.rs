//! Which markers of a board a picture shows: ids that stand where the others have them.
//!
//! An id alone can be chance. Each marker carries a homography from the board to the picture, which says where its neighbours should
//! be: those that agree on each other belong together, and of several groups (two boards, chance) the largest is the board. All is
//! local, so bent boards and lenses beyond 180° do no harm.

use nalgebra::{Matrix3, Vector2};

use super::{Sighting, board::Layout};
use crate::{
    homography::{self, apply},
    order,
};

/// A marker of the board as the picture shows it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placed {
    /// Position in the layout.
    pub(super) place: usize,
    /// Corners in the order of the layout, px, and their standard deviations.
    pub(super) corners: [Vector2<f64>; 4],
    pub(super) sigma_px: [f64; 4],
    /// White on black.
    pub(super) inverted: bool,
}

/// The markers of one board.
pub(super) struct Group {
    /// Ascending by place, each at most once.
    pub(super) marks: Vec<Placed>,
    /// How many more markers of the board's ids stand elsewhere in a group of their own.
    pub(super) elsewhere: usize,
    /// Whether the ids are beyond chance: two agree, or one of a dictionary that chance does not hit.
    pub(super) certain: bool,
}

/// Neighbours on the board that a marker is compared with, and how far they may be, in its sides.
const NEIGHBOURS: usize = 10;
const FARTHEST: f64 = 9.0;
/// How far a marker may lie from where another has it: in its sides, and for each side of distance.
const OFF: (f64, f64) = (0.2, 0.14);
/// A single marker counts where chance hits the dictionary less often.
const CERTAIN: f64 = 1e-4;

/// How far a corner may lie from where the marks around have it, in half diagonals, px, and multiples of what they leave; how far
/// those may be, in sides.
const STRAY: (f64, f64, f64) = (0.1, 1.5, 2.0);
/// How much farther at the rim, where the others are on one side and say less.
const RIM: f64 = 1.5;
const STRAY_REACH: f64 = 2.6;

#[derive(Clone, Copy)]
struct Node {
    placed: Placed,
    picture_from_board: Matrix3<f64>,
    side: f64,
    errors: u8,
    /// Recognised without looking at its place.
    strict: bool,
}

/// The largest group of markers that agree; `None` where no id of the layout was read.
pub(super) fn place(sighting: &Sighting, layout: &Layout) -> Option<Group> {
    let nodes = nodes(sighting, layout);
    let center = |n: &Node| layout.marks[n.placed.place].iter().sum::<Vector2<f64>>() / 4.0;
    let unit = layout.marks.first().map(|m| (m[1] - m[0]).norm())?;
    let mut group: Vec<usize> = (0..nodes.len()).collect();
    fn root(group: &[usize], mut i: usize) -> usize {
        while group[i] != i {
            i = group[i];
        }
        i
    }
    for i in 0..nodes.len() {
        let mut near: Vec<(f64, usize)> = (0..nodes.len())
            .filter(|j| nodes[*j].placed.place != nodes[i].placed.place)
            .map(|j| ((center(&nodes[j]) - center(&nodes[i])).norm() / unit, j))
            .filter(|n| n.0 < FARTHEST)
            .collect();
        order::by(&mut near, |n| [n.0, n.1 as f64]);
        for (distance, j) in near.into_iter().take(NEIGHBOURS) {
            let (a, b) = (root(&group, i), root(&group, j));
            if a != b && agree(&nodes[i], &nodes[j], distance, layout) {
                group[a.max(b)] = a.min(b);
            }
        }
    }
    let roots: Vec<usize> = (0..nodes.len()).map(|i| root(&group, i)).collect();
    let members = |r: usize| -> Vec<Node> {
        let mut list: Vec<Node> =
            nodes.iter().zip(&roots).filter(|(_, q)| **q == r).map(|(n, _)| *n).collect();
        order::by(&mut list, |n| [n.placed.place as f64, n.errors.into()]);
        list.dedup_by_key(|n| n.placed.place);
        list
    };
    let strict = |list: &[Node]| list.iter().filter(|n| n.strict).count();
    let best =
        (0..nodes.len()).filter(|i| roots[*i] == *i).map(members).max_by_key(|l| (strict(l), l.len()))?;
    let own = strict(&best);
    (own > 0).then(|| Group {
        certain: own >= 2 || layout.dictionary.chance(layout.dictionary.corrected()) < CERTAIN,
        elsewhere: (0..nodes.len())
            .filter(|i| roots[*i] == *i)
            .map(|r| strict(&members(r)))
            .filter(|n| *n >= 2)
            .sum::<usize>()
            .saturating_sub(if own >= 2 { own } else { 0 }),
        marks: best.into_iter().map(|n| n.placed).collect(),
    })
}

fn nodes(sighting: &Sighting, layout: &Layout) -> Vec<Node> {
    let d = layout.dictionary;
    let mut nodes = Vec::new();
    for mark in &sighting.marks {
        for reading in mark.readings.iter().filter(|r| r.border == layout.border) {
            let strict = d.identify(reading.bits);
            let Some(found) = strict.or_else(|| d.nearest(reading.bits)) else { continue };
            let Some(place) = found.id.checked_sub(layout.first_id).map(|p| p as usize) else { continue };
            let Some(on_board) = layout.marks.get(place) else { continue };
            let turned = |k: usize| (usize::from(found.turns) + k) % 4;
            let corners = [0, 1, 2, 3].map(|k| mark.corners[turned(k)]);
            let options = homography::Options { ransac: false, ..homography::Options::default() };
            let Some(fit) = homography::fit(on_board, &corners, options) else { continue };
            nodes.push(Node {
                placed: Placed {
                    place,
                    corners,
                    sigma_px: [0, 1, 2, 3].map(|k| mark.sigma_px[turned(k)]),
                    inverted: mark.inverted,
                },
                picture_from_board: fit.matrix,
                side: mark.side_px(),
                errors: found.errors,
                strict: strict.is_some(),
            });
        }
    }
    nodes
}

/// Whether two markers stand where they have each other.
fn agree(a: &Node, b: &Node, distance: f64, layout: &Layout) -> bool {
    let off = |from: &Node, to: &Node| {
        let places = layout.marks[to.placed.place].iter().zip(&to.placed.corners);
        let sum: f64 = places.map(|(p, q)| (apply(&from.picture_from_board, p) - q).norm()).sum();
        0.25 * sum / to.side
    };
    let allowed = OFF.0 + OFF.1 * distance;
    let ratio = a.side / b.side;
    a.placed.inverted == b.placed.inverted
        && (1.0 / 4.0..=4.0).contains(&ratio)
        // The extrapolation from the smaller one is the worse: one of both may be off by more.
        && off(a, b).min(off(b, a)) < allowed
        && off(a, b).max(off(b, a)) < 2.5 * allowed
}

/// Where points of the board lie near recognised markers.
pub(super) struct Nearby<'a> {
    layout: &'a Layout,
    marks: &'a [Placed],
    centers: Vec<Vector2<f64>>,
}

impl<'a> Nearby<'a> {
    pub(super) fn new(layout: &'a Layout, marks: &'a [Placed]) -> Self {
        let centers =
            marks.iter().map(|m| layout.marks[m.place].iter().sum::<Vector2<f64>>() / 4.0).collect();
        Self { layout, marks, centers }
    }

    /// The homography near a point of the board, from at most four markers that are not farther than `reach` (in its unit).
    pub(super) fn homography(&self, point: Vector2<f64>, reach: f64) -> Option<Matrix3<f64>> {
        self.homography_without(point, reach, |_| false).map(|h| h.0)
    }

    /// Marks whose corners do not lie where those around them have them, the worst first: something lies over a side.
    pub(super) fn strays(&self) -> Vec<bool> {
        let mut stray = vec![false; self.marks.len()];
        let mut doubtful: Vec<usize> = (0..self.marks.len()).filter(|i| self.off(*i, &stray) > 1.0).collect();
        // Without the worst one others may be right.
        loop {
            let off = doubtful.iter().enumerate().map(|(n, i)| (self.off(*i, &stray), n));
            match off.max_by(|a, b| a.0.total_cmp(&b.0)) {
                Some((off, n)) if off > 1.0 => stray[doubtful.swap_remove(n)] = true,
                _ => return stray,
            }
        }
    }

    /// How far the corners of a mark lie from where those around have them, as a share of what is allowed.
    fn off(&self, i: usize, stray: &[bool]) -> f64 {
        let (place, corners) = (self.layout.marks[self.marks[i].place], self.marks[i].corners);
        let unit = (place[1] - place[0]).norm();
        let left_out = |j: usize| j == i || stray[j];
        let Some((h, bent)) = self.homography_without(self.centers[i], STRAY_REACH * unit, left_out) else {
            return 0.0;
        };
        let beside = |k: usize, sign: f64| {
            let ahead = |j: usize| sign * (self.centers[j][k] - self.centers[i][k]);
            let near = |j: usize| ahead(j) > 0.5 * unit && ahead(j) < STRAY_REACH * unit;
            (0..self.marks.len()).any(|j| !stray[j] && near(j))
        };
        let inside = [0, 1].iter().all(|k| beside(*k, 1.0) && beside(*k, -1.0));
        let side = 0.5 * (corners[2] - corners[0]).norm().min((corners[3] - corners[1]).norm());
        // What a homography of those around leaves, a bent lens leaves here too.
        let allowed = ((STRAY.0 * side).max(STRAY.1) + STRAY.2 * bent) * if inside { 1.0 } else { RIM };
        let off = place.iter().zip(&corners).map(|(p, q)| (apply(&h, p) - q).norm());
        off.fold(0.0, f64::max) / allowed
    }

    fn homography_without(
        &self,
        point: Vector2<f64>,
        reach: f64,
        left_out: impl Fn(usize) -> bool,
    ) -> Option<(Matrix3<f64>, f64)> {
        let mut near: Vec<(f64, usize)> = self
            .centers
            .iter()
            .enumerate()
            .map(|(i, c)| ((c - point).norm(), i))
            .filter(|n| n.0 <= reach && !left_out(n.1))
            .collect();
        order::by(&mut near, |n| [n.0, n.1 as f64]);
        near.truncate(4);
        let (mut board, mut image) = (Vec::new(), Vec::new());
        for (_, i) in near {
            board.extend(self.layout.marks[self.marks[i].place]);
            image.extend(self.marks[i].corners);
        }
        let options = homography::Options { ransac: false, ..homography::Options::default() };
        homography::fit(&board, &image, options).map(|f| (f.matrix, f.rms_px))
    }
}
