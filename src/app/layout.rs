//! The panels as the user arranges them, once the layout is unlocked.

use egui::{Ui, WidgetText};
use egui_tiles::{
    Behavior, Container, Linear, LinearDir, SimplificationOptions, TileId, Tiles, Tree, UiResponse,
};
use serde::{Deserialize, Serialize};

use super::{
    cx::Cx,
    panels::{PANELS, Tile},
    style::font,
    widgets::text,
    zones::center,
};

/// Least width and height of a page.
const PAGE: [f32; 2] = [460.0, 300.0];

/// What is kept between runs.
#[derive(Clone, Serialize, Deserialize)]
pub struct Layout {
    /// Whether it is shown in place of the fixed zones.
    pub unlocked: bool,
    tree: Tree<Tile>,
    /// Light, dark, or as the system has it.
    #[serde(default)]
    theme: egui::ThemePreference,
    /// How large everything is.
    #[serde(default = "as_it_is")]
    zoom: f32,
}

fn as_it_is() -> f32 {
    1.0
}

impl Default for Layout {
    /// As the fixed zones: the picture above, the others in a row below.
    fn default() -> Self {
        let mut tiles = Tiles::default();
        let panes: Vec<TileId> = PANELS.iter().map(|panel| tiles.insert_pane(panel.tile)).collect();
        let mut row = Linear::new(LinearDir::Horizontal, panes[1..].to_vec());
        for (id, panel) in panes.iter().zip(&PANELS).skip(1) {
            row.shares.set_share(*id, panel.share);
        }
        let row = tiles.insert_container(Container::Linear(row));
        let mut all = Linear::new(LinearDir::Vertical, vec![panes[0], row]);
        all.shares.set_share(panes[0], 1.6);
        let root = tiles.insert_container(Container::Linear(all));
        Self {
            unlocked: false,
            tree: Tree::new(egui::Id::unique("layout"), root, tiles),
            theme: egui::ThemePreference::default(),
            zoom: as_it_is(),
        }
    }
}

impl Layout {
    /// Remembers how the context looks: a browser's does not do so itself.
    pub fn note(&mut self, ctx: &egui::Context) {
        (self.theme, self.zoom) = (ctx.options(|o| o.theme_preference), ctx.zoom_factor());
    }

    /// Makes the context look as it did.
    pub fn dress(&self, ctx: &egui::Context) {
        ctx.set_theme(self.theme);
        ctx.set_zoom_factor(self.zoom);
    }

    /// Draws all panels in their places.
    pub fn show(&mut self, cx: &mut Cx<'_>, ui: &mut Ui) {
        self.tree.ui(&mut Draw { cx }, ui);
    }
}

/// Draws panels for the tree.
struct Draw<'a, 'b> {
    cx: &'a mut Cx<'b>,
}

impl Behavior<Tile> for Draw<'_, '_> {
    fn pane_ui(&mut self, ui: &mut Ui, _: TileId, pane: &mut Tile) -> UiResponse {
        let index = pane.index();
        let rect = ui.max_rect();
        ui.painter().rect_filled(rect, 0.0, self.cx.t.bg);
        ui.shrink_clip_rect(rect);
        ui.push_id(index, |ui| {
            // Where there is no room for a page with its tabs there is for the tile.
            if rect.width() < PAGE[0] || rect.height() < PAGE[1] {
                let inner = rect.shrink(8.0);
                let mut ui = ui.new_child(egui::UiBuilder::new().max_rect(inner));
                (PANELS[index].small)(self.cx, &mut ui);
            } else {
                center::panel(self.cx, ui, index);
            }
        });
        UiResponse::None
    }

    fn tab_title_for_pane(&mut self, pane: &Tile) -> WidgetText {
        text(PANELS[pane.index()].title, font::semibold(font::SMALL), self.cx.t.ink).into()
    }

    fn gap_width(&self, _: &egui::Style) -> f32 {
        6.0
    }

    fn min_size(&self) -> f32 {
        120.0
    }

    fn tab_bar_height(&self, _: &egui::Style) -> f32 {
        26.0
    }

    /// Every panel has a tab, so that it can be taken by it.
    fn simplification_options(&self) -> SimplificationOptions {
        SimplificationOptions { all_panes_must_have_tabs: true, ..SimplificationOptions::default() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_reads_back() {
        let layout = Layout { unlocked: true, ..Layout::default() };
        let back: Layout = serde_json::from_str(&serde_json::to_string(&layout).unwrap()).unwrap();
        assert!(back.unlocked && back.tree == layout.tree);
    }
}
