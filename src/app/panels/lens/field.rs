//! How far the lens moves what it shows: Δx, Δy, length.

use std::sync::Arc;

use egui::{Color32, Rect, Sense, Ui, pos2, vec2};

use super::NOTHING;
use crate::{
    app::{
        cx::Cx,
        maps::{self, Grid},
        plots::Axis,
        style::{font, from_map, signed},
        widgets::{WHOLE, color_bar, empty, fit_top_left, named, segmented, text},
    },
    calib::{camera::Camera, undistort::displacement},
    job::Key,
};

/// Nodes along the longer side.
const NODES: u32 = 64;

/// The three components.
struct Field {
    key: Key,
    grids: [Grid; 3],
    /// Largest length, px.
    largest: f64,
}

fn compute(key: Key, camera: &Camera) -> Option<Field> {
    let step = (camera.size_px[0].max(camera.size_px[1]) / NODES).max(1);
    let d = displacement(camera, step).ok()?;
    let grid = |of: fn([f32; 2]) -> f64| Grid {
        values: d.field.iter().map(|v| v.map(of)).collect(),
        columns: d.nodes[0],
    };
    let grids = [
        grid(|[x, _]| f64::from(x)),
        grid(|[_, y]| f64::from(y)),
        grid(|[x, y]| f64::from(x).hypot(f64::from(y))),
    ];
    Some(Field { key, grids, largest: d.largest_px })
}

/// Of the present answer, computed once.
fn field(cx: &Cx<'_>, ui: &Ui) -> Option<Arc<Field>> {
    let (answer, solution) = cx.state.data.solved()?;
    let id = egui::Id::unique("displacement");
    if let Some(known) = ui.data(|d| d.get_temp::<Arc<Field>>(id)).filter(|f| f.key == answer.key) {
        return Some(known);
    }
    let made = Arc::new(compute(answer.key, &solution.camera)?);
    ui.data_mut(|d| d.insert_temp(id, made.clone()));
    Some(made)
}

/// The map.
pub(super) fn show(cx: &mut Cx<'_>, ui: &mut Ui) {
    let t = cx.t;
    let (Some(field), Some((_, solution))) = (field(cx, ui), cx.state.data.solved()) else {
        return empty(ui, t, NOTHING);
    };
    let [w, h] = solution.camera.size_px.map(|n| n as f32);
    let all = ui.available_rect_before_wrap();
    let component = cx.state.screen.component.min(2);
    ui.horizontal(|ui| {
        ui.label(text("Displacement", font::semibold(font::SMALL), t.ink));
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            ui.horizontal(|ui| {
                if let Some(i) = segmented(ui, t, &["Δx", "Δy", "length"], component) {
                    cx.show(|s| s.component = i);
                }
            });
        });
    });
    let room =
        Rect::from_min_max(pos2(all.left(), all.top() + 30.0), pos2(all.right() - 60.0, all.bottom() - 18.0));
    let map = fit_top_left(room, vec2(w, h));
    let grid = &field.grids[component];
    let most = if component == 2 {
        field.largest
    } else {
        grid.values.iter().flatten().fold(0.0f64, |m, v| m.max(v.abs()))
    }
    .max(1e-9);
    let color =
        |v: f64| if component == 2 { from_map(colorous::VIRIDIS, v / most) } else { signed(t, v / most) };
    ui.painter().rect_filled(map, 0.0, t.canvas);
    let names = ["displacement x", "displacement y", "displacement length"];
    let made_from = field.key.0 as u64 ^ u64::from(ui.visuals().dark_mode);
    let texture = cx.textures.map(ui, names[component], made_from, || grid.image(160, color));
    ui.painter().image(texture.id(), map, WHOLE, Color32::WHITE);
    let scale = Axis::new(if component == 2 { 0.0 } else { -most }, most, 5, "px");
    let levels: Vec<(f64, String)> =
        scale.ticks.iter().filter(|v| v.abs() > 1e-9).map(|v| (*v, scale.label(*v))).collect();
    maps::contours(ui, map, grid, &levels);
    let bar = Rect::from_min_size(pos2(map.right() + 8.0, map.top() + 6.0), vec2(8.0, map.height() - 12.0));
    let low = if component == 2 { 0.0 } else { -most };
    let labels: Vec<(f32, String)> = scale
        .ticks
        .iter()
        .map(|v| {
            let last = scale.ticks.last() == Some(v);
            let label = if last { format!("{} px", scale.label(*v)) } else { scale.label(*v) };
            (((v - low) / (most - low)) as f32, label)
        })
        .collect();
    color_bar(ui, t, bar, &labels, |s| color(low + s * (most - low)));
    let response = ui.interact(map, ui.scope_id().with("displacement"), Sense::hover());
    let words = format!("{}, up to {most:.1} px", names[component]);
    named(&response, egui::Role::Image, true, &words);
    let small = font::regular(font::CAPTION);
    let at = map.left_bottom() + vec2(0.0, 4.0);
    ui.painter().text(
        at,
        egui::Align2::LEFT_TOP,
        "px a point moves when the lens is removed",
        small,
        t.text3,
    );
}
