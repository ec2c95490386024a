//! The same code compiled for wider registers, where the processor has them: the only unsafe code.
//!
//! No operation is fused or reordered, so the result is the same to the bit.
#![allow(unsafe_code, reason = "a function for a processor feature is called after asking for the feature")]

use super::{Line, bilinear::Blend};

/// Makes one row of the output.
pub(super) fn make<T: Blend, const C: usize>(line: Line<'_, T>) {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx2") {
        // SAFETY: the processor was just asked for the feature, and there is no other condition.
        return unsafe { avx2::<T, C>(line) };
    }
    line.make::<C>();
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn avx2<T: Blend, const C: usize>(line: Line<'_, T>) {
    line.make::<C>();
}
