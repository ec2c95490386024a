//! Errors.

use egui::Ui;

use super::{Page, Panel, Tile};
use crate::app::{cx::Cx, state::State, widgets::empty};

/// Registered.
pub const PANEL: Panel = Panel {
    tile: Tile::Errors,
    title: "Errors",
    page_title: "Errors",
    caption,
    share: 290.0,
    small,
    pages: &[Page { name: "Overview", show: small }],
    switches: |_, _| (),
};

fn caption(_state: &State) -> String {
    String::new()
}

fn small(cx: &mut Cx<'_>, ui: &mut Ui) {
    empty(ui, cx.t, "Nothing yet");
}
