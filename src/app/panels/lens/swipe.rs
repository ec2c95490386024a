//! Before and after: under one line that is dragged, or beside each other.

use egui::{Align2, Color32, CursorIcon, Rect, Sense, Shape, Stroke, Ui, pos2, vec2};

use super::NOTHING;
use crate::app::{
    cx::Cx,
    picture_view::Place,
    plan::Kind,
    style::CASING,
    widgets::{WHOLE, empty, named, plate},
};

/// Both pictures on the graphics card: before, after.
fn textures(cx: &mut Cx<'_>, ui: &Ui, zoom: f64) -> [Option<egui::TextureId>; 2] {
    let state = cx.state;
    let mut load = |shown: Option<&crate::app::state::Shown>, name: &'static str| {
        let shown = shown?;
        let raster = shown.raster.as_ref().ok()?;
        Some(cx.textures.large(ui, name, shown.key, raster, zoom * f64::from(ui.pixels_per_point())).id())
    };
    let current = state.selected().map(Kind::Look);
    let look =
        state.data.look.as_ref().filter(|l| Kind::of(l.key) == current || state.data.straight.is_some());
    [load(look, "look"), load(state.data.straight.as_ref(), "straight")]
}

/// Draws both under a line; answers where the picture is.
pub(super) fn show(cx: &mut Cx<'_>, ui: &mut Ui, inside: Rect, salt: &str) -> Option<Rect> {
    let (_, solution) = cx.state.data.solved()?;
    let size_px = solution.camera.size_px;
    let place = Place::fitted(size_px, inside);
    let mut rect = place.rect;
    if salt == "page" {
        rect = rect.translate(inside.min - rect.min);
    }
    let place = Place { rect, ..place };
    let [before, after] = textures(cx, ui, place.zoom);
    ui.painter().rect_filled(rect, 2.0, cx.t.canvas);
    let Some(after) = after else {
        let why =
            cx.state.data.straight.as_ref().and_then(|s| s.raster.as_ref().err().map(ToString::to_string));
        empty(
            &mut crate::app::panels::part(ui, "why", rect),
            cx.t,
            &why.unwrap_or_else(|| "Straightening…".to_owned()),
        );
        return Some(rect);
    };
    let x = rect.left() + rect.width() * cx.state.screen.swipe;
    if let Some(before) = before {
        ui.painter_at(rect.with_max_x(x)).image(before, rect, WHOLE, Color32::WHITE);
    }
    ui.painter_at(rect.with_min_x(x)).image(after, rect, WHOLE, Color32::WHITE);
    if salt == "page" {
        super::safe::shade(cx, ui, rect, rect.with_min_x(x));
    }
    if let Some(valid) = cx.state.data.straight.as_ref().and_then(|s| s.valid).filter(|_| salt == "page") {
        let edge = |x: u32, y: u32| place.point([f64::from(x) - 0.5, f64::from(y) - 0.5]);
        let (l, t, r, b) = (valid.x, valid.y, valid.x + valid.width, valid.y + valid.height);
        let path = [edge(l, t), edge(r, t), edge(r, b), edge(l, b), edge(l, t)];
        let clip = ui.painter_at(rect);
        clip.add(Shape::line(path.to_vec(), Stroke::new(3.0, CASING)));
        clip.extend(Shape::dashed_line(&path, Stroke::new(1.6, Color32::WHITE), 6.0, 4.0));
    }
    ui.painter().vline(x, rect.y_range(), Stroke::new(4.0, CASING));
    ui.painter().vline(x, rect.y_range(), Stroke::new(1.6, Color32::WHITE));
    let handle = Rect::from_center_size(pos2(x, rect.center().y), vec2(18.0, 22.0));
    ui.painter().rect_filled(handle, 5.0, Color32::WHITE);
    for (dx, tip) in [(-2.5, -4.0), (2.5, 4.0)] {
        let c = handle.center();
        let points = vec![c + vec2(dx, -3.5), c + vec2(dx + tip * 0.8, 0.0), c + vec2(dx, 3.5)];
        ui.painter().add(Shape::line(points, Stroke::new(1.4, Color32::from_gray(30))));
    }
    let grip = ui.interact(
        handle.expand2(vec2(8.0, rect.height() / 2.0)).intersect(rect),
        ui.scope_id().with(("swipe", salt)),
        Sense::drag(),
    );
    let share = f64::from(cx.state.screen.swipe);
    grip.widget_info(|| egui::WidgetInfo::slider(true, share, "Before and after"));
    if grip.dragged()
        && let Some(at) = grip.interact_pointer_pos()
    {
        cx.show(|s| s.swipe = ((at.x - rect.left()) / rect.width()).clamp(0.0, 1.0));
    }
    grip.on_hover_cursor(CursorIcon::ResizeHorizontal);
    plate(ui.painter(), rect, rect.left_top() + vec2(6.0, 6.0), Align2::LEFT_TOP, "before");
    plate(ui.painter(), rect, rect.right_top() + vec2(-6.0, 6.0), Align2::RIGHT_TOP, "after");
    Some(rect)
}

/// Both beside each other.
pub(super) fn beside(cx: &mut Cx<'_>, ui: &mut Ui) {
    let t = cx.t;
    let Some((_, solution)) = cx.state.data.solved() else { return empty(ui, t, NOTHING) };
    let size_px = solution.camera.size_px;
    let all = ui.available_rect_before_wrap();
    let middle = all.center().x;
    let both = [all.with_max_x(middle - 6.0), all.with_min_x(middle + 6.0)];
    let textures = textures(cx, ui, Place::fitted(size_px, both[0]).zoom);
    for ((half, texture), name) in both.into_iter().zip(textures).zip(["before", "after"]) {
        let place = Place::fitted(size_px, half);
        ui.painter().rect_filled(place.rect, 2.0, t.canvas);
        let response = ui.interact(place.rect, ui.scope_id().with(name), Sense::hover());
        named(&response, egui::Role::Image, true, &format!("The picture {name} straightening"));
        if let Some(texture) = texture {
            ui.painter().image(texture, place.rect, WHOLE, Color32::WHITE);
            if name == "after" {
                super::safe::shade(cx, ui, place.rect, place.rect);
            }
        }
        plate(ui.painter(), place.rect, place.rect.left_top() + vec2(6.0, 6.0), Align2::LEFT_TOP, name);
    }
}
