//! The source document's renderer: one filled polygon per square, its vertices cut to whole pixels.
//!
//! Filling is `cv2.fillPoly`'s: the interior by scan lines, and the outline with 8-connected lines, so that every
//! square is half a pixel larger all round than its polygon. Later squares paint over the outlines of earlier ones.

use nalgebra::Point3;

use super::{Cut, Scene, surface::Surface};
use crate::{image::Plane, pose::Pose};

/// Draws the board; squares with a vertex that the camera cannot see are left out.
pub(super) fn picture(scene: &Scene, camera_from_board: &Pose, cut: Cut) -> Plane<f32> {
    let [w, h] = scene.camera.size_px.map(|n| n as usize);
    let (board, levels) = (&scene.board, scene.board.levels);
    let surface = Surface::new(board, scene.degrade.bend);
    let vertex = |x: f64, y: f64| -> Option<[i64; 2]> {
        let p: Point3<f64> = surface.lift(x * board.square, y * board.square);
        let px = scene.camera.project(&camera_from_board.apply(&p))?;
        let whole = |v: f64| match cut {
            Cut::Truncate => v.trunc(),
            Cut::Round => v.round_ties_even(),
        };
        // Far outside any picture; keeps the products of the filling within range.
        (px.x.abs() < 1e6 && px.y.abs() < 1e6).then(|| [whole(px.x) as i64, whole(px.y) as i64])
    };
    let quad = |x: [f64; 2], y: [f64; 2]| -> Option<[[i64; 2]; 4]> {
        Some([vertex(x[0], y[0])?, vertex(x[1], y[0])?, vertex(x[1], y[1])?, vertex(x[0], y[1])?])
    };
    let mut picture = Plane::from_fn(w, h, |_, _| f32::from(levels.background));
    let [x_ends, y_ends] = board.extent_squares();
    if board.margin > 0.0
        && let Some(q) = quad(x_ends, y_ends)
    {
        fill(&mut picture, &q, f32::from(levels.white));
    }
    for j in -1..board.size.rows as i32 {
        for i in -1..board.size.cols as i32 {
            let level = if (i + j) % 2 == 0 { levels.black } else { levels.white };
            let ends = |n: i32| [f64::from(n), f64::from(n + 1)];
            if let Some(q) = quad(ends(i), ends(j)) {
                fill(&mut picture, &q, f32::from(level));
            }
        }
    }
    picture
}

/// Fills a polygon with whole-pixel vertices, outline included.
fn fill(picture: &mut Plane<f32>, polygon: &[[i64; 2]; 4], level: f32) {
    let (w, h) = (picture.width() as i64, picture.height() as i64);
    let edges = (0..4).map(|i| (polygon[i], polygon[(i + 1) % 4]));
    let (mut top, mut bottom) = (i64::MAX, i64::MIN);
    for p in polygon {
        top = top.min(p[1]);
        bottom = bottom.max(p[1]);
    }
    for y in top.max(0)..bottom.min(h) {
        // Crossings of the line through the pixel centres; an edge owns its upper end, not its lower.
        let mut crossings = [0.0f64; 4];
        let mut n = 0;
        for (a, b) in edges.clone() {
            let (a, b) = if a[1] <= b[1] { (a, b) } else { (b, a) };
            if a[1] <= y && y < b[1] {
                crossings[n] = a[0] as f64 + (b[0] - a[0]) as f64 * (y - a[1]) as f64 / (b[1] - a[1]) as f64;
                n += 1;
            }
        }
        crossings[..n].sort_by(f64::total_cmp);
        for pair in crossings[..n].chunks_exact(2) {
            let (from, to) = ((pair[0].ceil() as i64).max(0), (pair[1].floor() as i64).min(w - 1));
            for x in from..=to {
                picture.row_mut(y as usize)[x as usize] = level;
            }
        }
    }
    for (a, b) in edges {
        line(a, b, |x, y| {
            if (0..w).contains(&x) && (0..h).contains(&y) {
                picture.row_mut(y as usize)[x as usize] = level;
            }
        });
    }
}

/// The pixels of an 8-connected line from `a` to `b` (Bresenham 1965), drawn from left to right.
fn line(a: [i64; 2], b: [i64; 2], mut paint: impl FnMut(i64, i64)) {
    let (a, b) = if a[0] <= b[0] { (a, b) } else { (b, a) };
    let (dx, dy) = (b[0] - a[0], (b[1] - a[1]).abs());
    let down = (b[1] - a[1]).signum();
    let (long, short) = (dx.max(dy), dx.min(dy));
    let mut error = long - 2 * short;
    let [mut x, mut y] = a;
    for _ in 0..=long {
        paint(x, y);
        let aside = error < 0;
        error += if aside { 2 * long - 2 * short } else { -2 * short };
        if dx >= dy {
            x += 1;
            y += if aside { down } else { 0 };
        } else {
            y += down;
            x += i64::from(aside);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_filled_square_includes_its_outline() {
        let mut p = Plane::new(8, 6);
        fill(&mut p, &[[1, 1], [4, 1], [4, 3], [1, 3]], 1.0);
        let inside = |x: usize, y: usize| (1..=4).contains(&x) && (1..=3).contains(&y);
        assert_eq!(p, Plane::from_fn(8, 6, |x, y| f32::from(u8::from(inside(x, y)))));
    }
}
