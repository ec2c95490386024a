//! The border of the largest piece of a picture where a function is not above zero: marching squares with linear interpolation
//! (W. Lorensen and H. Cline, 1987, in the plane). Holes in it are not told.

use std::collections::BTreeMap;

use nalgebra::Vector2;

use super::area;

/// The edge of the lattice between two nodes: of the left or upper one column and row, and whether it goes down.
type Edge = (usize, usize, bool);

/// Traces the border, in px; `size` is that of the picture, `cells` how many there are along its longer side.
pub(super) fn of(size: [f64; 2], cells: f64, beyond: impl Fn(&Vector2<f64>) -> f64) -> Vec<[f64; 2]> {
    let longer = size[0].max(size[1]);
    let n = size.map(|s| (cells * s / longer).round().max(1.0) as usize);
    // One more node on each side lies on the border, too, and is outside: so every piece is closed.
    let at = |i: usize, axis: usize| {
        let inner = i.clamp(1, n[axis] + 1) - 1;
        inner as f64 / n[axis] as f64 * size[axis] - 0.5
    };
    let columns = n[0] + 3;
    let values: Vec<f64> = (0..(n[1] + 3) * columns)
        .map(|k| {
            let (i, j) = (k % columns, k / columns);
            let pad = i == 0 || j == 0 || i > n[0] + 1 || j > n[1] + 1;
            if pad { 1.0 } else { beyond(&Vector2::new(at(i, 0), at(j, 1))) }
        })
        .collect();
    let value = |i: usize, j: usize| values[j * columns + i];
    let mut next: BTreeMap<Edge, Edge> = BTreeMap::new();
    for j in 0..n[1] + 2 {
        for i in 0..columns - 1 {
            // Around the cell: its corners, and the edge behind each.
            let corners = [value(i, j), value(i + 1, j), value(i + 1, j + 1), value(i, j + 1)];
            let edges: [Edge; 4] = [(i, j, false), (i + 1, j, true), (i, j + 1, false), (i, j, true)];
            let safe = corners.map(|v| v <= 0.0);
            for k in 0..4 {
                if safe[k] || !safe[(k + 1) % 4] {
                    continue;
                }
                let leaves = (1..4).map(|s| (k + s) % 4).find(|m| safe[*m] && !safe[(*m + 1) % 4]);
                next.extend(leaves.map(|m| (edges[k], edges[m])));
            }
        }
    }
    let crossing = |&(i, j, down): &Edge| {
        let (a, b) = if down { ((i, j), (i, j + 1)) } else { ((i, j), (i + 1, j)) };
        let (va, vb) = (value(a.0, a.1), value(b.0, b.1));
        let t = va / (va - vb);
        let between = |a: usize, b: usize, axis: usize| at(a, axis) + t * (at(b, axis) - at(a, axis));
        [between(a.0, b.0, 0), between(a.1, b.1, 1)]
    };
    let mut best = Vec::new();
    while let Some((start, mut edge)) = next.pop_first() {
        let mut polygon = vec![crossing(&start)];
        while edge != start {
            polygon.push(crossing(&edge));
            match next.remove(&edge) {
                Some(following) => edge = following,
                None => break,
            }
        }
        if area(&polygon).abs() > area(&best).abs() {
            best = polygon;
        }
    }
    if area(&best) < 0.0 {
        best.reverse();
    }
    plain(&best)
}

/// Rounded to a hundredth of a px, without points on the line between their neighbours.
fn plain(polygon: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut list: Vec<[f64; 2]> = polygon.iter().map(|p| p.map(|v| (100.0 * v).round() / 100.0)).collect();
    list.dedup();
    if list.len() > 1 && list.first() == list.last() {
        list.pop();
    }
    let n = list.len();
    let bends = |k: usize| {
        let [a, b, c] = [list[(k + n - 1) % n], list[k], list[(k + 1) % n]];
        ((b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0])).abs() > 1e-9
    };
    (0..n).filter(|k| bends(*k)).map(|k| list[k]).collect()
}
