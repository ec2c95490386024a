//! What stands over the window.

use egui::Ui;

use crate::app::{
    cx::Cx,
    screen::Dialog,
    style::font,
    widgets::{key_cap, text},
};

/// Shortcuts: keys and what they do.
pub const SHORTCUTS: &[(&str, &str)] = &[
    ("Ctrl O", "Open a folder"),
    ("Ctrl V", "Open a pasted path"),
    ("Ctrl S", "Save the session"),
    ("Ctrl E", "Export"),
    ("Ctrl Z", "Undo"),
    ("Ctrl Shift Z", "Redo"),
    ("1 … 5", "Picture, poses, errors, coverage, lens"),
    ("Esc", "Back to the picture"),
    ("Up Down", "Previous, next picture"),
    ("Left Right", "Previous, next corner"),
    ("Del", "Drop the corner, or restore it"),
    ("Space", "Set the picture aside, or use it again"),
    ("C O R S", "Corners, order, reprojected, straightened"),
    ("A", "All pictures at once"),
    ("Ctrl + −", "Larger, smaller"),
    ("?", "This page"),
];

/// Draws the dialog that is open.
pub fn show(cx: &mut Cx<'_>, ui: &mut Ui) {
    let Some(dialog) = cx.state.screen.dialog.clone() else { return };
    let t = cx.t;
    let frame = egui::Frame::popup(ui.style()).inner_margin(ui.spacing().window_margin);
    let modal = egui::Modal::new(egui::Id::unique("dialog")).frame(frame);
    let response = modal.show(ui.ctx(), |ui| match dialog {
        Dialog::Shortcuts => {
            ui.set_width(360.0);
            ui.label(text("Keyboard", font::semibold(font::LEAD), t.ink));
            ui.add_space(8.0);
            egui::Grid::new("shortcuts").num_columns(2).spacing(egui::vec2(24.0, 6.0)).show(ui, |ui| {
                for (keys, what) in SHORTCUTS {
                    ui.horizontal(|ui| {
                        for key in keys.split(' ') {
                            key_cap(ui, t, key);
                        }
                    });
                    ui.label(text(*what, font::regular(font::BODY), t.text2));
                    ui.end_row();
                }
            });
            ui.add_space(8.0);
            if ui.button("Close").clicked() {
                ui.close();
            }
        }
        Dialog::Board => super::super::board_dialog::show(cx, ui),
        Dialog::Export { part, format } => super::super::export::show(cx, ui, part, format),
    });
    if response.should_close() {
        cx.show(|s| s.dialog = None);
    }
}
