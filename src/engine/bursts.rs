//! Pictures that show nearly the same pose are one: what holds for one of them holds for the other by itself, so they are no new
//! pictures to each other in a cross-validation.

use nalgebra::Vector2;

use super::observation::Observation;

/// Mean distance of equal corners, in diagonals of the picture.
const NEAR: f64 = 0.01;

/// The corners of one picture: index on the board, ascending, and place, px.
pub type Corners = Vec<(u32, Vector2<f64>)>;

/// The corners of an observation.
pub fn corners(observation: &Observation) -> Corners {
    observation.corners.iter().map(|c| (c.index, c.px)).collect()
}

/// For each picture its group, numbered from 0 in the order of their first pictures.
pub fn groups(pictures: &[Corners], size_px: [u32; 2]) -> Vec<usize> {
    let [w, h] = size_px.map(f64::from);
    let near = NEAR * w.hypot(h);
    let mut groups: Vec<usize> = Vec::with_capacity(pictures.len());
    let mut count = 0;
    for (i, picture) in pictures.iter().enumerate() {
        // The latest first: a burst follows one another, and its ends may be apart.
        let same = pictures[..i].iter().zip(&groups).rev().find(|(other, _)| alike(picture, other, near));
        let group = same.map_or(count, |(_, group)| *group);
        count = count.max(group + 1);
        groups.push(group);
    }
    groups
}

/// Mean distance of equal corners below which two pictures repeat one pose, in diagonals of the picture.
const SAME: f64 = 0.003;

/// For each picture its group, as in [`groups`], but of pictures that hardly differ from the first of theirs: what may be averaged. A slow
/// film is no such group.
pub fn repeated(pictures: &[Corners], size_px: [u32; 2]) -> Vec<usize> {
    let [w, h] = size_px.map(f64::from);
    let same = SAME * w.hypot(h);
    let mut groups: Vec<usize> = Vec::with_capacity(pictures.len());
    let mut firsts: Vec<usize> = Vec::new();
    for (i, picture) in pictures.iter().enumerate() {
        let found = firsts.iter().position(|first| alike(picture, &pictures[*first], same));
        groups.push(found.unwrap_or(firsts.len()));
        if found.is_none() {
            firsts.push(i);
        }
    }
    groups
}

/// Whether more than half of the corners are in both pictures, nearly at one place.
fn alike(a: &Corners, b: &Corners, near: f64) -> bool {
    let (mut sum, mut n) = (0.0, 0usize);
    let mut others = b.iter().peekable();
    for (index, px) in a {
        while others.next_if(|o| o.0 < *index).is_some() {}
        if let Some((_, other)) = others.next_if(|o| o.0 == *index) {
            let distance = (px - other).norm();
            // Most pairs are far apart, which one corner tells.
            if distance > 4.0 * near {
                return false;
            }
            sum += distance;
            n += 1;
        }
    }
    2 * n > a.len().max(b.len()) && sum <= near * n as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn board(x: f64) -> Corners {
        (0..54).map(|i| (i, Vector2::new(x + f64::from(i % 9) * 30.0, f64::from(i / 9) * 30.0))).collect()
    }

    #[test]
    fn a_burst_is_one_pose() {
        let part = board(200.0)[20..].to_vec();
        let pictures = [board(0.0), board(6.0), board(200.0), part, board(12.0), board(0.0)[..10].to_vec()];
        // A diagonal of 1000 px: up to 10 px are near.
        assert_eq!(groups(&pictures, [800, 600]), [0, 0, 1, 1, 0, 2]);
    }
}
