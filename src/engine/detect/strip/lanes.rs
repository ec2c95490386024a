//! Arithmetic of eight lanes that compiles to a few vector instructions on every target.

/// Lanes of a block: one 256-bit or two 128-bit registers of f32.
pub(super) const LANES: usize = 8;

/// Eight numbers handled together.
pub(super) type Block = [f32; LANES];

/// `a b + c`, fused where the hardware does it (elsewhere `mul_add` would be a call into libm).
#[inline(always)]
pub(super) fn fma(a: f32, b: f32, c: f32) -> f32 {
    if cfg!(target_feature = "fma") { a.mul_add(b, c) } else { a * b + c }
}

/// `x` limited to ±`r`: two instructions, where `f32::clamp` would also keep NaN.
#[inline(always)]
pub(super) fn limit(x: f32, r: f32) -> f32 {
    let y = if x < r { x } else { r };
    if y > -r { y } else { -r }
}

/// `Σ c_j y^j` by Horner's rule.
#[inline(always)]
pub(super) fn polynomial(c: &[f32; 7], y: f32) -> f32 {
    fma(fma(fma(fma(fma(fma(c[6], y, c[5]), y, c[4]), y, c[3]), y, c[2]), y, c[1]), y, c[0])
}
