//! Where corners are, and how sure the camera is there.

mod cells;
mod certainty;
mod diversity;
mod next;

use egui::{Rect, Sense, Stroke, Ui, pos2, vec2};

use super::{Page, Panel, Tile, part};
use crate::app::{
    cx::Cx,
    maps,
    picture_view::Place,
    style::font,
    widgets::{empty, fit, named, plate, text},
};
use crate::calib::stats::regions;

/// Registered.
pub const PANEL: Panel = Panel {
    tile: Tile::Coverage,
    title: "Coverage",
    page_title: "Coverage",
    caption: |_| "corners per cell".to_owned(),
    share: 212.0,
    small,
    pages: &[
        Page { name: "Certainty", show: |cx, ui| certainty::show(cx, ui) },
        Page { name: "Corners", show: |cx, ui| corners(cx, ui) },
        Page { name: "Density", show: |cx, ui| density(cx, ui) },
        Page { name: "Diversity", show: |cx, ui| diversity::show(cx, ui) },
        Page { name: "Next picture", show: |cx, ui| next::show(cx, ui) },
    ],
    switches: |_, _| (),
};

/// What an empty page says.
const NOTHING: &str = "The coverage appears here when a camera was found.";

fn small(cx: &mut Cx<'_>, ui: &mut Ui) {
    let Some((_, solution)) = cx.state.data.solved() else { return empty(ui, cx.t, NOTHING) };
    let all = ui.available_rect_before_wrap();
    cells::show(
        cx,
        ui,
        all.with_max_y(all.bottom() - 26.0),
        &solution.coverage.cells,
        solution.camera.size_px,
    );
    let row = all.with_min_y(all.bottom() - 20.0);
    let mut ui = ui.new_child(
        egui::UiBuilder::new()
            .id_salt("shares")
            .max_rect(row)
            .layout(egui::Layout::left_to_right(egui::Align::Center)),
    );
    shares(cx, &mut ui);
}

/// Width, height and cells in per cent.
fn shares(cx: &Cx<'_>, ui: &mut Ui) {
    let t = cx.t;
    let Some((_, solution)) = cx.state.data.solved() else { return };
    let c = &solution.coverage;
    ui.spacing_mut().item_spacing.x = 3.0;
    for (share, what) in
        [(c.width_fraction, "width"), (c.height_fraction, "height"), (c.cells_fraction, "cells")]
    {
        // A word that would be cut is left out.
        if ui.available_width() < 52.0 {
            break;
        }
        ui.label(text(format!("{:.0} %", 100.0 * share), font::semibold(font::SMALL), t.ink));
        ui.label(text(what, font::regular(font::SMALL), t.text3));
        ui.add_space(2.0);
    }
}

/// All corners over an empty picture, with the regions that have none.
fn corners(cx: &mut Cx<'_>, ui: &mut Ui) {
    let t = cx.t;
    let Some((answer, solution)) = cx.state.data.solved() else { return empty(ui, t, NOTHING) };
    let all = ui.available_rect_before_wrap();
    let [w, h] = solution.camera.size_px.map(|n| n as f32);
    let rect = fit(all.with_max_y(all.bottom() - 28.0), vec2(w, h));
    ui.painter().rect_filled(rect, 2.0, t.canvas);
    let selected = cx.state.selected();
    let place = Place::covering(rect, solution.camera.size_px);
    let points = answer.report().corners_px();
    maps::dots(ui.painter(), &place, &points, 1.6, t.text2);
    let chosen = selected.and_then(|id| answer.frame(id)).filter(|f| f.included);
    let chosen: Vec<_> = chosen.iter().flat_map(|f| f.corners.iter().map(|c| c.px)).collect();
    maps::dots(ui.painter(), &place, &chosen, 2.6, t.accent);
    let empty_regions = regions::empty(&points, solution.camera.size_px);
    for region in &empty_regions {
        let [x0, y0, x1, y1] = region.share.map(|s| s as f32);
        let part = Rect::from_min_max(
            pos2(rect.left() + rect.width() * x0, rect.top() + rect.height() * y0),
            pos2(rect.left() + rect.width() * x1, rect.top() + rect.height() * y1),
        );
        ui.painter().rect_filled(part, 0.0, t.ctl.gamma_multiply(0.6));
        ui.painter().rect_stroke(part, 0.0, Stroke::new(1.0, t.line2), egui::StrokeKind::Inside);
    }
    let mut labels: Vec<egui::Pos2> = Vec::new();
    for region in &empty_regions {
        let [x0, y0, x1, y1] = region.share.map(|s| s as f32);
        let at = rect.lerp_inside(vec2((x0 + x1) / 2.0, (y0 + y1) / 2.0));
        // Names keep clear of each other; the sentence below has them all.
        if labels.iter().all(|l| (l.x - at.x).abs() > 120.0 || (l.y - at.y).abs() > 22.0) {
            plate(ui.painter(), rect, at, egui::Align2::CENTER_CENTER, region.place());
            labels.push(at);
        }
    }
    let words = if empty_regions.is_empty() {
        "Every border strip and corner of the picture has seen the board.".to_owned()
    } else {
        let names: Vec<&str> = empty_regions.iter().take(3).map(|r| r.name).collect();
        let more = match empty_regions.len().saturating_sub(3) {
            0 => String::new(),
            n => format!(" and in {}", crate::calib::number::counted(n, "more place")),
        };
        format!("No corner {}{more}.", names.join(", "))
    };
    let response = ui.interact(rect, ui.scope_id().with("corners"), Sense::hover());
    named(&response, egui::Role::Image, true, &format!("{} corners over the picture. {words}", points.len()));
    let row = all.with_min_y(all.bottom() - 22.0);
    let mut ui = part(ui, "words", row);
    ui.horizontal_centered(|ui| {
        shares(cx, ui);
        ui.label(text(words, font::regular(font::SMALL), t.text2));
    });
}

fn density(cx: &mut Cx<'_>, ui: &mut Ui) {
    let t = cx.t;
    let Some((_, solution)) = cx.state.data.solved() else { return empty(ui, t, NOTHING) };
    let all = ui.available_rect_before_wrap();
    cells::show(
        cx,
        ui,
        all.with_max_y(all.bottom() - 30.0),
        &solution.coverage.cells,
        solution.camera.size_px,
    );
    let mut ui = part(ui, "shares", all.with_min_y(all.bottom() - 22.0));
    ui.horizontal_centered(|ui| shares(cx, ui));
}
