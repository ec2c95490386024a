//! Plane-to-picture homographies.
