//! The same on a narrow screen: one column, made for thumbs. The picture, the film of all pictures and the answer, or a panel; all
//! panels along the lower edge.

use egui::{Align2, Frame, Margin, Panel, Popup, Rect, Sense, Stroke, Ui, pos2, vec2};

use super::{answer, center, pictures, strip, top};
use crate::{
    app::{
        action::Action,
        cx::Cx,
        panels::{PANELS, Tile},
        screen::{Dialog, ExportPart},
        style::{font, icon},
        widgets::{self, icon_button, named, primary},
    },
    calib::diagnose::Level,
};

/// Below this width of the window, in points, it is a phone.
pub const WIDTH: f32 = 700.0;
/// What a thumb can hit, points.
const TOUCH: f32 = 44.0;
/// A picture of the film, points.
const FILM: egui::Vec2 = vec2(56.0, 42.0);

/// Draws everything.
pub fn show(cx: &mut Cx<'_>, ui: &mut Ui) {
    let t = cx.t;
    let bar = |margin: Margin| Frame::new().fill(t.bg).inner_margin(margin);
    ui.spacing_mut().interact_size.y = 36.0;
    let all = ui.content_rect().size();
    Panel::top("phone top").exact_size(48.0).frame(bar(Margin::symmetric(10, 0))).show(ui, |ui| head(cx, ui));
    Panel::bottom("phone panels").exact_size(58.0).frame(bar(Margin::ZERO)).show(ui, |ui| panels(cx, ui));
    let reading = cx.state.waiting() > 0 || cx.state.data.answer.is_none();
    if reading {
        let frame = bar(Margin::symmetric(8, 0));
        Panel::top("phone strip").exact_size(28.0).frame(frame).show(ui, |ui| strip::show(cx, ui));
    }
    if cx.state.screen.center != Tile::Picture {
        return drop(egui::CentralPanel::no_frame().show(ui, |ui| center::show(cx, ui)));
    }
    // The picture gets its usual shape, and never so much that nothing is left for the answer.
    let height = (all.x * 0.75).min(all.y * 0.42);
    Panel::top("phone center")
        .exact_size(height)
        .frame(bar(Margin::ZERO))
        .show(ui, |ui| center::show(cx, ui));
    Panel::top("phone film").exact_size(58.0).frame(bar(Margin::ZERO)).show(ui, |ui| film(cx, ui));
    let frame = bar(Margin { left: 16, right: 12, top: 14, bottom: 0 });
    egui::CentralPanel::no_frame().frame(frame).show(ui, |ui| answer::show(cx, ui));
}

/// What is open; a tap opens its two settings. Export and menu.
fn head(cx: &mut Cx<'_>, ui: &mut Ui) {
    let t = cx.t;
    ui.horizontal_centered(|ui| {
        top::mark(ui, t);
        ui.add_space(6.0);
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            let menu = icon_button(ui, t, icon::LIST, "Menu", true);
            Popup::menu(&menu).show(|ui| {
                ui.set_min_width(200.0);
                ui.spacing_mut().interact_size.y = TOUCH;
                ui.menu_button("Open", |ui| top::open_menu(cx, ui));
                ui.separator();
                let (back, on) = (!cx.state.past.is_empty(), !cx.state.future.is_empty());
                if ui.add_enabled(back, egui::Button::new("Undo")).clicked() {
                    cx.push(Action::Undo);
                }
                if ui.add_enabled(on, egui::Button::new("Redo")).clicked() {
                    cx.push(Action::Redo);
                }
                ui.separator();
                top::menu_items(cx, ui);
            });
            if cx.state.data.solved().is_some() && primary(ui, t, icon::EXPORT, "Export…", 34.0).clicked() {
                cx.show(|s| s.dialog = Some(Dialog::Export { part: ExportPart::Camera, format: 0 }));
            }
            let rect = ui.available_rect_before_wrap();
            let response = ui.interact(rect, ui.scope_id().with("what is open"), Sense::click());
            let (name, settings) = (top::folder(cx), top::settings(cx));
            named(&response, egui::Role::Button, true, &format!("{name}, {settings}"));
            let painter = ui.painter_at(rect);
            let middle = rect.left_center();
            painter.text(
                middle - vec2(0.0, 1.0),
                Align2::LEFT_BOTTOM,
                name,
                font::semibold(font::LEAD),
                t.ink,
            );
            let quiet = font::regular(font::SMALL);
            painter.text(middle + vec2(0.0, 2.0), Align2::LEFT_TOP, settings, quiet, t.text3);
            Popup::from_toggle_button_response(&response)
                .close_behavior(egui::PopupCloseBehavior::CloseOnClickOutside)
                .show(|ui| {
                    ui.set_width(300.0);
                    ui.spacing_mut().item_spacing.y = 8.0;
                    top::board::settings(cx, ui);
                    ui.separator();
                    top::lens::settings(cx, ui);
                });
        });
    });
}

/// Thumbnails of all pictures in a row.
fn film(cx: &mut Cx<'_>, ui: &mut Ui) {
    let t = cx.t;
    let selected = cx.state.selected();
    let rows = pictures::rows(cx.state);
    let area = egui::ScrollArea::horizontal()
        .scroll_bar_visibility(egui::scroll_area::ScrollBarVisibility::AlwaysHidden);
    area.show_viewport(ui, |ui, seen| {
        let step = FILM.x + 6.0;
        ui.set_width(8.0 + step * rows.len() as f32);
        ui.set_height(FILM.y + 16.0);
        let origin = ui.min_rect().min;
        let first = (((seen.left() - 8.0) / step).floor().max(0.0) as usize).min(rows.len());
        let last = ((seen.right() / step).ceil() as usize).min(rows.len());
        for (i, row) in rows.iter().enumerate().take(last).skip(first) {
            let place = Rect::from_min_size(origin + vec2(8.0 + step * i as f32, 8.0), FILM);
            let response =
                ui.interact(place.expand(3.0), ui.scope_id().with(("film", row.id.0)), Sense::click());
            let name = format!("{} {}", row.name, row.why);
            response.widget_info(|| {
                egui::WidgetInfo::selected(egui::Role::ListItem, true, selected == Some(row.id), name.trim())
            });
            pictures::thumbnail(cx, ui, place, row.id, !row.used);
            if selected == Some(row.id) {
                let stroke = Stroke::new(2.0, t.accent);
                ui.painter().rect_stroke(place.expand(2.0), 4.0, stroke, egui::StrokeKind::Outside);
            }
            if let Some((_, level)) = row.badge.filter(|(_, level)| *level >= Level::Warn) {
                let (_, color) = widgets::level(t, level);
                ui.painter().circle_filled(place.right_bottom() - vec2(7.0, 7.0), 4.0, color);
            }
            if response.clicked() {
                cx.select(row.id);
            }
        }
    });
}

/// The panels, as tabs along the lower edge.
fn panels(cx: &mut Cx<'_>, ui: &mut Ui) {
    const GLYPHS: [&str; 5] = [icon::IMAGE, icon::CUBE, icon::CHART, icon::GRID, icon::SPLIT];
    let t = cx.t;
    let all = ui.available_rect_before_wrap();
    ui.painter().hline(all.x_range(), all.top(), Stroke::new(1.0, t.line));
    let width = all.width() / PANELS.len() as f32;
    for (i, (panel, glyph)) in PANELS.iter().zip(GLYPHS).enumerate() {
        let left = all.left() + width * i as f32;
        let rect = Rect::from_min_size(pos2(left, all.top()), vec2(width, all.height()));
        let response = ui.interact(rect, ui.scope_id().with(("panel", i)), Sense::click());
        let name = if panel.page_title.is_empty() { panel.title } else { panel.page_title };
        let on = cx.state.screen.center == panel.tile;
        response.widget_info(|| egui::WidgetInfo::selected(egui::Role::Tab, true, on, name));
        let (ink, words) =
            if on { (t.ink, font::semibold(font::CAPTION)) } else { (t.text2, font::regular(font::CAPTION)) };
        let painter = ui.painter();
        painter.text(rect.center() - vec2(0.0, 8.0), Align2::CENTER_CENTER, glyph, font::regular(20.0), ink);
        painter.text(rect.center() + vec2(0.0, 15.0), Align2::CENTER_CENTER, name, words, ink);
        if response.clicked() {
            cx.show(|s| s.center = panel.tile);
        }
    }
}
