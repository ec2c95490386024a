//! The list of pictures: what is used, what is set aside and why.

use egui::{Align2, Color32, Pos2, Rect, RichText, Sense, Stroke, Ui, pos2, vec2};

use crate::{
    app::{
        cx::Cx,
        screen::{Filter, Sort},
        state::{State, short_name},
        style::{Tokens, font, icon},
        widgets::{self, icon_button, named, text},
    },
    calib::{
        diagnose::Level,
        influence::{Influence, Role},
        number::significant,
        observation::FrameId,
        order,
        report::{FrameReport, FrameState, SET_ASIDE_BY_HAND},
    },
};

/// Of pictures that wait.
const NOT_READ: &str = "not read yet";
/// Height of a row.
const ROW: f32 = 44.0;
/// Height of the line below the list.
const FOOT: f32 = 26.0;

/// One line of the list, as text: what a test reads.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// The picture.
    pub id: FrameId,
    /// Its name.
    pub name: String,
    /// Whether the calibration uses it.
    pub used: bool,
    /// Whether the user set it aside.
    pub excluded: bool,
    /// Corners, mean error, largest error or how far it moves the camera, tilt; empty where not known.
    pub numbers: [String; 4],
    /// One word about it.
    pub badge: Option<(&'static str, Level)>,
    /// What leaving it out would do.
    pub influence: Option<Influence>,
    /// Why it is not used.
    pub why: String,
    /// By what it is sorted.
    mean: f64,
    tilt: f64,
    corners: usize,
}

/// Rows in the order and with the filter of the screen.
pub fn rows(state: &State) -> Vec<Row> {
    let answer = state.data.answer.as_deref();
    let mut rows: Vec<Row> = state
        .doc
        .frames
        .iter()
        .map(|frame| {
            let name = short_name(&frame.source.name()).to_owned();
            let excluded = state.is_excluded(frame.id);
            let mut row = Row {
                id: frame.id,
                name,
                used: false,
                excluded,
                numbers: Default::default(),
                badge: None,
                influence: None,
                why: String::new(),
                mean: 0.0,
                tilt: 0.0,
                corners: 0,
            };
            let Some(report) = answer.and_then(|a| a.frame(frame.id)) else {
                row.why = match state.data.inspections.get(&frame.id) {
                    Some(Err(error)) => error.to_string(),
                    Some(Ok(_)) => String::new(),
                    None => NOT_READ.to_owned(),
                };
                return row;
            };
            row.used = report.included;
            row.corners = report.corners.len();
            row.mean = report.mean_px();
            row.tilt = report.tilt_rad.unwrap_or(0.0);
            if row.corners > 0 {
                row.numbers[0] = row.corners.to_string();
            }
            if report.included {
                row.numbers[1] = format!("{:.2}", row.mean);
                row.influence = report.influence;
                let third = match state.screen.sort {
                    Sort::Influence => report.influence.map(|i| significant(i.moves_px, 2)),
                    _ => report.max_px.map(|m| format!("{m:.2}")),
                };
                row.numbers[2] = third.unwrap_or_default();
                row.numbers[3] = format!("{:.0}°", row.tilt.to_degrees());
                row.badge = badge(report, answer.is_some_and(|a| a.weighed));
            } else {
                row.why.clone_from(&report.why);
                if excluded {
                    SET_ASIDE_BY_HAND.clone_into(&mut row.why);
                }
            }
            row
        })
        .collect();
    let threshold = state.doc.threshold_px;
    rows.retain(|row| match state.screen.filter {
        Filter::All => true,
        Filter::Used => row.used,
        Filter::Aside => !row.used,
        Filter::Above => row.used && row.mean > threshold,
    });
    match state.screen.sort {
        Sort::Name => {}
        Sort::Error => order::by(&mut rows, |r| [-r.mean]),
        Sort::Tilt => order::by(&mut rows, |r| [-r.tilt]),
        Sort::Corners => order::by(&mut rows, |r| [-(r.corners as f64)]),
        // Nobody can say where the camera would go without a picture that the others need.
        Sort::Influence => {
            order::by(&mut rows, |r| {
                [-r.influence.map_or(f64::from(u8::from(r.used)) * f64::MAX, |i| i.moves_px)]
            });
        }
    }
    // What could not be used stands below what is; what the user sets aside stays where it is under the pointer.
    order::by(&mut rows, |r| [r.is_aside().into()]);
    rows
}

/// The word that counts most.
fn badge(report: &FrameReport, weighed: bool) -> Option<(&'static str, Level)> {
    // Without such a picture the others do not determine the camera.
    let alone = weighed.then_some(Role::Precious);
    let role = report.influence.map(|i| i.role).or(alone).unwrap_or(Role::Fine);
    match (role, report.outliers.len()) {
        (Role::Harmful, _) => Some((role.name(), Level::Bad)),
        (Role::HarmlessOutlier, _) => Some((role.name(), Level::Warn)),
        (_, 1) => Some(("1 outlier", Level::Warn)),
        (_, 2..) => Some(("outliers", Level::Warn)),
        (Role::Precious, _) => Some((role.name(), Level::Good)),
        (Role::Fine, _) => (report.state == FrameState::Partial).then_some(("partial", Level::Info)),
    }
}

impl Row {
    /// What leaving it out would do, in a sentence.
    fn effect(&self) -> Option<String> {
        let Influence { moves_px, by_chance_px, certainty, .. } = self.influence?;
        let times = if by_chance_px > 0.0 {
            format!(", {} times as far as chance would take it", significant(moves_px / by_chance_px, 2))
        } else {
            String::new()
        };
        Some(format!(
            "Without it the projection moves by {} px{times}, and is {:.0} % less certain.",
            significant(moves_px, 2),
            100.0 * certainty
        ))
    }

    /// Whether the program has set it aside.
    fn is_aside(&self) -> bool {
        !self.used && !self.excluded && !self.why.is_empty() && self.why != NOT_READ
    }
}

/// Draws head and list.
pub fn show(cx: &mut Cx<'_>, ui: &mut Ui) {
    let t = cx.t;
    let rows = rows(cx.state);
    head(cx, ui);
    let first_aside = rows.iter().position(Row::is_aside);
    let lines = rows.len() + usize::from(first_aside.is_some_and(|f| f > 0));
    ui.spacing_mut().item_spacing.y = 0.0;
    let selected = cx.state.selected();
    let scroll_to = ui.data_mut(|d| {
        let id = egui::Id::unique("list selection");
        let before = d.get_temp::<Option<FrameId>>(id).flatten();
        d.insert_temp(id, selected);
        (before != selected).then_some(selected).flatten()
    });
    let line_of = |i: usize| i + usize::from(first_aside.is_some_and(|f| f > 0 && i >= f));
    let offset_id = egui::Id::unique("list offset");
    let (offset, height) = ui.data(|d| d.get_temp::<(f32, f32)>(offset_id)).unwrap_or((0.0, f32::MAX));
    // Reasons at the end of a long list would be found by nobody.
    let below = first_aside.filter(|f| {
        let bottom = offset + ui.available_height();
        *f > 0 && height < f32::MAX && (*f as f32 + 0.5) * ROW > bottom
    });
    let mut area = egui::ScrollArea::vertical().auto_shrink(false);
    if below.is_some() {
        area = area.max_height(ui.available_height() - FOOT);
    }
    if ui.data_mut(|d| d.remove_temp::<bool>(offset_id.with("to what is set aside"))).is_some() {
        area = area.vertical_scroll_offset(first_aside.unwrap_or(0) as f32 * ROW);
    } else if let Some(i) = scroll_to.and_then(|id| rows.iter().position(|r| r.id == id)) {
        let top = line_of(i) as f32 * ROW;
        if top < offset {
            area = area.vertical_scroll_offset(top);
        } else if top + ROW > offset + height {
            area = area.vertical_scroll_offset(top + ROW - height);
        }
    }
    let out = area.show_rows(ui, ROW, lines, |ui, range| {
        for line in range {
            let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), ROW), Sense::click());
            match first_aside {
                Some(f) if f > 0 && line == f => {
                    let n = rows.len() - f;
                    let at = pos2(rect.left() + 10.0, rect.bottom() - 14.0);
                    ui.painter().text(
                        at,
                        Align2::LEFT_CENTER,
                        "Set aside",
                        font::semibold(font::SMALL),
                        t.ink,
                    );
                    let at = at + vec2(62.0, 0.0);
                    ui.painter().text(
                        at,
                        Align2::LEFT_CENTER,
                        n.to_string(),
                        font::regular(font::SMALL),
                        t.text3,
                    );
                }
                Some(f) if f > 0 && line > f => row(cx, ui, rect, &response, &rows[line - 1], selected),
                _ => row(cx, ui, rect, &response, &rows[line], selected),
            }
        }
    });
    let place = (out.state.unclamped_offset().y, out.inner_rect.height());
    ui.data_mut(|d| d.insert_temp(offset_id, place));
    if let Some(f) = below {
        foot(cx, ui, rows.len() - f);
    }
}

/// Says that there is more below, and goes there.
fn foot(cx: &Cx<'_>, ui: &mut Ui, aside: usize) {
    let t = cx.t;
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), FOOT), Sense::click());
    let words = format!("{aside} set aside, and why");
    named(&response, egui::Role::Button, true, &words);
    let painter = ui.painter();
    painter.rect_filled(rect, 0.0, if response.hovered() { t.ctl } else { t.raised });
    painter.hline(rect.x_range(), rect.top(), Stroke::new(1.0, t.line));
    let left = pos2(rect.left() + 10.0, rect.center().y);
    painter.text(left, Align2::LEFT_CENTER, words, font::regular(font::SMALL), t.text2);
    let right = pos2(rect.right() - 10.0, rect.center().y);
    painter.text(right, Align2::RIGHT_CENTER, icon::CARET_DOWN, font::regular(11.0), t.text2);
    if response.clicked() {
        ui.data_mut(|d| d.insert_temp(egui::Id::unique("list offset").with("to what is set aside"), true));
    }
}

fn head(cx: &mut Cx<'_>, ui: &mut Ui) {
    let t = cx.t;
    ui.horizontal(|ui| {
        ui.set_height(28.0);
        ui.add_space(10.0);
        ui.label(text("Pictures", font::semibold(font::BODY), t.ink));
        let used = cx.state.data.answer.as_deref().map_or(0, |a| a.report().included().count());
        let all = cx.state.doc.frames.len();
        let counts = if used == all { format!("{used} used") } else { format!("{used} of {all}") };
        ui.label(text(counts, font::regular(font::BODY), t.text3));
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            ui.add_space(4.0);
            let filter = icon_button(ui, t, icon::FUNNEL, "Filter", true);
            egui::Popup::menu(&filter).show(|ui| {
                for choice in Filter::ALL {
                    if ui.selectable_label(cx.state.screen.filter == choice, choice.name()).clicked() {
                        cx.show(|s| s.filter = choice);
                    }
                }
            });
            let label = RichText::new(format!("{}  {}", icon::SORT_UP, cx.state.screen.sort.name()));
            let sort = ui.add(
                egui::Button::new(label.font(font::regular(font::BODY)).color(t.text2))
                    .fill(Color32::TRANSPARENT),
            );
            named(&sort, egui::Role::Button, true, "Sort");
            egui::Popup::menu(&sort).show(|ui| {
                for choice in Sort::ALL {
                    if ui.selectable_label(cx.state.screen.sort == choice, choice.name()).clicked() {
                        cx.show(|s| s.sort = choice);
                    }
                }
            });
        });
    });
    let (rect, _) = ui.allocate_exact_size(vec2(ui.available_width(), 18.0), Sense::hover());
    let third = if cx.state.screen.sort == Sort::Influence { "moves px" } else { "max px" };
    for (x, name) in columns(rect).into_iter().zip(["corners", "mean", third, "tilt"]) {
        let at = pos2(x, rect.center().y);
        ui.painter().text(at, Align2::RIGHT_CENTER, name, font::regular(font::CAPTION), t.text3);
    }
    ui.painter().hline(rect.x_range(), rect.bottom(), Stroke::new(1.0, t.line));
}

/// Right edges of the numbers.
fn columns(rect: Rect) -> [f32; 4] {
    let right = rect.right() - 10.0;
    [right - 114.0, right - 79.0, right - 32.0, right]
}

fn row(
    cx: &mut Cx<'_>,
    ui: &mut Ui,
    rect: Rect,
    response: &egui::Response,
    row: &Row,
    selected: Option<FrameId>,
) {
    let t = cx.t;
    let is_selected = selected == Some(row.id);
    let says = row.badge.map_or("", |b| b.0);
    let name = format!("{} {says} {}", row.name, row.why);
    response.widget_info(|| egui::WidgetInfo::selected(egui::Role::ListItem, true, is_selected, name.trim()));
    if response.clicked() {
        cx.select(row.id);
    }
    if !row.why.is_empty() {
        response.clone().on_hover_text(&row.why);
    } else if let Some(effect) = row.effect() {
        response.clone().on_hover_text(effect);
    }
    let painter = ui.painter();
    if is_selected {
        painter.rect_filled(rect, 0.0, t.accent_fill);
        painter.rect_filled(Rect::from_min_size(rect.min, vec2(2.0, ROW)), 0.0, t.accent);
    } else if response.hovered() {
        painter.rect_filled(rect, 0.0, t.ctl);
    }
    let quiet = !row.used;
    let thumb = Rect::from_center_size(pos2(rect.left() + 55.0, rect.center().y), vec2(48.0, 36.0));
    thumbnail(cx, ui, thumb, row.id, quiet);
    let painter = ui.painter();
    let ink = if quiet { t.text2 } else { t.ink };
    let left = rect.left() + 87.0;
    let badge = row.badge.map(|(word, level)| {
        (
            painter.layout_no_wrap(word.to_owned(), font::regular(font::SMALL), t.text2),
            widgets::level(t, level).1,
        )
    });
    let badge_room = badge.as_ref().map_or(0.0, |(word, _)| word.size().x + 18.0);
    let name = shortened(painter, &row.name, rect.right() - 10.0 - badge_room - left);
    painter.text(pos2(left, rect.top() + 13.0), Align2::LEFT_CENTER, name, font::medium(font::BODY), ink);
    if let Some((word, color)) = badge {
        let at = pos2(rect.right() - 10.0 - word.size().x, rect.top() + 13.0);
        painter.circle_filled(at - vec2(7.0, 0.0), 3.0, color);
        painter.galley(at - vec2(0.0, word.size().y / 2.0), word, t.text2);
    }
    let y = rect.top() + 31.0;
    if quiet && !row.why.is_empty() {
        elided(
            painter,
            pos2(left, y),
            rect.right() - 10.0 - left,
            &row.why,
            font::regular(font::SMALL),
            t.text3,
        );
    } else {
        for (x, number) in columns(rect).into_iter().zip(&row.numbers) {
            painter.text(pos2(x, y), Align2::RIGHT_CENTER, number, font::regular(font::SMALL), t.text2);
        }
    }
    eye(cx, ui, pos2(rect.left() + 15.0, rect.center().y), row);
}

/// A name, cut in its middle where it is too long: names of pictures differ at their ends.
fn shortened(painter: &egui::Painter, name: &str, width: f32) -> String {
    let fits = |s: &str| {
        painter.layout_no_wrap(s.to_owned(), font::medium(font::BODY), Color32::WHITE).size().x <= width
    };
    if fits(name) {
        return name.to_owned();
    }
    let letters: Vec<char> = name.chars().collect();
    let cut = |kept: usize| -> String {
        let tail = (kept / 2).min(6);
        let head = letters[..kept - tail].iter();
        head.chain(&['…']).chain(&letters[letters.len() - tail..]).collect()
    };
    (1..letters.len()).rev().map(cut).find(|s| fits(s)).unwrap_or_default()
}

/// One line, cut with … where it is too long.
fn elided(painter: &egui::Painter, at: Pos2, width: f32, content: &str, font: egui::FontId, color: Color32) {
    let mut job = egui::text::LayoutJob::simple_singleline(content.to_owned(), font, color);
    job.wrap = egui::text::TextWrapping::truncate_at_width(width);
    let galley = painter.layout_job(job);
    painter.galley(at - vec2(0.0, galley.size().y / 2.0), galley, color);
}

fn eye(cx: &mut Cx<'_>, ui: &mut Ui, at: Pos2, row: &Row) {
    let t = cx.t;
    let rect = Rect::from_center_size(at, vec2(24.0, 26.0));
    let response = ui.interact(rect, ui.scope_id().with(("eye", row.id.0)), Sense::click());
    let name = format!("{} {}", if row.excluded { "Use" } else { "Set aside" }, row.name);
    response.widget_info(|| egui::WidgetInfo::selected(egui::Role::CheckBox, true, !row.excluded, &name));
    let color = if response.hovered() { t.ink } else { t.text3 };
    let glyph = if row.excluded { icon::EYE_SLASH } else { icon::EYE };
    ui.painter().text(at, Align2::CENTER_CENTER, glyph, font::regular(15.0), color);
    let id = row.id;
    if response.on_hover_text(name).clicked() {
        cx.edit(|d| d.toggle(id));
    }
}

/// A thumbnail, cut to its place.
pub fn thumbnail(cx: &mut Cx<'_>, ui: &Ui, place: Rect, id: FrameId, quiet: bool) {
    let t: &Tokens = cx.t;
    ui.painter().rect_filled(place, 3.0, t.canvas);
    let Some(texture) = cx.textures.thumbnail(ui, id, &cx.state.data) else { return };
    let size = texture.size_vec2();
    // The middle of the picture fills the place.
    let part = vec2(
        (place.width() / place.height() * size.y / size.x).min(1.0),
        (place.height() / place.width() * size.x / size.y).min(1.0),
    );
    let uv = Rect::from_center_size(pos2(0.5, 0.5), part);
    let tint = if quiet { Color32::from_white_alpha(110) } else { Color32::WHITE };
    egui::Image::new((texture.id(), size)).uv(uv).tint(tint).corner_radius(3.0).paint_at(ui, place);
}
