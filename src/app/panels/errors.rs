//! Residuals: by picture, as a distribution, over the picture, against radius and tilt.

mod bars;
mod distribution;
mod field;
mod scatter;
mod sources;
mod tilt;

use egui::{Rect, Ui, pos2, vec2};

use super::{Page, Panel, Tile, part};
use crate::app::{
    cx::Cx,
    state::State,
    style::font,
    widgets::{empty, segmented, text},
};

/// Registered.
pub const PANEL: Panel = Panel {
    tile: Tile::Errors,
    title: "Errors",
    page_title: "Errors",
    caption,
    share: 290.0,
    small,
    pages: &[
        Page { name: "Overview", show: overview },
        Page { name: "Per picture", show: |cx, ui| bars::show(cx, ui) },
        Page { name: "Distribution", show: |cx, ui| distribution::show(cx, ui) },
        Page { name: "Map", show: |cx, ui| field::show(cx, ui) },
        Page { name: "Scatter", show: |cx, ui| scatter::show(cx, ui) },
        Page { name: "Radius", show: |cx, ui| scatter::radius(cx, ui) },
        Page { name: "Tilt", show: |cx, ui| tilt::show(cx, ui) },
        Page { name: "Sources", show: |cx, ui| sources::show(cx, ui) },
    ],
    switches,
};

/// Below this width the parts of the overview stand below each other.
const NARROW: f32 = 480.0;
/// What an empty errors page says.
const NOTHING: &str = "Errors appear here when a camera was found.";

fn caption(state: &State) -> String {
    state
        .data
        .solved()
        .map_or_else(String::new, |(_, s)| format!("mean {:.3}, worst {:.2} px", s.stats.mean, s.stats.max))
}

fn switches(cx: &mut Cx<'_>, ui: &mut Ui) {
    let on = usize::from(cx.state.screen.bars_rms);
    if let Some(i) = segmented(ui, cx.t, &["mean", "RMS"], on) {
        cx.show(|s| s.bars_rms = i == 1);
    }
}

fn small(cx: &mut Cx<'_>, ui: &mut Ui) {
    if cx.state.data.solved().is_none() {
        return empty(ui, cx.t, NOTHING);
    }
    let all = ui.available_rect_before_wrap();
    let middle = all.left() + all.width() * 0.5;
    let [left, right] = [
        Rect::from_min_max(all.min, pos2(middle - 4.0, all.bottom())),
        Rect::from_min_max(pos2(middle + 12.0, all.top()), all.max),
    ];
    bars::plot(cx, &mut part(ui, "bars", left), "tile bars", false);
    distribution::plot(cx, &mut part(ui, "distribution", right), "tile distribution", false);
}

fn overview(cx: &mut Cx<'_>, ui: &mut Ui) {
    if cx.state.data.solved().is_none() {
        return empty(ui, cx.t, NOTHING);
    }
    let all = ui.available_rect_before_wrap();
    if all.width() < NARROW {
        let part_of = |i: f32| {
            let height = all.height() / 3.0;
            Rect::from_min_size(all.min + vec2(0.0, i * height), vec2(all.width(), height - 10.0))
        };
        bars::show(cx, &mut part(ui, "bars", part_of(0.0)));
        distribution::show(cx, &mut part(ui, "distribution", part_of(1.0)));
        return field::show(cx, &mut part(ui, "field", part_of(2.0)));
    }
    let half = all.top() + all.height() * 0.52;
    bars::show(cx, &mut part(ui, "bars", Rect::from_min_max(all.min, pos2(all.right(), half - 6.0))));
    let below = Rect::from_min_max(pos2(all.left(), half + 2.0), all.max);
    ui.painter().hline(below.x_range(), below.top() - 4.0, egui::Stroke::new(1.0, cx.t.line));
    let third = below.left() + below.width() * 0.51;
    let left = Rect::from_min_max(below.min, pos2(third - 10.0, below.bottom()));
    distribution::show(cx, &mut part(ui, "distribution", left));
    let right = Rect::from_min_max(pos2(third + 2.0, below.top()), below.max);
    field::show(cx, &mut part(ui, "field", right));
}

/// The title of a part of a page with what it is measured in.
fn heading(ui: &mut Ui, t: &crate::app::style::Tokens, title: &str, quiet: &str) {
    ui.horizontal(|ui| {
        ui.label(text(title, font::semibold(font::SMALL), t.ink));
        ui.label(text(quiet, font::regular(font::SMALL), t.text3));
    });
}
