//! Headless commands: what is typed, what is printed, and the exit code.
//!
//! Exit codes: 0 done · 1 ran, but without a calibration or a file that was to be written · 2 wrong use (missing path, bad
//! grammar).

mod args;
mod board;
mod calibrate;
mod check;
mod compare;
mod convert;
mod detect;
mod experiment;
mod fail_if;
mod files;
mod frames;
mod measured;
mod pose;
mod stmap;
mod synth;
mod text;
mod twin;
mod undistort;
mod validate;
mod watch;

use std::{path::PathBuf, process::ExitCode};

use clap::{CommandFactory as _, Parser, Subcommand};

use crate::calib::{Error, Result};
use crate::job::store;

/// Camera calibration that can be believed. Without a command it opens the window
#[derive(Debug, Parser)]
#[command(name = "straightedge", version, args_conflicts_with_subcommands = true)]
struct Cli {
    /// Photographs, or folders of them, to open in the window
    #[arg(value_name = "PATHS")]
    paths: Vec<PathBuf>,
    #[command(subcommand)]
    command: Option<Command>,
}

/// One file a command: its arguments and `fn run(Args) -> Result<ExitCode>`.
#[derive(Debug, Subcommand)]
enum Command {
    Calibrate(calibrate::Args),
    Detect(detect::Args),
    Undistort(undistort::Args),
    Convert(convert::Args),
    Pose(pose::Args),
    Synth(synth::Args),
    Experiment(experiment::Args),
    Board(board::Args),
    Stmap(stmap::Args),
    Twin(twin::Args),
    Check(check::Args),
    Compare(compare::Args),
    Validate(validate::Args),
    Watch(watch::Args),
}

/// Ran, but there is no calibration.
pub(crate) const NO_RESULT: u8 = 1;
/// Wrong use: bad grammar, a missing path.
pub(crate) const WRONG_USE: u8 = 2;

/// Runs the command line of this process. `window` shows the application until it is closed; its error says in words why there
/// is no window.
pub fn main(window: fn(Vec<PathBuf>) -> std::result::Result<(), String>) -> ExitCode {
    let cli = Cli::parse();
    let ran = match cli.command {
        None => return open(window, cli.paths),
        Some(Command::Calibrate(args)) => calibrate::run(&args),
        Some(Command::Detect(args)) => detect::run(&args),
        Some(Command::Undistort(args)) => undistort::run(&args),
        Some(Command::Convert(args)) => convert::run(&args),
        Some(Command::Pose(args)) => pose::run(&args),
        Some(Command::Synth(args)) => synth::run(&args),
        Some(Command::Experiment(args)) => experiment::run(&args),
        Some(Command::Board(args)) => board::run(&args),
        Some(Command::Stmap(args)) => stmap::run(&args),
        Some(Command::Twin(args)) => twin::run(&args),
        Some(Command::Check(args)) => check::run(&args),
        Some(Command::Compare(args)) => compare::run(&args),
        Some(Command::Validate(args)) => validate::run(&args),
        Some(Command::Watch(args)) => watch::run(&args),
    };
    ran.unwrap_or_else(|error| fail(&error))
}

fn open(window: fn(Vec<PathBuf>) -> std::result::Result<(), String>, paths: Vec<PathBuf>) -> ExitCode {
    for path in &paths {
        if !path.exists() {
            let word = path.display().to_string();
            let message = match likely_command(&word) {
                Some(command) => {
                    format!("there is no such command, file or folder: a similar command is '{command}'")
                }
                None => "there is no such file or folder: check the path".to_owned(),
            };
            return fail(&Error::File { path: word, message });
        }
    }
    match window(paths) {
        Ok(()) => ExitCode::SUCCESS,
        Err(why) => {
            say(&format!(
                "no window: {why}. Without one: straightedge calibrate | detect | undistort | convert | pose | synth | experiment | board | stmap | check | compare | validate | watch | twin (--help)"
            ));
            ExitCode::from(NO_RESULT)
        }
    }
}

/// The command that a word may have been meant to be.
fn likely_command(word: &str) -> Option<String> {
    let commands = Cli::command();
    let names = commands.get_subcommands().map(|c| (strsim::jaro_winkler(word, c.get_name()), c.get_name()));
    let (likeness, name) = names.max_by(|a, b| a.0.total_cmp(&b.0))?;
    (likeness > 0.8).then(|| name.to_owned())
}

/// Says what is wrong on stderr and answers the exit code.
fn fail(error: &Error) -> ExitCode {
    say(&format!("error: {error}"));
    ExitCode::from(match error {
        Error::Invalid(_) | Error::File { .. } | Error::Format { .. } => WRONG_USE,
        _ => NO_RESULT,
    })
}

/// A line for people, on stderr: stdout is for results.
#[expect(clippy::print_stderr, reason = "the one place where a person is spoken to")]
pub(crate) fn say(text: &str) {
    eprintln!("{text}");
}

/// A result, on stdout. A reader that went away (`| head`) is no error.
///
/// # Errors
/// [`Error::Output`] where it cannot be written, as on a full disk.
pub(crate) fn print(text: &str) -> Result<()> {
    use std::io::{ErrorKind, Write as _};
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() != ErrorKind::BrokenPipe => {
            Err(Error::Output { path: "standard output".to_owned(), message: store::not_written(&e) })
        }
        _ => Ok(()),
    }
}
