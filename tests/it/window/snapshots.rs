//! Pictures of the window, in both themes: each page of each panel comes from the registry.

use egui::Theme;
use straightedge::app::{
    panels::PANELS,
    screen::{Dialog, ExportPart, Screen},
};

use super::{demonstrated, picture, window};

const SIZE: [f32; 2] = [1280.0, 720.0];

fn name(theme: Theme, what: &str) -> String {
    let theme = if theme == Theme::Dark { "dark" } else { "light" };
    format!("{}_{theme}", what.to_lowercase().replace([' ', '/'], "-"))
}

fn every_page(theme: Theme) {
    let mut window = demonstrated(SIZE, theme);
    window.state_mut().state.data.took_ms = None;
    let mut shoot = |screen: Screen, what: &str| {
        window.state_mut().act(straightedge::app::action::Action::Show(Box::new(screen)));
        super::settle(&mut window);
        window.state_mut().state.data.took_ms = None;
        picture(&mut window, &name(theme, what));
    };
    for panel in &PANELS {
        for (i, page) in panel.pages.iter().enumerate() {
            let mut screen = Screen { center: panel.tile, ..Screen::default() };
            screen.pages[panel.tile.index()] = i;
            shoot(screen, &format!("{} {}", panel.title.replace(" / ", "-"), page.name));
        }
    }
    shoot(Screen { sheet: true, ..Screen::default() }, "sheet");
    shoot(Screen { more: true, ..Screen::default() }, "more");
    let export = Dialog::Export { part: ExportPart::Camera, format: 0 };
    for (dialog, what) in [(export, "export"), (Dialog::Shortcuts, "shortcuts"), (Dialog::Board, "board")] {
        shoot(Screen { dialog: Some(dialog), ..Screen::default() }, what);
    }
}

#[test]
fn every_page_dark() {
    every_page(Theme::Dark);
}

#[test]
fn every_page_light() {
    every_page(Theme::Light);
}

#[test]
fn empty() {
    for theme in [Theme::Dark, Theme::Light] {
        let mut window = window(SIZE, theme);
        picture(&mut window, &name(theme, "empty"));
    }
}
