//! Figures of the evidence: PNG and SVG.
