//! Export.

use egui::Ui;

use super::{cx::Cx, screen::ExportPart};

/// Draws the dialog.
pub fn show(_cx: &mut Cx<'_>, ui: &mut Ui, _part: ExportPart, _format: usize) {
    ui.label("Export");
}
