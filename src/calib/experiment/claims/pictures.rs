//! Claims about poses, pictures, coverage and distortion.

use super::{Claim, Judgement, Verdict};
use crate::calib::{
    Result,
    experiment::{
        document::{
            CORNERS, COVERAGE_PERCENT, DISPLACEMENT_PERCENT, DISPLACEMENT_PX, PICTURES, PIXEL_DEG, POSES_DEG,
        },
        evidence::{EXACT, Evidence},
    },
    stats,
    synth::Scene,
};

pub(super) const CLAIMS: &[Claim] = &[
    Claim {
        id: "origin",
        section: "IV-A",
        says: "the poses place the first inner corner of the board",
        judge: origin,
    },
    Claim {
        id: "poses",
        section: "III-C, IV-B",
        says: "tilts within ±25°, in-plane rotations up to ±30°",
        judge: poses,
    },
    Claim {
        id: "smallest_tilt",
        section: "VI-B",
        says: "its own rule: tilt at least 15° from frontal",
        judge: smallest_tilt,
    },
    Claim {
        id: "detection",
        section: "V-B",
        says: "the board is found in 15 of 15 pictures: 810 corners",
        judge: detection,
    },
    Claim {
        id: "coverage",
        section: "V-F",
        says: "corners cover 92 % of the width and 88 % of the height",
        judge: coverage,
    },
    Claim {
        id: "displacement_px",
        section: "V-G",
        says: "the largest displacement is about 18 px",
        judge: displacement_px,
    },
    Claim {
        id: "displacement_percent",
        section: "V-G",
        says: "which is 3 % of the picture's diagonal",
        judge: displacement_percent,
    },
    Claim { id: "pixel_angle", section: "VI-A", says: "a pixel sees about 0.06°", judge: pixel_angle },
];

/// Mean distance of the board's middle from the picture's, px, and corners within the picture.
fn placed(scene: &Scene) -> (f64, usize) {
    let truth = scene.truth();
    let [w, h] = scene.camera.size_px.map(f64::from);
    let aside: Vec<f64> = truth
        .frames
        .iter()
        .filter_map(|f| scene.camera.project(&f.pose.apply(&truth.target().center_in_board())))
        .map(|p| (p.x - (w - 1.0) / 2.0).hypot(p.y - (h - 1.0) / 2.0))
        .collect();
    (stats::errors(&aside).mean, truth.frames.iter().map(|f| f.corners.len()).sum())
}

fn origin(e: &Evidence) -> Result<Judgement> {
    let outer = &e.runs[EXACT].setup.scene;
    let ((far, inner_corners), (near, outer_corners)) = (placed(&e.inner), placed(outer));
    let points =
        |scene: &Scene| scene.truth().frames.iter().flat_map(|f| f.corners.clone()).collect::<Vec<_>>();
    let spans = |scene: &Scene| {
        let points: Vec<_> = points(scene).iter().map(|c| nalgebra::Vector2::new(c.1, c.2)).collect();
        let c = stats::coverage(&points, scene.camera.size_px);
        format!("{:.1} × {:.1} %", 100.0 * c.width_fraction, 100.0 * c.height_fraction)
    };
    let because = format!(
        "View 1 is called \"Frontal, centered\". With the first inner corner as origin the boards' middles lie {far:.0} px from the \
         picture's on average (coverage {}, {inner_corners} corners in the pictures), with the outer corner of the first square \
         {near:.0} px ({}, {outer_corners} corners). Everything here uses the outer corner.",
        spans(&e.inner),
        spans(outer),
    );
    Ok(Judgement::plain(far <= near, because))
}

fn poses(e: &Evidence) -> Result<Judgement> {
    let truth = e.runs[EXACT].setup.scene.truth();
    let largest = |f: fn(&stats::Stance) -> f64| {
        let all = truth.frames.iter().map(|v| f(&stats::stance(&v.pose, &truth.target())).abs());
        all.fold(0.0, f64::max).to_degrees()
    };
    let (tilt, roll) = (largest(|s| s.tilt_rad), largest(|s| s.roll_rad));
    let because = format!("Table II itself: tilts to {tilt:.1}°, rolls to {roll:.1}°.");
    Ok(Judgement::plain(tilt < POSES_DEG[0] + 0.5 && roll > POSES_DEG[1] - 0.5, because))
}

fn smallest_tilt(e: &Evidence) -> Result<Judgement> {
    let truth = e.runs[EXACT].setup.scene.truth();
    let flat: Vec<String> = truth
        .frames
        .iter()
        .enumerate()
        .filter(|(_, f)| f.pose.tilt_rad().to_degrees() < POSES_DEG[2] - 1e-9)
        .map(|(i, f)| format!("{} ({:.1}°)", i + 1, f.pose.tilt_rad().to_degrees()))
        .collect();
    let because = format!("Below it in Table II: views {}.", flat.join(", "));
    Ok(Judgement::plain(flat.is_empty(), because))
}

fn detection(e: &Evidence) -> Result<Judgement> {
    Judgement::by_run(e, "", |run| {
        let (full, corners) = (run.full(), run.corners());
        let text = format!("{full} of {}, {corners}", run.setup.views);
        Ok((text, full == PICTURES && corners == CORNERS))
    })
}

fn coverage(e: &Evidence) -> Result<Judgement> {
    let because = "It follows from Tables I and II alone, whatever the renderer.";
    Judgement::by_run(e, because, |run| {
        let c = run.coverage();
        let got = [100.0 * c.width_fraction, 100.0 * c.height_fraction];
        let near = (0..2).all(|k| (got[k] - COVERAGE_PERCENT[k]).abs() < 1.0);
        Ok((format!("{:.1} × {:.1} %", got[0], got[1]), near))
    })
}

fn displacement_px(e: &Evidence) -> Result<Judgement> {
    let (columns, truth) = e.displacements()?;
    let because = format!(
        "The true camera of Table I moves a corner of the picture by {:.1} px; no board of Table II reaches the corners, so each \
         estimate extrapolates there.",
        truth[0]
    );
    let near = |px: f64| (px - DISPLACEMENT_PX).abs() < 1.0;
    Ok(Judgement::by_column(columns.map(|c| (format!("{:.1} px", c[0]), near(c[0]))), because))
}

fn displacement_percent(e: &Evidence) -> Result<Judgement> {
    let (columns, truth) = e.displacements()?;
    let [w, h] = e.runs[EXACT].setup.scene.camera.size_px.map(f64::from);
    let because = format!(
        "18 px are {:.1} % of the diagonal of {:.0} px; the true camera has {:.1} %. So the two figures contradict each other.",
        100.0 * DISPLACEMENT_PX / w.hypot(h),
        w.hypot(h),
        truth[1]
    );
    let near = |percent: f64| (percent - DISPLACEMENT_PERCENT).abs() < 0.5;
    Ok(Judgement::by_column(columns.map(|c| (format!("{:.1} %", c[1]), near(c[1]))), because))
}

fn pixel_angle(e: &Evidence) -> Result<Judgement> {
    let camera = &e.runs[EXACT].setup.scene.camera;
    let between = |a: [f64; 2], b: [f64; 2]| {
        let (a, b) = (camera.unproject(&a.into())?, camera.unproject(&b.into())?);
        Some(a.cross(&b).norm().atan2(a.dot(&b)).to_degrees())
    };
    let [w, h] = camera.size_px.map(f64::from);
    let middle = between([w / 2.0 - 1.0, h / 2.0], [w / 2.0, h / 2.0]);
    let corner = between([0.0, 0.0], [1.0, 0.0]);
    let (Some(middle), Some(corner)) = (middle, corner) else {
        return Ok(Judgement { verdict: Verdict::DoesNotHold, columns: Vec::new(), because: String::new() });
    };
    let because = format!("The true camera: {middle:.4}° in the middle, {corner:.4}° in a corner.");
    let near = |deg: f64| (deg - PIXEL_DEG).abs() < 0.005;
    Ok(Judgement::plain(near(middle) && near(corner), because))
}
