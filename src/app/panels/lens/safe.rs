//! What no corner supports, shaded in the straightened picture, and the α that does not show it.

use std::sync::Arc;

use egui::{Color32, Rect, Shape, Stroke, Ui};
use nalgebra::Vector2;

use crate::{
    app::{cx::Cx, maps::Grid, picture_view::Place, style::CASING, widgets::WHOLE},
    calib::{
        camera::Camera,
        safe::{Shown, widest_alpha},
        undistort::{Framing, View},
    },
    job::Key,
};

/// Opacity of the shade.
const SHADE: f64 = 110.0;
/// Cells of it along the longer side.
const CELLS: usize = 96;

/// Of an answer and what straightened pictures are to show.
pub(super) struct Safe {
    made_from: (Key, Framing),
    /// 1 where no corner supports what is shown, 0 where one does.
    grid: Grid,
    /// Pieces of the border of the safe region, px of the straightened picture; what lies on the border of the photograph is none.
    border: Vec<[[f64; 2]; 2]>,
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
    let shown = Shown::new(camera, &view, polygon, CELLS);
    // α is sought anew only where it is another lens or layout.
    let same =
        |k: &&Arc<Safe>| k.made_from.0 == answer.key && k.made_from.1.projection == made_from.1.projection;
    let alpha = match known.as_ref().filter(same) {
        Some(known) => known.alpha,
        None => widest_alpha(camera, &made_from.1, polygon).ok().flatten(),
    };
    let border = border(camera, &view, polygon);
    let made =
        Arc::new(Safe { made_from, grid: grid(&shown), border, beyond: shown.unsafe_fraction(), alpha });
    ui.data_mut(|d| d.insert_temp(id, made.clone()));
    Some(made)
}

/// Cells beside what is shown take the mean of their neighbours, so that the shade reaches its edge.
fn grid(shown: &Shown) -> Grid {
    let columns = shown.columns as i32;
    let rows = shown.safe.len() as i32 / columns.max(1);
    let at = |i: i32, j: i32| {
        let inside = (0..columns).contains(&i) && (0..rows).contains(&j);
        let safe = if inside { shown.safe[(j * columns + i) as usize] } else { None };
        safe.map(|safe| f64::from(u8::from(!safe)))
    };
    let value = |k: i32| {
        let (i, j) = (k % columns, k / columns);
        at(i, j).or_else(|| {
            let around = (-1..=1).flat_map(|b| (-1..=1).filter_map(move |a| at(i + a, j + b)));
            let (sum, n) = around.fold((0.0, 0.0), |(sum, n), v| (sum + v, n + 1.0));
            (n > 0.0).then(|| sum / n)
        })
    };
    Grid { values: (0..columns * rows).map(value).collect(), columns: shown.columns }
}

fn border(camera: &Camera, view: &View, polygon: &[[f64; 2]]) -> Vec<[[f64; 2]; 2]> {
    let [w, h] = camera.size_px.map(|n| f64::from(n) - 0.5);
    let side = |p: &[f64; 2]| [p[0] <= 0.0, p[1] <= 0.0, p[0] >= w - 0.5, p[1] >= h - 0.5];
    let there = |p: &[f64; 2]| Some(<[f64; 2]>::from(view.pixel(&camera.unproject(&Vector2::from(*p))?)?));
    let next = |k: usize| &polygon[(k + 1) % polygon.len()];
    let pieces = polygon.iter().enumerate().map(|(k, a)| (a, next(k)));
    let inner = pieces.filter(|(a, b)| !side(a).iter().zip(side(b)).any(|(a, b)| *a && b));
    inner.filter_map(|(a, b)| Some([there(a)?, there(b)?])).collect()
}

/// Shades it over the straightened picture in `rect`, of which `clip` is seen.
pub(super) fn shade(cx: &mut Cx<'_>, ui: &Ui, rect: Rect, clip: Rect) {
    let Some(safe) = of(cx, ui).filter(|s| s.beyond > 0.0) else { return };
    let Some(size_px) = cx.state.data.solved().map(|(_, s)| s.camera.size_px) else { return };
    let (key, framing) = safe.made_from;
    let made_from =
        key.0 as u64 ^ framing.alpha.to_bits() ^ framing.fov_rad.map_or(0, f64::to_bits).rotate_left(7);
    let image = || safe.grid.image(160, |v| Color32::from_black_alpha((SHADE * v.clamp(0.0, 1.0)) as u8));
    let texture = cx.textures.map(ui, "safe region", made_from, image);
    let painter = ui.painter_at(clip);
    painter.image(texture.id(), rect, WHOLE, Color32::WHITE);
    let place = Place::covering(rect, size_px);
    for [a, b] in &safe.border {
        let piece = [place.point(*a), place.point(*b)];
        painter.add(Shape::line_segment(piece, Stroke::new(2.4, CASING)));
        painter.add(Shape::line_segment(piece, Stroke::new(1.0, cx.t.warn)));
    }
}
