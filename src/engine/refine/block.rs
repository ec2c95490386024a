//! One view as the solver stores it: structure of arrays, padded to the lane count.

use nalgebra::{Point3, Vector2, Vector3};

use crate::{
    camera::{LANES, Lanes},
    pose::Pose,
};

/// Corners of one view.
#[derive(Clone, Debug)]
pub struct Block {
    /// Board points relative to `center`.
    pub(super) points: Vec<[Lanes; 3]>,
    /// Where they were seen, px.
    pub(super) observed: Vec<[Lanes; 2]>,
    /// Square roots of the a-priori weights; 0 in the padding.
    pub(super) roots: Vec<Lanes>,
    center: Vector3<f64>,
    count: usize,
}

impl Block {
    /// From corresponding points of the board and of the picture; all weights are 1.
    pub fn new(points: &[Point3<f64>], observed: &[Vector2<f64>]) -> Self {
        let count = points.len().min(observed.len());
        let center = points[..count].iter().map(|p| p.coords).sum::<Vector3<f64>>() / (count.max(1) as f64);
        let chunks = count.div_ceil(LANES);
        // Padding repeats the last corner, so that it is always visible, with weight 0.
        let at = |c: usize, l: usize| (c * LANES + l).min(count - 1);
        let mut block = Self {
            points: (0..chunks)
                .map(|c| [0, 1, 2].map(|k| std::array::from_fn(|l| points[at(c, l)].coords[k] - center[k])))
                .collect(),
            observed: (0..chunks)
                .map(|c| [0, 1].map(|k| std::array::from_fn(|l| observed[at(c, l)][k])))
                .collect(),
            roots: vec![[0.0; LANES]; chunks],
            center,
            count,
        };
        block.set_weights(std::iter::repeat_n(1.0, count));
        block
    }

    /// Sets the a-priori weight of each squared residual, in the order of the corners.
    pub fn set_weights(&mut self, weights: impl Iterator<Item = f64>) {
        for (root, weight) in self.roots.as_flattened_mut()[..self.count].iter_mut().zip(weights) {
            *root = weight.sqrt();
        }
    }

    /// A-priori weight of corner `i`.
    pub fn weight(&self, i: usize) -> f64 {
        self.roots[i / LANES][i % LANES].powi(2)
    }

    /// Number of corners.
    pub const fn len(&self) -> usize {
        self.count
    }

    /// Whether there is none.
    pub const fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// The pose whose translation is the place of the middle of the corners.
    pub(super) fn centred(&self, camera_from_board: &Pose) -> Pose {
        Pose {
            rotation: camera_from_board.rotation,
            translation: camera_from_board.rotation * self.center + camera_from_board.translation,
        }
    }

    /// Inverse of [`Block::centred`].
    pub(super) fn uncentred(&self, pose: &Pose) -> Pose {
        Pose { rotation: pose.rotation, translation: pose.translation - pose.rotation * self.center }
    }
}
