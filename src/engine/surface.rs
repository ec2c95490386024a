//! Smooth surfaces over the picture that are fitted to corners while every pose is free.
//!
//! Both the displacement on top of a camera ([`crate::residual`]) and the splined camera ([`crate::splined`]) are two values at
//! each knot of a grid, B-splines between them, and both are linear in the knots: one problem of least squares serves both.

mod factor;
mod penalty;
mod rows;
mod system;

pub(crate) use penalty::penalty;
pub(crate) use rows::{Row, ViewRows, by_motion, usual_weights};
pub(crate) use system::System;
