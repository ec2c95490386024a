//! Printable boards: PDF and SVG at true scale.
