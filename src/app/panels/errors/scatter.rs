//! Residuals as points: dx against dy, and their length against the distance from the axis.

use egui::{Ui, vec2};
use egui_plot::{HLine, Line, PlotPoints, PlotUi, Points, VLine};

use super::NOTHING;
use crate::{
    app::{
        cx::Cx,
        plots::{self, Axis},
        state::State,
        style::Tokens,
        widgets::{empty, named},
    },
    calib::order,
};

/// Points of all used corners, those of the selected picture apart.
struct Split {
    others: Vec<[f64; 2]>,
    selected: Vec<[f64; 2]>,
}

fn split(state: &State, point: impl Fn([f64; 2], [f64; 2]) -> [f64; 2]) -> Split {
    let (mut others, mut selected) = (Vec::new(), Vec::new());
    let chosen = state.selected();
    if let Some((answer, _)) = state.data.solved() {
        for (id, frame) in answer.used() {
            let list = if chosen == Some(id) { &mut selected } else { &mut others };
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
        cloud(p, t, points.others, points.selected, 1.6);
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
        cloud(p, t, points.others, points.selected, 1.6);
        p.line(Line::new("mean", PlotPoints::new(rings)).color(t.ink).width(1.5).allow_hover(false));
    });
    plots::long_unit(ui, t, &shown, &x);
    named(&shown.response, egui::Role::Image, true, "Errors against the distance from the axis");
}

/// Points, of which those of the selected picture stand out.
pub(super) fn cloud(
    plot: &mut PlotUi<'_>,
    t: &Tokens,
    others: Vec<[f64; 2]>,
    selected: Vec<[f64; 2]>,
    radius: f32,
) {
    for (name, list, color, radius) in
        [("others", others, t.bar2, radius), ("selected", selected, t.accent, radius + 1.0)]
    {
        let points = Points::new(name, PlotPoints::new(list)).color(color).radius(radius);
        plot.points(points.allow_hover(false));
    }
}

/// Mean place and height of `n` groups of equally many points, by their place.
fn rings(mut points: Vec<[f64; 2]>, n: usize) -> Vec<[f64; 2]> {
    order::by(&mut points, |p| [p[0]]);
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
