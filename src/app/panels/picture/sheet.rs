//! All pictures at once, with the same layers.

use egui::{Rect, Sense, Stroke, Ui, pos2, vec2};

use super::{marked, picture, size_of};
use crate::app::{
    cx::Cx,
    picture_view::{Place, marks},
    widgets::{named, plate},
};

/// Widest a picture gets.
const WIDEST: f32 = 230.0;
/// Between pictures.
const GAP: f32 = 8.0;

/// Draws the sheet.
pub(super) fn show(cx: &mut Cx<'_>, ui: &mut Ui) {
    let width = ui.available_width() - 2.0 * GAP;
    let columns = (width / WIDEST).ceil().max(1.0);
    let cell = vec2((width - GAP * (columns - 1.0)) / columns, 0.0);
    let cell = vec2(cell.x, cell.x * 0.75);
    let n = cx.state.doc.frames.len();
    let lines = n.div_ceil(columns as usize);
    egui::ScrollArea::vertical().auto_shrink(false).show_rows(ui, cell.y + GAP, lines, |ui, range| {
        ui.spacing_mut().item_spacing = vec2(0.0, 0.0);
        for line in range {
            let (row, _) = ui.allocate_exact_size(vec2(width, cell.y + GAP), Sense::hover());
            for column in 0..columns as usize {
                let Some(frame) = cx.state.doc.frames.get(line * columns as usize + column) else { break };
                let left = row.left() + GAP + column as f32 * (cell.x + GAP);
                one(cx, ui, frame.id, Rect::from_min_size(pos2(left, row.top() + GAP), cell));
            }
        }
    });
}

fn one(cx: &mut Cx<'_>, ui: &mut Ui, id: crate::calib::observation::FrameId, rect: Rect) {
    let t = cx.t;
    let name = cx.state.name(id);
    let response = ui.interact(rect, ui.scope_id().with(("sheet", id.0)), Sense::click());
    named(&response, egui::Role::Button, true, &format!("Show {name}"));
    ui.painter().rect_filled(rect, 3.0, t.bg);
    let mut inside = rect;
    if let Some(size_px) = size_of(cx.state, id) {
        let place = Place::fitted(size_px, rect);
        inside = place.rect;
        picture(cx, ui, id, &place, rect, false);
        let layers = cx.state.screen.layers;
        if let Some(frame) = cx.state.data.answer.as_deref().and_then(|a| a.frame(id)) {
            let list = marked(frame, &place, cx.state.times());
            marks(&ui.painter_at(rect), &list, layers.corners, layers.reprojected && frame.included, 0.5);
            if !frame.included && !frame.why.is_empty() {
                response.clone().on_hover_text(&frame.why);
            }
        }
    }
    plate(ui.painter(), inside, inside.left_top() + vec2(4.0, 4.0), egui::Align2::LEFT_TOP, &name);
    if cx.state.selected() == Some(id) {
        ui.painter().rect_stroke(inside, 3.0, Stroke::new(2.0, t.accent), egui::StrokeKind::Outside);
    }
    if response.clicked() {
        cx.select(id);
    }
    if response.double_clicked() {
        cx.show(|s| s.sheet = false);
    }
}
