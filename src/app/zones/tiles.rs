//! The row of live tiles: everything is on screen at once; a click swaps one into the centre.

use egui::{Rect, Sense, Stroke, Ui, pos2, vec2};

use crate::app::{
    cx::Cx,
    panels::{PANELS, Tile},
    style::font,
    widgets::named,
};

/// Space between tiles.
const GAP: f32 = 6.0;
/// Height of the head of a tile.
const HEAD: f32 = 26.0;

/// Draws the tiles of all panels but the one in the centre, whose place the picture takes.
pub fn show(cx: &mut Cx<'_>, ui: &mut Ui) {
    let all = ui.available_rect_before_wrap().shrink(GAP);
    let center = cx.state.screen.center;
    let places = PANELS.iter().skip(1);
    let total: f32 = places.clone().map(|p| p.share).sum();
    let free = all.width() - GAP * (places.len() - 1) as f32;
    let mut left = all.left();
    for place in places {
        let width = free * place.share / total;
        let rect = Rect::from_min_size(pos2(left, all.top()), vec2(width, all.height()));
        left += width + GAP;
        let panel = if place.tile == center { &PANELS[Tile::Picture.index()] } else { place };
        tile(cx, ui, panel, rect);
    }
}

fn tile(cx: &mut Cx<'_>, ui: &mut Ui, panel: &crate::app::panels::Panel, rect: Rect) {
    let t = cx.t;
    let caption = (panel.caption)(cx.state);
    let response = ui.interact(rect, ui.scope_id().with(panel.title), Sense::click());
    named(&response, egui::Role::Button, true, &format!("{}, {caption}", panel.title));
    ui.painter().rect_filled(rect, 6.0, t.raised);
    if response.hovered() {
        ui.painter().rect_stroke(rect, 6.0, Stroke::new(1.0, t.hover), egui::StrokeKind::Inside);
    }
    if response.has_focus() {
        ui.painter().rect_stroke(
            rect.expand(1.0),
            7.0,
            Stroke::new(2.0, t.accent),
            egui::StrokeKind::Outside,
        );
    }
    if response.clicked() {
        cx.show(|s| s.center = panel.tile);
    }
    let painter = ui.painter_at(rect);
    let head = Rect::from_min_max(rect.min, pos2(rect.right(), rect.top() + HEAD)).shrink2(vec2(10.0, 0.0));
    let title = painter.layout_no_wrap(panel.title.to_owned(), font::semibold(font::SMALL), t.ink);
    let cap = Rect::from_center_size(head.right_center() - vec2(6.0, 0.0), vec2(15.0, 15.0));
    let rest = painter.with_clip_rect(Rect::from_min_max(head.min, pos2(cap.left() - 4.0, head.bottom())));
    let x = head.left() + title.size().x + 7.0;
    rest.galley(pos2(head.left(), head.center().y - title.size().y / 2.0), title, t.ink);
    let small = font::regular(font::SMALL);
    rest.text(pos2(x, head.center().y), egui::Align2::LEFT_CENTER, caption, small, t.text3);
    painter.rect_stroke(cap, 3.0, Stroke::new(1.0, t.line2), egui::StrokeKind::Inside);
    let number = (panel.tile.index() + 1).to_string();
    painter.text(cap.center(), egui::Align2::CENTER_CENTER, number, font::regular(font::CAPTION), t.text3);
    let body = Rect::from_min_max(pos2(rect.left(), head.bottom()), rect.max).shrink2(vec2(8.0, 0.0));
    let body = Rect::from_min_max(body.min + vec2(0.0, 2.0), body.max - vec2(0.0, 8.0));
    let mut child = ui.new_child(egui::UiBuilder::new().id_salt(panel.title).max_rect(body));
    child.set_clip_rect(rect);
    if cx.its_turn(ui, panel.title) {
        (panel.small)(cx, &mut child);
    }
}
