//! What the window costs: the interface's own work a frame, and from an edit to the new result.
//!
//! `cargo bench --bench window` prints CPU times; painting by the graphics card is not in them.

#![allow(clippy::expect_used, clippy::print_stdout, reason = "a benchmark reports and fails loudly")]

mod common;

use std::{sync::Arc, time::Duration};

use common::{cpu_s, random_scene};
use egui::{Context, RawInput, Rect, pos2, vec2};
use straightedge::{
    app::{
        App,
        action::Action,
        panels::PANELS,
        screen::Screen,
        state::{Document, Frame},
    },
    calib::{
        detect::{Detection, Grid, GridCorner},
        observation::FrameId,
    },
    job::{Inspection, Source, photo::Exif},
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
        };
        let inspection = Inspection {
            size_px: scene.camera.size_px,
            exif: Exif::default(),
            bytes_hash: view as u128,
            pixels_hash: view as u128,
            thumbnail: None,
            notes: Vec::new(),
            detection: Detection { grid: Some(grid), why: String::new() },
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
        let report = app.state.data.answer.as_ref().map(|a| a.report().clone());
        let (used, took) = report.map_or((0, 0.0), |r| (r.included().count(), r.timing_ms.calibrate));
        println!("{n:8}  used {used}, calibration {took:.1} ms wall");
    }
}
