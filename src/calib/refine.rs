//! Joint Levenberg–Marquardt refinement with the Schur complement.
