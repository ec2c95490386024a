//! The detector on rendered boards with exactly known centres, on photographs, and on what is no grid of circles.

mod accuracy;
mod boards;
mod estimators;
mod render;
