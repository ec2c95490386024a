//! What the window costs: the interface's own work a frame, and from an edit to the new result.
//!
//! `cargo bench --bench window` prints times without painting by the graphics card; `taskset -c 0` before it gives the program one core.

#![allow(clippy::expect_used, clippy::print_stdout, reason = "a benchmark reports and fails loudly")]

mod common;

use std::{
    fs,
    path::{Path, PathBuf},
    sync::Arc,
    time::{Duration, Instant},
};

use common::{cpu_s, random_scene};
use egui::{Context, RawInput, Rect, pos2, vec2};
use straightedge::{
    app::{
        App,
        action::{Action, Command},
        panels::{PANELS, Tile},
        screen::Screen,
        state::{Document, Frame},
    },
    calib::{
        detect::{Detection, Grid, GridCorner},
        observation::FrameId,
        synth,
    },
    job::{Inspection, Other, Source, photo::Exif},
    worker::threads,
};

/// Frames over which a mean is taken.
const FRAMES: u32 = 100;

fn input() -> RawInput {
    RawInput {
        screen_rect: Some(Rect::from_min_size(pos2(0.0, 0.0), vec2(1280.0, 720.0))),
        ..RawInput::default()
    }
}

fn frame(ctx: &Context, app: &mut App) {
    app.advance();
    let output = ctx.run_ui(input(), |ui| app.draw(ui));
    std::hint::black_box(ctx.tessellate(output.shapes.clone(), output.pixels_per_point));
    output.drop_without_applying_deltas();
}

fn settle(ctx: &Context, app: &mut App) {
    loop {
        frame(ctx, app);
        if !app.is_busy() {
            return;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// An application with `n` pictures of 54 corners that were looked at: true corners of random poses with noise of 0.1 px. The last one
/// is selected and a file in `folder`; nobody reads the others.
fn application(ctx: &Context, n: usize, folder: &Path) -> App {
    let scene = random_scene(n, 1);
    let file = |view: usize| folder.join(scene.file_name(view));
    let picture = synth::render(&scene, n - 1).and_then(|p| synth::png(&p, true)).expect("it is drawn");
    fs::write(file(n - 1), picture).expect("it is written");
    let mut problem = common::problem(&scene, 0.1, Default::default());
    common::add_noise(&mut problem, 2);
    let mut app = App::on(ctx, Vec::new(), None);
    let cols = scene.board.size.cols;
    let mut frames = Vec::new();
    for (view, observation) in problem.observations.iter().enumerate() {
        let id = FrameId(view as u32);
        let corner = |c: &straightedge::calib::observation::Corner| GridCorner {
            cell: [c.index % cols, c.index / cols],
            px: c.px,
            sigma_px: c.sigma_px,
        };
        let grid = Grid {
            size: [cols, scene.board.size.rows],
            corners: observation.corners.iter().map(corner).collect(),
            black_first: true,
            ends: [true; 4],
            dots: Vec::new(),
        };
        let inspection = Inspection {
            size_px: scene.camera.size_px,
            exif: Exif::default(),
            bytes_hash: view as u128,
            pixels_hash: view as u128,
            thumbnail: None,
            notes: Vec::new(),
            detection: Detection { grid: Some(grid), why: String::new(), passed_over: false, light: None },
            other: Other::default(),
            read_ms: 0.0,
            detect_ms: 0.0,
        };
        app.state.data.inspections.insert(id, Ok(Arc::new(inspection)));
        app.state.data.thumbnails.insert(id, None);
        frames.push(Frame { id, source: Source::File(file(view)) });
    }
    let doc = Document { frames: Arc::new(frames), next_id: n as u32, ..Document::default() };
    app.act(Action::Edit(Box::new(doc)));
    app.act(Action::Show(Box::new(screen(Tile::Picture, n))));
    app
}

/// The last of `n` pictures is selected.
fn screen(center: Tile, n: usize) -> Screen {
    Screen { center, selected: Some(FrameId(n as u32 - 1)), ..Screen::default() }
}

/// What a picture that is set aside or taken back costs until something is on the screen, ms.
#[derive(Clone, Copy)]
struct Shown {
    /// CPU time of the process.
    cpu: f64,
    /// Wall time.
    wall: f64,
}

/// Sets pictures aside and takes them back, one at a time and never as before: until the new camera and its σ map are drawn, and until
/// the influence of every picture is, least of all; and the calibration in it, wall. With one lane ([`threads`]) this is one core.
fn toggle(ctx: &Context, app: &mut App) -> ([Shown; 2], f64) {
    let mut least = [Shown { cpu: f64::INFINITY, wall: f64::INFINITY }; 2];
    let mut calibration = f64::INFINITY;
    for i in 0..12 {
        let mut doc = app.state.doc.clone();
        // Off 0, off 1, on 0, off 2, on 1, …
        doc.toggle(FrameId(if i % 2 == 0 && i > 0 { i / 2 - 1 } else { i.div_ceil(2) }));
        let before = app.state.data.answer.as_ref().map(|a| a.key);
        let (cpu, begun) = (cpu_s(), Instant::now());
        app.act(Action::Edit(Box::new(doc)));
        frame(ctx, app);
        let is_new = |app: &App| app.state.data.answer.as_ref().is_some_and(|a| Some(a.key) != before);
        let weighed = |app: &App| is_new(app) && app.state.data.answer.as_ref().is_some_and(|a| a.weighed);
        let stages: [&dyn Fn(&App) -> bool; 2] = [&is_new, &weighed];
        for (least, is_there) in least.iter_mut().zip(stages) {
            while !is_there(app) {
                std::thread::sleep(Duration::from_micros(100));
                app.advance();
            }
            frame(ctx, app);
            least.cpu = least.cpu.min((cpu_s() - cpu) * 1e3);
            least.wall = least.wall.min(begun.elapsed().as_secs_f64() * 1e3);
        }
        let report = app.state.data.answer.as_ref().expect("it is there").report();
        calibration = calibration.min(report.timing_ms.calibrate);
        settle(ctx, app);
    }
    (least, calibration)
}

/// From the drop of a folder to the first camera, and to the last.
fn open(data: &str) {
    let folder = PathBuf::from(data).join("opencv_left");
    if !folder.is_dir() {
        println!("no photographs in {}: the drop is left out", folder.display());
        return;
    }
    let ctx = Context::default();
    let mut app = App::on(&ctx, Vec::new(), None);
    settle(&ctx, &mut app);
    let begun = Instant::now();
    app.act(Action::Do(Command::OpenPaths(vec![folder])));
    while app.state.data.solved().is_none() {
        frame(&ctx, &mut app);
    }
    let first = begun.elapsed().as_secs_f64() * 1e3;
    settle(&ctx, &mut app);
    let last = begun.elapsed().as_secs_f64() * 1e3;
    println!("opencv_left  from the drop to the first camera {first:.0} ms, to the last {last:.0} ms, wall");
}

fn main() {
    let toggles_alone = std::env::args().any(|a| a == "toggle");
    println!("pictures  panel      CPU ms a frame");
    for n in [20, 50, 200, 1000] {
        let ctx = Context::default();
        let folder = tempfile::tempdir().expect("a folder");
        let mut app = application(&ctx, n, folder.path());
        settle(&ctx, &mut app);
        for panel in PANELS.iter().filter(|_| !toggles_alone) {
            app.act(Action::Show(Box::new(screen(panel.tile, n))));
            settle(&ctx, &mut app);
            let begun = cpu_s();
            for _ in 0..FRAMES {
                frame(&ctx, &mut app);
            }
            println!("{n:8}  {:14} {:6.2}", panel.title, (cpu_s() - begun) * 1e3 / f64::from(FRAMES));
        }
        let ([map, words], calibration) = toggle(&ctx, &mut app);
        println!(
            "toggle {n:6}  camera and σ map {:.1} ms ({:.1} CPU, calibration {calibration:.1}), influence {:.1} ms ({:.1} CPU), {} lanes",
            map.wall,
            map.cpu,
            words.wall,
            words.cpu,
            threads(None)
        );
    }
    open(&std::env::var("STRAIGHTEDGE_DATA").unwrap_or_else(|_| "../shared/data".to_owned()));
}
