//! Rows made in wide registers and without them.

use super::{Line, Source, bilinear::Blend, lanczos::Kernel};
use crate::{
    camera::{Camera, Model},
    undistort::{Map, map::Row},
    wide::{self, Kernel as _},
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
            let [plain, wide_out] = &mut out;
            Line::<T, C> { map, v, source: &source, kernel, row: a, out: plain }.run();
            wide::run(Line::<T, C> { map, v, source: &source, kernel, row: b, out: wide_out });
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
