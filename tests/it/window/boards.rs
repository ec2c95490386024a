//! Boards of all kinds, and lenses that are not ordinary, in the window.

use egui::{Key, Modifiers, Theme, accesskit::Role};
use egui_kittest::{Harness, kittest::Queryable as _};
use straightedge::{
    app::{
        App,
        action::Action,
        panels::Tile,
        screen::{Dialog, Screen},
    },
    calib::{
        board::Kind,
        camera::{Camera, Model},
        synth::{self, Scene, poses},
        target::Target,
    },
    job::Source,
};
use tempfile::TempDir;

use super::{click, opened, picture, says, settle, window};
use crate::boards::photographs;

const SIZE: [f32; 2] = [1280.0, 720.0];

/// A window with photographs of a board.
fn with_board(board: &str, theme: Theme) -> (Harness<'static, App>, TempDir) {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path().join("photographs");
    std::fs::create_dir(&folder).unwrap();
    for (i, photograph) in photographs(board).iter().enumerate() {
        let png = synth::png(photograph, false).unwrap();
        std::fs::write(folder.join(format!("board_{}.png", i + 1)), png).unwrap();
    }
    let mut window = window(SIZE, theme);
    opened(&mut window, vec![folder]);
    window.state_mut().state.data.took_ms = None;
    (window, place)
}

fn target(window: &Harness<'_, App>) -> Target {
    window.state().state.data.answer.as_ref().unwrap().report().settings.target().unwrap()
}

/// Opens a list and takes an entry of it.
fn choose(window: &mut Harness<'_, App>, list: &str, entry: &str) {
    window.get_by_role_and_label(Role::ComboBox, list).click();
    window.run_ok();
    window.get_all_by_label(entry).last().unwrap().click();
    settle(window);
}

/// Types into a field.
fn fill(window: &mut Harness<'_, App>, field: &str, words: &str) {
    window.get_by_label(field).focus();
    window.run_ok();
    window.key_press_modifiers(Modifiers::COMMAND, Key::A);
    window.get_by_label(field).type_text(words);
    window.run_ok();
    window.key_press(Key::Enter);
    settle(window);
}

#[test]
fn a_charuco_board_is_found_and_can_be_said() {
    let (mut window, _folder) = with_board("charuco:8x6:4x4_100:marker=0.7", Theme::Dark);
    assert_eq!(target(&window).name(), "ChArUco 8 × 6");
    let found = window.state().state.data.solved().unwrap().1.rms_px;
    assert!(found < 0.3, "{found}");
    window.get_by_role_and_label(Role::Button, "Board, ChArUco 8 × 6 guessed").click();
    settle(&mut window);
    picture(&mut window, "board_charuco_dark");
    fill(&mut window, "Dictionary", "5x5_50");
    assert!(says(&window, "Board contradicted"), "the pictures show another dictionary");
    assert!(window.state().state.data.solved().is_none());
    fill(&mut window, "Dictionary", "4x4_250");
    assert_eq!(window.state().state.doc.board.unwrap().to_string(), "charuco:8x6:4x4_250");
    assert!((window.state().state.data.solved().unwrap().1.rms_px - found).abs() < 1e-9);
    click(&mut window, "Guess from the pictures");
    settle(&mut window);
    assert!(window.state().state.doc.board.is_none());
    click(&mut window, Kind::Circles.title());
    assert!(window.state().state.doc.board.is_none(), "a kind alone is no board");
    assert!(says(&window, "Spacing"));
}

#[test]
fn circles_are_found() {
    let (mut window, _folder) = with_board("acircles:4x11", Theme::Light);
    assert_eq!(target(&window).name(), "Circles 4 × 11");
    assert!(window.state().state.data.solved().unwrap().1.rms_px < 0.3);
    picture(&mut window, "board_circles_light");
}

#[test]
fn a_fisheye_lens_is_recognised_and_straightened_as_one_likes() {
    let mut scene = Scene::seed();
    let params = vec![210.0, 210.0, 399.5, 299.5, 0.02, -0.004, 0.0, 0.0];
    scene.camera = Camera::new(Model::Kb4, [800, 600], params).unwrap();
    scene.poses = poses::random(15, &scene.camera, &scene.board, 3).unwrap();
    let scene = std::sync::Arc::new(scene);
    let views = (0..15).map(|view| Source::View { scene: scene.clone(), view }).collect();
    let mut window = window(SIZE, Theme::Dark);
    window.state_mut().act(Action::Open(views));
    settle(&mut window);
    let (_, solution) = window.state().state.data.solved().unwrap();
    assert_eq!(solution.camera.model, Model::Kb4);
    window.state_mut().act(Action::Show(Box::new(Screen { center: Tile::Lens, ..Screen::default() })));
    settle(&mut window);
    click(&mut window, "Equidistant");
    click(&mut window, "by field of view");
    settle(&mut window);
    assert_eq!(window.state().state.doc.fov_deg, Some(90.0));
    window.state_mut().state.data.took_ms = None;
    picture(&mut window, "lens_fisheye_dark");
    click(&mut window, "by α");
    assert_eq!(window.state().state.doc.fov_deg, None);
}

#[test]
fn every_board_can_be_printed() {
    let mut window = window(SIZE, Theme::Dark);
    let screen = Screen { dialog: Some(Dialog::Board), ..Screen::default() };
    window.state_mut().act(Action::Show(Box::new(screen)));
    settle(&mut window);
    for kind in Kind::ALL.into_iter().filter(|k| *k != Kind::Checkerboard) {
        choose(&mut window, "Kind", kind.title());
        assert!(says(&window, kind.inner_title().unwrap()), "{kind}");
        assert!(says(&window, "Save PDF"), "{kind}");
        if kind == Kind::Charuco {
            picture(&mut window, "print_charuco_dark");
            window.get_by_label("Edge of a marker").focus();
            window.run_ok();
            window.get_by_label("Edge of a marker").type_text("25 mm");
            window.run_ok();
            assert!(says(&window, "a marker of 25 mm does not fit a board of 20 mm: give 6 mm to 19 mm"));
            assert!(!says(&window, "Save PDF"));
        }
    }
}
