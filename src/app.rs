//! The window: draws the state, collects actions, and does what only a window can do.
//!
//! ```text
//!  folder ─► Action ─► apply ─► plan ─► Request ─► Pool ─► run(job) ─► Reply ─► Action::Finished ─► apply …
//!                        └─► panels draw &State ─► Action ─► apply …
//! ```
//!
//! [`State::apply`] is the only place where the state changes, [`State::plan`] the only one that asks for work.

pub mod action;
pub mod batch;
pub mod board_dialog;
pub mod cx;
pub mod export;
pub mod files;
pub mod home;
mod keys;
pub mod lab;
pub mod layout;
pub mod maps;
pub mod panels;
pub mod picture_view;
pub mod plan;
pub mod plots;
pub mod screen;
pub mod session;
pub mod state;
pub mod style;
pub mod textures;
#[cfg(target_arch = "wasm32")]
pub mod web;
pub mod widgets;
pub mod zones;

use std::{
    path::{Path, PathBuf},
    time::Duration,
};

use egui::{Frame, Margin, Panel};
use web_time::Instant;

use crate::{
    calib::{number::counted, order},
    job::{Reply, ms_since, photo},
    worker::{self, Event, Pool},
};
use action::{Action, Command};
use batch::Batch;
use cx::Cx;
use files::Inbox;
use home::Home;
use layout::Layout;
use plan::{Kind, Plan};
use session::Session;
use state::{Notice, State};
use style::Tokens;
use textures::Textures;

/// Names the folder of the application.
const ID: &str = "straightedge";
/// Names the layout in what is kept between runs.
const LAYOUT: &str = "layout";
/// How long good news stays, seconds.
const GOOD_NEWS_S: f64 = 10.0;

/// The application.
pub struct App {
    /// Everything that is known.
    pub state: State,
    pool: Pool,
    textures: Textures,
    inbox: Inbox,
    /// The revision that was planned for.
    planned: Option<u64>,
    /// Whether the view with pictures has been drawn since they were opened.
    shown: bool,
    home: Home,
    /// Where panels are, once that is the user's choice.
    layout: Layout,
    /// When the pictures were opened.
    opened: Option<Instant>,
    /// Pictures that are being straightened into a folder.
    batch: Option<Batch>,
}

impl App {
    /// A window; it opens what lies at `paths`.
    pub fn new(cc: &eframe::CreationContext<'_>, paths: Vec<PathBuf>) -> Self {
        let mut app = Self::on(&cc.egui_ctx, paths, home::place(ID));
        app.keep_layout(cc);
        app
    }

    /// Puts the panels where they were in the last run.
    fn keep_layout(&mut self, cc: &eframe::CreationContext<'_>) {
        if let Some(layout) =
            cc.storage.and_then(|s| serde_json::from_str::<Layout>(&s.get_string(LAYOUT)?).ok())
        {
            self.state.screen.unlocked = layout.unlocked;
            layout.dress(&cc.egui_ctx);
            self.layout = layout;
        }
    }

    /// The same on a context; `home` is the folder for what is kept between runs, without one nothing is.
    pub fn on(ctx: &egui::Context, paths: Vec<PathBuf>, home: Option<PathBuf>) -> Self {
        style::install(ctx);
        let waker = ctx.clone();
        #[cfg(not(target_arch = "wasm32"))]
        let wake = move || waker.request_repaint();
        #[cfg(target_arch = "wasm32")]
        let wake = move || web::wake(&waker);
        let mut app = Self {
            state: State::default(),
            pool: Pool::waking(worker::threads(None), wake),
            textures: Textures::default(),
            inbox: Inbox::new(ctx),
            planned: None,
            shown: false,
            home: Home::new(home),
            layout: Layout::default(),
            opened: None,
            batch: None,
        };
        app.state.recent.clone_from(&app.home.recent);
        if !paths.is_empty() {
            app.act(Action::Do(Command::OpenPaths(paths)));
        } else {
            app.home.bring_back(&app.inbox.post);
        }
        app
    }

    /// Takes what happened outside of the window, and asks for what is missing.
    pub fn advance(&mut self) {
        for action in self.inbox.drain() {
            self.act(action);
        }
        while let Some(event) = self.pool.poll() {
            match event {
                Event::Done(reply) => self.finished(reply),
                Event::Progress(key, share) if Kind::of(key) == Some(Kind::Twin) => {
                    self.state.apply(Action::Progress(key, share.0));
                }
                Event::Progress(..) | Event::Stopped(_) => {}
            }
        }
        self.catch_up();
        #[cfg(target_arch = "wasm32")]
        web::waiting(self.state.waiting());
    }

    /// Plans for what has changed. On a page work begins once the pictures have been drawn: their first frame and the first jobs would
    /// otherwise share the same processors, and hold the page up.
    fn catch_up(&mut self) {
        let first = !self.shown && !self.state.doc.frames.is_empty();
        if self.planned != Some(self.state.revision) && !(first && cfg!(target_arch = "wasm32")) {
            self.planned = Some(self.state.revision);
            self.plan();
        }
    }

    fn finished(&mut self, reply: Box<Reply>) {
        match self.batch.as_mut().filter(|b| b.has(reply.key)) {
            Some(batch) => {
                let told = batch.take(*reply);
                if batch.is_done() {
                    self.batch = None;
                }
                if let Some(action) = told {
                    self.act(action);
                }
            }
            None => self.act(Action::Finished(reply)),
        }
    }

    /// Whether something is still being computed.
    pub fn is_busy(&self) -> bool {
        self.pool.keys().next().is_some() || self.planned != Some(self.state.revision)
    }

    fn plan(&mut self) {
        let solving = self.is_solving();
        let Plan { first, then } = self.state.plan(solving);
        let wanted = order::set(first.iter().chain(&then).map(|r| r.key));
        let batch = self.batch.as_ref();
        let keep = |key| Kind::of(key) == Some(Kind::Evidence) || batch.is_some_and(|b| b.has(key));
        self.pool.keep(|key| wanted.contains(&key) || keep(key));
        self.pool.submit_all(first, then);
        let done = self.state.waiting() == 0 && !self.is_solving();
        if done && let Some(opened) = self.opened.take() {
            self.state.data.took_ms = Some(ms_since(opened));
        }
    }

    fn is_solving(&self) -> bool {
        self.pool.keys().any(|k| Kind::of(k) == Some(Kind::Evidence))
    }

    /// Applies an action, or does what it asks for.
    pub fn act(&mut self, action: Action) {
        if let Action::Open(_) | Action::Add(_) = &action {
            self.opened = Some(Instant::now());
        }
        if matches!(action, Action::Open(_) | Action::Close) {
            self.textures = Textures::default();
        }
        if let Action::Restore(session) = &action {
            self.textures = Textures::default();
            let lost = session.missing();
            self.state.apply(action);
            if lost > 0 {
                let offer = Some(("Where are they?".to_owned(), Command::Locate));
                let text = format!("{} of the session cannot be found", counted(lost, "picture"));
                self.state.apply(Action::Tell(Notice { offer, ..Notice::bad(text) }));
            }
            return;
        }
        if let Action::Do(command) = &action {
            self.run(command.clone());
        }
        self.state.apply(action);
    }

    fn run(&mut self, command: Command) {
        match command {
            Command::PickFolder => self.inbox.pick_folder(),
            Command::PickPictures => self.inbox.pick_pictures(),
            Command::OpenSession => self.inbox.pick_session(),
            Command::PickCameras => self.inbox.pick_cameras(),
            Command::OpenPaths(paths) => self.open(paths),
            Command::Save { name, content } => self.inbox.save(&name, content),
            Command::SaveSession => self.inbox.save_session(Session::of(&self.state), self.home.copies()),
            Command::SaveAll(files) => self.inbox.save_all(files),
            Command::Locate => self.inbox.locate(Session::of(&self.state)),
            Command::StraightenAll => self.inbox.straighten_into(),
            Command::StraightenInto(folder) => self.straighten_into(&folder),
            Command::StopStraightening => self.batch = None,
            Command::ResetLayout => self.layout = Layout::default(),
            // The text goes through the window, which is at hand where panels are drawn.
            Command::Copy(_) => {}
        }
    }

    /// Opens what lies at paths.
    fn open(&mut self, paths: Vec<PathBuf>) {
        if let [session] = &paths[..]
            && session.extension().is_some_and(|e| e == session::EXTENSION)
        {
            return self.inbox.open_session(session.clone(), self.home.copy_of(session));
        }
        // Beside pictures that are open camera files are calibrations to compare with.
        if !paths.is_empty() && paths.iter().all(|path| files::is_camera(path)) {
            if self.state.doc.frames.is_empty() {
                return self.state.apply(files::without_pictures(&paths));
            }
            return paths.into_iter().for_each(|camera| self.inbox.open_camera(camera));
        }
        self.home.opened(&paths);
        self.state.recent.clone_from(&self.home.recent);
        let folder = paths.iter().any(|p| photo::is_folder(p));
        let replace = folder || self.state.doc.frames.is_empty();
        let open = Session::of(&self.state);
        self.inbox.list(paths, replace, (open.missing() > 0).then_some(open));
    }

    /// Straightens every picture that the camera fits into a folder.
    fn straighten_into(&mut self, folder: &Path) {
        match Batch::new(&self.state, folder, self.state.revision) {
            Ok(Some((batch, jobs))) => {
                self.batch = Some(batch);
                for job in jobs {
                    self.pool.submit(job);
                }
            }
            Ok(None) => {}
            Err(error) => self.state.apply(files::tell_bad(error.to_string())),
        }
    }

    /// Draws everything.
    pub fn draw(&mut self, ui: &mut egui::Ui) {
        let t = Tokens::of(ui);
        let mut actions = keys::actions(&self.state, ui);
        let hovering = ui.input(|i| !i.raw.hovered_files.is_empty());
        let mut cx = Cx::new(&self.state, t, &mut self.textures);
        let bar = |margin: Margin| Frame::new().fill(t.bg).inner_margin(margin);
        if self.state.doc.frames.is_empty() {
            egui::CentralPanel::no_frame()
                .frame(bar(Margin::ZERO))
                .show(ui, |ui| zones::empty::show(&mut cx, ui, hovering));
        } else if ui.content_rect().width() < zones::phone::WIDTH {
            zones::phone::show(&mut cx, ui);
        } else {
            desk(&mut cx, ui, &mut self.layout);
        }
        lab::show(&mut cx, ui);
        zones::dialogs::show(&mut cx, ui);
        notice(&mut cx, ui);
        actions.extend(cx.into_actions());
        #[cfg(not(target_arch = "wasm32"))]
        actions.extend(dropped(ui));
        for action in actions {
            if let Action::Do(Command::Copy(text)) = &action {
                ui.copy_text(text.clone());
            }
            self.act(action);
        }
        if self.planned != Some(self.state.revision) {
            // What was asked for just now starts now, not at the next move of the mouse.
            self.catch_up();
            ui.request_repaint();
        }
        self.shown = !self.state.doc.frames.is_empty();
    }
}

/// The zones of a desk: top bar, strip, pictures, centre, answer, tiles.
fn desk(cx: &mut Cx<'_>, ui: &mut egui::Ui, layout: &mut Layout) {
    let t = cx.t;
    let bar = |margin: Margin| Frame::new().fill(t.bg).inner_margin(margin);
    let width = ui.content_rect().width();
    let by_width = |[narrow, usual, wide]: [f32; 3]| match width {
        w if w > 1500.0 => wide,
        w if w < 1100.0 => narrow,
        _ => usual,
    };
    let tall = ui.content_rect().height() > 850.0;
    Panel::top("top")
        .exact_size(40.0)
        .frame(bar(Margin::symmetric(10, 0)))
        .show(ui, |ui| zones::top::show(cx, ui));
    Panel::top("strip")
        .exact_size(28.0)
        .frame(bar(Margin::symmetric(8, 0)))
        .show(ui, |ui| zones::strip::show(cx, ui));
    Panel::right("answer")
        .default_size(by_width([288.0, 304.0, 348.0]))
        .size_range(288.0..=420.0)
        .frame(bar(Margin::symmetric(14, 12)))
        .show(ui, |ui| {
            if cx.its_turn(ui, "answer") {
                zones::answer::show(cx, ui);
            } else {
                // A panel is as large as what is in it.
                ui.take_available_space();
            }
        });
    if !cx.state.screen.unlocked {
        Panel::bottom("tiles")
            .exact_size(if tall { 244.0 } else { 198.0 })
            .frame(bar(Margin::ZERO))
            .show(ui, |ui| zones::tiles::show(cx, ui));
    }
    Panel::left("pictures")
        .default_size(by_width([236.0, 250.0, 272.0]))
        .size_range(230.0..=400.0)
        .frame(bar(Margin::ZERO))
        .show(ui, |ui| zones::pictures::show(cx, ui));
    egui::CentralPanel::no_frame().show(ui, |ui| {
        if cx.state.screen.unlocked {
            layout.show(cx, ui);
        } else {
            zones::center::show(cx, ui);
        }
    });
}

/// Files that were dropped on the window.
#[cfg(not(target_arch = "wasm32"))]
fn dropped(ui: &egui::Ui) -> Option<Action> {
    let paths: Vec<PathBuf> = ui.input(|i| i.raw.dropped_files.iter().map(|f| f.path().to_owned()).collect());
    (!paths.is_empty()).then_some(Action::Do(Command::OpenPaths(paths)))
}

/// Something to tell, above everything: until it is dismissed, or was read.
fn notice(cx: &mut Cx<'_>, ui: &egui::Ui) {
    let Some(notice) = &cx.state.screen.notice else { return };
    let t = cx.t;
    let id = egui::Id::unique("notice");
    let area = egui::Area::new(id)
        .anchor(egui::Align2::CENTER_BOTTOM, egui::vec2(0.0, -16.0))
        .order(egui::Order::Foreground)
        .show(ui.ctx(), |ui| {
            let frame = Frame::new().fill(t.raised).corner_radius(6.0).inner_margin(Margin::symmetric(12, 8));
            frame.stroke(egui::Stroke::new(1.0, t.line2)).show(ui, |ui| {
                ui.set_max_width(560.0);
                ui.horizontal(|ui| {
                    let (glyph, color) = if notice.bad {
                        (style::icon::WARNING, t.warn)
                    } else {
                        (style::icon::CHECK_CIRCLE, t.ok)
                    };
                    ui.label(widgets::text(glyph, style::font::fill(16.0), color));
                    ui.label(widgets::text(
                        notice.text.as_str(),
                        style::font::regular(style::font::BODY),
                        t.ink,
                    ));
                    if let Some((words, command)) = &notice.offer
                        && widgets::button(ui, t, "", words, 24.0).clicked()
                    {
                        cx.show(|s| s.notice = None);
                        cx.ask(command.clone());
                    }
                    if widgets::icon_button(ui, t, style::icon::X, "Dismiss", true).clicked() {
                        cx.show(|s| s.notice = None);
                    }
                });
            });
        });
    // Good news leaves by itself; what needs an answer waits for it.
    if notice.bad || notice.offer.is_some() || area.response.contains_pointer() {
        return ui.data_mut(|d| d.remove::<(String, f64)>(id));
    }
    let now = ui.input(|i| i.time);
    let seen: Option<(String, f64)> = ui.data(|d| d.get_temp(id));
    match seen.filter(|(text, _)| *text == notice.text) {
        Some((_, since)) if now - since > GOOD_NEWS_S => cx.show(|s| s.notice = None),
        Some((_, since)) => {
            ui.ctx().request_repaint_after(Duration::from_secs_f64((GOOD_NEWS_S - (now - since)).max(0.01)));
        }
        None => {
            ui.data_mut(|d| d.insert_temp(id, (notice.text.clone(), now)));
        }
    }
}

impl eframe::App for App {
    fn logic(&mut self, ctx: &egui::Context, _frame: &mut eframe::Frame) {
        self.advance();
        self.layout.note(ctx);
        // A picture that was read or a decision is saved; what is on the screen is not.
        if let Some(pause) = self.home.keep(&self.state, &self.inbox.post) {
            ctx.request_repaint_after(pause);
        }
    }

    fn save(&mut self, storage: &mut dyn eframe::Storage) {
        self.layout.unlocked = self.state.screen.unlocked;
        if let Ok(text) = serde_json::to_string(&self.layout) {
            storage.set_string(LAYOUT, text);
        }
    }

    fn auto_save_interval(&self) -> std::time::Duration {
        std::time::Duration::from_secs(5)
    }

    #[cfg(not(target_arch = "wasm32"))]
    fn on_exit(&mut self) {
        self.home.close();
    }

    fn ui(&mut self, ui: &mut egui::Ui, _frame: &mut eframe::Frame) {
        self.draw(ui);
    }
}

/// Opens the window and returns when it is closed.
///
/// # Errors
/// In words, where there is no display or no renderer.
#[cfg(not(target_arch = "wasm32"))]
pub fn run(paths: Vec<PathBuf>) -> Result<(), String> {
    if cfg!(target_os = "linux")
        && ["DISPLAY", "WAYLAND_DISPLAY"].iter().all(|v| std::env::var_os(v).is_none_or(|d| d.is_empty()))
    {
        return Err("there is no display (DISPLAY and WAYLAND_DISPLAY are not set)".to_owned());
    }
    let viewport = egui::ViewportBuilder::default()
        .with_title("Straightedge")
        .with_app_id("straightedge")
        .with_inner_size([1280.0, 800.0])
        .with_min_inner_size([1024.0, 640.0])
        .with_drag_and_drop(true);
    let options = eframe::NativeOptions { viewport, ..Default::default() };
    eframe::run_native(ID, options, Box::new(|cc| Ok(Box::new(App::new(cc, paths)))))
        .map_err(|e| e.to_string())
}
