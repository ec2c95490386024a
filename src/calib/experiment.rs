//! The source document's Section V, measured.
