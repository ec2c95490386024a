//! A bar for each picture, with a threshold that names those above it.

use egui::{Align2, Rect, Sense, Stroke, Ui, pos2, vec2};
use egui_plot::{Bar, BarChart, HLine, Line, PlotPoints};

use super::NOTHING;
use crate::{
    app::{
        cx::Cx,
        panels::Tile,
        plots::{self, Axis},
        state::State,
        style::font,
        widgets::{button, empty, named, text},
    },
    calib::{observation::FrameId, report::Solution},
};

/// One bar.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Item {
    pub(super) id: FrameId,
    pub(super) name: String,
    /// Mean or RMS, px.
    pub(super) height: f64,
    pub(super) max: f64,
}

/// The bars of all used pictures, in order.
pub(super) fn data(state: &State) -> Vec<Item> {
    let Some((answer, _)) = state.data.solved() else { return Vec::new() };
    answer
        .used()
        .map(|(id, frame)| {
            let height = if state.screen.bars_rms { frame.rms_px.unwrap_or(0.0) } else { frame.mean_px() };
            Item { id, name: state.name(id), height, max: frame.max_px.unwrap_or(0.0) }
        })
        .collect()
}

/// Pictures whose bar ends above the threshold.
pub(super) fn above(items: &[Item], threshold_px: f64) -> Vec<&Item> {
    items.iter().filter(|i| i.height > threshold_px).collect()
}

/// What tells names apart: without what all begin with, and without leading zeros of no use.
pub(super) fn short_names(items: &[Item]) -> Vec<String> {
    let Some(first) = items.first() else { return Vec::new() };
    let mut shared = first.name.len();
    for item in items {
        let same = first.name.bytes().zip(item.name.bytes()).take_while(|(a, b)| a == b).count();
        shared = shared.min(same);
    }
    while shared > 0 && !first.name.is_char_boundary(shared) {
        shared -= 1;
    }
    // A number is not cut in two.
    while shared > 0 && first.name.as_bytes()[shared - 1].is_ascii_digit() {
        shared -= 1;
    }
    let tail = |i: &Item| i.name.get(shared..).filter(|t| !t.is_empty()).unwrap_or(&i.name).to_owned();
    items.iter().map(tail).collect()
}

/// The bars with their threshold, and a sentence about what lies above it.
pub(super) fn show(cx: &mut Cx<'_>, ui: &mut Ui) {
    let t = cx.t;
    let items = data(cx.state);
    if items.is_empty() {
        return empty(ui, t, NOTHING);
    }
    let all = ui.available_rect_before_wrap();
    let plot_rect = Rect::from_min_max(all.min + vec2(0.0, 10.0), pos2(all.right(), all.bottom() - 34.0));
    plot(cx, &mut crate::app::panels::part(ui, "plot", plot_rect), "bars", true);
    let row = Rect::from_min_max(pos2(all.left(), all.bottom() - 28.0), all.max);
    let mut ui = ui.new_child(
        egui::UiBuilder::new()
            .id_salt("row")
            .max_rect(row)
            .layout(egui::Layout::left_to_right(egui::Align::Center)),
    );
    let threshold = cx.state.doc.threshold_px;
    let over = above(&items, threshold);
    let limit = shown_px(threshold);
    let names = match &over[..] {
        [] => format!("No picture lies above {limit}"),
        [one] => format!("{} lies above {limit}", one.name),
        [a, b] => format!("{} and {} lie above {limit}", a.name, b.name),
        [a, .., b] => {
            format!("{} pictures, {} to {}, lie above {limit}", over.len(), a.name, b.name)
        }
    };
    ui.label(text(names, font::medium(font::SMALL), t.ink));
    ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
        let Some(first) = over.first() else { return };
        if over.len() < items.len() && button(ui, t, "", "Set aside", 22.0).clicked() {
            cx.edit(|d| d.set_aside(over.iter().map(|i| i.id)));
        }
        if button(ui, t, "", "Show", 22.0).clicked() {
            let id = first.id;
            cx.show(|s| (s.selected, s.corner, s.center) = (Some(id), None, Tile::Picture));
        }
    });
}

/// The plot alone; `large` with names, threshold and clicks.
pub(super) fn plot(cx: &mut Cx<'_>, ui: &mut Ui, id: &str, large: bool) {
    let t = cx.t;
    let items = data(cx.state);
    let n = items.len();
    let top = items.iter().map(|i| i.max).fold(0.0, f64::max) * 1.08;
    let y = Axis::new(0.0, top, if large { 5 } else { 3 }, "px");
    let x = Axis::bare(-0.6, n as f64 - 0.4);
    let selected = cx.state.selected();
    let over_all = |s: &Solution| if cx.state.screen.bars_rms { s.rms_px } else { s.stats.mean };
    let overall = cx.state.data.solved().map_or(0.0, |(_, s)| over_all(s));
    let before = cx.state.data.ghost.as_deref().and_then(|g| g.solution()).map(over_all);
    let mut rect = ui.available_rect_before_wrap();
    rect.max.y -= 15.0;
    if large {
        rect.max.x -= 78.0;
    } else {
        rect.min.y += 12.0;
    }
    let mut child = crate::app::panels::part(ui, id, rect);
    let color = |i: &Item| if selected == Some(i.id) { t.accent } else { t.bar };
    let shown = plots::plot(id, t, &x, &y, large).show(&mut child, |p| {
        let bars = items
            .iter()
            .enumerate()
            .map(|(k, i)| Bar::new(k as f64, i.height).width(0.64).fill(color(i)).stroke(Stroke::NONE));
        p.bar_chart(BarChart::new("mean", bars.collect()).allow_hover(false));
        for (k, i) in items.iter().enumerate() {
            let x = k as f64;
            let whisker = |from: [f64; 2], to: [f64; 2]| {
                Line::new("", PlotPoints::new(vec![from, to])).color(color(i)).width(1.0).allow_hover(false)
            };
            p.line(whisker([x, i.height], [x, i.max]));
            if n <= 60 {
                p.line(whisker([x - 0.15, i.max], [x + 0.15, i.max]));
            }
        }
        if let Some(before) = before {
            p.hline(
                HLine::new("before", before).color(t.ink.gamma_multiply(0.35)).width(1.2).allow_hover(false),
            );
        }
        p.hline(HLine::new("overall", overall).color(t.ink).width(1.2).allow_hover(false));
    });
    plots::units(ui, t, &shown, &x, &y);
    let frame = *shown.transform.frame();
    let what = if cx.state.screen.bars_rms { "RMS" } else { "mean" };
    named(
        &shown.response,
        egui::Role::Image,
        true,
        &format!("{what} error of {n} pictures, overall {overall:.3} px"),
    );
    names(ui, t, &items, &shown, selected);
    if !large {
        return;
    }
    let at = pos2(frame.right() + 6.0, plots::at(&shown, 0.0, overall).y.max(frame.top()));
    let under = |pointer| items.get(shown.transform.value_from_position(pointer).x.round().max(0.0) as usize);
    if shown.response.clicked()
        && let Some(item) = shown.response.interact_pointer_pos().and_then(under)
    {
        cx.select(item.id);
    }
    if let Some(i) = shown.response.hover_pos().and_then(under) {
        let tip = format!("{}: {what} {:.3} px, worst {:.2} px", i.name, i.height, i.max);
        shown.response.clone().on_hover_text_at_pointer(tip);
    }
    let pill = threshold(cx, ui, &shown, frame, top);
    let label = format!("{what} {overall:.3}");
    let y = if (at.y - pill.center().y).abs() < 22.0 { pill.bottom() + 10.0 } else { at.y };
    ui.painter().text(pos2(at.x, y), Align2::LEFT_CENTER, label, font::regular(font::CAPTION), t.text2);
}

/// Names below the bars, as many as fit.
fn names<R>(
    ui: &Ui,
    t: &crate::app::style::Tokens,
    items: &[Item],
    shown: &egui_plot::PlotResponse<R>,
    selected: Option<FrameId>,
) {
    let frame = *shown.transform.frame();
    let labels = short_names(items);
    let widest = labels.iter().map(|l| l.chars().count()).max().unwrap_or(1) as f32 * 6.5 + 6.0;
    let slot = frame.width() / items.len().max(1) as f32;
    let every = (widest / slot).ceil().max(1.0) as usize;
    for (k, label) in labels.iter().enumerate() {
        let is_selected = selected == Some(items[k].id);
        if k % every == 0 && label.chars().count() < 16 {
            let at = pos2(plots::at(shown, k as f64, 0.0).x, frame.bottom() + 3.0);
            let color = if is_selected { t.ink } else { t.text3 };
            ui.painter().text(at, Align2::CENTER_TOP, label, font::regular(font::CAPTION), color);
        }
    }
}

/// A threshold as shown: finer where errors are small.
fn shown_px(px: f64) -> String {
    if px < 0.1 { format!("{px:.3} px") } else { format!("{px:.2} px") }
}

/// The threshold line with its handle; above the plot it waits at the upper edge.
fn threshold<R>(
    cx: &mut Cx<'_>,
    ui: &mut Ui,
    shown: &egui_plot::PlotResponse<R>,
    frame: Rect,
    top: f64,
) -> Rect {
    let t = cx.t;
    let value = cx.state.doc.threshold_px;
    let y = plots::at(shown, 0.0, value.min(top)).y;
    if value <= top {
        ui.painter().hline(frame.x_range(), y, Stroke::new(1.6, t.accent));
    }
    let pill = Rect::from_min_size(pos2(frame.right() + 4.0, y - 10.0), vec2(66.0, 20.0));
    let response = ui.interact(pill, ui.scope_id().with("threshold"), Sense::click_and_drag());
    response.widget_info(|| egui::WidgetInfo::slider(true, value, "Threshold, px"));
    ui.painter().rect_filled(pill, 4.0, t.accent);
    for dy in [-3.0, 0.0, 3.0] {
        let x = pill.left() + 6.0;
        ui.painter().hline(x..=x + 7.0, pill.center().y + dy, Stroke::new(1.2, t.on_ink));
    }
    let label = shown_px(value);
    ui.painter().text(
        pill.right_center() - vec2(6.0, 0.0),
        Align2::RIGHT_CENTER,
        label,
        font::medium(font::CAPTION),
        t.on_ink,
    );
    let response = response.on_hover_cursor(egui::CursorIcon::ResizeVertical);
    let mut to = None;
    if response.dragged()
        && let Some(pointer) = response.interact_pointer_pos()
    {
        to = Some(shown.transform.value_from_position(pointer).y);
    }
    if response.has_focus() {
        ui.painter().rect_stroke(pill, 4.0, Stroke::new(2.0, t.accent), egui::StrokeKind::Outside);
        let step = ui.input(|i| {
            f64::from(i.num_presses(egui::Key::ArrowUp) as i32 - i.num_presses(egui::Key::ArrowDown) as i32)
        });
        if step != 0.0 {
            to = Some(value + 0.01 * step);
        }
    }
    let asked: Option<f64> = ui.input(|i| {
        let mut values = i.accesskit_action_requests(response.id, egui::accesskit::Action::SetValue);
        values.find_map(|r| match r.data {
            Some(egui::accesskit::ActionData::NumericValue(v)) => Some(v),
            _ => None,
        })
    });
    if let Some(to) = to.or(asked) {
        let begins = response.drag_started() || asked.is_some() || !response.dragged();
        cx.drag(begins, |d| d.threshold_px = (to.max(0.0) * 1e3).round() * 1e-3);
    }
    pill
}

#[cfg(test)]
mod tests {
    use super::*;

    fn item(name: &str, height: f64) -> Item {
        Item { id: FrameId(0), name: name.to_owned(), height, max: 2.0 * height }
    }

    #[test]
    fn what_lies_above() {
        let items = [item("a", 0.2), item("b", 0.5), item("c", 0.3)];
        assert_eq!(above(&items, 0.3).iter().map(|i| i.name.as_str()).collect::<Vec<_>>(), ["b"]);
    }

    #[test]
    fn names_are_cut_to_what_differs() {
        let items = [item("left01", 0.0), item("left02", 0.0), item("left13", 0.0)];
        assert_eq!(short_names(&items), ["01", "02", "13"]);
        assert_eq!(short_names(&items[..1]), ["01"]);
        assert_eq!(short_names(&[item("über1", 0.0), item("übel1", 0.0)]), ["r1", "l1"]);
    }
}
