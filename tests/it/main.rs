//! The one integration-test binary.
#![allow(clippy::unwrap_used, clippy::panic, reason = "helpers of tests may panic like tests")]

mod calibration;
mod cli;
mod cli_tools;
mod detection;
mod experiment;
mod formats;
mod layers;
