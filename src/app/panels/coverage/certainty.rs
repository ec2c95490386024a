//! How sure the projection is over the picture, 1 σ in px on a logarithmic scale.

use egui::{Color32, Rect, Sense, Ui, pos2, vec2};

use super::NOTHING;
use crate::app::{
    cx::Cx,
    maps::{self, Grid},
    picture_view::Place,
    style::{font, from_map},
    widgets::{WHOLE, certainty, color_bar, empty, fit_top_left, named, text},
};
use crate::calib::{number::significant, report::Solution, uncertainty::Uncertainty};

/// Upper end of the scale, px.
const TOP_PX: f64 = 10.0;

/// Lower end of the scale: 0.01 px, or a decade further down where everything is surer, px.
fn bottom_px(grid: &Grid) -> f64 {
    let least = grid.values.iter().flatten().copied().fold(f64::INFINITY, f64::min);
    [0.01, 0.001].into_iter().find(|bottom| least >= *bottom).unwrap_or(0.0001)
}

/// The map with contours, corners and the two figures.
pub(super) fn show(cx: &mut Cx<'_>, ui: &mut Ui) {
    let t = cx.t;
    let state = cx.state;
    let Some((answer, solution)) = state.data.solved() else { return empty(ui, t, NOTHING) };
    let u = wanted(cx, solution);
    let grid = Grid::from_rows(&u.grid_px);
    let all = ui.available_rect_before_wrap();
    let [w, h] = solution.camera.size_px.map(|n| n as f32);
    let side = if all.width() > 560.0 { 196.0 } else { 0.0 };
    let room = Rect::from_min_max(all.min, pos2(all.right() - side - 62.0, all.bottom() - 26.0));
    let rect = fit_top_left(room, vec2(w, h));
    ui.painter().rect_filled(rect, 2.0, t.canvas);
    let bottom = bottom_px(&grid);
    let share = |px: f64| (px.max(1e-9) / bottom).log10() / (TOP_PX / bottom).log10();
    let color = |px: f64| from_map(colorous::VIRIDIS, share(px));
    let made_from = answer.key.0 as u64 ^ u64::from(u.range.is_none());
    let texture = cx.textures.map(ui, "certainty", made_from, || grid.image(160, color));
    ui.painter().image(texture.id(), rect, WHOLE, Color32::WHITE);
    let place = Place::covering(rect, solution.camera.size_px);
    maps::dots(ui.painter(), &place, &answer.report().corners_px(), 1.0, Color32::from_white_alpha(150));
    let levels = [0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0]
        .map(|l| (l, format!("{l}")));
    maps::contours(ui, rect, &grid, &levels);
    let response = ui.interact(rect, ui.scope_id().with("certainty"), Sense::hover());
    let words = format!(
        "Certainty of the projection, {} px at centre, {} px at the worst corner",
        certainty(u.center_px),
        certainty(u.worst_corner_px)
    );
    named(&response, egui::Role::Image, true, &words);
    if let Some(at) = response.hover_pos() {
        let i = ((at.x - rect.left()) / rect.width() * grid.columns as f32) as usize;
        let j = ((at.y - rect.top()) / rect.height() * grid.rows() as f32) as usize;
        let here = grid.values.get(j * grid.columns + i).copied().flatten();
        response.on_hover_text_at_pointer(
            here.map_or_else(|| "no answer here".to_owned(), |px| format!("{} px", certainty(Some(px)))),
        );
    }
    let bar =
        Rect::from_min_size(pos2(rect.right() + 8.0, rect.top() + 6.0), vec2(8.0, rect.height() - 12.0));
    let decades = [0.0001, 0.001, 0.01, 0.1, 1.0, 10.0].into_iter().filter(|l| *l >= bottom);
    let label = |l: f64| (share(l) as f32, if l == TOP_PX { "10 px".to_owned() } else { format!("{l}") });
    let labels: Vec<_> = decades.map(label).collect();
    color_bar(ui, t, bar, &labels, |s| from_map(colorous::VIRIDIS, s));
    let mut below = crate::app::panels::part(
        ui,
        "legend",
        Rect::from_min_size(pos2(rect.left(), rect.bottom() + 6.0), vec2(rect.width() + 60.0, 18.0)),
    );
    below.label(text(
        format!("{} corners so far · lines of equal certainty, px", solution.stats.n),
        font::regular(font::SMALL),
        t.text3,
    ));
    if side > 0.0 {
        let place = Rect::from_min_max(pos2(rect.right() + 66.0, all.top()), all.max);
        let mut ui = crate::app::panels::part(ui, "figures", place);
        figures(cx, &mut ui, u);
    }
}

/// At the distance that is chosen.
fn wanted<'a>(cx: &Cx<'_>, solution: &'a Solution) -> &'a Uncertainty {
    let far = solution.uncertainty_far.as_ref().filter(|_| cx.state.screen.far);
    far.unwrap_or(&solution.uncertainty)
}

/// What the map says in words.
fn figures(cx: &mut Cx<'_>, ui: &mut Ui, u: &Uncertainty) {
    let t = cx.t;
    let Some((answer, _)) = cx.state.data.solved() else { return };
    let unit = answer.report().settings.unit.name();
    ui.label(text(
        "If you calibrated again with other pictures like these, a point would move by this much, 1 σ.",
        font::regular(font::SMALL),
        t.text2,
    ));
    ui.add_space(10.0);
    for (name, value) in [
        ("at the centre", certainty(u.center_px)),
        ("over 90 % of it", certainty(u.over_share(0.9))),
        ("worst corner", certainty(u.worst_corner_px)),
    ] {
        ui.horizontal(|ui| {
            ui.label(text(name, font::regular(font::SMALL), t.text2));
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                ui.label(text(format!("{value} px"), font::medium(font::SMALL), t.ink));
            });
        });
    }
    ui.add_space(10.0);
    ui.label(text("For points", font::regular(font::SMALL), t.text3));
    let at_boards = answer.solution().and_then(|s| s.uncertainty.range).map_or_else(
        || "at the boards".to_owned(),
        |r| format!("as far as the boards, {} {unit}", significant(r, 3)),
    );
    for (far, name) in [(false, at_boards.as_str()), (true, "far away")] {
        if ui.radio(cx.state.screen.far == far, text(name, font::regular(font::SMALL), t.text2)).clicked() {
            cx.show(|s| s.far = far);
        }
    }
}
