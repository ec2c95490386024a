//! Whether residuals have a pattern in the picture: Moran's I with a permutation test.

use nalgebra::Vector2;
use rand::{SeedableRng, seq::SliceRandom};
use rand_pcg::Pcg64;
use serde::{Deserialize, Serialize};

/// A residual at its place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placed {
    /// Place in the picture, px.
    pub px: Vector2<f64>,
    /// The picture that it belongs to.
    pub view: usize,
    /// The residual, px.
    pub residual_px: Vector2<f64>,
}

/// Which pairs of residuals are compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Pairs {
    /// Of different views: what they share at one place of the picture is the lens.
    BetweenViews,
    /// Of one view: what neighbouring corners share is the board, the pose, or the detector.
    WithinViews,
}

/// Moran's I of a field of residuals.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Moran {
    /// Mean of rᵢ·rⱼ over neighbouring pairs / mean of |r|²: 0 without a pattern, 1 where neighbours are equal.
    pub index: f64,
    /// The same in standard deviations from its mean over permutations.
    pub z: f64,
    /// Share of permutations that reach the index or more (the unpermuted one counted, so it is never 0).
    pub p: f64,
    /// Pairs compared.
    pub pairs: usize,
}

impl Moran {
    /// Whether there is a pattern at the 1 % level.
    pub fn is_significant(&self) -> bool {
        self.p < 0.01
    }
}

/// Measures Moran's I over pairs nearer than `radius_px`. The null distribution comes from `permutations` seeded shuffles of the
/// residuals within each view, so that views may differ in size of error. `None` where no pairs are that near or all residuals
/// vanish.
///
/// P. A. P. Moran, *Biometrika* 37, 1950, for vectors.
pub fn moran(
    field: &[Placed],
    pairs: Pairs,
    radius_px: f64,
    permutations: usize,
    seed: u64,
) -> Option<Moran> {
    let is_pair = |a: &Placed, b: &Placed| {
        (a.view == b.view) == (pairs == Pairs::WithinViews) && (a.px - b.px).norm() < radius_px
    };
    let list: Vec<[usize; 2]> = (0..field.len())
        .flat_map(|i| (0..i).filter(move |j| is_pair(&field[i], &field[*j])).map(move |j| [i, j]))
        .collect();
    let mut values: Vec<Vector2<f64>> = field.iter().map(|f| f.residual_px).collect();
    let power = values.iter().map(Vector2::norm_squared).sum::<f64>() / values.len().max(1) as f64;
    if list.is_empty() || power.is_nan() || power <= 0.0 {
        return None;
    }
    let index = |values: &[Vector2<f64>]| {
        list.iter().map(|&[i, j]| values[i].dot(&values[j])).sum::<f64>() / (list.len() as f64 * power)
    };
    let found = index(&values);
    let mut views: Vec<Vec<usize>> = Vec::new();
    for (i, f) in field.iter().enumerate() {
        views.resize(views.len().max(f.view + 1), Vec::new());
        views[f.view].push(i);
    }
    let mut random = Pcg64::seed_from_u64(seed);
    let (mut sum, mut squares, mut reached) = (0.0, 0.0, 1usize);
    for _ in 0..permutations {
        for view in &views {
            let mut shuffled: Vec<_> = view.iter().map(|i| values[*i]).collect();
            shuffled.shuffle(&mut random);
            for (i, v) in view.iter().zip(shuffled) {
                values[*i] = v;
            }
        }
        let by_chance = index(&values);
        sum += by_chance;
        squares += by_chance * by_chance;
        reached += usize::from(by_chance >= found);
    }
    let n = permutations.max(1) as f64;
    let deviation = (squares / n - (sum / n).powi(2)).max(0.0).sqrt();
    Some(Moran {
        index: found,
        z: if deviation > 0.0 { (found - sum / n) / deviation } else { 0.0 },
        p: reached as f64 / (permutations + 1) as f64,
        pairs: list.len(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_distr::{Distribution, Normal};

    /// Four views of a grid; noise plus `pattern` times a smooth field.
    fn field(pattern: f64, seed: u64) -> Vec<Placed> {
        let mut random = Pcg64::seed_from_u64(seed);
        let normal = Normal::new(0.0, 1.0).unwrap();
        let mut out = Vec::new();
        for view in 0..4 {
            for (x, y) in (0..80).map(|i| (f64::from(i % 10) * 20.0, f64::from(i / 10) * 20.0)) {
                let smooth = Vector2::new((x / 50.0).sin(), (y / 40.0).cos()) * pattern;
                let noise = Vector2::new(normal.sample(&mut random), normal.sample(&mut random));
                let px = Vector2::new(x + 3.0 * view as f64, y);
                out.push(Placed { px, view, residual_px: smooth + noise });
            }
        }
        out
    }

    #[test]
    fn a_pattern_is_found_and_noise_is_not() {
        for pairs in [Pairs::BetweenViews, Pairs::WithinViews] {
            let run = |pattern, seed| moran(&field(pattern, seed), pairs, 25.0, 299, 1).unwrap();
            let seen = run(0.7, 1);
            assert!(seen.is_significant() && seen.z > 4.0 && seen.index > 0.1, "{pairs:?} {seen:?}");
            let false_alarms = (0..40).filter(|s| run(0.0, *s).p < 0.1).count();
            assert!((0..=10).contains(&false_alarms), "{pairs:?}: {false_alarms} of 40 at the 10 % level");
        }
        assert!(moran(&field(0.0, 1), Pairs::WithinViews, 1.0, 9, 1).is_none());
        assert!(moran(&[], Pairs::WithinViews, 1.0, 9, 1).is_none());
    }
}
