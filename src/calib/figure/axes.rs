//! Axes with round ticks, grid lines and names.

use super::{
    color,
    svg::{Anchor, Panel, Type},
};

/// A plot area and the numbers along its sides.
pub(super) struct Axes {
    /// Left, top, width and height of the plot area in the panel.
    pub(super) area: [f64; 4],
    /// Numbers at left and right.
    pub(super) x: [f64; 2],
    /// Numbers at bottom and top (top first where y grows downwards).
    pub(super) y: [f64; 2],
}

/// What to write along the sides.
#[derive(Clone, Copy, Default)]
pub(super) struct Names<'a> {
    pub(super) title: &'a str,
    pub(super) x: &'a str,
    pub(super) y: &'a str,
    /// Whether x has grid lines and numbers of its own.
    pub(super) x_ticks: bool,
}

impl Axes {
    /// A panel of the given outer size with title, grid, ticks and names drawn.
    pub(super) fn draw(width: f64, height: f64, x: [f64; 2], y: [f64; 2], names: Names<'_>) -> (Panel, Self) {
        let mut panel = Panel::new(width, height);
        let axes = Self { area: [62.0, 28.0, width - 62.0 - 12.0, height - 28.0 - 48.0], x, y };
        let [left, top, w, h] = axes.area;
        panel.text([0.0, 14.0], names.title, Type::TITLE);
        for v in ticks(y, (h / 40.0) as usize) {
            let at = axes.at(x[0], v)[1];
            panel.line([left, at], [left + w, at], color::GRID, 1.0, "");
            panel.text([left - 8.0, at + 4.0], &label(v, y), Type::TICK.anchored(Anchor::End));
        }
        if names.x_ticks {
            for v in ticks(x, (w / 70.0) as usize) {
                let at = axes.at(v, y[0])[0];
                panel.line([at, top], [at, top + h], color::GRID, 1.0, "");
                panel.text([at, top + h + 16.0], &label(v, x), Type::TICK);
            }
        }
        panel.line([left, top + h], [left + w, top + h], color::MUTED, 1.0, "");
        panel.text([left + w / 2.0, top + h + 38.0], names.x, Type::LABEL);
        panel.text_up([14.0, top + h / 2.0], names.y, Type::LABEL);
        (panel, axes)
    }

    /// Where a pair of numbers lies in the panel.
    pub(super) fn at(&self, x: f64, y: f64) -> [f64; 2] {
        let [left, top, w, h] = self.area;
        let share = |v: f64, [lo, hi]: [f64; 2]| if hi == lo { 0.5 } else { (v - lo) / (hi - lo) };
        [left + w * share(x, self.x), top + h * (1.0 - share(y, self.y))]
    }

    /// A horizontal line over the whole width with its name above the right end.
    pub(super) fn level(&self, panel: &mut Panel, y: f64, name: &str, stroke: &'static str) {
        let at = self.at(self.x[0], y)[1];
        let [left, _, w, _] = self.area;
        panel.line([left, at], [left + w, at], stroke, 1.5, "stroke-dasharray=\"6 4\"");
        panel.text_over([left + w, at - 5.0], name, Type::TICK.anchored(Anchor::End).colored(stroke));
    }

    /// A vertical line over the whole height with its name beside the top.
    pub(super) fn mark(&self, panel: &mut Panel, x: f64, name: &str, stroke: &'static str) {
        let at = self.at(x, self.y[0])[0];
        let [left, top, w, h] = self.area;
        panel.line([at, top], [at, top + h], stroke, 1.5, "stroke-dasharray=\"6 4\"");
        let (dx, anchor) = if at > left + w / 2.0 { (-5.0, Anchor::End) } else { (5.0, Anchor::Start) };
        panel.text_over([at + dx, top + 12.0], name, Type::TICK.anchored(anchor).colored(stroke));
    }
}

/// Round numbers within an interval, about `n` of them.
pub(super) fn ticks(range: [f64; 2], n: usize) -> Vec<f64> {
    let (lo, hi) = (range[0].min(range[1]), range[0].max(range[1]));
    if !(lo.is_finite() && hi.is_finite()) || hi <= lo {
        return Vec::new();
    }
    let step = step(hi - lo, n);
    let (first, last) = ((lo / step - 1e-9).ceil() as i64, (hi / step + 1e-9).floor() as i64);
    (first..=last).map(|i| i as f64 * step).collect()
}

/// 1, 2 or 5 times a power of ten.
fn step(span: f64, n: usize) -> f64 {
    let rough = span / n.clamp(2, 12) as f64;
    let power = 10f64.powf(rough.log10().floor());
    let round = [1.0, 2.0, 5.0, 10.0].into_iter().find(|m| m * power >= rough * 0.999);
    round.unwrap_or(10.0) * power
}

/// A tick's number with as many decimals as the range asks for.
pub(super) fn label(v: f64, range: [f64; 2]) -> String {
    let span = (range[1] - range[0]).abs();
    let decimals = if span > 0.0 { (1.0 - (span / 5.0).log10()).ceil().clamp(0.0, 6.0) as usize } else { 2 };
    let text = format!("{v:.decimals$}");
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    text.replace('-', "\u{2212}")
}

/// The smallest round number of at least `v`, for the end of an axis that starts at zero.
pub(super) fn round_up(v: f64) -> f64 {
    if !(v.is_finite() && v > 0.0) {
        return 1.0;
    }
    let s = step(v, 5);
    (v / s - 1e-9).ceil() * s
}
