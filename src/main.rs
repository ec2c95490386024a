//! The `straightedge` command.

fn main() -> std::process::ExitCode {
    straightedge::cli::main(straightedge::app::run)
}
