//! The same code compiled for wider registers, where the processor has them: the only unsafe code.
//!
//! No operation is fused or reordered, so the result is the same to the bit on every processor. The feature `narrow` leaves this out:
//! what a processor without the registers does can be measured and tested on one that has them.
#![allow(unsafe_code, reason = "a function for a processor feature is called after asking for the feature")]

use crate::undistort::remap::{
    Source,
    bilinear::{BLOCK, Taps},
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
    if std::arch::is_x86_feature_detected!("avx2") && !narrow() {
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
    if (C == 3 || C == 4) && std::arch::is_x86_feature_detected!("avx2") && !narrow() {
        // SAFETY: as above.
        unsafe { crate::undistort::remap::bilinear::avx2::group::<C>(taps, source, out) };
        return true;
    }
    let _ = (taps, source, out);
    false
}

/// Whether a test asked for the code without wider registers.
#[cfg(all(target_arch = "x86_64", not(feature = "narrow")))]
#[inline(always)]
fn narrow() -> bool {
    #[cfg(test)]
    return tests::NARROW.get();
    #[cfg(not(test))]
    false
}

#[cfg(test)]
mod tests {
    use std::{cell::Cell, ops::ControlFlow};

    use crate::{
        calibrate::{Options, calibrate},
        camera::Model,
        image::{Photo, Samples},
        uncertainty,
        undistort::{Framing, Interpolation, Straightener},
    };

    thread_local! {
        pub(super) static NARROW: Cell<bool> = const { Cell::new(false) };
    }

    /// What `f` gives without wider registers and with them.
    fn both<T>(f: impl Fn() -> T) -> [T; 2] {
        [true, false].map(|narrow| {
            NARROW.set(narrow);
            let result = f();
            NARROW.set(false);
            result
        })
    }

    #[test]
    fn a_calibration_is_the_same_to_the_bit() {
        let views: Vec<usize> = (0..15).collect();
        let mut problem = uncertainty::tests::problem(&views, Options::default(), 3);
        for (i, corner) in problem.observations.iter_mut().flat_map(|o| &mut o.corners).enumerate() {
            // Weights that differ, and outliers.
            corner.sigma_px *= 1.0 + 0.01 * (i % 7) as f64;
            corner.px.x += if i % 41 == 0 { 3.0 } else { 0.0 };
        }
        for model in [Model::Brown5, Model::Tilted, Model::Kb4] {
            problem.cameras[0].model = model;
            let [narrow, wide] = both(|| calibrate(&problem, &mut |_| ControlFlow::Continue(())).unwrap());
            assert!(narrow == wide, "{model}: {:?} {:?}", narrow.camera, wide.camera);
        }
    }

    #[test]
    fn a_straightened_picture_is_the_same_to_the_bit() {
        let camera = crate::synth::Scene::seed().camera;
        let [width, height] = camera.size_px.map(|n| n as usize);
        let straight = Straightener::new(&camera, &Framing::flat(1.0), false).unwrap();
        for channels in [1, 3, 4] {
            let samples = (0..width * height * channels).map(|i| (i * i / 7 + i / 3) as u8).collect();
            let photo = Photo { width, height, channels, samples: Samples::U8(samples) };
            for how in [Interpolation::Bilinear, Interpolation::Lanczos] {
                let [narrow, wide] = both(|| straight.run(&photo, how).unwrap());
                assert!(narrow == wide, "{channels} channels, {how:?}");
            }
        }
    }
}
