//! What no corner supports, shaded in the straightened picture, and the α that does not show it.

use std::sync::Arc;

use egui::{Color32, Rect, Shape, Stroke, Ui, pos2};

use crate::{
    app::{cx::Cx, maps::Grid, style::CASING, widgets::WHOLE},
    calib::{
        safe::{Shown, widest_alpha},
        undistort::{Framing, View},
    },
    job::Key,
};

/// Opacity of the shade.
const SHADE: f64 = 110.0;

/// Of an answer and what straightened pictures are to show.
pub(super) struct Safe {
    made_from: (Key, Framing),
    /// 1 where no corner supports what is shown, 0 where one does.
    grid: Grid,
    /// Share of what is shown that no corner supports.
    pub(super) beyond: f64,
    /// The largest α that shows nothing of it.
    pub(super) alpha: Option<f64>,
}

/// Of the present answer, computed once.
pub(super) fn of(cx: &Cx<'_>, ui: &Ui) -> Option<Arc<Safe>> {
    let (answer, solution) = cx.state.data.solved()?;
    let polygon = &solution.safe_region.as_ref()?.polygon_px;
    let made_from = (answer.key, cx.state.doc.framing());
    let id = egui::Id::unique("safe region");
    let known = ui.data(|d| d.get_temp::<Arc<Safe>>(id));
    if let Some(known) = known.as_ref().filter(|k| k.made_from == made_from) {
        return Some(known.clone());
    }
    let camera = &solution.camera;
    let view = View::new(camera, &made_from.1).ok()?;
    let shown = Shown::new(camera, &view, polygon);
    // α is sought anew only where it is another lens or layout.
    let same =
        |k: &&Arc<Safe>| k.made_from.0 == answer.key && k.made_from.1.projection == made_from.1.projection;
    let alpha = match known.as_ref().filter(same) {
        Some(known) => known.alpha,
        None => widest_alpha(camera, &made_from.1, polygon).ok().flatten(),
    };
    let values = shown.safe.iter().map(|safe| safe.map(|safe| f64::from(u8::from(!safe)))).collect();
    let grid = Grid { values, columns: shown.columns };
    let made = Arc::new(Safe { made_from, grid, beyond: shown.unsafe_fraction(), alpha });
    ui.data_mut(|d| d.insert_temp(id, made.clone()));
    Some(made)
}

/// Shades it over the straightened picture in `rect`, of which `clip` is seen.
pub(super) fn shade(cx: &mut Cx<'_>, ui: &Ui, rect: Rect, clip: Rect) {
    let Some(safe) = of(cx, ui).filter(|s| s.beyond > 0.0) else { return };
    let (key, framing) = safe.made_from;
    let made_from =
        key.0 as u64 ^ framing.alpha.to_bits() ^ framing.fov_rad.map_or(0, f64::to_bits).rotate_left(7);
    let image = || safe.grid.image(160, |v| Color32::from_black_alpha((SHADE * v.clamp(0.0, 1.0)) as u8));
    let texture = cx.textures.map(ui, "safe region", made_from, image);
    let painter = ui.painter_at(clip);
    painter.image(texture.id(), rect, WHOLE, Color32::WHITE);
    let place =
        |[x, y]: [f64; 2]| pos2(rect.left() + rect.width() * x as f32, rect.top() + rect.height() * y as f32);
    for [a, b] in safe.grid.contour(0.5) {
        painter.add(Shape::line_segment([place(a), place(b)], Stroke::new(2.4, CASING)));
        painter.add(Shape::line_segment([place(a), place(b)], Stroke::new(1.0, cx.t.warn)));
    }
}
