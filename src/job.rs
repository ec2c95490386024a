//! Jobs: plain data in, plain data out; the only place that reads photographs and looks at the clock.
//!
//! Threads, tests and the command line call the same [`run`]. A [`Request`] names its [`Source`], it never carries pixels:
//! the lane that runs [`Job::Inspect`] reads, decodes and detects, and what leaves it is corners and what the file says.

pub mod assemble;
pub mod develop;
pub mod evidence;
pub mod group;
mod other;
pub mod photo;
pub mod raster;
pub mod store;
pub mod validate;

use std::{
    any::Any,
    ops::ControlFlow,
    panic::{AssertUnwindSafe, catch_unwind},
    path::{Path, PathBuf},
    sync::Arc,
};

use serde::{Deserialize, Serialize};
use web_time::Instant;

use crate::calib::{
    Error, Result,
    advice::{Advice, Goal},
    calibrate::Comparison,
    camera::Camera,
    compare::Validity,
    detect::{self, Detection},
    experiment::{
        ablate::{self, Numbers},
        pipeline::Bench,
    },
    image::{Photo, Samples},
    report::Report,
    screen,
    synth::{self, Scene},
    twin::{self, Outcome},
    undistort::{Framing, Interpolation, Rect, Straightener, largest_valid},
};
pub use other::Other;

use develop::developed;
use evidence::{Case, Evidence};
use photo::{Colours, Exif};
use raster::Raster;

/// Where a picture comes from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Source {
    /// A file.
    File(PathBuf),
    /// View `view` of a scene, rendered in memory.
    View {
        /// The scene.
        scene: Arc<Scene>,
        /// From 0.
        view: usize,
    },
}

impl Source {
    /// What messages call it.
    pub fn name(&self) -> String {
        match self {
            Self::File(path) => path.display().to_string(),
            Self::View { scene, view } => scene.file_name(*view),
        }
    }

    /// Reads or renders the picture.
    ///
    /// # Errors
    /// Those of [`photo::read`] and [`synth::render()`].
    pub fn read(&self, colours: Colours) -> Result<photo::Picture> {
        match self {
            Self::File(path) => photo::read(path, colours),
            Self::View { scene, view } => {
                let plane = synth::render(scene, *view)?;
                let (width, height) = (plane.width(), plane.height());
                let samples = Samples::U8(plane.into_vec());
                Ok(photo::Picture::rendered(Photo { width, height, channels: 1, samples }))
            }
        }
    }
}

/// Something to do.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Job {
    /// Read a picture and find the grid of corners in it, whatever the size of the board.
    Inspect {
        /// The picture.
        source: Source,
        /// How to detect.
        options: detect::Options,
        /// Longer side of the thumbnail that is made, px; 0 for none.
        thumbnail_px: u32,
    },
    /// From what was seen to a camera with its evidence.
    Evidence(Box<Case>),
    /// Add what takes longer to evidence: what each picture does to the camera.
    Weigh(Box<Evidence>),
    /// Add the sources of error to evidence.
    Sources(Box<Evidence>),
    /// What to photograph next.
    Advise(Box<Evidence>, Goal),
    /// Draw what this calibration is of so many times anew, and calibrate that.
    Twin(Box<Report>, u32),
    /// Compare camera models on what would be calibrated.
    Compare(Box<Case>),
    /// Hold an old calibration against what was seen.
    Validate {
        /// What was seen.
        case: Box<Case>,
        /// Name of the old calibration's file.
        file: String,
        /// What is in it.
        text: String,
    },
    /// Read a picture to be shown.
    Look {
        /// The picture.
        source: Source,
    },
    /// Read a picture and make a small grey copy.
    Thumbnail {
        /// The picture.
        source: Source,
        /// Its longer side, px.
        longest_px: u32,
    },
    /// Calibrate the built-in scene with one thing changed, by its number ([`ablate::trial`]).
    Ablate(u32),
    /// Read a photograph, take the lens out of it, and make a file of the same kind of it.
    Develop {
        /// The photograph.
        path: PathBuf,
        /// Where the file is written; without a place it is the answer.
        to: Option<PathBuf>,
        /// The camera that took it.
        camera: Camera,
        /// As in [`Job::Straighten`].
        framing: Framing,
    },
    /// Read a picture and take the lens out of it.
    Straighten {
        /// The picture.
        source: Source,
        /// The camera that took it.
        camera: Camera,
        /// How it is laid out, and how much of it is shown.
        framing: Framing,
    },
}

impl Job {
    /// The file that it reads.
    pub fn file(&self) -> Option<&Path> {
        match self {
            Self::Inspect { source, .. }
            | Self::Look { source }
            | Self::Thumbnail { source, .. }
            | Self::Straighten { source, .. } => match source {
                Source::File(path) => Some(path),
                Source::View { .. } => None,
            },
            Self::Develop { path, .. } => Some(path),
            Self::Evidence(_)
            | Self::Weigh(_)
            | Self::Advise(..)
            | Self::Twin(..)
            | Self::Sources(_)
            | Self::Compare(_)
            | Self::Validate { .. }
            | Self::Ablate(_) => None,
        }
    }
}

/// What a job answers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Output {
    /// Of [`Job::Inspect`].
    Inspection(Box<Inspection>),
    /// Of [`Job::Evidence`], [`Job::Weigh`] and [`Job::Sources`].
    Evidence(Box<Evidence>),
    /// Of [`Job::Advise`].
    Advice(Box<Advice>),
    /// Of [`Job::Twin`].
    Twin(Box<Outcome>),
    /// Of [`Job::Compare`].
    Compared(Box<Comparison>),
    /// Of [`Job::Validate`].
    Validity(Box<Validity>),
    /// Of [`Job::Look`] and [`Job::Thumbnail`].
    Raster(Raster),
    /// Of [`Job::Ablate`]; a calibration that is refused is an outcome.
    Effect(std::result::Result<Box<Numbers>, String>),
    /// Of [`Job::Develop`]: the bytes of the file, none where they were written.
    File(#[serde(with = "serde_bytes")] Vec<u8>),
    /// Of [`Job::Straighten`], with the largest rectangle of it in which every pixel is valid.
    Straight(Raster, Option<Rect>),
}

/// What is known of a picture, whatever the board.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Inspection {
    /// `[width, height]` of the stored pixels.
    pub size_px: [u32; 2],
    /// What the file says about camera, lens and time.
    pub exif: Exif,
    /// Hash of the file's bytes.
    pub bytes_hash: u128,
    /// Hash of the grey pixels: equal for copies of one picture.
    pub pixels_hash: u128,
    /// A small grey copy, where it was asked for.
    pub thumbnail: Option<Raster>,
    /// What reading it told.
    pub notes: Vec<String>,
    /// What was found.
    pub detection: Detection,
    /// What else was found, where that is no plain checkerboard.
    #[serde(default, skip_serializing_if = "Other::is_none")]
    pub other: Other,
    /// Wall time of reading and decoding, ms.
    pub read_ms: f64,
    /// Wall time of the detection, ms.
    pub detect_ms: f64,
}

/// By what the asker recognises the reply: a position in a list, or a hash of what the job is made from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Key(pub u128);

/// A job with its key.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Request {
    /// Comes back with the reply.
    pub key: Key,
    /// What to do.
    pub job: Job,
}

/// The answer to a request.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Reply {
    /// The request's.
    pub key: Key,
    /// What came out, or why nothing did.
    pub result: Result<Output>,
}

/// Share of a job that is done, 0..=1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Progress(pub f32);

/// Runs a job in this thread. `report` hears how far it is and may stop it; a stopped job has no reply.
///
/// A panic inside becomes [`Error::Crashed`] in the reply.
pub fn run(request: Request, report: &mut dyn FnMut(Progress) -> ControlFlow<()>) -> Option<Reply> {
    let Request { key, job } = request;
    let result = caught(|| perform(job, report));
    (result != Err(Error::Stopped)).then_some(Reply { key, result })
}

/// Turns a panic into an error.
fn caught<T>(work: impl FnOnce() -> Result<T>) -> Result<T> {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|panic| Err(Error::Crashed(message(panic.as_ref()))))
}

fn perform(job: Job, report: &mut dyn FnMut(Progress) -> ControlFlow<()>) -> Result<Output> {
    match job {
        Job::Inspect { source, options, thumbnail_px } => {
            inspect(&source, &options, thumbnail_px, report).map(|i| Output::Inspection(Box::new(i)))
        }
        Job::Evidence(case) => evidence::evidence(&case, &mut |share| report(Progress(share)))
            .map(|e| Output::Evidence(Box::new(e))),
        Job::Weigh(mut found) => {
            evidence::with_influence(&mut found, &mut |share| report(Progress(share)))?;
            Ok(Output::Evidence(found))
        }
        Job::Sources(mut found) => {
            evidence::with_sources(&mut found, &mut |share| report(Progress(share)))?;
            Ok(Output::Evidence(found))
        }
        Job::Advise(found, goal) => Ok(Output::Advice(Box::new(evidence::advised(&found, goal)))),
        Job::Twin(of, runs) => twin::run(&of, runs as usize, &mut |share| report(Progress(share)))
            .map(|o| Output::Twin(Box::new(o))),
        Job::Compare(case) => evidence::compared(&case, &mut |share| report(Progress(share)))
            .map(|c| Output::Compared(Box::new(c))),
        Job::Validate { case, file, text } => {
            validate::held(*case, &file, &text, &mut |share| report(Progress(share)))
                .map(|(validity, _)| Output::Validity(Box::new(validity)))
        }
        Job::Look { source } => Ok(Output::Raster(Raster::of(source.read(Colours::Keep)?.photo))),
        Job::Thumbnail { source, longest_px } => {
            let gray = source.read(Colours::Gray)?.photo.into_gray();
            Ok(Output::Raster(Raster::thumbnail(&gray, longest_px as usize)))
        }
        Job::Ablate(number) => {
            let effect = ablate::effect(number as usize, &mut Bench::default())?;
            Ok(Output::Effect(effect.outcome.map(Box::new)))
        }
        Job::Develop { path, to, camera, framing } => {
            let straight = Straightener::new(&camera, &framing, false)?;
            let (bytes, _) = developed(&path, &straight, Interpolation::Lanczos)?;
            let Some(to) = to else { return Ok(Output::File(bytes)) };
            store::file(&to, &bytes)?;
            Ok(Output::File(Vec::new()))
        }
        Job::Straighten { source, camera, framing } => {
            let photo = source.read(Colours::Keep)?.photo;
            let straight = Straightener::new(&camera, &framing, false)?;
            let valid = largest_valid(&straight.map);
            Ok(Output::Straight(Raster::of(straight.run(&photo, Interpolation::Bilinear)?), valid))
        }
    }
}

/// Of a picture of a display.
const ON_SCREEN: &str = "a fine regular pattern lies over its white squares, as a screen has it: where its pixels and those of the camera \
                         interfere, corners are off; print the board, or turn and move the camera until the pattern is gone";

fn inspect(
    source: &Source,
    options: &detect::Options,
    thumbnail_px: u32,
    report: &mut dyn FnMut(Progress) -> ControlFlow<()>,
) -> Result<Inspection> {
    let mut at = |share| if report(Progress(share)).is_break() { Err(Error::Stopped) } else { Ok(()) };
    at(0.0)?;
    let start = Instant::now();
    let picture = source.read(Colours::Gray)?;
    let size_px = [picture.photo.width as u32, picture.photo.height as u32];
    let gray = picture.photo.into_gray();
    let thumbnail = (thumbnail_px > 0).then(|| Raster::thumbnail(&gray, thumbnail_px as usize));
    let read_ms = ms_since(start);
    at(0.5)?;
    let start = Instant::now();
    let detection = detect::detect(&gray, options);
    let other = Other::beside(&gray, &detection);
    let mut notes = picture.notes;
    if detection.grid.as_ref().is_some_and(|grid| screen::is_shown(&gray, grid)) {
        notes.push(ON_SCREEN.to_owned());
    }
    Ok(Inspection {
        size_px,
        exif: picture.exif,
        bytes_hash: picture.bytes_hash,
        pixels_hash: picture.pixels_hash,
        thumbnail,
        notes,
        detection,
        other,
        read_ms,
        detect_ms: ms_since(start),
    })
}

/// Wall time since `start`, ms.
pub fn ms_since(start: Instant) -> f64 {
    start.elapsed().as_secs_f64() * 1e3
}

/// The message of a panic.
pub fn message(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().copied();
    text.or_else(|| panic.downcast_ref::<String>().map(String::as_str)).unwrap_or("unknown panic").to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_becomes_an_error() {
        assert_eq!(caught::<()>(|| panic!("at {}", 3)), Err(Error::Crashed("at 3".to_owned())));
        assert_eq!(caught(|| Ok(3)), Ok(3));
    }

    #[test]
    fn a_stopped_job_has_no_reply() {
        let source = Source::View { scene: Arc::new(Scene::seed()), view: 0 };
        let job = Job::Inspect { source, options: detect::Options::default(), thumbnail_px: 0 };
        let request = Request { key: Key(7), job };
        assert_eq!(run(request.clone(), &mut |_| ControlFlow::Break(())), None);
        let reply = run(request, &mut |_| ControlFlow::Continue(())).unwrap();
        assert_eq!(reply.key, Key(7));
        let Ok(Output::Inspection(inspection)) = reply.result else { panic!("{:?}", reply.result) };
        assert_eq!(inspection.size_px, [800, 600]);
        assert!(inspection.detection.grid.is_some(), "{}", inspection.detection.why);
    }
}
