//! A folder of straightened photographs: names, depth and metadata are kept.

use std::{
    fs,
    path::{Path, PathBuf},
};

use super::side_by_side;
use crate::{
    calib::{
        Error, Result, order,
        undistort::{Interpolation, Straightener},
    },
    job::{develop::developed, store},
};

/// A photograph and where its undistorted self goes.
pub struct Task {
    /// The photograph.
    pub from: PathBuf,
    /// Where its straightened copy goes.
    pub to: PathBuf,
}

/// Straightens photographs side by side; the results, with what reading each told, are in the order of the tasks.
pub fn all(
    tasks: &[Task],
    straight: &Straightener,
    interpolation: Interpolation,
    threads: usize,
    heard: &mut dyn FnMut(usize),
) -> Vec<Result<Vec<String>>> {
    side_by_side(threads, tasks, |task| one(task, straight, interpolation), heard)
}

/// Straightens and writes one photograph; answers what reading it told.
fn one(task: &Task, straight: &Straightener, interpolation: Interpolation) -> Result<Vec<String>> {
    let (bytes, notes) = developed(&task.from, straight, interpolation)?;
    store::file(&task.to, &bytes)?;
    Ok(notes)
}

/// Where everything goes: by name, or with the folders below their common one where names repeat.
///
/// # Errors
/// [`Error::File`] for a path that cannot be found, [`Error::Invalid`] where a photograph lies in `out`.
pub fn tasks(pictures: &[PathBuf], out: &Path) -> Result<Vec<Task>> {
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
    let unique = order::set(pictures.iter().map(name)).len() == pictures.len();
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
