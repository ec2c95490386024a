//! The page: the same application in a canvas.

mod seen;

use std::{
    cell::{Cell, RefCell},
    time::Duration,
};

use wasm_bindgen::{JsCast as _, JsValue, prelude::wasm_bindgen};
use web_sys::{HtmlCanvasElement, UrlSearchParams};

use super::{
    App, Cx, Layout, State, Textures, Tokens,
    action::{Action, demo},
    desk, home,
    panels::PANELS,
    style::{self, font},
};

#[wasm_bindgen(module = "/web/page.js")]
extern "C" {
    /// The first picture is drawn: the loading page goes.
    fn ready();
    /// The page cannot go on: says why, in words.
    fn broken(why: &str);
}

/// Takes the loading page away once there is something to see. Then draws ahead what comes with the first pictures, a piece in each
/// frame: all of it at once would hold the page up for a tenth of a second.
#[derive(Default)]
struct FirstFrames(usize);

impl egui::Plugin for FirstFrames {
    fn debug_name(&self) -> &'static str {
        "first frames"
    }

    fn output_hook(&mut self, ctx: &egui::Context, _: &mut egui::FullOutput) {
        if self.0 == 0 {
            ready();
        }
        if let Some(font) = font::COMMON.get(self.0) {
            let letters: String = (' '..='~').collect();
            ctx.fonts_mut(|f| f.layout_no_wrap(letters, font(), egui::Color32::WHITE));
        } else if self.0 < font::COMMON.len() + REHEARSED {
            REHEARSAL.with_borrow_mut(|r| r.get_or_insert_with(Rehearsal::new).frame());
        } else {
            REHEARSAL.set(None);
            return;
        }
        self.0 += 1;
        ctx.request_repaint();
    }
}

/// Frames in which every part of the window has had its turn.
const REHEARSED: usize = 7;

/// The window with pictures, drawn where nobody sees it: a browser compiles what is drawn for the first time.
struct Rehearsal {
    ctx: egui::Context,
    state: State,
    textures: Textures,
    layout: Layout,
}

impl Rehearsal {
    fn new() -> Self {
        let ctx = egui::Context::default();
        style::install(&ctx);
        let mut state = State::default();
        state.apply(Action::Open(demo()));
        Self { ctx, state, textures: Textures::default(), layout: Layout::default() }
    }

    fn frame(&mut self) {
        let screen = egui::Rect::from_min_size(egui::Pos2::ZERO, egui::vec2(1280.0, 800.0));
        let input = egui::RawInput { screen_rect: Some(screen), ..Default::default() };
        let _ = self.ctx.run_ui(input, |ui| {
            desk(&mut Cx::new(&self.state, Tokens::of(ui), &mut self.textures), ui, &mut self.layout);
        });
    }
}

/// What the address asks for: `?demo=seed`, `?view=errors`, `?theme=light`, and `?seen=1` for tests.
struct Wishes(Option<UrlSearchParams>);

impl Wishes {
    fn read() -> Self {
        let search = web_sys::window().and_then(|w| w.location().search().ok()).unwrap_or_default();
        Self(UrlSearchParams::new_with_str(&search).ok())
    }

    fn get(&self, name: &str) -> Option<String> {
        self.0.as_ref()?.get(name)
    }

    /// Makes a new application as it was asked for.
    fn grant(&self, app: &mut App, ctx: &egui::Context) {
        match self.get("theme").as_deref() {
            Some("light") => ctx.set_theme(egui::Theme::Light),
            Some("dark") => ctx.set_theme(egui::Theme::Dark),
            _ => {}
        }
        if self.demo() {
            app.act(Action::Open(demo()));
        }
        let panel = self.get("view").and_then(|view| {
            PANELS.iter().find(|p| [p.title, p.page_title].iter().any(|n| n.eq_ignore_ascii_case(&view)))
        });
        if let Some(panel) = panel {
            let mut screen = app.state.screen.clone();
            screen.center = panel.tile;
            app.act(Action::Show(Box::new(screen)));
        }
    }

    fn demo(&self) -> bool {
        self.get("demo").as_deref() == Some("seed")
    }
}

thread_local! {
    static REHEARSAL: RefCell<Option<Rehearsal>> = const { RefCell::new(None) };
    static WAITING: Cell<usize> = const { Cell::new(0) };
    static RUNNER: eframe::WebRunner = eframe::WebRunner::new();
}

/// Time between frames that only show more of many pictures: drawing without a graphics card takes the processors that the work needs.
const PACE: Duration = Duration::from_millis(100);

/// Tells how many pictures are still being read.
pub(super) fn waiting(pictures: usize) {
    WAITING.set(pictures);
}

/// A worker has said something. A page that is not looked at draws no frames: there it is heard at once, so that work goes on.
pub(super) fn wake(ctx: &egui::Context) {
    ctx.request_repaint_after(if WAITING.get() > 1 { PACE } else { Duration::ZERO });
    if web_sys::window().and_then(|w| w.document()).is_some_and(|d| d.hidden()) {
        let runner = RUNNER.with(Clone::clone);
        wasm_bindgen_futures::spawn_local(async move {
            if let Some(mut app) = runner.app_mut::<App>() {
                app.advance();
            }
        });
    }
}

/// Starts the application in the canvas of the page.
pub fn start() {
    // A crash is told in words too; what was done is kept (`home`).
    std::panic::set_hook(Box::new(|panic| {
        console_error_panic_hook::hook(panic);
        broken(
            "Straightedge has crashed, which is a mistake in it. What you did is kept: load the page again.",
        );
    }));
    wasm_bindgen_futures::spawn_local(async {
        if let Err(error) = run().await {
            let message = js_sys::Reflect::get(&error, &"message".into()).ok().and_then(|m| m.as_string());
            broken(&error.as_string().or(message).unwrap_or_default());
        }
    });
}

async fn run() -> Result<(), JsValue> {
    let document = web_sys::window().and_then(|w| w.document()).ok_or("there is no page")?;
    let canvas = document.get_element_by_id("app").ok_or("the page has no canvas")?;
    let canvas: HtmlCanvasElement = canvas.dyn_into().map_err(|_| "the page has no canvas")?;
    let make = |cc: &eframe::CreationContext<'_>| {
        let wishes = Wishes::read();
        if wishes.get("seen").is_some() {
            seen::install(&cc.egui_ctx);
        }
        // A demo leaves alone what was open at the last visit.
        let place = if wishes.demo() { None } else { home::place(super::ID) };
        let mut app = App::on(&cc.egui_ctx, Vec::new(), place);
        app.keep_layout(cc);
        app.inbox.watch();
        wishes.grant(&mut app, &cc.egui_ctx);
        cc.egui_ctx.add_plugin(FirstFrames::default());
        Ok(Box::new(app) as Box<dyn eframe::App>)
    };
    let runner = RUNNER.with(Clone::clone);
    runner.start(canvas, eframe::WebOptions::default(), Box::new(make)).await
}
