//! Pictures whose board was taken for its mirror image about the line of sight: a plane seen from afar fits nearly as well either way,
//! and no small step leads from one to the other.

use nalgebra::Vector2;
use std::ops::ControlFlow;

use super::{Constraints, Problem, Seen, contradiction, pose_of, robust, robust::Fitted};
use crate::{
    Result,
    camera::Camera,
    observation::Corner,
    refine::{self, State},
};

/// A pose is another one where it fits better by this factor.
const BETTER: f64 = 0.7;

/// Looks for another pose of each picture that fits far worse than the others, and refines everything again where there is one.
pub(super) fn put_right(
    problem: &Problem,
    views: &[Seen],
    constraints: &Constraints,
    fitted: &mut Fitted,
    tick: &mut dyn FnMut() -> ControlFlow<()>,
) -> Result<()> {
    let setup = &problem.cameras[0];
    let State { params, mut poses } = fitted.refined.state.clone();
    let camera = Camera { model: setup.model, size_px: setup.size_px, params };
    let mut any = false;
    for i in contradiction::suspected(fitted) {
        let (view, before) = (&views[i], rms(&fitted.residuals[i]));
        let corner = |(index, px): (&u32, &Vector2<f64>)| Corner { index: *index, px: *px, sigma_px: 1.0 };
        let corners: Vec<Corner> = view.indices.iter().zip(&view.px).map(corner).collect();
        if let Ok((pose, residuals)) = pose_of(&camera, &problem.target, &corners)
            && rms(&residuals) < BETTER * before
        {
            poses[i] = pose;
            any = true;
        }
    }
    if any {
        let whole = refine::Problem {
            spec: setup.model.spec(),
            free: &constraints.free,
            blocks: &[],
            huber_px: None,
            single_precision: false,
        };
        let blocks = views.iter().map(Seen::block).collect();
        let again = robust::fit(
            &whole,
            blocks,
            views,
            &State { params: camera.params, poses },
            &problem.options,
            tick,
        )?;
        if again.refined.cost < fitted.refined.cost {
            *fitted = again;
        }
    }
    Ok(())
}

fn rms(residuals: &[Vector2<f64>]) -> f64 {
    (residuals.iter().map(|r| r.norm_squared()).sum::<f64>() / residuals.len().max(1) as f64).sqrt()
}
