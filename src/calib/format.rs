//! Camera files of twelve programs: one list, [`FORMATS`], drives reading, writing, help and tests.
//!
//! Each format has one file with a writer and a reader. Inside, a camera has its pixel origin at the *centre* of the
//! top-left pixel; a format with another origin converts at its border. What a format cannot hold is never dropped in
//! silence: the parameters are refitted over the picture and the remaining error is reported, or the file is refused.
//! Every text is read back before it is handed out, and both cameras are compared over a grid of rays.
//!
//! `docs/formats.md` lists origin, order of the terms and limits of each format, and what was checked with which tool.

mod basalt;
mod colmap;
mod convert;
mod destination;
mod gyroflow;
mod kalibr;
mod lens;
mod matlab;
mod metashape;
mod mrcal;
mod nerfstudio;
mod node;
mod number;
mod opencv;
mod opensfm;
mod residual;
mod ros;
mod straightedge;

use std::sync::Arc;

use nalgebra::DMatrix;

use super::{
    Error, Result,
    camera::{Camera, refit::grid},
    compare::date,
    html::embedded,
    lens::Lens,
    observation::Corner,
    pose::Pose,
    report::{FrameReport, Report},
    residual::{Corrected, Field},
    target::{BoardSize, Unit},
};

pub use destination::Destination;
pub use mrcal::splined::{is_splined, read_splined, write_splined};

/// Largest camera file that is read, bytes.
const MAX_BYTES: usize = 512 << 20;
/// Columns and rows of rays over which a written text is compared with the camera.
const CHECK_GRID: [u32; 2] = [20, 15];
/// Largest difference of a text that claims to hold the camera exactly, px: above the rounding of a sum, below any use.
const EXACT_PX: f64 = 1e-9;

/// A file format for cameras.
#[derive(Clone, Copy, Debug)]
pub struct Format {
    /// Name before the colon of `[FORMAT:]FILE`.
    pub name: &'static str,
    /// Name for people.
    pub title: &'static str,
    /// Extensions that mean this format where no name is given.
    pub extensions: &'static [&'static str],
    /// Extensions that its files have, the usual one first.
    pub usual: &'static [&'static str],
    /// Name before the extension that is proposed for its files.
    pub stem: &'static str,
    /// Where its pixels begin and in which order its terms stand, for people.
    pub convention: &'static str,
    /// What it cannot hold, for help and tooltips.
    pub lacks: &'static str,
    write: fn(&Export<'_>) -> Result<Draft>,
    read: fn(&str) -> Result<Content>,
    /// Whether a text has the marks of this format.
    sniff: fn(&str) -> bool,
}

/// All formats. When a file is read, the first one that recognises the text is taken.
pub const FORMATS: &[Format] = &[
    opencv::FORMAT,
    ros::FORMAT,
    kalibr::FORMAT,
    colmap::FORMAT,
    nerfstudio::FORMAT,
    straightedge::FORMAT,
    mrcal::FORMAT,
    matlab::FORMAT,
    metashape::FORMAT,
    basalt::FORMAT,
    gyroflow::FORMAT,
    opensfm::FORMAT,
];

/// A format by its name.
///
/// # Errors
/// [`Error::Invalid`] with the list of names.
pub fn by_name(name: &str) -> Result<&'static Format> {
    FORMATS.iter().find(|f| f.name.eq_ignore_ascii_case(name)).ok_or_else(|| {
        Error::Invalid(format!("\"{name}\" is not a camera file format: choose one of {}", names()))
    })
}

fn names() -> String {
    FORMATS.iter().map(|f| f.name).collect::<Vec<_>>().join(", ")
}

/// What a file can hold beside the camera; everything is optional.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Evidence {
    /// Name of the camera.
    pub name: Option<String>,
    /// Who made the camera, as the photographs say (EXIF).
    pub make: Option<String>,
    /// Its model, as the photographs say (EXIF).
    pub camera_model: Option<String>,
    /// When it was calibrated, as text.
    pub date: Option<String>,
    /// Inner corners of the board.
    pub board: Option<BoardSize>,
    /// Edge of a square, in `unit`.
    pub square: Option<f64>,
    /// Unit of `square` and of the poses.
    pub unit: Option<Unit>,
    /// √(Σ|r|²/N), px.
    pub rms_px: Option<f64>,
    /// σ of each parameter in the model's order, `None` where fixed; empty where unknown.
    pub sigma: Vec<Option<f64>>,
    /// Covariance of the parameters at the positions `free`.
    pub covariance: Option<DMatrix<f64>>,
    /// Positions, in the model's order, of the rows and columns of `covariance`.
    pub free: Vec<usize>,
    /// What is seen beyond the camera, as a displacement over the picture.
    pub residual: Option<Field>,
    /// The part of the picture that corners support, as a polygon, px.
    pub safe: Option<Vec<[f64; 2]>>,
    /// The pictures.
    pub frames: Vec<Frame>,
}

impl From<&Report> for Evidence {
    /// What formats other than our own can hold beside the camera.
    fn from(report: &Report) -> Self {
        let frame = |f: &FrameReport| Frame {
            file: f.file.clone(),
            camera_from_board: f.camera_from_board(),
            rms_px: f.rms_px,
            corners: f.corners.clone(),
        };
        let settings = &report.settings;
        let solution = report.solution.as_ref();
        let group = report.groups.first();
        Self {
            make: group.and_then(|g| g.make.clone()),
            camera_model: group.and_then(|g| g.model.clone()),
            date: report.taken().and_then(date::days).map(date::iso),
            board: settings.board,
            square: Some(settings.square),
            unit: Some(settings.unit),
            rms_px: solution.map(|s| s.rms_px),
            sigma: solution.map(|s| s.sigma.iter().map(|(_, v)| *v).collect()).unwrap_or_default(),
            residual: solution.and_then(|s| s.residual_map.as_ref()?.field.clone()),
            safe: solution.and_then(|s| Some(s.safe_region.as_ref()?.polygon_px.clone())),
            frames: report.included().map(frame).collect(),
            ..Self::default()
        }
    }
}

impl Evidence {
    /// The covariance over all parameters of the camera in the model's order, zero where fixed; `None` where it is not known.
    pub fn covariance_of_all(&self, camera: &Camera) -> Option<DMatrix<f64>> {
        let n = camera.params.len();
        let small = self.covariance.as_ref()?;
        let free = &self.free;
        if small.nrows() != free.len() || small.ncols() != free.len() || free.iter().any(|i| *i >= n) {
            return None;
        }
        let mut full = DMatrix::zeros(n, n);
        for (a, i) in free.iter().enumerate() {
            for (b, j) in free.iter().enumerate() {
                full[(*i, *j)] = small[(a, b)];
            }
        }
        Some(full)
    }
}

/// A picture of a calibration.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Frame {
    /// File name.
    pub file: String,
    /// Where the board was.
    pub camera_from_board: Option<Pose>,
    /// √(Σ|r|²/n), px.
    pub rms_px: Option<f64>,
    /// Corners; σ is 0 where the file does not say.
    pub corners: Vec<Corner>,
}

/// What a writer gets.
#[derive(Clone, Copy, Debug)]
pub struct Export<'a> {
    /// The camera.
    pub camera: &'a Camera,
    /// What else is known.
    pub evidence: &'a Evidence,
    /// Everything that is known: where it is given, its JSON is the text of the `straightedge` format.
    pub report: Option<&'a Report>,
}

/// A camera file as text, checked.
#[derive(Clone, Debug, PartialEq)]
pub struct Written {
    /// The file.
    pub text: String,
    /// Largest difference between the camera and the text read back, over a grid of rays that covers the picture, px:
    /// rounding, or the error of a refit.
    pub self_check_px: f64,
    /// What the user should know: refits with their error, placeholders.
    pub notes: Vec<String>,
}

/// A camera that was read, with what else the file held.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraFile {
    /// Name of the format.
    pub format: &'static str,
    /// The camera.
    pub camera: Camera,
    /// What else was there.
    pub evidence: Evidence,
    /// What the user should know: several cameras in the file, an extension that does not fit, …
    pub notes: Vec<String>,
}

/// What a writer hands to the self-check.
struct Draft {
    text: String,
    notes: Vec<String>,
    /// Whether the text holds the camera exactly; otherwise `notes` has the error of the refit.
    exact: bool,
}

impl Draft {
    const fn exact(text: String) -> Self {
        Self { text, notes: Vec::new(), exact: true }
    }

    /// Exact unless there is a note of a refit.
    fn noted(text: String, refit: Option<String>) -> Self {
        Self { text, exact: refit.is_none(), notes: refit.into_iter().collect() }
    }
}

/// What a reader found.
struct Content {
    camera: Camera,
    evidence: Evidence,
    notes: Vec<String>,
}

impl CameraFile {
    /// What undistorts pictures of this camera: with its displacement where the file has one.
    pub fn lens(&self) -> Arc<dyn Lens> {
        let camera = self.camera.clone();
        match self.evidence.residual.clone() {
            Some(field) => Arc::new(Corrected { camera, field }),
            None => Arc::new(camera),
        }
    }
}

impl From<Camera> for Content {
    fn from(camera: Camera) -> Self {
        Self { camera, evidence: Evidence::default(), notes: Vec::new() }
    }
}

/// Writes a camera file, reads it back and compares both cameras over a grid of rays that covers the picture.
///
/// # Errors
/// [`Error::Invalid`] for a camera that [`Camera::validate`] refuses, [`Error::Unsupported`] where the format can hold
/// no approximation of it.
pub fn write(format: &Format, export: &Export<'_>) -> Result<Written> {
    export.camera.validate()?;
    let Draft { text, mut notes, exact } = (format.write)(export)?;
    let back = (format.read)(&text)?;
    let self_check_px = difference_px(export.camera, &back.camera)?;
    if exact && self_check_px > EXACT_PX * scale_px(export.camera) {
        return Err(Error::Unsupported(format!(
            "the {} text does not give back the camera: {self_check_px:.3e} px off; choose another format",
            format.title
        )));
    }
    if export.evidence.residual.is_some() && back.evidence.residual.is_none() {
        notes.push(format!(
            "{} has no place for the residual map: it is in the JSON of straightedge, and as an array by --residual-map",
            format.title
        ));
    }
    Ok(Written { text, self_check_px, notes })
}

/// Reads a camera file of any format, recognised by its content. `file` is the name for messages.
///
/// # Errors
/// [`Error::Format`] with the file, the format and the field that is wrong, or the model that is not known here.
pub fn read(text: &str, file: &str) -> Result<CameraFile> {
    if text.len() > MAX_BYTES {
        return Err(Error::format(file, "larger than 512 MB: this is not a camera file"));
    }
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    // A page of ours is its report.
    let text = embedded(text).unwrap_or(text);
    if text.trim().is_empty() {
        return Err(Error::format(file, "the file is empty: export the camera again"));
    }
    let Some(format) = FORMATS.iter().find(|f| (f.sniff)(text)) else {
        return Err(Error::format(
            file,
            format!(
                "no camera file format was recognised (damaged, or another kind of file): one of {} is expected",
                names()
            ),
        ));
    };
    let named = |e: Error| match e {
        Error::Invalid(message) | Error::Unsupported(message) => {
            Error::format(&format!("{file} ({})", format.name), message)
        }
        other => other,
    };
    let Content { camera, evidence, mut notes } = (format.read)(text).map_err(named)?;
    camera.validate().and_then(|()| plausible(&camera)).map_err(named)?;
    if let Some(extension) = destination::extension(file)
        && !format.usual.contains(&extension.as_str())
    {
        notes.push(format!("{file}: read as {}, although its extension is .{extension}", format.name));
    }
    Ok(CameraFile { format: format.name, camera, evidence, notes })
}

/// Farthest principal point outside of the picture, in picture sizes.
const FARTHEST: f64 = 10.0;
/// Focal lengths of cameras, in picture widths.
const FOCAL: std::ops::RangeInclusive<f64> = 1e-2..=1e3;

/// Refuses what no photograph was made with: two fields of such a file contradict each other.
fn plausible(camera: &Camera) -> Result<()> {
    let [w, h] = camera.size_px.map(f64::from);
    for (param, value) in camera.spec().params.iter().zip(&camera.params).take(4) {
        let extent = match param.name {
            "fx" | "fy" if !FOCAL.contains(&(value / w)) => w,
            "cx" if !(-FARTHEST..=1.0 + FARTHEST).contains(&(value / w)) => w,
            "cy" if !(-FARTHEST..=1.0 + FARTHEST).contains(&(value / h)) => h,
            _ => continue,
        };
        return Err(Error::Invalid(format!(
            "{} of {value:e} px contradicts the picture of {w} x {h} px ({:.1e} times its size): correct one of them, or export the camera again",
            param.name,
            value / extent
        )));
    }
    Ok(())
}

/// Reads the bytes of a camera file; see [`read`].
///
/// # Errors
/// As [`read`], and [`Error::Format`] for bytes that are not UTF-8 text.
pub fn read_bytes(bytes: &[u8], file: &str) -> Result<CameraFile> {
    let text = std::str::from_utf8(bytes).map_err(|e| {
        Error::format(
            file,
            format!("not a text file (byte {} is not UTF-8): choose a camera file", e.valid_up_to()),
        )
    })?;
    read(text, file)
}

/// Rounding of a projection grows with the picture.
fn scale_px(camera: &Camera) -> f64 {
    let [fx, fy, cx, cy] = camera.intrinsics();
    [fx, fy, cx.abs(), cy.abs()].into_iter().fold(1e3, f64::max) / 1e3
}

/// Largest distance between the projections of the rays of a grid over the picture, px.
fn difference_px(camera: &Camera, other: &Camera) -> Result<f64> {
    let mut worst = 0.0f64;
    let mut seen = 0;
    for px in grid(camera.size_px, CHECK_GRID) {
        let Some(ray) = camera.unproject(&px) else { continue };
        let Some(here) = (camera.spec().project_px)(&camera.params, &ray) else { continue };
        seen += 1;
        worst = match (other.spec().project_px)(&other.params, &ray) {
            Some(there) => worst.max((there - here).norm()),
            None => f64::INFINITY,
        };
    }
    if seen == 0 {
        return Err(Error::Unsupported(
            "no pixel of the picture has a ray: the distortion folds everywhere, the camera is not usable"
                .to_owned(),
        ));
    }
    if worst.is_finite() {
        Ok(worst)
    } else {
        Err(Error::Unsupported(
            "the written camera does not see the whole picture: choose another format".to_owned(),
        ))
    }
}

#[cfg(test)]
mod tests;
