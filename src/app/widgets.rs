//! Small parts that several panels use.

use egui::{Align2, Color32, Pos2, Rect, Response, RichText, Sense, Stroke, Ui, Vec2, pos2, vec2};

use super::style::{Tokens, font, icon};
use crate::calib::number::with_sigma;

/// A button that shows only an icon; `name` is its tooltip and accessible name.
pub fn icon_button(ui: &mut Ui, t: &Tokens, glyph: &str, name: &str, enabled: bool) -> Response {
    let color = if enabled { t.text2 } else { t.line2 };
    let button = egui::Button::new(RichText::new(glyph).font(font::regular(17.0)).color(color))
        .fill(Color32::TRANSPARENT)
        .min_size(vec2(26.0, 26.0));
    let response = ui.add_enabled(enabled, button).on_hover_text(name);
    named(&response, egui::Role::Button, enabled, name);
    response
}

/// The one button of a screen that stands out.
pub fn primary(ui: &mut Ui, t: &Tokens, glyph: &str, text: &str, height: f32) -> Response {
    let label = format!("{glyph}  {text}");
    let text_of = RichText::new(label).font(font::medium(font::BODY)).color(t.on_ink);
    let response = ui.add(egui::Button::new(text_of).fill(t.ink).min_size(vec2(0.0, height)));
    named(&response, egui::Role::Button, true, text);
    response
}

/// A button with an icon before its text.
pub fn button(ui: &mut Ui, t: &Tokens, glyph: &str, text: &str, height: f32) -> Response {
    let label = if glyph.is_empty() { text.to_owned() } else { format!("{glyph}  {text}") };
    let text_of = RichText::new(label).font(font::medium(font::BODY)).color(t.ink);
    let response = ui.add(egui::Button::new(text_of).min_size(vec2(0.0, height)));
    named(&response, egui::Role::Button, true, text);
    response
}

/// A toggle, one of a row: filled when on.
pub fn toggle(ui: &mut Ui, t: &Tokens, on: bool, text: &str) -> Response {
    let color = if on { t.ink } else { t.text2 };
    let font = if on { font::medium(font::BODY) } else { font::regular(font::BODY) };
    let fill = if on { t.ctl } else { Color32::TRANSPARENT };
    let response = ui.add(
        egui::Button::new(RichText::new(text).font(font).color(color))
            .fill(fill)
            .corner_radius(4.0)
            .min_size(vec2(0.0, 24.0)),
    );
    response.widget_info(|| egui::WidgetInfo::selected(egui::Role::Button, true, on, text));
    response
}

/// A row of choices of which one is on; answers the one that was clicked.
pub fn segmented(ui: &mut Ui, t: &Tokens, names: &[&str], on: usize) -> Option<usize> {
    let mut clicked = None;
    egui::Frame::new().fill(t.ctl).corner_radius(5.0).inner_margin(2.0).show(ui, |ui| {
        ui.spacing_mut().item_spacing.x = 0.0;
        ui.spacing_mut().interact_size.y = 18.0;
        ui.horizontal(|ui| {
            // In a row from the right the last comes first.
            let backwards = ui.layout().prefer_right_to_left();
            for k in 0..names.len() {
                let i = if backwards { names.len() - 1 - k } else { k };
                let name = &names[i];
                let here = i == on;
                let text = RichText::new(*name).font(font::regular(font::SMALL)).color(if here {
                    t.ink
                } else {
                    t.text2
                });
                let fill = if here { t.bg } else { Color32::TRANSPARENT };
                let button = egui::Button::new(text).fill(fill).corner_radius(4.0).min_size(vec2(0.0, 20.0));
                let response = ui.add(button);
                response
                    .widget_info(|| egui::WidgetInfo::selected(egui::Role::RadioButton, true, here, *name));
                if response.clicked() {
                    clicked = Some(i);
                }
            }
        });
    });
    clicked
}

/// A key as printed on a keyboard.
pub fn key_cap(ui: &mut Ui, t: &Tokens, key: &str) -> Response {
    let galley = ui.painter().layout_no_wrap(key.to_owned(), font::regular(font::CAPTION), t.text3);
    let size = vec2((galley.size().x + 8.0).max(16.0), 16.0);
    let (rect, response) = ui.allocate_exact_size(size, Sense::hover());
    ui.painter().rect_stroke(rect, 3.0, Stroke::new(1.0, t.line2), egui::StrokeKind::Inside);
    ui.painter().galley(rect.center() - galley.size() / 2.0, galley, t.text3);
    response
}

/// Gives a painted thing a name for people who do not see it, and for tests.
pub fn named(response: &Response, role: egui::Role, enabled: bool, name: &str) {
    response.widget_info(|| egui::WidgetInfo::labeled(role, enabled, name));
}

/// Whether a change of a slider is a step of undo: the first one of a drag, and every one that is no drag. To be asked in every
/// frame, because a drag begins before anything changes.
pub fn begins(ui: &Ui, response: &Response) -> bool {
    let id = response.id.with("drag begins");
    if response.drag_started() {
        ui.data_mut(|d| d.insert_temp(id, true));
    }
    response.changed() && (!response.dragged() || ui.data_mut(|d| d.remove_temp::<bool>(id)).is_some())
}

/// Text in one style.
pub fn text(content: impl Into<String>, font: egui::FontId, color: Color32) -> RichText {
    RichText::new(content).font(font).color(color)
}

/// A caption: small and quiet.
pub fn caption(ui: &mut Ui, t: &Tokens, content: impl Into<String>) -> Response {
    ui.label(text(content, font::regular(font::CAPTION), t.text3))
}

/// A label on a picture or a map; it stays inside `inside`.
pub fn plate(painter: &egui::Painter, inside: Rect, at: Pos2, anchor: Align2, content: &str) {
    use super::style::{ON_PLATE, PLATE};
    let galley = painter.layout_no_wrap(content.to_owned(), font::regular(font::CAPTION), ON_PLATE);
    let size = galley.size() + vec2(10.0, 4.0);
    let mut rect = anchor.anchor_size(at, size);
    let shift = |low: f32, high: f32, from: f32, to: f32| (from - low).max(0.0) - (high - to).max(0.0);
    rect = rect.translate(vec2(
        shift(rect.left(), rect.right(), inside.left() + 2.0, inside.right() - 2.0),
        shift(rect.top(), rect.bottom(), inside.top() + 2.0, inside.bottom() - 2.0),
    ));
    painter.rect_filled(rect, 3.0, PLATE);
    painter.galley(rect.min + vec2(5.0, 2.0), galley, ON_PLATE);
}

/// A vertical colour bar with its labels to the right; `at` gives the colour for 0 (bottom) to 1 (top).
pub fn color_bar(ui: &Ui, t: &Tokens, rect: Rect, labels: &[(f32, String)], at: impl Fn(f64) -> Color32) {
    let painter = ui.painter();
    let n = 64;
    for i in 0..n {
        let [low, high] = [i, i + 1].map(|k| rect.bottom() - rect.height() * k as f32 / n as f32);
        let part = Rect::from_min_max(pos2(rect.left(), high), pos2(rect.right(), low + 1.0));
        painter.rect_filled(part.intersect(rect), 0.0, at((f64::from(i) + 0.5) / f64::from(n)));
    }
    for (share, label) in labels {
        let y = rect.bottom() - rect.height() * share;
        // Inside, also where there is hardly room.
        let y = y.min(rect.bottom() - 5.0).max(rect.top() + 5.0);
        let font = font::regular(font::CAPTION);
        painter.text(pos2(rect.right() + 5.0, y), Align2::LEFT_CENTER, label, font, t.text3);
    }
}

/// What an empty place says: what it will show and how to get there.
pub fn empty(ui: &mut Ui, t: &Tokens, content: &str) {
    let rect = ui.available_rect_before_wrap();
    let font = font::regular(font::SMALL);
    let galley = ui.painter().layout(content.to_owned(), font, t.text3, (rect.width() - 16.0).max(40.0));
    let at = rect.center() - galley.size() / 2.0;
    let response = ui.allocate_rect(rect, Sense::hover());
    named(&response, egui::Role::Label, true, content);
    ui.painter().galley(at, galley, t.text3);
}

/// The largest rectangle of this shape in the middle of another.
pub fn fit(inside: Rect, shape: Vec2) -> Rect {
    let scale = (inside.width() / shape.x).min(inside.height() / shape.y).max(0.0);
    Rect::from_center_size(inside.center(), shape * scale)
}

/// The largest rectangle of this shape in the upper left corner of another.
pub fn fit_top_left(inside: Rect, shape: Vec2) -> Rect {
    let middle = fit(inside, shape);
    middle.translate(inside.min - middle.min)
}

/// All of a texture.
pub const WHOLE: Rect = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));

/// A number for people: a true minus sign.
pub fn minus(number: impl Into<String>) -> String {
    number.into().replace('-', "−")
}

/// `533.00` and `0.41`: value and σ rounded alike, with a true minus sign.
pub fn value_sigma(value: f64, sigma: f64) -> [String; 2] {
    with_sigma(value, sigma).map(minus)
}

/// Two significant digits with bounds: `<0.001`, `±0.15`, `±11`, `>100`, also where nothing is known.
pub fn certainty(px: Option<f64>) -> String {
    match px {
        Some(px) if px < 0.001 => "<0.001".to_owned(),
        Some(px) if px < 0.01 => format!("±{px:.3}"),
        Some(px) if px < 100.0 => format!("±{}", crate::calib::number::significant(px, 2)),
        _ => ">100".to_owned(),
    }
}

/// Icon and colour of a level.
pub fn level(t: &Tokens, level: crate::calib::diagnose::Level) -> (&'static str, Color32) {
    use crate::calib::diagnose::Level;
    match level {
        Level::Good => (icon::CHECK_CIRCLE, t.ok),
        Level::Info => (icon::INFO, t.text3),
        Level::Warn => (icon::WARNING, t.warn),
        Level::Bad => (icon::OCTAGON, t.bad),
    }
}

/// A text field; answers its text when it was changed and left.
pub fn typed(ui: &mut Ui, id: &str, shown: &str, hint: &str, width: f32) -> (Response, Option<String>) {
    let id = egui::Id::unique(id);
    let mut buffer = ui.data(|d| d.get_temp::<String>(id)).unwrap_or_else(|| shown.to_owned());
    let edit = egui::TextEdit::singleline(&mut buffer)
        .desired_width(width)
        .min_size(egui::vec2(width, 0.0))
        .hint_text(hint)
        .id(id.with("edit"));
    let response = ui.add(edit);
    if response.has_focus() {
        ui.data_mut(|d| d.insert_temp(id, buffer));
    } else if response.lost_focus() {
        ui.data_mut(|d| d.remove::<String>(id));
        if buffer != shown {
            return (response, Some(buffer));
        }
    }
    (response, None)
}

/// The same with its label.
pub fn field(ui: &mut Ui, label: &str, id: &str, shown: &str, hint: &str) -> Option<String> {
    ui.horizontal(|ui| {
        let name = ui.label(label);
        let right = egui::Layout::right_to_left(egui::Align::Center);
        ui.with_layout(right, |ui| {
            let (response, answer) = typed(ui, id, shown, hint, 110.0);
            response.labelled_by(name.id);
            answer
        })
        .inner
    })
    .inner
}
