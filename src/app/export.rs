//! Export: the camera for the tool that is used, straightened pictures and figures, the report.

mod content;
mod figures;
#[cfg_attr(not(target_arch = "wasm32"), path = "export/png_native.rs")]
#[cfg_attr(target_arch = "wasm32", path = "export/png_web.rs")]
mod png;
mod snippet;

use std::sync::Arc;

use egui::{Ui, vec2};

use super::{
    action::Command,
    cx::Cx,
    screen::{Dialog, ExportPart},
    state::Answer,
    style::{font, icon},
    widgets::{button, primary, segmented, text},
};
use crate::{
    calib::{
        Result,
        format::{self, Evidence, Export, FORMATS},
        number::within_px,
        stmap::{Storage, Way},
    },
    job::Key,
};
pub use content::{Content, Map};
use figures::{FIGURES, Figure, Kind};

/// Height of the part below the head.
const BODY: f32 = 380.0;

/// A camera file as it would be written.
#[derive(Clone, Debug, PartialEq)]
pub struct Preview {
    /// Proposed file name.
    pub name: String,
    /// Its text.
    pub text: String,
    /// What the user should know, the check first.
    pub notes: Vec<String>,
}

/// The text of a format, by its place in [`FORMATS`]; one past the end is the Python snippet.
///
/// # Errors
/// Those of [`format::write`].
pub fn preview(answer: &Answer, index: usize) -> Result<Option<Preview>> {
    let Some(solution) = answer.solution() else { return Ok(None) };
    let Some(format) = FORMATS.get(index) else {
        let notes =
            vec!["A script that straightens one picture with OpenCV; the numbers are exact.".to_owned()];
        return Ok(Some(Preview {
            name: "undistort.py".to_owned(),
            text: snippet::python(&solution.camera),
            notes,
        }));
    };
    let report = answer.report();
    let export = Export { camera: &solution.camera, evidence: &Evidence::from(report), report: Some(report) };
    let written = format::write(format, &export)?;
    let mut notes = vec![
        format!("Read back, it projects {}.", within_px(written.self_check_px)),
        format.convention.to_owned(),
    ];
    if !format.lacks.starts_with("nothing") {
        notes.push(format!("It cannot hold {}.", format.lacks));
    }
    notes.extend(written.notes);
    let extension = format.usual.first().copied().unwrap_or("txt");
    let name = format!("{}.{extension}", format.stem);
    Ok(Some(Preview { name, text: written.text, notes }))
}

/// Draws the dialog.
pub fn show(cx: &mut Cx<'_>, ui: &mut Ui, part: ExportPart, format: usize) {
    let t = cx.t;
    let Some(answer) = cx.state.data.answer.clone().filter(|a| a.solution().is_some()) else {
        ui.label("There is no camera to export.");
        return;
    };
    let screen = ui.ctx().content_rect();
    ui.set_width((screen.width() - 80.0).min(760.0));
    let parts = [ExportPart::Camera, ExportPart::Pictures, ExportPart::Report];
    ui.horizontal(|ui| {
        ui.label(text("Export", font::semibold(font::LEAD), t.ink));
        ui.add_space(12.0);
        let on = parts.iter().position(|p| *p == part).unwrap_or(0);
        if let Some(i) = segmented(ui, t, &["Camera", "Pictures", "Report"], on) {
            cx.show(|s| s.dialog = Some(Dialog::Export { part: parts[i], format }));
        }
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            if ui.button("Close").clicked() {
                ui.close();
            }
        });
    });
    ui.add_space(8.0);
    let height = BODY.min(screen.height() - 160.0);
    let size = vec2(ui.available_width(), height);
    ui.allocate_ui(size, |ui| {
        ui.set_min_size(size);
        match part {
            ExportPart::Camera => camera(cx, ui, &answer, format),
            ExportPart::Pictures => pictures(cx, ui, &answer),
            ExportPart::Report => report(cx, ui, &answer),
        }
    });
}

/// Height of three lines of notes.
const NOTES: f32 = 58.0;

/// A preview, made once.
fn known(ui: &Ui, answer: &Answer, index: usize) -> Arc<Result<Option<Preview>>> {
    type Known = (Key, usize, Arc<Result<Option<Preview>>>);
    let id = egui::Id::unique("export preview");
    if let Some((key, i, made)) = ui.data(|d| d.get_temp::<Known>(id))
        && (key, i) == (answer.key, index)
    {
        return made;
    }
    let made = Arc::new(preview(answer, index));
    ui.data_mut(|d| d.insert_temp::<Known>(id, (answer.key, index, made.clone())));
    made
}

fn camera(cx: &mut Cx<'_>, ui: &mut Ui, answer: &Answer, format: usize) {
    let t = cx.t;
    let height = ui.available_height();
    ui.horizontal_top(|ui| {
        ui.vertical(|ui| {
            ui.set_width(180.0);
            ui.spacing_mut().item_spacing.y = 1.0;
            let names = FORMATS.iter().map(|f| f.title).chain(["OpenCV-Python"]);
            for (i, name) in names.enumerate() {
                let wide = vec2(180.0, 24.0);
                let label = egui::Button::selectable(i == format, name).min_size(wide);
                if ui.add(label).clicked() {
                    cx.show(|s| s.dialog = Some(Dialog::Export { part: ExportPart::Camera, format: i }));
                }
            }
        });
        ui.add_space(8.0);
        ui.vertical(|ui| match known(ui, answer, format).as_ref() {
            Ok(Some(preview)) => {
                egui::Frame::new().fill(t.bg).corner_radius(4.0).inner_margin(8.0).show(ui, |ui| {
                    let area = egui::ScrollArea::both().auto_shrink(false).max_height(height - 130.0);
                    area.show(ui, |ui| {
                        // A report has a million letters; nobody reads them here.
                        let short: String = preview.text.lines().take(400).flat_map(|l| [l, "\n"]).collect();
                        ui.add(
                            egui::Label::new(text(short, font::mono(font::SMALL), t.text2))
                                .extend()
                                .selectable(true),
                        );
                    });
                });
                ui.add_space(4.0);
                // As high for every format, or the buttons would jump away from under the pointer.
                ui.vertical(|ui| {
                    ui.set_min_height(NOTES);
                    for note in &preview.notes {
                        ui.label(text(note.as_str(), font::regular(font::SMALL), t.text2));
                    }
                });
                ui.add_space(4.0);
                ui.horizontal(|ui| {
                    if primary(ui, t, icon::SAVE, "Save…", 26.0).clicked() {
                        let content = Content::bytes(preview.text.clone().into_bytes());
                        cx.ask(Command::Save { name: preview.name.clone(), content });
                    }
                    if button(ui, t, icon::COPY, "Copy", 26.0).clicked() {
                        cx.ask(Command::Copy(preview.text.clone()));
                    }
                });
            }
            Ok(None) => {}
            Err(error) => {
                ui.label(text(error.to_string(), font::regular(font::BODY), t.bad));
            }
        });
    });
}

fn pictures(cx: &mut Cx<'_>, ui: &mut Ui, answer: &Answer) {
    let t = cx.t;
    let body = |s: &str| text(s, font::regular(font::SMALL), t.text2);
    ui.label(text("Straightened pictures", font::semibold(font::BODY), t.ink));
    let words = format!(
        "Every picture with the lens taken out, {}, {} (Lens page). Names, depth and metadata are kept; the pictures themselves are not touched.",
        cx.state.doc.projection,
        cx.state.doc.extent()
    );
    ui.label(body(&words));
    ui.add_space(4.0);
    if cx.state.doc.scene().is_some() {
        ui.label(body("The demo's pictures are rendered in memory; open a folder to straighten its files."));
    } else if primary(ui, t, icon::IMAGES, "Straighten all…", 26.0).clicked() {
        cx.ask(Command::StraightenAll);
    }
    ui.add_space(16.0);
    ui.label(text("Maps for compositing programs", font::semibold(font::BODY), t.ink));
    ui.label(body("STMaps: one takes the lens out of a picture, the other puts it back. Laid out as the straightened pictures."));
    ui.add_space(4.0);
    ui.horizontal(|ui| maps(cx, ui, answer));
    ui.add_space(16.0);
    ui.label(text("Figures", font::semibold(font::BODY), t.ink));
    let id = egui::Id::unique("kind of figures");
    let mut kind = ui.data(|d| d.get_temp::<Kind>(id)).unwrap_or_default();
    ui.horizontal(|ui| {
        ui.label(body("For a paper or a report, as"));
        let on = usize::from(kind == Kind::Png);
        if let Some(chosen) = segmented(ui, t, &["SVG", "PNG"], on) {
            kind = if chosen == 1 { Kind::Png } else { Kind::Svg };
            ui.data_mut(|d| d.insert_temp(id, kind));
        }
    });
    ui.add_space(4.0);
    let Some(solution) = answer.solution() else { return };
    let file = |figure: &Figure| figure.file(answer.report(), solution, kind);
    ui.horizontal_wrapped(|ui| {
        for figure in FIGURES {
            if button(ui, t, "", &format!("{}…", figure.name), 24.0).clicked() {
                let (name, content) = file(figure);
                cx.ask(Command::Save { name, content });
            }
        }
    });
    ui.add_space(4.0);
    if button(ui, t, icon::SAVE, "Save all figures…", 26.0).clicked() {
        cx.ask(Command::SaveAll(FIGURES.iter().map(file).collect()));
    }
}

/// Both maps, as EXR and as PNG.
fn maps(cx: &mut Cx<'_>, ui: &mut Ui, answer: &Answer) {
    let Some(solution) = answer.solution() else { return };
    for (storage, name, extension) in [(Storage::Exr, "EXR", "exr"), (Storage::Png, "PNG, 16 bits", "png")] {
        if button(ui, cx.t, "", &format!("Save maps as {name}…"), 24.0).clicked() {
            let (camera, framing) = (&solution.camera, cx.state.doc.framing());
            let map = |way: Way| {
                let map = Map { camera: camera.clone(), framing, way, storage };
                (format!("stmap_{}.{extension}", way.name()), Content::Map(Box::new(map)))
            };
            cx.ask(Command::SaveAll(Way::ALL.map(map).to_vec()));
        }
    }
}

fn report(cx: &mut Cx<'_>, ui: &mut Ui, answer: &Answer) {
    let t = cx.t;
    ui.label(text("One page with everything", font::semibold(font::BODY), t.ink));
    let words = "Verdict, camera with σ, errors, coverage, every picture, covariance, settings and conventions, with figures; and all numbers as JSON inside, so that the page alone can be checked. It needs nothing beside it and loads nothing from anywhere.";
    ui.label(text(words, font::regular(font::SMALL), t.text2));
    ui.add_space(6.0);
    if primary(ui, t, icon::SAVE, "Save report…", 26.0).clicked() {
        let mut report = answer.report().clone();
        report.advice = cx.state.data.advice(cx.state.doc.goal);
        let content = Content::Page(Arc::new(report));
        cx.ask(Command::Save { name: "report.html".to_owned(), content });
    }
}
