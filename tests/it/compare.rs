//! Calibrations beside each other: what chance explains, what changed, old ones beside new pictures, and a series.

use std::ops::ControlFlow;

use nalgebra::Vector2;
use rand::{RngExt as _, SeedableRng as _};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;
use straightedge::{
    calib::{
        camera::{Camera, Model},
        compare::{Answer, Member, Series, Side, UNLIKELY, Verdict, compare, date},
        format,
        report::Report,
        residual::Field,
        target::Target,
    },
    job::{
        assemble::{Finding, Seen},
        evidence::Case,
        validate::validate,
    },
};

use crate::check::{case, solved};

/// Pictures as those of `check`, with normal noise of 0.1 px.
fn noisy(camera: &Camera, target: &Target, count: usize, salt: u32) -> Case {
    let mut case = case(camera, target, count, salt);
    let mut rng = Pcg64::seed_from_u64(u64::from(salt));
    let mut list = case.entries.to_vec();
    for entry in &mut list {
        let Ok(Seen { finding: Finding::Corners { corners, .. }, .. }) = &mut entry.seen else { continue };
        for corner in corners {
            let mut noise = || 0.1 * rng.sample::<f64, _>(StandardNormal);
            corner.px += Vector2::new(noise(), noise());
            corner.sigma_px = 0.1;
        }
    }
    case.entries = list.into();
    case
}

fn board() -> Target {
    Target::checkerboard("9x6".parse().unwrap(), 30.0)
}

fn camera(focal: f64) -> Camera {
    let params = vec![focal, focal, 318.0, 243.0, -0.25, 0.09, 0.001, -0.0005, 0.0];
    Camera::new(Model::Brown5, [640, 480], params).unwrap()
}

fn side(report: &Report) -> Side {
    Side::from(&format::read(&report.to_json(), "camera.json").unwrap())
}

fn calibrated(focal: f64, count: usize, salt: u32) -> Side {
    side(&solved(&noisy(&camera(focal), &board(), count, salt)))
}

/// The chance that is told is the chance that there is, over pairs that differ by noise and poses alone.
#[test]
fn chance_is_told_as_it_is() {
    let sides: Vec<Side> = (0..80).map(|k| calibrated(620.0, 8, 10 + k)).collect();
    let told: Vec<f64> = sides
        .chunks(2)
        .map(|pair| compare(&pair[0], &pair[1]).unwrap().chance.unwrap().probability)
        .collect();
    let below = |p: f64| told.iter().filter(|t| **t < p).count();
    println!("of {} pairs: {} below 0.5, {} below 0.1", told.len(), below(0.5), below(0.1));
    // Of 40 pairs 20 ± 3.2 and 4 ± 1.9 are expected: three standard deviations.
    assert!((10..=30).contains(&below(0.5)) && below(0.1) <= 10 && below(UNLIKELY / 100.0) == 0);
}

#[test]
fn what_changed_is_seen_and_what_did_not_is_not() {
    let [first, again, zoomed] =
        [(620.0, 1), (620.0, 2), (626.0, 3)].map(|(f, salt)| calibrated(f, 10, salt));
    let same = compare(&first, &again).unwrap();
    assert_eq!(same.verdict, Verdict::WithinChance, "{}", same.sentence());
    let other = compare(&first, &zoomed).unwrap();
    assert_eq!(other.verdict, Verdict::Differ, "{}", other.sentence());
    assert!(other.parameter("fx").unwrap().in_sigma.unwrap() > 4.0);
    // A turn of the camera is no difference, a camera is none from itself.
    let none = compare(&first, &first).unwrap();
    assert!(none.whole.max_px < 1e-9 && none.corners.max_px < 1e-9);
    // A zoom of 1 % moves what is seen r px off the middle by 1 % of r.
    let exact = |f: f64| Side { camera: camera(f), covariance: None, residual: None };
    let known = compare(&exact(620.0), &exact(626.2)).unwrap();
    assert_eq!((known.verdict, known.chance, &known.sigma_px), (Verdict::Unknown, None, &[None, None]));
    let mut pinhole = exact(620.0);
    pinhole.camera = Camera::new(Model::Pinhole, [640, 480], vec![620.0, 620.0, 319.5, 239.5]).unwrap();
    let mut longer = pinhole.clone();
    longer.camera.params[..2].fill(626.2);
    let zoom = compare(&pinhole, &longer).unwrap();
    let diagonal = 0.01 * 319.5f64.hypot(239.5);
    assert!((zoom.corners.max_px / diagonal - 1.0).abs() < 0.02, "{:?}", zoom.corners);
    assert!(zoom.middle.max_px < zoom.whole.max_px && zoom.whole.max_px < zoom.corners.max_px);
    // σ of one side is enough, and is that of the certainty of the parameters: largest in the corners.
    let half = compare(&first, &Side { covariance: None, ..zoomed }).unwrap();
    assert_eq!(half.verdict, Verdict::Differ);
    let sigma = half.sigma(0).unwrap();
    assert!(sigma.values[0] > 3.0 * sigma.values[sigma.values.len() / 2 + sigma.columns / 2]);
    assert!(half.sigma(1).is_none());
    // Other models, other sizes.
    let fisheye =
        Camera::new(Model::Kb4, [640, 480], vec![620.0, 620.0, 318.0, 243.0, 0.08, 0.0, 0.0, 0.0]).unwrap();
    let mixed = compare(&first, &Side { camera: fisheye, covariance: None, residual: None }).unwrap();
    assert_eq!(
        mixed.parameters.iter().map(|p| p.name).collect::<Vec<_>>(),
        ["fx", "fy", "cx", "cy", "k1", "k2", "k3"]
    );
    let small = Side { camera: first.camera.scaled(0.5).unwrap(), covariance: None, residual: None };
    let says = compare(&first, &small).unwrap_err().to_string();
    assert!(says.contains("convert the second one with `straightedge convert --scale 2`"), "{says}");
}

fn judged(old: &Side, case: &Case) -> straightedge::calib::compare::Validity {
    let case = Case { start: Some(("old.json".into(), old.camera.clone())), ..case.clone() };
    validate(&case, old, &mut |_| ControlFlow::Continue(())).unwrap().0
}

#[test]
fn an_old_calibration_is_judged_by_few_new_pictures() {
    let old = calibrated(620.0, 12, 1);
    let fresh = judged(&old, &noisy(&camera(620.0), &board(), 4, 50));
    assert_eq!(fresh.answer, Answer::StillValid, "{}", fresh.sentence);
    let expected = fresh.expected_rms_px.unwrap();
    assert!((fresh.held_rms_px / expected - 1.0).abs() < 0.05, "{fresh:?}");
    let zoomed = judged(&old, &noisy(&camera(629.3), &board(), 4, 51));
    assert_eq!(zoomed.answer, Answer::Recalibrate, "{}", zoomed.sentence);
    let focal = zoomed.focal.unwrap();
    assert!((focal.px - 9.3).abs() < 3.0 * focal.sigma_px && focal.px > 3.0 * focal.sigma_px, "{focal:?}");
    assert!(
        zoomed.sentence.contains("the focal length moved by")
            && zoomed.held_rms_px > zoomed.expected_rms_px.unwrap()
    );
    // Without σ of its own the old one counts as exact.
    let exact = Side { camera: camera(620.0), covariance: None, residual: None };
    assert_eq!(judged(&exact, &noisy(&camera(620.0), &board(), 4, 52)).answer, Answer::StillValid);
    // One picture does not tell all, and says so.
    let one = judged(&old, &noisy(&camera(620.0), &board(), 1, 53));
    assert!(one.why.is_some() && one.answer != Answer::Recalibrate, "{one:?}");
}

#[test]
fn a_series_is_in_the_order_of_its_dates() {
    let member = |file: &str, focal: f64, salt: u32, day: &str, warm: f64| Member {
        file: file.to_owned(),
        side: calibrated(focal, 10, salt),
        days: date::days(day),
        temperature: Some(warm),
    };
    let mut list = vec![
        member("c.json", 624.0, 3, "2026-07-01", 30.0),
        member("a.json", 620.0, 1, "2026-05-01", 20.0),
        member("b.json", 620.0, 2, "2026-06-01", 20.5),
        member("d.json", 628.0, 4, "2026-08-01", 40.0),
    ];
    let series = Series::new(list.clone()).unwrap();
    let files: Vec<&str> = series.entries.iter().map(|e| e.file.as_str()).collect();
    assert_eq!(files, ["a.json", "b.json", "c.json", "d.json"]);
    assert!(series.recalibrate && series.sentence().starts_with("Changed since"), "{}", series.sentence());
    assert_eq!(series.entries[1].verdict, Verdict::WithinChance);
    let slope = series.focal_by_temperature.unwrap();
    assert!((slope.slope - 0.4).abs() < 0.1 && slope.is_significant(), "{slope:?}");
    let page = series.page();
    assert!(page.contains("2026-06-01") && page.contains("Temperature, °C") && !page.contains("NaN"));
    list.truncate(3);
    list.swap_remove(0);
    let steady = Series::new(list).unwrap();
    assert!(!steady.recalibrate && steady.sentence().starts_with("Steady"), "{}", steady.sentence());
}

/// A residual map is part of the camera that it corrects: two equal ones make no difference, and one alone makes its own.
#[test]
fn residual_maps_are_compared() {
    const AMPLITUDE_PX: f64 = 0.5;
    // Waves over the picture, which no rotation makes.
    let knots = [13, 10];
    let wave = |k: usize| {
        let [i, j] = [k % knots[0], k / knots[0]].map(|n| n as f64);
        [AMPLITUDE_PX * (1.3 * i).sin() * (0.9 * j).cos(), AMPLITUDE_PX * (1.1 * i).cos() * (1.2 * j).sin()]
    };
    let offsets = (0..knots[0] * knots[1]).map(wave).collect();
    let field = Field::new([0.0; 2], [64.0, 68.0], knots, offsets).unwrap();
    let plain = Side { camera: camera(620.0), covariance: None, residual: None };
    let bent = Side { residual: Some(field.clone()), ..plain.clone() };
    let same = compare(&bent, &bent).unwrap();
    assert!(same.whole.max_px < 1e-6, "{:?}", same.whole);
    let one = compare(&plain, &bent).unwrap();
    let rows = one.moved_px.len();
    let columns = one.moved_px[0].len();
    let mut squares = [0.0, 0.0];
    for (j, row) in one.moved_px.iter().enumerate() {
        for (i, moved) in row.iter().enumerate() {
            let px = Vector2::new(
                (i as f64 + 0.5) / columns as f64 * 640.0 - 0.5,
                (j as f64 + 0.5) / rows as f64 * 480.0 - 0.5,
            );
            squares[0] += (Vector2::from(moved.unwrap()) - field.at(&px)).norm_squared();
            squares[1] += field.at(&px).norm_squared();
        }
    }
    // What is left is the rotation that fits the waves by chance.
    let left = (squares[0] / squares[1]).sqrt();
    assert!(left < 0.4, "{left}");
    // The other way round it is the opposite, to the slope of the waves.
    let back = compare(&bent, &plain).unwrap();
    assert!((back.whole.rms_px / one.whole.rms_px - 1.0).abs() < 0.05);
}
