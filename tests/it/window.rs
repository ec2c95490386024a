//! The window, driven by accessible names as a person would, and pictures of it.

mod boards;
mod interaction;
mod sessions;
mod snapshots;

use std::{
    path::{Path, PathBuf},
    sync::Arc,
    time::{Duration, Instant},
};

use egui::Theme;
use egui_kittest::{
    Harness, SnapshotOptions,
    kittest::{NodeT as _, Queryable as _},
};
use straightedge::{
    app::{
        App,
        action::{Action, Command, demo},
    },
    calib::synth::{self, Scene},
};

/// Longest that a calibration may take here, on a busy machine without optimisation.
const PATIENCE: Duration = Duration::from_secs(120);

/// A window of this size, without a folder of its own.
fn window(size: [f32; 2], theme: Theme) -> Harness<'static, App> {
    with_home(size, theme, Vec::new(), None)
}

fn with_home(
    size: [f32; 2],
    theme: Theme,
    paths: Vec<PathBuf>,
    home: Option<PathBuf>,
) -> Harness<'static, App> {
    Harness::builder()
        .with_size(size)
        .with_theme(theme)
        .with_max_steps(64)
        .with_render_cursor(false)
        .build_eframe(move |cc| App::on(&cc.egui_ctx, paths, home))
}

/// Runs until nothing is being computed.
fn settle(window: &mut Harness<'_, App>) {
    until(window, |app| !app.is_busy());
    window.run_ok();
}

/// Runs until something holds.
fn until(window: &mut Harness<'_, App>, holds: impl Fn(&App) -> bool) {
    let begun = Instant::now();
    loop {
        window.step();
        if holds(window.state()) {
            return;
        }
        assert!(begun.elapsed() < PATIENCE, "nothing has come of it");
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// A calibrated demo scene.
fn demonstrated(size: [f32; 2], theme: Theme) -> Harness<'static, App> {
    let mut window = window(size, theme);
    window.state_mut().act(Action::Open(demo()));
    settle(&mut window);
    window
}

/// Opens paths and waits for the camera.
fn opened(window: &mut Harness<'_, App>, paths: Vec<PathBuf>) {
    window.state_mut().act(Action::Do(Command::OpenPaths(paths)));
    until(window, |app| !app.state.doc.frames.is_empty());
    settle(window);
}

/// Writes some pictures of the built-in scene.
fn pictures(folder: &Path, views: std::ops::Range<usize>) {
    let scene = Scene::seed();
    for view in views {
        let png = synth::png(&synth::render(&scene, view).unwrap(), false).unwrap();
        std::fs::write(folder.join(scene.file_name(view)), png).unwrap();
    }
}

/// The key of the present answer.
fn key(window: &Harness<'_, App>) -> straightedge::job::Key {
    window.state().state.data.answer.as_ref().unwrap().key
}

/// The one place that says how alike two pictures must be: renderers differ by one level here and there.
fn alike() -> SnapshotOptions {
    SnapshotOptions::new().threshold(0.9).max_failed_pixels(20).output_path("tests/snapshots")
}

/// Compares with the stored picture.
fn picture(window: &mut Harness<'_, App>, name: &str) {
    window.run_ok();
    window.snapshot_options(name, &alike());
}

/// A dropped path.
#[derive(Debug)]
struct Dropped(PathBuf);

impl egui::DroppedFile for Dropped {
    fn path(&self) -> &Path {
        &self.0
    }
    fn bytes(&self) -> Result<Vec<u8>, String> {
        std::fs::read(&self.0).map_err(|e| e.to_string())
    }
}

fn drop_on(window: &mut Harness<'_, App>, path: PathBuf) {
    window.input_mut().dropped_files.push(Arc::new(Dropped(path)));
    window.step();
}

/// Whether something with this name can be seen.
fn says(window: &Harness<'_, App>, label: &str) -> bool {
    window.query_all_by_label_contains(label).next().is_some()
}

/// Clicks what has this name.
fn click(window: &mut Harness<'_, App>, label: &str) {
    window.get_by_label(label).click();
    window.run_ok();
}

/// Whether a node is on.
fn is_on(window: &Harness<'_, App>, label: &str) -> bool {
    let node = window.get_by_label(label);
    node.accesskit_node().is_selected() == Some(true)
        || node.accesskit_node().toggled() == Some(egui::accesskit::Toggled::True)
}
