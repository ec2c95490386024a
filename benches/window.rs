//! What the window costs: the interface's own work a frame, and from an edit to the new result.
//!
//! `cargo bench --bench window` prints CPU times; painting by the graphics card is not in them.

#![allow(clippy::expect_used, clippy::print_stdout, reason = "a benchmark reports and fails loudly")]

mod common;

use std::{
    ops::ControlFlow,
    path::PathBuf,
    sync::Arc,
    time::{Duration, Instant},
};

use common::{cpu_s, random_scene};
use egui::{Context, RawInput, Rect, pos2, vec2};
use straightedge::{
    app::{
        App,
        action::{Action, Command},
        panels::PANELS,
        screen::Screen,
        state::{Document, Frame},
    },
    calib::{
        detect::{Detection, Grid, GridCorner},
        observation::FrameId,
    },
    job::{Inspection, Job, Other, Output, Request, Source, photo::Exif, run},
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

/// An application with `n` pictures that were looked at: true corners of random poses with noise of 0.1 px.
fn application(ctx: &Context, n: usize) -> App {
    let scene = Arc::new(random_scene(n, 1));
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
            detection: Detection { grid: Some(grid), why: String::new(), passed_over: false },
            other: Other::default(),
            read_ms: 0.0,
            detect_ms: 0.0,
        };
        app.state.data.inspections.insert(id, Ok(Arc::new(inspection)));
        app.state.data.thumbnails.insert(id, None);
        frames.push(Frame { id, source: Source::View { scene: scene.clone(), view } });
    }
    let doc = Document { frames: Arc::new(frames), next_id: n as u32, ..Document::default() };
    app.act(Action::Edit(Box::new(doc)));
    app
}

/// Sets pictures aside, one at a time. The least CPU time of the job, of the calibration in it, and the least wall time until
/// the new answer is on the screen, ms.
fn solve_again(ctx: &Context, app: &mut App) -> [f64; 3] {
    let mut least = [f64::INFINITY; 3];
    for i in 0..6 {
        let mut doc = app.state.doc.clone();
        doc.toggle(FrameId(i));
        app.act(Action::Edit(Box::new(doc)));
        let plan = app.state.plan(false);
        let of = |r: Request| if let Job::Evidence(case) = r.job { Some((r.key, case)) } else { None };
        let (key, mut case) = plan.first.into_iter().find_map(of).expect("something to solve");
        // Photographs have no truth to be compared with.
        case.truth = None;
        let job = Request { key, job: Job::Evidence(case) };
        let cpu = cpu_s();
        let reply = run(job, &mut |_| ControlFlow::Continue(())).expect("not stopped");
        least[0] = least[0].min((cpu_s() - cpu) * 1e3);
        let Ok(Output::Evidence(evidence)) = reply.result else { continue };
        least[1] = least[1].min(evidence.report.timing_ms.calibrate);
        let begun = Instant::now();
        let before = app.state.data.answer.as_ref().map(|a| a.key);
        while app.state.data.answer.as_ref().map(|a| a.key) == before {
            frame(ctx, app);
        }
        least[2] = least[2].min(begun.elapsed().as_secs_f64() * 1e3);
        settle(ctx, app);
    }
    least
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
    println!("pictures  panel      CPU ms a frame");
    for n in [20, 50, 200, 1000] {
        let ctx = Context::default();
        let mut app = application(&ctx, n);
        settle(&ctx, &mut app);
        for panel in &PANELS {
            app.act(Action::Show(Box::new(Screen { center: panel.tile, ..Screen::default() })));
            settle(&ctx, &mut app);
            let begun = cpu_s();
            for _ in 0..FRAMES {
                frame(&ctx, &mut app);
            }
            println!("{n:8}  {:14} {:6.2}", panel.title, (cpu_s() - begun) * 1e3 / f64::from(FRAMES));
        }
        let [job, calibration, wall] = solve_again(&ctx, &mut app);
        println!(
            "{n:8}  a picture set aside: job {job:.1} ms CPU, of it calibration {calibration:.1}; shown after {wall:.1} ms"
        );
    }
    open(&std::env::var("STRAIGHTEDGE_DATA").unwrap_or_else(|_| "../shared/data".to_owned()));
}
