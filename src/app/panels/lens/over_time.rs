//! Calibrations of one camera in the order of their dates, the present one among them: what changes, and when to calibrate again.

use std::sync::Arc;

use egui::{Grid, Rect, ScrollArea, Stroke, Ui, pos2};

use super::beside;
use crate::{
    app::{
        cx::Cx,
        panels::part,
        plots::{self, Axis},
        screen::{Beside, Earlier},
        style::{Tokens, font, icon},
        widgets::{icon_button, minus, named, text, typed},
    },
    calib::{
        Result,
        compare::{Entry, Member, Series, Side, Verdict, date},
        figure::Point,
    },
    job::Key,
};

/// What the present calibration is called.
const PRESENT: &str = "these pictures";
/// Height of the figures with their titles, points.
const FIGURES: f32 = 170.0;
/// Half the width of a band, points.
const HALF: f32 = 7.0;
/// Temperatures that cameras are used at, °C.
const WARMTH: std::ops::RangeInclusive<f64> = -90.0..=200.0;

/// Of an answer and the open files.
struct Known {
    made_from: (Option<Key>, Earlier),
    series: Result<Series>,
}

/// Of the present answer and the open files, computed once.
fn series(cx: &Cx<'_>, ui: &Ui, earlier: &Earlier) -> Arc<Known> {
    let solved = cx.state.data.solved();
    // Which of them is compared does not matter here.
    let made_from = (solved.map(|(answer, _)| answer.key), Earlier { shown: 0, ..earlier.clone() });
    let id = egui::Id::unique("calibrations over time");
    if let Some(known) = ui.data(|d| d.get_temp::<Arc<Known>>(id)).filter(|k| k.made_from == made_from) {
        return known;
    }
    let file = |(beside, temperature): &(Arc<Beside>, Option<f64>)| Member {
        file: beside.name.clone(),
        side: beside.side.clone(),
        days: beside.days,
        temperature: *temperature,
    };
    let present = solved.map(|(answer, solution)| Member {
        file: PRESENT.to_owned(),
        side: Side::of(solution),
        days: answer.report().taken().and_then(date::days),
        temperature: earlier.temperature,
    });
    let members = earlier.list.iter().map(file).chain(present).collect();
    let made = Arc::new(Known { made_from, series: Series::new(members) });
    ui.data_mut(|d| d.insert_temp(id, made.clone()));
    made
}

/// The page.
pub(super) fn show(cx: &mut Cx<'_>, ui: &mut Ui, earlier: &Earlier) {
    let t = cx.t;
    beside::switch(cx, ui);
    ui.add_space(4.0);
    let known = series(cx, ui, earlier);
    let series = match &known.series {
        Ok(series) => series,
        Err(error) => {
            ui.label(text(error.to_string(), font::regular(font::SMALL), t.bad));
            return files(cx, ui, earlier);
        }
    };
    let color = match series.entries.last().map(|e| e.verdict) {
        Some(Verdict::Differ) => t.bad,
        Some(Verdict::Unknown) => t.warn,
        _ => t.ok,
    };
    ui.label(text(series.sentence(), font::regular(font::SMALL), color));
    ui.add_space(6.0);
    ScrollArea::both().auto_shrink(false).show(ui, |ui| {
        figures(ui, t, series);
        table(cx, ui, earlier, series);
    });
}

/// Where they cannot be a series: what is open, to be closed.
fn files(cx: &mut Cx<'_>, ui: &mut Ui, earlier: &Earlier) {
    for (i, (beside, _)) in earlier.list.iter().enumerate() {
        ui.horizontal(|ui| {
            close(cx, ui, i, &beside.name);
            ui.label(text(&beside.name, font::regular(font::SMALL), cx.t.ink));
        });
    }
}

fn close(cx: &mut Cx<'_>, ui: &mut Ui, position: usize, name: &str) {
    if icon_button(ui, cx.t, icon::X, &format!("Close {name}"), true).clicked() {
        cx.show(|s| s.earlier.close(position));
    }
}

/// Focal length, and difference from the first.
fn figures(ui: &mut Ui, t: &'static Tokens, series: &Series) {
    let course = series.course();
    let (all, _) = ui.allocate_exact_size(egui::vec2(ui.available_width(), FIGURES), egui::Sense::hover());
    let middle = all.center().x;
    for (name, room, points, bands) in [
        ("Focal length", all.with_max_x(middle - 8.0), &course.focal, &course.focal_bands),
        ("Difference from the first", all.with_min_x(middle + 8.0), &course.moved, &course.moved_bands),
    ] {
        let mut child = part(ui, name, room);
        child.label(text(format!("{name}, px"), font::medium(font::SMALL), t.ink));
        figure(&mut child, t, name, points, bands);
        let below = pos2(room.right(), room.bottom());
        let painter = child.painter();
        let caption =
            |at, align, words: &str| painter.text(at, align, words, font::regular(font::CAPTION), t.text3);
        caption(below, egui::Align2::RIGHT_BOTTOM, &course.over);
        caption(room.left_bottom(), egui::Align2::LEFT_BOTTOM, "grey: what chance explains");
    }
}

/// Points with their σ, over the band of each that chance explains.
fn figure(ui: &mut Ui, t: &'static Tokens, name: &str, points: &[Point], bands: &[[f64; 2]]) {
    let span = |values: &mut dyn Iterator<Item = f64>| {
        let [low, high] = values.fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], v| [l.min(v), h.max(v)]);
        let room = 0.1 * (high - low).max(1e-3);
        [low - room, high + room]
    };
    let [left, right] = span(&mut points.iter().map(|p| p.x));
    let ends = points.iter().flat_map(|p| [p.y - p.sigma, p.y + p.sigma]);
    let [low, high] = span(&mut ends.chain(bands.iter().copied().flatten()));
    // No parts of a number or a day.
    let most = ((right - left).ceil() as usize).clamp(1, 5);
    let (x, y) = (Axis::new(left, right, most, ""), Axis::new(low, high, 5, ""));
    let room = ui.available_rect_before_wrap();
    let mut child = part(ui, "plot", room.with_max_y(room.bottom() - 14.0));
    let shown = plots::plot(name, t, &x, &y, false).show(&mut child, |_| ());
    let painter = child.painter().with_clip_rect(*shown.transform.frame());
    for (p, [from, to]) in points.iter().zip(bands) {
        let [top, bottom] = [*to, *from].map(|v| plots::at(&shown, p.x, v).y);
        let at = plots::at(&shown, p.x, p.y);
        let band = Rect::from_min_max(pos2(at.x - HALF, top), pos2(at.x + HALF, bottom));
        painter.rect_filled(band, 1.0, t.line2);
        let color = if p.good { t.accent } else { t.bad };
        let [up, down] = [p.y + p.sigma, p.y - p.sigma].map(|v| plots::at(&shown, p.x, v));
        painter.line_segment([up, down], Stroke::new(1.5, color));
        painter.circle_filled(at, 3.5, color);
    }
    named(&shown.response, egui::Role::Image, true, &format!("{name} of each calibration"));
}

/// One line for each; a click on a name compares it.
fn table(cx: &mut Cx<'_>, ui: &mut Ui, earlier: &Earlier, series: &Series) {
    let t = cx.t;
    ui.add_space(8.0);
    Grid::new("series").num_columns(8).spacing([14.0, 1.0]).show(ui, |ui| {
        for name in
            ["calibration", "date", "°C", "focal length, px", "differs, px", "by chance up to", "", ""]
        {
            ui.label(text(name, font::regular(font::CAPTION), t.text3));
        }
        ui.end_row();
        for entry in &series.entries {
            let file = Some(entry.given).filter(|i| *i < earlier.list.len());
            row(cx, ui, entry, file);
            ui.end_row();
        }
    });
}

fn row(cx: &mut Cx<'_>, ui: &mut Ui, entry: &Entry, file: Option<usize>) {
    let t = cx.t;
    let name = text(&entry.file, font::medium(font::SMALL), t.ink);
    match file {
        Some(position) => {
            let label = egui::Label::new(name.underline()).sense(egui::Sense::click());
            let response = ui.add(label).on_hover_text("Where in the picture it differs from these pictures");
            if response.clicked() {
                cx.show(|s| (s.earlier.shown, s.earlier.over_time) = (position, false));
            }
        }
        None => drop(ui.label(name)),
    }
    let [date, _, focal, _, _, moved, limit] = entry.cells();
    let cell = |ui: &mut Ui, words: String| {
        ui.label(text(minus(words), font::regular(font::SMALL), t.ink));
    };
    // The dashes of a date are no minus signs.
    ui.label(text(date, font::regular(font::SMALL), t.ink));
    warmth(cx, ui, entry, file);
    [focal, moved, limit].into_iter().for_each(|words| cell(ui, words));
    let color = if entry.verdict == Verdict::Differ { t.bad } else { t.text3 };
    ui.label(text(entry.word(), font::medium(font::SMALL), color));
    if let Some(position) = file {
        close(cx, ui, position, &entry.file);
    }
}

/// How warm the camera was, for who knows it: a lens grows with it.
fn warmth(cx: &mut Cx<'_>, ui: &mut Ui, entry: &Entry, file: Option<usize>) {
    let shown = entry.temperature.map_or(String::new(), |v| format!("{v}"));
    let (response, words) = typed(ui, &format!("warmth {}", entry.given), &shown, "–", 40.0);
    named(&response, egui::Role::TextInput, true, &format!("Temperature of {}", entry.file));
    let Some(words) = words else { return };
    let value = words.trim().replace(',', ".").replace('−', "-").parse().ok();
    let value = value.filter(|v| WARMTH.contains(v));
    cx.show(|s| match file.and_then(|i| s.earlier.list.get_mut(i)) {
        Some((_, temperature)) => *temperature = value,
        None => s.earlier.temperature = value,
    });
}
