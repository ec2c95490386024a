//! The calibration library: the engine (geometry, vision, optimisation, statistics, rendering; its modules are here too), and what
//! is made of its results: the report, findings, figures, pages, camera files, boards to print.
//!
//! Its conventions are those of [`engine`]: it knows no files, no threads, no clocks and no global state, and is deterministic.

pub use engine::*;

pub mod advice;
pub mod board;
pub mod check;
pub mod compare;
pub mod diagnose;
pub mod experiment;
pub mod figure;
pub mod format;
pub mod html;
pub mod npy;
pub mod report;
pub mod stmap;
pub mod survey;
pub mod twin;
