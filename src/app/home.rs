//! What the application keeps between runs: the session that was open, and on the desktop good copies of saved ones and folders
//! that were opened.

#[cfg(not(target_arch = "wasm32"))]
mod native;
#[cfg(target_arch = "wasm32")]
mod web;

#[cfg(not(target_arch = "wasm32"))]
pub use native::{Copies, Home, place};
#[cfg(target_arch = "wasm32")]
pub use web::{Copies, Home, place};
