//! `straightedge undistort`: photographs as a camera without distortion would have taken them.

use std::{path::PathBuf, process::ExitCode};

use super::{NO_RESULT, args::Pictures, files, frames, print, say};
use crate::{
    calib::{
        Error, Result,
        format::{self, Evidence, Export},
        number::counted,
        undistort::{Interpolation, Straightener},
    },
    job::{photo, store},
    worker::{straighten, threads},
};

/// File with the camera of the undistorted pictures.
const CAMERA: &str = "camera.yaml";

/// Undistort photographs; names, depth and metadata are kept
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    pictures: Pictures,
    /// Camera file of any format
    #[arg(long, value_name = "FILE")]
    camera: PathBuf,
    /// From 0 (only valid pixels) to 1 (all pixels of the photograph, black around them)
    #[arg(long, value_name = "0..1", default_value = "0", value_parser = alpha, allow_hyphen_values = true)]
    alpha: f64,
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

fn alpha(text: &str) -> Result<f64> {
    match text.trim().replace(',', ".").parse() {
        Ok(a) if (0.0..=1.0).contains(&a) => Ok(a),
        _ => Err(Error::Invalid(format!("\"{text}\" is not an alpha: give a number from 0 to 1"))),
    }
}

pub(super) fn run(args: &Args) -> Result<ExitCode> {
    let out = &args.out;
    let file = files::camera(&args.camera)?;
    for note in &file.notes {
        say(&format!("note: {note}"));
    }
    let straight = Straightener::new(file.lens().as_ref(), args.alpha, args.crop)?;
    for warning in &straight.warnings {
        say(&format!("warning: {}", warning.text));
    }
    let pictures = photo::list(&args.pictures.paths)?;
    if pictures.is_empty() {
        return Err(files::no_pictures(&args.pictures.paths));
    }
    store::folder(out)?;
    let tasks = straighten::tasks(&pictures, out)?;
    let camera = out.join(CAMERA);
    if files::same(&args.camera, &camera) {
        return Err(Error::Invalid(format!(
            "{} is where the camera of the results would go: give another folder, or another name to your camera file",
            camera.display()
        )));
    }
    files::may_write(&camera, [])?;
    let text = format::write(
        format::by_name("opencv")?,
        &Export { camera: &straight.camera, evidence: &Evidence::default(), report: None },
    )?
    .text;

    let bar = frames::counter("Undistorting", tasks.len());
    let mut heard = |done| bar.set_position(done as u64);
    let threads = threads(args.threads);
    let results = straighten::all(&tasks, &straight, &file.camera, args.interpolation, threads, &mut heard);
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
        say(&format!(
            "none of {} could be undistorted, so {} was not written",
            counted(tasks.len(), "picture"),
            camera.display()
        ));
        return Ok(ExitCode::from(NO_RESULT));
    }
    // Beside no picture it would be the camera of nothing, or of the pictures of an earlier run.
    store::write(&camera, text.as_bytes())?;
    let [w, h] = straight.camera.size_px;
    let [fx, fy, cx, cy] = straight.camera.intrinsics();
    print(&format!(
        "{done} of {} undistorted into {}; their camera is {}: pinhole, {w} x {h} px, fx {fx:.2}, fy {fy:.2}, cx {cx:.2}, cy {cy:.2}\n",
        counted(tasks.len(), "picture"),
        out.display(),
        camera.display()
    ))?;
    Ok(ExitCode::SUCCESS)
}
