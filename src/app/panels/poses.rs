//! Boards and cameras in 3-D.

mod draw;
mod scene;

use egui::{Sense, Ui};

use super::{Page, Panel, Tile};
use crate::{
    app::{
        cx::Cx,
        screen::Orbit,
        state::State,
        style::font,
        widgets::{empty, named, segmented, text},
    },
    calib::number::counted,
};
use scene::Scene;

/// Registered.
pub const PANEL: Panel = Panel {
    tile: Tile::Poses,
    title: "Poses",
    page_title: "Poses",
    caption,
    share: 212.0,
    small,
    pages: &[Page { name: "Poses", show }],
    switches,
};

fn caption(state: &State) -> String {
    state.data.solved().map_or_else(String::new, |(a, _)| counted(a.report().included().count(), "board"))
}

fn switches(cx: &mut Cx<'_>, ui: &mut Ui) {
    let on = usize::from(cx.state.screen.orbit.board_centric);
    if let Some(i) = segmented(ui, cx.t, &["camera", "board"], on) {
        cx.show(|s| s.orbit.board_centric = i == 1);
    }
}

/// What an empty view says.
const NOTHING: &str = "Boards appear here when a camera was found.";

fn small(cx: &mut Cx<'_>, ui: &mut Ui) {
    let Some(scene) = Scene::of(cx.state) else { return empty(ui, cx.t, NOTHING) };
    let rect = ui.available_rect_before_wrap();
    let orbit = Orbit { zoom: 1.0, ..cx.state.screen.orbit };
    draw::show(&ui.painter_at(rect), cx.t, &scene, rect, &orbit, cx.state.selected());
}

fn show(cx: &mut Cx<'_>, ui: &mut Ui) {
    let t = cx.t;
    let Some(scene) = Scene::of(cx.state) else { return empty(ui, t, NOTHING) };
    let rect = ui.available_rect_before_wrap();
    let response = ui.interact(rect, ui.scope_id().with("poses"), Sense::click_and_drag());
    let many = counted(scene.boards.len(), "board");
    named(&response, egui::Role::Image, true, &format!("{many} in front of the camera"));
    let orbit = cx.state.screen.orbit;
    let drawn = draw::show(&ui.painter_at(rect), t, &scene, rect, &orbit, cx.state.selected());
    let hit = response.hover_pos().and_then(|at| drawn.at(at));
    if let Some(id) = hit {
        let tip = scene.boards.iter().find(|b| b.id == id).map(|b| b.tip.clone()).unwrap_or_default();
        response.clone().on_hover_text_at_pointer(tip);
        if response.clicked() {
            cx.select(id);
        }
    }
    if response.double_clicked() {
        cx.show(|s| s.orbit = Orbit { board_centric: orbit.board_centric, ..Orbit::default() });
    } else if response.dragged() {
        let d = response.drag_delta();
        cx.show(|s| {
            s.orbit.yaw += f64::from(d.x) * 0.01;
            s.orbit.pitch = (s.orbit.pitch + f64::from(d.y) * 0.01).clamp(-1.5, 1.5);
        });
    }
    if response.hovered() {
        let factor = ui.input(|i| f64::from(i.zoom_delta() * (i.smooth_scroll_delta().y * 0.004).exp()));
        if (factor - 1.0).abs() > 1e-6 {
            cx.show(|s| s.orbit.zoom = (s.orbit.zoom * factor).clamp(0.2, 20.0));
        }
    }
    let words = format!(
        "Floor lines every {} {} · drag turns, wheel zooms, double click resets",
        scene.floor_step, scene.unit
    );
    let mut corner = super::part(ui, "words", rect.with_min_y(rect.bottom() - 16.0));
    corner.label(text(words, font::regular(font::CAPTION), t.text3));
}
