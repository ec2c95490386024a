//! `straightedge calibrate`.

use std::process::ExitCode;

use crate::calib::{Error, Result};

/// TODO
#[derive(Debug, clap::Args)]
pub(super) struct Args {}

pub(super) fn run(args: Args) -> Result<ExitCode> {
    let Args {} = args;
    Err(Error::Unsupported("not written yet".to_owned()))
}

/// Calibrates the built-in scene and prints the evidence.
pub(super) fn demo() -> Result<ExitCode> {
    Err(Error::Unsupported("not written yet".to_owned()))
}
