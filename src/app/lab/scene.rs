//! What is photographed: camera, boards, and what spoils the pictures.

use std::{ops::RangeInclusive, sync::Arc};

use egui::{Response, Slider, Ui};

use crate::{
    app::{
        action::{Action, Command, demo},
        cx::Cx,
        export::Content,
        files::tell_bad,
        state::{Document, Frame},
        style::font,
        widgets::{begins, minus, primary, text},
    },
    calib::{
        number::significant,
        synth::{Cut, Degrade, Method, Origin, Scene, poses},
    },
    job::Source,
};

/// A degradation with a slider: name, unit, range, where it is.
type Spoiler = (&'static str, &'static str, RangeInclusive<f64>, fn(&mut Degrade) -> &mut f64);

const SPOILERS: [Spoiler; 9] = [
    ("Noise", "levels, 1 σ", 0.0..=40.0, |d| &mut d.noise),
    ("Shot noise", "levels on white", 0.0..=40.0, |d| &mut d.shot),
    ("Defocus", "px, 1 σ", 0.0..=5.0, |d| &mut d.blur),
    ("Motion", "px", 0.0..=20.0, |d| &mut d.motion),
    ("Contrast", "of the full one", 0.05..=1.0, |d| &mut d.contrast),
    ("Uneven light", "share lost", 0.0..=0.9, |d| &mut d.light),
    ("Vignetting", "share lost", 0.0..=0.9, |d| &mut d.vignette),
    ("Covered", "share of the board", 0.0..=0.6, |d| &mut d.occlusion),
    ("Board bent", "mm", -5.0..=5.0, |d| &mut d.bend),
];

/// How squares are drawn: name, method, what it means.
const METHODS: [(&str, Method, &str); 3] = [
    (
        "Exact",
        Method::Exact,
        "The mean over each pixel's area, through the whole camera model: what a sensor sees.",
    ),
    (
        "Crude, cut",
        Method::Crude(Cut::Truncate),
        "A polygon per square whose vertices are cut to whole pixels, as the document's script draws them. Corners then lie off by \
         up to a pixel: its 0.48 px are the error of the drawing, not of the camera.",
    ),
    (
        "Crude, rounded",
        Method::Crude(Cut::Round),
        "The same with vertices rounded to the nearest pixel: half a pixel at most, and no common shift.",
    ),
];

pub(super) fn show(cx: &mut Cx<'_>, ui: &mut Ui) {
    let t = cx.t;
    let Some(scene) = cx.state.doc.scene().cloned() else {
        ui.label(text(
            "The lab photographs a board with a camera that is known exactly. What is open here are photographs.",
            font::regular(font::BODY),
            t.text2,
        ));
        ui.add_space(8.0);
        if primary(ui, t, "", "Open the built-in scene", 26.0).clicked() {
            cx.push(Action::Open(demo()));
        }
        return;
    };
    ui.spacing_mut().slider_width = 120.0;
    let mut edit = Edit { scene: Scene::clone(&scene), begins: false, changed: false };
    outcome(cx, ui);
    heading(cx, ui, "Drawing");
    drawing(cx, ui, &mut edit);
    heading(cx, ui, "Pictures");
    for (name, unit, range, of) in SPOILERS {
        edit.slider(ui, name, unit, range, |s| of(&mut s.degrade));
    }
    jpeg(ui, &mut edit);
    heading(cx, ui, "Camera");
    camera(ui, &mut edit);
    heading(cx, ui, "Boards");
    boards(cx, ui, &mut edit);
    ui.add_space(8.0);
    ui.horizontal(|ui| {
        if ui.button("As built in").clicked() {
            edit.step(|s| *s = Scene::seed());
        }
        if ui.button("Save scene…").clicked() {
            let content = Content::bytes(edit.scene.to_json().into_bytes());
            cx.ask(Command::Save { name: "scene.json".to_owned(), content });
        }
    });
    edit.finish(cx);
}

/// The scene as the widgets leave it.
struct Edit {
    scene: Scene,
    /// Whether this is a step of undo.
    begins: bool,
    changed: bool,
}

impl Edit {
    /// A change at one stroke.
    fn step(&mut self, change: impl FnOnce(&mut Scene)) {
        change(&mut self.scene);
        (self.begins, self.changed) = (true, true);
    }

    fn slider(
        &mut self,
        ui: &mut Ui,
        name: &str,
        unit: &str,
        range: RangeInclusive<f64>,
        of: impl Fn(&mut Scene) -> &mut f64,
    ) {
        let mut value = *of(&mut self.scene);
        // What was set elsewhere may lie outside.
        let range = range.start().min(value)..=range.end().max(value);
        ui.horizontal(|ui| {
            let place = egui::Layout::left_to_right(egui::Align::Center);
            let label = ui.allocate_ui_with_layout(egui::vec2(86.0, 20.0), place, |ui| {
                ui.set_min_width(86.0);
                ui.label(name)
            });
            let response = ui.add(Slider::new(&mut value, range).max_decimals(4)).labelled_by(label.inner.id);
            ui.label(egui::RichText::new(unit).weak());
            if self.moved(ui, &response) {
                *of(&mut self.scene) = value;
            }
        });
    }

    /// Whether a slider was moved.
    fn moved(&mut self, ui: &Ui, response: &Response) -> bool {
        self.begins |= begins(ui, response);
        self.changed |= response.changed();
        response.changed()
    }

    /// The pictures of the scene take the place of those before; each keeps its number.
    fn finish(self, cx: &mut Cx<'_>) {
        if !self.changed {
            return;
        }
        match self.scene.validate() {
            Ok(()) => cx.drag(self.begins, |doc| photograph(doc, self.scene)),
            Err(error) => cx.push(tell_bad(error.to_string())),
        }
    }
}

/// Makes the views of a scene the pictures of a document.
fn photograph(doc: &mut Document, scene: Scene) {
    let scene = Arc::new(scene);
    let old: Vec<_> = doc.frames.iter().map(|f| f.id).collect();
    let frames = (0..scene.poses.len()).map(|view| {
        let id = old.get(view).copied().unwrap_or_else(|| doc.new_id());
        Frame { id, source: Source::View { scene: scene.clone(), view } }
    });
    doc.frames = Arc::new(frames.collect());
}

fn heading(cx: &Cx<'_>, ui: &mut Ui, name: &str) {
    ui.add_space(8.0);
    ui.label(text(name, font::semibold(font::BODY), cx.t.ink));
}

/// What came of it, beside the truth.
fn outcome(cx: &Cx<'_>, ui: &mut Ui) {
    let t = cx.t;
    let Some((_, solution)) = cx.state.data.solved() else { return };
    let worst = solution.truth.iter().filter_map(|c| c.in_sigma.map(|s| (s.abs(), c.name.as_str())));
    let worst = worst.max_by(|a, b| a.0.total_cmp(&b.0));
    let mut words = format!("Fit {} px RMS", significant(solution.rms_px, 2));
    if let Some(corners) = &solution.truth_corners {
        words += &format!(", corners {} px RMS from the truth", significant(corners.rms, 2));
    }
    if let Some((sigma, name)) = worst {
        words += &format!(", {name} off by {} σ", significant(sigma, 2));
    }
    ui.label(text(minus(words + "."), font::medium(font::SMALL), t.text2));
}

fn drawing(cx: &Cx<'_>, ui: &mut Ui, edit: &mut Edit) {
    let now = edit.scene.method;
    ui.horizontal(|ui| {
        for (name, method, _) in METHODS {
            if ui.radio(now == method, name).clicked() && now != method {
                edit.step(|s| s.method = method);
            }
        }
    });
    for (_, _, meaning) in METHODS.iter().filter(|m| m.1 == now) {
        ui.label(text(*meaning, font::regular(font::SMALL), cx.t.text3));
    }
}

fn jpeg(ui: &mut Ui, edit: &mut Edit) {
    ui.horizontal(|ui| {
        let mut on = edit.scene.degrade.jpeg.is_some();
        let mut quality = edit.scene.degrade.jpeg.unwrap_or(60);
        ui.allocate_ui(egui::vec2(86.0, 20.0), |ui| {
            ui.set_min_width(86.0);
            if ui.checkbox(&mut on, "JPEG").changed() {
                edit.step(|s| s.degrade.jpeg = on.then_some(quality));
            }
        });
        let response = ui.add_enabled(on, Slider::new(&mut quality, 5..=100));
        super::super::widgets::named(&response, egui::Role::Slider, on, "JPEG quality");
        ui.label(egui::RichText::new("quality").weak());
        if edit.moved(ui, &response) {
            edit.scene.degrade.jpeg = Some(quality);
        }
    });
}

fn camera(ui: &mut Ui, edit: &mut Edit) {
    let [w, h] = edit.scene.camera.size_px.map(f64::from);
    for (i, param) in edit.scene.camera.spec().params.iter().enumerate() {
        let range = match param.name {
            "fx" | "fy" => 0.4 * w..=4.0 * w,
            "cx" => 0.3 * w..=0.7 * w,
            "cy" => 0.3 * h..=0.7 * h,
            "p1" | "p2" => -0.01..=0.01,
            _ => -0.5..=0.5,
        };
        edit.slider(ui, param.name, param.unit, range, |s| &mut s.camera.params[i]);
    }
}

fn boards(cx: &Cx<'_>, ui: &mut Ui, edit: &mut Edit) {
    let id = egui::Id::unique("random views");
    let mut n = ui.data(|d| d.get_temp::<usize>(id)).unwrap_or(edit.scene.poses.len());
    ui.horizontal(|ui| {
        let label = ui.label("Random views");
        if ui.add(egui::DragValue::new(&mut n).range(3..=200)).labelled_by(label.id).changed() {
            ui.data_mut(|d| d.insert_temp(id, n));
        }
        if ui.button("Draw").on_hover_text("Poses by the rules of the document's Section IV-B").clicked() {
            let seed = edit.scene.seed + 1;
            // A scene without room for its board keeps its poses; the message comes with the check of the scene.
            if let Ok(drawn) = poses::random(n, &edit.scene.camera, &edit.scene.board, seed) {
                edit.step(|s| (s.poses, s.seed) = (drawn, seed));
            }
        }
    });
    let mut outer = edit.scene.board.origin == Origin::Outer;
    let says = "Table II fits the outer corner, its text says the first inner one";
    if ui.checkbox(&mut outer, "Poses place the outer corner").on_hover_text(says).changed() {
        edit.step(|s| s.board.origin = if outer { Origin::Outer } else { Origin::FirstInner });
    }
    let selected = cx.state.selected();
    let view = cx.state.doc.frames.iter().position(|f| Some(f.id) == selected).unwrap_or(0);
    if view >= edit.scene.poses.len() {
        return;
    }
    ui.label(text(
        format!("The board in {}", cx.state.name(cx.state.doc.frames[view].id)),
        font::regular(font::SMALL),
        cx.t.text3,
    ));
    for (i, name) in ["About x", "About y", "About z"].into_iter().enumerate() {
        let range = if i == 2 { -180.0..=180.0 } else { -70.0..=70.0 };
        edit.slider(ui, name, "°", range, |s| &mut s.poses[view].angles_deg[i]);
    }
    let unit = edit.scene.board.unit.name();
    let far = edit.scene.poses[view].translation[2].abs().max(100.0);
    for (i, name) in ["Right", "Down", "Away"].into_iter().enumerate() {
        let range = if i == 2 { 0.3 * far..=2.0 * far } else { -0.6 * far..=0.6 * far };
        edit.slider(ui, name, unit, range, |s| &mut s.poses[view].translation[i]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calib::observation::FrameId;

    #[test]
    fn views_keep_their_numbers_and_new_ones_get_new_numbers() {
        let mut doc = Document { next_id: 7, ..Document::default() };
        let of = |n: usize| {
            let mut scene = Scene::seed();
            scene.poses.truncate(n);
            scene
        };
        photograph(&mut doc, of(2));
        let ids = |doc: &Document| doc.frames.iter().map(|f| f.id).collect::<Vec<_>>();
        assert_eq!(ids(&doc), [FrameId(7), FrameId(8)]);
        photograph(&mut doc, of(3));
        assert_eq!(ids(&doc), [FrameId(7), FrameId(8), FrameId(9)]);
        assert!(doc.scene().is_some_and(|s| s.poses.len() == 3) && doc.next_id == 10);
    }
}
