//! The picture before and after, and what the lens does to it.

mod bend;
mod beside;
mod field;
mod over_time;
mod profile;
mod projection;
mod safe;
mod swipe;

use egui::{Sense, Ui, UiBuilder, vec2};

use super::{Page, Panel, Tile, part};
use crate::app::{
    cx::Cx,
    state::State,
    style::{font, icon},
    widgets::{begins, caption, empty, segmented, text},
};

/// Registered.
pub const PANEL: Panel = Panel {
    tile: Tile::Lens,
    title: "Before / after",
    page_title: "Lens",
    caption: caption_of,
    share: 250.0,
    small,
    pages: &[
        Page { name: "Swipe", show: overview },
        Page { name: "Side by side", show: |cx, ui| swipe::beside(cx, ui) },
        Page { name: "Displacement", show: |cx, ui| field::show(cx, ui) },
        Page { name: "Radial profile", show: |cx, ui| profile::show(cx, ui) },
        Page { name: COMPARE, show: |cx, ui| beside::show(cx, ui) },
    ],
    switches: |_, _| (),
};

/// Name of the page with a second calibration.
pub const COMPARE: &str = "Compare";

/// Field of view that a choice of it begins with, and the narrowest.
const USUAL_DEG: f64 = 90.0;
const NARROWEST_DEG: f64 = 10.0;

/// What an empty page says.
const NOTHING: &str = "The straightened picture appears here when a camera was found.";

fn caption_of(state: &State) -> String {
    match bend::of_selected(state) {
        Some([before, after]) => format!("bend {before:.1}, after {after:.1} px"),
        None => String::new(),
    }
}

fn small(cx: &mut Cx<'_>, ui: &mut Ui) {
    if cx.state.data.solved().is_none() {
        return empty(ui, cx.t, NOTHING);
    }
    let rect = ui.available_rect_before_wrap();
    swipe::show(cx, ui, rect, "tile");
}

fn overview(cx: &mut Cx<'_>, ui: &mut Ui) {
    let t = cx.t;
    let Some((_, solution)) = cx.state.data.solved() else { return empty(ui, t, NOTHING) };
    let choice = projection::offered(cx.state.doc.projection, &solution.camera);
    let height = 90.0 + if choice { projection::HEIGHT } else { 0.0 };
    let all = ui.available_rect_before_wrap();
    let right = (all.width() * 0.36).min(300.0);
    let left = all.with_max_x(all.right() - right - 16.0);
    let picture = left.with_max_y(left.bottom() - height - 2.0);
    let drawn = swipe::show(cx, ui, picture, "page");
    let top = drawn.map_or(picture.bottom(), |r| r.bottom()) + 8.0;
    let mut below = part(ui, "below", left.with_min_y(top).with_max_y(top + height));
    if choice {
        projection::show(cx, &mut below);
    }
    extent(cx, &mut below, choice);
    figures(cx, &mut below);
    let side = all.with_min_x(all.right() - right);
    let half = side.top() + side.height() * 0.5;
    field::show(cx, &mut part(ui, "field", side.with_max_y(half - 6.0)));
    profile::show(cx, &mut part(ui, "profile", side.with_min_y(half + 6.0)));
}

/// How much of the picture is shown: by α, or where a projection can be chosen by the field of view.
fn extent(cx: &mut Cx<'_>, ui: &mut Ui, choice: bool) {
    ui.horizontal(|ui| {
        if choice {
            let by_fov = cx.state.doc.fov_deg.is_some();
            let words = ["by α", "by field of view"];
            match segmented(ui, cx.t, &words, usize::from(by_fov)) {
                Some(0) => cx.edit(|d| d.fov_deg = None),
                Some(_) => cx.edit(|d| d.fov_deg = Some(USUAL_DEG)),
                None => {}
            }
            ui.add_space(8.0);
        }
        match cx.state.doc.fov_deg {
            Some(fov_deg) => field_of_view(cx, ui, fov_deg),
            None => alpha(cx, ui),
        }
    });
}

/// The field of view, degrees.
fn field_of_view(cx: &mut Cx<'_>, ui: &mut Ui, mut value: f64) {
    ui.spacing_mut().slider_width = 170.0;
    let widest = projection::widest_deg(cx.state.doc.projection);
    let slider = egui::Slider::new(&mut value, NARROWEST_DEG..=widest).show_value(false).trailing_fill(true);
    let response = ui.add(slider).on_hover_text("Horizontal field of view of the straightened picture");
    response.widget_info(|| egui::WidgetInfo::slider(true, value, "Field of view"));
    let begins = begins(ui, &response);
    if response.changed() {
        cx.drag(begins, |d| d.fov_deg = Some(value.round()));
    }
    ui.label(text(format!("{value:.0}°"), font::medium(font::SMALL), cx.t.ink));
}

/// How much of the picture is kept.
fn alpha(cx: &mut Cx<'_>, ui: &mut Ui) {
    let t = cx.t;
    ui.scope(|ui| {
        let name = ui.label(text("α", font::regular(font::BODY), t.text3));
        ui.label(text("crop", font::regular(font::SMALL), t.text2));
        ui.spacing_mut().slider_width = 170.0;
        let mut value = cx.state.doc.alpha;
        let slider = egui::Slider::new(&mut value, 0.0..=1.0).show_value(false).trailing_fill(true);
        let help = "How much of the straightened picture is kept: crop shows only valid pixels, keep all shows every pixel of the photograph. It stops where no corner supports what is shown; drag once more to go on";
        let response = ui.add(slider).labelled_by(name.id).on_hover_text(help);
        let begins = begins(ui, &response);
        let value = value.min(stop(cx, ui, &response));
        // Held at the stop, the slider is off its place in every frame: that is no change.
        if response.changed() && value != cx.state.doc.alpha {
            cx.drag(begins, |d| d.alpha = value);
        }
        ui.label(text("keep all", font::regular(font::SMALL), t.text2));
        ui.label(text(format!("{:.2}", cx.state.doc.alpha), font::medium(font::SMALL), t.ink));
        if safe::of(cx, ui).is_some_and(|s| s.alpha.is_none()) {
            ui.label(text("0 is not safe either", font::regular(font::SMALL), t.warn)).on_hover_text(
                "Even with α = 0 the picture shows places that no corner supports (shaded): photograph the board there",
            );
        }
    });
}

/// Where α stops: at the largest that shows only what corners support, unless the drag begins there or beyond.
fn stop(cx: &Cx<'_>, ui: &Ui, response: &egui::Response) -> f64 {
    let Some(most) = safe::of(cx, ui).and_then(|s| s.alpha) else { return 1.0 };
    let id = egui::Id::unique("alpha goes on");
    let by_keys = response.changed() && response.interact_pointer_pos().is_none();
    if response.drag_started() || by_keys {
        ui.data_mut(|d| d.insert_temp(id, cx.state.doc.alpha >= most));
    }
    if ui.data(|d| d.get_temp(id)).unwrap_or(false) { 1.0 } else { most }
}

/// Bend, valid region, folds.
fn figures(cx: &Cx<'_>, ui: &mut Ui) {
    let beyond = safe::of(cx, ui).map_or(0.0, |s| 100.0 * s.beyond);
    let t = cx.t;
    let Some((_, solution)) = cx.state.data.solved() else { return };
    let bend = bend::of_selected(cx.state);
    let valid = cx.state.data.straight.as_ref().and_then(|s| s.valid);
    let folded = solution.uncertainty.grid_px.iter().flatten().filter(|v| v.is_none()).count();
    let cells: usize = solution.uncertainty.grid_px.iter().map(Vec::len).sum();
    let lost = 100.0 * folded as f64 / cells.max(1) as f64;
    ui.add_space(4.0);
    ui.horizontal(|ui| {
        for (value, what) in [
            (
                bend.map_or("–".to_owned(), |[b, a]| format!("{b:.1} {} {a:.1} px", icon::ARROW)),
                "bend of the worst row",
            ),
            (
                valid.map_or("none".to_owned(), |r| format!("{} × {}", r.width, r.height)),
                "valid region (dashed), px",
            ),
            if lost > 0.0 {
                (format!("{lost:.0} %"), "cannot be straightened")
            } else {
                (format!("{beyond:.0} %"), "no corner near (shaded)")
            },
        ] {
            let (rect, _) = ui.allocate_exact_size(vec2(134.0, 36.0), Sense::hover());
            let builder = UiBuilder::new().max_rect(rect).layout(egui::Layout::top_down(egui::Align::Min));
            let mut cell = ui.new_child(builder);
            cell.spacing_mut().item_spacing.y = 1.0;
            cell.label(text(value, font::medium(font::BODY), t.ink));
            caption(&mut cell, t, what);
        }
    });
}
