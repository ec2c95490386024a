//! The top bar: what is open, the two settings that a beginner meets, undo, export, menu.

pub(super) mod board;
pub(super) mod lens;

use egui::{Popup, PopupCloseBehavior, RichText, Ui, vec2};

use crate::app::{
    action::{Action, Command, demo},
    cx::Cx,
    lab,
    screen::{Dialog, ExportPart},
    style::{font, icon},
    widgets::{icon_button, named, primary, text},
};

/// Draws the bar.
pub fn show(cx: &mut Cx<'_>, ui: &mut Ui) {
    let t = cx.t;
    ui.horizontal_centered(|ui| {
        mark(ui, t);
        ui.add_space(6.0);
        open(cx, ui);
        if !cx.state.doc.frames.is_empty() {
            ui.add_space(4.0);
            title(cx, ui);
            ui.add_space(4.0);
            board::board(cx, ui);
            lens::lens(cx, ui);
        }
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            menu(cx, ui);
            ui.add_space(2.0);
            if cx.state.data.solved().is_some() {
                ui.spacing_mut().button_padding.x = 10.0;
                if primary(ui, t, icon::EXPORT, "Export…", 26.0).clicked() {
                    cx.show(|s| s.dialog = Some(Dialog::Export { part: ExportPart::Camera, format: 0 }));
                }
                ui.spacing_mut().button_padding.x = 8.0;
                ui.add_space(8.0);
            }
            if !cx.state.doc.frames.is_empty() {
                let (back, on) = (!cx.state.past.is_empty(), !cx.state.future.is_empty());
                if icon_button(ui, t, icon::REDO, "Redo", on).clicked() {
                    cx.push(Action::Redo);
                }
                if icon_button(ui, t, icon::UNDO, "Undo", back).clicked() {
                    cx.push(Action::Undo);
                }
            }
        });
    });
}

/// The mark: two bowed lines over one straight.
pub(super) fn mark(ui: &mut Ui, t: &crate::app::style::Tokens) {
    let (rect, response) = ui.allocate_exact_size(vec2(20.0, 20.0), egui::Sense::hover());
    named(&response, egui::Role::Image, true, "Straightedge");
    let stroke = egui::Stroke::new(1.6, t.ink);
    for (y, bow) in [(4.5, 4.0), (9.5, 2.0), (15.5, 0.0)] {
        let points: Vec<_> = (0..=12)
            .map(|k| {
                let x = k as f32 / 12.0;
                rect.min + vec2(1.5 + 17.0 * x, y + bow * ((2.0 * x - 1.0).powi(2) - 0.5))
            })
            .collect();
        ui.painter().add(egui::Shape::line(points, stroke));
    }
}

fn open(cx: &mut Cx<'_>, ui: &mut Ui) {
    let label = format!("{}  Open  {}", icon::FOLDER, icon::CARET_DOWN);
    let response = ui.add(egui::Button::new(RichText::new(label).color(cx.t.ink)).min_size(vec2(0.0, 26.0)));
    named(&response, egui::Role::Button, true, "Open");
    Popup::menu(&response).show(|ui| open_menu(cx, ui));
}

/// What can be opened.
pub(super) fn open_menu(cx: &mut Cx<'_>, ui: &mut Ui) {
    ui.set_min_width(190.0);
    if ui.button("Open folder…").clicked() {
        cx.ask(Command::PickFolder);
    }
    if ui.button("Add pictures…").clicked() {
        cx.ask(Command::PickPictures);
    }
    if !cx.state.doc.frames.is_empty() && ui.button("Compare with camera files…").clicked() {
        cx.ask(Command::PickCameras);
    }
    if ui.button("Open session…").clicked() {
        cx.ask(Command::OpenSession);
    }
    if !cx.state.recent.is_empty() {
        ui.menu_button("Recent", |ui| {
            for folder in &cx.state.recent {
                let name = folder
                    .file_name()
                    .map_or_else(|| folder.display().to_string(), |n| n.to_string_lossy().into_owned());
                if ui.button(name).on_hover_text(folder.display().to_string()).clicked() {
                    cx.ask(Command::OpenPaths(vec![folder.clone()]));
                }
            }
        });
    }
    ui.separator();
    if ui.button("Try the demo").clicked() {
        cx.push(Action::Open(demo()));
    }
    if !cx.state.doc.frames.is_empty() {
        ui.separator();
        if ui.button("Save session…").clicked() {
            cx.ask(Command::SaveSession);
        }
        if ui.button("Close").clicked() {
            cx.push(Action::Close);
        }
    }
}

/// Folder and size of the pictures.
fn title(cx: &mut Cx<'_>, ui: &mut Ui) {
    let name = folder(cx);
    ui.label(text(name, font::medium(font::BODY), cx.t.ink));
    let size = cx
        .state
        .data
        .solved()
        .map(|(_, s)| s.camera.size_px)
        .or_else(|| cx.state.data.inspections.values().find_map(|i| i.as_ref().ok().map(|i| i.size_px)));
    if let Some([w, h]) = size {
        ui.label(text(format!("{w} × {h}"), font::regular(font::BODY), cx.t.text3));
    }
}

pub(super) fn folder(cx: &Cx<'_>) -> String {
    use crate::job::Source;
    match cx.state.doc.frames.first().map(|f| &f.source) {
        Some(Source::File(path)) => {
            let folder = path.parent().and_then(|p| p.file_name());
            folder.map_or_else(|| "Pictures".to_owned(), |f| f.to_string_lossy().into_owned())
        }
        Some(Source::View { .. }) => "Demo scene".to_owned(),
        None => String::new(),
    }
}

/// A chip that opens a popover.
fn chip(
    cx: &mut Cx<'_>,
    ui: &mut Ui,
    [name, glyph]: [&str; 2],
    label: &str,
    quiet: &str,
    content: impl FnOnce(&mut Cx<'_>, &mut Ui),
) {
    let t = cx.t;
    let mut job = egui::text::LayoutJob::default();
    let mut add = |s: &str, font, color| {
        let format =
            egui::TextFormat { font_id: font, color, valign: egui::Align::Center, ..Default::default() };
        job.append(s, 0.0, format);
    };
    add(&format!("{glyph}  "), font::regular(15.0), t.text2);
    add(label, font::medium(font::BODY), t.ink);
    if !quiet.is_empty() {
        add(&format!(" {quiet}"), font::regular(font::BODY), t.text3);
    }
    add(&format!("  {}", icon::CARET_DOWN), font::regular(11.0), t.text2);
    let response = ui.add(egui::Button::new(job).min_size(vec2(0.0, 26.0)));
    named(&response, egui::Role::Button, true, format!("{name}, {label} {quiet}").trim());
    Popup::from_toggle_button_response(&response)
        .close_behavior(PopupCloseBehavior::CloseOnClickOutside)
        .show(|ui| {
            ui.set_min_width(280.0);
            ui.set_max_width(430.0);
            ui.add_space(2.0);
            ui.spacing_mut().item_spacing.y = 6.0;
            content(cx, ui);
        });
}

fn lens_words(cx: &Cx<'_>) -> &'static str {
    let solved = cx.state.data.solved().map(|(_, s)| s.camera.model);
    cx.state.doc.model.or(solved).map_or("Lens", |m| m.spec().title)
}

/// Both settings in a few words.
pub(super) fn settings(cx: &Cx<'_>) -> String {
    format!("{} · {}", board::words(cx), lens_words(cx))
}

fn view(cx: &mut Cx<'_>, ui: &mut Ui) {
    let dark = ui.visuals().dark_mode;
    if ui.button(if dark { "Light theme" } else { "Dark theme" }).clicked() {
        ui.set_theme(if dark { egui::Theme::Light } else { egui::Theme::Dark });
    }
    egui::gui_zoom::zoom_menu_buttons(ui);
    ui.separator();
    let unlocked = cx.state.screen.unlocked;
    let says = "Panels can be dragged by their tabs and resized";
    if ui.button(if unlocked { "Lock layout" } else { "Unlock layout" }).on_hover_text(says).clicked() {
        cx.show(|s| s.unlocked = !unlocked);
    }
    if unlocked && ui.button("Panels back to their places").clicked() {
        cx.ask(Command::ResetLayout);
    }
}

fn menu(cx: &mut Cx<'_>, ui: &mut Ui) {
    let response = icon_button(ui, cx.t, icon::LIST, "Menu", true);
    Popup::menu(&response).show(|ui| {
        ui.set_min_width(190.0);
        menu_items(cx, ui);
    });
}

/// What is seldom needed.
pub(super) fn menu_items(cx: &mut Cx<'_>, ui: &mut Ui) {
    ui.menu_button("View", |ui| view(cx, ui));
    ui.separator();
    if ui.button("Print a board…").clicked() {
        cx.show(|s| s.dialog = Some(Dialog::Board));
    }
    if ui.button("Lab").on_hover_text("A scene whose camera is known, and what spoils it").clicked() {
        cx.show(|s| s.lab = Some(lab::Part::Scene));
    }
    ui.separator();
    if ui.add(egui::Button::new("Keyboard shortcuts").shortcut_text("?")).clicked() {
        cx.show(|s| s.dialog = Some(Dialog::Shortcuts));
    }
}
