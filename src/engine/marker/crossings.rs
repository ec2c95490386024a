//! Crossings of edges near markers, whatever the board: inner corners of a ChArUco board, corners of AprilGrid tags.
//!
//! Places come from two sides: the corner of a mark that a black square touches from outside, and the peaks of the response of a
//! checkerboard detector ([`crate::detect`]) between marks. Linked to their neighbours they are refined as the corners of a
//! checkerboard are: along their edges, with the curvature that the neighbours show.

use std::borrow::Cow;

use nalgebra::{Matrix3, Vector2, Vector3};
use serde::{Deserialize, Serialize};

use super::{
    Mark,
    links::Links,
    outline::{bilinear, square_to},
};
use crate::{
    detect::{
        pyramid::noise,
        response::{RING, SMALL_RING, peaks, response, vertex},
        saddle::Saddle,
        strip::Fit,
    },
    image::{Plane, Sample},
    order,
};

/// A place where four squares meet, two black and two white.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Crossing {
    /// Position, px.
    pub px: Vector2<f64>,
    /// Predicted standard deviation per axis, px.
    pub sigma_px: f64,
    /// Middle of one of the black squares as seen from the crossing, of unit length.
    pub black: Vector2<f64>,
}

/// Side of a mark in the level where crossings are looked for, at least, px.
const SIDE: f64 = 18.0;
/// Below it the small ring is used, px.
const SMALL_SIDE: f64 = 15.0;
/// Farthest from the middle of a mark, in its sides.
const FARTHEST: f64 = 1.7;
/// Smallest quality of a saddle.
const QUALITY: f32 = 0.45;
/// Most saddles: a picture of nothing but texture must not take minutes.
const MOST: usize = 6000;
/// Where a square that touches a corner is looked at, in sides beyond the corner.
const TOUCH: f64 = 0.09;
/// Length of an edge beyond a mark's corner where nothing tells it, in sides.
const BEYOND: f64 = 0.18;
/// Share of the distance from a mark beside the edges that is looked at, and at least that many px.
const CLEAR: (f64, f64) = (0.75, 1.6);
/// A fit may move a crossing by this share of its shortest edge.
const MOVE: f64 = 0.3;
const MOVE_PX: f64 = 3.0;
/// What a fit may leave, relative to half the contrast.
const LEFT: f64 = 0.36;

/// A place that may be a crossing.
#[derive(Clone, Copy)]
pub(super) struct Place {
    pub(super) px: Vector2<f64>,
    /// Directions of the edges, unit vectors: from the first turning to the second (x towards y) it is black.
    pub(super) axes: [Vector2<f64>; 2],
    /// Edge lengths against and along both axes, where a mark tells them, px.
    pub(super) room: Option<[[f64; 2]; 2]>,
    /// Standard deviation per axis once it was fitted, px.
    pub(super) sigma_px: f64,
    /// Side of the mark beside it, px.
    pub(super) side: f64,
    /// How far beside the edges there is no mark, px.
    pub(super) clear: f64,
}

impl Place {
    /// Middle of a black square, of unit length.
    pub(super) fn black(&self) -> Vector2<f64> {
        (self.axes[0] + self.axes[1]).normalize()
    }
}

/// The crossings near the marks, by row, then column.
pub(super) fn crossings<T: Sample>(
    picture: &Plane<T>,
    levels: &[Cow<'_, Plane<u8>>],
    marks: &[Mark],
) -> Vec<Crossing> {
    let Some(frames) = frames(marks) else { return Vec::new() };
    let mut places: Vec<Place> =
        marks.iter().flat_map(|m| (0..4).filter_map(|k| touched(&levels[0], m, k))).collect();
    unite(&mut places);
    let level = between(levels, &frames, &mut places);
    let scale = f64::from(1u32 << level);
    let mut links = Links::of(&places);
    if level > 0 {
        // A pixel of the level is several of the picture: a fit there brings the starts near enough.
        let to_level = |p: &Place| Place {
            px: p.px.map(|v| (v + 0.5) / scale - 0.5),
            room: p.room.map(|r| r.map(|r| r.map(|r| r / scale))),
            side: p.side / scale,
            clear: p.clear / scale,
            ..*p
        };
        let small: Vec<Place> = places.iter().map(to_level).collect();
        for (place, fit) in places.iter_mut().zip(links.fit(&*levels[level], &small, false)) {
            if fit.ok {
                place.px = fit.px.map(|v| (v + 0.5) * scale - 0.5);
            }
        }
        links = Links::of(&places);
    }
    let mut found = accepted(&places, &links, &links.fit(picture, &places, false));
    let more = predicted(marks, &frames, &found);
    if !more.is_empty() {
        found.extend(more);
        let links = Links::of(&found);
        found = accepted(&found, &links, &links.fit(picture, &found, false));
    }
    // What was no crossing must not tell the others their curvature, so once more without it.
    let links = Links::of(&found);
    let found = accepted(&found, &links, &links.fit(picture, &found, true));
    let mut found: Vec<Crossing> =
        found.iter().map(|p| Crossing { px: p.px, sigma_px: p.sigma_px, black: p.black() }).collect();
    order::by(&mut found, |c| [c.px.y, c.px.x]);
    found.dedup_by(|b, a| (a.px - b.px).norm() < 1.0);
    found
}

/// The places that are crossings, moved to where the fit has them.
fn accepted(places: &[Place], links: &Links, fits: &[Fit]) -> Vec<Place> {
    let good = |(i, (p, f)): (usize, (&Place, &Fit))| {
        let stayed =
            (f.px - p.px).norm() < (MOVE * links.shortest(i, places)).min(MOVE_PX.max(0.06 * p.side));
        (f.ok && stayed && f.sigma_gray <= LEFT * f.amplitude.abs()).then(|| Place {
            px: f.px,
            sigma_px: f.sigma_px(),
            ..*p
        })
    };
    places.iter().zip(fits).enumerate().filter_map(good).collect()
}

/// Where the marks have more crossings off their corners, if some crossings tell how far off they are (on a ChArUco board).
fn predicted(marks: &[Mark], frames: &[Frame], found: &[Place]) -> Vec<Place> {
    let mut margins: Vec<f64> = found
        .iter()
        .filter(|p| p.room.is_none())
        .flat_map(|p| frames.iter().map(|f| f.beside(p.px)).filter(|m| *m > 0.04 && m.is_finite()))
        .collect();
    margins.sort_by(f64::total_cmp);
    let Some(margin) = margins.get(margins.len() / 2).copied() else { return Vec::new() };
    let clear =
        |px| (CLEAR.0 * frames.iter().map(|f| f.beside_px(px)).fold(f64::INFINITY, f64::min)).max(CLEAR.1);
    let mut more: Vec<Place> = Vec::new();
    for mark in marks {
        for k in 0..4 {
            let c = |i: usize| mark.corners[(k + i) % 4];
            let Some(h) = square_to(&[c(0), c(1), c(2), c(3)]) else { continue };
            let q = h * Vector3::new(-margin, -margin, 1.0);
            let px = Vector2::new(q.x, q.y) / q.z;
            let side = mark.side_px();
            let near = |p: &Place, part: f64| (p.px - px).norm() < (part * side).max(2.5);
            if found.iter().any(|p| near(p, 0.12)) || frames.iter().any(|f| f.covers(px)) {
                continue;
            }
            match more.iter_mut().find(|p| near(p, 0.25)) {
                // The mark on the other side has it too: between both.
                Some(p) => p.px = 0.5 * (p.px + px),
                None => more.push(Place {
                    px,
                    sigma_px: 0.0,
                    axes: axes(c(1) - c(0), c(3) - c(0), mark.inverted),
                    room: None,
                    side,
                    clear: clear(px),
                }),
            }
        }
    }
    more
}

/// Axes of a crossing whose squares along `next` and `last`, and opposite, are black, else white.
fn axes(next: Vector2<f64>, last: Vector2<f64>, black: bool) -> [Vector2<f64>; 2] {
    let [a, b] = [next.normalize(), last.normalize()];
    if black { [a, b] } else { [-b, a] }
}

/// Two marks that touch have one corner there.
fn unite(places: &mut Vec<Place>) {
    let mut kept: Vec<Place> = Vec::with_capacity(places.len());
    for p in places.iter() {
        if !kept.iter().any(|k| (k.px - p.px).norm() < (0.1 * p.side).max(1.5)) {
            kept.push(*p);
        }
    }
    *places = kept;
}

/// A mark's middle, side and the way from the picture into its square.
struct Frame {
    center: Vector2<f64>,
    side: f64,
    corners: [Vector2<f64>; 4],
    square_from_picture: Matrix3<f64>,
}

impl Frame {
    /// Whether a place lies among the cells of the mark; its corners may be crossings.
    fn covers(&self, px: Vector2<f64>) -> bool {
        let q = self.square_from_picture * Vector3::new(px.x, px.y, 1.0);
        [q.x / q.z, q.y / q.z].iter().all(|v| (0.06..0.94).contains(v))
    }

    /// Distance of a place off a corner of the mark from the nearer of its two sides, in sides; infinite elsewhere.
    fn beside(&self, px: Vector2<f64>) -> f64 {
        let q = self.square_from_picture * Vector3::new(px.x, px.y, 1.0);
        let out = [q.x / q.z, q.y / q.z].map(|v| (-v).max(v - 1.0));
        let off = |o: f64| (-0.1..0.8).contains(&o);
        if off(out[0]) && off(out[1]) { out[0].min(out[1]).max(0.0) } else { f64::INFINITY }
    }

    /// The same distance, px.
    fn beside_px(&self, px: Vector2<f64>) -> f64 {
        if self.beside(px).is_infinite() {
            return f64::INFINITY;
        }
        let distance = |k: usize| {
            let (a, b) = (self.corners[k], self.corners[(k + 1) % 4]);
            (b - a).perp(&(px - a)).abs() / (b - a).norm()
        };
        (0..4).map(distance).fold(f64::INFINITY, f64::min)
    }
}

fn frames(marks: &[Mark]) -> Option<Vec<Frame>> {
    let list: Vec<Frame> = marks
        .iter()
        .filter_map(|m| {
            let square_from_picture = square_to(&m.corners)?.try_inverse()?;
            Some(Frame { center: m.center(), side: m.side_px(), corners: m.corners, square_from_picture })
        })
        .collect();
    (!list.is_empty()).then_some(list)
}

/// Corner `k` of a mark where a black square touches it from outside.
fn touched(picture: &Plane<u8>, mark: &Mark, k: usize) -> Option<Place> {
    let c = |i: usize| mark.corners[(k + i) % 4];
    let (next, last) = (c(1) - c(0), c(3) - c(0));
    let sign = if mark.inverted { -1.0 } else { 1.0 };
    let at = |a: f64, b: f64| bilinear(picture, c(0) + next * a + last * b).map(|v| sign * v);
    let beyond = at(-TOUCH, -TOUCH)?;
    let (inside, beside) = (at(TOUCH, TOUCH)?, [at(-TOUCH, TOUCH)?, at(TOUCH, -TOUCH)?]);
    let bright = beside[0].min(beside[1]);
    if beyond.max(inside) > bright - 0.35 * (bright - beyond.min(inside)) || bright - inside < 6.0 {
        return None;
    }
    let [a, b] = [next, last].map(|d| d.norm());
    let mut room = [[BEYOND * a, a], [BEYOND * b, b]];
    if mark.inverted {
        // The first axis runs against the last side, the second one along the next.
        room = [[room[1][1], room[1][0]], room[0]];
    }
    let axes = axes(next, last, !mark.inverted);
    Some(Place {
        px: c(0),
        sigma_px: 0.0,
        axes,
        room: Some(room),
        side: mark.side_px(),
        clear: f64::INFINITY,
    })
}

/// Adds the saddles between the marks; returns the level in which they were found.
fn between(levels: &[Cow<'_, Plane<u8>>], frames: &[Frame], places: &mut Vec<Place>) -> usize {
    let mut sides: Vec<f64> = frames.iter().map(|f| f.side).collect();
    sides.sort_by(f64::total_cmp);
    let small = sides[sides.len() / 6];
    let level = (1..levels.len()).take_while(|k| small / f64::from(1u32 << k) >= SIDE).last().unwrap_or(0);
    let scale = f64::from(1u32 << level);
    let whole = &levels[level];
    // Only what lies around the marks is looked at.
    let bound = |k: usize, sign: f64, size: usize| {
        let far = frames.iter().map(|f| sign * f.center[k] + FARTHEST * f.side).fold(f64::MIN, f64::max);
        ((sign * far / scale).clamp(0.0, size as f64)) as usize
    };
    let (x0, x1) = (bound(0, -1.0, whole.width()), bound(0, 1.0, whole.width()));
    let (y0, y1) = (bound(1, -1.0, whole.height()), bound(1, 1.0, whole.height()));
    if x1 <= x0 || y1 <= y0 {
        return level;
    }
    let part = Plane::from_fn(x1 - x0, y1 - y0, |x, y| whole.at(x0 + x, y0 + y));
    let ring = if small / scale < SMALL_SIDE { &SMALL_RING } else { &RING };
    let strength = response(&part, ring);
    let noise = noise(&part);
    let threshold = (8.0 * noise).clamp(24.0, 2000.0) as i16;
    let mut at = peaks(&strength, threshold);
    if at.len() > MOST {
        order::by(&mut at, |[x, y]| [-f64::from(strength.at(*x, *y)), *y as f64, *x as f64]);
        at.truncate(MOST);
    }
    let known = places.len();
    for [x, y] in at {
        let [dx, dy] = vertex(&strength, x, y);
        let local = Vector2::new(x as f64 + dx, y as f64 + dy);
        let px = (local + Vector2::new(x0 as f64, y0 as f64)).map(|v| (v + 0.5) * scale - 0.5);
        let near = frames.iter().filter(|f| (f.center - px).norm() < FARTHEST * f.side);
        let mut side = None;
        let (mut covered, mut clear) = (false, f64::INFINITY);
        for f in near {
            covered |= f.covers(px);
            clear = clear.min(CLEAR.0 * f.beside_px(px));
            side = Some(side.map_or(f.side, |s: f64| s.min(f.side)));
        }
        let Some(side) = side.filter(|_| !covered) else { continue };
        let twice = places[..known].iter().any(|p| (p.px - px).norm() < (0.12 * p.side).max(2.0));
        if twice {
            continue;
        }
        let saddle = Saddle::at(&part, ring, [x, y], local);
        if let Some(s) = saddle.filter(|s| s.quality >= QUALITY && s.contrast >= 2.0 * noise + 3.0) {
            places.push(Place {
                px,
                sigma_px: 0.0,
                axes: s.axes,
                room: None,
                side,
                clear: clear.max(CLEAR.1),
            });
        }
    }
    level
}
