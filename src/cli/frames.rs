//! From paths to what was seen in the pictures, over all processors, with a progress bar on a terminal.

use std::{ops::ControlFlow, path::PathBuf, time::Duration};

use indicatif::{ProgressBar, ProgressStyle};

use crate::{
    calib::{Error, Result, detect},
    job::{Inspection, Job, Output, Source, assemble::Entry, photo},
    worker::{self, Pool},
};

/// What was seen in a list of pictures.
pub(super) struct Inspected {
    /// One for each picture, in order.
    pub(super) entries: Vec<Entry>,
    /// Reading and decoding, summed over the pictures.
    pub(super) read_ms: f64,
    /// Detection, summed over the pictures.
    pub(super) detect_ms: f64,
}

/// Lanes as asked for, or one for each processor.
pub(super) fn pool(threads: Option<u16>) -> Pool {
    Pool::new(worker::threads(threads))
}

/// The pictures behind paths.
///
/// # Errors
/// Those of [`photo::list`].
pub(super) fn sources(paths: &[PathBuf]) -> Result<Vec<Source>> {
    Ok(photo::list(paths)?.into_iter().map(Source::File).collect())
}

/// Reads pictures and finds the grids of corners in them.
///
/// # Errors
/// Never for a single picture: that is in its entry.
pub(super) fn inspect(pool: &mut Pool, sources: Vec<Source>, options: detect::Options) -> Result<Inspected> {
    let names: Vec<String> = sources.iter().map(Source::name).collect();
    let bar = counter("Finding boards", names.len());
    let jobs = sources.into_iter().map(|source| Job::Inspect { source, options, thumbnail_px: 0 }).collect();
    let results = pool.map(jobs, &mut |done| {
        bar.set_position(done as u64);
        ControlFlow::Continue(())
    })?;
    bar.finish_and_clear();
    let (mut read_ms, mut detect_ms) = (0.0, 0.0);
    let entries = names.into_iter().zip(results).map(|(name, result)| {
        let inspection = result.and_then(inspection);
        if let Ok(i) = &inspection {
            read_ms += i.read_ms;
            detect_ms += i.detect_ms;
        }
        Entry::inspected(name, inspection)
    });
    let entries = entries.collect();
    Ok(Inspected { entries, read_ms, detect_ms })
}

fn inspection(output: Output) -> Result<Inspection> {
    match output {
        Output::Inspection(i) => Ok(*i),
        _ => Err(Error::Crashed("something else answered an inspection".to_owned())),
    }
}

/// A bar that counts; nothing where stderr is no terminal.
pub(super) fn counter(what: &'static str, n: usize) -> ProgressBar {
    let bar = ProgressBar::new(n as u64).with_message(what);
    if let Ok(style) = ProgressStyle::with_template("{msg} {bar:40.green} {pos}/{len}") {
        bar.set_style(style.progress_chars("━╸ "));
    }
    bar.enable_steady_tick(Duration::from_millis(100));
    bar
}

/// A bar that only turns.
pub(super) fn waiting(what: &'static str) -> ProgressBar {
    let bar = ProgressBar::new_spinner().with_message(what);
    bar.enable_steady_tick(Duration::from_millis(100));
    bar
}
