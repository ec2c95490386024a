//! An earlier calibration beside the one found: whether it still holds, where they differ, and whether chance explains it.

use std::sync::Arc;

use egui::{Color32, Rect, ScrollArea, Sense, Ui, pos2, vec2};

use super::over_time;
use crate::{
    app::{
        action::Command,
        cx::Cx,
        maps::{self, Grid},
        plan::validity_key,
        plots::Axis,
        screen::Beside,
        style::{font, from_map, icon},
        widgets::{WHOLE, button, color_bar, fit_top_left, minus, named, segmented, text},
    },
    calib::{
        Result,
        compare::{Answer, Comparison, Side, Verdict, compare},
        number::{significant, with_sigma},
    },
    job::Key,
};

/// Width of the words beside the map.
const WORDS: f32 = 250.0;

/// Of an answer and a file.
struct Known {
    made_from: (Key, Arc<Beside>),
    comparison: Result<Comparison>,
}

/// Of the present answer and the open file, computed once.
fn comparison(cx: &Cx<'_>, ui: &Ui, beside: &Arc<Beside>) -> Option<Arc<Known>> {
    let (answer, solution) = cx.state.data.solved()?;
    let id = egui::Id::unique("calibration beside");
    let same = |k: &Arc<Known>| k.made_from.0 == answer.key && Arc::ptr_eq(&k.made_from.1, beside);
    if let Some(known) = ui.data(|d| d.get_temp::<Arc<Known>>(id)).filter(same) {
        return Some(known);
    }
    let comparison = compare(&beside.side, &Side::of(solution));
    let made = Arc::new(Known { made_from: (answer.key, beside.clone()), comparison });
    ui.data_mut(|d| d.insert_temp(id, made.clone()));
    Some(made)
}

/// The page.
pub(super) fn show(cx: &mut Cx<'_>, ui: &mut Ui) {
    let earlier = cx.state.screen.earlier.clone();
    let Some(beside) = earlier.shown() else { return invitation(cx, ui) };
    if earlier.over_time {
        return over_time::show(cx, ui, &earlier);
    }
    let all = ui.available_rect_before_wrap();
    let known = comparison(cx, ui, beside);
    let comparison = known.as_ref().map(|known| &known.comparison);
    let side = if all.width() > 2.0 * WORDS { WORDS } else { 0.0 };
    let room = match (comparison, side > 0.0) {
        // Without a camera of the pictures there is no map.
        (None | Some(Err(_)), _) => all,
        (Some(Ok(_)), true) => all.with_min_x(all.right() - side),
        (Some(Ok(_)), false) => all.with_min_y(all.center().y),
    };
    let mut words = crate::app::panels::part(ui, "words", room);
    head(cx, &mut words, &beside.name);
    ScrollArea::vertical().auto_shrink(false).show(&mut words, |ui| {
        let told = validity(cx, ui, beside);
        ui.add_space(8.0);
        match comparison {
            Some(Ok(comparison)) => figures(cx, ui, comparison, told),
            Some(Err(error)) => drop(ui.label(text(error.to_string(), font::regular(font::SMALL), cx.t.bad))),
            None => {}
        }
    });
    if let (Some(known), Some(Ok(comparison))) = (&known, comparison) {
        let right = if side > 0.0 { side + 16.0 } else { 0.0 };
        let bottom = if side > 0.0 { all.bottom() } else { all.center().y };
        let room = Rect::from_min_max(all.min, pos2(all.right() - right - 62.0, bottom - 26.0));
        map(cx, ui, room, known, comparison);
    }
}

/// What is shown of which.
fn head(cx: &mut Cx<'_>, ui: &mut Ui, name: &str) {
    let t = cx.t;
    switch(cx, ui);
    ui.horizontal(|ui| {
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            if button(ui, t, "", "Close", 24.0).clicked() {
                cx.show(|s| s.earlier.close(s.earlier.shown));
            }
            ui.with_layout(egui::Layout::left_to_right(egui::Align::Center), |ui| {
                let label = egui::Label::new(text(name, font::semibold(font::SMALL), t.ink)).truncate();
                ui.add(label);
            });
        });
    });
}

/// Between one earlier calibration and all of them, and more of them.
pub(super) fn switch(cx: &mut Cx<'_>, ui: &mut Ui) {
    let t = cx.t;
    ui.horizontal(|ui| {
        let over_time = cx.state.screen.earlier.over_time;
        let words = ["Difference", "Over time"];
        if let Some(chosen) = segmented(ui, t, &words, usize::from(over_time)) {
            cx.show(|s| s.earlier.over_time = chosen == 1);
        }
        if button(ui, t, "", "Add…", 24.0).on_hover_text("Open more camera files or reports").clicked() {
            cx.ask(Command::PickCameras);
        }
    });
}

/// Whether the earlier calibration still holds, from the pictures with it held; the answer is whether that could be told.
fn validity(cx: &Cx<'_>, ui: &mut Ui, beside: &Beside) -> bool {
    let t = cx.t;
    let Some(answer) = cx.state.data.answer.as_deref() else { return false };
    let key = validity_key(answer, beside);
    let validity = cx.state.data.validity.as_ref().filter(|v| v.0 == key);
    let (words, color) = match validity {
        None => ("Holding it against the pictures…".to_owned(), t.text3),
        Some((_, Ok(found))) => {
            let color = match found.answer {
                Answer::StillValid => t.ok,
                Answer::Recalibrate => t.bad,
                Answer::Unclear => t.warn,
            };
            (minus(found.sentence.as_str()), color)
        }
        Some((_, Err(error))) => {
            (format!("Whether it still holds the pictures do not tell: {error}"), t.warn)
        }
    };
    ui.label(text(words, font::regular(font::SMALL), color));
    validity.is_some_and(|(_, found)| found.as_ref().is_ok_and(|f| f.answer != Answer::Unclear))
}

/// Before there is one.
fn invitation(cx: &mut Cx<'_>, ui: &mut Ui) {
    let t = cx.t;
    let words = "Is it still the same camera? Drop earlier calibrations on the window, camera files of any program or reports: does the last one still hold for these pictures, where in the picture do two differ, does chance explain it, and how does the camera change over time?";
    ui.set_max_width(420.0);
    ui.label(text(words, font::regular(font::BODY), t.text2));
    ui.add_space(8.0);
    if button(ui, t, icon::FOLDER, "Open camera files…", 26.0).clicked() {
        cx.ask(Command::PickCameras);
    }
}

fn map(cx: &mut Cx<'_>, ui: &Ui, room: Rect, known: &Known, comparison: &Comparison) {
    let t = cx.t;
    let lengths = comparison.lengths();
    let values = lengths.values.iter().map(|v| v.is_finite().then_some(*v)).collect();
    let grid = Grid { values, columns: lengths.columns };
    let most = comparison.whole.max_px.max(1e-9);
    let rect = fit_top_left(room, comparison.image_size_px.map(|n| n as f32).into());
    ui.painter().rect_filled(rect, 2.0, t.canvas);
    let color = |v: f64| from_map(colorous::VIRIDIS, v / most);
    let made_from = known.made_from.0.0 as u64 ^ Arc::as_ptr(&known.made_from.1) as u64;
    let texture = cx.textures.map(ui, "beside", made_from, || grid.image(160, color));
    ui.painter().image(texture.id(), rect, WHOLE, Color32::WHITE);
    let scale = Axis::new(0.0, most, 5, "px");
    let ticks = scale.ticks.iter().filter(|v| **v > 1e-9);
    let levels: Vec<(f64, String)> = ticks.clone().map(|v| (*v, scale.label(*v))).collect();
    maps::contours(ui, rect, &grid, &levels);
    let bar =
        Rect::from_min_size(pos2(rect.right() + 8.0, rect.top() + 6.0), vec2(8.0, rect.height() - 12.0));
    let last = scale.ticks.last().copied();
    let labels: Vec<(f32, String)> = ticks
        .map(|v| {
            (
                (v / most) as f32,
                if last == Some(*v) { format!("{} px", scale.label(*v)) } else { scale.label(*v) },
            )
        })
        .collect();
    color_bar(ui, t, bar, &labels, |s| from_map(colorous::VIRIDIS, s));
    let response = ui.interact(rect, ui.scope_id().with("beside"), Sense::hover());
    named(
        &response,
        egui::Role::Image,
        true,
        &format!("Difference of two calibrations, up to {} px", significant(most, 2)),
    );
    ui.painter().text(
        rect.left_bottom() + vec2(0.0, 6.0),
        egui::Align2::LEFT_TOP,
        "px that a point moves from the earlier calibration to this one",
        font::regular(font::CAPTION),
        t.text3,
    );
}

/// How far points move, and the earlier parameters; `told`: the words above say already whether chance explains it.
fn figures(cx: &Cx<'_>, ui: &mut Ui, c: &Comparison, told: bool) {
    let t = cx.t;
    let color = match c.verdict {
        Verdict::WithinChance => t.ok,
        Verdict::Differ => t.bad,
        Verdict::Unknown => t.warn,
    };
    if !told {
        ui.label(text(minus(c.sentence()), font::regular(font::SMALL), color));
        ui.add_space(6.0);
    }
    (ui.spacing_mut().interact_size.y, ui.spacing_mut().item_spacing.y) = (16.0, 3.0);
    let row = |ui: &mut Ui, name: &str, value: String| {
        ui.horizontal(|ui| {
            ui.label(text(name, font::regular(font::SMALL), t.text2));
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                ui.label(text(value.replace('-', "\u{2212}"), font::medium(font::SMALL), t.ink));
            });
        });
    };
    let title = |ui: &mut Ui, words: &str| ui.label(text(words, font::medium(font::SMALL), t.ink));
    title(ui, "How far points move (RMS)");
    for (name, figures) in
        [("in the middle half", c.middle), ("over the picture", c.whole), ("in the corners", c.corners)]
    {
        row(ui, name, format!("{} px", significant(figures.rms_px, 2)));
    }
    ui.add_space(6.0);
    title(ui, "Earlier values, off by");
    for p in &c.parameters {
        let value = match p.sigma[0].filter(|s| *s > 0.0) {
            Some(sigma) => with_sigma(p.values[0], sigma).join(" ± "),
            None => significant(p.values[0], 6),
        };
        let by = p.in_sigma.map_or(String::new(), |s| format!("  {s:+.1} σ"));
        row(ui, p.name, format!("{value}{by}"));
    }
}
