//! Streams of random numbers: one per seed, view and effect, independent of the order of drawing.

use rand_pcg::Pcg64;

/// Starts the stream of `effect` in `view`.
pub(super) fn stream(seed: u64, view: usize, effect: u64) -> Pcg64 {
    let a = mix(seed ^ 0x5eed);
    let b = mix(a ^ view as u64);
    let c = mix(b ^ effect.wrapping_mul(0x0100_0000_01b3));
    Pcg64::new(u128::from(a) << 64 | u128::from(c), u128::from(mix(c)))
}

/// SplitMix64's finaliser (Steele, Lea, Flood, OOPSLA 2014): neighbouring numbers give unrelated ones.
const fn mix(z: u64) -> u64 {
    let z = z.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}
