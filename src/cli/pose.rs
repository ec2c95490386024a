//! `straightedge pose`: where the board is in new pictures of a known camera.

use std::{fmt::Write as _, path::PathBuf, process::ExitCode};

use nalgebra::Vector2;
use serde::Serialize;

use super::{
    NO_RESULT, args, files,
    frames::{self, Inspected},
    measured::{Given, Measured},
    print, say,
};
use crate::{
    calib::{
        Result,
        board::Design,
        calibrate::pose_of,
        camera::Camera,
        circles::bias::corrected,
        json,
        observation::{Corner, FrameId, Observation},
        pose::Pose,
        report::{FrameReport, FrameState},
        residual::Field,
        stats,
        target::{Target, Unit},
    },
    job::assemble,
};

/// Find the pose of the board in pictures of a known camera
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Photographs, or folders of them; beside --corners only where the pictures are
    #[arg(value_name = "PATHS", required_unless_present = "corners")]
    paths: Vec<PathBuf>,
    /// Camera file of any format
    #[arg(long, value_name = "FILE")]
    camera: PathBuf,
    #[command(flatten)]
    board: args::Board,
    #[command(flatten)]
    measured: Measured,
    #[command(flatten)]
    detecting: args::Detecting,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Poses {
    version: &'static str,
    settings: Settings,
    #[serde(with = "crate::calib::synth::truth::camera")]
    camera: Camera,
    frames: Vec<FrameReport>,
}

#[derive(Serialize)]
struct Settings {
    camera: String,
    board: Option<String>,
    board_is_found: bool,
    square: f64,
    unit: Unit,
}

pub(super) fn run(args: &Args) -> Result<ExitCode> {
    let file = files::camera(&args.camera)?;
    for note in &file.notes {
        say(&format!("note: {note}"));
    }
    let (camera, residual) = (file.camera, file.evidence.residual.as_ref());
    let given = args.measured.read(&args.paths, Some(camera.size_px))?;
    let Given { board, square, target, inspected } = match given {
        Some(given) => given,
        None => Given { board: None, square: None, target: None, inspected: searched(args)? },
    };
    let entries = inspected.entries;
    let told = args.board.board.0.or(board.map(Design::checkerboard));
    let (square, unit) =
        args.board.square.map(|s| (s.value, s.unit)).or(square).unwrap_or(args.board.square());
    let is_known = target.is_some();
    let all: Vec<_> = entries.iter().collect();
    let mut warnings = Vec::new();
    let target = match target {
        Some(target) => Some(target),
        None => assemble::target_of(&all, told.as_ref(), square, &mut warnings)?,
    };
    warnings.iter().for_each(|warning| say(&format!("warning: {}", warning.text)));
    let dots = assemble::dots_of(&all, target.as_ref());
    let frames: Vec<FrameReport> = entries
        .iter()
        .map(|entry| {
            placed(assemble::frame(entry, target.as_ref(), &dots), &camera, residual, target.as_ref())
        })
        .collect();
    let found = frames.iter().any(|f| f.included);
    let settings = Settings {
        camera: args.camera.display().to_string(),
        board: target.as_ref().map(|t| match t {
            Target::Checkerboard { size, .. } => size.to_string(),
            other => other.words(),
        }),
        board_is_found: told.is_none() && !is_known,
        square,
        unit,
    };
    if args.json {
        let poses = Poses { version: env!("CARGO_PKG_VERSION"), settings, camera, frames };
        print(&json::text(&poses))?;
    } else {
        print(&table(&frames, unit))?;
    }
    Ok(if found { ExitCode::SUCCESS } else { ExitCode::from(NO_RESULT) })
}

/// What the pictures show.
fn searched(args: &Args) -> Result<Inspected> {
    let sources = frames::sources(&args.paths)?;
    if sources.is_empty() {
        return Err(files::no_pictures(&args.paths));
    }
    let mut pool = frames::pool(args.detecting.threads);
    frames::inspect(&mut pool, sources, args.detecting.options())
}

/// A picture with the pose of its board, or with the reason why it has none.
fn placed(
    mut frame: FrameReport,
    camera: &Camera,
    residual: Option<&Field>,
    target: Option<&Target>,
) -> FrameReport {
    let (Some(target), Some([w, h]), true) = (target, frame.image_size_px, frame.found) else { return frame };
    if [w, h] != camera.size_px {
        let [cw, ch] = camera.size_px;
        frame.why = format!(
            "it has {w} x {h} px, the camera is for {cw} x {ch}: convert the camera with `straightedge convert --scale` or `--crop`"
        );
        return frame;
    }
    // Where the model alone would show what was seen.
    let modelled =
        |c: &Corner| Some(Corner { px: residual.map_or(Some(c.px), |f| f.modelled(&c.px))?, ..*c });
    let Some(corners) = frame.corners.iter().map(modelled).collect::<Option<Vec<_>>>() else {
        frame.why =
            "the residual map of the camera file folds: calibrate again without --residual-map".to_owned();
        return frame;
    };
    match pose_of(camera, target, &corners).and_then(|found| centred(camera, target, &corners, found)) {
        Err(error) => frame.why = error.to_string(),
        Ok((pose, residuals)) => {
            let errors = stats::errors(&residuals.iter().map(|r| r.norm()).collect::<Vec<_>>());
            let stance = stats::stance(&pose, target);
            frame.included = true;
            frame.residuals_px = residuals.into_iter().map(Into::into).collect();
            (frame.rms_px, frame.max_px) = (Some(errors.rms), Some(errors.max));
            (frame.rvec_rad, frame.tvec) = (Some(pose.rvec().into()), Some(pose.translation.into()));
            (frame.tilt_rad, frame.roll_rad) = (Some(stance.tilt_rad), Some(stance.roll_rad));
            frame.distance = Some(stance.distance);
        }
    }
    frame
}

/// A pose and the residuals, px.
type Placed = (Pose, Vec<Vector2<f64>>);

/// Of circles the pose once more, from the places of their centres: the outline of a disc lies beside its projected centre.
fn centred(camera: &Camera, target: &Target, corners: &[Corner], found: Placed) -> Result<Placed> {
    let Target::Circles { radius, .. } = *target else { return Ok(found) };
    let seen = Observation { camera: 0, frame: FrameId(0), corners: corners.to_vec() };
    let points = target.points_in_board();
    let moved = corrected(&[seen], std::slice::from_ref(camera), &[found.0], &points, radius);
    moved.first().map_or(Ok(found), |observation| pose_of(camera, target, &observation.corners))
}

/// A line for each picture.
fn table(frames: &[FrameReport], unit: Unit) -> String {
    let wide = frames.iter().map(|f| f.name().chars().count()).max().unwrap_or(0).max(7);
    let mut out = format!(
        "{:wide$}  corners   rms px   tilt °   roll °  {:>12}  {:>32}  {:>29}\n",
        "picture",
        format!("distance {}", unit.name()),
        format!("translation {}", unit.name()),
        "rotation vector rad"
    );
    for f in frames {
        let name = f.name();
        let (Some(rms), Some(tilt), Some(roll), Some(distance), Some(r), Some(t)) =
            (f.rms_px, f.tilt_rad, f.roll_rad, f.distance, f.rvec_rad, f.tvec)
        else {
            let state = if f.state == FrameState::Unreadable { "unreadable" } else { "no pose" };
            let _ = writeln!(out, "{name:wide$}  {state}: {}", f.why);
            continue;
        };
        let _ = writeln!(
            out,
            "{name:wide$}  {:>7}  {rms:>7.4}  {:>7.2}  {:>7.2}  {distance:>12.2}  {:>10.3} {:>10.3} {:>10.3}  {:>9.5} {:>9.5} {:>9.5}",
            f.corners.len(),
            tilt.to_degrees(),
            roll.to_degrees(),
            t[0],
            t[1],
            t[2],
            r[0],
            r[1],
            r[2]
        );
    }
    out
}
