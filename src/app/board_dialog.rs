//! A board to print.

use std::sync::Arc;

use egui::Ui;

use super::{
    action::Command,
    cx::Cx,
    export::Content,
    style::font,
    widgets::{primary, text},
};
use crate::calib::{
    Result,
    board::{self, Kind, Sheet},
    target::BoardSize,
};

/// What is typed, and the board that it makes.
#[derive(Clone)]
struct Typed {
    kind: Kind,
    size: String,
    square: String,
    dictionary: String,
    first_id: String,
    /// A length within the square; empty for the usual one.
    inner: String,
    legacy: bool,
    made: Result<Made>,
}

/// A board that can be saved.
#[derive(Clone)]
struct Made {
    name: String,
    pdf: Arc<Vec<u8>>,
}

impl Typed {
    /// What is usual for a kind.
    fn usual(kind: Kind) -> Self {
        let square = match kind {
            Kind::Checkerboard | Kind::ArucoGrid => "25 mm",
            Kind::Circles => "22 mm",
            Kind::Charuco | Kind::AprilGrid | Kind::AsymmetricCircles => "20 mm",
        };
        Self {
            kind,
            size: kind.usual_size().to_owned(),
            square: square.to_owned(),
            dictionary: kind.usual_dictionary().unwrap_or_default().to_owned(),
            first_id: "0".to_owned(),
            inner: String::new(),
            legacy: false,
            made: Err(crate::calib::Error::Stopped),
        }
        .making()
    }

    /// With the board that it makes.
    fn making(mut self) -> Self {
        self.made = self.make();
        self
    }

    fn make(&self) -> Result<Made> {
        let kind = self.kind;
        let size: BoardSize = self.size.parse()?;
        if kind == Kind::Checkerboard {
            size.findable()?;
        }
        let mut sheet = Sheet::new(kind, size, self.square.parse()?);
        if !self.inner.trim().is_empty() {
            sheet = sheet.with_inner(self.inner.parse()?)?;
        }
        if kind.has_markers() {
            sheet.design.dictionary = Some(self.dictionary.parse()?);
            let id = self.first_id.trim().parse().ok().filter(|id| *id < 1_000_000);
            sheet.design.first_id = id.ok_or_else(|| {
                crate::calib::Error::Invalid(format!(
                    "\"{}\" is not an id: write a whole number, for example 0",
                    self.first_id
                ))
            })?;
        }
        sheet.design.legacy = Some(self.legacy);
        let name = match kind {
            Kind::Checkerboard => format!("board_{size}.pdf"),
            _ => format!("{kind}_{size}.pdf"),
        };
        Ok(Made { name, pdf: Arc::new(board::pdf(&sheet)?) })
    }
}

/// Draws the dialog.
pub fn show(cx: &mut Cx<'_>, ui: &mut Ui) {
    let t = cx.t;
    ui.set_width(340.0);
    ui.label(text("Print a board", font::semibold(font::LEAD), t.ink));
    ui.add_space(6.0);
    let id = egui::Id::unique("board to print");
    let mut typed = ui.data(|d| d.get_temp::<Typed>(id)).unwrap_or_else(|| Typed::usual(Kind::Checkerboard));
    let mut kind = typed.kind;
    let mut changed = false;
    egui::Grid::new("board").num_columns(2).spacing(egui::vec2(16.0, 8.0)).show(ui, |ui| {
        let label = ui.label("Kind");
        let choice = egui::ComboBox::from_id_salt("kind of board").width(150.0).selected_text(kind.title());
        let choice = choice.show_ui(ui, |ui| {
            for k in Kind::ALL {
                ui.selectable_value(&mut kind, k, k.title());
            }
        });
        choice.response.labelled_by(label.id);
        ui.end_row();
        let mut field = |ui: &mut Ui, name: &str, value: &mut String, hint: &str| {
            let label = ui.label(name);
            let edit = egui::TextEdit::singleline(value).desired_width(120.0).hint_text(hint);
            changed |= ui.add(edit).labelled_by(label.id).changed();
            ui.end_row();
        };
        field(ui, typed.kind.counts(), &mut typed.size, "");
        field(ui, typed.kind.length(), &mut typed.square, "");
        if let Some(inner) = typed.kind.inner_title() {
            field(ui, inner, &mut typed.inner, "as usual");
        }
        if typed.kind.has_markers() {
            field(ui, "Dictionary", &mut typed.dictionary, "");
            field(ui, "First id", &mut typed.first_id, "");
        }
        if typed.kind == Kind::Charuco {
            ui.label("");
            let words = "Layout before OpenCV 4.6";
            changed |= ui.checkbox(&mut typed.legacy, words).changed();
            ui.end_row();
        }
    });
    if kind != typed.kind {
        typed = Typed::usual(kind);
    } else if changed {
        typed = typed.making();
    }
    let made = typed.made.clone();
    ui.data_mut(|d| d.insert_temp(id, typed));
    ui.add_space(6.0);
    let note = match &made {
        Ok(_) => "Print it at 100 %, glue it to something flat and stiff, and measure a square: the ruler on the sheet tells whether the printer scaled it.".to_owned(),
        Err(error) => error.to_string(),
    };
    let color = if made.is_ok() { t.text2 } else { t.bad };
    ui.label(text(note, font::regular(font::SMALL), color));
    ui.add_space(10.0);
    ui.horizontal(|ui| {
        if let Ok(Made { name, pdf }) = made
            && primary(ui, t, super::style::icon::PRINTER, "Save PDF…", 26.0).clicked()
        {
            cx.ask(Command::Save { name, content: Content::Bytes(pdf) });
            ui.close();
        }
        if ui.button("Close").clicked() {
            ui.close();
        }
    });
}
