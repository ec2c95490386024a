//! Sub-pixel corners from gradients alone: the classical refiner, kept to be measured against.
