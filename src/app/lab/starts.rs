//! Whether other starts end at the same camera.

use egui::{Grid, Ui};

use crate::{
    app::{cx::Cx, style::font, widgets::text},
    calib::number::significant,
};

pub(super) fn show(cx: &mut Cx<'_>, ui: &mut Ui) {
    let t = cx.t;
    let Some((_, solution)) = cx.state.data.solved() else {
        ui.label(text(
            "The starts are listed here when a camera was found.",
            font::regular(font::BODY),
            t.text2,
        ));
        return;
    };
    let starts = &solution.starts;
    let words = if starts.agreeing == starts.tried {
        format!(
            "All {} starts end at the same camera: this is the optimum, not a place where one start got stuck.",
            starts.tried
        )
    } else {
        format!(
            "{} of {} starts end at the best camera; the others got stuck at a worse one.",
            starts.agreeing, starts.tried
        )
    };
    ui.label(text(words, font::regular(font::SMALL), t.text2));
    ui.add_space(6.0);
    Grid::new("starts").num_columns(3).striped(true).spacing([18.0, 5.0]).show(ui, |ui| {
        for head in ["start", "from fx, px", "ends at RMS, px"] {
            ui.label(text(head, font::regular(font::CAPTION), t.text3));
        }
        ui.end_row();
        for start in &starts.list {
            ui.label(start.name.as_str());
            ui.label(format!("{:.0}", start.focal_px));
            ui.label(start.rms_px.map_or_else(|| "failed".to_owned(), |r| significant(r, 4)));
            ui.end_row();
        }
    });
}
