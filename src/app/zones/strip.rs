//! The stages in words, with live counts; what passed between them is one click away.

mod passed;

use egui::{Color32, Popup, Rect, Sense, Stroke, Ui, pos2, vec2};

use crate::{
    app::{
        action::Action,
        cx::Cx,
        panels::Tile,
        state::State,
        style::{font, icon},
        widgets::{level, named, text},
    },
    calib::{diagnose::Level, number::counted},
};

/// A stage of the work.
struct Stage {
    name: &'static str,
    detail: String,
    /// How it ended; none while it runs or waits.
    ended: Option<Level>,
    /// Share that is done while it runs.
    share: Option<f32>,
    /// What a click shows.
    tile: Tile,
    sheet: bool,
    /// What passes to the next stage, in lines.
    passed: fn(&State) -> Option<Vec<String>>,
}

/// Draws the strip.
pub fn show(cx: &mut Cx<'_>, ui: &mut Ui) {
    let t = cx.t;
    let stages = stages(cx.state);
    ui.horizontal_centered(|ui| {
        ui.spacing_mut().item_spacing.x = 5.0;
        for (k, stage) in stages.iter().enumerate() {
            if k > 0 {
                ui.label(text(icon::CARET_RIGHT, font::regular(10.0), t.line2));
            }
            one(cx, ui, stage);
        }
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            if cx.state.waiting() > 0 {
                let stopped = cx.state.data.stopped;
                if ui.small_button(if stopped { "Go on" } else { "Cancel" }).clicked() {
                    cx.push(if stopped { Action::Resume } else { Action::Stop });
                }
            } else if let Some(ms) = cx.state.data.took_ms {
                ui.label(text(format!("{:.2} s", ms / 1e3), font::regular(font::SMALL), t.text3));
            }
        });
    });
}

fn one(cx: &mut Cx<'_>, ui: &mut Ui, stage: &Stage) {
    let t = cx.t;
    let (glyph, glyph_color) = match stage.ended {
        Some(Level::Good | Level::Info) => (icon::CHECK, t.text2),
        Some(other) => level(t, other),
        None => ("", Color32::TRANSPARENT),
    };
    let layout = |s: &str, font, color| ui.painter().layout_no_wrap(s.to_owned(), font, color);
    let on = stage.ended.is_some() || stage.share.is_some();
    let parts = [
        layout(glyph, font::regular(13.0), glyph_color),
        layout(stage.name, font::medium(font::SMALL), if on { t.ink } else { t.text3 }),
        layout(&stage.detail, font::regular(font::SMALL), t.text2),
    ];
    let width: f32 = parts.iter().filter(|p| !p.is_empty()).map(|p| p.size().x + 5.0).sum();
    let (rect, response) = ui.allocate_exact_size(vec2(width + 6.0, 24.0), Sense::click());
    named(&response, egui::Role::Button, true, format!("{} {}", stage.name, stage.detail).trim());
    if response.hovered() {
        ui.painter().rect_filled(rect, 4.0, t.ctl);
    }
    let mut x = rect.left() + 3.0;
    for part in parts.into_iter().filter(|p| !p.is_empty()) {
        let size = part.size();
        ui.painter().galley(pos2(x, rect.center().y - size.y / 2.0), part, t.ink);
        x += size.x + 5.0;
    }
    if let Some(share) = stage.share {
        let y = rect.bottom() + 1.0;
        let line =
            Rect::from_min_max(pos2(rect.left(), y - 1.0), pos2(rect.left() + rect.width() * share, y + 1.0));
        ui.painter().rect_filled(line, 0.0, t.accent);
    }
    if response.has_focus() {
        ui.painter().rect_stroke(rect, 4.0, Stroke::new(2.0, t.accent), egui::StrokeKind::Inside);
    }
    if response.clicked() {
        cx.show(|s| {
            (s.center, s.sheet) = (stage.tile, stage.sheet);
            s.pages[stage.tile.index()] = 0;
        });
    }
    Popup::from_toggle_button_response(&response).width(280.0).show(|ui| {
        ui.label(text(format!("{} gave", stage.name), font::semibold(font::SMALL), t.ink));
        for line in (stage.passed)(cx.state).unwrap_or_else(|| vec!["nothing yet".to_owned()]) {
            ui.label(text(line, font::regular(font::SMALL), t.text2));
        }
    });
}

fn stages(state: &State) -> Vec<Stage> {
    let all = state.doc.frames.len();
    let read = all - state.waiting();
    let running = read < all && !state.data.stopped;
    let answer = state.data.answer.as_deref();
    let report = answer.map(|a| a.report());
    let stage = |name, detail: String, ended, tile, sheet, passed| Stage {
        name,
        detail,
        ended,
        share: None,
        tile,
        sheet,
        passed,
    };
    let found = report.map(|r| r.frames.iter().filter(|f| f.found).count());
    let corners: usize = report.iter().flat_map(|r| r.included()).map(|f| f.corners.len()).sum();
    let possible = report.and_then(|r| Some(r.settings.target()?.len() * found?)).unwrap_or(0);
    let solved = state.data.solved().map(|(_, s)| s);
    let unreadable = state.data.inspections.values().any(Result::is_err);
    let mut list = vec![
        stage(
            "Read",
            if running { format!("{read} of {}", counted(all, "picture")) } else { counted(read, "picture") },
            (!running).then_some(if unreadable { Level::Warn } else { Level::Good }),
            Tile::Picture,
            true,
            passed::read,
        ),
        stage(
            "Find",
            found.map(|n| format!("{n} of {read}")).unwrap_or_default(),
            (!running).then(|| if found == Some(0) { Level::Bad } else { Level::Good }),
            Tile::Picture,
            true,
            passed::find,
        ),
        stage(
            "Refine",
            if corners > 0 { format!("{corners} of {possible} corners") } else { String::new() },
            (corners > 0 && !running).then_some(Level::Good),
            Tile::Picture,
            false,
            passed::refine,
        ),
    ];
    if running {
        // There are pictures, or none would be waiting.
        let share = Some(read as f32 / all as f32);
        (list[0].share, list[1].share) = (share, share);
    }
    let failed = report.is_some_and(|r| r.error.is_some());
    list.push(stage(
        "Solve",
        solved.map(|s| format!("{:.3} px", s.rms_px)).unwrap_or_default(),
        solved.map(|_| Level::Good).or(failed.then_some(Level::Bad)),
        Tile::Errors,
        false,
        passed::solve,
    ));
    let findings = answer.map(|a| a.evidence.findings.as_slice()).unwrap_or_default();
    let worst = findings.iter().map(|f| f.level).max().unwrap_or(Level::Good);
    list.push(stage(
        "Check",
        if solved.is_some() { counted(findings.len(), "finding") } else { String::new() },
        solved.map(|_| worst),
        Tile::Coverage,
        false,
        passed::check,
    ));
    let straight = state.data.straight.as_ref().is_some_and(|s| s.raster.is_ok());
    list.push(stage(
        "Straighten",
        if straight { "ready".to_owned() } else { String::new() },
        (straight && solved.is_some()).then_some(Level::Good),
        Tile::Lens,
        false,
        passed::straighten,
    ));
    list
}
