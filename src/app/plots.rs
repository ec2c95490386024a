//! How plots look: on the page's own ground, horizontal grid only, at most five ticks, the unit once.

use egui::{Align2, Rect, Sense, Stroke, Ui, Vec2b, pos2};
use egui_plot::{AxisHints, GridMark, Plot, PlotPoint, PlotResponse};

use super::{
    style::{Tokens, font},
    widgets::minus,
};

/// One direction of a plot.
#[derive(Clone, Debug)]
pub struct Axis {
    /// From and to.
    pub range: [f64; 2],
    /// Where it has numbers.
    pub ticks: Vec<f64>,
    /// Their digits after the point.
    decimals: usize,
    /// Said once, at its end.
    pub unit: &'static str,
}

impl Axis {
    /// From `low` to `high`, with at most `most` numbers.
    pub fn new(low: f64, high: f64, most: usize, unit: &'static str) -> Self {
        let high = if high > low { high } else { low + 1.0 };
        let step = nice_step((high - low) / most.max(1) as f64);
        let first = (low / step - 1e-9).ceil() as i64;
        let last = (high / step + 1e-9).floor() as i64;
        let decimals = (-step.log10().floor()).clamp(0.0, 9.0) as usize;
        Self { range: [low, high], ticks: (first..=last).map(|k| k as f64 * step).collect(), decimals, unit }
    }

    /// Without numbers.
    pub fn bare(low: f64, high: f64) -> Self {
        Self { range: [low, high], ticks: Vec::new(), decimals: 0, unit: "" }
    }

    /// A value as its numbers are written.
    pub fn label(&self, value: f64) -> String {
        if value.abs() < 1e-12 {
            return "0".to_owned();
        }
        minus(format!("{:.*}", self.decimals, value))
    }
}

/// 1, 2 or 5 times a power of ten, not below `least`.
fn nice_step(least: f64) -> f64 {
    let power = 10f64.powf(least.abs().max(1e-12).log10().floor());
    let factor = [1.0, 2.0, 5.0].into_iter().find(|f| f * power >= least * (1.0 - 1e-9)).unwrap_or(10.0);
    factor * power
}

/// A plot with these axes. It neither moves nor zooms; `clickable` plots hear clicks and drags.
pub fn plot(id: &str, t: &'static Tokens, x: &Axis, y: &Axis, clickable: bool) -> Plot<'static> {
    let marks = |axis: &Axis| -> Vec<GridMark> {
        axis.ticks.iter().map(|v| GridMark { value: *v, step_size: axis.range[1] - axis.range[0] }).collect()
    };
    let (mut x_marks, y_marks) = (marks(x), marks(y));
    // A short unit stands at the end of the numbers, where the last of them would be.
    if !x.unit.is_empty() && x.unit.chars().count() < 4 {
        x_marks.retain(|m| (m.value - x.range[0]) / (x.range[1] - x.range[0]) < 0.87);
    }
    let hints = |hints: AxisHints<'static>, axis: &Axis| {
        let axis = axis.clone();
        hints
            .tick_label_font(font::regular(font::CAPTION))
            .tick_label_color(t.text3)
            .label_spacing(egui::Rangef::new(1.0, 2.0))
            .formatter(move |mark: GridMark, _| axis.label(mark.value))
    };
    Plot::new(id)
        .show_background(false)
        .show_axes(Vec2b::new(!x.ticks.is_empty(), !y.ticks.is_empty()))
        .show_grid(Vec2b::new(false, true))
        .grid_color(t.line)
        .grid_fade(0.0)
        .grid_spacing(egui::Rangef::new(1.0, 2.0))
        .x_grid_spacer(move |_| x_marks.clone())
        .y_grid_spacer(move |_| y_marks.clone())
        .custom_x_axes(vec![hints(AxisHints::new_x(), x).min_thickness(16.0)])
        .custom_y_axes(vec![hints(AxisHints::new_y(), y).min_thickness(26.0)])
        .default_x_bounds(x.range[0], x.range[1])
        .default_y_bounds(y.range[0], y.range[1])
        .set_margin_fraction(egui::Vec2::ZERO)
        .auto_bounds(false)
        .allow_zoom(false)
        .allow_drag(false)
        .allow_scroll(false)
        .allow_boxed_zoom(false)
        .allow_axis_zoom_drag(false)
        .allow_double_click_reset(false)
        .show_x(false)
        .show_y(false)
        .cursor_color(egui::Color32::TRANSPARENT)
        .label_formatter(|_| None)
        .sense(if clickable { Sense::click_and_drag() } else { Sense::hover() })
        .reset()
}

/// Writes the units at the ends of the axes.
pub fn units<R>(ui: &Ui, t: &Tokens, shown: &PlotResponse<R>, x: &Axis, y: &Axis) {
    let frame = *shown.transform.frame();
    let small = || font::regular(font::CAPTION);
    if !x.unit.is_empty() {
        let at = pos2(frame.right(), frame.bottom() + 3.0);
        ui.painter().text(at, Align2::RIGHT_TOP, x.unit, small(), t.text3);
    }
    if !y.unit.is_empty() {
        let at = pos2(frame.left() - 4.0, frame.top() - 2.0);
        ui.painter().text(at, Align2::RIGHT_BOTTOM, y.unit, small(), t.text3);
    }
}

/// A long unit stands below the numbers.
pub fn long_unit<R>(ui: &Ui, t: &Tokens, shown: &PlotResponse<R>, x: &Axis) {
    let frame = *shown.transform.frame();
    let at = pos2(frame.right(), frame.bottom() + 17.0);
    ui.painter().text(at, Align2::RIGHT_TOP, x.unit, font::regular(font::CAPTION), t.text3);
}

/// The point of the screen where a value is.
pub fn at<R>(shown: &PlotResponse<R>, x: f64, y: f64) -> egui::Pos2 {
    shown.transform.position_from_point(&PlotPoint::new(x, y))
}

/// A dashed vertical line with its label beside it.
pub fn mark_x<R>(ui: &Ui, t: &Tokens, shown: &PlotResponse<R>, x: f64, top: f64, lines: [&str; 2]) {
    let [from, to] = [at(shown, x, 0.0), at(shown, x, top)];
    ui.painter().extend(egui::Shape::dashed_line(&[from, to], Stroke::new(1.0, t.ink), 3.0, 3.0));
    ui.painter().circle_filled(to, 3.0, t.ink);
    let frame: Rect = *shown.transform.frame();
    let y = frame.top() + frame.height() * 0.5;
    let room = frame.right() - from.x;
    let (dx, anchor) = if room > 46.0 { (5.0, Align2::LEFT_CENTER) } else { (-5.0, Align2::RIGHT_CENTER) };
    for (line, color, dy) in [(lines[0], t.text2, -7.0), (lines[1], t.ink, 7.0)] {
        ui.painter().text(pos2(from.x + dx, y + dy), anchor, line, font::regular(font::CAPTION), color);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_few() {
        let axis = Axis::new(0.0, 0.53, 5, "px");
        assert_eq!(axis.ticks.len(), 3);
        assert_eq!(axis.ticks.iter().map(|v| axis.label(*v)).collect::<Vec<_>>(), ["0", "0.2", "0.4"]);
        let axis = Axis::new(-40.0, 40.0, 5, "°");
        assert_eq!(
            axis.ticks.iter().map(|v| axis.label(*v)).collect::<Vec<_>>(),
            ["−40", "−20", "0", "20", "40"]
        );
        assert!(Axis::new(3.0, 3.0, 5, "").range[1] > 3.0);
    }
}
