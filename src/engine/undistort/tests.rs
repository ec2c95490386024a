mod wide;

use nalgebra::{Point3, Vector2};

use super::*;
use crate::image::Samples;

fn brown(size: [u32; 2], f: f64, d: [f64; 5]) -> Camera {
    let [w, h] = size.map(|n| 0.5 * (f64::from(n) - 1.0));
    let values = [
        ("fx", f),
        ("fy", f * 1.01),
        ("cx", w + 3.2),
        ("cy", h - 2.1),
        ("k1", d[0]),
        ("k2", d[1]),
        ("p1", d[2]),
        ("p2", d[3]),
        ("k3", d[4]),
    ];
    Camera::from_named(Model::Brown5, size, &values).unwrap()
}

fn seed() -> Camera {
    let values = [
        ("fx", 1000.0),
        ("fy", 1000.0),
        ("cx", 400.0),
        ("cy", 300.0),
        ("k1", -0.28),
        ("k2", 0.1),
        ("p1", 0.001),
        ("p2", 0.002),
    ];
    Camera::from_named(Model::Brown5, [800, 600], &values).unwrap()
}

/// Barrel, pincushion, moustache, strong tangential terms; the last four fold inside the picture.
fn lenses() -> Vec<Camera> {
    vec![
        seed(),
        brown([640, 480], 533.0, [-0.2854, 0.064, 1.1e-3, -1.3e-4, 0.0]),
        brown([640, 480], 600.0, [0.15, 0.05, 0.0, 0.0, 0.0]),
        brown([480, 640], 500.0, [-0.3, 0.2, 0.01, -0.02, -0.05]),
        brown([1280, 720], 1157.0, [-0.24, -0.02, -1e-3, 1e-4, 0.02]),
        brown([641, 1], 400.0, [-0.1, 0.0, 0.0, 0.0, 0.0]),
        brown([640, 480], 500.0, [-0.5, 0.0, 0.0, 0.0, 0.0]),
        brown([640, 480], 300.0, [-0.3, 0.05, 1e-3, 1e-3, 0.0]),
        brown([640, 480], 260.0, [-0.3, 0.12, 0.0, 0.0, -0.02]),
        brown([1280, 720], 400.0, [0.3, -0.6, 1e-3, -2e-3, 0.1]),
    ]
}

fn photo(size: [u32; 2], channels: usize, wide: bool) -> Photo {
    let [width, height] = size.map(|n| n as usize);
    let value = |i: usize| {
        let (c, x, y) = (i % channels, i / channels % width, i / channels / width);
        let wave = ((x as f64 / 7.3).sin() + (y as f64 / 11.9 + c as f64).cos()) * 45.0;
        120.0 + wave + if (x / 16 + y / 16) % 2 == 0 { -12.0 } else { 12.0 }
    };
    let n = width * height * channels;
    let samples = if wide {
        Samples::U16((0..n).map(|i| (value(i) * 256.0) as u16).collect())
    } else {
        Samples::U8((0..n).map(|i| value(i) as u8).collect())
    };
    Photo { width, height, channels, samples }
}

fn values(photo: &Photo) -> Vec<f64> {
    match &photo.samples {
        Samples::U8(s) => s.iter().copied().map(f64::from).collect(),
        Samples::U16(s) => s.iter().copied().map(f64::from).collect(),
    }
}

#[test]
fn without_distortion_nothing_changes() {
    for params in Model::Pinhole.spec().examples {
        let camera = Camera::new(Model::Pinhole, [64, 48], params.to_vec()).unwrap();
        for alpha in [0.0, 0.3, 1.0] {
            let target = new_camera(&camera, alpha).unwrap();
            for (a, b) in target.params.iter().zip(&camera.params) {
                assert!((a - b).abs() < 1e-9 * b, "{alpha}: {:?} {:?}", target.params, camera.params);
            }
            for interpolation in [Interpolation::Bilinear, Interpolation::Lanczos] {
                for (channels, wide) in [(1, false), (3, true), (4, false)] {
                    let photo = photo(camera.size_px, channels, wide);
                    assert_eq!(
                        straighten(&photo, &camera, &Framing::flat(alpha), true, interpolation).unwrap(),
                        photo
                    );
                }
            }
        }
    }
}

#[test]
fn alpha_0_has_no_black_pixel_and_touches_the_border() {
    for camera in lenses().into_iter().filter(|c| c.size_px[1] > 1) {
        let target = new_camera(&camera, 0.0).unwrap();
        let map = Map::new(&camera, &target).unwrap();
        assert!(map.mask().data().iter().all(|v| *v == 255), "{camera:?}");
        let [w, h] = camera.size_px;
        assert_eq!(largest_valid(&map), Some(Rect { x: 0, y: 0, width: w, height: h }));
        // A view 0.2 % wider, wherever it is put within ± 0.1 %, has black pixels.
        for shift in [-0.5, -0.25, 0.0, 0.25, 0.5] {
            for other in [-0.5, 0.0, 0.5] {
                let mut wider = target.clone();
                for (i, s) in [(0, shift), (1, other)] {
                    wider.params[i] *= 0.998;
                    let last = f64::from(camera.size_px[i]) - 1.0;
                    wider.params[i + 2] =
                        0.5 * last + (target.params[i + 2] - 0.5 * last) * 0.998 + s * 0.002 * last;
                }
                let map = Map::new(&camera, &wider).unwrap();
                assert!(map.mask().data().contains(&0), "{camera:?} {shift} {other}");
            }
        }
    }
}

#[test]
fn alpha_1_keeps_every_pixel_that_has_a_ray() {
    for camera in lenses() {
        let target = new_camera(&camera, 1.0).unwrap();
        let [w, h] = camera.size_px.map(|n| f64::from(n) - 1.0);
        let fold = camera.fold_rad();
        let (mut kept, mut low, mut high) = (0, [f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for j in 0..=60 {
            for i in 0..=60 {
                let px = Vector2::new(w * f64::from(i) / 60.0, h * f64::from(j) / 60.0);
                let Some(ray) = camera.unproject(&px) else { continue };
                if ray.x.hypot(ray.y).atan2(ray.z) > fold.min(MAX_ANGLE_RAD) {
                    continue;
                }
                let at = target.project(&Point3::from(ray)).unwrap();
                for (k, last) in [w, h].into_iter().enumerate() {
                    assert!((-0.01..=last + 0.01).contains(&at[k]) || h == 0.0, "{camera:?} {px} → {at}");
                    (low[k], high[k]) = (low[k].min(at[k]), high[k].max(at[k]));
                }
                kept += 1;
            }
        }
        assert!(kept > 1000 || h == 0.0, "{camera:?}: {kept}");
        // Tight in at least one direction, as far as the grid can tell: beside a fold a pixel shows much.
        let slack = [w, h]
            .into_iter()
            .enumerate()
            .map(|(k, last)| last - (high[k] - low[k]))
            .fold(f64::MAX, f64::min);
        assert!(slack < if reach(&camera).beyond > 0.0 { 40.0 } else { 0.5 }, "{camera:?}: {slack}");
    }
}

#[test]
fn the_view_grows_steadily_with_alpha() {
    for camera in lenses().into_iter().filter(|c| c.size_px[1] > 1) {
        let view = |alpha: f64| {
            let t = new_camera(&camera, alpha).unwrap();
            let [fx, fy, cx, cy] = t.intrinsics();
            assert!(
                (fy / fx / (camera.params[1] / camera.params[0]) - 1.0).abs() < 1e-12,
                "squares stay squares"
            );
            let [w, h] = t.size_px.map(|n| f64::from(n) - 1.0);
            [-cx / fx, -cy / fy, (cx - w) / fx, (cy - h) / fy] // left, top, −right, −bottom
        };
        let steps: Vec<_> = (0..=20).map(|i| view(f64::from(i) / 20.0)).collect();
        for k in 0..4 {
            let whole = steps[0][k] - steps[20][k];
            for pair in steps.windows(2) {
                let step = pair[0][k] - pair[1][k];
                assert!(step >= -1e-12 && (step - whole / 20.0).abs() < 1e-9, "{camera:?} {step} {whole}");
            }
        }
    }
}

#[test]
fn small_changes_of_the_lens_change_the_view_little() {
    for camera in lenses().into_iter().filter(|c| c.size_px[1] > 1) {
        for alpha in [0.0, 1.0] {
            let before = new_camera(&camera, alpha).unwrap();
            for k in 0..9 {
                let mut other = camera.clone();
                other.params[k] += if k < 4 { 1e-3 } else { 1e-6 };
                let after = new_camera(&other, alpha).unwrap();
                let change = (0..4).map(|i| (after.params[i] - before.params[i]).abs()).fold(0.0, f64::max);
                assert!(change < 0.3, "{camera:?} α {alpha} parameter {k}: {change} px");
            }
        }
    }
}

#[test]
fn no_lens_makes_the_view_explode() {
    // A polynomial that turns back inside the picture, as in opencv#22711, and worse.
    for d in [
        [-0.5, 0.3, 0.0, 0.0, -0.3],
        [-1.2, 2.0, 0.01, 0.01, -1.0],
        [0.5, -2.0, 0.0, 0.0, 1.0],
        [-0.8, 0.0, 0.05, -0.05, 0.0],
        [10.0, -100.0, 0.0, 0.0, 300.0],
        [-3.0, 5.0, 0.1, 0.1, -40.0],
        [1e6, 0.0, 0.0, 0.0, 0.0],
        [-1e6, 0.0, 0.0, 0.0, 0.0],
        [0.0, 0.0, 5.0, 5.0, 0.0],
    ] {
        for f in [300.0, 700.0, 5000.0] {
            let camera = brown([640, 480], f, d);
            for alpha in [0.0, 0.5, 1.0] {
                let target = match new_camera(&camera, alpha) {
                    Ok(target) => target,
                    Err(e) => {
                        assert!(matches!(e, Error::Degenerate(_)), "{e}");
                        continue;
                    }
                };
                let [fx, fy, cx, cy] = target.intrinsics();
                assert!([fx, fy, cx, cy].into_iter().all(f64::is_finite));
                // Half the view is at most tan 80° wide.
                assert!(fx > 319.5 / MAX_ANGLE_RAD.tan() - 1.0, "{d:?} {f}: {fx}");
                let map = Map::new(&camera, &target).unwrap();
                let ghosts = (0..=20)
                    .flat_map(|j| (0..=20).map(move |i| [f64::from(i) * 31.95, f64::from(j) * 23.95]))
                    .filter(|[u, v]| {
                        map.at(*u, *v).is_some_and(|px| {
                            let ray = nalgebra::Vector3::new((u - cx) / fx, (v - cy) / fy, 1.0).normalize();
                            // The way back leads to the same ray, not to one on this side of a fold.
                            camera.unproject(&px).is_some_and(|back| (back - ray).norm() > 1e-4)
                        })
                    })
                    .count();
                assert_eq!(ghosts, 0, "{d:?} {f} α {alpha}");
                if alpha == 0.0 {
                    assert!(map.border_is_valid(), "{d:?} {f}");
                }
            }
        }
    }
}

#[test]
fn folds_are_warned_of() {
    assert_eq!(warnings(&seed(), Projection::Perspective), []);
    let folding = brown([640, 480], 500.0, [-0.5, 0.0, 0.0, 0.0, 0.0]);
    let warned = warnings(&folding, Projection::Perspective);
    assert_eq!(warned[0].code, "model_folds");
    assert!(warned[0].text.contains("272 px") && warned[0].text.contains("39.2°"), "{}", warned[0].text);
    let r = reach(&folding);
    // Counted over all pixels: beyond the ellipse of 272 × 275 px radius.
    assert!((r.beyond - 0.2757).abs() < 0.01, "{}", r.beyond);
}

#[test]
fn straight_lines_become_straight() {
    let camera = seed();
    let target = new_camera(&camera, 0.5).unwrap();
    let map = Map::new(&camera, &target).unwrap();
    // Exact points: the map sends the image of a point under the pinhole to its image under the lens.
    for i in 0..50 {
        let p =
            Point3::new(-0.4 + 0.016 * f64::from(i), 0.2 - 0.004 * f64::from(i), 1.0 + 0.01 * f64::from(i));
        let at = target.project(&p).unwrap();
        if let Some(px) = map.at(at.x, at.y) {
            assert!((px - camera.project(&p).unwrap()).norm() < 1e-9);
        }
    }
    // Pixels: a soft edge along a line in space, photographed and straightened; its crossings lie on a line.
    let line = |ray: &nalgebra::Vector3<f64>| 0.9 * ray.y / ray.z + 0.25 * ray.x / ray.z - 0.12;
    let samples = (0..600 * 800)
        .map(|i| {
            let ray = camera.unproject(&Vector2::new(f64::from(i % 800), f64::from(i / 800))).unwrap();
            (32768.0 + 30000.0 * (line(&ray) * 300.0).tanh()) as u16
        })
        .collect();
    let photo = Photo { width: 800, height: 600, channels: 1, samples: Samples::U16(samples) };
    for interpolation in [Interpolation::Bilinear, Interpolation::Lanczos] {
        let out = map.remap(&photo, interpolation).unwrap();
        let v = values(&out);
        let [fx, fy, cx, cy] = target.intrinsics();
        let mut checked = 0;
        for x in (0..800).step_by(10) {
            let column: Vec<f64> = (0..600).map(|y| v[y * 800 + x]).collect();
            let cross = column.windows(2).position(|p| p[0] > 1000.0 && (p[0] < 32768.0) != (p[1] < 32768.0));
            let Some(y) = cross else { continue };
            let found = y as f64 + (32768.0 - column[y]) / (column[y + 1] - column[y]);
            let truth = cy + fy * (0.12 - 0.25 * (x as f64 - cx) / fx) / 0.9;
            let from = map.at(x as f64, found).unwrap_or_default();
            if from.x < 4.0 || from.x > 795.0 || from.y < 4.0 || from.y > 595.0 {
                continue; // taps beyond the border
            }
            assert!((found - truth).abs() < 0.01, "{interpolation:?} {x}: {}", found - truth);
            checked += 1;
        }
        assert!(checked > 60, "{checked}");
    }
}

/// Weights of the pixels −2 … 3 around a fraction in exact arithmetic.
fn weights(t: f64, interpolation: Interpolation) -> [f64; 6] {
    let sinc =
        |x: f64| if x == 0.0 { 1.0 } else { (std::f64::consts::PI * x).sin() / (std::f64::consts::PI * x) };
    let x: [f64; 6] = std::array::from_fn(|k| k as f64 - 2.0 - t);
    match interpolation {
        Interpolation::Bilinear => x.map(|x| (1.0 - x.abs()).max(0.0)),
        Interpolation::Lanczos => {
            let mut w = x.map(|x| if x.abs() < 3.0 { sinc(x) * sinc(x / 3.0) } else { 0.0 });
            let [m0, m1] = [0, 1].map(|n| (0..6).map(|k| w[k] * x[k].powi(n)).sum::<f64>());
            w[3] += t * (1.0 - m0) - m1;
            w[2] += (1.0 - t) * (1.0 - m0) + m1;
            w
        }
    }
}

/// Interpolation in exact arithmetic at exact positions.
fn exact(photo: &Photo, map: &Map, interpolation: Interpolation) -> Vec<f64> {
    let v = values(photo);
    let (w, h, c) = (photo.width as i64, photo.height as i64, photo.channels);
    let at = |x: i64, y: i64, k: usize| v[(y.clamp(0, h - 1) * w + x.clamp(0, w - 1)) as usize * c + k];
    let [ow, oh] = map.size();
    let mut out = Vec::new();
    for i in 0..ow * oh {
        let Some(px) = map.at((i % ow) as f64, (i / ow) as f64) else {
            out.extend(std::iter::repeat_n(0.0, c));
            continue;
        };
        let [wx, wy] = [px.x, px.y].map(|p| weights(p - p.floor(), interpolation));
        for k in 0..c {
            let mut sum = 0.0;
            for (y, wy) in (px.y.floor() as i64 - 2..).zip(wy) {
                for (x, wx) in (px.x.floor() as i64 - 2..).zip(wx) {
                    sum += wx * wy * at(x, y, k);
                }
            }
            out.push(sum);
        }
    }
    out
}

#[test]
fn remapping_is_within_rounding_of_exact_interpolation() {
    for camera in [
        brown([203, 151], 160.0, [-0.3, 0.1, 1e-3, 1e-3, 0.0]),
        brown([97, 64], 70.0, [0.3, 0.0, 0.0, 0.0, 0.0]),
    ] {
        let map = Map::new(&camera, &new_camera(&camera, 0.7).unwrap()).unwrap();
        for (channels, wide) in [(1, false), (2, false), (3, false), (4, false), (1, true), (3, true)] {
            let photo = photo(camera.size_px, channels, wide);
            for interpolation in [Interpolation::Bilinear, Interpolation::Lanczos] {
                let out = values(&map.remap(&photo, interpolation).unwrap());
                let exact = exact(&photo, &map, interpolation);
                assert_eq!(out.len(), exact.len());
                // Half a level of rounding, and the position's: bilinear 1/2048 px at 8 bits and 1/16384 at 16, Lanczos 1/2048.
                let worst = out.iter().zip(&exact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                let bound = match (wide, interpolation) {
                    (false, _) => 0.6,
                    (true, Interpolation::Bilinear) => 1.5,
                    (true, Interpolation::Lanczos) => 12.0,
                };
                assert!(worst < bound, "{channels} {wide} {interpolation:?}: {worst}");
            }
        }
    }
}

#[test]
fn kept_positions_are_the_same() {
    for camera in lenses() {
        let photo = photo(camera.size_px, 3, false);
        for alpha in [0.0, 1.0] {
            let mut straight = Straightener::new(&camera, &Framing::flat(alpha), false).unwrap();
            for how in [Interpolation::Bilinear, Interpolation::Lanczos] {
                let fresh = straight.run(&photo, how).unwrap();
                let mask = straight.map.mask();
                let mut keeping = straight.clone();
                keeping.keep();
                assert!(
                    keeping.run(&photo, how).unwrap() == fresh && keeping.map.mask() == mask,
                    "{alpha} {how:?}"
                );
            }
            straight.keep();
            assert!(straight.map.mask().data().contains(&255));
        }
    }
}

#[test]
fn bands_of_rows_are_the_whole() {
    let camera = seed();
    let map = Map::new(&camera, &new_camera(&camera, 1.0).unwrap()).unwrap();
    let photo = photo(camera.size_px, 3, false);
    let whole = values(&map.remap(&photo, Interpolation::Lanczos).unwrap());
    let bands: Vec<f64> = [0..150, 150..151, 151..600]
        .into_iter()
        .flat_map(|rows| values(&map.remap_rows(&photo, Interpolation::Lanczos, rows).unwrap()))
        .collect();
    assert_eq!(whole, bands);
    assert!(map.remap_rows(&photo, Interpolation::Lanczos, 10..601).is_err());
}

#[test]
fn the_mask_is_what_the_map_says() {
    for camera in lenses() {
        for alpha in [0.4, 1.0] {
            let map = Map::new(&camera, &new_camera(&camera, alpha).unwrap()).unwrap();
            let mask = map.mask();
            for v in 0..mask.height() {
                for u in 0..mask.width() {
                    assert_eq!(
                        mask.at(u, v) == 255,
                        map.at(u as f64, v as f64).is_some(),
                        "{camera:?} {u} {v}"
                    );
                }
            }
        }
    }
}

#[test]
fn the_crop_is_the_largest_valid_rectangle() {
    for camera in [
        brown([47, 33], 30.0, [-0.3, 0.1, 1e-3, 1e-3, 0.0]),
        brown([30, 41], 40.0, [0.4, 0.1, 0.0, 0.0, 0.0]),
        brown([40, 40], 20.0, [-0.3, 0.0, 0.0, 0.0, 0.0]),
    ] {
        let target = new_camera(&camera, 1.0).unwrap();
        let map = Map::new(&camera, &target).unwrap();
        let mask = map.mask();
        let (w, h) = (mask.width(), mask.height());
        let mut most = 0;
        for y in 0..h {
            let mut ok = vec![true; w];
            for bottom in y..h {
                let mut run = 0;
                for x in 0..w {
                    ok[x] &= mask.at(x, bottom) == 255;
                    run = if ok[x] { run + 1 } else { 0 };
                    most = most.max(run * (bottom + 1 - y));
                }
            }
        }
        let rect = largest_valid(&map).unwrap();
        assert_eq!((rect.width * rect.height) as usize, most);
        let straightener = Straightener::new(&camera, &Framing::flat(1.0), true).unwrap();
        assert_eq!(straightener.view.size_px, [rect.width, rect.height]);
        assert!(straightener.map.mask().data().iter().all(|v| *v == 255));
        // The cut camera shows the same rays.
        let p = Point3::new(0.1, -0.05, 1.0);
        let (a, b) = (target.project(&p).unwrap(), straightener.view.camera().unwrap().project(&p).unwrap());
        assert!((a - b - Vector2::new(f64::from(rect.x), f64::from(rect.y))).norm() < 1e-12);
    }
}

#[test]
fn the_smallest_pictures_survive() {
    for size in [[1, 1], [1, 7], [7, 1], [2, 2], [2, 1], [3, 2]] {
        let camera = brown(size, 50.0, [-0.2, 0.0, 1e-3, 0.0, 0.0]);
        for alpha in [0.0, 1.0] {
            for interpolation in [Interpolation::Bilinear, Interpolation::Lanczos] {
                for crop in [false, true] {
                    let out = straighten(
                        &photo(size, 3, false),
                        &camera,
                        &Framing::flat(alpha),
                        crop,
                        interpolation,
                    )
                    .unwrap();
                    assert!(crop || [out.width as u32, out.height as u32] == size);
                }
            }
        }
    }
    let one = brown([1, 1], 50.0, [-0.2, 0.0, 1e-3, 0.0, 0.0]);
    let photo = photo([1, 1], 3, false);
    assert_eq!(straighten(&photo, &one, &Framing::flat(0.0), false, Interpolation::Bilinear).unwrap(), photo);
}

#[test]
fn displacement_of_the_built_in_scene() {
    let d = displacement(&seed(), 50).unwrap();
    assert_eq!((d.nodes, d.at_px[0].last(), d.at_px[1].last()), ([17, 13], Some(&799), Some(&599)));
    let [dx, dy] = d.field[0].unwrap();
    assert!(dx > 0.0 && dy > 0.0, "barrel distortion points to the middle");
    let middle = d.field[6 * 17 + 8].unwrap();
    assert!(middle[0].hypot(middle[1]) < 1e-6, "{middle:?}");
    // The diagonal is 1000 px.
    assert!(
        (d.largest_px - 33.525).abs() < 1e-3 && (d.largest_percent - 3.3525).abs() < 1e-4,
        "{}",
        d.largest_px
    );
    assert_eq!(d.largest_at, [0, 0]);
    assert!(displacement(&seed(), 0).is_err());
}

#[test]
fn wrong_requests_are_refused() {
    let camera = seed();
    for alpha in [-0.1, 1.1, f64::NAN] {
        assert!(matches!(new_camera(&camera, alpha), Err(Error::Invalid(_))));
    }
    let mut broken = camera.clone();
    broken.params[4] = f64::NAN;
    assert!(matches!(new_camera(&broken, 0.0), Err(Error::Invalid(_))));
    assert!(matches!(Map::new(&camera, &camera), Err(Error::Invalid(_))));
    let small = photo([799, 600], 1, false);
    let message = straighten(&small, &camera, &Framing::flat(0.0), false, Interpolation::Bilinear)
        .unwrap_err()
        .to_string();
    assert!(message.contains("799 x 600") && message.contains("800 x 600"), "{message}");
    assert!("cubic".parse::<Interpolation>().is_err());
}

#[test]
fn a_lens_with_a_residual_field_is_mapped_as_exactly() {
    use crate::residual::{Corrected, Field};
    let camera = brown([640, 480], 533.0, [-0.2854, 0.064, 1.1e-3, -1.3e-4, 0.0]);
    let mut offsets = vec![[0.0; 2]; 13 * 9];
    (offsets[58], offsets[59], offsets[84]) = ([0.8, -0.5], [0.6, 0.4], [-0.5, 0.3]);
    // At the border too: α = 0 must take it in.
    offsets[5] = [0.4, -1.2];
    let field = Field::new([-0.5; 2], [64.0, 80.0], [13, 9], offsets).unwrap();
    let lens = Corrected { camera: camera.clone(), field: field.clone() };
    let straight = Straightener::new(&lens, &Framing::flat(0.0), false).unwrap();
    assert!(straight.map.mask().data().iter().all(|v| *v == 255));
    let mut row = map::Row::default();
    let (mut worst, mut largest) = (0.0f64, 0.0f64);
    let plain = Map::new(&camera, &straight.view.camera().unwrap()).unwrap();
    for v in 0..480 {
        straight.map.row(v, &mut row);
        for u in 0..640 {
            let at = straight.map.at(u as f64, v as f64).unwrap();
            let fixed = Vector2::new(f64::from(row.x[u]), f64::from(row.y[u])) / f64::from(map::ONE);
            worst = worst.max((fixed - at).amax());
            if let Some(without) = plain.at(u as f64, v as f64) {
                let moved = at - without;
                largest = largest.max(moved.norm());
                assert!((moved - field.at(&without)).norm() < 1e-9 || at.x == 0.0 || at.y == 0.0);
            }
        }
    }
    println!("rows differ by {worst:.1e} px, the field moves by up to {largest:.2} px");
    assert!(worst < 1.1e-4 && largest > 0.4);
}
