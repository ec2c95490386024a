//! Lenses beyond 180° in every projection.

use std::f64::consts::PI;

use nalgebra::{Point3, Vector2, Vector3};

use super::super::*;
use crate::image::Samples;

/// A fisheye of 200° from side to side and 150° from top to bottom.
fn fisheye() -> Camera {
    let params = vec![224.0, 225.0, 402.5, 297.0, 0.02, -0.006, 0.001, -0.0001];
    Camera::new(Model::Kb4, [800, 600], params).unwrap()
}

/// The same lens on a sensor that holds all of its image circle of 240°: what is beyond has no ray.
fn circular() -> Camera {
    let values = vec![150.0, 150.0, 399.5, 299.5, 0.0, 0.0, 0.0, -0.0003];
    Camera::new(Model::Kb4, [800, 600], values).unwrap()
}

fn wide() -> Vec<Camera> {
    vec![
        fisheye(),
        circular(),
        Camera::new(Model::Ds, [640, 480], vec![157.0, 157.5, 316.0, 241.0, -0.2, 0.59]).unwrap(),
        Camera::new(Model::Eucm, [640, 480], vec![200.0, 201.0, 319.5, 239.5, 0.63, 1.04]).unwrap(),
    ]
}

fn angle(ray: &Vector3<f64>) -> f64 {
    ray.x.hypot(ray.y).atan2(ray.z)
}

fn framings() -> impl Iterator<Item = Framing> {
    Projection::ALL.into_iter().flat_map(|projection| {
        [(0.0, None), (0.5, None), (1.0, None), (0.0, Some(110.0)), (0.0, Some(150.0))]
            .map(|(alpha, fov)| Framing { projection, alpha, fov_rad: fov.map(f64::to_radians) })
    })
}

#[test]
fn points_and_rays_are_inverse() {
    for projection in Projection::ALL {
        let spec = projection.spec();
        let mut seen = 0;
        for i in 0..40 {
            for j in 0..36 {
                let (theta, turn) =
                    (f64::from(i) / 40.0 * spec.max_angle_rad, f64::from(j) / 36.0 * 2.0 * PI);
                let ray = Vector3::new(theta.sin() * turn.cos(), theta.sin() * turn.sin(), theta.cos());
                let Some(point) = (spec.point)(&ray).filter(|p| p.y.abs() <= spec.max_y) else { continue };
                let back = projection.ray(&point).unwrap().normalize();
                assert!(
                    (back - ray).norm() < 1e-12,
                    "{projection} {theta} {turn}: {:e}",
                    (back - ray).norm()
                );
                seen += 1;
            }
        }
        assert!(seen > 1000, "{projection}: {seen}");
        assert_eq!(projection.to_string().parse(), Ok(projection));
    }
    for (projection, beyond) in [
        (Projection::Equidistant, Vector2::new(3.0, 1.0)),
        (Projection::Cylindrical, Vector2::new(3.2, 0.0)),
        (Projection::Cylindrical, Vector2::new(0.0, 5.7)),
    ] {
        assert_eq!(projection.ray(&beyond), None, "{projection}");
    }
    assert!("fisheye".parse::<Projection>().unwrap_err().to_string().contains("perspective, cylindrical"));
}

#[test]
fn every_valid_pixel_shows_what_the_lens_sees_there() {
    for camera in wide() {
        for framing in framings() {
            let Straightener { view, map, .. } = Straightener::new(&camera, &framing, false).unwrap();
            let mask = map.mask();
            let (mut valid, mut found) = (0, 0);
            for v in (0..view.size_px[1]).step_by(7) {
                for u in (0..view.size_px[0]).step_by(5) {
                    let at = map.at(f64::from(u), f64::from(v));
                    assert_eq!(at.is_some(), mask.at(u as usize, v as usize) == 255, "{framing:?} {u} {v}");
                    let Some(px) = at else { continue };
                    let ray = view.ray(f64::from(u), f64::from(v)).unwrap();
                    assert!((camera.project(&ray.into()).unwrap() - px).norm() < 1e-9, "{framing:?} {u} {v}");
                    // And the pixel shows this ray, not one on the other side of a fold.
                    // (At the very edge of what has rays, none is found.)
                    let back = camera.unproject(&px);
                    found += i32::from(back.is_some());
                    let same = back.is_none_or(|back| (back - ray.normalize()).norm() < 1e-6);
                    assert!(same, "{framing:?} {u} {v}");
                    valid += 1;
                }
            }
            assert!(
                valid > 2000 && found > valid - valid / 200,
                "{:?} {framing:?}: {valid} {found}",
                camera.model
            );
        }
    }
}

#[test]
fn alpha_0_has_no_black_pixel_and_alpha_1_all_that_can_be_shown() {
    for camera in wide() {
        for projection in Projection::ALL {
            let framing = |alpha| Framing { projection, alpha, fov_rad: None };
            let inner = Straightener::new(&camera, &framing(0.0), false).unwrap();
            assert!(inner.map.mask().data().iter().all(|v| *v == 255), "{:?} {projection}", camera.model);
            let outer = View::new(&camera, &framing(1.0)).unwrap();
            let spec = projection.spec();
            let limit = camera.fold_rad().min(spec.max_angle_rad);
            let [w, h] = camera.size_px.map(|n| f64::from(n) - 1.0);
            let mut kept = 0;
            for j in 0..=40 {
                for i in 0..=40 {
                    let px = Vector2::new(w * f64::from(i) / 40.0, h * f64::from(j) / 40.0);
                    let Some(ray) = camera.unproject(&px).filter(|r| angle(r) <= limit) else { continue };
                    if (spec.point)(&ray).is_none_or(|p| p.y.abs() > spec.max_y) {
                        continue;
                    }
                    let at = outer.pixel(&ray).unwrap();
                    assert!(
                        (-0.5..=w + 0.5).contains(&at.x) && (-0.5..=h + 0.5).contains(&at.y),
                        "{:?} {projection} {px} → {at}",
                        camera.model
                    );
                    kept += 1;
                }
            }
            assert!(kept > 300, "{:?} {projection}: {kept}", camera.model);
        }
    }
}

#[test]
fn wide_projections_show_more_than_180_degrees() {
    let camera = fisheye();
    let seen = |projection| {
        let Straightener { view, map, .. } =
            Straightener::new(&camera, &Framing { projection, alpha: 1.0, fov_rad: None }, false).unwrap();
        let [w, h] = view.size_px.map(f64::from);
        let row = (0..view.size_px[0]).map(f64::from).filter(|u| map.at(*u, 0.5 * h).is_some());
        let angles: Vec<f64> = row.map(|u| angle(&view.ray(u, 0.5 * h).unwrap())).collect();
        let [first, last] = [angles.first(), angles.last()].map(|a| a.copied().unwrap_or_default());
        assert!(w > 0.0);
        (first + last).to_degrees()
    };
    let truth = [0.0, 799.0].map(|u| angle(&camera.unproject(&Vector2::new(u, 300.0)).unwrap()));
    let truth = (truth[0] + truth[1]).to_degrees();
    assert!(truth > 198.0, "{truth}");
    for projection in [Projection::Equidistant, Projection::Stereographic, Projection::Cylindrical] {
        let shown = seen(projection);
        assert!((shown - truth).abs() < 2.0, "{projection}: {shown}° of {truth}°");
    }
    let flat = seen(Projection::Perspective);
    assert!((150.0..160.001).contains(&flat), "{flat}");
}

#[test]
fn a_field_of_view_is_as_wide_as_it_says() {
    let camera = fisheye();
    for (projection, degrees) in [
        (Projection::Perspective, 100.0),
        (Projection::Cylindrical, 180.0),
        (Projection::Equidistant, 200.0),
        (Projection::Stereographic, 190.0),
    ] {
        let framing = Framing { projection, alpha: 0.0, fov_rad: Some(f64::to_radians(degrees)) };
        let view = View::new(&camera, &framing).unwrap();
        // From edge to edge: half a pixel beyond the centres of the outermost ones.
        let edges = [-0.5, 799.5].map(|u| angle(&view.ray(u, 299.5).unwrap()).to_degrees());
        assert!(edges.iter().all(|e| (e - 0.5 * degrees).abs() < 1e-9), "{projection}: {edges:?}");
        assert!((view.intrinsics[1] / view.intrinsics[0] - 225.0 / 224.0).abs() < 1e-12);
    }
    for (projection, degrees, says) in [
        (Projection::Perspective, 180.0, "at most 160°, or another projection"),
        (Projection::Stereographic, 330.0, "at most 320°"),
        (Projection::Equidistant, 0.0, "more than 0°"),
        (Projection::Cylindrical, f64::NAN, "at most 358°"),
        (Projection::Cylindrical, -20.0, "more than 0°"),
    ] {
        let framing = Framing { projection, alpha: 0.0, fov_rad: Some(f64::to_radians(degrees)) };
        let error = View::new(&camera, &framing).unwrap_err().to_string();
        assert!(error.contains(says), "{error}");
    }
}

/// Where a view shows points of the scene.
fn shown(projection: Projection, points: impl Iterator<Item = Vector3<f64>>) -> Vec<Vector2<f64>> {
    let framing = Framing { projection, alpha: 0.5, fov_rad: None };
    let view = View::new(&fisheye(), &framing).unwrap();
    points.map(|p| view.pixel(&p).unwrap()).collect()
}

#[test]
fn each_projection_keeps_what_it_promises() {
    // A line in the world, as far as a flat picture shows it.
    let line = |i: i32| Vector3::new(-3.0 + 0.06 * f64::from(i), 0.4 + 0.01 * f64::from(i), 1.0);
    let flat = shown(Projection::Perspective, (0..100).map(line));
    let (first, last) = (flat[0], flat[99]);
    let off = |p: &Vector2<f64>| (last - first).normalize().perp(&(p - first)).abs();
    assert!(flat.iter().all(|p| off(p) < 1e-9));

    // A vertical one beside the camera, behind the plane of the lens, on the cylinder.
    let post =
        shown(Projection::Cylindrical, (0..50).map(|i| Vector3::new(2.0, f64::from(i) * 0.1 - 2.5, -0.2)));
    assert!(post.iter().all(|p| (p.x - post[0].x).abs() < 1e-9) && post[49].y - post[0].y > 50.0);

    // Steps of 10° from the axis to 100°, in any direction, are steps of the same length.
    let turn = f64::to_radians(25.0);
    let ray = |i: i32| {
        let (sin, cos) = f64::to_radians(10.0 * f64::from(i)).sin_cos();
        Vector3::new(sin * turn.cos(), sin * turn.sin(), cos)
    };
    let steps = shown(Projection::Equidistant, (0..=10).map(ray));
    let step = (steps[10] - steps[0]) / 10.0;
    assert!(steps.iter().enumerate().all(|(i, p)| (p - steps[0] - step * i as f64).norm() < 1e-9));
    assert!(step.norm() > 10.0);

    // A circle of rays 20° about one that is 80° off the axis: all points of its picture are as far from the middle. Of square pixels.
    let axis = Vector3::new(f64::to_radians(80.0).sin(), 0.0, f64::to_radians(80.0).cos());
    let [a, b] = crate::camera::tangents(&axis);
    let (sin, cos) = f64::to_radians(20.0).sin_cos();
    let on_circle = |i: i32| {
        let (y, x) = (f64::from(i) / 40.0 * 2.0 * PI).sin_cos();
        axis * cos + (a * x + b * y) * sin
    };
    let circle = shown(Projection::Stereographic, (0..40).map(on_circle));
    let square: Vec<_> = circle.iter().map(|p| Vector2::new(p.x, p.y * 224.0 / 225.0)).collect();
    let middle = square.iter().sum::<Vector2<f64>>() / 40.0;
    // The mean of the points is not the middle of the circle: three points determine that.
    let centre = circumcentre(square[0], square[13], square[27]);
    let radius = (square[0] - centre).norm();
    assert!((centre - middle).norm() < radius && radius > 10.0);
    assert!(square.iter().all(|p| ((p - centre).norm() - radius).abs() < 1e-9));
}

fn circumcentre(a: Vector2<f64>, b: Vector2<f64>, c: Vector2<f64>) -> Vector2<f64> {
    let (p, q) = (b - a, c - a);
    let d = 2.0 * p.perp(&q);
    let (p2, q2) = (p.norm_squared(), q.norm_squared());
    a + Vector2::new(q.y * p2 - p.y * q2, p.x * q2 - q.x * p2) / d
}

#[test]
fn views_have_the_cameras_of_their_projections() {
    for projection in Projection::ALL {
        let view = View::new(&fisheye(), &Framing { projection, alpha: 0.7, fov_rad: None }).unwrap();
        let Some(camera) = view.camera() else {
            assert_eq!(projection, Projection::Cylindrical);
            continue;
        };
        for [u, v] in [[400.0, 300.0], [10.0, 20.0], [799.0, 300.0], [300.0, 599.0]] {
            let ray = view.ray(u, v).unwrap();
            let px = camera.project(&Point3::from(ray)).unwrap();
            assert!((px - Vector2::new(u, v)).norm() < 1e-9, "{projection} {u} {v} → {px}");
        }
    }
}

/// A scene on a sphere: a smooth pattern over all directions.
fn pattern(ray: &Vector3<f64>) -> f64 {
    let r = ray.normalize();
    32768.0 + 14000.0 * ((9.0 * r.x).sin() * (8.0 * r.y + 1.0).cos() + 0.5 * (7.0 * r.z).sin())
}

#[test]
fn a_rendered_scene_comes_back_in_every_projection() {
    let camera = fisheye();
    let samples = (0..600 * 800).map(|i| {
        let ray = camera.unproject(&Vector2::new(f64::from(i % 800), f64::from(i / 800)));
        ray.map_or(0.0, |r| pattern(&r)) as u16
    });
    let photo = Photo { width: 800, height: 600, channels: 1, samples: Samples::U16(samples.collect()) };
    for projection in Projection::ALL {
        for (alpha, crop) in [(0.0, false), (0.6, false), (1.0, true)] {
            let framing = Framing { projection, alpha, fov_rad: None };
            let straight = Straightener::new(&camera, &framing, crop).unwrap();
            let Samples::U16(out) = straight.run(&photo, Interpolation::Lanczos).unwrap().samples else {
                panic!("16 bit")
            };
            let [w, h] = straight.view.size_px.map(|n| n as usize);
            let (mut worst, mut checked) = (0.0f64, 0);
            for v in 0..h {
                for u in 0..w {
                    let Some(px) = straight.map.at(u as f64, v as f64) else {
                        assert_eq!(out[v * w + u], 0);
                        continue;
                    };
                    // Taps beyond the border repeat it.
                    if px.x < 3.0 || px.x > 796.0 || px.y < 3.0 || px.y > 596.0 {
                        continue;
                    }
                    let ray = straight.view.ray(u as f64, v as f64).unwrap();
                    worst = worst.max((f64::from(out[v * w + u]) - pattern(&ray)).abs());
                    checked += 1;
                }
            }
            assert!(checked > 50_000, "{framing:?}: {checked}");
            // Of 65535: the interpolation of a pattern of 1/20 of a wave a pixel, and the rounding of the photograph.
            assert!(worst < 25.0, "{framing:?}: {worst}");
        }
    }
}

#[test]
fn only_a_flat_picture_is_too_narrow_for_a_fisheye() {
    let limited = |p| warnings(&fisheye(), p).iter().any(|w| w.code == "view_limited");
    assert!(limited(Projection::Perspective));
    assert!(!limited(Projection::Equidistant) && !limited(Projection::Cylindrical));
}
