//! The lab: a camera that is known exactly photographs a board, and the whole program follows.
//!
//! A window of its own beside everything else, hidden until asked for. What it changes is the document, so each change is one
//! step of undo; the rest follows from the plan.

mod ablation;
mod scene;
mod starts;
mod twin;

use egui::{Rect, Ui, pos2, vec2};

use super::{
    cx::Cx,
    style::{font, icon},
    widgets::{icon_button, text, toggle},
};

/// A page of the lab.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// What is photographed.
    Scene,
    /// What each part of the method brings.
    Ablation,
    /// Whether other starts end at the same camera.
    Starts,
    /// The capture drawn anew, with known truth.
    Twin,
}

/// Pages: name, and what draws them.
static PARTS: [(Part, &str, fn(&mut Cx<'_>, &mut Ui)); 4] = [
    (Part::Scene, "Scene", scene::show),
    (Part::Ablation, "Ablation", ablation::show),
    (Part::Starts, "Several starts", starts::show),
    (Part::Twin, "Twin", twin::show),
];

/// Draws the window, where it is open.
pub fn show(cx: &mut Cx<'_>, ui: &Ui) {
    let Some(part) = cx.state.screen.lab else { return };
    let t = cx.t;
    let area = ui.ctx().content_rect();
    // Photographs have no scene to change, and a twin may not be drawn yet: then it says so, and is no larger than that.
    let empty = match part {
        Part::Scene => cx.state.doc.scene().is_none(),
        Part::Twin => cx.state.data.twin.is_none() && cx.state.screen.twin.is_none(),
        Part::Ablation | Part::Starts => false,
    };
    let height = if empty { 170.0 } else { (area.height() - 80.0).clamp(300.0, 640.0) };
    let size = vec2(356.0, height);
    egui::Window::new("Lab")
        .id(egui::Id::unique(("lab", empty)))
        .title_bar(false)
        .default_rect(Rect::from_min_size(pos2(area.left() + 258.0, area.top() + 74.0), size))
        .constrain_to(area)
        .vscroll(true)
        .min_width(330.0)
        .show(ui.ctx(), |ui| {
            ui.horizontal(|ui| {
                ui.label(text("Lab", font::semibold(font::LEAD), t.ink));
                ui.add_space(8.0);
                ui.spacing_mut().item_spacing.x = 1.0;
                for &(this, name, _) in &PARTS {
                    if toggle(ui, t, this == part, name).clicked() {
                        cx.show(|s| s.lab = Some(this));
                    }
                }
                ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                    if icon_button(ui, t, icon::X, "Close the lab", true).clicked() {
                        cx.show(|s| s.lab = None);
                    }
                });
            });
            ui.add_space(6.0);
            for (_, _, draw) in PARTS.iter().filter(|p| p.0 == part) {
                draw(cx, ui);
            }
        });
}
