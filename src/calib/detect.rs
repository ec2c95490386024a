//! Checkerboard detection.
