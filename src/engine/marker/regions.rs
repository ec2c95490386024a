//! Dark and bright regions of a picture, each with its convex hull: where squares may be.
//!
//! The threshold follows the light: a pixel is dark or bright by the range of grey values within about 6 px (the lowest and
//! highest of tiles of 4 × 4 and their neighbours, as J. Wang & E. Olson, "AprilTag 2", IROS 2016). What lies in the
//! middle of the range is neither, so that squares which touch at their corners fall apart. Regions are runs of pixels joined by
//! their sides; the hull of a region needs no more than where its rows begin and end, however ragged it is inside.

use nalgebra::Vector2;

use crate::image::Plane;

/// Side of a tile, px.
const TILE: usize = 4;
/// Where in the range of grey values dark ends, and from the other end bright begins. Where squares touch, the middle of the crossing
/// is at 0.5, or nearer to 0.3 where the view is oblique: higher limits join the tags of an AprilGrid, lower ones break thin borders.
const DARK: f32 = 0.25;
/// Smallest side of a region's box, px.
const SMALLEST: u32 = 7;

/// A connected region of one colour.
#[derive(Clone, Debug)]
pub(super) struct Region {
    /// Darker than its surroundings, else brighter.
    pub(super) dark: bool,
    /// Convex hull of its pixels' centres, clockwise as seen in the picture, px.
    pub(super) hull: Vec<Vector2<f64>>,
}

/// Pixels of one class side by side in a row: `x0..x1`.
#[derive(Clone, Copy)]
struct Run {
    y: u32,
    x0: u32,
    x1: u32,
    /// Another run of the same region, itself at the root.
    parent: u32,
}

/// What a root run knows of its region.
#[derive(Clone, Copy)]
struct Extent {
    low: [u32; 2],
    high: [u32; 2],
    pixels: u32,
}

/// The regions of a picture that are large and solid enough to be the border of a marker; `contrast` is the smallest
/// range of grey values that means anything.
pub(super) fn regions(picture: &Plane<u8>, contrast: u8) -> Vec<Region> {
    let (w, h) = (picture.width(), picture.height());
    if w < 2 * TILE || h < 2 * TILE || u32::try_from(w.max(h)).is_err() {
        return Vec::new();
    }
    let [dark, bright] = thresholds(picture, contrast);
    let mut regions = Vec::new();
    let columns = w.div_ceil(TILE);
    let mut mask = vec![false; w];
    for is_dark in [true, false] {
        let limits = if is_dark { &dark } else { &bright };
        let mut runs = Vec::new();
        let mut above = 0..0;
        for y in 0..h {
            let of_tiles = &limits[y / TILE * columns..(y / TILE + 1) * columns];
            let row = picture.row(y);
            for ((to, from), limit) in mask.chunks_mut(TILE).zip(row.chunks(TILE)).zip(of_tiles) {
                for (to, v) in to.iter_mut().zip(from) {
                    *to = if is_dark { v < limit } else { v > limit };
                }
            }
            let first = runs.len();
            add_row(&mut runs, &mask, y as u32);
            join(&mut runs, above, first);
            above = first..runs.len();
        }
        collect(&mut runs, is_dark, &mut regions);
    }
    regions
}

/// For each tile, below what a pixel is dark and above what it is bright.
fn thresholds(picture: &Plane<u8>, contrast: u8) -> [Vec<u8>; 2] {
    let (w, h) = (picture.width(), picture.height());
    let (columns, rows) = (w.div_ceil(TILE), h.div_ceil(TILE));
    let (mut low, mut high) = (vec![u8::MAX; columns * rows], vec![0u8; columns * rows]);
    for r in 0..rows {
        let (mut least, mut most) = (picture.row(r * TILE).to_vec(), picture.row(r * TILE).to_vec());
        for y in r * TILE + 1..((r + 1) * TILE).min(h) {
            for ((l, m), v) in least.iter_mut().zip(&mut most).zip(picture.row(y)) {
                *l = (*l).min(*v);
                *m = (*m).max(*v);
            }
        }
        for (c, (l, m)) in least.chunks(TILE).zip(most.chunks(TILE)).enumerate() {
            low[r * columns + c] = l.iter().fold(u8::MAX, |a, b| a.min(*b));
            high[r * columns + c] = m.iter().fold(0, |a, b| a.max(*b));
        }
    }
    let low = spread(&low, columns, u8::min);
    let high = spread(&high, columns, u8::max);
    let mut dark = vec![0; low.len()];
    let mut bright = vec![u8::MAX; low.len()];
    for (i, (l, m)) in low.iter().zip(&high).enumerate() {
        let range = m - l;
        if range >= contrast {
            let part = DARK * f32::from(range);
            dark[i] = (f32::from(*l) + part + 1.0) as u8;
            bright[i] = (f32::from(*m) - part) as u8;
        }
    }
    [dark, bright]
}

/// The extreme of each tile and its eight neighbours.
fn spread(tiles: &[u8], columns: usize, extreme: fn(u8, u8) -> u8) -> Vec<u8> {
    let mut along = tiles.to_vec();
    for (to, from) in along.chunks_mut(columns).zip(tiles.chunks(columns)) {
        for c in 0..from.len() {
            let near = &from[c.saturating_sub(1)..(c + 2).min(from.len())];
            to[c] = near.iter().fold(from[c], |a, b| extreme(a, *b));
        }
    }
    let rows = tiles.len() / columns;
    let mut out = along.clone();
    for r in 0..rows {
        for near in [r.saturating_sub(1), (r + 1).min(rows - 1)] {
            for c in 0..columns {
                let at = r * columns + c;
                out[at] = extreme(out[at], along[near * columns + c]);
            }
        }
    }
    out
}

/// The runs of a row.
fn add_row(runs: &mut Vec<Run>, mask: &[bool], y: u32) {
    let mut x = 0;
    while let Some(from) = mask[x..].iter().position(|m| *m) {
        let x0 = x + from;
        let length = mask[x0..].iter().position(|m| !*m).unwrap_or(mask.len() - x0);
        runs.push(Run { y, x0: x0 as u32, x1: (x0 + length) as u32, parent: runs.len() as u32 });
        x = x0 + length;
    }
}

/// Joins the runs from `first` on with those of the row above that share a side with them.
fn join(runs: &mut [Run], above: std::ops::Range<usize>, first: usize) {
    let mut a = above.start;
    for i in first..runs.len() {
        while a < above.end && runs[a].x1 <= runs[i].x0 {
            a += 1;
        }
        let mut b = a;
        while b < above.end && runs[b].x0 < runs[i].x1 {
            let (p, q) = (root(runs, b), root(runs, i));
            // The older run is the root: its row is the first one.
            let (old, new) = (p.min(q), p.max(q));
            runs[new].parent = old as u32;
            b += 1;
        }
    }
}

fn root(runs: &mut [Run], mut i: usize) -> usize {
    while runs[i].parent as usize != i {
        let up = runs[runs[i].parent as usize].parent;
        runs[i].parent = up;
        i = up as usize;
    }
    i
}

/// Hulls of the regions that may be borders.
fn collect(runs: &mut [Run], dark: bool, regions: &mut Vec<Region>) {
    let empty = Extent { low: [u32::MAX; 2], high: [0; 2], pixels: 0 };
    // Number of each root's extent, then the extents.
    let mut number = vec![u32::MAX; runs.len()];
    let mut extents: Vec<Extent> = Vec::new();
    for i in 0..runs.len() {
        let r = root(runs, i);
        if r == i {
            number[i] = extents.len() as u32;
            extents.push(empty);
        } else {
            number[i] = number[r];
        }
        let (run, e) = (runs[i], &mut extents[number[i] as usize]);
        e.low = [e.low[0].min(run.x0), e.low[1].min(run.y)];
        e.high = [e.high[0].max(run.x1 - 1), e.high[1].max(run.y)];
        e.pixels += run.x1 - run.x0;
    }
    // Rows of the regions that are kept: where they begin and end.
    let mut place = vec![usize::MAX; extents.len()];
    let mut rows: Vec<Vec<[u32; 2]>> = Vec::new();
    for (e, place) in extents.iter().zip(&mut place) {
        let side = [0, 1].map(|k| e.high[k] - e.low[k] + 1);
        if side[0].min(side[1]) >= SMALLEST && e.pixels >= side[0] + side[1] {
            *place = rows.len();
            rows.push(vec![[u32::MAX, 0]; side[1] as usize]);
        }
    }
    let mut first = vec![0; rows.len()];
    for (run, n) in runs.iter().zip(&number) {
        let at = place[*n as usize];
        let Some(list) = rows.get_mut(at) else { continue };
        first[at] = extents[*n as usize].low[1];
        let row = &mut list[(run.y - first[at]) as usize];
        *row = [row[0].min(run.x0), row[1].max(run.x1 - 1)];
    }
    regions.extend(rows.iter().zip(first).map(|(rows, y0)| Region { dark, hull: hull(rows, y0) }));
}

/// Convex hull of rows from `y0` on, each from its first to its last pixel.
fn hull(rows: &[[u32; 2]], y0: u32) -> Vec<Vector2<f64>> {
    let point = |x: u32, i: usize| Vector2::new(f64::from(x), f64::from(y0) + i as f64);
    let chain = |points: &mut dyn Iterator<Item = Vector2<f64>>| {
        let mut chain: Vec<Vector2<f64>> = Vec::new();
        for p in points {
            while let [.., a, b] = chain[..]
                && (b - a).perp(&(p - b)) <= 0.0
            {
                chain.pop();
            }
            chain.push(p);
        }
        chain
    };
    // Down the right side, up the left one: clockwise where y runs down.
    let mut all = chain(&mut rows.iter().enumerate().map(|(i, r)| point(r[1], i)));
    all.extend(chain(&mut rows.iter().enumerate().rev().map(|(i, r)| point(r[0], i))));
    all.dedup();
    if all.len() > 1 && all.first() == all.last() {
        all.pop();
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(hull: &[Vector2<f64>]) -> f64 {
        let next = hull.iter().cycle().skip(1);
        0.5 * hull.iter().zip(next).map(|(p, q)| p.perp(q)).sum::<f64>()
    }

    #[test]
    fn a_tilted_ring_is_one_region_with_its_hull() {
        let picture = Plane::from_fn(90, 80, |x, y| {
            let (u, v) = (x as f64 - 45.0, y as f64 - 40.0);
            let (p, q) = ((0.8 * u + 0.6 * v).abs(), (0.8 * v - 0.6 * u).abs());
            if p.max(q) < 25.0 && p.max(q) > 15.0 { 30 } else { 200 }
        });
        let found = regions(&picture, 20);
        let dark: Vec<&Region> = found.iter().filter(|r| r.dark).collect();
        assert_eq!(dark.len(), 1);
        assert!((area(&dark[0].hull) - 2500.0).abs() < 150.0, "{}", area(&dark[0].hull));
    }

    #[test]
    fn squares_that_touch_at_a_corner_fall_apart() {
        // Blurred by the pixel: the crossing is exactly in the middle of the range.
        let picture = Plane::from_fn(60, 60, |x, y| {
            let side = |v: usize| (v as f64 - 30.0).clamp(-0.5, 0.5);
            let product = 4.0 * side(x) * side(y);
            (115.0 - 85.0 * product) as u8
        });
        let found = regions(&picture, 20);
        assert_eq!(found.iter().filter(|r| r.dark).count(), 2);
    }

    #[test]
    fn odd_pictures_are_survived() {
        for (w, h) in [(0, 0), (1, 1), (8, 1), (1, 9), (8, 8), (9, 13), (3, 5000)] {
            let picture = Plane::from_fn(w, h, |x, y| ((x * 37 + y * 91) % 256) as u8);
            let _ = regions(&picture, 5);
        }
    }
}
