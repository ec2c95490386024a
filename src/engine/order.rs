//! Lists in the order of numbers.
//!
//! The sort of the standard library is compiled anew for every type and every comparison, a few kilobytes each, which a page has to
//! load; here one of plain numbers serves all lists. `collect` into a set or a map sorts, too: [`set`] and [`map`] do not.

use std::collections::{BTreeMap, BTreeSet};

/// Sorts by the numbers of `key`, least first; equals by the next number, in the end as they stood. Indices are exact as `f64`.
pub fn by<T, const N: usize>(list: &mut [T], key: impl Fn(&T) -> [f64; N]) {
    const { assert!(N <= WIDTH) };
    let keys = list.iter().map(|item| {
        let mut wide = [0.0; WIDTH];
        wide[..N].copy_from_slice(&key(item));
        wide
    });
    let mut places = places(keys.collect());
    for i in 0..list.len() {
        while places[i] != i {
            let to = places[i];
            list.swap(i, to);
            places.swap(i, to);
        }
    }
}

/// Most numbers of one key.
const WIDTH: usize = 3;

/// Where each item goes.
fn places(keys: Vec<[f64; WIDTH]>) -> Vec<usize> {
    let mut order: Vec<([f64; WIDTH], usize)> = keys.into_iter().zip(0..).collect();
    order.sort_unstable_by(|a, b| {
        let first = a.0.iter().zip(&b.0).map(|(a, b)| a.total_cmp(b)).find(|o| o.is_ne());
        first.unwrap_or_else(|| a.1.cmp(&b.1))
    });
    let mut places = vec![0; order.len()];
    for (to, (_, from)) in order.into_iter().enumerate() {
        places[from] = to;
    }
    places
}

/// The set of some items.
pub fn set<T: Ord>(items: impl IntoIterator<Item = T>) -> BTreeSet<T> {
    let mut set = BTreeSet::new();
    set.extend(items);
    set
}

/// The map of some pairs; of equal keys the last counts.
pub fn map<K: Ord, V>(pairs: impl IntoIterator<Item = (K, V)>) -> BTreeMap<K, V> {
    let mut map = BTreeMap::new();
    map.extend(pairs);
    map
}

#[cfg(test)]
mod tests {
    use rand::{RngExt as _, SeedableRng as _};

    use super::*;

    /// The same order as the stable sort of the standard library, over lists with many equals.
    #[test]
    fn as_the_stable_sort() {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(3);
        for n in [0, 1, 2, 7, 500] {
            let list: Vec<(i32, u32, usize)> =
                (0..n).map(|i| (rng.random_range(-3..3), rng.random_range(0..4), i)).collect();
            let (mut ours, mut theirs) = (list.clone(), list);
            by(&mut ours, |v| [f64::from(v.0), -f64::from(v.1)]);
            theirs.sort_by_key(|v| (v.0, std::cmp::Reverse(v.1)));
            assert_eq!(ours, theirs);
        }
    }
}
