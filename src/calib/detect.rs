//! Checkerboard detection.

pub mod gradient;
pub mod strip;
