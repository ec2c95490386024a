//! Work is never lost.

use std::time::Duration;

use egui::Theme;
use straightedge::app::{
    action::{Action, Command, demo},
    session::Session,
};

use super::{click, key, opened, pictures, says, settle, until, window, with_home};

const SIZE: [f32; 2] = [1000.0, 700.0];

#[test]
fn a_session_opens_where_it_was_without_reading_pictures_again() {
    let folder = tempfile::tempdir().unwrap();
    let [before, after] = ["before", "after"].map(|name| folder.path().join(name));
    std::fs::create_dir(&before).unwrap();
    pictures(&before, 0..5);
    let mut window = window(SIZE, Theme::Dark);
    opened(&mut window, vec![before.clone()]);
    click(&mut window, "Set aside view_02");
    settle(&mut window);
    let told = window.state().state.data.answer.clone().unwrap();
    let file = folder.path().join("mine.straightedge");
    std::fs::write(&file, Session::of(&window.state().state).to_json()).unwrap();

    // The folder moved: its pictures are found by their hash.
    std::fs::rename(&before, &after).unwrap();
    let mut session = Session::from_json(&std::fs::read_to_string(&file).unwrap(), "mine").unwrap();
    session.locate(folder.path());
    assert_eq!(session.missing(), 5);
    std::fs::rename(after.join("view_01.png"), after.join("other name.png")).unwrap();
    session.locate(&after);
    assert_eq!(session.missing(), 0);
    let mut window = super::window(SIZE, Theme::Dark);
    window.state_mut().act(Action::Restore(Box::new(session)));
    settle(&mut window);
    let now = window.state().state.data.answer.clone().unwrap();
    assert_eq!(now.key, told.key);
    assert_eq!(now.solution(), told.solution());
    assert_eq!(window.state().state.data.thumbnails.len(), 5);
}

#[test]
fn a_damaged_session_leaves_everything_as_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let home = folder.path().join("home");
    let mut window = with_home(SIZE, Theme::Dark, Vec::new(), Some(home));
    window.state_mut().act(Action::Open(demo()));
    settle(&mut window);
    let before = key(&window);
    let file = folder.path().join("mine.straightedge");
    std::fs::write(&file, "{\"format\":\"straightedge session\",\"vers").unwrap();
    window.state_mut().act(Action::Do(Command::OpenPaths(vec![file.clone()])));
    until(&mut window, |app| app.state.screen.notice.is_some());
    window.run_ok();
    assert!(says(&window, "mine.straightedge"));
    assert_eq!(key(&window), before);
    assert!(!says(&window, "Open the last good copy"), "there is none yet");
}

#[test]
fn a_killed_run_is_taken_up_again() {
    let folder = tempfile::tempdir().unwrap();
    let home = folder.path().join("home");
    let mut window = with_home(SIZE, Theme::Dark, Vec::new(), Some(home.clone()));
    window.state_mut().act(Action::Open(demo()));
    settle(&mut window);
    click(&mut window, "Set aside view_04");
    settle(&mut window);
    let before = window.state().state.data.answer.clone().unwrap();
    // A second is what a kill may cost.
    let autosave = home.join("autosave.straightedge");
    for _ in 0..100 {
        window.step();
        std::thread::sleep(Duration::from_millis(20));
        let text = std::fs::read_to_string(&autosave).unwrap_or_default();
        if Session::from_json(&text, "").is_ok_and(|s| s.document.excluded.len() == 1 && s.seen.len() == 15) {
            break;
        }
    }
    drop(window);
    let mut window = with_home(SIZE, Theme::Dark, Vec::new(), Some(home));
    settle(&mut window);
    let after = window.state().state.data.answer.clone().unwrap();
    assert_eq!(after.solution(), before.solution());
    assert!(says(&window, "without being closed"));
}

#[test]
fn an_orderly_end_leaves_nothing_behind() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = with_home(SIZE, Theme::Dark, Vec::new(), Some(folder.path().to_owned()));
    window.state_mut().act(Action::Open(demo()));
    settle(&mut window);
    eframe::App::on_exit(window.state_mut());
    drop(window);
    let window = with_home(SIZE, Theme::Dark, Vec::new(), Some(folder.path().to_owned()));
    assert!(window.state().state.doc.frames.is_empty());
}
