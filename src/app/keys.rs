//! The keyboard.

use egui::{Event, Key, KeyboardShortcut, Modifiers, Ui};

use super::{
    action::{Action, Command},
    files::pasted_paths,
    panels::PANELS,
    screen::{Dialog, ExportPart, Screen},
    state::State,
    zones::pictures,
};

/// What was typed, while no text field has the keyboard.
pub(super) fn actions(state: &State, ui: &Ui) -> Vec<Action> {
    let mut actions = Vec::new();
    if ui.egui_wants_keyboard_input() {
        return actions;
    }
    let chord = |modifiers, key| ui.input_mut(|i| i.consume_shortcut(&KeyboardShortcut::new(modifiers, key)));
    let shift = Modifiers::COMMAND.plus(Modifiers::SHIFT);
    // The longer one first: the shorter would take it.
    if chord(shift, Key::Z) || chord(Modifiers::COMMAND, Key::Y) {
        actions.push(Action::Redo);
    }
    if chord(Modifiers::COMMAND, Key::Z) {
        actions.push(Action::Undo);
    }
    if chord(Modifiers::COMMAND, Key::O) {
        actions.push(Action::Do(Command::PickFolder));
    }
    if chord(Modifiers::COMMAND, Key::S) && !state.doc.frames.is_empty() {
        actions.push(Action::Do(Command::SaveSession));
    }
    let pasted: Vec<String> = ui.input(|i| {
        let paste = |e: &Event| if let Event::Paste(text) = e { Some(text.clone()) } else { None };
        i.events.iter().filter_map(paste).collect()
    });
    for text in pasted {
        let paths = pasted_paths(&text);
        if paths.is_empty() {
            actions
                .push(super::files::tell_bad("What was pasted is no path of a folder or picture".to_owned()));
        } else {
            actions.push(Action::Do(Command::OpenPaths(paths)));
        }
    }
    let mut screen = state.screen.clone();
    let pressed = |key| ui.input_mut(|i| i.consume_key(Modifiers::NONE, key));
    if chord(Modifiers::COMMAND, Key::E) && state.data.solved().is_some() {
        screen.dialog = Some(Dialog::Export { part: ExportPart::Camera, format: 0 });
    }
    if ui.input(|i| i.events.iter().any(|e| matches!(e, Event::Text(t) if t == "?"))) {
        screen.dialog = Some(Dialog::Shortcuts);
    }
    if screen.dialog.is_none() && !state.doc.frames.is_empty() {
        for (key, panel) in [Key::Num1, Key::Num2, Key::Num3, Key::Num4, Key::Num5].into_iter().zip(&PANELS) {
            if pressed(key) {
                screen.center = panel.tile;
            }
        }
        if ui.memory(|m| m.focused().is_none()) {
            if pressed(Key::Escape) {
                escape(&mut screen);
            }
            if pressed(Key::ArrowDown) {
                step(state, &mut screen, 1);
            }
            if pressed(Key::ArrowUp) {
                step(state, &mut screen, -1);
            }
            for (key, by) in [(Key::ArrowLeft, -1), (Key::ArrowRight, 1)] {
                if pressed(key) {
                    step_corner(state, &mut screen, by);
                }
            }
            if (pressed(Key::Delete) || pressed(Key::Backspace))
                && let (Some(id), Some(index)) = (state.selected(), screen.corner)
            {
                let mut doc = state.doc.clone();
                doc.toggle_corner(id, index);
                actions.push(Action::Edit(Box::new(doc)));
            }
            if pressed(Key::Space)
                && let Some(id) = state.selected()
            {
                let mut doc = state.doc.clone();
                doc.toggle(id);
                actions.push(Action::Edit(Box::new(doc)));
            }
        }
        for (key, on) in [
            (Key::C, &mut screen.layers.corners as &mut bool),
            (Key::O, &mut screen.layers.order),
            (Key::R, &mut screen.layers.reprojected),
            (Key::S, &mut screen.layers.straightened),
            (Key::A, &mut screen.sheet),
        ] {
            if pressed(key) {
                *on = !*on;
            }
        }
    }
    if screen != state.screen {
        actions.push(Action::Show(Box::new(screen)));
    }
    actions
}

fn escape(screen: &mut Screen) {
    if screen.center != super::panels::Tile::Picture {
        screen.center = super::panels::Tile::Picture;
    } else if screen.view.is_some() {
        screen.view = None;
    } else {
        screen.sheet = false;
    }
}

/// Selects the picture below or above in the list.
fn step(state: &State, screen: &mut Screen, by: isize) {
    let rows = pictures::rows(state);
    let at = rows.iter().position(|r| Some(r.id) == state.selected());
    let next = at.map_or(0, |i| i.saturating_add_signed(by).min(rows.len().saturating_sub(1)));
    if let Some(row) = rows.get(next) {
        (screen.selected, screen.corner) = (Some(row.id), None);
    }
}

/// Selects the corner before or after on the board, around its end.
fn step_corner(state: &State, screen: &mut Screen, by: isize) {
    let frame = state.selected().and_then(|id| state.data.answer.as_deref()?.frame(id));
    if let Some((frame, at)) = frame.and_then(|f| Some((f, state.corner_of(f)?))) {
        let next = (at as isize + by).rem_euclid(frame.corners.len() as isize);
        screen.corner = Some(frame.corners[next as usize].index);
    }
}
