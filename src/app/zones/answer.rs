//! The answer: verdict, numbers, findings, camera.

mod next;

use egui::{Align2, Color32, Sense, Stroke, Ui, pos2, vec2};

use crate::{
    app::{
        action::Command,
        cx::Cx,
        panels::Tile,
        state::Answer,
        style::font,
        widgets::{button, caption, certainty, level, minus, named, text, value_sigma},
    },
    calib::{
        calibrate::Fix,
        diagnose::{Finding, Level, Remedy, SHOWN, Show},
        number::{counted, significant},
        report::Solution,
    },
};

/// Draws the panel.
pub fn show(cx: &mut Cx<'_>, ui: &mut Ui) {
    let t = cx.t;
    // Or the panel would shrink to the text that is in it while pictures are read.
    ui.set_min_width(ui.available_width());
    let Some(answer) = cx.state.data.answer.clone() else {
        let reading = if cx.state.data.stopped {
            "Stopped before a camera was found."
        } else {
            "Looking for boards…"
        };
        ui.add_space(4.0);
        ui.label(text(reading, font::semibold(font::LEAD), t.text2));
        return;
    };
    egui::ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        ui.spacing_mut().item_spacing.y = 0.0;
        verdict(cx, ui, &answer);
        if let Some(solution) = answer.solution() {
            numbers(cx, ui, &answer, solution);
            next::show(cx, ui);
        }
        let all = &answer.evidence.findings;
        let id = egui::Id::unique("all findings");
        let open = ui.data(|d| d.get_temp::<bool>(id)).unwrap_or_default();
        for finding in all.iter().take(if open { all.len() } else { SHOWN }) {
            separator(ui, t);
            one(cx, ui, &answer, finding);
        }
        if all.len() > SHOWN {
            ui.add_space(8.0);
            let words =
                if open { "Fewer findings".to_owned() } else { counted(all.len() - SHOWN, "more finding") };
            if button(ui, t, "", &words, 22.0).clicked() {
                ui.data_mut(|d| d.insert_temp(id, !open));
            }
        }
        match answer.solution() {
            Some(solution) => {
                separator(ui, t);
                camera(cx, ui, solution);
            }
            // First why there is none.
            None => next::show(cx, ui),
        }
    });
}

fn separator(ui: &mut Ui, t: &crate::app::style::Tokens) {
    ui.add_space(8.0);
    let (rect, _) = ui.allocate_exact_size(vec2(ui.available_width(), 1.0), Sense::hover());
    ui.painter().hline(rect.x_range(), rect.center().y, Stroke::new(1.0, t.line));
    ui.add_space(8.0);
}

fn verdict(cx: &Cx<'_>, ui: &mut Ui, answer: &Answer) {
    let t = cx.t;
    let verdict = &answer.evidence.verdict;
    let (glyph, color) = level(t, verdict.level);
    ui.horizontal_top(|ui| {
        ui.label(text(glyph, font::fill(20.0), color));
        ui.add_space(4.0);
        ui.vertical(|ui| {
            ui.label(text(minus(verdict.sentence.as_str()), font::semibold(font::LEAD), t.ink));
            if answer.solution().is_some() {
                ui.add_space(2.0);
                ui.label(text(verdict.rms_words(), font::regular(font::SMALL), t.text3));
            }
        });
    });
    ui.add_space(10.0);
}

fn numbers(cx: &Cx<'_>, ui: &mut Ui, answer: &Answer, solution: &Solution) {
    let t = cx.t;
    let used = answer.report().included().count();
    let tone = |px: Option<f64>| match px {
        Some(px) if px <= 1.0 => t.ink,
        Some(px) if px <= 20.0 => t.warn,
        _ => t.bad,
    };
    let u = &solution.uncertainty;
    let cells = [
        (
            certainty(u.center_px),
            "px at centre",
            tone(u.center_px),
            "How far the place of a point in the middle of the picture would scatter if you calibrated again, 1 σ",
        ),
        (
            certainty(u.worst_corner_px),
            "px at corner",
            tone(u.worst_corner_px),
            "The same in the worst of the four corners of the picture",
        ),
        (
            if solution.rms_px < 10.0 {
                format!("{:.3}", solution.rms_px)
            } else {
                format!("{:.1}", solution.rms_px)
            },
            "px RMS fit",
            t.ink,
            "Root mean square of the distances between detected and projected corners. It says how well the corners fit, not how good the camera is",
        ),
        (used.to_string(), "used", t.ink, "Pictures that the calibration uses"),
    ];
    let (rect, _) = ui.allocate_exact_size(vec2(ui.available_width(), 42.0), Sense::hover());
    let widths = [0.27, 0.255, 0.25, 0.225];
    let mut x = rect.left();
    for (k, (number, what, color, help)) in cells.into_iter().enumerate() {
        let what = if k == 3 { format!("of {} used", answer.report().frames.len()) } else { what.to_owned() };
        let part =
            egui::Rect::from_min_size(pos2(x, rect.top()), vec2(rect.width() * widths[k], rect.height()));
        let response =
            ui.interact(part, ui.scope_id().with(("number", k)), Sense::hover()).on_hover_text(help);
        named(&response, egui::Role::Label, true, &format!("{number} {what}"));
        ui.painter().text(part.left_top(), Align2::LEFT_TOP, &number, font::medium(font::NUMBER), color);
        let at = part.left_top() + vec2(0.0, 26.0);
        ui.painter().text(at, Align2::LEFT_TOP, &what, font::regular(font::CAPTION), t.text3);
        x += part.width();
    }
}

fn one(cx: &mut Cx<'_>, ui: &mut Ui, answer: &Answer, finding: &Finding) {
    let t = cx.t;
    let (glyph, color) = level(t, finding.level);
    ui.horizontal_top(|ui| {
        let icons = if finding.level == Level::Info { font::regular(14.0) } else { font::fill(14.0) };
        ui.label(text(glyph, icons, color));
        ui.add_space(2.0);
        ui.vertical(|ui| {
            ui.spacing_mut().item_spacing.y = 2.0;
            ui.label(text(minus(finding.title.as_str()), font::medium(font::BODY), t.ink));
            ui.label(text(minus(finding.text.as_str()), font::regular(font::SMALL), t.text2));
            ui.add_space(3.0);
            ui.horizontal(|ui| {
                if button(ui, t, "", "Show", 22.0).clicked() {
                    evidence(cx, answer, finding.show);
                }
                if let Some(remedy) = &finding.remedy
                    && button(ui, t, "", &remedy.label(), 22.0).clicked()
                {
                    mend(cx, answer, remedy);
                }
            });
        });
    });
}

/// Goes to where evidence is to be seen.
pub(in crate::app) fn evidence(cx: &mut Cx<'_>, answer: &Answer, show: Show) {
    let ids = &answer.ids;
    cx.show(|s| {
        let (tile, page) = match show {
            Show::Picture(_) | Show::Pictures => (Tile::Picture, "Picture"),
            Show::Errors => (Tile::Errors, "Overview"),
            Show::Field => (Tile::Errors, "Map"),
            Show::Certainty => (Tile::Coverage, "Certainty"),
            Show::Corners => (Tile::Coverage, "Corners"),
            Show::Diversity => (Tile::Coverage, "Diversity"),
            Show::Lens => (Tile::Lens, "Swipe"),
        };
        s.go(tile, page);
        s.sheet = show == Show::Pictures;
        if let Show::Picture(position) = show {
            s.selected = ids.get(position).copied();
        }
    });
}

/// Does what helps.
pub(in crate::app) fn mend(cx: &mut Cx<'_>, answer: &Answer, remedy: &Remedy) {
    match remedy {
        Remedy::Hold(names) => cx.edit(|d| {
            for name in names {
                d.hold(name, true);
            }
        }),
        Remedy::SetAside(positions, _) => {
            cx.edit(|d| d.set_aside(positions.iter().filter_map(|p| answer.ids.get(*p).copied())));
        }
        Remedy::AddPictures => cx.ask(Command::PickPictures),
        Remedy::Model(model) => cx.edit(|d| d.model = Some(*model)),
    }
}

fn camera(cx: &mut Cx<'_>, ui: &mut Ui, solution: &Solution) {
    let t = cx.t;
    let ghost = cx.state.data.ghost.clone().filter(|g| g.solution().is_some());
    ui.horizontal(|ui| {
        ui.label(text("Camera", font::semibold(font::BODY), t.ink));
        let title = solution.camera.spec().title;
        let words = if ghost.is_some() { format!("{title} · moved, in σ") } else { title.to_owned() };
        ui.label(text(words, font::regular(font::SMALL), t.text3));
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            let more = cx.state.screen.more;
            let glyph = if more { "less" } else { "more" };
            let response = ui.add(
                egui::Button::new(text(glyph, font::regular(font::SMALL), t.text2))
                    .fill(Color32::TRANSPARENT),
            );
            // What unfolds is brought into view, once it is there.
            let id = egui::Id::unique("more is new");
            if response.clicked() {
                cx.show(|s| s.more = !more);
                ui.data_mut(|d| d.insert_temp(id, !more));
            } else if ui.data_mut(|d| d.remove_temp::<bool>(id)) == Some(true) {
                response.scroll_to_me(Some(egui::Align::Min));
            }
        });
    });
    ui.add_space(4.0);
    let params = solution.camera.spec().params;
    for (i, param) in params.iter().enumerate() {
        let value = solution.camera.params[i];
        let sigma = solution.sigma.get(param.name).copied().flatten();
        let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), 19.0), Sense::click());
        let painter = ui.painter();
        let y = rect.center().y;
        let small = || font::regular(font::BODY);
        painter.text(pos2(rect.left(), y), Align2::LEFT_CENTER, param.name, small(), t.text2);
        let [shown, bound] = match sigma {
            Some(sigma) => value_sigma(value, sigma),
            None => [minus(significant_signed(value)), String::new()],
        };
        // Points stand below each other.
        let (whole, rest) =
            shown.split_once('.').map_or((shown.as_str(), String::new()), |(w, r)| (w, format!(".{r}")));
        let point = rect.left() + 66.0;
        painter.text(pos2(point, y), Align2::RIGHT_CENTER, whole, small(), t.ink);
        painter.text(pos2(point, y), Align2::LEFT_CENTER, rest, small(), t.ink);
        let uncertain = i >= 4 && sigma.is_some_and(|s| value.abs() < 2.0 * s);
        if sigma.is_some() {
            painter.text(
                pos2(rect.left() + 134.0, y),
                Align2::LEFT_CENTER,
                format!("± {bound}"),
                small(),
                t.text2,
            );
        } else {
            painter.text(pos2(rect.left() + 134.0, y), Align2::LEFT_CENTER, "held", small(), t.text3);
        }
        let right = pos2(rect.right(), y);
        let moved = ghost.as_deref().and_then(|g| {
            let before = g.solution()?;
            let old = before.camera.get(param.name)?;
            let sigma = sigma.or_else(|| before.sigma.get(param.name).copied().flatten())?;
            let moved = (value - old) / sigma;
            (moved.abs() > 0.05).then(|| minus(format!("{moved:+.1} σ")))
        });
        let quiet = font::regular(font::SMALL);
        let drawn = match moved {
            Some(moved) => Some(painter.text(right, Align2::RIGHT_CENTER, moved, quiet, t.text3)),
            None if uncertain => {
                Some(painter.text(right, Align2::RIGHT_CENTER, "not certain", quiet, t.text2))
            }
            None => None,
        };
        if let Some(drawn) = drawn {
            if uncertain {
                painter.circle_filled(pos2(drawn.left() - 7.0, y), 3.0, t.warn);
            }
        } else if param.unit == "px" && ghost.is_none() {
            painter.text(right, Align2::RIGHT_CENTER, "px", font::regular(font::CAPTION), t.text3);
        }
        named(&response, egui::Role::Label, true, &format!("{} {shown} ± {bound}", param.name));
        response.on_hover_text(meaning(param.name));
    }
    if cx.state.screen.more {
        more(cx, ui, solution);
    }
}

fn significant_signed(value: f64) -> String {
    let sign = if value < 0.0 { "-" } else { "" };
    format!("{sign}{}", significant(value.abs(), 5))
}

/// What a parameter means, in plain words.
fn meaning(name: &str) -> &'static str {
    match name {
        "fx" => "Focal length in widths of a pixel: how many px one unit to the side moves at distance one",
        "fy" => "Focal length in heights of a pixel; equal to fx where pixels are square",
        "cx" => "Where the optical axis meets the picture, px from the centre of the first column",
        "cy" => "Where the optical axis meets the picture, px from the centre of the first row",
        "k1" => {
            "Radial distortion: negative bends lines outwards like a barrel, positive inwards like a pincushion"
        }
        "k2" => "Radial distortion further out, with the fourth power of the distance from the axis",
        "k3" => "Radial distortion at the very edge, with the sixth power: often not determined",
        "p1" => "Tangential distortion: the lens is tilted about the horizontal axis",
        "p2" => "Tangential distortion: the lens is tilted about the vertical axis",
        _ => "",
    }
}

/// Fix toggles, truth, correlation, the way to the solution.
fn more(cx: &mut Cx<'_>, ui: &mut Ui, solution: &Solution) {
    let t = cx.t;
    ui.add_space(8.0);
    ui.label(text("Hold", font::semibold(font::SMALL), t.ink)).on_hover_text(
        "A held parameter stays at its start: the coefficients at 0, the principal point in the middle of the picture",
    );
    ui.add_space(4.0);
    ui.horizontal_wrapped(|ui| {
        for param in solution.camera.spec().params.iter().skip(2) {
            let mut on = cx.state.doc.holds(param.name);
            if ui.checkbox(&mut on, param.name).changed() {
                cx.edit(|d| d.hold(param.name, on));
            }
        }
        let tie = Fix::Tie("fx".to_owned(), "fy".to_owned());
        let mut on = cx.state.doc.fixed.contains(&tie);
        if ui.checkbox(&mut on, "fx = fy").changed() {
            cx.edit(|d| {
                d.fixed.retain(|f| *f != tie);
                if on {
                    d.fixed.push(tie.clone());
                }
            });
        }
    });
    if !solution.truth.is_empty() {
        ui.add_space(8.0);
        ui.label(text("Against the truth", font::semibold(font::SMALL), t.ink));
        ui.add_space(4.0);
        egui::Grid::new("truth").num_columns(5).spacing(vec2(10.0, 3.0)).show(ui, |ui| {
            for head in ["", "truth", "off by", "%", "σ"] {
                caption(ui, t, head);
            }
            ui.end_row();
            for c in &solution.truth {
                let small = |s: String| text(s, font::regular(font::SMALL), t.text2);
                ui.label(small(c.name.clone()));
                ui.label(small(minus(significant_signed(c.truth))));
                ui.label(small(significant(c.absolute, 2)));
                ui.label(small(c.relative.map(|r| significant(100.0 * r, 2)).unwrap_or_default()));
                ui.label(small(c.in_sigma.map(|s| format!("{s:.1}")).unwrap_or_default()));
                ui.end_row();
            }
        });
    }
    ui.add_space(8.0);
    correlation(cx, ui, solution);
    ui.add_space(8.0);
    ui.label(text("The way there", font::semibold(font::SMALL), t.ink));
    ui.add_space(4.0);
    let small = |s: String| text(s, font::regular(font::SMALL), t.text2);
    if let Some(first) = &solution.closed_form.camera {
        let [fx, fy, cx0, cy0] = first.intrinsics();
        ui.label(small(format!("Zhang's closed form: fx {fx:.1}, fy {fy:.1}, cx {cx0:.1}, cy {cy0:.1} px")));
        if let Some(rms) = solution.closed_form.rms_px {
            ui.label(small(format!("Its RMS before the refinement: {} px", significant(rms, 3))));
        }
    }
    ui.label(small(format!("{} of {} starts agree", solution.starts.agreeing, solution.starts.tried)));
    ui.label(small(format!("Stopped after {} steps: {}", solution.iterations, stopped(solution))));
    steps(cx, ui, solution);
}

fn stopped(solution: &Solution) -> &'static str {
    use crate::calib::solution::Termination;
    match solution.termination {
        Termination::CostConverged => "the error no longer falls",
        Termination::StepConverged => "the step is below rounding",
        Termination::GradientConverged => "the gradient vanishes",
        Termination::IterationLimit => "too many steps, not at an optimum",
        Termination::Stuck => "no better point was found, not at an optimum",
    }
}

/// RMS over the steps, logarithmic.
fn steps(cx: &Cx<'_>, ui: &mut Ui, solution: &Solution) {
    let t = cx.t;
    let values: Vec<f64> =
        solution.steps.iter().filter(|s| s.accepted).map(|s| s.rms_px.max(1e-12).log10()).collect();
    if values.len() < 2 {
        return;
    }
    ui.add_space(4.0);
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), 60.0), Sense::hover());
    named(&response, egui::Role::Image, true, "RMS of each step");
    let (low, high) = values.iter().fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(*v), h.max(*v)));
    let span = (high - low).max(1e-9);
    let points = values.iter().enumerate().map(|(i, v)| {
        let x = rect.left() + 2.0 + (rect.width() - 60.0) * i as f32 / (values.len() - 1) as f32;
        pos2(x, rect.bottom() - 4.0 - (rect.height() - 8.0) * ((v - low) / span) as f32)
    });
    let points: Vec<_> = points.collect();
    let ends = [values[0], values[values.len() - 1]].map(|v| 10f64.powf(v));
    // As many digits as tell them apart: a start from the last camera is close already.
    let digits = (2..6).find(|n| significant(ends[0], *n) != significant(ends[1], *n)).unwrap_or(6);
    for (at, value) in [points[0], points[points.len() - 1]].into_iter().zip(ends) {
        let label = format!("{} px", significant(value, digits));
        let (at, anchor) = if at == points[0] {
            (at + vec2(6.0, 0.0), Align2::LEFT_CENTER)
        } else {
            (at + vec2(6.0, -1.0), Align2::LEFT_CENTER)
        };
        ui.painter().text(at, anchor, label, font::regular(font::CAPTION), t.text3);
    }
    ui.painter().add(egui::Shape::line(points, Stroke::new(1.5, t.ink)));
}

/// Correlation of the parameters as a matrix of colours with numbers.
fn correlation(cx: &Cx<'_>, ui: &mut Ui, solution: &Solution) {
    let t = cx.t;
    let names: Vec<&str> = solution.camera.spec().params.iter().map(|p| p.name).collect();
    let n = names.len();
    ui.label(text("Correlation", font::semibold(font::SMALL), t.ink));
    ui.add_space(4.0);
    let left = 22.0;
    let side = ((ui.available_width() - left) / n as f32).min(30.0);
    let (rect, response) =
        ui.allocate_exact_size(vec2(left + side * n as f32, 16.0 + 18.0 * n as f32), Sense::hover());
    named(&response, egui::Role::Image, true, "Correlation of the parameters");
    for i in 0..n {
        let y = rect.top() + 16.0 + 18.0 * i as f32;
        ui.painter().text(
            pos2(rect.left(), y + 9.0),
            Align2::LEFT_CENTER,
            names[i],
            font::regular(10.0),
            t.text3,
        );
        let x = rect.left() + left + side * (i as f32 + 0.5);
        ui.painter().text(
            pos2(x, rect.top() + 7.0),
            Align2::CENTER_CENTER,
            names[i],
            font::regular(10.0),
            t.text3,
        );
        for j in 0..n {
            let [a, b] = [solution.covariance[(i, i)], solution.covariance[(j, j)]];
            let r = if a > 0.0 && b > 0.0 { solution.covariance[(i, j)] / (a * b).sqrt() } else { 0.0 };
            let cell = egui::Rect::from_min_size(
                pos2(rect.left() + left + side * j as f32, y),
                vec2(side - 1.0, 17.0),
            );
            let color = crate::app::style::signed(t, r);
            ui.painter().rect_filled(cell, 0.0, color);
            if i != j && r.abs() >= 0.3 {
                let light = color.r() as u32 * 3 + color.g() as u32 * 6 + color.b() as u32 > 1400;
                let ink = if light { Color32::from_gray(20) } else { Color32::from_gray(240) };
                ui.painter().text(
                    cell.center(),
                    Align2::CENTER_CENTER,
                    minus(format!("{:.0}", 100.0 * r)),
                    font::regular(10.0),
                    ink,
                );
            }
        }
    }
    caption(ui, t, "per cent; a pair near ±100 is known only together");
}
