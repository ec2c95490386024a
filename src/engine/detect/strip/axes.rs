//! Direction and length of the edges of a corner from its neighbours in the grid.

use nalgebra::Vector2;

use super::{Arms, Options, Start};

/// Shortest believable distance between corners, px.
const SHORTEST: f64 = 3.0;

/// One grid direction at a corner.
#[derive(Clone, Copy, Debug)]
pub(super) struct Axis {
    /// Towards +column or +row, px.
    pub(super) along: Vector2<f64>,
    /// Distances over which the edge may be used before and after the corner, px, before [`Options::arm`] is applied.
    pub(super) room: [f32; 2],
}

impl Arms {
    /// As axes; `None` where the directions or lengths are none.
    pub(super) fn axes(&self) -> Option<[Axis; 2]> {
        let usable = self.along.iter().all(|d| d.norm() >= SHORTEST)
            && self.room_px.iter().flatten().all(|r| r.is_finite() && *r > 0.0);
        usable.then(|| [0, 1].map(|k| Axis { along: self.along[k], room: self.room_px[k].map(|r| r as f32) }))
    }
}

/// Both axes of every corner: axis 0 along the grid row, axis 1 along the grid column; `None` without a usable direction.
///
/// A missing neighbour follows the rim rule: the other side's distance, shortened to [`Options::arm_rim`]. Where both are
/// missing, the axis is that of the nearest corner that has one, found from link to link.
pub(super) fn all(starts: &[Start], options: &Options) -> Vec<Option<[Axis; 2]>> {
    let rim = options.arm_rim / options.arm;
    let mut axes: Vec<[Option<Axis>; 2]> =
        (0..starts.len()).map(|i| [0, 1].map(|k| own(starts, i, k, rim))).collect();
    loop {
        let mut found = Vec::new();
        for (i, k) in (0..axes.len()).flat_map(|i| [(i, 0), (i, 1)]) {
            if axes[i][k].is_none() {
                let beside = linked(starts, i, 1 - k).into_iter().flatten();
                found.extend(beside.filter_map(|j| axes[j][k]).next().map(|axis| (i, k, axis)));
            }
        }
        if found.is_empty() {
            break;
        }
        for (i, k, Axis { along, room }) in found {
            let both = room[0].min(room[1]).min(rim * room[0].max(room[1]));
            axes[i][k] = Some(Axis { along, room: [both; 2] });
        }
    }
    axes.into_iter().map(|[row, column]| Some([row?, column?])).collect()
}

/// The neighbours of `i` before and after it on axis `k`, where the links make sense.
pub(super) fn linked(starts: &[Start], i: usize, k: usize) -> [Option<usize>; 2] {
    [2 * k, 2 * k + 1].map(|side| {
        let j = starts[i].neighbours[side]? as usize;
        (j != i && starts.get(j)?.px.iter().all(|v| v.is_finite())).then_some(j)
    })
}

fn own(starts: &[Start], i: usize, k: usize, rim: f32) -> Option<Axis> {
    let here = starts[i].px;
    let [before, after] = linked(starts, i, k).map(|j| j.map(|j| starts[j].px));
    let along = after.unwrap_or(here) - before.unwrap_or(here);
    let distance = |q: Option<Vector2<f64>>| q.map(|q| (q - here).norm() as f32);
    let room = match (distance(before), distance(after)) {
        (Some(a), Some(b)) => [a, b],
        (Some(a), None) => [a, rim * a],
        (None, Some(b)) => [rim * b, b],
        (None, None) => return None,
    };
    (along.norm() >= SHORTEST).then_some(Axis { along, room })
}
