//! `straightedge synth`.

use std::process::ExitCode;

use crate::calib::{Error, Result};

/// TODO
#[derive(Debug, clap::Args)]
pub(super) struct Args {}

pub(super) fn run(args: Args) -> Result<ExitCode> {
    let Args {} = args;
    Err(Error::Unsupported("not written yet".to_owned()))
}
