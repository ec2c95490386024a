//! A lens that bends in a way that the model cannot follow.

use super::{Alternative, Hypothesis, Words, column::Column, size};

/// Radial terms up to the ninth degree, prism, decentring, skew and unequal scales; those that the model has drop out by themselves.
pub(super) const MORE_TERMS: Hypothesis = Hypothesis {
    code: "lens_model",
    alternatives: |capture| {
        Alternative::of_all(Column::ALL[Column::LENS].iter().map(|c| capture.everywhere(*c)).collect())
    },
    words: |_, best| Words {
        title: "The lens model is too small".to_owned(),
        size: format!("more terms move the projection by {}", size(best.moves_px, "px")),
        value: best.moves_px,
        unit: "px".to_owned(),
    },
};
