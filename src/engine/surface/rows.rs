//! Corners as rows of a least-squares problem whose poses are free.

use nalgebra::{Cholesky, Const, Matrix2x3, Matrix2x6, Matrix6, Vector2, Vector3, Vector6};

use crate::{bspline::Patch, stats::quantile};

/// Standard deviations of one coordinate beyond which the robust loss doubts a corner.
const DOUBT: f64 = 2.5;

/// One corner.
#[derive(Clone, Debug)]
pub(crate) struct Row {
    pub(crate) index: u32,
    /// Where it was seen, px.
    pub(crate) seen_px: Vector2<f64>,
    /// The knots around the place where the model shows it.
    pub(crate) patch: Patch,
    /// ∂px/∂(ω, τ) of the pose, about the middle of the corners.
    pub(crate) by_pose: Matrix2x6<f64>,
    /// Observed − projected, px.
    pub(crate) residual: Vector2<f64>,
    pub(crate) weight: f64,
}

/// One view.
#[derive(Clone, Debug)]
pub(crate) struct ViewRows {
    pub(crate) rows: Vec<Row>,
    /// Group of pictures that show nearly the same.
    pub(crate) group: usize,
}

impl ViewRows {
    /// The normal matrix of the pose, factored; `None` where it is not determined.
    pub(crate) fn pose_information(&self) -> Option<Cholesky<f64, Const<6>>> {
        let mut v = Matrix6::zeros();
        for row in &self.rows {
            v += row.by_pose.transpose() * row.by_pose * row.weight;
        }
        v.cholesky()
    }

    /// The motion (ω, τ) of the pose that fits `residuals` (px) best; `None` where it is not determined.
    pub(crate) fn motion(&self, residuals: &[Vector2<f64>]) -> Option<Vector6<f64>> {
        let mut gradient = Vector6::zeros();
        for (row, r) in self.rows.iter().zip(residuals) {
            gradient += row.by_pose.transpose() * r * row.weight;
        }
        Some(self.pose_information()?.solve(&gradient))
    }

    /// What is left of each corner once the pose has moved to fit `residuals` best, px.
    pub(crate) fn with_pose_free(&self, mut residuals: Vec<Vector2<f64>>) -> Option<Vec<Vector2<f64>>> {
        let motion = self.motion(&residuals)?;
        for (row, r) in self.rows.iter().zip(&mut residuals) {
            *r -= row.by_pose * motion;
        }
        Some(residuals)
    }
}

/// ∂px/∂(ω, τ) of a pose that turns about a place `arm` away: δx = ω × arm + τ.
pub(crate) fn by_motion(by_point: &Matrix2x3<f64>, arm: &Vector3<f64>) -> Matrix2x6<f64> {
    let mut by = Matrix2x6::zeros();
    by.fixed_view_mut::<2, 3>(0, 0).copy_from(&(by_point * -arm.cross_matrix()));
    by.fixed_view_mut::<2, 3>(0, 3).copy_from(by_point);
    by
}

/// The weights of a view's corners without the doubt of the robust loss, which judged by another model: corners beyond its threshold
/// get the usual weight of the view. `sigma0_px` is σ of a coordinate of a corner of weight 1.
pub(crate) fn usual_weights(weights: &[f64], residuals_px: &[Vector2<f64>], sigma0_px: f64) -> Vec<f64> {
    let mut sorted = weights.to_vec();
    sorted.sort_by(f64::total_cmp);
    let usual = quantile(&sorted, 0.5);
    let doubted = |r: &Vector2<f64>| usual.sqrt() * r.norm() > DOUBT * sigma0_px;
    weights.iter().zip(residuals_px).map(|(w, r)| if doubted(r) { w.max(usual) } else { *w }).collect()
}
