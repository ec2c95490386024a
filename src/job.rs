//! Jobs: plain data in, plain data out; the only place that reads photographs.

pub mod group;
pub mod photo;
