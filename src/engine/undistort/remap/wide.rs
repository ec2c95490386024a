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

#[cfg(test)]
mod tests {
    use super::super::{Source, lanczos::Kernel};
    use super::*;
    use crate::{
        camera::{Camera, Model},
        undistort::{Map, map::Row},
    };

    /// Every row of a picture of noise, made both ways.
    fn compare<T: Blend, const C: usize>(map: &Map, sample: impl Fn(u32) -> T) {
        let [width, height] = map.source_size();
        let mut seed = 7u32;
        let mut next = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            sample(seed >> 8)
        };
        let samples: Vec<T> = (0..width * height * C).map(|_| next()).collect();
        let source = Source { samples: &samples, width, height };
        let kernel = Kernel::new();
        for kernel in [None, Some(&kernel)] {
            for v in 0..map.size()[1] {
                let mut rows = [Row::default(), Row::default()];
                let mut out = [vec![T::default(); map.size()[0] * C], vec![T::default(); map.size()[0] * C]];
                let [a, b] = &mut rows;
                let [plain, wide] = &mut out;
                Line { map, v, source: &source, kernel, row: a, out: plain }.make::<C>();
                make::<T, C>(Line { map, v, source: &source, kernel, row: b, out: wide });
                assert!(out[0] == out[1], "row {v} of {C} channels, Lanczos {}", kernel.is_some());
            }
        }
    }

    #[test]
    fn wide_rows_are_the_same_to_the_bit() {
        let params = vec![70.0, 71.0, 48.3, 29.7, -0.25, 0.06, 0.001, -0.002, 0.01];
        let camera = Camera::new(Model::Brown5, [101, 61], params).unwrap();
        // Some of the output shows nothing.
        let target = Camera::new(Model::Pinhole, [107, 67], vec![60.0, 60.0, 50.0, 30.0]).unwrap();
        let map = Map::new(&camera, &target).unwrap();
        compare::<u8, 1>(&map, |v| v as u8);
        compare::<u8, 3>(&map, |v| v as u8);
        compare::<u8, 4>(&map, |v| v as u8);
        compare::<u16, 3>(&map, |v| v as u16);
    }
}
