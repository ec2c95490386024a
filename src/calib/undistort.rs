//! Undistortion.
