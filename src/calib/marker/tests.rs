//! Markers in rendered pictures with exactly known corners, and in photographs.

mod photographs;
