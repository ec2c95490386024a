//! The whole calibration: starts, refinement, sanity, evidence.
