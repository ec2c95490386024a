//! Both maps against the camera, the half pixel, and both kinds of files.

use super::*;
use crate::calib::{
    camera::{Camera, Model},
    undistort::{Framing, Projection},
};

fn camera() -> Camera {
    let params = vec![110.0, 111.0, 63.0, 46.0, -0.28, 0.1, 0.001, 0.002, 0.0];
    Camera::new(Model::Brown5, [128, 96], params).unwrap()
}

fn rows(maker: &Maker<'_>, way: Way) -> Vec<Vec<[f32; 2]>> {
    (0..maker.size_px(way)[1]).map(|v| maker.row(way, v)).collect()
}

/// Back to px from the centre of the top-left pixel.
fn px([s, t]: [f32; 2], [w, h]: [u32; 2]) -> Vector2<f64> {
    Vector2::new(f64::from(s) * f64::from(w) - 0.5, (1.0 - f64::from(t)) * f64::from(h) - 0.5)
}

#[test]
fn pixel_centres_are_half_a_pixel_in_and_t_counts_from_the_bottom() {
    let camera = Camera::new(Model::Pinhole, [4, 2], vec![5.0, 5.0, 1.5, 0.5]).unwrap();
    let straight = Straightener::new(&camera, &Framing::flat(0.0), false).unwrap();
    let maker = Maker { lens: &camera, straight: &straight };
    for way in Way::ALL {
        let rows = rows(&maker, way);
        for (v, t) in [(0, 0.75), (1, 0.25)] {
            for (u, s) in [0.125, 0.375, 0.625, 0.875].into_iter().enumerate() {
                let [a, b]: [f32; 2] = rows[v][u];
                assert!((a - s).abs() < 1e-6 && (b - t).abs() < 1e-6, "{way:?} {u} {v}: {a} {b}");
            }
        }
    }
}

#[test]
fn the_maps_are_the_lens_and_its_inverse() {
    let camera = camera();
    for projection in [Projection::Perspective, Projection::Stereographic] {
        let framing = Framing { projection, alpha: 0.5, fov_rad: None };
        let straight = Straightener::new(&camera, &framing, false).unwrap();
        let maker = Maker { lens: &camera, straight: &straight };
        let size = camera.size_px;
        let there = rows(&maker, Way::Undistort);
        for (v, row) in there.iter().enumerate() {
            for (u, st) in row.iter().enumerate() {
                let ray = straight.view.ray(u as f64, v as f64).unwrap();
                let truth = camera.project(&ray.into()).unwrap();
                assert!((px(*st, size) - truth).norm() < 2e-5, "{projection} {u} {v}");
            }
        }
        // Beyond the photograph too: alpha is more than 0.
        if projection == Projection::Perspective {
            assert!(there.iter().flatten().flatten().any(|v| !(0.0..=1.0).contains(v)));
        }
        for (v, row) in rows(&maker, Way::Distort).iter().enumerate() {
            for (u, st) in row.iter().enumerate() {
                let at = px(*st, straight.view.size_px);
                let ray = straight.view.ray(at.x, at.y).unwrap();
                let back = camera.project(&ray.into()).unwrap();
                assert!(
                    (back - Vector2::new(u as f64, v as f64)).norm() < 2e-4,
                    "{projection} {u} {v}: {back}"
                );
            }
        }
    }
}

#[test]
fn what_comes_from_nowhere_is_marked() {
    // A fisheye of which a flat picture shows only the middle.
    let params = vec![30.0, 30.0, 63.5, 47.5, 0.0, 0.0, 0.0, 0.0];
    let camera = Camera::new(Model::Kb4, [128, 96], params).unwrap();
    let straight = Straightener::new(&camera, &Framing::flat(1.0), false).unwrap();
    let maker = Maker { lens: &camera, straight: &straight };
    let distort = rows(&maker, Way::Distort);
    assert_eq!((distort[0][0], distort[95][127]), (NOWHERE, NOWHERE));
    assert!(distort[48][64].iter().all(|v| (0.4..0.6).contains(v)));
    let png = image::load_from_memory(&file(&distort, Storage::Png).unwrap()).unwrap().into_rgb16();
    assert_eq!(png.get_pixel(0, 0).0, [0, 0, 0]);
}

#[test]
fn files_hold_what_was_written() {
    let rows = vec![vec![[0.25, 1.5], [-1.0, 0.125]], vec![[0.0, 1.0], [0.5, 0.75]]];
    let png = image::load_from_memory(&file(&rows, Storage::Png).unwrap()).unwrap().into_rgb16();
    let pixels: Vec<[u16; 3]> = png.pixels().map(|p| p.0).collect();
    assert_eq!(pixels, [[16384, 65535, 0], [0, 8192, 0], [0, 65535, 0], [32768, 49151, 0]]);

    let exr = file(&rows, Storage::Exr).unwrap();
    assert_eq!(exr[..8], [0x76, 0x2f, 0x31, 0x01, 2, 0, 0, 0]);
    // Two lines of 8 bytes and 2 × 2 floats at the end; the table before them says where.
    let number = |at: usize| u32::from_le_bytes(exr[at..at + 4].try_into().unwrap());
    let float = |at: usize| f32::from_le_bytes(exr[at..at + 4].try_into().unwrap());
    let first = exr.len() - 2 * 24;
    for (line, start) in [first, first + 24].into_iter().enumerate() {
        assert_eq!(number(first - 16 + 8 * line) as usize, start);
        assert_eq!([number(start), number(start + 4)], [line as u32, 16]);
        for x in 0..2 {
            let [s, t] = rows[line][x];
            assert_eq!([float(start + 8 + 4 * x), float(start + 16 + 4 * x)], [t, s], "G before R");
        }
    }
    assert!(file(&[], Storage::Exr).is_err() && file(&[vec![], vec![]], Storage::Png).is_err());
    assert!(file(&[vec![[0.0; 2]], vec![]], Storage::Png).is_err());
}
