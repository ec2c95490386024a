//! The registry of panels: tiles, pages, keys and snapshot tests come from it.

pub mod coverage;
pub mod errors;
pub mod lens;
pub mod picture;
pub mod poses;

use serde::{Deserialize, Serialize};

use super::{cx::Cx, state::State};

/// A panel by name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Tile {
    /// The selected picture, or all of them.
    #[default]
    Picture,
    /// Boards and cameras in 3-D.
    Poses,
    /// Residuals.
    Errors,
    /// Where corners are.
    Coverage,
    /// The lens, and pictures without it.
    Lens,
}

/// A detail page of a panel.
pub struct Page {
    /// On its tab.
    pub name: &'static str,
    /// Draws it into all of the given space.
    pub show: fn(&mut Cx<'_>, &mut egui::Ui),
}

/// Something to look at: small as a tile, large in the centre.
pub struct Panel {
    /// Its name in the state.
    pub tile: Tile,
    /// On its tile.
    pub title: &'static str,
    /// On its page.
    pub page_title: &'static str,
    /// What it says in a few words, beside the title of the tile: also its accessible name.
    pub caption: fn(&State) -> String,
    /// Width of the tile beside those of the others.
    pub share: f32,
    /// Draws the tile.
    pub small: fn(&mut Cx<'_>, &mut egui::Ui),
    /// Pages in the centre.
    pub pages: &'static [Page],
    /// Switches at the right end of the head of its pages.
    pub switches: fn(&mut Cx<'_>, &mut egui::Ui),
}

/// All panels, in the order of their keys 1 to 5.
pub const PANELS: [Panel; 5] = [picture::PANEL, poses::PANEL, errors::PANEL, coverage::PANEL, lens::PANEL];

impl Tile {
    /// Its place in [`PANELS`].
    pub fn index(self) -> usize {
        PANELS.iter().position(|p| p.tile == self).unwrap_or(0)
    }
}

/// A part of a page.
fn part(ui: &mut egui::Ui, salt: &str, rect: egui::Rect) -> egui::Ui {
    ui.new_child(egui::UiBuilder::new().id_salt(salt).max_rect(rect))
}
