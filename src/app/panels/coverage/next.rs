//! The next picture: the board as it should be held, over an empty picture, and what it brings.

use egui::{Color32, Painter, Pos2, Rect, Sense, Shape, Stroke, Ui, pos2, vec2};
use nalgebra::Point3;

use super::NOTHING;
use crate::{
    app::{
        cx::Cx,
        files::tell_bad,
        maps,
        picture_view::Place,
        style::{font, icon},
        widgets::{certainty, empty, field, fit_top_left, named, text},
    },
    calib::{
        advice::{Advice, Figure, Goal, Next},
        camera::Camera,
        target::Target,
    },
};

/// Width of the words beside the picture, points.
const SIDE: f32 = 206.0;

/// Draws the page.
pub(super) fn show(cx: &mut Cx<'_>, ui: &mut Ui) {
    let t = cx.t;
    let goal = cx.state.doc.goal;
    let Some(advice) = cx.state.data.advice(goal) else {
        return empty(ui, t, "What to photograph next appears here when all pictures were looked at.");
    };
    let all = ui.available_rect_before_wrap();
    let Some((answer, solution)) = cx.state.data.solved() else {
        return empty(ui, t, if advice.sentence.is_empty() { NOTHING } else { &advice.sentence });
    };
    let wide = all.width() > 560.0;
    let room = if wide { all.with_max_x(all.right() - SIDE - 16.0) } else { all.with_max_y(all.center().y) };
    let [w, h] = solution.camera.size_px.map(|n| n as f32);
    let rect = fit_top_left(room, vec2(w, h));
    let painter = ui.painter_at(rect);
    painter.rect_filled(rect, 2.0, t.canvas);
    let place = Place::covering(rect, solution.camera.size_px);
    maps::dots(&painter, &place, &answer.report().corners_px(), 1.0, t.text3);
    if let (Some(next), Some(target)) = (&advice.next, answer.report().settings.target()) {
        ghost(&painter, &place, &solution.camera, &target, next);
    }
    let response = ui.interact(rect, ui.scope_id().with("next picture"), Sense::hover());
    named(&response, egui::Role::Image, true, &format!("Next picture. {}", advice.sentence));
    let side = if wide {
        Rect::from_min_max(pos2(all.right() - SIDE, all.top()), all.max)
    } else {
        all.with_min_y(rect.bottom() + 12.0)
    };
    let mut ui = crate::app::panels::part(ui, "words", side);
    words(cx, &mut ui, &advice);
}

/// The board at its pose: squares where it has some, else points; dashed around.
fn ghost(painter: &Painter, place: &Place, camera: &Camera, target: &Target, next: &Next) {
    let at = |x: f64, y: f64| -> Option<Pos2> {
        let px = camera.project(&next.camera_from_board.apply(&Point3::new(x, y, 0.0)))?;
        Some(place.point([px.x, px.y]))
    };
    let [[x0, y0], [x1, y1]] = target.extent();
    let mut edge = 0.0;
    if let &Target::Checkerboard { size, square } = target {
        edge = square;
        for row in 0..=size.rows {
            for col in 0..=size.cols {
                let [x, y] = [col, row].map(|n| (f64::from(n) - 1.0) * square);
                let corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
                let corners: Option<Vec<Pos2>> =
                    corners.into_iter().map(|(u, v)| at(x + u * square, y + v * square)).collect();
                let gray = if (row + col) % 2 == 0 { 24 } else { 214 };
                let fill = Color32::from_rgba_unmultiplied(gray, gray, gray, 205);
                painter.extend(corners.map(|c| Shape::convex_polygon(c, fill, Stroke::NONE)));
            }
        }
    } else {
        let points = target.points_in_board();
        let points = points.iter().filter_map(|p| camera.project(&next.camera_from_board.apply(p)));
        maps::dots(painter, place, &points.collect::<Vec<_>>(), 2.0, Color32::from_gray(214));
    }
    // Sides bend with the lens.
    let corners =
        [(x0 - edge, y0 - edge), (x1 + edge, y0 - edge), (x1 + edge, y1 + edge), (x0 - edge, y1 + edge)];
    let side = |k: usize| {
        let (a, b) = (corners[k % 4], corners[(k + 1) % 4]);
        (0..8).map(move |i| {
            let share = f64::from(i) / 8.0;
            (a.0 + share * (b.0 - a.0), a.1 + share * (b.1 - a.1))
        })
    };
    let outline: Option<Vec<Pos2>> =
        (0..4).flat_map(side).chain([corners[0]]).map(|(x, y)| at(x, y)).collect();
    if let Some(outline) = outline {
        painter.extend(Shape::dashed_line(&outline, Stroke::new(1.6, Color32::WHITE), 6.0, 4.0));
    }
}

fn words(cx: &mut Cx<'_>, ui: &mut Ui, advice: &Advice) {
    let t = cx.t;
    let small = |words: &str, color: Color32| text(words, font::regular(font::SMALL), color);
    ui.spacing_mut().item_spacing.y = 4.0;
    ui.label(text(advice.sentence.as_str(), font::semibold(font::LEAD), t.ink));
    if advice.next.is_some() {
        ui.label(small("Sides are those of the picture, as the camera sees the board.", t.text3));
    }
    ui.add_space(8.0);
    if let Some(before) = advice.before {
        // σ of the centre is told against the mean of all boards, so a board in a corner can raise it: only where that is the goal.
        for (figure, name) in
            [(Figure::Corner, "worst corner"), (Figure::Centre, "centre"), (Figure::Mean, "whole map")]
        {
            if figure == Figure::Centre && advice.goal.figure != figure {
                continue;
            }
            let (before, after) =
                (figure.of_figures(&before), advice.after.map(|after| figure.of_figures(&after)));
            ui.horizontal(|ui| {
                ui.label(small(name, t.text2));
                ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                    let now = certainty(before);
                    let words = match after {
                        Some(after) => format!("{now} {} {} px", icon::ARROW, certainty(after)),
                        None => format!("{now} px"),
                    };
                    ui.label(text(words, font::medium(font::SMALL), t.ink));
                });
            });
        }
        ui.add_space(8.0);
    }
    let shown = cx.state.doc.goal.to_string();
    if let Some(text) = field(ui, "Goal", "goal of the advice", &shown, "1px") {
        match text.parse::<Goal>() {
            Ok(goal) => cx.edit(|d| d.goal = goal),
            Err(_) if text.trim().is_empty() => cx.edit(|d| d.goal = Goal::default()),
            Err(error) => cx.push(tell_bad(error.to_string())),
        }
    }
    for (example, words) in [
        ("1px,centre", "or 1px,mean: elsewhere"),
        ("5mm@2m", "sideways, at 2 m"),
        ("1cm@2m,baseline=12cm", "in depth"),
    ] {
        ui.horizontal_wrapped(|ui| {
            ui.spacing_mut().item_spacing.x = 6.0;
            ui.label(small(example, t.text2));
            ui.label(small(words, t.text3));
        });
    }
    ui.add_space(4.0);
    ui.label(small(&advice.promise, t.ink));
}
