//! The error of each picture against the tilt of its board, with the trend and its interval.

use egui::Ui;
use egui_plot::{Line, PlotPoints};

use super::NOTHING;
use crate::app::{
    cx::Cx,
    plots::{self, Axis},
    style::font,
    widgets::{empty, minus, named, text},
};

/// The plot.
pub(super) fn show(cx: &mut Cx<'_>, ui: &mut Ui) {
    let t = cx.t;
    let Some((answer, solution)) = cx.state.data.solved() else { return empty(ui, t, NOTHING) };
    let selected = cx.state.selected();
    let (mut others, mut chosen, mut ids) = (Vec::new(), Vec::new(), Vec::new());
    for (frame, id) in answer.report().frames.iter().zip(&answer.ids) {
        if let (Some(tilt), Some(rms)) = (frame.tilt_rad, frame.rms_px) {
            let point = [tilt.to_degrees(), rms];
            if selected == Some(*id) { &mut chosen } else { &mut others }.push(point);
            ids.push((point, *id));
        }
    }
    super::heading(ui, t, "Error against tilt", "RMS of each picture, px");
    let words = solution.trends.rms_by_tilt_rad.map_or_else(
        || "Too few pictures for a trend.".to_owned(),
        |trend| {
            let ten = 10f64.to_radians();
            let by10 = trend.slope * ten;
            let half = trend.slope_ci95.map(|v| v * ten);
            let chance = if trend.is_significant() { "more than chance" } else { "no more than chance" };
            minus(format!(
                "{by10:+.3} px for 10° more (95 % interval {:+.3} to {:+.3}), {chance}",
                half[0], half[1]
            ))
        },
    );
    ui.label(text(words, font::regular(font::SMALL), t.text2));
    let points = others.iter().chain(&chosen);
    let [mut far, mut top] = [5.0f64, 0.0f64];
    for [x, y] in points {
        (far, top) = (far.max(*x), top.max(*y));
    }
    let (x, y) =
        (Axis::new(0.0, far * 1.08, 6, "° between board and picture"), Axis::new(0.0, top * 1.15, 5, "px"));
    let line = solution.trends.rms_by_tilt_rad.map(|trend| {
        let (low, high) = ids.iter().fold((f64::MAX, 0.0f64), |(l, h), (p, _)| (l.min(p[0]), h.max(p[0])));
        vec![[low, trend.at(low.to_radians())], [high, trend.at(high.to_radians())]]
    });
    let rect = ui.available_rect_before_wrap();
    let mut child = crate::app::panels::part(
        ui,
        "tilt",
        rect.with_min_y(rect.top() + 14.0).with_max_y(rect.bottom() - 14.0),
    );
    let shown = plots::plot("tilt", t, &x, &y, true).show(&mut child, |p| {
        if let Some(line) = line {
            p.line(Line::new("trend", PlotPoints::new(line)).color(t.ink).width(1.5).allow_hover(false));
        }
        super::scatter::cloud(p, t, others, chosen, 3.5);
    });
    plots::long_unit(ui, t, &shown, &x);
    named(&shown.response, egui::Role::Image, true, "RMS of each picture against its tilt");
    let nearest = |at: egui::Pos2| {
        let near = ids.iter().map(|(p, id)| (plots::at(&shown, p[0], p[1]).distance(at), *id));
        near.min_by(|a, b| a.0.total_cmp(&b.0)).filter(|(d, _)| *d < 14.0).map(|(_, id)| id)
    };
    if let Some(id) = shown.response.hover_pos().and_then(nearest) {
        shown.response.clone().on_hover_text_at_pointer(cx.state.name(id));
        if shown.response.clicked() {
            cx.select(id);
        }
    }
}
