//! The whole way on real photographs, beside OpenCV's calibrations (`tests/golden/peers.json`, made by
//! `benches/golden_peers.py`).

use std::{collections::BTreeMap, process::Command};

use nalgebra::{Matrix3, Vector2, Vector3};
use serde::Deserialize;
use serde_json::Value;
use straightedge::calib::{
    camera::{Camera, Model},
    stats::convex_hull,
};

use crate::detection::data;

#[derive(Deserialize)]
struct Golden {
    sets: BTreeMap<String, Set>,
}

#[derive(Deserialize)]
struct Set {
    board: String,
    size_px: [u32; 2],
    /// Pictures in which every detector of OpenCV finds the whole board.
    files: Vec<String>,
    answers: BTreeMap<String, Answer>,
}

#[derive(Deserialize)]
struct Answer {
    rms_px: f64,
    params: Vec<f64>,
}

/// RMS difference of two projection maps over the hull of points, px, after the rotation that brings the rays together.
fn difference_px(a: &Camera, b: &Camera, points: &[Vector2<f64>]) -> f64 {
    let hull = convex_hull(points);
    let inside = |p: &Vector2<f64>| {
        let next = hull.iter().cycle().skip(1);
        hull.iter().zip(next).all(|(q, r)| (r - q).perp(&(p - q)) >= 0.0)
    };
    let [w, h] = a.size_px;
    let grid = (0..h).step_by(20).flat_map(|y| (0..w).step_by(20).map(move |x| [x, y].map(f64::from)));
    let pairs: Vec<(Vector2<f64>, Vector3<f64>, Vector3<f64>)> = grid
        .map(Vector2::from)
        .filter(inside)
        .filter_map(|p| Some((p, a.unproject(&p)?.normalize(), b.unproject(&p)?.normalize())))
        .collect();
    assert!(pairs.len() > 100);
    // W. Kabsch, Acta Cryst. A32, 1976.
    let sum = pairs.iter().fold(Matrix3::zeros(), |m, (_, x, y)| m + y * x.transpose());
    let svd = sum.svd(true, true);
    let (u, vt) = (svd.u.unwrap(), svd.v_t.unwrap());
    let sign = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, (u * vt).determinant().signum()));
    let b_from_a = u * sign * vt;
    let squares =
        pairs.iter().map(|(p, x, _)| (b.project(&(b_from_a * x).into()).unwrap() - p).norm_squared());
    (squares.sum::<f64>() / pairs.len() as f64).sqrt()
}

#[test]
fn photographs_are_calibrated_at_least_as_well_as_by_opencv() {
    let text =
        std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/golden/peers.json")).unwrap();
    let golden: Golden = serde_json::from_str(&text).unwrap();
    for (name, set) in &golden.sets {
        let Some(folder) = data(name) else { continue };
        let best = set.answers.values().min_by(|a, b| a.rms_px.total_cmp(&b.rms_px)).unwrap();
        let calibrate = |options: &[&str]| -> Value {
            let output = Command::new(env!("CARGO_BIN_EXE_straightedge"))
                .arg("calibrate")
                .args(set.files.iter().map(|f| folder.join(f)))
                .args(["--board", &set.board, "--json"])
                .args(options)
                .output()
                .unwrap();
            assert!(output.status.success(), "{name}: {}", String::from_utf8_lossy(&output.stderr));
            serde_json::from_slice(&output.stdout).unwrap()
        };
        // Like for like, and as users run it.
        for options in [&["--loss", "linear", "--weights", "none"][..], &[]] {
            let report = calibrate(options);
            let rms = report["rms_px"].as_f64().unwrap();
            let points: Vec<Vector2<f64>> = report["frames"]
                .as_array()
                .unwrap()
                .iter()
                .flat_map(|f| f["corners"].as_array().unwrap())
                .map(|c| Vector2::new(c[1].as_f64().unwrap(), c[2].as_f64().unwrap()))
                .collect();
            let board: Vec<usize> = set.board.split('x').map(|n| n.parse().unwrap()).collect();
            assert_eq!(points.len(), set.files.len() * board[0] * board[1], "{name}: whole boards only");
            let value = |group: &str, key: &str| report[group][key].as_f64().unwrap();
            let mut params = ["fx", "fy", "cx", "cy"].map(|k| value("camera_matrix", k)).to_vec();
            params.extend(["k1", "k2", "p1", "p2", "k3"].map(|k| value("distortion", k)));
            let own = Camera::new(Model::Brown5, set.size_px, params).unwrap();
            let theirs = Camera::new(Model::Brown5, set.size_px, best.params.clone()).unwrap();
            let apart = difference_px(&own, &theirs, &points);
            println!("{name} {options:?}: RMS {rms:.4}, OpenCV {:.4}; maps {apart:.3} px apart", best.rms_px);
            assert!(rms <= 1.02 * best.rms_px, "{name} {options:?}: {rms} {}", best.rms_px);
            // OpenCV's own answers for the phone differ by more than this: seven pictures, a third of the view.
            assert!(apart <= 1.0 || name == "learning_opencv_phone", "{name} {options:?}: {apart}");
        }
    }
}
