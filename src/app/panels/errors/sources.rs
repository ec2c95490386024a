//! The seven sources of error, ranked by what they cost: evidence, what helps, and the rules of the source document.

use egui::{Align2, CornerRadius, Rect, ScrollArea, Sense, Ui, pos2, vec2};

use super::{NOTHING, heading};
use crate::{
    app::{
        cx::Cx,
        state::Answer,
        style::font,
        widgets::{button, empty, level, minus, named, text},
        zones::answer::{evidence, mend},
    },
    calib::diagnose::sources::{Source, Sources},
};

/// Costs at which a bar is empty and full, px: the scale is logarithmic.
const SCALE_PX: [f64; 2] = [0.001, 10.0];
/// Width of the bars.
const BAR: f32 = 120.0;

/// The page.
pub(super) fn show(cx: &mut Cx<'_>, ui: &mut Ui) {
    let t = cx.t;
    if cx.state.data.solved().is_none() {
        return empty(ui, t, NOTHING);
    }
    let Some(answer) = cx.state.data.answer.clone() else { return };
    let Some(sources) = &answer.report().sources else {
        let words = if answer.sourced { "Not measured for these pictures." } else { "Measuring…" };
        return empty(ui, t, words);
    };
    let quiet = "px of the projection, over the nine tenths of the picture that are known best";
    heading(ui, t, "What the camera may err by", quiet);
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        ui.spacing_mut().item_spacing.y = 2.0;
        for card in &sources.cards {
            ui.add_space(8.0);
            one(cx, ui, &answer, card);
        }
        ui.add_space(12.0);
        parts(cx, ui, sources);
    });
}

fn one(cx: &mut Cx<'_>, ui: &mut Ui, answer: &Answer, card: &Source) {
    let t = cx.t;
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), 20.0), Sense::hover());
    let (glyph, color) = level(t, card.level);
    let y = rect.center().y;
    let painter = ui.painter();
    painter.text(pos2(rect.left() + 7.0, y), Align2::CENTER_CENTER, glyph, font::fill(14.0), color);
    let left = rect.left() + 22.0;
    painter.text(pos2(left, y), Align2::LEFT_CENTER, &card.title, font::medium(font::BODY), t.ink);
    let end = rect.right() - 10.0;
    let number = end - BAR - 12.0;
    painter.text(pos2(number, y), Align2::RIGHT_CENTER, card.cost(), font::regular(font::BODY), t.ink);
    let [low, high] = SCALE_PX.map(f64::ln);
    let share = ((card.px.max(SCALE_PX[0]).ln() - low) / (high - low)).clamp(0.0, 1.0) as f32;
    let bar = |width: f32| Rect::from_min_size(pos2(end - BAR, y - 3.0), vec2(width, 6.0));
    painter.rect_filled(bar(BAR), CornerRadius::same(3), t.line);
    painter.rect_filled(bar(BAR * share), CornerRadius::same(3), color);
    named(&response, egui::Role::Label, true, &format!("{}: {}", card.title, card.cost()));
    ui.horizontal_top(|ui| {
        ui.add_space(22.0);
        ui.vertical(|ui| {
            ui.spacing_mut().item_spacing.y = 2.0;
            let words = if card.advice.is_empty() {
                card.text.clone()
            } else {
                format!("{} {}.", card.text, card.advice)
            };
            ui.label(text(minus(words.as_str()), font::regular(font::SMALL), t.text2));
            ui.horizontal(|ui| {
                if button(ui, t, "", "Show", 20.0).clicked() {
                    evidence(cx, answer, card.show);
                }
                if let Some(remedy) = &card.remedy
                    && button(ui, t, "", &remedy.label(), 20.0).clicked()
                {
                    mend(cx, answer, remedy);
                }
            });
        });
    });
}

/// What the parts of the pictures say, and the rules that were not kept.
fn parts(cx: &Cx<'_>, ui: &mut Ui, sources: &Sources) {
    let t = cx.t;
    let mut say = |words: String| {
        ui.label(text(minus(words.as_str()), font::regular(font::SMALL), t.text2));
    };
    if let Some(words) = sources.cross_words() {
        say(format!("{words}."));
    }
    for rule in sources.rules.iter().filter(|r| !r.kept) {
        say(format!("{}: {}, {}.", rule.text, rule.value, rule.word()));
    }
}
