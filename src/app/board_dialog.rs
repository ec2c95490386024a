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
    board::{self, Kind},
    target::{BoardSize, Length},
};

/// What is typed, and the board that it makes.
#[derive(Clone)]
struct Sheet {
    size: String,
    square: String,
    made: Result<(BoardSize, Arc<Vec<u8>>)>,
}

impl Sheet {
    fn new(size: &str, square: &str) -> Self {
        let made = size.parse::<BoardSize>().and_then(BoardSize::findable).and_then(|size| {
            Ok((size, Arc::new(board::pdf(Kind::Checkerboard, size, square.parse::<Length>()?)?)))
        });
        Self { size: size.to_owned(), square: square.to_owned(), made }
    }
}

/// Draws the dialog.
pub fn show(cx: &mut Cx<'_>, ui: &mut Ui) {
    let t = cx.t;
    ui.set_width(340.0);
    ui.label(text("Print a board", font::semibold(font::LEAD), t.ink));
    ui.add_space(6.0);
    let id = egui::Id::unique("board to print");
    let mut sheet = ui.data(|d| d.get_temp::<Sheet>(id)).unwrap_or_else(|| Sheet::new("9x6", "25 mm"));
    let (mut size, mut square) = (sheet.size.clone(), sheet.square.clone());
    egui::Grid::new("board").num_columns(2).spacing(egui::vec2(16.0, 8.0)).show(ui, |ui| {
        let label = ui.label("Inner corners");
        ui.add(egui::TextEdit::singleline(&mut size).desired_width(120.0)).labelled_by(label.id);
        ui.end_row();
        let label = ui.label("Edge of a square");
        ui.add(egui::TextEdit::singleline(&mut square).desired_width(120.0)).labelled_by(label.id);
        ui.end_row();
    });
    if (&size, &square) != (&sheet.size, &sheet.square) {
        sheet = Sheet::new(&size, &square);
    }
    let made = sheet.made.clone();
    ui.data_mut(|d| d.insert_temp(id, sheet));
    ui.add_space(6.0);
    let note = match &made {
        Ok(_) => "Print it at 100 %, glue it to something flat and stiff, and measure a square: the ruler on the sheet tells whether the printer scaled it.".to_owned(),
        Err(error) => error.to_string(),
    };
    let color = if made.is_ok() { t.text2 } else { t.bad };
    ui.label(text(note, font::regular(font::SMALL), color));
    ui.add_space(10.0);
    ui.horizontal(|ui| {
        if let Ok((size, pdf)) = made
            && primary(ui, t, super::style::icon::PRINTER, "Save PDF…", 26.0).clicked()
        {
            cx.ask(Command::Save { name: format!("board_{size}.pdf"), content: Content::Bytes(pdf) });
            ui.close();
        }
        if ui.button("Close").clicked() {
            ui.close();
        }
    });
}
