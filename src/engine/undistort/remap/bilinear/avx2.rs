//! [`Taps::group`] by instructions of AVX2, which the compiler does not find by itself: two pixels in one register, the right samples of
//! each beside the left ones.

use std::arch::x86_64::{
    __m256i, _mm_set_epi64x, _mm_set1_epi16, _mm256_add_epi16, _mm256_bsrli_epi128, _mm256_cvtepu8_epi16,
    _mm256_extract_epi32, _mm256_mulhi_epi16, _mm256_packus_epi16, _mm256_set_m128i, _mm256_set1_epi16,
    _mm256_slli_epi16, _mm256_srai_epi16, _mm256_sub_epi16,
};

use super::{BLOCK, Source, Taps};

/// The same as [`Taps::group`] to the bit.
#[target_feature(enable = "avx2")]
pub(crate) fn group<const C: usize>(taps: &Taps, source: &Source<'_, u8>, out: &mut [u8; BLOCK * 4 + 4]) {
    let stride = source.width * C;
    for i in (0..BLOCK).step_by(2) {
        let [top, bottom] = taps.lines(source, i, stride);
        let [next_top, next_bottom] = taps.lines(source, i + 1, stride);
        let [first, second] = pair::<C>(
            both(top, next_top),
            both(bottom, next_bottom),
            each(taps.x[i], taps.x[i + 1]),
            each(taps.y[i], taps.y[i + 1]),
        );
        for (k, blended) in [(i, first), (i + 1, second)] {
            // What is written too much the next pixel overwrites.
            let valid = i32::from_le_bytes([taps.valid[k]; 4]);
            out[k * C..k * C + 4].copy_from_slice(&(blended & valid).to_le_bytes());
        }
    }
}

/// Eight samples of each of two pixels, in 16 bits.
#[inline]
#[target_feature(enable = "avx2")]
fn both(first: u64, second: u64) -> __m256i {
    _mm256_cvtepu8_epi16(_mm_set_epi64x(second.cast_signed(), first.cast_signed()))
}

/// A fraction of each of two pixels, for all their samples.
#[inline]
#[target_feature(enable = "avx2")]
fn each(first: i16, second: i16) -> __m256i {
    _mm256_set_m128i(_mm_set1_epi16(second), _mm_set1_epi16(first))
}

/// Blends two pixels of `C` channels: [`super::down`], [`super::across`] and [`super::round`].
#[inline]
#[target_feature(enable = "avx2")]
fn pair<const C: usize>(top: __m256i, bottom: __m256i, x: __m256i, y: __m256i) -> [i32; 2] {
    let fall = _mm256_slli_epi16::<7>(_mm256_sub_epi16(bottom, top));
    let left = _mm256_add_epi16(_mm256_slli_epi16::<5>(top), _mm256_mulhi_epi16(fall, y));
    let right = if C == 3 { _mm256_bsrli_epi128::<6>(left) } else { _mm256_bsrli_epi128::<8>(left) };
    let rise = _mm256_slli_epi16::<2>(_mm256_sub_epi16(right, left));
    let sum = _mm256_add_epi16(left, _mm256_mulhi_epi16(rise, x));
    let whole = _mm256_srai_epi16::<5>(_mm256_add_epi16(sum, _mm256_set1_epi16(17)));
    let bytes = _mm256_packus_epi16(whole, whole);
    [_mm256_extract_epi32::<0>(bytes), _mm256_extract_epi32::<4>(bytes)]
}
