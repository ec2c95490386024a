//! What a panel gets: the state to read, and where its actions go.

use std::time::Duration;

use super::{
    action::{Action, Command},
    screen::Screen,
    state::{Document, State},
    style::Tokens,
    textures::Textures,
};
use crate::calib::observation::FrameId;

/// Handed to every panel.
pub struct Cx<'a> {
    /// What there is to draw.
    pub state: &'a State,
    /// Colours.
    pub t: &'static Tokens,
    /// Pictures on the graphics card.
    pub textures: &'a mut Textures,
    /// What happened.
    actions: Vec<Action>,
    /// Changes of this frame, gathered: two panels may change different parts.
    screen: Option<Screen>,
    doc: Option<(Document, bool)>,
}

impl<'a> Cx<'a> {
    /// For one frame.
    pub fn new(state: &'a State, t: &'static Tokens, textures: &'a mut Textures) -> Self {
        Self { state, t, textures, actions: Vec::new(), screen: None, doc: None }
    }

    /// Whether `part` of the window is drawn in this frame. A page compiles what it has never drawn while it draws it: without a camera
    /// and with one, parts come up one in a frame, so that no frame holds the page up; in between the browser shows what is
    /// drawn.
    pub fn its_turn(&self, ui: &egui::Ui, part: &'static str) -> bool {
        if !cfg!(target_arch = "wasm32") {
            return true;
        }
        let solved = self.state.data.solved().is_some();
        let pass = ui.ctx().cumulative_pass_nr();
        let turn = ui.data_mut(|d| {
            let (drawn, last): &mut (Vec<&'static str>, u64) =
                d.get_temp_mut_or_default(egui::Id::unique(("first frames", solved)));
            let new = !drawn.contains(&part);
            if new && *last != pass {
                drawn.push(part);
                *last = pass;
                return true;
            }
            !new
        });
        if !turn {
            ui.ctx().request_repaint_after(Duration::from_millis(40));
        }
        turn
    }

    /// Reports something.
    pub fn push(&mut self, action: Action) {
        self.actions.push(action);
    }

    /// Asks the application for something.
    pub fn ask(&mut self, command: Command) {
        self.push(Action::Do(command));
    }

    /// Changes what is on the screen.
    pub fn show(&mut self, change: impl FnOnce(&mut Screen)) {
        change(self.screen.get_or_insert_with(|| self.state.screen.clone()));
    }

    /// Selects a picture everywhere.
    pub fn select(&mut self, id: FrameId) {
        self.show(|s| {
            if s.selected != Some(id) {
                (s.selected, s.corner) = (Some(id), None);
            }
        });
    }

    /// Changes the document: one step of undo.
    pub fn edit(&mut self, change: impl FnOnce(&mut Document)) {
        self.change(change, true);
    }

    /// Changes the document while something is dragged; `begins` makes the step of undo.
    pub fn drag(&mut self, begins: bool, change: impl FnOnce(&mut Document)) {
        self.change(change, begins);
    }

    fn change(&mut self, change: impl FnOnce(&mut Document), step: bool) {
        let (doc, steps) = self.doc.get_or_insert_with(|| (self.state.doc.clone(), false));
        change(doc);
        *steps |= step;
    }

    /// Everything that happened.
    pub fn into_actions(self) -> Vec<Action> {
        let mut actions = self.actions;
        if let Some(screen) = self.screen {
            actions.insert(0, Action::Show(Box::new(screen)));
        }
        if let Some((doc, step)) = self.doc {
            let doc = Box::new(doc);
            actions.insert(0, if step { Action::Edit(doc) } else { Action::Drag(doc) });
        }
        actions
    }
}
