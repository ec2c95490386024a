//! OpenCV's full fourteen terms, with a tilted sensor: [`super::opencv`].

use super::{
    Param, Spec,
    at::{all, all_px, one, one_px},
    opencv::{at_tilted, px_tilted},
    pinhole::{self, INTRINSICS},
};

const fn term(name: &'static str) -> Param {
    Param { name, unit: "" }
}

/// The model's table.
pub static SPEC: Spec = Spec {
    name: "tilted",
    title: "Tilted sensor, 14 terms",
    explained: "Thin prism with a sensor that is turned against the lens, as in Scheimpflug cameras",
    perspective: true,
    neutral: &[0.0; 14],
    params: &[
        INTRINSICS[0],
        INTRINSICS[1],
        INTRINSICS[2],
        INTRINSICS[3],
        term("k1"),
        term("k2"),
        term("p1"),
        term("p2"),
        term("k3"),
        term("k4"),
        term("k5"),
        term("k6"),
        term("s1"),
        term("s2"),
        term("s3"),
        term("s4"),
        Param { name: "taux", unit: "rad" },
        Param { name: "tauy", unit: "rad" },
    ],
    project: |p, x| one(at_tilted(p), p, x),
    project_px: |p, x| one_px(px_tilted(p), p, x),
    project_batch: |p, x, out| all(at_tilted(p), p, x, out),
    project_px_batch: |p, x, out| all_px(px_tilted(p), p, x, out),
    guess_ray: pinhole::guess_ray,
    examples: &[&[
        450.0, 451.0, 320.0, 240.0, 0.6, 0.05, 1e-3, -1e-3, 0.001, 0.95, 0.2, 0.01, 2e-3, -5e-4, -1e-3, 3e-4,
        0.08, -0.05,
    ]],
    invalid: &[&[533.0, 533.2, 342.3, 234.0, 0.0]],
};
