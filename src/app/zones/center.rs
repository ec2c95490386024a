//! The centre: one panel large, with its pages.

use egui::{Ui, vec2};

use crate::app::{
    cx::Cx,
    panels::{PANELS, Tile},
    style::{font, icon},
    widgets::{key_cap, text, toggle},
};

/// Height of the head of a page.
const HEAD: f32 = 34.0;
/// Below this width the tabs of the pages are a menu.
const NARROW: f32 = 440.0;

/// Draws the head and the page that is on.
pub fn show(cx: &mut Cx<'_>, ui: &mut Ui) {
    panel(cx, ui, cx.state.screen.center.index());
}

/// Draws the head and a page of one panel.
pub fn panel(cx: &mut Cx<'_>, ui: &mut Ui, index: usize) {
    let panel = &PANELS[index];
    let page = cx.state.screen.pages[index].min(panel.pages.len() - 1);
    let t = cx.t;
    let head = egui::Panel::top("page head").exact_size(HEAD).show_separator_line(false);
    head.frame(egui::Frame::new().fill(t.bg).inner_margin(egui::Margin::symmetric(10, 0))).show(ui, |ui| {
        ui.horizontal_centered(|ui| {
            ui.label(text(panel.page_title, font::semibold(font::BODY), t.ink));
            ui.add_space(6.0);
            if panel.pages.len() > 1 && ui.available_width() < NARROW {
                let label = format!("{}  {}", panel.pages[page].name, icon::CARET_DOWN);
                ui.menu_button(label, |ui| tabs(cx, ui, index, page));
            } else if panel.pages.len() > 1 {
                ui.spacing_mut().item_spacing.x = 1.0;
                tabs(cx, ui, index, page);
                ui.spacing_mut().item_spacing.x = 6.0;
            }
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                if panel.tile != Tile::Picture
                    && key_cap(ui, t, "Esc").interact(egui::Sense::click()).clicked()
                {
                    cx.show(|s| s.center = Tile::Picture);
                }
                (panel.switches)(cx, ui);
            });
        });
    });
    let frame = egui::Frame::new().fill(if panel.tile == Tile::Picture { t.canvas } else { t.bg });
    egui::CentralPanel::no_frame().frame(frame).show(ui, |ui| {
        let rect = ui.available_rect_before_wrap();
        let margin = if panel.tile == Tile::Picture { 0.0 } else { 12.0 };
        let inner = rect.shrink2(vec2(margin, margin * 0.7));
        let mut ui = ui.new_child(egui::UiBuilder::new().max_rect(inner).layout(*ui.layout()));
        ui.set_clip_rect(rect);
        (panel.pages[page].show)(cx, &mut ui);
    });
}

/// A toggle for each page of a panel.
fn tabs(cx: &mut Cx<'_>, ui: &mut Ui, index: usize, page: usize) {
    for (i, p) in PANELS[index].pages.iter().enumerate() {
        if toggle(ui, cx.t, i == page, p.name).clicked() {
            cx.show(|s| s.pages[index] = i);
        }
    }
}
