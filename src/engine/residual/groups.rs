//! Pictures that show nearly the same are one: what holds for one of them holds for the other by itself.

use crate::surface::ViewRows;

/// Mean distance of equal corners, in diagonals of the picture.
const NEAR: f64 = 0.01;

/// Gives each view its group, in the order of their first pictures; the number of groups.
pub(super) fn assign(views: &mut [ViewRows], size_px: [u32; 2]) -> usize {
    let [w, h] = size_px.map(f64::from);
    let near = NEAR * w.hypot(h);
    let mut count = 0;
    for i in 0..views.len() {
        let (before, rest) = views.split_at_mut(i);
        let Some(view) = rest.first_mut() else { break };
        // The latest first: a burst follows one another, and its ends may be apart.
        view.group = match before.iter().rev().find(|other| alike(view, other, near)) {
            Some(other) => other.group,
            None => {
                count += 1;
                count - 1
            }
        };
    }
    count
}

fn alike(a: &ViewRows, b: &ViewRows, near: f64) -> bool {
    let (mut sum, mut n) = (0.0, 0usize);
    let mut others = b.rows.iter().peekable();
    for row in &a.rows {
        while others.next_if(|o| o.index < row.index).is_some() {}
        if let Some(other) = others.next_if(|o| o.index == row.index) {
            let distance = (row.seen_px - other.seen_px).norm();
            if distance > 4.0 * near {
                return false;
            }
            sum += distance;
            n += 1;
        }
    }
    2 * n > a.rows.len().max(b.rows.len()) && sum <= near * n as f64
}
