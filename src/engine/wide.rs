//! The same code compiled for wider registers, where the processor has them: the only unsafe code.
//!
//! No operation is fused or reordered, so the result is the same to the bit on every processor. The feature `narrow` leaves this out:
//! what a processor without the registers does can be measured and tested on one that has them.
#![allow(unsafe_code, reason = "a function for a processor feature is called after asking for the feature")]

use crate::undistort::remap::{
    Source,
    bilinear::{self, BLOCK, Taps},
};

/// Work that wider registers make faster.
pub(crate) trait Kernel {
    /// What it answers.
    type Output;

    /// Does it. This, and everything below it that is to be wide, is `#[inline(always)]`: only what is compiled as a part of it
    /// is compiled for wider registers.
    fn run(self) -> Self::Output;
}

/// Runs a kernel.
#[inline(always)]
pub(crate) fn run<K: Kernel>(kernel: K) -> K::Output {
    #[cfg(all(target_arch = "x86_64", not(feature = "narrow")))]
    if std::arch::is_x86_feature_detected!("avx2") {
        // SAFETY: the processor was just asked for the feature, and there is no other condition.
        return unsafe { avx2(kernel) };
    }
    kernel.run()
}

#[cfg(all(target_arch = "x86_64", not(feature = "narrow")))]
#[target_feature(enable = "avx2")]
fn avx2<K: Kernel>(kernel: K) -> K::Output {
    kernel.run()
}

/// Blends pixels of 3 or 4 channels; `false` where the processor has no instructions of its own for it.
#[inline(always)]
pub(crate) fn group<const C: usize>(
    taps: &Taps,
    source: &Source<'_, u8>,
    out: &mut [u8; BLOCK * 4 + 4],
) -> bool {
    #[cfg(all(target_arch = "x86_64", not(feature = "narrow")))]
    if (C == 3 || C == 4) && std::arch::is_x86_feature_detected!("avx2") {
        // SAFETY: as above.
        unsafe { bilinear::avx2::group::<C>(taps, source, out) };
        return true;
    }
    let _ = (taps, source, out);
    false
}
