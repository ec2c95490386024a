//! The `straightedge` command.

use std::process::ExitCode;

fn main() -> ExitCode {
    #[cfg(feature = "window")]
    let window = straightedge::app::run;
    #[cfg(not(feature = "window"))]
    let window = |_| Err("this program was built without it".to_owned());
    straightedge::cli::main(window)
}
