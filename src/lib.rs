//! Straightedge: camera calibration that can be believed.
//!
//! One thin binary. Each module knows only those below it:
//!
//! ```text
//!   app      the window: draws state, collects actions
//!   cli      headless commands, progress bars
//!   worker   queue + lanes: runs jobs on threads
//!   job      Request → Reply: plain data, one fn run(); the only place that reads photographs
//!   calib    what is made of results: report, findings, figures, camera files
//!   engine   a package of its own: geometry, vision, optimisation, statistics, rendering
//! ```
//!
//! The data flows one way: folder → action → plan → job → reply → state → panel. See `ARCHITECTURE.md`.

#[cfg(feature = "window")]
pub mod app;
pub mod calib;
#[cfg(not(target_arch = "wasm32"))]
pub mod cli;
pub mod job;
pub mod worker;
