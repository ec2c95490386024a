//! Runs jobs on lanes: a queue in front, one job at a time in each lane.
//!
//! Every lane holds the pixels of one photograph at most, so memory is bounded by the number of lanes, whatever the number of
//! pictures. Results do not depend on the number of lanes: a job is one thread, and [`Pool::map`] answers in the order in which it
//! was asked. A lane is a thread on the desktop and a worker in a browser.

#[cfg(not(target_arch = "wasm32"))]
mod lane_native;
#[cfg(target_arch = "wasm32")]
mod lane_web;
mod pool;
#[cfg(target_arch = "wasm32")]
mod serve_web;
#[cfg(not(target_arch = "wasm32"))]
mod side_by_side;
#[cfg(not(target_arch = "wasm32"))]
pub mod straighten;
#[cfg(any(test, target_arch = "wasm32"))]
pub(crate) mod wire;

#[cfg(target_arch = "wasm32")]
pub use lane_web::threads;
pub use pool::{Event, Pool};
#[cfg(target_arch = "wasm32")]
pub use serve_web::{scope, serve};
#[cfg(not(target_arch = "wasm32"))]
pub use side_by_side::{side_by_side, threads};
