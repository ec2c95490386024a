//! The one integration-test binary.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "helpers of tests may panic and print like tests"
)]

mod advice;
mod boards;
mod calibration;
mod check;
mod circles;
mod cli;
mod cli_tools;
mod compare;
mod detection;
mod experiment;
mod fisheyes;
mod formats;
mod influence;
mod layers;
mod lenses;
mod markers;
mod photographs;
mod trust;
mod window;
