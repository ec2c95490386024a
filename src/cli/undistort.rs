//! `straightedge undistort`: photographs as a camera without distortion would have taken them.

use std::{
    collections::BTreeSet,
    fs,
    path::{Path, PathBuf},
    process::ExitCode,
};

use super::{NO_RESULT, args::Pictures, files, frames, print, say};
use crate::{
    calib::{
        Error, Result,
        camera::Camera,
        format::{self, Evidence, Export},
        number::counted,
        undistort::{Interpolation, Straightener},
    },
    job::photo::{self, Colours},
    worker::{side_by_side, threads},
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

/// A photograph and where its undistorted self goes.
struct Task {
    from: PathBuf,
    to: PathBuf,
}

pub(super) fn run(args: &Args) -> Result<ExitCode> {
    let out = &args.out;
    let file = files::camera(&args.camera)?;
    for note in &file.notes {
        say(&format!("note: {note}"));
    }
    let straight = Straightener::new(&file.camera, args.alpha, args.crop)?;
    for warning in &straight.warnings {
        say(&format!("warning: {}", warning.text));
    }
    let pictures = photo::list(&args.pictures.paths)?;
    if pictures.is_empty() {
        return Err(files::no_pictures(&args.pictures.paths));
    }
    files::folder(out)?;
    let tasks = tasks(&pictures, out)?;
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
    let work = |task: &Task| one(task, &straight, &file.camera, args.interpolation);
    let results =
        side_by_side(threads(args.threads), &tasks, work, &mut |done| bar.set_position(done as u64));
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
    files::write(&camera, text.as_bytes())?;
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

/// Reads, undistorts and writes one photograph; answers what reading it told.
fn one(
    task: &Task,
    straight: &Straightener,
    camera: &Camera,
    interpolation: Interpolation,
) -> Result<Vec<String>> {
    let name = task.from.display().to_string();
    let original = photo::bytes(&task.from)?;
    let picture = photo::decode(&name, &original, Colours::Keep)?;
    let [w, h] = camera.size_px;
    if [picture.photo.width, picture.photo.height] != [w as usize, h as usize] {
        return Err(Error::Picture {
            file: name,
            message: format!(
                "it has {} x {} px, the camera is for {w} x {h}: where the photograph was resized or cropped, convert the camera with `straightedge convert --scale` or `--crop`",
                picture.photo.width, picture.photo.height
            ),
        });
    }
    let photo = straight.run(&picture.photo, interpolation)?;
    let bytes = photo::write::like(&name, &original, &photo)?;
    if let Some(folder) = task.to.parent() {
        files::folder(folder)?;
    }
    files::write(&task.to, &bytes)?;
    Ok(picture.notes)
}

/// Where everything goes: by name, or with the folders below their common one where names repeat.
fn tasks(pictures: &[PathBuf], out: &Path) -> Result<Vec<Task>> {
    let wrong = |path: &Path, e: &std::io::Error| Error::File {
        path: path.display().to_string(),
        message: format!("it cannot be found ({e}): check the path"),
    };
    let home = fs::canonicalize(out).map_err(|e| wrong(out, &e))?;
    let full: Vec<PathBuf> =
        pictures.iter().map(|p| fs::canonicalize(p).map_err(|e| wrong(p, &e))).collect::<Result<_>>()?;
    if let Some(i) = full.iter().position(|p| p.starts_with(&home)) {
        return Err(Error::Invalid(format!(
            "{} lies in {}, where the results would go: give another folder, so that no photograph is overwritten",
            pictures[i].display(),
            out.display()
        )));
    }
    let name = |p: &PathBuf| p.file_name().unwrap_or_default().to_ascii_lowercase();
    let unique = pictures.iter().map(name).collect::<BTreeSet<_>>().len() == pictures.len();
    // Names as the user gave them: a link keeps its own.
    let whole: Vec<PathBuf> =
        pictures.iter().map(|p| std::path::absolute(p).unwrap_or_else(|_| p.clone())).collect();
    let common = common_folder(&whole);
    let task = |(from, whole): (&PathBuf, &PathBuf)| {
        let below = whole.strip_prefix(&common).ok().filter(|_| !unique);
        let to =
            below.map_or_else(|| out.join(from.file_name().unwrap_or_default()), |below| out.join(below));
        Task { from: from.clone(), to }
    };
    Ok(pictures.iter().zip(&whole).map(task).collect())
}

/// The deepest folder that holds all files.
fn common_folder(files: &[PathBuf]) -> PathBuf {
    let mut common = files.first().and_then(|f| f.parent()).unwrap_or(Path::new("")).to_path_buf();
    for file in files {
        while !file.starts_with(&common) && common.pop() {}
    }
    common
}
