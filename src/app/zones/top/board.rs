//! The board: which one, as the pictures show it or as the user says, and its square.

use egui::Ui;

use super::chip;
use crate::{
    app::{
        cx::Cx,
        files::tell_bad,
        state::Answer,
        style::{font, icon},
        widgets::{field, text},
    },
    calib::{
        Error, Result,
        board::{Design, Kind},
        marker::dictionary::Dictionary,
        report::Settings,
        target::{Length, Target, Unit},
    },
};

/// In an empty field: the pictures tell.
const MEASURED: &str = "as pictured";

fn known<'a>(cx: &'a Cx<'_>) -> Option<&'a Settings> {
    Some(&cx.state.data.answer.as_deref().map(Answer::report)?.settings)
}

/// The board as it is known: the last answer's, or what was said.
fn name(cx: &Cx<'_>) -> Option<String> {
    if let Some(target) = known(cx).and_then(Settings::target) {
        return Some(target.name());
    }
    let target = cx.state.doc.board?.target(Length { value: 1.0, unit: Unit::Squares }, 1.0).ok()?;
    Some(target.name())
}

/// The edge of a square as it is known.
fn square(cx: &Cx<'_>) -> Option<Length> {
    cx.state.doc.square.or_else(|| {
        let known = known(cx)?;
        (known.unit != Unit::Squares).then_some(Length { value: known.square, unit: known.unit })
    })
}

/// In a few words.
pub(super) fn words(cx: &Cx<'_>) -> String {
    let name = name(cx).unwrap_or_else(|| "Board".to_owned());
    square(cx).map_or_else(|| name.clone(), |square| format!("{name}, {square}"))
}

/// The chip.
pub(super) fn board(cx: &mut Cx<'_>, ui: &mut Ui) {
    let guessed = cx.state.doc.board.is_none() && name(cx).is_some();
    let quiet = match (guessed, cx.state.doc.square) {
        (true, None) => "guessed",
        (true, Some(_)) => "size guessed",
        (false, _) => "",
    };
    chip(cx, ui, ["Board", icon::BOARD], &words(cx), quiet, settings);
}

/// The board, to be chosen and typed.
pub(in crate::app::zones) fn settings(cx: &mut Cx<'_>, ui: &mut Ui) {
    let t = cx.t;
    ui.label(text("Board", font::semibold(font::BODY), t.ink));
    let target = known(cx).and_then(Settings::target);
    let words = target.as_ref().map(Target::words).unwrap_or_default();
    if !words.is_empty() {
        ui.label(text(words, font::regular(font::SMALL), t.text2));
    }
    let seen = target.as_ref().and_then(Design::of);
    let kind = kind(ui, cx.state.doc.board.or(seen).map_or(Kind::Checkerboard, |d| d.kind));
    let given = cx.state.doc.board.filter(|d| d.kind == kind);
    let seen = seen.filter(|d| d.kind == kind).map(|d| Design::new(kind, d.size));
    if let Some(change) = design(ui, kind, given.or(seen), cx.state.doc.square) {
        match change.and_then(|design| design.map(Design::findable).transpose()) {
            Ok(design) => cx.edit(|d| d.board = design),
            Err(error) => cx.push(tell_bad(error.to_string())),
        }
    }
    if kind == Kind::Checkerboard {
        ui.label(text("Where four squares meet, columns x rows", font::regular(font::SMALL), t.text3));
    }
    if cx.state.doc.board.is_some() && ui.button("Guess from the pictures").clicked() {
        ui.data_mut(|d| d.remove::<Kind>(chosen()));
        cx.edit(|d| d.board = None);
    }
    ui.separator();
    let shown = cx.state.doc.square.map(|s| s.to_string()).unwrap_or_default();
    if let Some(text) = field(ui, kind.length(), "square size", &shown, "25 mm") {
        match text.parse::<Length>() {
            Ok(length) => cx.edit(|d| d.square = Some(length)),
            Err(_) if text.trim().is_empty() => cx.edit(|d| d.square = None),
            Err(error) => cx.push(tell_bad(error.to_string())),
        }
    }
    ui.label(text("Scales distances only, not the camera", font::regular(font::SMALL), t.text3));
}

/// Where the kind is kept that was chosen but has no size yet.
fn chosen() -> egui::Id {
    egui::Id::unique("kind of board in the pictures")
}

/// The kind that is shown and can be chosen.
fn kind(ui: &mut Ui, known: Kind) -> Kind {
    let mut kind = ui.data(|d| d.get_temp::<Kind>(chosen())).unwrap_or(known);
    // No list that drops down: egui holds one popup open at a time, and this is in one.
    ui.horizontal_wrapped(|ui| {
        for k in Kind::ALL {
            ui.selectable_value(&mut kind, k, k.title());
        }
    });
    ui.data_mut(|d| {
        if kind == known {
            d.remove::<Kind>(chosen());
        } else {
            d.insert_temp(chosen(), kind);
        }
    });
    kind
}

/// What a board of a kind is made of; answers what was changed, none to guess it.
fn design(
    ui: &mut Ui,
    kind: Kind,
    now: Option<Design>,
    square: Option<Length>,
) -> Option<Result<Option<Design>>> {
    let mut change = None;
    let shown = now.map(|d| d.size.to_string()).unwrap_or_default();
    if let Some(text) = field(ui, kind.counts(), &format!("size of {kind}"), &shown, kind.usual_size()) {
        let design = |size| Some(Design { size, ..now.unwrap_or(Design::new(kind, size)) });
        change = Some(if text.trim().is_empty() { Ok(None) } else { text.parse().map(design) });
    }
    let Some(now) = now else { return change };
    if kind.has_markers() {
        let shown = now.dictionary.map(Dictionary::name).unwrap_or_default();
        if let Some(text) = field(ui, "Dictionary", &format!("dictionary of {kind}"), shown, MEASURED) {
            let dictionary = if text.trim().is_empty() { Ok(None) } else { text.parse().map(Some) };
            change = Some(dictionary.map(|dictionary| Some(Design { dictionary, ..now })));
        }
    }
    if let Some(name) = kind.inner_title() {
        let shown = now.inner.map(|share| inner(share, square)).unwrap_or_default();
        if let Some(text) = field(ui, name, &format!("inside of {kind}"), &shown, MEASURED) {
            let inner = if text.trim().is_empty() { Ok(None) } else { share(&text, square).map(Some) };
            change = Some(inner.map(|inner| Some(Design { inner, ..now })));
        }
    }
    change
}

/// A share of the square as a length, where the square has one.
fn inner(share: f64, square: Option<Length>) -> String {
    square.map_or_else(|| share.to_string(), |square| square.times(share).to_string())
}

/// A length, or a share where it has no unit, as a share of the square.
fn share(text: &str, square: Option<Length>) -> Result<f64> {
    let length: Length = text.parse()?;
    let Some(metres) = length.unit.metres() else { return Ok(length.value) };
    let square = square.and_then(|s| Some(s.unit.metres()? * s.value)).ok_or_else(|| {
        Error::Invalid(
            "write a share of the square, for example 0.75, or say first how large the square is".to_owned(),
        )
    })?;
    Ok(metres * length.value / square)
}
