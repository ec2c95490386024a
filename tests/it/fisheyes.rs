//! Fisheye models of one lens: where corners were, their projections are one map, as far as the models fit the lens.

use nalgebra::{Matrix2x6, Matrix6, Vector2, Vector3, Vector6};
use straightedge::calib::{
    calibrate::Problem,
    camera::{Camera, Model},
    influence::displacement,
    pose::Pose,
    solution::Calibration,
    target::Target,
    uncertainty::{self, Range},
};

use crate::influence::{problem, solve};

const MODELS: [Model; 3] = [Model::Kb4, Model::Ds, Model::Eucm];
/// Models fit a lens alike up to this ratio of their RMS.
const ALIKE: f64 = 1.1;

/// Pixels of a grid that have a corner within a fortieth of the picture's width.
fn supported(problem: &Problem) -> Vec<Vector2<f64>> {
    let [w, h] = problem.cameras[0].size_px.map(f64::from);
    let corners: Vec<Vector2<f64>> =
        problem.observations.iter().flat_map(|o| o.corners.iter().map(|c| c.px)).collect();
    (0..60 * 80)
        .map(|i| Vector2::new((f64::from(i % 80) + 0.5) / 80.0 * w, (f64::from(i / 80) + 0.5) / 60.0 * h))
        .filter(|p| corners.iter().any(|c| (c - p).norm() < w / 40.0))
        .collect()
}

/// [`displacement`] of points at a distance, after the rigid motion that makes it smallest: models may place the camera itself
/// differently.
fn displacement_at(
    from: &Camera,
    to: &Camera,
    pixels: &[Vector2<f64>],
    weights: &[f64],
    range: f64,
) -> Vec<f64> {
    let points: Vec<Vector3<f64>> = pixels.iter().map(|p| from.unproject(p).unwrap() * range).collect();
    let mut motion = Pose::identity();
    let seen = |motion: &Pose, k: usize| {
        let x = motion.apply(&points[k].into()).coords;
        (x, (to.spec().project)(&to.params, &x).unwrap())
    };
    for _ in 0..10 {
        let (mut normal, mut right) = (Matrix6::zeros(), Vector6::zeros());
        for (k, px) in pixels.iter().enumerate() {
            let (x, there) = seen(&motion, k);
            let mut by = Matrix2x6::zeros();
            by.fixed_view_mut::<2, 3>(0, 0).copy_from(&(there.by_point * -x.cross_matrix()));
            by.fixed_view_mut::<2, 3>(0, 3).copy_from(&there.by_point);
            normal += by.transpose() * by * weights[k];
            right += by.transpose() * (px - there.px) * weights[k];
        }
        let step = normal.cholesky().unwrap().solve(&right);
        let turn = Pose::from_rvec_tvec(step.fixed_rows::<3>(0).into(), step.fixed_rows::<3>(3).into());
        motion = turn * motion;
    }
    (0..pixels.len()).map(|k| (seen(&motion, k).1.px - pixels[k]).norm()).collect()
}

/// Distances of two maps, and the σ of both together, px.
struct Apart {
    px: Vec<f64>,
    sigma_px: Vec<f64>,
}

impl Apart {
    fn new(a: &Calibration, b: &Calibration, target: &Target, pixels: &[Vector2<f64>], range: Range) -> Self {
        let [of_a, of_b] = [a, b].map(|c| uncertainty::at(c, target, range, pixels));
        let sigma_px: Vec<f64> = of_a.iter().zip(of_b).map(|(a, b)| a.unwrap().hypot(b.unwrap())).collect();
        let weights: Vec<f64> = sigma_px.iter().map(|s| 1.0 / (s * s)).collect();
        let px = match uncertainty::of(a, target, range).range {
            Some(range) => displacement_at(&a.camera, &b.camera, pixels, &weights, range),
            None => {
                let list = displacement(&a.camera, &b.camera, pixels, &weights);
                list.into_iter().map(|d| d.unwrap().norm()).collect()
            }
        };
        Self { px, sigma_px }
    }

    /// Share of the pixels within 3 √(σ² + misfit²).
    fn share(&self, misfit_px: f64) -> f64 {
        let within = self.px.iter().zip(&self.sigma_px).filter(|(d, s)| **d <= 3.0 * s.hypot(misfit_px));
        within.count() as f64 / self.px.len() as f64
    }

    fn rms(&self) -> f64 {
        (self.px.iter().map(|d| d * d).sum::<f64>() / self.px.len() as f64).sqrt()
    }
}

/// Two models that fit a lens alike are one map within their σ. One that fits it worse is off by more than its σ, which knows nothing
/// of that; at the distance of the boards what it leaves more, √|RMS² − RMS²|, covers the rest.
#[test]
fn agree_where_corners_were() {
    for (set, alike) in [("camodocal_fisheye", 1), ("aprilgrid_tumvi_euroc", 3)] {
        let Some((_, problem)) = problem(set, Model::Kb4) else { continue };
        let pixels = supported(&problem);
        assert!(pixels.len() > 1000);
        let fits = MODELS.map(|model| {
            let mut problem = problem.clone();
            problem.cameras[0].model = model;
            solve(&problem)
        });
        assert!(fits.iter().all(|f| f.views.len() == problem.observations.len() && f.set_aside.is_empty()));
        let mut pairs = 0;
        for (a, b) in [(0, 1), (0, 2), (1, 2)] {
            let (a, b) = (&fits[a], &fits[b]);
            let (least, most) = (a.rms_px.min(b.rms_px), a.rms_px.max(b.rms_px));
            let misfit = (most * most - least * least).sqrt();
            let [far, near] = [Range::Infinity, Range::Boards]
                .map(|range| Apart::new(a, b, &problem.target, &pixels, range));
            println!(
                "{set}: {} ({:.3} px) and {} ({:.3} px): {:.3} px apart at infinity, {:.4} within 3 σ; {:.3} px at the boards, {:.4} within 3 σ, {:.4} with the misfit",
                a.camera.model,
                a.rms_px,
                b.camera.model,
                b.rms_px,
                far.rms(),
                far.share(0.0),
                near.rms(),
                near.share(0.0),
                near.share(misfit)
            );
            assert!(near.share(misfit) >= 0.95, "{} {}", a.camera.model, b.camera.model);
            if most < ALIKE * least {
                pairs += 1;
                assert!(far.share(0.0) >= 0.95, "{} {}", a.camera.model, b.camera.model);
                assert!(near.share(0.0) >= 0.95, "{} {}", a.camera.model, b.camera.model);
            }
        }
        assert_eq!(pairs, alike, "{set}");
        assert!(fits.iter().all(|f| f.rms_px >= fits[0].rms_px), "{set}: kb4 fits best");
    }
}
