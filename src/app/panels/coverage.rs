//! Coverage.

use egui::Ui;

use super::{Page, Panel, Tile};
use crate::app::{cx::Cx, state::State, widgets::empty};

/// Registered.
pub const PANEL: Panel = Panel {
    tile: Tile::Coverage,
    title: "Coverage",
    page_title: "Coverage",
    caption,
    share: 212.0,
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
