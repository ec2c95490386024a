//! OpenCV's full fourteen terms, with a tilted sensor: [`super::opencv`].

use super::{
    Spec,
    at::{one, one_px},
    opencv::{all, all_px, at, px},
    pinhole::{self, params},
};

/// The model's table.
pub static SPEC: Spec = Spec {
    name: "tilted",
    title: "Tilted sensor, 14 terms",
    explained: "Thin prism with a sensor that is turned against the lens, as in Scheimpflug cameras",
    perspective: true,
    neutral: &[0.0; 14],
    params: params!("k1" "k2" "p1" "p2" "k3" "k4" "k5" "k6" "s1" "s2" "s3" "s4" "taux" in "rad" "tauy" in "rad"),
    project: |p, x| one(at::<18>(p), p, x),
    project_px: |p, x| one_px(px::<18>(p), p, x),
    project_batch: all::<18>,
    project_px_batch: all_px::<18>,
    guess_ray: pinhole::guess_ray,
    examples: &[&[
        450.0, 451.0, 320.0, 240.0, 0.6, 0.05, 1e-3, -1e-3, 0.001, 0.95, 0.2, 0.01, 2e-3, -5e-4, -1e-3, 3e-4,
        0.08, -0.05,
    ]],
    invalid: &[&[533.0, 533.2, 342.3, 234.0, 0.0]],
};
