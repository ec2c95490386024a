//! Radial distortion against the distance from the axis, with its ±1σ band.

use egui::{Align2, Rect, Ui, pos2};
use egui_plot::{FilledArea, Line, PlotPoints};
use nalgebra::{DMatrix, DVector, Vector2, Vector3};

use super::NOTHING;
use crate::{
    app::{
        cx::Cx,
        plots::{self, Axis},
        style::font,
        widgets::{empty, named, text},
    },
    calib::camera::Camera,
};

/// Places along the radius.
const STEPS: usize = 60;

/// `[distance from the axis without a lens, how far the lens moves it outwards, σ of that]` of each step, px.
pub(super) fn data(camera: &Camera, covariance: &DMatrix<f64>) -> Vec<[f64; 3]> {
    let [fx, fy, cx, cy] = camera.intrinsics();
    let [w, h] = camera.size_px.map(f64::from);
    let corners = [[0.0, 0.0], [w - 1.0, 0.0], [0.0, h - 1.0], [w - 1.0, h - 1.0]];
    let to = corners
        .map(|[x, y]| Vector2::new(x - cx, y - cy))
        .into_iter()
        .max_by(|a, b| a.norm().total_cmp(&b.norm()));
    let Some(to) = to else { return Vec::new() };
    // The far corner shows what a point further out would without the lens; the curve ends where the picture does.
    let outwards = to / to.norm();
    let mut list = Vec::new();
    for k in 0..=STEPS * 2 {
        let radius = to.norm() * k as f64 / STEPS as f64;
        let ideal = outwards * radius;
        let ray = Vector3::new(ideal.x / fx, ideal.y / fy, 1.0);
        let Some(there) = (camera.spec().project)(&camera.params, &ray) else { break };
        let moved = there.px - Vector2::new(cx, cy) - ideal;
        // Focal length and centre move the ideal place, too: what is left is the lens.
        let n = camera.params.len();
        let by = DVector::from_fn(n, |i, _| {
            let mut by = there.by_params[i];
            match i {
                0 => by.x -= ray.x,
                1 => by.y -= ray.y,
                2 => by.x -= 1.0,
                3 => by.y -= 1.0,
                _ => {}
            }
            by.dot(&outwards)
        });
        let variance = (by.transpose() * covariance * &by)[(0, 0)];
        let real = (there.px - Vector2::new(cx, cy)).dot(&outwards);
        // Beyond the fold a larger angle comes nearer again.
        if list.last().is_some_and(|[r, d, _]: &[f64; 3]| real <= r + d) && k > 0 {
            break;
        }
        list.push([radius, moved.dot(&outwards), variance.max(0.0).sqrt()]);
        if real > to.norm() {
            break;
        }
    }
    list
}

/// The plot.
pub(super) fn show(cx: &mut Cx<'_>, ui: &mut Ui) {
    let t = cx.t;
    let Some((answer, solution)) = cx.state.data.solved() else { return empty(ui, t, NOTHING) };
    let all = ui.available_rect_before_wrap();
    ui.horizontal(|ui| {
        ui.label(text("Radial profile", font::semibold(font::SMALL), t.ink));
        ui.label(text("px outwards, band ±1σ", font::regular(font::SMALL), t.text3));
    });
    let points = data(&solution.camera, &solution.covariance);
    if points.len() < 2 {
        return;
    }
    let [_, _, cx0, cy0] = solution.camera.intrinsics();
    let seen = answer
        .report()
        .included()
        .flat_map(|f| &f.corners)
        .map(|c| (c.px.x - cx0).hypot(c.px.y - cy0))
        .fold(0.0, f64::max);
    // Corners were measured with the lens: find where that is without.
    let edge = points.iter().find(|[r, d, _]| r + d >= seen).map_or(f64::MAX, |p| p[0]);
    let (mut low, mut high) = (0.0f64, 0.0f64);
    for [_, d, s] in &points {
        (low, high) = (low.min(d - s), high.max(d + s));
    }
    let far = points[points.len() - 1][0];
    let pad = 0.05 * (high - low).max(1e-6);
    let (x, y) = (Axis::new(0.0, far, 5, "px from the axis"), Axis::new(low - pad, high + pad, 5, "px"));
    let rect =
        Rect::from_min_max(pos2(all.left(), all.top() + 34.0), pos2(all.right() - 4.0, all.bottom() - 16.0));
    let mut child = crate::app::panels::part(ui, "profile", rect);
    let id = format!("profile {}", all.width() as i32);
    let shown = plots::plot(&id, t, &x, &y, false).show(&mut child, |p| {
        let column = |k: usize| points.iter().map(|p| p[k]).collect::<Vec<f64>>();
        let (radius, middle, sigma) = (column(0), column(1), column(2));
        let side = |s: f64| middle.iter().zip(&sigma).map(|(d, e)| d + s * e).collect::<Vec<f64>>();
        if edge < far {
            let band = FilledArea::new("no corner beyond", &[edge, far], &[low - pad; 2], &[high + pad; 2]);
            p.add(band.fill_color(t.ctl).allow_hover(false));
        }
        let band = FilledArea::new("1σ", &radius, &side(-1.0), &side(1.0));
        p.add(band.fill_color(t.bar.gamma_multiply(0.5)).allow_hover(false));
        let curve = radius.iter().zip(&middle).map(|(r, d)| [*r, *d]).collect();
        p.line(Line::new("displacement", PlotPoints::new(curve)).color(t.ink).width(1.5).allow_hover(false));
    });
    plots::units(ui, t, &shown, &Axis::bare(0.0, 1.0), &y);
    if edge < far {
        // Away from the curve: above one that rises, below one that falls.
        let rises = high > -low;
        let at = plots::at(&shown, edge, if rises { high } else { low });
        let anchor = match (at.x > rect.center().x, rises) {
            (true, true) => Align2::RIGHT_TOP,
            (true, false) => Align2::RIGHT_BOTTOM,
            (false, true) => Align2::LEFT_TOP,
            (false, false) => Align2::LEFT_BOTTOM,
        };
        ui.painter().text(
            at + egui::vec2(-5.0, 2.0),
            anchor,
            "no corner beyond",
            font::regular(font::CAPTION),
            t.text3,
        );
    }
    plots::long_unit(ui, t, &shown, &x);
    let last = points[points.len() - 1];
    named(
        &shown.response,
        egui::Role::Image,
        true,
        &format!("Radial profile, {:.1} px at the far corner", last[1]),
    );
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calib::camera::Model;

    #[test]
    fn the_profile_of_one_term_is_its_cubic() {
        let params = vec![500.0, 500.0, 319.5, 239.5, -0.1, 0.0, 0.0, 0.0, 0.0];
        let camera = Camera::new(Model::Brown5, [640, 480], params).unwrap();
        let mut covariance = DMatrix::zeros(9, 9);
        covariance[(4, 4)] = 0.01f64.powi(2);
        let points = data(&camera, &covariance);
        assert!(points.len() > 30);
        for [radius, moved, sigma] in points {
            let cubic = radius * (radius / 500.0).powi(2);
            assert!((moved + 0.1 * cubic).abs() < 1e-9 && (sigma - 0.01 * cubic).abs() < 1e-9);
        }
    }
}
