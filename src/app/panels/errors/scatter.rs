//! Residuals as points: dx against dy, and their length against the distance from the axis.

use egui::{Ui, vec2};
use egui_plot::{HLine, Line, PlotPoints, Points, VLine};

use super::NOTHING;
use crate::app::{
    cx::Cx,
    plots::{self, Axis},
    state::State,
    widgets::{empty, named},
};

/// Points of all used corners, those of the selected picture apart.
struct Split {
    others: Vec<[f64; 2]>,
    selected: Vec<[f64; 2]>,
}

fn split(state: &State, point: impl Fn([f64; 2], [f64; 2]) -> [f64; 2]) -> Split {
    let (mut others, mut selected) = (Vec::new(), Vec::new());
    if let Some((answer, _)) = state.data.solved() {
        for (frame, id) in answer.report().frames.iter().zip(&answer.ids).filter(|(f, _)| f.included) {
            let list = if state.selected() == Some(*id) { &mut selected } else { &mut others };
            list.extend(
                frame.corners.iter().zip(&frame.residuals_px).map(|(c, r)| point([c.px.x, c.px.y], *r)),
            );
        }
    }
    Split { others, selected }
}

/// dx against dy.
pub(super) fn show(cx: &mut Cx<'_>, ui: &mut Ui) {
    let t = cx.t;
    let Some((_, solution)) = cx.state.data.solved() else { return empty(ui, t, NOTHING) };
    let reach = solution.stats.max * 1.05;
    super::heading(ui, t, "Residuals", "detected − projected, px; the selected picture's stand out");
    let points = split(cx.state, |_, r| [r[0], -r[1]]);
    let all = ui.available_rect_before_wrap();
    let side = all.width().min(all.height() - 8.0);
    let rect =
        egui::Rect::from_min_size(all.min + vec2((all.width() - side) / 2.0, 4.0), vec2(side, side - 4.0));
    let axis = Axis::new(-reach, reach, 5, "px");
    let mut child = crate::app::panels::part(ui, "scatter", rect);
    let shown = plots::plot("scatter", t, &axis, &axis, false).data_aspect(1.0).show(&mut child, |p| {
        p.hline(HLine::new("", 0.0).color(t.line2).width(1.0).allow_hover(false));
        p.vline(VLine::new("", 0.0).color(t.line2).width(1.0).allow_hover(false));
        p.points(
            Points::new("others", PlotPoints::new(points.others))
                .color(t.bar2)
                .radius(1.6)
                .allow_hover(false),
        );
        p.points(
            Points::new("selected", PlotPoints::new(points.selected))
                .color(t.accent)
                .radius(2.6)
                .allow_hover(false),
        );
    });
    named(&shown.response, egui::Role::Image, true, "Residuals, dx against dy");
}

/// Length against the distance from the principal point, with the mean of rings of equal numbers.
pub(super) fn radius(cx: &mut Cx<'_>, ui: &mut Ui) {
    let t = cx.t;
    let Some((_, solution)) = cx.state.data.solved() else { return empty(ui, t, NOTHING) };
    let [_, _, cx0, cy0] = solution.camera.intrinsics();
    let [w, h] = solution.camera.size_px.map(f64::from);
    let far = [[0.0, 0.0], [w, 0.0], [0.0, h], [w, h]]
        .map(|[x, y]| (x - cx0).hypot(y - cy0))
        .into_iter()
        .fold(0.0, f64::max);
    super::heading(
        ui,
        t,
        "Error against the distance from the axis",
        "px; the line is the mean of rings with equally many corners",
    );
    let points = split(cx.state, |[x, y], [dx, dy]| [(x - cx0).hypot(y - cy0), dx.hypot(dy)]);
    let rings = rings(points.others.iter().chain(&points.selected).copied().collect(), 8);
    let (x, y) =
        (Axis::new(0.0, far, 6, "px from the axis"), Axis::new(0.0, solution.stats.max * 1.05, 5, "px"));
    let rect = ui.available_rect_before_wrap();
    let mut child = crate::app::panels::part(
        ui,
        "radius",
        rect.with_min_y(rect.top() + 14.0).with_max_y(rect.bottom() - 14.0),
    );
    let shown = plots::plot("radius", t, &x, &y, false).show(&mut child, |p| {
        p.points(
            Points::new("others", PlotPoints::new(points.others))
                .color(t.bar2)
                .radius(1.6)
                .allow_hover(false),
        );
        p.points(
            Points::new("selected", PlotPoints::new(points.selected))
                .color(t.accent)
                .radius(2.6)
                .allow_hover(false),
        );
        p.line(Line::new("mean", PlotPoints::new(rings)).color(t.ink).width(1.5).allow_hover(false));
    });
    end_unit(ui, t, &shown, &x);
    named(&shown.response, egui::Role::Image, true, "Errors against the distance from the axis");
}

/// A long unit stands below the numbers.
pub(super) fn end_unit<R>(
    ui: &Ui,
    t: &crate::app::style::Tokens,
    shown: &egui_plot::PlotResponse<R>,
    x: &Axis,
) {
    let frame = *shown.transform.frame();
    let at = egui::pos2(frame.right(), frame.bottom() + 17.0);
    let font = crate::app::style::font::regular(crate::app::style::font::CAPTION);
    ui.painter().text(at, egui::Align2::RIGHT_TOP, x.unit, font, t.text3);
}

/// Mean place and height of `n` groups of equally many points, by their place.
fn rings(mut points: Vec<[f64; 2]>, n: usize) -> Vec<[f64; 2]> {
    points.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let size = points.len().div_ceil(n).max(1);
    let mean = |c: &[[f64; 2]]| {
        let m = c.len() as f64;
        [c.iter().map(|p| p[0]).sum::<f64>() / m, c.iter().map(|p| p[1]).sum::<f64>() / m]
    };
    points.chunks(size).map(mean).collect()
}

#[cfg(test)]
mod tests {
    #[test]
    fn rings_hold_equally_many() {
        let points = (0..8).map(|i| [f64::from(7 - i), f64::from(i % 2)]).collect();
        assert_eq!(super::rings(points, 4), [[0.5, 0.5], [2.5, 0.5], [4.5, 0.5], [6.5, 0.5]]);
        assert!(super::rings(Vec::new(), 4).is_empty());
    }
}
