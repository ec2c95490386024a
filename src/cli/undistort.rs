//! `straightedge undistort`: photographs as a camera without distortion would have taken them.

use std::{path::PathBuf, process::ExitCode};

use super::{
    NO_RESULT,
    args::{Framed, Pictures},
    files, frames, print, say,
};
use crate::{
    calib::{
        Error, Result,
        camera::Model,
        format::{self, Evidence, Export},
        lens::Lens,
        number::{counted, percent},
        safe::{Shown, widest_alpha},
        undistort::{Framing, Interpolation, Straightener, View},
    },
    job::{photo, store},
    worker::{straighten, threads},
};

/// Name of the file with the camera of the undistorted pictures, before its extension.
const CAMERA: &str = "camera";

/// Undistort photographs; names, depth and metadata are kept
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    pictures: Pictures,
    /// Camera file of any format; also a splined camera of mrcal
    #[arg(long, value_name = "FILE")]
    camera: PathBuf,
    #[command(flatten)]
    framed: Framed,
    /// Cut to the largest rectangle of valid pixels
    #[arg(long)]
    crop: bool,
    /// lanczos (sharp) or bilinear (fast)
    #[arg(long, value_name = "METHOD", default_value = "lanczos")]
    interpolation: Interpolation,
    /// Pictures that are worked on at the same time [default: one for each processor]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Folder for the results; made where it is missing
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

pub(super) fn run(args: &Args) -> Result<ExitCode> {
    let out = &args.out;
    let (lens, safe) = files::lens(&args.camera)?;
    let mut straight = Straightener::new(lens.as_ref(), &args.framed.framing(), args.crop)?;
    for warning in &straight.warnings {
        say(&format!("warning: {}", warning.text));
    }
    beyond_safe(lens.as_ref(), safe.as_deref(), &args.framed.framing(), &straight.view)?;
    let pictures = photo::list(&args.pictures.paths)?;
    if pictures.is_empty() {
        return Err(files::no_pictures(&args.pictures.paths));
    }
    store::folder(out)?;
    let tasks = straighten::tasks(&pictures, out)?;
    let camera = camera_file(&straight.view)?.map(|(name, text)| (out.join(name), text));
    if let Some((path, _)) = &camera {
        if files::same(&args.camera, path) {
            return Err(Error::Invalid(format!(
                "{} is where the camera of the results would go: give another folder, or another name to your camera file",
                path.display()
            )));
        }
        files::may_write(path, [])?;
    }

    if tasks.len() > 2 {
        straight.keep();
    }
    let bar = frames::counter("Undistorting", tasks.len());
    let mut heard = |done| bar.set_position(done as u64);
    let threads = threads(args.threads);
    let results = straighten::all(&tasks, &straight, args.interpolation, threads, &mut heard);
    bar.finish_and_clear();
    let mut done = 0;
    for (task, result) in tasks.iter().zip(results) {
        let name = task.from.display();
        match result {
            Ok(notes) => {
                done += 1;
                notes.iter().for_each(|note| say(&format!("note: {name}: {note}")));
            }
            Err(error @ (Error::File { .. } | Error::Output { .. } | Error::Picture { .. })) => {
                say(&format!("error: {error}"));
            }
            Err(error) => say(&format!("error: {name}: {error}")),
        }
    }
    if done == 0 {
        let rest = camera.map(|(path, _)| format!(", so {} was not written", path.display()));
        say(&format!(
            "none of {} could be undistorted{}",
            counted(tasks.len(), "picture"),
            rest.unwrap_or_default()
        ));
        return Ok(ExitCode::from(NO_RESULT));
    }
    let [w, h] = straight.view.size_px;
    let [fx, fy, cx, cy] = straight.view.intrinsics;
    let mut said =
        format!("{done} of {} undistorted into {}; ", counted(tasks.len(), "picture"), out.display());
    let size = format!("{w} x {h} px, fx {fx:.2}, fy {fy:.2}, cx {cx:.2}, cy {cy:.2}\n");
    match (camera, straight.view.camera()) {
        (Some((path, text)), Some(camera)) => {
            // Beside no picture it would be the camera of nothing, or of the pictures of an earlier run.
            store::write(&path, text.as_bytes())?;
            said += &format!("their camera is {}: {}, {size}", path.display(), camera.model);
        }
        _ => {
            said += &format!("{}, {size}", args.framed.projection);
            say(
                "note: no camera model has such pictures, so no camera file was written: pixel (u, v) looks along (sin x, y, cos x) with x = (u - cx) / fx, y = (v - cy) / fy",
            );
        }
    }
    print(&said)?;
    Ok(ExitCode::SUCCESS)
}

/// Warns where straightened pictures show what no corner supports, and says which α does not.
///
/// # Errors
/// As [`View::new`].
pub(super) fn beyond_safe(
    lens: &dyn Lens,
    safe: Option<&[[f64; 2]]>,
    framing: &Framing,
    view: &View,
) -> Result<()> {
    let Some(polygon) = safe else { return Ok(()) };
    let share = Shown::new(lens, view, polygon).unsafe_fraction();
    if share < 0.005 {
        return Ok(());
    }
    let remedy = match (framing.fov_rad, widest_alpha(lens, framing, polygon)?) {
        (Some(_), _) => "a smaller --fov shows less of it".to_owned(),
        (None, Some(alpha)) => {
            format!("--alpha {:.2} shows only what they support", (100.0 * alpha).floor() / 100.0)
        }
        (None, None) => "photograph the board there, too".to_owned(),
    };
    say(&format!(
        "warning: {} of the straightened picture lies where no corner supports the calibration: {remedy}",
        percent(share)
    ));
    Ok(())
}

/// Name and text of the file with the camera of the results: OpenCV's where that holds it exactly, else our own. `None` where no model
/// has the projection.
fn camera_file(view: &View) -> Result<Option<(String, String)>> {
    let Some(camera) = view.camera() else { return Ok(None) };
    let format = if matches!(camera.model, Model::Pinhole | Model::Kb4) { "opencv" } else { "straightedge" };
    let format = format::by_name(format)?;
    let export = Export { camera: &camera, evidence: &Evidence::default(), report: None };
    let extension = format.extensions.first().copied().unwrap_or_default();
    Ok(Some((format!("{CAMERA}.{extension}"), format::write(format, &export)?.text)))
}
