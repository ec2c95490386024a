//! The one currency of everything that can be wrong: by how much the projection map errs, px.
//!
//! The map tells in which pixel a direction is seen. Two maps differ by the displacement of each pixel after the rotation between
//! the cameras that makes it smallest, because the boards do not tell how the camera is turned; places count for that rotation by
//! their certainty. The measure is the root of the mean square over the nine tenths of the picture that are known best: the rest is
//! extrapolated, and would outvote what the boards cover.

use nalgebra::{DMatrix, DVector, Matrix2x3, Matrix3, Vector2, Vector3};

use crate::calib::{
    camera::Camera,
    influence::displacement,
    solution::Calibration,
    target::Target,
    uncertainty::{self, Range},
};

/// Places in the picture, columns × rows.
const GRID: [usize; 2] = [16, 12];
/// Share of the picture that counts.
const SHARE: f64 = 0.9;

/// One place.
struct Place {
    px: Vector2<f64>,
    /// ∂px/∂(free intrinsics).
    by_free: DMatrix<f64>,
    /// ∂px/∂rotation.
    by_turn: Matrix2x3<f64>,
    weight: f64,
    counts: bool,
}

/// The map of a calibrated camera, linearised.
pub(super) struct Map {
    places: Vec<Place>,
    /// Inverse of the normal matrix of the rotation.
    turn: Matrix3<f64>,
}

impl Map {
    /// `None` where the boards determine it nowhere.
    pub(super) fn new(calibration: &Calibration, target: &Target, slots: &[Option<usize>]) -> Option<Self> {
        let camera = &calibration.camera;
        let [w, h] = camera.size_px.map(f64::from);
        let middle = |i: usize, cells: usize, n: f64| (i as f64 + 0.5) / cells as f64 * n - 0.5;
        let pixels: Vec<Vector2<f64>> = (0..GRID[1])
            .flat_map(|j| {
                (0..GRID[0]).map(move |i| Vector2::new(middle(i, GRID[0], w), middle(j, GRID[1], h)))
            })
            .collect();
        let sigma = uncertainty::at(calibration, target, Range::Infinity, &pixels);
        let mut places: Vec<Place> = pixels
            .iter()
            .zip(sigma)
            .filter_map(|(px, sigma)| {
                let sigma = sigma.filter(|s| *s > 0.0)?;
                let ray = camera.unproject(px)?;
                let there = (camera.spec().project)(&camera.params, &ray)?;
                let mut by_free = DMatrix::zeros(2, calibration.free.len());
                for (slot, column) in slots.iter().zip(&there.by_params) {
                    if let Some(slot) = slot {
                        let mut to = by_free.column_mut(*slot);
                        to += column;
                    }
                }
                let by_turn = there.by_point * -ray.cross_matrix();
                Some(Place { px: *px, by_free, by_turn, weight: sigma.powi(-2), counts: false })
            })
            .collect();
        let mut weights: Vec<f64> = places.iter().map(|p| p.weight).collect();
        weights.sort_by(|a, b| b.total_cmp(a));
        let least =
            *weights.get(((SHARE * pixels.len() as f64) as usize).min(weights.len()).checked_sub(1)?)?;
        let mut normal = Matrix3::zeros();
        for place in &mut places {
            place.counts = place.weight >= least;
            normal += place.by_turn.transpose() * place.by_turn * place.weight;
        }
        Some(Self { turn: normal.try_inverse()?, places })
    }

    /// Size of a displacement, px.
    fn size(&self, displaced: &[Vector2<f64>]) -> f64 {
        let mut right = Vector3::zeros();
        for (place, by) in self.places.iter().zip(displaced) {
            right += place.by_turn.transpose() * by * place.weight;
        }
        let turn = self.turn * right;
        let (mut squares, mut n) = (0.0, 0.0);
        for (place, by) in self.places.iter().zip(displaced).filter(|(p, _)| p.counts) {
            squares += (by - place.by_turn * turn).norm_squared();
            n += 1.0;
        }
        (squares / f64::max(n, 1.0)).sqrt()
    }

    /// How far the map moves when the free intrinsics do, and the picture is displaced by `more` besides, px.
    pub(super) fn moves(
        &self,
        intrinsics: &DVector<f64>,
        more: &dyn Fn(&Vector2<f64>) -> Vector2<f64>,
    ) -> f64 {
        let displaced: Vec<_> = self
            .places
            .iter()
            .map(|p| {
                let by = &p.by_free * intrinsics;
                Vector2::new(by[0], by[1]) + more(&p.px)
            })
            .collect();
        self.size(&displaced)
    }

    /// How far the maps of two cameras are apart, px; `None` where one of them does not see a direction.
    pub(super) fn between(&self, from: &Camera, to: &Camera) -> Option<f64> {
        let pixels: Vec<Vector2<f64>> = self.places.iter().map(|p| p.px).collect();
        let weights: Vec<f64> = self.places.iter().map(|p| p.weight).collect();
        let by = displacement(from, to, &pixels, &weights);
        let counted = self.places.iter().zip(by).filter(|(p, _)| p.counts);
        let squares: Option<Vec<f64>> = counted.map(|(_, by)| Some(by?.norm_squared())).collect();
        squares.map(|s| (s.iter().sum::<f64>() / s.len().max(1) as f64).sqrt())
    }

    /// How far it scatters for a covariance of the free intrinsics, px.
    pub(super) fn scatters(&self, covariance: &DMatrix<f64>) -> Option<f64> {
        let root = covariance.clone().cholesky()?.unpack();
        let still = |_: &Vector2<f64>| Vector2::zeros();
        let squares = root.column_iter().map(|c| self.moves(&c.into_owned(), &still).powi(2)).sum::<f64>();
        Some(squares.sqrt())
    }
}
