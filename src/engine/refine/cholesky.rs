//! Cholesky factors of the leading `n × n` part of small fixed arrays; only lower triangles are read and written. The diagonal of a
//! factor holds reciprocals.

/// Replaces the lower triangle of `a` by its factor; `false` where `a` is not positive definite.
#[inline(always)]
pub(super) fn factor<const N: usize>(a: &mut [[f64; N]; N], n: usize) -> bool {
    for j in 0..n {
        let mut d = a[j][j];
        for k in 0..j {
            d -= a[j][k] * a[j][k];
        }
        // A pivot that lost all digits is rounding, not information.
        if !(d > 1e-15 * a[j][j] && d.is_finite()) {
            return false;
        }
        let inverse = 1.0 / d.sqrt();
        a[j][j] = inverse;
        for i in j + 1..n {
            let mut s = a[i][j];
            for k in 0..j {
                s -= a[i][k] * a[j][k];
            }
            a[i][j] = s * inverse;
        }
    }
    true
}

/// `b ← L⁻¹ b`.
#[inline(always)]
pub(super) fn forward<const N: usize>(l: &[[f64; N]; N], b: &mut [f64], n: usize) {
    for i in 0..n {
        let mut s = b[i];
        for k in 0..i {
            s -= l[i][k] * b[k];
        }
        b[i] = s * l[i][i];
    }
}

/// `b ← L⁻ᵀ b`.
#[inline(always)]
pub(super) fn backward<const N: usize>(l: &[[f64; N]; N], b: &mut [f64], n: usize) {
    for i in (0..n).rev() {
        let mut s = b[i];
        for k in i + 1..n {
            s -= l[k][i] * b[k];
        }
        b[i] = s * l[i][i];
    }
}
