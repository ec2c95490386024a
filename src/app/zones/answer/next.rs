//! What to photograph next, where something is still to be done.

use egui::Ui;

use crate::{
    app::{
        action::Command,
        cx::Cx,
        panels::Tile,
        style::{font, icon},
        widgets::{button, minus, text},
    },
    calib::advice::State,
};

/// One row, as findings are.
pub(super) fn show(cx: &mut Cx<'_>, ui: &mut Ui) {
    let t = cx.t;
    let Some(advice) = cx.state.data.advice(cx.state.doc.goal).filter(|a| a.state != State::Enough) else {
        return;
    };
    super::separator(ui, t);
    ui.horizontal_top(|ui| {
        ui.label(text(icon::BOARD, font::regular(14.0), t.text2));
        ui.add_space(2.0);
        ui.vertical(|ui| {
            ui.spacing_mut().item_spacing.y = 2.0;
            ui.label(text("What to photograph next", font::medium(font::BODY), t.ink));
            ui.label(text(advice.sentence.as_str(), font::regular(font::SMALL), t.ink));
            ui.label(text(minus(advice.promise.as_str()), font::regular(font::SMALL), t.text2));
            ui.add_space(3.0);
            ui.horizontal(|ui| {
                if advice.next.is_some() && button(ui, t, "", "Show the pose", 22.0).clicked() {
                    cx.show(|s| s.go(Tile::Coverage, "Next picture"));
                }
                if button(ui, t, "", "Add pictures…", 22.0).clicked() {
                    cx.ask(Command::PickPictures);
                }
            });
        });
    });
}
