//! The rational model, OpenCV's eight terms `k1 k2 p1 p2 k3 k4 k5 k6`: [`super::opencv`].

use super::{
    Spec,
    at::{one, one_px},
    opencv::{all, all_px, at, px},
    pinhole::{self, params},
};

/// The model's table.
pub static SPEC: Spec = Spec {
    name: "rational",
    title: "Rational, 8 terms",
    explained: "Wide lenses that Brown's terms do not follow; far more terms than ordinary lenses determine",
    perspective: true,
    neutral: &[0.0; 8],
    params: params!("k1" "k2" "p1" "p2" "k3" "k4" "k5" "k6"),
    project: |p, x| one(at::<12>(p), p, x),
    project_px: |p, x| one_px(px::<12>(p), p, x),
    project_batch: all::<12>,
    project_px_batch: all_px::<12>,
    guess_ray: pinhole::guess_ray,
    examples: &[
        &[533.0, 533.2, 342.3, 234.0, -0.2854, 0.064, 1.1e-3, -1.3e-4, 0.0, 0.0, 0.0, 0.0],
        &[350.0, 351.0, 320.0, 240.0, 0.6, 0.05, 1e-3, -1e-3, 0.001, 0.95, 0.2, 0.01],
    ],
    invalid: &[&[533.0, 533.2, 342.3, 234.0, 0.0, 0.0, 0.0, 0.0, 0.0, f64::NAN, 0.0, 0.0]],
};
