//! Pictures in parts that are new to each other.

use crate::observation::{Corner, Observation};

/// Parts that the pictures are divided into.
const PARTS: usize = 5;
/// Groups of pictures that are looked at: of more, every n-th.
const MOST: usize = 60;
/// Two pictures are of one pose where their common corners lie within this share of the picture's longer side on average.
const SAME_POSE: f64 = 0.005;
/// One corner that is this many times further away says that they are not.
const FAR: f64 = 10.0;

/// One fit and the pictures that it is asked about, as positions of observations.
pub(super) struct Fold {
    pub(super) fitted: Vec<usize>,
    pub(super) left_out: Vec<usize>,
}

/// The division.
pub(super) struct Folds {
    /// For each observation the group of its pose.
    pub(super) group: Vec<usize>,
    /// Empty where there are fewer than three poses.
    pub(super) folds: Vec<Fold>,
}

/// Divides observations into up to five parts, pictures of one pose in one part.
pub(super) fn of(observations: &[Observation], size_px: [u32; 2]) -> Folds {
    let near = SAME_POSE * f64::from(size_px[0].max(size_px[1]));
    let mut first: Vec<usize> = Vec::new();
    let mut group = Vec::with_capacity(observations.len());
    for (i, observation) in observations.iter().enumerate() {
        let same = first.iter().position(|&f| of_one_pose(&observations[f], observation, near));
        group.push(same.unwrap_or(first.len()));
        if same.is_none() {
            first.push(i);
        }
    }
    let groups = first.len();
    let step = groups.div_ceil(MOST).max(1);
    let asked = groups.div_ceil(step);
    let parts = if asked < 3 { 0 } else { PARTS.min(asked) };
    let members = |wanted: &dyn Fn(usize) -> bool| {
        (0..group.len()).filter(|&i| group[i] % step == 0 && wanted(group[i] / step)).collect::<Vec<_>>()
    };
    let folds = (0..parts)
        .map(|k| Fold { fitted: members(&|g| g % parts != k), left_out: members(&|g| g % parts == k) })
        .collect();
    Folds { group, folds }
}

/// Whether the corners that two pictures share, at least four and half of each, are less than `near` px apart on average.
fn of_one_pose(a: &Observation, b: &Observation, near: f64) -> bool {
    let shared = |c: &Corner| b.corners.iter().find(|o| o.index == c.index).map(|o| (o.px - c.px).norm());
    // Most pairs are far apart, which one corner tells.
    if a.corners.iter().find_map(shared).is_none_or(|d| d > FAR * near) {
        return false;
    }
    let distances: Vec<f64> = a.corners.iter().filter_map(shared).collect();
    let n = distances.len();
    let enough = n >= 4 && 2 * n > a.corners.len().max(b.corners.len());
    enough && distances.iter().sum::<f64>() < near * n as f64
}
