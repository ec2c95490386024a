//! How straightened pictures are laid out: a choice where the lens is wide.

use egui::Ui;
use nalgebra::Vector2;

use crate::app::{
    cx::Cx,
    style::font,
    widgets::{segmented, text},
};
use crate::calib::{camera::Camera, undistort::Projection};

/// Angle off the axis beyond which a flat picture stretches what it shows by more than a half.
const WIDE_RAD: f64 = 50.0 / 180.0 * std::f64::consts::PI;
/// Height of the choice.
pub(super) const HEIGHT: f32 = 48.0;

/// Whether there is something to choose: a corner of the picture looks far off the axis, or another projection was chosen before.
pub(super) fn offered(chosen: Projection, camera: &Camera) -> bool {
    let [w, h] = camera.size_px.map(|n| f64::from(n) - 1.0);
    let wide = |[x, y]: [f64; 2]| match camera.unproject(&Vector2::new(x, y)) {
        Some(ray) => ray.x.hypot(ray.y).atan2(ray.z) > WIDE_RAD,
        None => !camera.spec().perspective,
    };
    chosen != Projection::default() || [[0.0, 0.0], [w, 0.0], [0.0, h], [w, h]].into_iter().any(wide)
}

/// The widest picture that is offered, degrees: a flat one of 150° is nearly all border.
pub(super) const fn widest_deg(projection: Projection) -> f64 {
    match projection {
        Projection::Perspective => 150.0,
        _ => 300.0,
    }
}

/// The choice, and what the chosen one keeps.
pub(super) fn show(cx: &mut Cx<'_>, ui: &mut Ui) {
    let t = cx.t;
    let chosen = cx.state.doc.projection;
    let names = Projection::ALL.map(|p| p.spec().title);
    let on = Projection::ALL.iter().position(|p| *p == chosen).unwrap_or(0);
    ui.horizontal(|ui| {
        if let Some(projection) = segmented(ui, t, &names, on).and_then(|i| Projection::ALL.get(i)) {
            cx.edit(|d| {
                d.projection = *projection;
                // What one can show, another may not.
                d.fov_deg = d.fov_deg.filter(|fov| *fov <= widest_deg(*projection));
            });
        }
    });
    ui.add(egui::Label::new(text(chosen.spec().explained, font::regular(font::SMALL), t.text2)).truncate());
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calib::camera::Model;

    #[test]
    fn a_choice_is_offered_where_the_lens_is_wide() {
        let camera = |model, params: &[f64]| Camera::new(model, [640, 480], params.to_vec()).unwrap();
        let narrow = camera(Model::Pinhole, &[600.0, 600.0, 319.5, 239.5]);
        assert!(!offered(Projection::Perspective, &narrow));
        assert!(offered(Projection::Stereographic, &narrow));
        let wide = camera(Model::Kb4, &[200.0, 200.0, 319.5, 239.5, 0.0, 0.0, 0.0, 0.0]);
        assert!(offered(Projection::Perspective, &wide));
        // A perspective lens whose corners fold is not wide.
        let folding = camera(Model::Radial1, &[600.0, 600.0, 319.5, 239.5, -0.9]);
        assert!(!offered(Projection::Perspective, &folding));
    }
}
