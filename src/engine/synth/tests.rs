//! Rendering against independent arithmetic; degradations against their definitions.

use nalgebra::{Point3, Vector2};

use super::*;
use crate::camera::Camera;

/// The seed scene at a fraction of its size, with one view.
fn small(view: usize, divide: u32) -> Scene {
    let mut scene = Scene::seed();
    let s = 1.0 / f64::from(divide);
    for k in 0..2 {
        scene.camera.size_px[k] /= divide;
        scene.camera.params[k] *= s;
        scene.camera.params[k + 2] = s * (scene.camera.params[k + 2] + 0.5) - 0.5;
    }
    scene.poses = vec![scene.poses[view].clone()];
    scene.seed = 1;
    scene
}

/// Mean of 32 × 32 points of each pixel, each undistorted by fixed-point iteration, without anything of the renderer.
fn brute_force(scene: &Scene) -> Plane<f32> {
    let pose = scene.camera_from_board(0).unwrap().inverse();
    let eye = pose.apply(&Point3::origin());
    let [w, h] = scene.camera.size_px.map(|n| n as usize);
    let levels = scene.board.levels;
    let p = &scene.camera.params;
    let ray = |u: f64, v: f64| {
        let (xd, yd) = ((u - p[2]) / p[0], (v - p[3]) / p[1]);
        let (mut x, mut y) = (xd, yd);
        for _ in 0..25 {
            let r2 = x * x + y * y;
            let c = 1.0 + p[4] * r2 + p[5] * r2 * r2;
            let tangential = (
                2.0 * p[6] * x * y + p[7] * (r2 + 2.0 * x * x),
                p[6] * (r2 + 2.0 * y * y) + 2.0 * p[7] * x * y,
            );
            (x, y) = ((xd - tangential.0) / c, (yd - tangential.1) / c);
        }
        Point3::new(x, y, 1.0)
    };
    let n = 32;
    Plane::from_fn(w, h, |x, y| {
        let mut sum = 0.0;
        for v in 0..n {
            for u in 0..n {
                let offset = |i: i32| (f64::from(i) + 0.5) / f64::from(n) - 0.5;
                let point = pose.apply(&ray(x as f64 + offset(u), y as f64 + offset(v)));
                let hit = eye + (point - eye) * (-eye.z / (point.z - eye.z));
                let (i, j) = ((hit.x / scene.board.square).floor(), (hit.y / scene.board.square).floor());
                let level = if i < -1.0 || j < -1.0 || i > 8.0 || j > 5.0 {
                    levels.background
                } else if (i + j) % 2.0 == 0.0 {
                    levels.black
                } else {
                    levels.white
                };
                sum += f64::from(level);
            }
        }
        (sum / f64::from(n * n)) as f32
    })
}

#[test]
fn the_exact_renderer_agrees_with_brute_force() {
    for view in [0, 9, 11] {
        let scene = small(view, 10);
        let exact = Renderer::new(&scene).unwrap().light(0).unwrap();
        let brute = brute_force(&scene);
        let errors: Vec<f64> = exact.data().iter().zip(brute.data()).map(|(a, b)| f64::from(a - b)).collect();
        let rms = (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt();
        let max = errors.iter().fold(0.0f64, |m, e| m.max(e.abs()));
        let mean = errors.iter().sum::<f64>() / errors.len() as f64;
        // 32 samples across an edge of 255 levels leave ± 4 levels where it lies along the grid.
        assert!(rms < 0.8 && max < 8.5 && mean.abs() < 0.1, "view {view}: rms {rms} max {max} mean {mean}");
    }
}

/// Where an edge crosses a row or a column of pixels, from the light along that line alone: the area under the step.
fn crossing_in(light: &Plane<f32>, near: &Vector2<f64>, along_x: bool) -> (i32, f64) {
    let (cx, cy) = (near.x.round() as i32, near.y.round() as i32);
    let reach = 5i32;
    let value = |k: i32| {
        let (x, y) = if along_x { (cx + k, cy) } else { (cx, cy + k) };
        f64::from(light.at(x as usize, y as usize))
    };
    let (a, b) = (value(-reach), value(reach));
    let area: f64 = (-reach..=reach).map(|k| (value(k) - b) / (a - b)).sum();
    let edge = area - f64::from(reach) - 0.5;
    if along_x { (cy, f64::from(cx) + edge) } else { (cx, f64::from(cy) + edge) }
}

#[test]
fn edges_in_the_picture_are_where_truth_says() {
    for bend in [0.0, 6.0] {
        let mut scene = Scene::seed();
        scene.degrade.bend = bend;
        let renderer = Renderer::new(&scene).unwrap();
        let surface = surface::Surface::new(&scene.board, bend);
        for view in [1, 9, 11] {
            let light = renderer.light(view).unwrap();
            let pose = scene.camera_from_board(view).unwrap();
            let project = |c: f64, r: f64| {
                scene.camera.project(&pose.apply(&surface.lift(30.0 * c, 30.0 * r))).unwrap()
            };
            let (mut sum, mut worst, mut n) = (0.0, 0.0f64, 0.0);
            for r in 0..6 {
                for c in 0..9 {
                    for down in [false, true] {
                        let edge = |t: f64| {
                            let (r, c) = (f64::from(r), f64::from(c));
                            if down { project(c, r + t) } else { project(c + t, r) }
                        };
                        let (line, measured) = crossing_in(&light, &edge(0.5), down);
                        // The mean of the true edge over the width of that line of pixels.
                        let (along, across) = if down { (1, 0) } else { (0, 1) };
                        let truth: f64 = (0..20)
                            .map(|i| {
                                let target = f64::from(line) + (f64::from(i) + 0.5) / 20.0 - 0.5;
                                let (mut lo, mut hi) = (0.3, 0.7);
                                for _ in 0..40 {
                                    let mid = 0.5 * (lo + hi);
                                    if edge(mid)[along] < target { lo = mid } else { hi = mid }
                                }
                                edge(lo)[across] / 20.0
                            })
                            .sum();
                        sum += measured - truth;
                        worst = worst.max((measured - truth).abs());
                        n += 1.0;
                    }
                }
            }
            assert!(
                worst < 5e-4 && f64::abs(sum / n) < 2e-5,
                "view {view}, bend {bend}: {worst} {}",
                sum / n
            );
        }
    }
}

#[test]
fn a_bent_board_moves_its_corners() {
    let flat = Scene::seed();
    let mut bent = flat.clone();
    bent.degrade.bend = 2.0;
    let shift = |i: usize| (bent.corners_px(3)[i].unwrap() - flat.corners_px(3)[i].unwrap()).norm();
    assert!(shift(0) > 0.5 && shift(4) < 1e-9, "{} {}", shift(0), shift(4));
}

#[test]
fn the_half_pixel_is_pinned() {
    // A frontal board in the middle of a picture whose principal point is (w − 1)/2: mirrored left and right, top and
    // bottom, it is itself, up to the colours of a board with an even number of squares across.
    let mut scene = Scene::seed();
    scene.camera.size_px = [120, 90];
    scene.camera.params = vec![150.0, 150.0, 59.5, 44.5, -0.28, 0.1, 0.0, 0.0, 0.0];
    scene.poses.truncate(1);
    scene.board.levels = Levels { black: 0, white: 200, background: 100 };
    let p = Renderer::new(&scene).unwrap().light(0).unwrap();
    for y in 0..90 {
        for x in 0..120 {
            assert!((p.at(x, y) - (200.0 - p.at(119 - x, y))).abs() < 2e-3, "{x} {y}");
            assert!((p.at(x, y) - p.at(x, 89 - y)).abs() < 2e-3, "{x} {y}");
        }
    }
    let middle: Vector2<f64> = scene.corners_px(0).into_iter().flatten().sum::<Vector2<f64>>() / 54.0;
    assert!((middle - Vector2::new(59.5, 44.5)).norm() < 1e-12);
}

#[test]
fn crude_pictures_are_off_by_a_pixel_at_most() {
    for cut in [Cut::Truncate, Cut::Round] {
        let mut scene = Scene::seed();
        let exact = render(&scene, 9).unwrap();
        scene.method = Method::Crude(cut);
        let crude = render(&scene, 9).unwrap();
        assert!(crude.data().iter().all(|v| [0, 160, 255].contains(v)));
        let differ = crude.data().iter().zip(exact.data()).filter(|(a, b)| a != b).count();
        assert!((3000..30_000).contains(&differ), "{differ}");
    }
}

#[test]
fn noise_is_as_asked_and_seeded_per_view() {
    let mut scene = small(0, 4);
    scene.poses.push(scene.poses[0].clone());
    scene.board.levels = Levels { black: 100, white: 100, background: 100 };
    scene.degrade = "noise=5".parse().unwrap();
    let (a, b) = (render(&scene, 0).unwrap(), render(&scene, 1).unwrap());
    let std = |p: &Plane<u8>| {
        let n = p.data().len() as f64;
        let mean = p.data().iter().map(|&v| f64::from(v)).sum::<f64>() / n;
        (p.data().iter().map(|&v| (f64::from(v) - mean).powi(2)).sum::<f64>() / n).sqrt()
    };
    // Rounding adds 1/12.
    assert!((std(&a) - (25.0f64 + 1.0 / 12.0).sqrt()).abs() < 0.08, "{}", std(&a));
    assert_ne!(a, b);
    assert_eq!(a, Renderer::new(&scene).unwrap().render(0).unwrap());
    let noise_alone = a.map(|v| v);
    scene.seed = 2;
    assert_ne!(a, render(&scene, 0).unwrap());
    scene.seed = 1;
    // Another effect does not change the noise: on a uniform picture blur does nothing.
    scene.degrade.blur = 1.0;
    assert_eq!(noise_alone, render(&scene, 0).unwrap());
    scene.degrade = "shot=5".parse().unwrap();
    let shot = std(&render(&scene, 0).unwrap());
    assert!((shot - (25.0f64 * 100.0 / 255.0 + 1.0 / 12.0).sqrt()).abs() < 0.06, "{shot}");
}

#[test]
fn light_contrast_and_occlusion_are_as_asked() {
    let mut scene = small(0, 4);
    scene.board.levels = Levels { black: 200, white: 200, background: 200 };
    let render = |scene: &Scene| Renderer::new(scene).unwrap().render(0).unwrap();
    let range = |p: &Plane<u8>| (p.data().iter().min().copied(), p.data().iter().max().copied());
    scene.degrade = "light=0.5".parse().unwrap();
    let (lo, hi) = range(&render(&scene));
    assert!((100..=104).contains(&lo.unwrap()) && (196..=200).contains(&hi.unwrap()), "{lo:?} {hi:?}");
    scene.degrade = "vignette=0.5".parse().unwrap();
    assert_eq!(range(&render(&scene)), (Some(100), Some(200)));
    scene.degrade = "occlusion=0.2".parse().unwrap();
    let covered = render(&scene).data().iter().filter(|&&v| v < 160).count() as f64;
    // Of 125 × 87.5 px at least a quarter of the ellipse stays on the picture.
    assert!(covered > 0.05 * 125.0 * 87.5 && covered < 0.22 * 125.0 * 87.5, "{covered}");
    scene.board.levels = Levels::default();
    scene.degrade = "contrast=0.3".parse().unwrap();
    assert_eq!(range(&render(&scene)), (Some(89), Some(166)));
    scene.degrade = "jpeg=40".parse().unwrap();
    let jpeg = render(&scene);
    scene.degrade = Degrade::default();
    let clean = render(&scene);
    let rms =
        jpeg.data().iter().zip(clean.data()).map(|(a, b)| f64::from(a.abs_diff(*b)).powi(2)).sum::<f64>();
    let rms = (rms / jpeg.data().len() as f64).sqrt();
    assert!((0.5..15.0).contains(&rms), "{rms}");
}

#[test]
fn degradations_are_read_and_written() {
    for text in [
        "",
        "noise=5",
        "bend=2,occlusion=0.2,blur=1,motion=5@30,light=0.5,vignette=0.5,contrast=0.3,shot=2,noise=5,jpeg=40",
    ] {
        let d: Degrade = text.parse().unwrap();
        assert_eq!(d.to_string(), text);
        assert_eq!(serde_json::from_str::<Degrade>(&serde_json::to_string(&d).unwrap()).unwrap(), d);
    }
    assert_eq!(" jpeg=40 , motion=5 ".parse::<Degrade>().unwrap().to_string(), "motion=5,jpeg=40");
    for text in [
        "noise",
        "noise=",
        "noise=-1",
        "noise=nan",
        "fog=1",
        "jpeg=0",
        "jpeg=101",
        "blur=1@2",
        "motion=5@x",
        "occlusion=1",
    ] {
        assert!(text.parse::<Degrade>().is_err(), "{text}");
    }
}

#[test]
fn poses_become_rotation_vectors_and_back() {
    let scene = Scene::seed();
    for (i, p) in scene.poses.iter().enumerate() {
        let pose = scene.camera_from_board(i).unwrap();
        let back = crate::pose::Pose::from_rvec_tvec(pose.rvec(), pose.translation).euler_deg();
        for k in 0..3 {
            assert!((back[k] - p.angles_deg[k]).abs() < 1e-12);
        }
    }
}

#[test]
fn nonsense_is_refused_not_drawn() {
    let broken: [fn(&mut Scene); 10] = [
        |s| s.poses[0].translation[2] = -600.0,
        |s| s.poses[0].translation[2] = f64::NAN,
        |s| s.poses[0].angles_deg = [180.0, 0.0, 0.0],
        |s| s.poses[0].angles_deg = [0.0, f64::INFINITY, 0.0],
        |s| s.board.square = 0.0,
        |s| s.board.margin = -1.0,
        |s| s.camera.params[0] = f64::NAN,
        |s| s.camera.size_px = [0, 600],
        |s| s.camera.size_px = [100_000, 100_000],
        |s| s.degrade.bend = 1e5,
    ];
    for (i, f) in broken.iter().enumerate() {
        let mut scene = small(0, 8);
        f(&mut scene);
        assert!(render(&scene, 0).is_err(), "case {i}");
    }
    assert!(render(&small(0, 8), 1).is_err());
    // Odd but drawable: tiny, grazing, far away, beyond the fold of the lens, half outside.
    let odd: [fn(&mut Scene); 5] = [
        |s| s.camera = Camera { size_px: [1, 1], ..s.camera.clone() },
        |s| s.poses[0].angles_deg = [80.0, 0.0, 0.0],
        |s| s.poses[0].translation = [0.0, 0.0, 1e7],
        |s| s.camera.params[0] = 30.0,
        |s| s.poses[0].translation[0] = 0.0,
    ];
    for (i, f) in odd.iter().enumerate() {
        let mut scene = small(0, 8);
        f(&mut scene);
        assert!(render(&scene, 0).is_ok(), "case {i}");
    }
}

#[test]
fn pictures_are_written_as_png() {
    let scene = small(0, 8);
    let picture = render(&scene, 0).unwrap();
    for color in [false, true] {
        let back = image::load_from_memory(&png(&picture, color).unwrap()).unwrap();
        assert_eq!(back.color().has_color(), color);
        assert_eq!(back.into_luma8().into_raw(), picture.data());
    }
}

#[test]
fn scene_files_survive_writing_and_reading() {
    let mut scene = Scene::seed();
    scene.degrade = "noise=5,jpeg=40".parse().unwrap();
    scene.method = Method::Crude(Cut::Round);
    let text = serde_json::to_string_pretty(&scene).unwrap();
    assert_eq!(Scene::from_json(&text).unwrap(), scene);
    assert!(Scene::from_json("{}").unwrap_err().to_string().contains("camera"));
}
