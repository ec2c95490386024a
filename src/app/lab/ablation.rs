//! What each part of the method brings: one thing changed at a time, on the built-in scene.

use egui::{Grid, Ui};

use crate::{
    app::{cx::Cx, style::font, widgets::text},
    calib::{
        experiment::ablate::{ABLATIONS, CONDITIONS, TRIALS, trial},
        number::significant,
    },
};

pub(super) fn show(cx: &mut Cx<'_>, ui: &mut Ui) {
    let t = cx.t;
    let effects = &cx.state.data.effects;
    let words = if effects.len() < TRIALS {
        format!(
            "{} of {TRIALS} done. Each calibrates the built-in scene with one thing changed.",
            effects.len()
        )
    } else {
        "The built-in scene with one thing changed at a time: how far the map of the camera found lies from the true one."
            .to_owned()
    };
    ui.label(text(words, font::regular(font::SMALL), t.text2));
    ui.add_space(6.0);
    Grid::new("ablation").num_columns(1 + CONDITIONS.len()).striped(true).spacing([14.0, 4.0]).show(
        ui,
        |ui| {
            ui.label(text("px RMS off the true map", font::regular(font::CAPTION), t.text3));
            for (name, _) in CONDITIONS {
                ui.label(text(*name, font::regular(font::CAPTION), t.text3));
            }
            ui.end_row();
            let mut group = "";
            for (i, ablation) in ABLATIONS.iter().enumerate() {
                if ablation.group != group {
                    group = ablation.group;
                    ui.label(text(group, font::semibold(font::SMALL), t.ink));
                    ui.end_row();
                }
                ui.label(text(ablation.name, font::regular(font::SMALL), t.text2));
                for condition in 0..CONDITIONS.len() {
                    let cell = match effects.get(&(trial(condition, i) as u32)) {
                        None => "…".to_owned(),
                        Some(Err(error)) => {
                            ui.label(text("none", font::regular(font::SMALL), t.text3)).on_hover_text(error);
                            continue;
                        }
                        Some(Ok(n)) => n.map_px.map_or_else(|| "folds".to_owned(), |px| significant(px, 2)),
                    };
                    ui.label(text(cell, font::medium(font::SMALL), t.ink));
                }
                ui.end_row();
            }
        },
    );
}
