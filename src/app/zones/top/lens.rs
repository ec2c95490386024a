//! The lens chip: the camera model, and how the models fare on the pictures at hand.

use egui::Ui;

use super::{chip, lens_words};
use crate::{
    app::{
        action::Command,
        cx::Cx,
        export::Content,
        style::{font, icon},
        widgets::text,
    },
    calib::{
        calibrate::{Candidate, Comparison},
        camera::Model,
        number::significant,
    },
};

pub(super) fn lens(cx: &mut Cx<'_>, ui: &mut Ui) {
    chip(cx, ui, ["Lens", icon::APERTURE], lens_words(cx), "", settings);
}

/// The model, to be chosen.
pub(in crate::app::zones) fn settings(cx: &mut Cx<'_>, ui: &mut Ui) {
    // Models are compared for whoever looks at them.
    if !cx.state.screen.comparing {
        cx.show(|s| s.comparing = true);
    }
    let t = cx.t;
    let now = cx.state.doc.model;
    let compared = cx.state.data.compared.clone();
    let found = compared.as_ref().and_then(|c| c.1.as_ref().ok());
    egui::Grid::new("models").num_columns(4).spacing([12.0, 6.0]).show(ui, |ui| {
        ui.label(text("Lens", font::semibold(font::BODY), t.ink));
        if found.is_some() {
            for (word, meaning) in HEADS {
                ui.label(text(word, font::regular(font::SMALL), t.text3)).on_hover_text(meaning);
            }
        }
        ui.end_row();
        let says = "Brown with 5 terms, or Kannala–Brandt where the pictures show a fisheye lens";
        if ui.radio(now.is_none(), "Ordinary or fisheye, as it fits").on_hover_text(says).clicked() {
            cx.edit(|d| d.model = None);
        }
        ui.end_row();
        for model in Model::ALL {
            let spec = model.spec();
            if ui.radio(now == Some(model), spec.title).on_hover_text(spec.explained).clicked() {
                cx.edit(|d| d.model = Some(model));
            }
            if let Some(candidate) = found.and_then(|c| c.candidates.iter().find(|c| c.model == model)) {
                figures(cx, ui, candidate, found.is_some_and(|c| c.recommended == model));
            }
            ui.end_row();
        }
    });
    ui.separator();
    let current = now.or(cx.state.data.solved().map(|(_, s)| s.camera.model));
    match &compared {
        Some((_, Ok(comparison))) => recommendation(cx, ui, comparison, current),
        Some((_, Err(why))) => {
            ui.label(text(why.as_str(), font::regular(font::SMALL), t.text3));
        }
        None => {
            let words = if cx.state.data.solved().is_some() {
                "Comparing the models on pictures left out of the fit …".to_owned()
            } else {
                current.map_or(String::new(), |m| m.spec().explained.to_owned())
            };
            ui.label(text(words, font::regular(font::SMALL), t.text3));
        }
    }
}

/// Heads of the figures, and what they mean.
const HEADS: [(&str, &str); 3] = [
    ("fit px", "RMS in the pictures that the model was fitted to, px: falls with every term"),
    ("new px", "RMS in pictures that were left out of the fit, px: falls only where a term is true"),
    ("corner px", "How sure the projection is in the worst corner of the picture, px (1σ)"),
];

fn figures(cx: &Cx<'_>, ui: &mut Ui, candidate: &Candidate, recommended: bool) {
    let t = cx.t;
    let px = |v: Option<f64>| v.map_or("–".to_owned(), |v| significant(v, 3));
    let color = if !candidate.against.is_empty() {
        t.warn
    } else if recommended {
        t.ink
    } else {
        t.text2
    };
    let values = [Some(candidate.rms_px), candidate.held_out_px, candidate.worst_corner_px];
    for (k, value) in values.into_iter().enumerate() {
        let font =
            if recommended && k == 1 { font::semibold(font::SMALL) } else { font::regular(font::SMALL) };
        let label = ui.label(text(px(value), font, color));
        if !candidate.against.is_empty() {
            label.on_hover_text(candidate.against.as_str());
        }
    }
}

/// A splined camera from what is shown, as a file.
fn splined_camera(cx: &mut Cx<'_>, ui: &mut Ui) {
    let Some(answer) = cx.state.data.answer.as_deref() else { return };
    let says =
        "A grid of control points on top of the model, for mrcal and for straightedge undistort and stmap";
    let (Some(calibration), Some(target)) = (&answer.evidence.calibration, answer.report().settings.target())
    else {
        return;
    };
    if ui.button("Save splined camera…").on_hover_text(says).clicked() {
        let content = Content::Splined(Box::new((calibration.clone(), target)));
        cx.ask(Command::Save { name: "splined.cameramodel".to_owned(), content });
    }
}

/// The sentence, and one click to follow it.
fn recommendation(cx: &mut Cx<'_>, ui: &mut Ui, comparison: &Comparison, current: Option<Model>) {
    let t = cx.t;
    let recommended = comparison.recommended;
    ui.label(text(comparison.why.as_str(), font::regular(font::SMALL), t.text2));
    if let Some(splined) = &comparison.splined {
        ui.label(text(splined.words(), font::regular(font::SMALL), t.text2));
        splined_camera(cx, ui);
    }
    if current == Some(recommended) {
        ui.label(text(
            format!("{}  {} is recommended", icon::CHECK_CIRCLE, recommended.spec().title),
            font::regular(font::SMALL),
            t.ok,
        ));
    } else if ui.button(format!("Use {}", recommended.spec().title)).clicked() {
        cx.edit(|d| d.model = Some(recommended));
    }
}
