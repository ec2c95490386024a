//! The engine: geometry, vision, optimisation, statistics, rendering: what must be fast.
//!
//! It knows no files, no threads, no clocks and no global state, and it is deterministic: on one build and
//! CPU class the same input gives the same bits, whatever the number of threads above it.
//!
//! # Conventions
//!
//! * **Pixels**: `(0, 0)` is the *centre* of the top-left pixel; x right, y down. Everything inside is in this
//!   origin (OpenCV's); formats with another origin convert at their border.
//! * **Camera frame**: x right, y down, z forward. **Board frame**: x along the columns, y along the rows,
//!   z away from the camera's side; board points have z = 0; the origin is corner 0. Surveyed points keep the frame in which
//!   they were given, which must be right-handed.
//! * **Transforms** are named `a_from_b`, points `x_in_a`: `camera_from_board * point_in_board` is a point in
//!   the camera frame.
//! * **Index** of a corner = `row · columns + column` over the full board of inner corners, also when only a
//!   part of it is seen.
//! * **Residual** = observed − projected, px.
//! * **Units** sit in names (`_px`, `_rad`, `_deg`). Lengths of the board and of poses are in the unit in which
//!   the square was given; they never influence the camera.
//! * **RMS** is over the 2-D distances of all corners of the included views, unweighted, outliers counted
//!   (OpenCV's number).
//!
//! `docs/interface.md` defines every word, option and field.

pub mod bspline;
pub mod bursts;
pub mod calibrate;
pub mod camera;
pub mod circles;
pub mod detect;
pub mod dlt;
pub mod error;
pub mod homography;
pub mod image;
pub mod influence;
pub mod jpeg;
pub mod json;
pub mod lens;
pub mod marker;
pub mod named;
pub mod number;
pub mod observation;
pub mod order;
pub mod p3p;
pub mod pose;
pub mod refine;
pub mod residual;
pub mod safe;
pub mod screen;
pub mod solution;
pub mod splined;
pub mod spread;
pub mod stats;
mod surface;
pub mod synth;
pub mod target;
pub mod uncertainty;
pub mod undistort;
mod wide;
pub mod zhang;

pub use error::{Error, Result};
