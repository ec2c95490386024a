//! One picture with its layers and a loupe, or all pictures at once.

mod large;
mod sheet;

use egui::Ui;

use super::{Page, Panel, Tile};
use crate::{
    app::{
        cx::Cx,
        picture_view::{Mark, Place, marks},
        plan,
        state::{State, TIMES},
        style::icon,
        widgets::{WHOLE, icon_button, named, toggle},
    },
    calib::{observation::FrameId, report::FrameReport},
};

/// Registered.
pub const PANEL: Panel = Panel {
    tile: Tile::Picture,
    title: "Picture",
    page_title: "",
    caption,
    share: 212.0,
    small,
    pages: &[Page { name: "Picture", show }],
    switches,
};

fn caption(state: &State) -> String {
    state.selected().map(|id| state.name(id)).unwrap_or_default()
}

fn show(cx: &mut Cx<'_>, ui: &mut Ui) {
    if cx.state.screen.sheet { sheet::show(cx, ui) } else { large::show(cx, ui) }
}

fn switches(cx: &mut Cx<'_>, ui: &mut Ui) {
    let t = cx.t;
    let sheet = cx.state.screen.sheet;
    let narrow = ui.available_width() < NARROW;
    if icon_button(ui, t, icon::SHEET, if sheet { "One picture" } else { "All pictures" }, true).clicked() {
        cx.show(|s| s.sheet = !sheet);
    }
    if !sheet && !narrow && icon_button(ui, t, icon::FIT, "Show all of the picture", true).clicked() {
        cx.show(|s| s.view = None);
    }
    if !sheet && !narrow {
        let zoom = ui.data(|d| d.get_temp::<f64>(egui::Id::unique("zoom shown"))).unwrap_or(1.0);
        let pixels = f64::from(ui.pixels_per_point());
        ui.label(crate::app::widgets::text(
            format!("{:.0} %", 100.0 * zoom * pixels),
            crate::app::style::font::regular(crate::app::style::font::BODY),
            t.text3,
        ));
    }
    // From left to right in what is left of the row.
    ui.with_layout(egui::Layout::left_to_right(egui::Align::Center), |ui| head(cx, ui, narrow));
}

/// Below this width the head says the least.
const NARROW: f32 = 620.0;
/// Below this width the layers are a menu.
const NARROW_LAYERS: f32 = 320.0;

fn head(cx: &mut Cx<'_>, ui: &mut Ui, narrow: bool) {
    use crate::app::{style::font, widgets::text};
    let t = cx.t;
    if let Some(id) = cx.state.selected() {
        let at = cx.state.doc.frames.iter().position(|f| f.id == id).map_or(0, |i| i + 1);
        let name = if cx.state.screen.sheet { "All pictures".to_owned() } else { cx.state.name(id) };
        ui.label(text(name, font::semibold(font::BODY), t.ink));
        if !cx.state.screen.sheet && !narrow {
            let of = format!("{at} of {}", cx.state.doc.frames.len());
            ui.label(text(of, font::regular(font::BODY), t.text3));
        }
    }
    ui.add_space(6.0);
    ui.spacing_mut().item_spacing.x = 2.0;
    if ui.available_width() < NARROW_LAYERS {
        ui.menu_button(format!("Layers  {}", icon::CARET_DOWN), |ui| layers(cx, ui));
    } else {
        layers(cx, ui);
    }
}

/// Toggles of what is drawn over the picture.
fn layers(cx: &mut Cx<'_>, ui: &mut Ui) {
    let t = cx.t;
    let layers = cx.state.screen.layers;
    if toggle(ui, t, layers.corners, "Corners").on_hover_text("Detected corners").clicked() {
        cx.show(|s| s.layers.corners = !layers.corners);
    }
    if toggle(ui, t, layers.order, "Order").on_hover_text("The order of the corners on the board").clicked() {
        cx.show(|s| s.layers.order = !layers.order);
    }
    let times = cx.state.times();
    let help = "Where the camera projects the corners; the distance is drawn this many times longer";
    if toggle(ui, t, layers.reprojected, "Reprojected").on_hover_text(help).clicked() {
        cx.show(|s| s.layers.reprojected = !layers.reprojected);
    }
    if layers.reprojected {
        let label = egui::RichText::new(format!("×{times}")).color(t.text3);
        let response = ui.add(egui::Button::new(label).fill(egui::Color32::TRANSPARENT));
        named(&response, egui::Role::Button, true, "Residuals drawn longer");
        egui::Popup::menu(&response).show(|ui| {
            for choice in TIMES {
                if ui.selectable_label(choice == times, format!("×{choice}")).clicked() {
                    cx.show(|s| s.times = Some(choice));
                }
            }
        });
    }
    if toggle(ui, t, layers.straightened, "Straightened").on_hover_text("The lens taken out").clicked() {
        cx.show(|s| s.layers.straightened = !layers.straightened);
    }
}

/// The tile: the picture alone, with its corners.
fn small(cx: &mut Cx<'_>, ui: &mut Ui) {
    let inside = ui.available_rect_before_wrap();
    let Some(id) = cx.state.selected() else { return };
    let Some(place) = draw(cx, ui, id, inside) else { return };
    if let Some(frame) = cx.state.data.answer.as_deref().and_then(|a| a.frame(id)) {
        marks(&ui.painter_at(inside), &marked(frame, &place, 1.0), true, false, 0.45);
    }
}

/// Draws a picture as large as fits: sharp where it is the selected one, else its thumbnail.
fn draw(cx: &mut Cx<'_>, ui: &Ui, id: FrameId, inside: egui::Rect) -> Option<Place> {
    let size_px = size_of(cx.state, id)?;
    let place = Place::fitted(size_px, inside);
    picture(cx, ui, id, &place, inside, false);
    Some(place)
}

/// Size of a picture, where it was read.
fn size_of(state: &State, id: FrameId) -> Option<[u32; 2]> {
    state.data.inspections.get(&id)?.as_ref().ok().map(|i| i.size_px)
}

/// Paints the pixels of a picture at its place.
fn picture(cx: &mut Cx<'_>, ui: &Ui, id: FrameId, place: &Place, clip: egui::Rect, straight: bool) -> bool {
    let painter = ui.painter_at(clip);
    let (shown, name) = if straight {
        (cx.state.data.straight.as_ref(), "straight")
    } else {
        (cx.state.data.look.as_ref(), "look")
    };
    // While a scene changes the picture before the change stays.
    let is_this = cx.state.selected() == Some(id)
        && (straight || shown.is_some_and(|s| plan::Kind::of(s.key) == Some(plan::Kind::Look(id))));
    if let (true, Some(Ok(raster))) = (is_this, shown.map(|s| s.raster.as_ref())) {
        let key = shown.map_or(crate::job::Key(0), |s| s.key);
        let zoom = place.zoom * f64::from(ui.pixels_per_point());
        let texture = cx.textures.large(ui, name, key, raster, zoom);
        painter.image(texture.id(), place.rect, WHOLE, egui::Color32::WHITE);
        return true;
    }
    if let Some(texture) = cx.textures.thumbnail(ui, id, &cx.state.data) {
        painter.image(texture.id(), place.rect, WHOLE, egui::Color32::WHITE);
    }
    false
}

/// Corners of a picture at their place on the screen.
fn marked(frame: &FrameReport, place: &Place, times: f64) -> Vec<Mark> {
    let corners = frame.corners.iter().enumerate();
    corners
        .map(|(i, corner)| Mark {
            detected: place.point([corner.px.x, corner.px.y]),
            projected: frame
                .residuals_px
                .get(i)
                .map(|r| place.point([corner.px.x - times * r[0], corner.px.y - times * r[1]])),
        })
        .collect()
}
