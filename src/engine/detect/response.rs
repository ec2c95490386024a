//! Where a checkerboard corner may be: the response of a ring of samples, and its peaks.
//!
//! At a corner, samples a quarter turn apart on a ring differ and those half a turn apart agree, whatever the rotation:
//!
//! ```text
//! R = Σ₀³ |Iₙ + Iₙ₊₈ − Iₙ₊₄ − Iₙ₊₁₂| − Σ₀⁷ |Iₙ − Iₙ₊₈| − |Σ₀¹⁵ Iₙ − 16 · middle|
//! ```
//!
//! (S. Bennett & J. Lasenby, "ChESS – Quick and robust detection of chess-board features", CVIU 118, 2014). The second sum
//! takes edges out, the third stripes. All in `i16`, in lanes along the rows.

use crate::image::Plane;

/// Offsets `(x, y)` of 16 samples on a ring; sample n + 8 is opposite of sample n, and n grows from −y over +x to +y.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Ring {
    pub(crate) offsets: [(i32, i32); 16],
    /// Largest offset.
    pub(crate) radius: usize,
}

/// The usual ring.
pub(crate) static RING: Ring = Ring {
    offsets: [
        (0, -5),
        (2, -5),
        (3, -3),
        (5, -2),
        (5, 0),
        (5, 2),
        (3, 3),
        (2, 5),
        (0, 5),
        (-2, 5),
        (-3, 3),
        (-5, 2),
        (-5, 0),
        (-5, -2),
        (-3, -3),
        (-2, -5),
    ],
    radius: 5,
};

/// For squares of less than 8 px.
pub(crate) static SMALL_RING: Ring = Ring {
    offsets: [
        (0, -3),
        (1, -3),
        (2, -2),
        (3, -1),
        (3, 0),
        (3, 1),
        (2, 2),
        (1, 3),
        (0, 3),
        (-1, 3),
        (-2, 2),
        (-3, 1),
        (-3, 0),
        (-3, -1),
        (-2, -2),
        (-1, -3),
    ],
    radius: 3,
};

/// The response at every pixel, zero within the radius of the border.
pub(crate) fn response(picture: &Plane<u8>, ring: &Ring) -> Plane<i16> {
    let (w, h, r) = (picture.width(), picture.height(), ring.radius);
    let mut out = Plane::new(w, h);
    if w <= 2 * r || h <= 2 * r {
        return out;
    }
    let n = w - 2 * r;
    for y in r..h - r {
        let shifted = |(dx, dy): (i32, i32)| {
            let x = (r as i32 + dx) as usize;
            &picture.row((y as i32 + dy) as usize)[x..x + n]
        };
        let s = ring.offsets.map(shifted);
        let middle = [(-1, 0), (1, 0), (0, -1), (0, 1)].map(shifted);
        row(&s, &middle, &mut out.row_mut(y)[r..r + n]);
    }
    out
}

fn row(s: &[&[u8]; 16], middle: &[&[u8]; 4], out: &mut [i16]) {
    // Blocks of a fixed length let the compiler keep everything in registers without checks.
    const BLOCK: usize = 32;
    let n = out.len();
    let mut x = 0;
    while x < n {
        // The last block overlaps the one before it.
        let at = if x + BLOCK <= n { x } else { n.saturating_sub(BLOCK) };
        if n < BLOCK {
            for (i, to) in out.iter_mut().enumerate() {
                *to = pixel(|k| i16::from(s[k][i]), |k| i16::from(middle[k][i]));
            }
            return;
        }
        let block = |p: &[u8]| -> [i16; BLOCK] {
            let mut wide = [0i16; BLOCK];
            for (to, v) in wide.iter_mut().zip(&p[at..at + BLOCK]) {
                *to = i16::from(*v);
            }
            wide
        };
        let mut sum = [0i16; BLOCK];
        let mut result = [0i16; BLOCK];
        for k in 0..4 {
            let (a, b, c, d) = (block(s[k]), block(s[k + 8]), block(s[k + 4]), block(s[k + 12]));
            for i in 0..BLOCK {
                let (p, q) = (a[i] + b[i], c[i] + d[i]);
                result[i] += (p - q).abs() - (a[i] - b[i]).abs() - (c[i] - d[i]).abs();
                sum[i] += p + q;
            }
        }
        let (m0, m1, m2, m3) = (block(middle[0]), block(middle[1]), block(middle[2]), block(middle[3]));
        for i in 0..BLOCK {
            result[i] -= (sum[i] - 4 * (m0[i] + m1[i] + m2[i] + m3[i])).abs();
        }
        out[at..at + BLOCK].copy_from_slice(&result);
        x += BLOCK;
    }
}

fn pixel(s: impl Fn(usize) -> i16, middle: impl Fn(usize) -> i16) -> i16 {
    let mut result = 0;
    let mut sum = 0;
    for k in 0..4 {
        let (a, b, c, d) = (s(k), s(k + 8), s(k + 4), s(k + 12));
        result += (a + b - c - d).abs() - (a - b).abs() - (c - d).abs();
        sum += a + b + c + d;
    }
    result - (sum - 4 * (0..4).map(middle).sum::<i16>()).abs()
}

/// Pixels whose response exceeds `threshold` and is the largest of their 5 × 5 neighbours.
pub(crate) fn peaks(response: &Plane<i16>, threshold: i16) -> Vec<[usize; 2]> {
    const REACH: usize = 2;
    let (w, h) = (response.width(), response.height());
    let mut list = Vec::new();
    if w < 2 * REACH + 1 {
        return list;
    }
    for y in REACH..h.saturating_sub(REACH) {
        let row = response.row(y);
        // Most blocks hold nothing: one comparison for all of it.
        for start in (REACH..w - REACH).step_by(32) {
            let block = &row[start..(start + 32).min(w - REACH)];
            if block.iter().fold(i16::MIN, |m, v| m.max(*v)) <= threshold {
                continue;
            }
            for x in start..start + block.len() {
                let v = row[x];
                if v > threshold && is_peak(response, x, y, v, REACH) {
                    list.push([x, y]);
                }
            }
        }
    }
    list
}

/// Of equal neighbours the first in reading order is the peak.
fn is_peak(response: &Plane<i16>, x: usize, y: usize, v: i16, reach: usize) -> bool {
    (y - reach..=y + reach).all(|j| {
        response.row(j)[x - reach..=x + reach].iter().enumerate().all(|(k, other)| {
            let before = (j, x + k - reach) < (y, x);
            if before { *other < v } else { *other <= v }
        })
    })
}

/// Peak of the parabolas through a pixel and its neighbours, relative to the pixel, ±0.5.
pub(crate) fn vertex(response: &Plane<i16>, x: usize, y: usize) -> [f64; 2] {
    let at = |x: usize, y: usize| f64::from(response.at(x, y));
    let along = |a: f64, b: f64, c: f64| {
        let bend = a - 2.0 * b + c;
        if bend < 0.0 { (0.5 * (a - c) / bend).clamp(-0.5, 0.5) } else { 0.0 }
    };
    if x == 0 || y == 0 || x + 1 >= response.width() || y + 1 >= response.height() {
        return [0.0; 2];
    }
    [along(at(x - 1, y), at(x, y), at(x + 1, y)), along(at(x, y - 1), at(x, y), at(x, y + 1))]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn board() -> Plane<u8> {
        Plane::from_fn(97, 80, |x, y| {
            let (u, v) = (x as f64 - 0.3 * y as f64, y as f64 + 0.2 * x as f64);
            let odd = ((u / 17.0).floor() + (v / 17.0).floor()).rem_euclid(2.0) > 0.5;
            if odd { 210 } else { 40 }
        })
    }

    #[test]
    fn rings_are_symmetric() {
        for ring in [&RING, &SMALL_RING] {
            for n in 0..8 {
                let ((x, y), (u, v)) = (ring.offsets[n], ring.offsets[n + 8]);
                assert_eq!((x, y), (-u, -v));
                let ((x, y), (u, v)) = (ring.offsets[n], ring.offsets[n + 4]);
                assert_eq!((x, y), (v, -u), "a quarter turn");
            }
        }
    }

    #[test]
    fn blocks_equal_the_formula() {
        let board = board();
        for ring in [&RING, &SMALL_RING] {
            let fast = response(&board, ring);
            let r = ring.radius;
            for (x, y) in (r..97 - r).flat_map(|x| (r..80 - r).map(move |y| (x, y))) {
                let at = |(dx, dy): (i32, i32)| {
                    i16::from(board.at((x as i32 + dx) as usize, (y as i32 + dy) as usize))
                };
                let middle = [(-1, 0), (1, 0), (0, -1), (0, 1)];
                assert_eq!(fast.at(x, y), pixel(|k| at(ring.offsets[k]), |k| at(middle[k])), "{x} {y}");
            }
        }
        assert_eq!(response(&Plane::new(9, 40), &RING).data().iter().max(), Some(&0));
        let narrow = Plane::from_fn(20, 40, |x, y| board.at(x, y));
        let wide = response(&board, &RING);
        assert_eq!(response(&narrow, &RING).at(12, 20), wide.at(12, 20));
    }

    #[test]
    fn peaks_are_at_corners_only() {
        let board = board();
        let r = response(&board, &RING);
        let found = peaks(&r, 200);
        assert!(found.len() >= 12, "{}", found.len());
        for [x, y] in found {
            let (u, v) = (x as f64 - 0.3 * y as f64, y as f64 + 0.2 * x as f64);
            let off = |c: f64| (c / 17.0 - (c / 17.0).round()).abs() * 17.0;
            assert!(off(u) < 2.0 && off(v) < 2.0, "{x} {y}");
        }
        // A plateau has one peak.
        let flat = Plane::from_fn(20, 20, |x, y| if (8..10).contains(&x) && y == 9 { 300i16 } else { 0 });
        assert_eq!(peaks(&flat, 200), [[8, 9]]);
    }
}
