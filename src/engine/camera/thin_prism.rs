//! The rational model with thin-prism terms, OpenCV's twelve `k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4`: [`super::opencv`].

use super::{
    Spec,
    at::{one, one_px},
    opencv::{all, all_px, at, px},
    pinhole::{self, params},
};

/// The model's table.
pub static SPEC: Spec = Spec {
    name: "thinprism",
    title: "Thin prism, 12 terms",
    explained: "Rational with four terms for lens elements that are not quite parallel",
    perspective: true,
    neutral: &[0.0; 12],
    params: params!("k1" "k2" "p1" "p2" "k3" "k4" "k5" "k6" "s1" "s2" "s3" "s4"),
    project: |p, x| one(at::<16>(p), p, x),
    project_px: |p, x| one_px(px::<16>(p), p, x),
    project_batch: all::<16>,
    project_px_batch: all_px::<16>,
    guess_ray: pinhole::guess_ray,
    examples: &[&[
        350.0, 351.0, 320.0, 240.0, 0.6, 0.05, 1e-3, -1e-3, 0.001, 0.95, 0.2, 0.01, 2e-3, -5e-4, -1e-3, 3e-4,
    ]],
    invalid: &[&[533.0, 533.2, 342.3, 234.0, 0.0]],
};
