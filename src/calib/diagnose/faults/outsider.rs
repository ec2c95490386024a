//! A picture that is not this camera's, or not as the camera took it.

use nalgebra::Vector2;

use super::{
    Alternative, Best, Capture, Fault, Hypothesis, Words,
    column::Column,
    linear::{At, Fixed, Linear, Seen},
    size,
};
use crate::calib::{
    calibrate::pose_of, camera::Camera, observation::Corner, report::FrameReport, target::Target,
};

/// One picture with a focal length and a principal point of its own.
pub(super) const ONE_PICTURE: Hypothesis = Hypothesis {
    code: "foreign_picture",
    alternatives: |capture| {
        let own = [Column::Focal, Column::CentreX, Column::CentreY];
        let one = |i| Alternative { terms: own.map(|c| capture.alone(c, i)).to_vec(), views: vec![i] };
        (0..capture.views()).map(one).collect()
    },
    words: |capture, best: &Best| {
        let value = best.theta[1].hypot(best.theta[2]);
        let view = &capture.calibration.views[best.alternative];
        let mirrored = capture
            .report
            .frames
            .get(view.frame.0 as usize)
            .is_some_and(|frame| kind(capture, frame).0 == Kind::Mirrored);
        let name = capture.name(best.alternative);
        let title =
            if mirrored { format!("{name} is mirrored") } else { format!("{name} is from another camera") };
        Words {
            title,
            size: format!("its principal point is {} away", size(value, "px")),
            value,
            unit: "px".to_owned(),
        }
    },
};

/// What a picture that contradicts the others is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Mirrored,
    Zoomed,
    Foreign,
}

/// Explained: its error is so many times that of the others.
const EXPLAINED: f64 = 2.5;

/// Pictures that the calibration set aside because they contradict all others: what they are.
pub(super) fn set_aside(capture: &Capture<'_>) -> Vec<Fault> {
    let aside =
        |position: &usize| capture.calibration.set_aside.iter().any(|(f, _)| f.0 as usize == *position);
    let frames = capture.report.frames.iter().enumerate();
    let contradicting = frames
        .filter(|(i, f)| !f.included && aside(i) && f.corners.len() > 3 && f.why.contains("contradict"));
    contradicting
        .map(|(position, frame)| {
            let (kind, rms_px, zoom) = kind(capture, frame);
            let name = frame.stem();
            let (code, title, size, value, unit) = match kind {
                Kind::Mirrored => (
                    "mirrored_picture",
                    format!("{name} is mirrored"),
                    "left and right are exchanged".to_owned(),
                    0.0,
                    "",
                ),
                Kind::Zoomed => {
                    let percent = 100.0 * (zoom - 1.0);
                    let longer = if percent > 0.0 { "longer" } else { "shorter" };
                    (
                        "zoomed_picture",
                        format!("{name} has another zoom"),
                        format!("a focal length {} {longer}", size(percent, "%")),
                        percent,
                        "%",
                    )
                }
                Kind::Foreign => (
                    "foreign_picture",
                    format!("{name} does not belong to the others"),
                    format!("it misses them by {}", size(rms_px, "px")),
                    rms_px,
                    "px",
                ),
            };
            let noise = capture.calibration.sigma0_px.powi(2);
            let gain = rms_px.powi(2) * frame.corners.len() as f64 / noise;
            Fault {
                code: code.to_owned(),
                found: true,
                title,
                size,
                value,
                unit: unit.to_owned(),
                unknowns: 1,
                gain,
                surprise: super::surprise(gain, 1),
                explains_px: rms_px,
                moves_px: 0.0,
                frames: vec![position],
            }
        })
        .collect()
}

/// What a picture is, its error with the camera of the others, px, and the ratio of focal lengths that fits it best.
fn kind(capture: &Capture<'_>, frame: &FrameReport) -> (Kind, f64, f64) {
    let camera = &capture.calibration.camera;
    let usual = capture.calibration.rms_inliers_px;
    let fits = |rms: f64| rms < EXPLAINED * usual;
    let error =
        |corners: &[Corner]| pose_of(camera, capture.target, corners).map_or(f64::INFINITY, |(_, r)| rms(&r));
    let plain = error(&frame.corners);
    let (zoom, zoomed) = zoomed(capture, frame).unwrap_or((1.0, f64::INFINITY));
    // Of a board seen nearly frontally the mirror image is not much worse than another zoom is.
    let mirrored = mirrored(&frame.corners, camera, capture.target).map_or(f64::INFINITY, |c| error(&c));
    if fits(mirrored) && mirrored < zoomed && !fits(plain) {
        return (Kind::Mirrored, plain, 1.0);
    }
    if fits(zoomed) { (Kind::Zoomed, plain, zoom) } else { (Kind::Foreign, plain, zoom) }
}

fn rms(residuals: &[Vector2<f64>]) -> f64 {
    (residuals.iter().map(|r| r.norm_squared()).sum::<f64>() / residuals.len().max(1) as f64).sqrt()
}

/// The corners as the picture would have shown them, unless it was mirrored: left and right exchanged, and the rows of the board counted
/// from its other end, because a board is never seen from behind.
fn mirrored(corners: &[Corner], camera: &Camera, target: &Target) -> Option<Vec<Corner>> {
    let size = target.grid()?;
    let last = f64::from(camera.size_px[0]) - 1.0;
    let mut list: Vec<Corner> = corners
        .iter()
        .map(|c| {
            let [column, row] = size.at(c.index);
            Corner {
                index: size.index(column, size.rows - 1 - row),
                px: Vector2::new(last - c.px.x, c.px.y),
                ..*c
            }
        })
        .collect();
    list.sort_by_key(|c| c.index);
    Some(list)
}

/// Ratio of the focal length that fits a picture best, and its error with that, px.
fn zoomed(capture: &Capture<'_>, frame: &FrameReport) -> Option<(f64, f64)> {
    let start = |by: f64| {
        let mut camera = capture.calibration.camera.clone();
        camera.params[..2].iter_mut().for_each(|f| *f *= by);
        camera
    };
    // Coarsely, then by steps of Gauss and Newton.
    let coarse = (-8..=8).map(|k| 1.1f64.powi(k)).filter_map(|by| {
        let (pose, residuals) = pose_of(&start(by), capture.target, &frame.corners).ok()?;
        Some((by, pose, rms(&residuals)))
    });
    let (by, pose, _) = coarse.min_by(|a, b| a.2.total_cmp(&b.2))?;
    let points: Option<Vec<_>> =
        frame.corners.iter().map(|c| capture.target.point_in_board(c.index)).collect();
    let seen = Seen {
        points: points?,
        observed: frame.corners.iter().map(|c| c.px).collect(),
        weights: vec![1.0; frame.corners.len()],
    };
    let fixed = Fixed {
        slots: vec![None; capture.calibration.camera.params.len()],
        free: 0,
        views: vec![seen],
        middle: capture.fixed.middle,
        half: capture.fixed.half,
        normal: capture.fixed.normal,
    };
    let terms = [super::Term { column: Column::Focal, factors: vec![1.0] }];
    let mut at = At { camera: capture.calibration.camera.clone(), poses: vec![pose], theta: vec![by - 1.0] };
    for _ in 0..6 {
        let linear = Linear::new(&fixed, &at, &terms)?;
        at = linear.step(&at, &terms, &linear.fit(&terms)?);
    }
    let by = 1.0 + at.theta[0];
    if !(0.2..5.0).contains(&by) {
        return None;
    }
    let (_, residuals) = pose_of(&start(by), capture.target, &frame.corners).ok()?;
    Some((by, rms(&residuals)))
}
