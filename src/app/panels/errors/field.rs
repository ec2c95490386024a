//! Residuals over the picture: what a lens model cannot explain stays as a pattern of arrows.

use egui::{Rect, Sense, Stroke, Ui, pos2, vec2};

use super::NOTHING;
use crate::app::{
    cx::Cx,
    state::State,
    style::{CASING, from_map},
    widgets::{color_bar, empty, fit_top_left, named},
};
use crate::calib::number::significant;

/// Cells along the longer side.
const CELLS: usize = 12;

/// Residuals of a cell of the picture.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Cell {
    /// Corners in it.
    pub(super) n: usize,
    /// Mean residual, px.
    pub(super) mean_px: [f64; 2],
    /// Mean length, px.
    pub(super) length_px: f64,
}

/// Cells of the picture, rows from the top, and how many are in a row.
pub(super) fn data(state: &State) -> Option<(Vec<Cell>, usize)> {
    let (answer, solution) = state.data.solved()?;
    let [w, h] = solution.camera.size_px.map(f64::from);
    let residuals = answer
        .report()
        .included()
        .flat_map(|f| f.corners.iter().zip(&f.residuals_px).map(|(c, r)| ([c.px.x, c.px.y], *r)));
    Some(cells(residuals, [w, h]))
}

fn cells(residuals: impl Iterator<Item = ([f64; 2], [f64; 2])>, [w, h]: [f64; 2]) -> (Vec<Cell>, usize) {
    let [columns, rows] = [w, h].map(|n| (CELLS as f64 * n / w.max(h)).round().max(1.0) as usize);
    let mut cells = vec![Cell::default(); columns * rows];
    for ([x, y], [dx, dy]) in residuals {
        let place =
            |v: f64, size: f64, n: usize| (((v + 0.5) / size * n as f64).max(0.0) as usize).min(n - 1);
        let cell = &mut cells[place(y, h, rows) * columns + place(x, w, columns)];
        cell.n += 1;
        cell.mean_px = [cell.mean_px[0] + dx, cell.mean_px[1] + dy];
        cell.length_px += dx.hypot(dy);
    }
    for cell in cells.iter_mut().filter(|c| c.n > 0) {
        let n = cell.n as f64;
        cell.mean_px = cell.mean_px.map(|v| v / n);
        cell.length_px /= n;
    }
    (cells, columns)
}

/// The map.
pub(super) fn show(cx: &mut Cx<'_>, ui: &mut Ui) {
    let t = cx.t;
    let (Some((cells, columns)), Some((_, solution))) = (data(cx.state), cx.state.data.solved()) else {
        return empty(ui, t, NOTHING);
    };
    let longest =
        cells.iter().filter(|c| c.n > 1).map(|c| c.mean_px[0].hypot(c.mean_px[1])).fold(0.0, f64::max);
    let top = cells.iter().map(|c| c.length_px).fold(0.0, f64::max).max(1e-9);
    let all = ui.available_rect_before_wrap();
    let room = Rect::from_min_max(pos2(all.left(), all.top() + 24.0), pos2(all.right() - 58.0, all.bottom()));
    let [w, h] = solution.camera.size_px.map(|n| n as f32);
    let map = fit_top_left(room, vec2(w, h));
    let side = map.width() / columns as f32;
    // The longest mean reaches over a cell.
    let times = if longest > 0.0 { nice(f64::from(side) / longest) } else { 1.0 };
    super::heading(ui, t, "Over the picture", &format!("mean per cell, arrows ×{times}"));
    ui.painter().rect_filled(map, 0.0, t.canvas);
    let center = |k: usize| {
        map.min + vec2(side * (k % columns) as f32, side * (k / columns) as f32) + vec2(side, side) / 2.0
    };
    for (k, cell) in cells.iter().enumerate().filter(|(_, c)| c.n > 0) {
        let rect = Rect::from_center_size(center(k), vec2(side - 1.0, side - 1.0)).intersect(map);
        ui.painter().rect_filled(rect, 0.0, from_map(colorous::CIVIDIS, cell.length_px / top));
    }
    let scale = times as f32;
    for pass in [true, false] {
        for (k, cell) in cells.iter().enumerate().filter(|(_, c)| c.n > 0) {
            let arrow = vec2(cell.mean_px[0] as f32, cell.mean_px[1] as f32) * scale;
            let stroke = if pass { Stroke::new(3.0, CASING) } else { Stroke::new(1.4, egui::Color32::WHITE) };
            let from = center(k);
            ui.painter().line_segment([from, from + arrow], stroke);
            if arrow.length() > 4.0 && !pass {
                let back = -arrow.normalized() * 4.0;
                for side in [back + back.rot90() * 0.6, back - back.rot90() * 0.6] {
                    ui.painter().line_segment([from + arrow, from + arrow + side], stroke);
                }
            }
        }
    }
    let response = ui.interact(map, ui.scope_id().with("field"), Sense::hover());
    let words = format!("Mean residuals over the picture, up to {longest:.3} px");
    named(&response, egui::Role::Image, true, &words);
    if let Some(at) = response.hover_pos() {
        let k = ((at.y - map.top()) / side) as usize * columns + ((at.x - map.left()) / side) as usize;
        if let Some(cell) = cells.get(k).filter(|c| c.n > 0) {
            response.on_hover_text_at_pointer(format!("{} corners, mean {:.3} px", cell.n, cell.length_px));
        }
    }
    let bar = Rect::from_min_size(pos2(map.right() + 8.0, map.top() + 6.0), vec2(8.0, map.height() - 12.0));
    let labels = [0.0, 0.5, 1.0].map(|s| {
        (s as f32, if s == 1.0 { format!("{} px", significant(top, 2)) } else { significant(s * top, 2) })
    });
    color_bar(ui, t, bar, &labels, |s| from_map(colorous::CIVIDIS, s));
}

/// 1, 2 or 5 times a power of ten, not above.
fn nice(most: f64) -> f64 {
    let power = 10f64.powf(most.log10().floor());
    [5.0, 2.0, 1.0].into_iter().map(|f| f * power).find(|v| *v <= most).unwrap_or(power)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_hold_means() {
        let list = [([0.0, 0.0], [1.0, 0.0]), ([1.0, 1.0], [3.0, 0.0]), ([639.0, 479.0], [0.0, -2.0])];
        let (cells, columns) = cells(list.into_iter(), [640.0, 480.0]);
        assert_eq!((columns, cells.len()), (12, 108));
        assert_eq!(cells[0], Cell { n: 2, mean_px: [2.0, 0.0], length_px: 2.0 });
        assert_eq!(cells[107], Cell { n: 1, mean_px: [0.0, -2.0], length_px: 2.0 });
        assert_eq!([nice(450.0), nice(0.3)], [200.0, 0.2]);
    }
}
