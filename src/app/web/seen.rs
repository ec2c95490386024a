//! For tests of the page, with `?seen=1`: what is on the screen, as a screen reader would know it.
//!
//! egui builds its accessibility tree in a browser too where it is asked to. `window.seen()` answers the last one as JSON, with
//! places in CSS pixels, so that a test finds a widget by its name and sends a real click to its middle.

use std::sync::{Arc, Mutex};

use egui::accesskit::Toggled;
use serde_json::{Value, json};
use wasm_bindgen::{JsCast as _, JsValue, closure::Closure};

struct Watch {
    frames: u64,
    last: Arc<Mutex<String>>,
}

impl egui::Plugin for Watch {
    fn debug_name(&self) -> &'static str {
        "seen"
    }

    fn output_hook(&mut self, ctx: &egui::Context, out: &mut egui::FullOutput) {
        self.frames += 1;
        let Some(update) = &out.platform_output.accesskit_update else { return };
        let zoom = f64::from(ctx.zoom_factor());
        let nodes: Vec<Value> = update
            .nodes
            .iter()
            .filter_map(|(_, node)| {
                let place = node.bounds()?;
                Some(json!({
                    "role": format!("{:?}", node.role()),
                    "label": node.label().unwrap_or_default(),
                    "value": node.value().unwrap_or_default(),
                    "on": node.toggled().map(|t| t == Toggled::True),
                    "disabled": node.is_disabled(),
                    "x": place.x0 * zoom,
                    "y": place.y0 * zoom,
                    "w": (place.x1 - place.x0) * zoom,
                    "h": (place.y1 - place.y0) * zoom,
                }))
            })
            .collect();
        if let Ok(mut last) = self.last.lock() {
            *last = json!({ "frame": self.frames, "nodes": nodes }).to_string();
        }
    }
}

/// Puts `seen` into the page.
pub(super) fn install(ctx: &egui::Context) {
    ctx.enable_accesskit();
    let last = Arc::new(Mutex::new(json!({ "frame": 0, "nodes": [] }).to_string()));
    ctx.add_plugin(Watch { frames: 0, last: last.clone() });
    let answer = Closure::<dyn Fn() -> JsValue>::new(move || {
        last.lock().map_or(JsValue::NULL, |last| JsValue::from_str(&last))
    });
    let _ = js_sys::Reflect::set(&js_sys::global(), &"seen".into(), answer.as_ref().unchecked_ref());
    answer.forget();
}
