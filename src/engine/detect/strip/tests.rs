//! The strip fit against exact truth.

pub(crate) mod scene;

use super::*;
use crate::image::Sample;
use scene::{Scene, noisy, rng, rounded, view};

const ANGLES: [f64; 5] = [0.0, 0.02, 0.3, 0.78, 1.2];

/// Errors of the corners at least `border` px inside the picture, px; every one of them must be accepted.
fn errors<T: Sample>(scene: &Scene, picture: &Plane<T>, starts: &[Start], border: f64) -> Vec<f64> {
    let fits = refine(picture, starts, &Options::default());
    let mut errors = Vec::new();
    for (fit, truth) in fits.iter().zip(scene.truths()) {
        if scene.sees(truth, border) {
            assert!(fit.ok, "{truth} {fit:?}");
            errors.push((fit.px - truth).norm());
        }
    }
    errors
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|e| e * e).sum::<f64>() / values.len() as f64).sqrt()
}

/// Checks RMS and largest error.
fn within(what: &str, errors: &[f64], bound_rms: f64, bound: f64) {
    let (rms, worst) = (rms(errors), errors.iter().copied().fold(0.0, f64::max));
    println!("{what}: {} corners, rms {rms:.4}, worst {worst:.4}", errors.len());
    assert!(!errors.is_empty() && rms < bound_rms && worst < bound, "{what}: rms {rms}, worst {worst}");
}

#[test]
fn sharp_corners_are_found_to_a_hundredth_of_a_pixel() {
    // squares of 30, 18 and 9 px that perspective makes up to a third smaller
    for (side, cols, off, bound_rms, bound) in
        [(30.0, 3, 2.0, 0.005, 0.01), (18.0, 5, 1.5, 0.005, 0.02), (9.0, 8, 0.6, 0.01, 0.035)]
    {
        let mut all = Vec::new();
        for (n, angle) in ANGLES.into_iter().enumerate() {
            let mut scene = Scene::new([cols, cols], view(side, angle, 0.002, [70.37, 20.71]));
            scene.samples = 377;
            let starts = scene.starts(off, &mut rng(n as u64));
            all.extend(errors(&scene, &rounded::<u8>(&scene.render()), &starts, 6.0));
        }
        within(&format!("squares of {side}"), &all, bound_rms, bound);
    }
}

#[test]
fn errors_scatter_as_their_sigma_says() {
    for (noise, blur, cols, bound_px) in [(5.0, 0.0, 4, 0.012), (5.0, 1.0, 4, 0.02), (10.0, 0.7, 4, 0.04)] {
        let (mut whitened, mut all) = (Vec::new(), Vec::new());
        for (n, angle) in ANGLES.into_iter().enumerate() {
            let scene = Scene::new([cols, cols], view(26.0, angle, 5e-4, [70.37, 25.71])).blurred(blur);
            let picture = scene.render();
            for seed in 0..16 {
                let rng = &mut rng(1000 * n as u64 + seed);
                let starts = scene.starts(1.0, rng);
                let fits = refine(&noisy(&picture, noise, rng), &starts, &Options::default());
                for (fit, truth) in fits.iter().zip(scene.truths()).filter(|(_, t)| scene.sees(*t, 14.0)) {
                    assert!(fit.ok);
                    let e = fit.px - truth;
                    whitened.push(e.x / fit.cov_px2[0].sqrt());
                    whitened.push(e.y / fit.cov_px2[2].sqrt());
                    all.push(e.norm());
                }
            }
        }
        let std = rms(&whitened);
        println!("noise {noise} blur {blur}: std of error/σ {std:.3}");
        assert!((0.9..1.1).contains(&std), "noise {noise} blur {blur}: {std}");
        within(&format!("noise {noise} blur {blur}"), &all, bound_px, 6.0 * bound_px);
    }
}

#[test]
fn strong_blur_and_motion_are_only_wider_profiles() {
    let sharp = Scene::new([4, 4], view(34.0, 0.2, 3e-4, [38.3, 22.7]));
    for (blur, bound_rms) in [(1.0, 0.002), (2.5, 0.002), (5.0, 0.01)] {
        let scene = sharp.clone().blurred(blur);
        let starts = scene.starts(1.5, &mut rng(3));
        let picture = rounded::<u8>(&scene.render());
        within(&format!("blur {blur}"), &errors(&scene, &picture, &starts, 14.0), bound_rms, 4.0 * bound_rms);
        let fits = refine(&picture, &starts, &Options::default());
        let widths: Vec<f64> = fits.iter().flat_map(|f| f.blur_px).collect();
        assert!((rms(&widths) / blur - 1.0).abs() < 0.1, "blur {blur} measured as {}", rms(&widths));
    }
    let (scene, sharp) = (&sharp, sharp.render());
    let motion = Plane::from_fn(160, 160, |x, y| {
        (0..7).map(|d| sharp.at((x + d).saturating_sub(3).min(159), y)).sum::<f32>() / 7.0
    });
    let starts = scene.starts(1.5, &mut rng(4));
    within("motion 7", &errors(scene, &rounded::<u8>(&motion), &starts, 14.0), 0.008, 0.02);
}

#[test]
fn neighbours_give_the_curvature_of_the_edges() {
    let mut scene = Scene::new([5, 5], view(33.0, 0.1, 0.0, [13.3, 11.7]));
    scene.k1 = -4e-6; // curvature up to 2.5e-3, three times that of a strong wide-angle lens
    let starts = scene.starts(1.0, &mut rng(8));
    let picture = rounded::<u8>(&scene.render());
    let all = errors(&scene, &picture, &starts, 10.0);
    within("bent", &all, 0.012, 0.05);
    let alone = refine(&picture, &starts, &Options { board_terms: false, ..Options::default() });
    let inside = alone.iter().zip(scene.truths()).filter(|(_, t)| scene.sees(*t, 10.0));
    let alone: Vec<f64> = inside.map(|(f, t)| (f.px - t).norm()).collect();
    assert!(rms(&alone) > 2.0 * rms(&all), "{} {}", rms(&alone), rms(&all));
}

#[test]
fn squares_from_7_to_300_px() {
    for (side, size, cols, off, bound_rms, bound) in [
        (7.0, 120, 12, 0.5, 0.005, 0.015),
        (12.0, 120, 7, 1.0, 0.003, 0.01),
        (300.0, 900, 2, 2.0, 0.004, 0.01),
    ] {
        let mut all = Vec::new();
        for (n, angle) in [0.05, 0.2].into_iter().enumerate() {
            let mut scene =
                Scene::new([cols, cols], view(side, angle, 0.0, [0.3 * size as f64, 12.9])).blurred(0.5);
            (scene.size, scene.samples) = ([size; 2], if size > 500 { 8 } else { 34 });
            let starts = scene.starts(off, &mut rng(n as u64));
            all.extend(errors(&scene, &rounded::<u8>(&scene.render()), &starts, 10.0));
        }
        within(&format!("squares of {side}"), &all, bound_rms, bound);
    }
}

#[test]
fn false_starts_are_refused() {
    let (mut tried, mut wrong) = (0, 0);
    for (n, angle) in ANGLES.into_iter().enumerate() {
        for (noise, blur) in [(0.0, 0.0), (10.0, 0.0), (5.0, 1.5)] {
            let scene = Scene::new([4, 4], view(26.0, angle, 5e-4, [70.37, 25.71])).blurred(blur);
            let rng = &mut rng(n as u64);
            let picture = noisy(&scene.render(), noise, rng);
            let (truths, mut starts) = (scene.truths(), scene.starts(0.0, rng));
            let along = truths[1] - truths[0];
            let down = truths[4] - truths[0];
            for shift in [0.5 * along, 0.5 * down, 0.5 * (along + down), 0.3 * along + 0.2 * down] {
                for (s, t) in starts.iter_mut().zip(&truths) {
                    s.px = t + shift;
                }
                for (fit, start) in refine(&picture, &starts, &Options::default()).iter().zip(&starts) {
                    tried += 1;
                    let nearest = truths.iter().map(|t| (t - fit.px).norm()).fold(f64::MAX, f64::min);
                    wrong += usize::from(fit.ok && nearest > 0.5);
                    assert!(fit.ok || fit.px == start.px);
                }
            }
        }
    }
    assert_eq!(wrong, 0, "of {tried}");
}

#[test]
fn nothing_is_found_in_noise() {
    let flat = Plane::from_fn(160, 160, |_, _| 128.0);
    let scene = Scene::new([6, 6], view(22.0, 0.1, 0.0, [20.0, 15.0]));
    let mut accepted = 0;
    for seed in 0..20 {
        let rng = &mut rng(seed);
        let starts = scene.starts(1.0, rng);
        let fits = refine(&noisy(&flat, 20.0, rng), &starts, &Options::default());
        accepted += fits.iter().filter(|f| f.ok).count();
    }
    assert_eq!(accepted, 0, "of 720");
}

#[test]
fn any_part_of_a_grid_will_do() {
    let scene = Scene::new([6, 6], view(21.0, 0.15, 0.001, [28.4, 14.8]));
    let (picture, all) = (rounded::<u8>(&scene.render()), scene.starts(1.0, &mut rng(5)));
    // an L, a diagonal staircase, and single rows hanging on one corner
    let parts: [&[usize]; 3] =
        [&[0, 6, 12, 18, 24, 30, 31, 32, 33], &[0, 1, 7, 8, 14, 15, 21, 22, 28], &[8, 9, 10, 11, 14, 20, 26]];
    for part in parts {
        let place = |q: u32| part.iter().position(|p| *p == q as usize).map(|p| p as u32);
        let starts: Vec<Start> = part
            .iter()
            .map(|&q| Start { px: all[q].px, neighbours: all[q].neighbours.map(|n| place(n?)) })
            .collect();
        let fits = refine(&picture, &starts, &Options::default());
        for (fit, q) in fits.iter().zip(part) {
            let error = (fit.px - scene.truths()[*q]).norm();
            assert!(fit.ok && error < 0.02, "{q} of {part:?}: {error} {fit:?}");
        }
    }
}

#[test]
fn corners_near_the_border_are_used() {
    // the first row and column of corners lie 3 to 7 px inside the picture
    let (mut ok, mut seen, mut all) = (0, 0, Vec::new());
    for (n, (at, angle)) in [([3.4, 4.1], 0.0), ([5.2, 6.3], 0.02), ([7.3, 3.2], -0.03), ([4.3, 6.8], 0.01)]
        .into_iter()
        .enumerate()
    {
        let scene = Scene::new([6, 6], view(29.0, angle, 0.0, at)).blurred(0.6);
        let starts = scene.starts(1.0, &mut rng(n as u64));
        let picture = noisy(&scene.render(), 2.0, &mut rng(n as u64 + 10));
        for (fit, truth) in refine(&picture, &starts, &Options::default()).iter().zip(scene.truths()) {
            let rim = scene.sees(truth, 3.0) && !scene.sees(truth, 8.0);
            seen += usize::from(rim);
            if fit.ok {
                ok += usize::from(rim);
                all.push((fit.px - truth).norm());
            }
        }
    }
    println!("{ok} of {seen} near the border");
    assert!(ok * 10 >= seen * 9, "{ok} of {seen}");
    within("near the border", &all, 0.01, 0.03);
}

#[test]
fn sixteen_bits_are_eight_bits_scaled() {
    let scene = Scene::new([4, 4], view(30.0, 0.2, 5e-4, [38.3, 22.7]));
    let rng = &mut rng(6);
    let eight = noisy(&scene.render(), 4.0, rng);
    let starts = scene.starts(1.0, rng);
    let a = refine(&eight, &starts, &Options::default());
    let b = refine(&eight.map(|v| u16::from(v) * 257), &starts, &Options::default());
    for (a, b) in a.iter().zip(&b) {
        assert!(a.ok && b.ok && (a.px - b.px).norm() < 1e-4, "{a:?} {b:?}");
        assert!((b.sigma_px() / a.sigma_px() - 1.0).abs() < 1e-3);
        assert!((b.sigma_gray / a.sigma_gray / 257.0 - 1.0).abs() < 1e-3);
        assert!((b.amplitude / a.amplitude / 257.0 - 1.0).abs() < 1e-4);
    }
    // a dark picture of 10 bits in 16
    let dark = refine(&eight.map(|v| u16::from(v) * 4), &starts, &Options::default());
    assert!(a.iter().zip(&dark).all(|(a, b)| (a.px - b.px).norm() < 1e-4));
}

#[test]
fn nonsense_is_refused_without_a_panic() {
    let scene = Scene::new([4, 4], view(30.0, 0.2, 5e-4, [38.3, 22.7]));
    let good = scene.starts(0.0, &mut rng(0));
    let refused = |picture: &Plane<u8>, starts: &[Start]| {
        let fits = refine(picture, starts, &Options::default());
        assert_eq!(fits.len(), starts.len());
        fits.iter().all(|f| !f.ok)
    };
    for size in [[0, 0], [1, 1], [3, 200], [200, 3], [7, 7]] {
        assert!(refused(&Plane::new(size[0], size[1]), &good));
    }
    assert!(refused(&Plane::from_fn(160, 160, |_, _| 255), &good));
    let picture = rounded::<u8>(&scene.render());
    for bad in [f64::NAN, f64::INFINITY, -1e300, 1e9, -40.0, 400.0] {
        let moved = |s: &Start| Start { px: s.px.map(|v| v + bad), ..*s };
        assert!(refused(&picture, &good.iter().map(moved).collect::<Vec<_>>()), "{bad}");
        let mut one = good.clone();
        one[5].px.x = bad;
        let fits = refine(&picture, &one, &Options::default());
        assert!(!fits[5].ok && fits.iter().filter(|f| f.ok).count() >= 11, "{bad}");
    }
    for neighbours in [[None; 4], [Some(99); 4], [Some(0); 4], [Some(5); 4], [Some(1), Some(1), None, None]] {
        let linked: Vec<Start> = good.iter().map(|s| Start { px: s.px, neighbours }).collect();
        refine(&picture, &linked, &Options::default());
    }
    let one_place: Vec<Start> = good.iter().map(|s| Start { px: good[0].px, ..*s }).collect();
    assert!(refused(&picture, &one_place));
    assert!(refine(&picture, &[], &Options::default()).is_empty());
}
