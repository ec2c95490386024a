//! The `straightedge` command.

fn main() {}
