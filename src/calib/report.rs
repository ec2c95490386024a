//! The evidence as one serialisable object.
