//! The twin of the capture: what comes out when it is drawn anew with known truth, again and again.

use egui::{Grid, Ui};

use crate::{
    app::{
        cx::Cx,
        plan::twin_key,
        style::font,
        widgets::{button, minus, text},
    },
    calib::{number::significant, twin::Outcome},
};

pub(super) fn show(cx: &mut Cx<'_>, ui: &mut Ui) {
    let t = cx.t;
    let small = |words: &str| text(words, font::regular(font::SMALL), t.text2);
    ui.label(small(
        "Your pictures are drawn anew from the camera that was found, with as much noise; boards are found and the camera is solved, 30 times. The truth is known, so this is what σ should be.",
    ));
    ui.add_space(6.0);
    let Some((answer, _)) = cx.state.data.solved() else {
        ui.label(small("Wait until a camera was found."));
        return;
    };
    let (key, asked) = (answer.key, cx.state.screen.twin == Some(answer.key));
    let done = cx.state.data.twin.as_ref().filter(|(made_from, _)| *made_from == twin_key(answer));
    match done {
        Some((_, Ok(outcome))) => table(cx, ui, outcome),
        Some((_, Err(error))) => drop(ui.label(small(error))),
        None if asked => {
            let of_this = cx.state.data.progress.filter(|(k, _)| *k == twin_key(answer));
            let share = of_this.map_or(0.0, |(_, share)| share);
            ui.add(egui::ProgressBar::new(share).show_percentage());
            ui.add_space(4.0);
            if button(ui, t, "", "Cancel the twin", 22.0).clicked() {
                cx.show(|s| s.twin = None);
            }
        }
        None => {
            if button(ui, t, "", "Draw it 30 times", 22.0).clicked() {
                cx.show(|s| s.twin = Some(key));
            }
        }
    }
}

fn table(cx: &Cx<'_>, ui: &mut Ui, outcome: &Outcome) {
    let t = cx.t;
    let cell = |v: f64| text(minus(significant(v, 2)), font::medium(font::SMALL), t.ink);
    let head = |words: &str| text(words, font::regular(font::CAPTION), t.text3);
    let name = |words: &str| text(words, font::regular(font::SMALL), t.text2);
    Grid::new("twin").num_columns(5).striped(true).spacing([14.0, 4.0]).show(ui, |ui| {
        for words in ["", "bias", "scatter", "its σ", "your σ"] {
            ui.label(head(words));
        }
        ui.end_row();
        for p in &outcome.parameters {
            ui.label(name(&p.name));
            for value in [Some(p.bias), Some(p.scatter), Some(p.sigma), p.capture_sigma] {
                ui.label(value.map_or_else(|| head("–"), cell));
            }
            ui.end_row();
        }
        ui.label(head("projection, px"));
        ui.end_row();
        for p in &outcome.places {
            ui.label(name(&p.name));
            for value in [Some(p.bias_px), Some(p.scatter_px), p.sigma_px] {
                ui.label(value.map_or_else(|| head("–"), cell));
            }
            ui.end_row();
        }
    });
    ui.add_space(6.0);
    if let Some(words) = outcome.neighbour_words() {
        ui.label(name(&format!("{words}.")));
        ui.add_space(4.0);
    }
    let [capture, twin] = outcome.rms_per_coordinate_px;
    ui.label(name(&format!(
        "Residuals are {} px in your pictures and {} px in the twin's: more than a half more is not the noise of the pictures, but the board, motion or the lens.",
        significant(capture, 2),
        significant(twin, 2)
    )));
}
