//! Synthetic scenes with exactly known truth.
