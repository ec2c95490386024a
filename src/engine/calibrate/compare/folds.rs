//! Pictures in parts that are new to each other.

use crate::{bursts, observation::Observation};

/// Parts that the pictures are divided into.
const PARTS: usize = 10;
/// Groups of pictures that are looked at: of more, every n-th.
const MOST: usize = 60;

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

/// Divides observations into up to ten parts, pictures of one pose in one part.
pub(super) fn of(observations: &[Observation], size_px: [u32; 2]) -> Folds {
    let corners: Vec<_> = observations.iter().map(bursts::corners).collect();
    let group = bursts::groups(&corners, size_px);
    let groups = group.iter().max().map_or(0, |last| last + 1);
    let step = groups.div_ceil(MOST).max(1);
    let asked = groups.div_ceil(step);
    let parts = if asked < 3 { 0 } else { PARTS.min(asked) };
    let members = |wanted: &dyn Fn(usize) -> bool| {
        (0..group.len())
            .filter(|&i| group[i].is_multiple_of(step) && wanted(group[i] / step))
            .collect::<Vec<_>>()
    };
    let folds = (0..parts)
        .map(|k| Fold { fitted: members(&|g| g % parts != k), left_out: members(&|g| g % parts == k) })
        .collect();
    Folds { group, folds }
}
