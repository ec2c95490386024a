//! One picture: pan, zoom to the pixel, a loupe with sub-pixel values.

use std::sync::Arc;

use egui::{Align2, Color32, Rect, Sense, Shape, Stroke, Ui, pos2, vec2};

use super::{marked, picture, size_of};
use crate::{
    app::{
        cx::Cx,
        picture_view::{Mark, Place, marks},
        plan::Kind,
        screen::View,
        style::{CASING, DETECTED, ON_PLATE, PROJECTED, RESIDUAL, font},
        widgets::{WHOLE, button, empty, minus, named, plate, text},
    },
    calib::{
        observation::{Corner, FrameId},
        report::FrameReport,
    },
};

/// Side of the loupe and pixels across it.
const LOUPE: f32 = 176.0;
const ACROSS: f64 = 12.0;
/// What the picture may lose for the loupe to stand beside it.
const SMALLER: f64 = 0.9;
/// Space around the picture.
const MARGIN: f32 = 12.0;

/// Draws the picture, its layers and the loupe.
pub(super) fn show(cx: &mut Cx<'_>, ui: &mut Ui) {
    let t = cx.t;
    let all = ui.available_rect_before_wrap();
    let Some(id) = cx.state.selected() else { return };
    let Some(size_px) = size_of(cx.state, id) else {
        let why = match cx.state.data.inspections.get(&id) {
            Some(Err(error)) => error.to_string(),
            _ => "Reading the picture…".to_owned(),
        };
        return empty(ui, t, &why);
    };
    let frame = cx.state.data.answer.clone().and_then(|a| a.frame(id).cloned());
    // The loupe stands beside a picture that need not become much smaller for it, and floats over any other.
    let inner = all.shrink(MARGIN);
    let whole = Place::fitted(size_px, inner);
    let narrower = inner.with_max_x(inner.right() - LOUPE - MARGIN);
    let beside = Place::fitted(size_px, narrower).zoom >= SMALLER * whole.zoom;
    let room = if beside { narrower } else { inner };
    let fitted = Place::fitted(size_px, room);
    let fitted = if beside {
        Place { rect: fitted.rect.translate(vec2(room.left() - fitted.rect.left(), 0.0)), ..fitted }
    } else {
        fitted
    };
    let place = match cx.state.screen.view {
        None => fitted,
        Some(view) => Place::around(size_px, room, view.zoom, view.center_px),
    };
    let zoomed = cx.state.screen.view.is_some();
    let clip = if zoomed { room } else { all };
    ui.data_mut(|d| d.insert_temp(egui::Id::unique("zoom shown"), place.zoom));
    let response = ui.interact(room, ui.scope_id().with("picture"), Sense::click_and_drag());
    named(&response, egui::Role::Image, true, &format!("Picture {}", cx.state.name(id)));
    let layers = cx.state.screen.layers;
    let straight = layers.straightened && cx.state.data.solved().is_some();
    picture(cx, ui, id, &place, clip, straight);
    let painter = ui.painter_at(clip);
    if let Some(frame) = frame.as_ref().filter(|_| !straight) {
        let list = marked(frame, &place, cx.state.times());
        if layers.order {
            order(&painter, &list, frame);
        }
        marks(&painter, &list, layers.corners, layers.reprojected && frame.included, 1.0);
        dropped(cx, &painter, &place, id);
        if let Some(mark) = cx.state.corner_of(frame).and_then(|i| list.get(i)) {
            let square = Rect::from_center_size(mark.detected, vec2(18.0, 18.0));
            painter.rect_stroke(square, 2.0, Stroke::new(4.0, CASING), egui::StrokeKind::Middle);
            painter.rect_stroke(square, 2.0, Stroke::new(2.0, Color32::WHITE), egui::StrokeKind::Middle);
        }
        if response.clicked()
            && let Some(at) = response.interact_pointer_pos()
        {
            let lost = dropped_of(cx, id);
            let near = frame
                .corners
                .iter()
                .chain(&lost)
                .map(|c| (place.point([c.px.x, c.px.y]).distance(at), c.index));
            let nearest = near.min_by(|a, b| a.0.total_cmp(&b.0)).filter(|(d, _)| *d < 14.0);
            let corner = nearest.map(|(_, index)| index);
            cx.show(|s| s.corner = corner);
        }
        if !frame.included && !frame.why.is_empty() {
            let at = pos2(place.rect.intersect(clip).center().x, place.rect.intersect(clip).bottom() - 8.0);
            plate(&painter, clip, at, Align2::CENTER_BOTTOM, &frame.why);
        }
    }
    moved(cx, ui, &response, &place, &fitted, room);
    if let Some(frame) = frame.filter(|_| !straight) {
        loupe(cx, ui, id, &frame, all, &place, beside);
    }
}

/// Lines along the rows, from the first corner to the last.
fn order(painter: &egui::Painter, list: &[Mark], frame: &FrameReport) {
    let points: Vec<_> = list.iter().map(|m| m.detected).collect();
    painter.add(Shape::line(points.clone(), Stroke::new(3.0, CASING)));
    painter.add(Shape::line(points.clone(), Stroke::new(1.4, Color32::WHITE)));
    for (i, at) in points.iter().enumerate() {
        let ends = i == 0 || i + 1 == points.len();
        if ends || points.len() <= 60 {
            let font = font::regular(if ends { font::SMALL } else { 10.0 });
            let label = frame.corners[i].index.to_string();
            painter.text(
                *at + vec2(6.0, -6.0) + vec2(1.0, 1.0),
                Align2::LEFT_BOTTOM,
                &label,
                font.clone(),
                Color32::BLACK,
            );
            painter.text(*at + vec2(6.0, -6.0), Align2::LEFT_BOTTOM, &label, font, ON_PLATE);
        }
    }
    if let Some(first) = points.first() {
        painter.circle_filled(*first, 5.0, Color32::WHITE);
        painter.circle_stroke(*first, 5.0, Stroke::new(1.5, Color32::BLACK));
    }
}

/// Corners that were dropped by hand.
fn dropped(cx: &Cx<'_>, painter: &egui::Painter, place: &Place, id: FrameId) {
    for corner in dropped_of(cx, id) {
        let at = place.point([corner.px.x, corner.px.y]);
        painter.circle_stroke(at, 3.4, Stroke::new(2.8, CASING));
        painter.add(Shape::dashed_line(&ring(at, 3.4), Stroke::new(1.4, Color32::WHITE), 2.0, 2.0));
    }
}

fn ring(at: egui::Pos2, radius: f32) -> Vec<egui::Pos2> {
    (0..=16).map(|k| at + radius * egui::Vec2::angled(k as f32 * std::f32::consts::TAU / 16.0)).collect()
}

fn dropped_of(cx: &Cx<'_>, id: FrameId) -> Vec<Corner> {
    let Some(answer) = cx.state.data.answer.as_deref() else { return Vec::new() };
    let position = answer.position(id);
    answer.evidence.dropped.iter().filter(|(p, _)| Some(*p) == position).map(|(_, c)| *c).collect()
}

/// Wheel and drag.
fn moved(cx: &mut Cx<'_>, ui: &Ui, response: &egui::Response, place: &Place, fitted: &Place, room: Rect) {
    let mut zoom = place.zoom;
    let mut center = place.pixel(room.center());
    let mut changed = false;
    if let Some(at) = response.hover_pos() {
        let factor = ui.input(|i| f64::from(i.zoom_delta() * (i.smooth_scroll_delta().y * 0.005).exp()));
        if (factor - 1.0).abs() > 1e-6 {
            zoom = (zoom * factor).min(64.0).max(fitted.zoom * 0.5);
            let under = place.pixel(at);
            let from = [f64::from(at.x - room.center().x), f64::from(at.y - room.center().y)];
            center = [under[0] - from[0] / zoom, under[1] - from[1] / zoom];
            changed = true;
        }
    }
    if response.dragged() {
        let d = response.drag_delta();
        center = [center[0] - f64::from(d.x) / zoom, center[1] - f64::from(d.y) / zoom];
        changed = changed || d != egui::Vec2::ZERO;
    }
    if response.double_clicked() {
        cx.show(|s| s.view = None);
    } else if changed {
        let view = (zoom > fitted.zoom).then_some(View { zoom, center_px: center });
        cx.show(|s| s.view = view);
    }
}

/// The pixels around a corner, and its values.
fn loupe(
    cx: &mut Cx<'_>,
    ui: &mut Ui,
    id: FrameId,
    frame: &FrameReport,
    all: Rect,
    place: &Place,
    beside: bool,
) {
    let t = cx.t;
    let chosen = cx.state.screen.corner;
    let lost = dropped_of(cx, id).into_iter().find(|c| Some(c.index) == chosen);
    let kept = cx.state.corner_of(frame).map(|i| (frame.corners[i], frame.residuals_px.get(i).copied()));
    let Some((corner, residual)) = lost.map(|c| (c, None)).or(kept) else { return };
    if !beside && cx.state.screen.corner.is_none() {
        return;
    }
    let mut rect =
        Rect::from_min_size(pos2(all.right() - MARGIN - LOUPE, all.top() + MARGIN + 6.0), vec2(LOUPE, LOUPE));
    if beside {
        rect = rect.translate(vec2(0.0, (place.rect.top() - rect.top()).clamp(0.0, 6.0)));
    } else {
        // Away from the corner that it shows.
        let at = place.point([corner.px.x, corner.px.y]);
        if at.x > all.center().x {
            rect = rect.translate(vec2(all.left() + MARGIN - rect.left(), 0.0));
        }
        let back = Rect::from_min_max(rect.min - vec2(8.0, 8.0), rect.max + vec2(8.0, 136.0));
        ui.painter().rect_filled(back, 6.0, t.raised);
        ui.painter().rect_stroke(back, 6.0, Stroke::new(1.0, t.line2), egui::StrokeKind::Inside);
    }
    let zoom = f64::from(LOUPE) / ACROSS;
    let size_px = size_of(cx.state, id).unwrap_or([1, 1]);
    let near = Place::around(size_px, rect, zoom, [corner.px.x, corner.px.y]);
    ui.painter().rect_filled(rect, 3.0, t.canvas);
    pixels(cx, ui, id, &near, rect);
    let projected = residual.map(|r| near.point([corner.px.x - r[0], corner.px.y - r[1]]));
    let mark = Mark { detected: near.point([corner.px.x, corner.px.y]), projected };
    marks(&ui.painter_at(rect), &[mark], true, true, 1.8);
    ui.painter().rect_stroke(rect, 3.0, Stroke::new(1.0, t.line2), egui::StrokeKind::Outside);
    let below = Rect::from_min_size(rect.left_bottom() + vec2(0.0, 8.0), vec2(LOUPE, 130.0));
    let mut ui = ui.new_child(egui::UiBuilder::new().id_salt("loupe").max_rect(below));
    values(cx, &mut ui, id, frame, corner, residual);
}

/// The pixels under the loupe alone: the picture itself may be shown with fewer.
fn pixels(cx: &mut Cx<'_>, ui: &Ui, id: FrameId, near: &Place, rect: Rect) {
    let look = cx.state.data.look.as_ref().filter(|l| Kind::of(l.key) == Some(Kind::Look(id)));
    let Some((key, Ok(raster))) = look.map(|l| (l.key, l.raster.clone())) else {
        picture(cx, ui, id, near, rect, false);
        return;
    };
    let [from, to] = [near.pixel(rect.min), near.pixel(rect.max)];
    let span = |axis: usize| {
        let n = raster.size_px[axis];
        let first = (from[axis].floor().max(0.0) as usize).min(n.saturating_sub(1));
        let last = (to[axis].ceil().max(0.0) as usize).min(n.saturating_sub(1));
        [first, last + 1 - first.min(last)]
    };
    let [[x, w], [y, h]] = [span(0), span(1)];
    let texture = cx.textures.part(ui, "loupe", key, &raster, [[x, y], [w, h]]);
    let corner = |x: usize, y: usize| near.point([x as f64 - 0.5, y as f64 - 0.5]);
    let place = Rect::from_min_max(corner(x, y), corner(x + w, y + h));
    ui.painter_at(rect).image(texture.id(), place, WHOLE, Color32::WHITE);
}

fn values(
    cx: &mut Cx<'_>,
    ui: &mut Ui,
    id: FrameId,
    frame: &FrameReport,
    corner: Corner,
    residual: Option<[f64; 2]>,
) {
    let t = cx.t;
    let board = cx.state.data.answer.as_deref().and_then(|a| a.report().settings.board);
    let small = || font::regular(font::SMALL);
    let line = |ui: &mut Ui, left: &str, right: String, dot: Option<Color32>| {
        let (rect, _) = ui.allocate_exact_size(vec2(LOUPE, 18.0), Sense::hover());
        let mut x = rect.left();
        if let Some(color) = dot {
            ui.painter().circle_stroke(pos2(x + 5.0, rect.center().y), 3.4, Stroke::new(1.6, color));
            x += 18.0;
        }
        ui.painter().text(pos2(x, rect.center().y), Align2::LEFT_CENTER, left, small(), t.text2);
        ui.painter().text(rect.right_center(), Align2::RIGHT_CENTER, right, small(), t.ink);
    };
    ui.spacing_mut().item_spacing.y = 0.0;
    ui.horizontal(|ui| {
        ui.label(text(format!("Corner {}", corner.index), font::semibold(font::SMALL), t.ink));
        if let Some(board) = board {
            let [column, row] = board.at(corner.index);
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                ui.label(text(format!("row {row}, column {column}"), small(), t.text3));
            });
        }
    });
    let pair = |x: f64, y: f64| minus(format!("{x:.2}, {y:.2}"));
    line(ui, "detected", pair(corner.px.x, corner.px.y), Some(DETECTED));
    if let Some([dx, dy]) = residual {
        line(ui, "projected", pair(corner.px.x - dx, corner.px.y - dy), Some(PROJECTED));
        line(ui, "residual, px", pair(dx, dy), Some(RESIDUAL));
    }
    ui.add_space(6.0);
    let index = corner.index;
    let outlier = frame.outliers.contains(&index);
    ui.horizontal(|ui| {
        let is_lost = cx.state.doc.dropped.contains(&(id, index));
        if button(ui, t, "", if is_lost { "Restore corner" } else { "Drop corner" }, 22.0).clicked() {
            cx.edit(|d| d.toggle_corner(id, index));
            // The button stays where it is, and takes itself back.
            cx.show(|s| s.corner = Some(index));
        }
        let lost = cx.state.doc.dropped.iter().filter(|(frame, _)| *frame == id).count();
        if lost > 1
            && button(ui, t, "", &format!("All {lost}"), 22.0)
                .on_hover_text("Brings back all dropped corners of this picture")
                .clicked()
        {
            cx.edit(|d| Arc::make_mut(&mut d.dropped).retain(|(frame, _)| *frame != id));
        }
        if outlier {
            ui.label(text("outlier", small(), t.warn));
        }
    });
}
