//! `straightedge synth`: pictures of a board whose every corner is known.

use std::{
    collections::BTreeSet,
    fs,
    path::{Path, PathBuf},
    process::ExitCode,
    str::FromStr,
};

use super::{files, frames, print, say};
use crate::job::store;
use crate::{
    calib::{
        Error, Result,
        camera::Camera,
        number::counted,
        synth::{self, Cut, Degrade, Method, Origin, Renderer, Scene, poses},
        target::{BoardSize, Length},
    },
    worker::{side_by_side, threads},
};

/// File with the true camera, poses and corners.
const TRUTH: &str = "truth.json";
/// File that makes the same pictures again.
const SCENE: &str = "scene.json";
/// Most random poses.
const MOST: usize = 100_000;

/// Render pictures of a checkerboard with exactly known truth
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// `seed` (the built-in scene of the source document), or a scene.json
    #[arg(long, value_name = "seed|FILE", default_value = "seed")]
    scene: PathBuf,
    /// Draw so many poses in place of the scene's: random:50
    #[arg(long, value_name = "random:N")]
    poses: Option<RandomPoses>,
    /// What spoils the pictures, as name=value: noise, shot (grey levels), blur, motion (px, motion=5@30 at 30°), light,
    /// vignette, occlusion (0 to 1), contrast (factor), jpeg (quality), bend (the board's unit)
    #[arg(long, value_name = "NAME=VALUE,…")]
    degrade: Option<Degrade>,
    /// Seed of everything random
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    seed: Option<u64>,
    /// Draw polygons with vertices cut to whole pixels, as the source document does
    #[arg(long)]
    crude: bool,
    /// What the poses place: the outer corner of the first square, or its inner one
    #[arg(long, value_name = "outer|inner")]
    origin: Option<OriginArg>,
    /// Size of the pictures, px; the camera is scaled to fill it and cut about the middle
    #[arg(long, value_name = "WxH")]
    size: Option<PictureSize>,
    /// Inner corners of the board
    #[arg(long, value_name = "CxR")]
    board: Option<BoardSize>,
    /// Edge of a square
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true)]
    square: Option<Length>,
    /// White border around the squares, in squares
    #[arg(long, value_name = "SQUARES", allow_hyphen_values = true)]
    margin: Option<f64>,
    /// Pictures that are rendered at the same time [default: one for each processor]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Folder for the pictures, truth.json and scene.json
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

/// `random:N`.
#[derive(Clone, Copy, Debug)]
struct RandomPoses(usize);

impl FromStr for RandomPoses {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let number = text.trim().strip_prefix("random:").and_then(|n| n.parse().ok());
        number.filter(|n| (1..=MOST).contains(n)).map(Self).ok_or_else(|| {
            Error::Invalid(format!(
                "\"{text}\" does not say which poses: write random:N with N from 1 to {MOST}"
            ))
        })
    }
}

#[derive(Clone, Copy, Debug)]
struct OriginArg(Origin);

impl FromStr for OriginArg {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        match text.trim() {
            "outer" => Ok(Self(Origin::Outer)),
            "inner" => Ok(Self(Origin::FirstInner)),
            _ => Err(Error::Invalid(format!("\"{text}\" is not an origin: choose outer or inner"))),
        }
    }
}

#[derive(Clone, Copy, Debug)]
struct PictureSize([u32; 2]);

impl FromStr for PictureSize {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let side = |n: &str| n.trim().parse().ok().filter(|n| (1..=100_000).contains(n));
        let sides = text.split_once(['x', 'X', '×']).and_then(|(w, h)| Some([side(w)?, side(h)?]));
        sides.map(Self).ok_or_else(|| {
            Error::Invalid(format!(
                "\"{text}\" is not a picture size: write width x height in px, for example 1280x720"
            ))
        })
    }
}

pub(super) fn run(args: &Args) -> Result<ExitCode> {
    let scene = scene(args)?;
    let out = &args.out;
    let n = scene.poses.len();
    let stale = stale(out, &scene);
    store::folder(out)?;
    store::write(&out.join(SCENE), scene.to_json().as_bytes())?;
    store::write(&out.join(TRUTH), scene.truth().to_json().as_bytes())?;
    let renderer = Renderer::new(&scene)?;
    let views: Vec<usize> = (0..n).collect();
    let bar = frames::counter("Rendering", n);
    let render = |view: &usize| {
        let png = synth::png(&renderer.render(*view)?, scene.color)?;
        store::write(&out.join(scene.file_name(*view)), &png)
    };
    let results =
        side_by_side(threads(args.threads), &views, render, &mut |done| bar.set_position(done as u64));
    bar.finish_and_clear();
    results.into_iter().collect::<Result<Vec<()>>>()?;
    let [w, h] = scene.camera.size_px;
    let spoilt = match scene.degrade.to_string() {
        text if text.is_empty() => String::new(),
        text => format!(", {text}"),
    };
    print(&format!(
        "{}: {} of {w} x {h} px, board {}, square {} {}{}{spoilt}, seed {}; truth in {TRUTH}, scene in {SCENE}\n",
        out.display(),
        counted(n, "picture"),
        scene.board.size,
        scene.board.square,
        scene.board.unit.name(),
        if scene.method == Method::Exact { "" } else { ", crude" },
        scene.seed
    ))?;
    if let Some(stale) = stale {
        say(&format!("warning: {stale}"));
    }
    Ok(ExitCode::SUCCESS)
}

/// The scene with everything that was asked for, checked.
fn scene(args: &Args) -> Result<Scene> {
    let mut scene = if args.scene == Path::new("seed") {
        Scene::seed()
    } else {
        let named = |e: Error| match e {
            Error::Format { message, .. } | Error::Invalid(message) => {
                Error::format(&args.scene.display().to_string(), message)
            }
            other => other,
        };
        Scene::from_json(&files::text(&args.scene)?).map_err(named)?
    };
    if let Some(PictureSize(size)) = args.size {
        scene.camera = resized(&scene.camera, size)?;
    }
    if let Some(square) = args.square {
        scene.measure_in(square.unit);
        scene.board.square = square.value;
    }
    let board = &mut scene.board;
    board.size = args.board.unwrap_or(board.size);
    board.margin = args.margin.unwrap_or(board.margin);
    if let Some(OriginArg(origin)) = args.origin {
        board.origin = origin;
    }
    if args.crude {
        scene.method = Method::Crude(Cut::default());
    }
    if let Some(degrade) = &args.degrade {
        scene.degrade = degrade.clone();
    }
    scene.seed = args.seed.unwrap_or(scene.seed);
    if let Some(RandomPoses(n)) = args.poses {
        scene.poses = poses::random(n, &scene.camera, &scene.board, scene.seed)?;
    }
    if scene.poses.is_empty() {
        return Err(Error::Invalid("the scene has no poses: add some, or give --poses random:20".into()));
    }
    scene.validate()?;
    Ok(scene)
}

/// The camera of pictures of another size: scaled to fill it, then cut about the middle.
fn resized(camera: &Camera, size: [u32; 2]) -> Result<Camera> {
    let [w, h] = [0, 1].map(|k| f64::from(size[k]) / f64::from(camera.size_px[k]));
    let scaled = camera.scaled(w.max(h))?;
    let [x, y] = [0, 1].map(|k| scaled.size_px[k].saturating_sub(size[k]) / 2);
    scaled.cropped([x, y, size[0], size[1]])
}

/// What lies in the folder from another run and is no part of this scene.
fn stale(out: &Path, scene: &Scene) -> Option<String> {
    let before = fs::read_to_string(out.join(SCENE)).ok()?;
    if before == scene.to_json() {
        return None;
    }
    let ours: BTreeSet<String> = (0..scene.poses.len()).map(|view| scene.file_name(view)).collect();
    let mut left: Vec<String> = match Scene::from_json(&before) {
        Ok(old) => (0..old.poses.len()).map(|view| old.file_name(view)).collect(),
        Err(_) => Vec::new(),
    };
    left.retain(|name| !ours.contains(name) && out.join(name).exists());
    Some(match left.as_slice() {
        [] => format!("{}: the pictures of another run were overwritten", out.display()),
        [first, .., last] => format!(
            "{}: the pictures of another run were overwritten, but {} of them are left ({first} to {last}): remove them before you calibrate the folder",
            out.display(),
            left.len()
        ),
        [only] => format!(
            "{}: the pictures of another run were overwritten, but {only} is left: remove it before you calibrate the folder",
            out.display()
        ),
    })
}
