//! Corners per cell as colours.

use egui::{Rect, Sense, Ui, pos2, vec2};

use crate::app::{
    cx::Cx,
    style::from_map,
    widgets::{color_bar, fit, named},
};

/// Draws the cells with their colour bar into a rectangle.
pub(super) fn show(cx: &Cx<'_>, ui: &Ui, all: Rect, cells: &[Vec<u32>], size_px: [u32; 2]) {
    let t = cx.t;
    let rows = cells.len().max(1);
    let columns = cells.first().map_or(1, Vec::len).max(1);
    let [w, h] = size_px.map(|n| n as f32);
    let map = fit(all.with_max_x(all.right() - 34.0), vec2(w, h));
    let map =
        map.translate(vec2((all.left() - map.left()) * if all.width() < 300.0 { 1.0 } else { 0.0 }, 0.0));
    let most = cells.iter().flatten().copied().max().unwrap_or(1).max(1);
    ui.painter().rect_filled(map, 2.0, t.canvas);
    let size = vec2(map.width() / columns as f32, map.height() / rows as f32);
    for (j, row) in cells.iter().enumerate() {
        for (i, n) in row.iter().enumerate().filter(|(_, n)| **n > 0) {
            let at = map.min + vec2(size.x * i as f32, size.y * j as f32);
            let rect = Rect::from_min_size(at, size).shrink(0.5);
            ui.painter().rect_filled(rect, 1.0, from_map(colorous::CIVIDIS, f64::from(*n) / f64::from(most)));
        }
    }
    let response = ui.interact(map, ui.scope_id().with(("cells", all.width() as i32)), Sense::hover());
    let hit = cells.iter().flatten().filter(|n| **n > 0).count();
    named(
        &response,
        egui::Role::Image,
        true,
        &format!("Corners per cell, up to {most}; {hit} of {} cells hit", rows * columns),
    );
    if let Some(at) = response.hover_pos() {
        let (i, j) = (((at.x - map.left()) / size.x) as usize, ((at.y - map.top()) / size.y) as usize);
        if let Some(n) = cells.get(j).and_then(|r| r.get(i)) {
            response.on_hover_text_at_pointer(crate::calib::number::counted(*n as usize, "corner"));
        }
    }
    let bar = Rect::from_min_size(pos2(map.right() + 8.0, map.top() + 6.0), vec2(8.0, map.height() - 12.0));
    let labels = [(1.0, most.to_string()), (0.0, "1".to_owned())];
    color_bar(ui, t, bar, &labels, |s| from_map(colorous::CIVIDIS, s));
}
