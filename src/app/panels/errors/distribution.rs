//! Histogram and cumulative share of the errors, with all figures as a table.

use egui::{Rect, Stroke, Ui, pos2, vec2};
use egui_plot::{Bar, BarChart, Line, PlotPoints};

use super::NOTHING;
use crate::{
    app::{
        action::Command,
        cx::Cx,
        plots::{self, Axis},
        state::{Answer, State},
        style::{font, icon},
        widgets::{empty, icon_button, named, text},
    },
    calib::stats::ErrorStats,
};

/// Bars of the histogram.
const BINS: usize = 24;
/// Points of the cumulative curve for each bar.
const FINE: usize = 8;

/// Errors, counted.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Counts {
    /// Upper end of the last bar, px.
    pub(super) top_px: f64,
    /// Corners in each bar.
    pub(super) bars: Vec<usize>,
    /// Share of the corners up to the end of each fine step, 0..=1.
    pub(super) share: Vec<f64>,
}

/// Counts errors; none without a camera.
pub(super) fn data(state: &State) -> Option<Counts> {
    of(state.data.answer.as_deref()?)
}

fn of(answer: &Answer) -> Option<Counts> {
    Some(count(answer.report().included().flat_map(|f| f.errors_px()), answer.solution()?.stats))
}

fn count(errors: impl Iterator<Item = f64>, stats: ErrorStats) -> Counts {
    // A single far outlier must not squeeze everything else into one bar.
    let top_px = stats.max.min(2.5 * stats.p95).max(1e-9);
    let mut fine = vec![0usize; BINS * FINE];
    let mut n = 0;
    for e in errors {
        fine[((e / top_px * (BINS * FINE) as f64) as usize).min(BINS * FINE - 1)] += 1;
        n += 1;
    }
    let mut sum = 0;
    let share = fine.iter().map(|c| {
        sum += c;
        sum as f64 / f64::from(n.max(1))
    });
    let share = share.collect();
    Counts { top_px, bars: fine.chunks(FINE).map(|c| c.iter().sum()).collect(), share }
}

/// The figures of Table IV, with their names.
pub(super) fn table(stats: &ErrorStats) -> Vec<(&'static str, String)> {
    let px = |v: f64| format!("{v:.3}");
    vec![
        ("corners", stats.n.to_string()),
        ("RMS", px(stats.rms)),
        ("mean", px(stats.mean)),
        ("median", px(stats.median)),
        ("std", px(stats.std)),
        ("p95", px(stats.p95)),
        ("min", px(stats.min)),
        ("max", px(stats.max)),
    ]
}

/// Plot and table.
pub(super) fn show(cx: &mut Cx<'_>, ui: &mut Ui) {
    let t = cx.t;
    let Some((_, solution)) = cx.state.data.solved() else { return empty(ui, t, NOTHING) };
    let rows = table(&solution.stats);
    let all = ui.available_rect_before_wrap();
    ui.horizontal(|ui| {
        ui.set_height(20.0);
        super::heading(ui, t, "Distribution", "px from where the camera projects");
        if icon_button(ui, t, icon::COPY, "Copy the table", true).clicked() {
            let lines: Vec<String> = rows.iter().map(|(name, value)| format!("{name}\t{value}")).collect();
            cx.ask(Command::Copy(lines.join("\n") + "\n"));
        }
    });
    let width = 112.0;
    let body = Rect::from_min_max(pos2(all.left(), all.top() + 30.0), all.max);
    let left = Rect::from_min_max(body.min, pos2(body.right() - width - 44.0, body.bottom()));
    plot(cx, &mut crate::app::panels::part(ui, "plot", left), "distribution", true);
    let right = Rect::from_min_max(pos2(body.right() - width, body.top()), body.max);
    let step = ((right.height() - 4.0) / rows.len() as f32).min(22.0);
    for (k, (name, value)) in rows.iter().enumerate() {
        let rect = Rect::from_min_size(right.min + vec2(0.0, 4.0 + step * k as f32), vec2(width, step));
        let mut row = crate::app::panels::part(ui, name, rect);
        row.horizontal_centered(|ui| {
            ui.label(text(*name, font::regular(font::SMALL), t.text2));
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                ui.label(text(value.as_str(), font::medium(font::SMALL), t.ink));
            });
        });
    }
}

/// The plot alone.
pub(super) fn plot(cx: &mut Cx<'_>, ui: &mut Ui, id: &str, large: bool) {
    let t = cx.t;
    let (Some(counts), Some((_, solution))) = (data(cx.state), cx.state.data.solved()) else { return };
    let most = counts.bars.iter().copied().max().unwrap_or(1).max(1) as f64;
    let ticks = if large { 5 } else { 3 }.min((ui.available_width() / 45.0) as usize).max(1);
    let x = Axis::new(0.0, counts.top_px, ticks, "px");
    // Bars fill four fifths of the height, the share all of it.
    let y = Axis::bare(0.0, 1.04);
    let mut rect = ui.available_rect_before_wrap();
    if !large {
        rect.min.y += 4.0;
    }
    let mut child = crate::app::panels::part(ui, id, rect);
    let step = counts.top_px / BINS as f64;
    let before = cx.state.data.ghost.as_deref().and_then(of);
    let top_px = counts.top_px;
    let shown = plots::plot(id, t, &x, &y, false).show(&mut child, |p| {
        let bars = counts.bars.iter().enumerate().map(|(k, n)| {
            let middle = (k as f64 + 0.5) * step;
            Bar::new(middle, 0.8 * *n as f64 / most).width(step * 0.92).fill(t.bar).stroke(Stroke::NONE)
        });
        p.bar_chart(BarChart::new("corners", bars.collect()).allow_hover(false));
        let curve = |counts: &Counts| {
            let fine = counts.top_px / counts.share.len() as f64;
            let steps = counts.share.iter().enumerate().map(|(k, s)| [(k + 1) as f64 * fine, *s]);
            let within = steps.filter(|p| p[0] <= top_px);
            PlotPoints::new(std::iter::once([0.0, 0.0]).chain(within).collect())
        };
        // The curve before the last edit stays as a ghost.
        if let Some(before) = &before {
            let line = Line::new("share before", curve(before)).color(t.ink.gamma_multiply(0.35));
            p.line(line.width(1.5).allow_hover(false));
        }
        p.line(Line::new("share", curve(&counts)).color(t.ink).width(1.5).allow_hover(false));
    });
    plots::units(ui, t, &shown, &x, &y);
    if large {
        let frame = *shown.transform.frame();
        for share in [0.25, 0.5, 0.75, 1.0] {
            let at = plots::at(&shown, counts.top_px, share);
            let font = font::regular(font::CAPTION);
            let label = format!("{:.0} %", 100.0 * share);
            ui.painter().text(
                pos2(frame.right() + 5.0, at.y),
                egui::Align2::LEFT_CENTER,
                label,
                font,
                t.text3,
            );
            ui.painter().hline(frame.x_range(), at.y, Stroke::new(1.0, t.line));
        }
    }
    let p95 = solution.stats.p95;
    let label = if p95 < 0.1 { format!("{p95:.3}") } else { format!("{p95:.2}") };
    let label = if large { format!("{label} px") } else { label };
    plots::mark_x(ui, t, &shown, p95, 0.95, ["p95", &label]);
    let n = solution.stats.n;
    named(
        &shown.response,
        egui::Role::Image,
        true,
        &format!("Errors of {n} corners, 95 % below {p95:.3} px"),
    );
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calib::stats;

    #[test]
    fn every_corner_is_counted_once() {
        let errors: Vec<f64> = (0..1000).map(|i| f64::from(i) / 1000.0).collect();
        let counts = count(errors.iter().copied(), stats::errors(&errors));
        assert_eq!(counts.bars.iter().sum::<usize>(), 1000);
        assert!((counts.share[BINS * FINE / 2] - 0.5).abs() < 0.02);
        assert_eq!(counts.share.last(), Some(&1.0));
        let far: Vec<f64> = errors.iter().copied().chain([1e6]).collect();
        assert!(count(far.iter().copied(), stats::errors(&far)).top_px < 3.0);
    }
}
