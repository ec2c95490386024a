//! Smooth surfaces over the picture that are fitted to corners while every pose is free.
//!
//! Such a surface ([`crate::residual`]) is two values at each knot of a grid, B-splines between them, and linear in the knots.

mod factor;
mod penalty;
mod rows;
mod system;

pub(crate) use penalty::penalty;
pub(crate) use rows::{Row, ViewRows, by_motion, usual_weights};
pub(crate) use system::System;
