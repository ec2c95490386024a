//! The four fixed zones of the window, and what stands over them.

pub mod answer;
pub mod center;
pub mod dialogs;
pub mod empty;
pub mod phone;
pub mod pictures;
pub mod strip;
pub mod tiles;
pub mod top;
