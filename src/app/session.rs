//! Sessions.

/// Of session files.
pub const EXTENSION: &str = "straightedge";
