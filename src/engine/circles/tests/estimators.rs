//! The fit beside two other ways to a centre, on the same dots: the conic of the gradients and the moments of the grey values.

use nalgebra::{Matrix5, Point2, Vector2, Vector3, Vector5};

use super::{
    accuracy::{POSES, shot},
    render::Shot,
};
use crate::{
    circles::{GridDot, bias, detect},
    image::{Gray, Plane},
};

/// Pixels within 1.5 radii and their grey values.
fn around(p: &Plane<u8>, dot: &GridDot) -> Vec<(usize, usize)> {
    let [a, b, c] = dot.ellipse;
    let det = a * c - b * b;
    let reach = [a, c].map(|v| 1.5 * v.sqrt() + 2.0);
    let range = |k: usize, n: usize| {
        (dot.px[k] - reach[k]).max(1.0) as usize..((dot.px[k] + reach[k]) as usize + 1).min(n - 1)
    };
    let inside = |x: usize, y: usize| {
        let d = Vector2::new(x as f64, y as f64) - dot.px;
        (c * d.x * d.x - 2.0 * b * d.x * d.y + a * d.y * d.y) / det < 1.5 * 1.5
    };
    range(1, p.height())
        .flat_map(|y| range(0, p.width()).map(move |x| (x, y)))
        .filter(|(x, y)| inside(*x, *y))
        .collect()
}

/// The dual conic that touches the lines across the gradients, weighted by their squares (Ouellet & Hébert 2009).
fn dual_conic(p: &Plane<u8>, dot: &GridDot) -> Vector2<f64> {
    let (mut normal, mut right) = (Matrix5::zeros(), Vector5::zeros());
    let size = dot.ellipse[0].sqrt();
    for (x, y) in around(p, dot) {
        let at = |dx: i32, dy: i32| f64::from(p.at((x as i32 + dx) as usize, (y as i32 + dy) as usize));
        let gx = (at(1, -1) - at(-1, -1) + 2.0 * (at(1, 0) - at(-1, 0)) + at(1, 1) - at(-1, 1)) / 8.0;
        let gy = (at(-1, 1) - at(-1, -1) + 2.0 * (at(0, 1) - at(0, -1)) + at(1, 1) - at(1, -1)) / 8.0;
        let u = (Vector2::new(x as f64, y as f64) - dot.px) / size;
        // The line with this gradient through the pixel: l = (a, b, c), lᵀ C* l = 0 with C*₃₃ = 1.
        let l = Vector3::new(gx, gy, -(gx * u.x + gy * u.y));
        let weight = 1.0 / (gx * gx + gy * gy + 1e-9);
        let by = Vector5::new(l.x * l.x, l.x * l.y, l.y * l.y, l.x * l.z, l.y * l.z);
        normal += by * by.transpose() * weight;
        right -= by * (l.z * l.z * weight);
    }
    let c = normal.cholesky().unwrap().solve(&right);
    // lᵀ C* l = A a² + B a b + C b² + D a c + E b c + c²: the centre is (D/2, E/2).
    dot.px + Vector2::new(c[3], c[4]) * (0.5 * size)
}

/// Centroid of how much each pixel is ink.
fn moments(p: &Plane<u8>, dot: &GridDot) -> Vector2<f64> {
    let list = around(p, dot);
    let paper = list.iter().map(|(x, y)| p.at(*x, *y)).max().map_or(0.0, f64::from);
    let (mut sum, mut weight) = (Vector2::zeros(), 0.0);
    for (x, y) in list {
        let ink = paper - f64::from(p.at(x, y));
        sum += Vector2::new(x as f64, y as f64) * ink;
        weight += ink;
    }
    sum / weight
}

#[test]
fn the_fit_is_the_best_of_three() {
    for (name, change) in [
        ("clean", (|_: &mut Shot| ()) as fn(&mut Shot)),
        ("sharp", |s| s.blur_px = 0.0),
        ("blur 2", |s| s.blur_px = 2.0),
        ("noise 5", |s| s.noise = 5.0),
        ("slope", |s| s.slope = 0.8),
        ("small dots, noise 2", |s| (s.radius, s.noise) = (0.15, 2.0)),
    ] {
        let (mut sums, mut n) = ([0.0; 3], 0.0);
        for (euler, distance) in POSES {
            let mut s = shot(euler, distance);
            change(&mut s);
            let picture = s.picture();
            let Gray::U8(p) = &picture else { panic!() };
            let (truth, points) = (s.centers(), s.board.points(1.0));
            for dot in detect(&picture).grid.unwrap().dots {
                let near = |i: &usize| (truth[*i] - dot.px).norm();
                let i = (0..truth.len()).min_by(|a, b| near(a).total_cmp(&near(b))).unwrap();
                let at = Point2::new(points[i].x, points[i].y);
                let want = truth[i] + bias::offset(&s.camera, &s.camera_from_board, &at, s.radius).unwrap();
                for (sum, px) in sums.iter_mut().zip([dot.px, dual_conic(p, &dot), moments(p, &dot)]) {
                    *sum += (px - want).norm_squared();
                }
                n += 1.0;
            }
        }
        let [fit, conic, moments] = sums.map(|s: f64| (s / n).sqrt());
        println!("{name:20} fit {fit:.4}, dual conic {conic:.4}, moments {moments:.4} px");
        // Moments have no model to be wrong, but nothing against noise and light.
        assert!(fit < conic && (fit < moments || fit < 0.007), "{name}");
    }
}
