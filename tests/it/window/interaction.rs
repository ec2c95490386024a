//! From a click to what it changes.

use std::{path::Path, sync::Arc};

use egui::{Key, Modifiers, Theme};
use egui_kittest::{Harness, kittest::Queryable as _};
use straightedge::{
    app::{
        App,
        action::Action,
        lab::Part,
        panels::{PANELS, Tile},
        screen::{Beside, Earlier, Screen},
    },
    calib::{
        Error,
        camera::Model,
        compare::Answer,
        diagnose::{Level, Remedy, Show, sources::Source},
        format::{self, Evidence, Export},
        html,
        safe::widest_alpha,
        synth::{self, Method, Scene},
        undistort::Framing,
    },
    job::Reply,
};

use super::{click, demonstrated, drop_on, is_on, key, opened, pictures, says, settle, until, window};

const SIZE: [f32; 2] = [1280.0, 720.0];

#[test]
fn the_demo_fills_the_list_and_knows_the_truth() {
    let mut window = window(SIZE, Theme::Dark);
    window.run_ok();
    assert!(says(&window, "Drop a folder of board pictures"));
    click(&mut window, "Try the demo");
    settle(&mut window);
    for name in ["view_01", "view_09"] {
        assert!(says(&window, name), "{name}");
    }
    let state = &window.state().state;
    let (answer, solution) = state.data.solved().unwrap();
    assert_eq!(answer.report().included().count(), 15);
    assert!(solution.rms_px < 0.012 && solution.truth.len() == 9);
    click(&mut window, "more");
    assert!(says(&window, "Against the truth"));
}

#[test]
fn a_dropped_folder_is_calibrated_and_broken_files_say_why() {
    let folder = tempfile::tempdir().unwrap();
    pictures(folder.path(), 0..5);
    std::fs::write(folder.path().join("broken.png"), b"\x89PNG\r\n\x1a\nnot really").unwrap();
    std::fs::write(folder.path().join("empty.jpg"), b"").unwrap();
    std::fs::write(folder.path().join("notes.txt"), b"no picture").unwrap();
    let mut window = window(SIZE, Theme::Dark);
    window.run_ok();
    drop_on(&mut window, folder.path().to_owned());
    until(&mut window, |app| !app.state.doc.frames.is_empty());
    settle(&mut window);
    let state = &window.state().state;
    assert_eq!(state.doc.frames.len(), 7);
    let report = state.data.answer.as_ref().unwrap().report();
    assert_eq!(report.included().count(), 5);
    assert!(report.solution.is_some());
    for name in ["broken", "empty"] {
        let frame = report.frames.iter().find(|f| f.name().starts_with(name)).unwrap();
        assert!(!frame.included && frame.why.len() > 10, "{}", frame.why);
        assert!(says(&window, &frame.why), "{}", frame.why);
    }
}

#[test]
fn what_is_no_picture_says_so_and_leaves_what_is_open() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("notes.txt"), b"no picture").unwrap();
    let mut window = demonstrated(SIZE, Theme::Dark);
    let before = key(&window);
    drop_on(&mut window, folder.path().to_owned());
    until(&mut window, |app| app.state.screen.notice.is_some());
    window.run_ok();
    assert!(says(&window, "No pictures in"));
    assert_eq!(key(&window), before);
    click(&mut window, "Dismiss");
    assert!(!says(&window, "No pictures in"));
}

#[test]
fn setting_aside_is_undone_bit_for_bit() {
    let mut window = demonstrated(SIZE, Theme::Dark);
    let before = window.state().state.data.answer.clone().unwrap();
    click(&mut window, "Set aside view_03");
    settle(&mut window);
    let without = window.state().state.data.answer.clone().unwrap();
    assert_eq!(without.report().included().count(), 14);
    assert_ne!(before.solution().unwrap().camera, without.solution().unwrap().camera);
    let rows = straightedge::app::zones::pictures::rows(&window.state().state);
    // It stays where it is under the pointer.
    assert_eq!((rows[2].name.as_str(), rows[2].why.as_str()), ("view_03", "set aside by you"));
    click(&mut window, "Undo");
    settle(&mut window);
    let after = window.state().state.data.answer.clone().unwrap();
    assert!(std::sync::Arc::ptr_eq(&before, &after), "the same answer, not a new one");
    click(&mut window, "Redo");
    settle(&mut window);
    assert!(std::sync::Arc::ptr_eq(&without, window.state().state.data.answer.as_ref().unwrap()));
    window.key_press(Key::Space);
    window.run_ok();
    settle(&mut window);
    assert_eq!(window.state().state.doc.excluded.len(), 2, "the space bar sets the selected one aside");
}

#[test]
fn a_picture_with_another_zoom_is_named_and_heads_the_list() {
    let folder = tempfile::tempdir().unwrap();
    pictures(folder.path(), 0..12);
    let mut zoomed = Scene::seed();
    zoomed.camera.params[0] *= 1.05;
    zoomed.camera.params[1] *= 1.05;
    let png = synth::png(&synth::render(&zoomed, 4).unwrap(), false).unwrap();
    std::fs::write(folder.path().join(zoomed.file_name(4)), png).unwrap();
    let mut window = window(SIZE, Theme::Dark);
    opened(&mut window, vec![folder.path().to_owned()]);
    assert!(says(&window, "view_05 pulls the camera away") && says(&window, "view_05 harmful"));
    let first = |window: &_| straightedge::app::zones::pictures::rows(state(window))[0].clone();
    assert_eq!(first(&window).name, "view_01");
    click(&mut window, "Sort");
    click(&mut window, "Influence");
    let (row, moves) = (first(&window), first(&window).influence.unwrap().moves_px);
    assert_eq!((row.name.as_str(), row.badge), ("view_05", Some(("harmful", Level::Bad))));
    assert!(row.numbers[2].parse::<f64>().unwrap() > 0.9 * moves && moves > 0.1);
    // In the list and beside the finding.
    window.get_all_by_label("Set aside view_05").last().unwrap().click();
    settle(&mut window);
    assert!(!says(&window, "pulls the camera away") && says(&window, "1 picture is set aside"));
    // Known answers come back with all that was said of them.
    click(&mut window, "Undo");
    println!(
        "{:?} {:?}",
        state(&window).data.answer.as_ref().unwrap().evidence.findings,
        straightedge::app::zones::pictures::rows(state(&window))
            .iter()
            .map(|r| (r.name.clone(), r.badge, r.influence))
            .collect::<Vec<_>>()
    );
    assert!(says(&window, "view_05 pulls the camera away"));
}

fn state<'a>(
    window: &'a egui_kittest::Harness<'static, straightedge::app::App>,
) -> &'a straightedge::app::state::State {
    &window.state().state
}

#[test]
fn sources_of_error_are_ranked_with_what_helps() {
    let mut window = demonstrated(SIZE, Theme::Dark);
    let sources = state(&window).data.answer.as_ref().unwrap().report().sources.clone().unwrap();
    assert!(!sources.faults.iter().any(|f| f.found), "the demo has no fault: {:#?}", sources.faults);
    let index = Tile::Errors.index();
    let mut screen = Screen { center: Tile::Errors, ..Screen::default() };
    screen.pages[index] = PANELS[index].pages.iter().position(|p| p.name == "Sources").unwrap();
    window.state_mut().act(Action::Show(Box::new(screen)));
    settle(&mut window);
    let first = &sources.cards[0];
    assert!(says(&window, &format!("{}: {}", first.title, first.cost())), "{first:?}");
}

#[test]
fn the_lens_is_a_choice() {
    let mut window = demonstrated(SIZE, Theme::Dark);
    let title = Model::Brown5.spec().title;
    click(&mut window, &format!("Lens, {title}"));
    settle(&mut window);
    window.get_by_role_and_label(egui::accesskit::Role::RadioButton, Model::Pinhole.spec().title).click();
    settle(&mut window);
    let (_, solution) = window.state().state.data.solved().unwrap();
    assert_eq!(solution.camera.model, Model::Pinhole);
    assert!(solution.rms_px > 0.1, "the demo's lens bends: {}", solution.rms_px);
}

#[test]
fn a_square_is_typed_as_people_write_it() {
    let mut window = demonstrated(SIZE, Theme::Dark);
    let distance = |window: &egui_kittest::Harness<'_, straightedge::app::App>| {
        window.state().state.data.answer.as_ref().unwrap().report().frames[0].distance.unwrap()
    };
    let board = window.get_all_by_label_contains("9 × 6").next().unwrap();
    board.click();
    window.run_ok();
    let fx = window.state().state.data.solved().unwrap().1.camera.params[0];
    for (typed, edge) in [("25,4 mm", 25.4), ("1 in", 1.0)] {
        window.get_by_label("Edge of a square").focus();
        window.run_ok();
        window.key_press_modifiers(Modifiers::COMMAND, Key::A);
        window.get_by_label("Edge of a square").type_text(typed);
        window.run_ok();
        window.key_press(Key::Enter);
        settle(&mut window);
        assert_eq!(window.state().state.doc.square.map(|s| s.value), Some(edge), "{typed}");
        let camera = &window.state().state.data.solved().unwrap().1.camera;
        assert!((camera.params[0] - fx).abs() < 1e-6 * fx, "the square scales distances only");
        let report = window.state().state.data.answer.as_ref().unwrap().report().clone();
        assert!((report.settings.square - edge).abs() < 1e-12 && distance(&window) > 5.0 * edge);
    }
}

#[test]
fn reading_can_be_cancelled_and_gone_on_with() {
    let mut window = window(SIZE, Theme::Dark);
    window.state_mut().act(Action::Open(straightedge::app::action::demo()));
    until(&mut window, |app| app.state.data.inspections.len() >= 2);
    click(&mut window, "Cancel");
    until(&mut window, |app| !app.is_busy());
    let read = window.state().state.data.inspections.len();
    assert!(read < 15, "{read}");
    click(&mut window, "Go on");
    settle(&mut window);
    assert_eq!(window.state().state.data.inspections.len(), 15);
    assert!(window.state().state.data.solved().is_some());
}

#[test]
fn keys_and_tiles_swap_panels() {
    let mut window = demonstrated(SIZE, Theme::Dark);
    for (key, tile) in [
        (Key::Num2, Tile::Poses),
        (Key::Num3, Tile::Errors),
        (Key::Num4, Tile::Coverage),
        (Key::Num5, Tile::Lens),
        (Key::Escape, Tile::Picture),
    ] {
        window.key_press(key);
        window.run_ok();
        assert_eq!(window.state().state.screen.center, tile);
    }
    let errors = window.get_all_by_label_contains("Errors, ").next().unwrap();
    errors.click();
    window.run_ok();
    assert_eq!(window.state().state.screen.center, Tile::Errors);
    window.key_press(Key::Escape);
    window.key_press(Key::ArrowDown);
    window.run_ok();
    assert_eq!(window.state().state.selected().map(|id| id.0), Some(1));
    window.key_press(Key::ArrowRight);
    window.run_ok();
    let after_worst = window.state().state.screen.corner.unwrap();
    for (key, at) in [(Key::ArrowRight, after_worst + 1), (Key::ArrowLeft, after_worst)] {
        window.key_press(key);
        window.run_ok();
        assert_eq!(window.state().state.screen.corner, Some(at % 54));
    }
    let before = is_on(&window, "Order");
    click(&mut window, "Order");
    assert_ne!(is_on(&window, "Order"), before);
}

#[test]
fn a_corner_is_dropped_and_restored() {
    let mut window = demonstrated(SIZE, Theme::Dark);
    let before = key(&window);
    click(&mut window, "Drop corner");
    settle(&mut window);
    let corners: usize =
        window.state().state.data.answer.as_ref().unwrap().report().included().map(|f| f.corners.len()).sum();
    assert_eq!(corners, 15 * 54 - 1);
    assert!(says(&window, "Restore corner") && !says(&window, "Drop corner"));
    window.key_press(Key::Delete);
    settle(&mut window);
    assert_eq!(key(&window), before);
}

#[test]
fn more_pictures_are_added_to_those_that_are_open() {
    let folder = tempfile::tempdir().unwrap();
    pictures(folder.path(), 0..4);
    let mut window = window(SIZE, Theme::Dark);
    let all: Vec<_> = std::fs::read_dir(folder.path()).unwrap().map(|e| e.unwrap().path()).collect();
    opened(&mut window, all[..2].to_vec());
    assert_eq!(window.state().state.doc.frames.len(), 2);
    opened(&mut window, all.clone());
    until(&mut window, |app| app.state.doc.frames.len() == 4);
    settle(&mut window);
    assert_eq!(window.state().state.data.answer.as_ref().unwrap().report().included().count(), 4);
}

#[test]
fn the_threshold_is_dragged_and_undone_in_one_step() {
    let mut window = demonstrated(SIZE, Theme::Dark);
    window.key_press(Key::Num3);
    window.run_ok();
    assert!(says(&window, "No picture lies above 1.00 px"));
    let pill = window.get_by_label("Threshold, px").rect().center();
    window.drag_at(pill);
    window.step();
    for down in [20.0, 60.0, 110.0] {
        window.hover_at(pill + egui::vec2(0.0, down));
        window.step();
    }
    window.drop_at(pill + egui::vec2(0.0, 110.0));
    window.run_ok();
    let state = &window.state().state;
    let threshold = state.doc.threshold_px;
    assert!(threshold < 0.01, "{threshold}");
    assert_eq!(state.past.len(), 1, "one drag is one step");
    click(&mut window, "Undo");
    assert_eq!(window.state().state.doc.threshold_px, 1.0);
    window.get_by_label("Threshold, px").set_value_accesskit(0.001);
    window.run_ok();
    assert!((window.state().state.doc.threshold_px - 0.001).abs() < 1e-12);
    click(&mut window, "Undo");
}

#[test]
fn every_export_reads_back() {
    use straightedge::{app::export::preview, calib::format};
    let mut window = demonstrated(SIZE, Theme::Dark);
    click(&mut window, "Export…");
    for (i, known) in format::FORMATS.iter().enumerate() {
        click(&mut window, known.title);
        assert!(says(&window, "Read back, it projects"), "{}", known.title);
        let answer = window.state().state.data.answer.clone().unwrap();
        let preview = preview(&answer, i).unwrap().unwrap();
        let read = format::read(&preview.text, &preview.name).unwrap();
        assert_eq!(read.format, known.name);
        assert_eq!(read.camera.size_px, [800, 600]);
        assert!((read.camera.params[0] - 1000.0).abs() < 0.5, "{}", known.name);
        assert_eq!(format::by_name(known.name).unwrap().title, known.title);
    }
    click(&mut window, "OpenCV-Python");
    assert!(says(&window, "import cv2"));
    window.key_press(Key::Escape);
    window.run_ok();
    assert!(window.state().state.screen.dialog.is_none());
}

#[test]
fn the_lab_shows_where_half_a_pixel_comes_from() {
    let mut window = demonstrated(SIZE, Theme::Dark);
    let exact = window.state().state.data.answer.clone().unwrap();
    click(&mut window, "Menu");
    click(&mut window, "Lab");
    click(&mut window, "Crude, cut");
    settle(&mut window);
    let rms = window.state().state.data.solved().unwrap().1.rms_px;
    assert!((0.3..0.6).contains(&rms), "the document's 0.48 px: {rms}");
    let corners = window.state().state.data.solved().unwrap().1.truth_corners;
    assert!(corners.is_some_and(|c| c.rms > 0.3) && says(&window, "px RMS from the truth"), "{corners:?}");
    // One stroke, one step of undo; the exact answer is the same one again.
    click(&mut window, "Undo");
    settle(&mut window);
    let again = window.state().state.data.answer.clone().unwrap();
    assert_eq!(exact.solution().unwrap().camera, again.solution().unwrap().camera);
    assert!(window.state().state.doc.scene().is_some_and(|s| s.method == Method::Exact));
}

#[test]
fn a_layout_is_unlocked_and_put_back() {
    let mut window = demonstrated(SIZE, Theme::Dark);
    click(&mut window, "Menu");
    click(&mut window, "View");
    click(&mut window, "Unlock layout");
    assert!(window.state().state.screen.unlocked);
    // All panels at once; those with room show a page with its tabs.
    let tabs = ["Picture", "Poses", "Errors", "Coverage", "Before / after"];
    assert!(tabs.iter().all(|tab| window.query_all_by_label(tab).next().is_some()));
    assert!(says(&window, "Reprojected") && !says(&window, "Certainty"));
    click(&mut window, "Menu");
    click(&mut window, "View");
    click(&mut window, "Lock layout");
    assert!(!window.state().state.screen.unlocked);
    assert!(says(&window, "Coverage, corners per cell"), "the tiles are back");
}

#[test]
fn a_slider_of_the_lab_is_one_step_of_undo() {
    let mut window = demonstrated(SIZE, Theme::Dark);
    click(&mut window, "Menu");
    click(&mut window, "Lab");
    let slider = window.get_by_role_and_label(egui::accesskit::Role::Slider, "Noise").rect();
    let from = slider.left_center() + egui::vec2(6.0, 0.0);
    window.drag_at(from);
    window.step();
    for right in [0.0, 15.0, 30.0, 40.0] {
        window.hover_at(from + egui::vec2(right, 0.0));
        window.step();
    }
    window.drop_at(from + egui::vec2(40.0, 0.0));
    settle(&mut window);
    let noise = |window: &egui_kittest::Harness<'_, straightedge::app::App>| {
        window.state().state.doc.scene().unwrap().degrade.noise
    };
    assert!(noise(&window) > 5.0, "{}", noise(&window));
    assert_eq!(window.state().state.past.len(), 1, "one drag is one step");
    let noisy = window.state().state.data.solved().unwrap().1.rms_px;
    assert!(noisy > 0.008, "{noisy}");
    click(&mut window, "Undo");
    settle(&mut window);
    assert_eq!(noise(&window), 0.0);
    assert!(window.state().state.data.solved().unwrap().1.rms_px < 0.005);
}

#[test]
fn the_next_picture_is_asked_for_until_the_goal_is_reached() {
    let folder = tempfile::tempdir().unwrap();
    pictures(folder.path(), 0..4);
    let mut window = window(SIZE, Theme::Dark);
    opened(&mut window, vec![folder.path().to_owned()]);
    let advice = |window: &_| state(window).data.advice.clone().unwrap().1;
    let first = advice(&window);
    assert_eq!(first.state, straightedge::calib::advice::State::Next);
    assert!(says(&window, "What to photograph next") && says(&window, &first.sentence));
    click(&mut window, "Show the pose");
    assert_eq!(state(&window).screen.center, Tile::Coverage);
    assert!(says(&window, &format!("Next picture. {}", first.sentence)));
    // A goal that is reached asks for nothing more; nonsense is told.
    for (typed, says_so) in [("enough", "is not a goal"), ("1000px, centre", "No more pictures are needed.")]
    {
        window.get_by_label("Goal").focus();
        window.run_ok();
        window.key_press_modifiers(Modifiers::COMMAND, Key::A);
        window.get_by_label("Goal").type_text(typed);
        window.run_ok();
        window.key_press(Key::Enter);
        settle(&mut window);
        assert!(says(&window, says_so), "{typed}");
    }
    assert!(!says(&window, "What to photograph next"));
    assert_eq!(state(&window).doc.goal.to_string(), "1000px,centre");
    click(&mut window, "Undo");
    settle(&mut window);
    assert_eq!(advice(&window).sentence, first.sentence);
}

#[test]
fn a_dropped_camera_file_is_compared() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = demonstrated(SIZE, Theme::Dark);
    let report = window.state().state.data.answer.as_ref().unwrap().report().clone();
    let mut zoomed = report.solution.as_ref().unwrap().camera.clone();
    zoomed.params[..2].iter_mut().for_each(|f| *f *= 1.01);
    let export = Export { camera: &zoomed, evidence: &Evidence::default(), report: None };
    let yaml = format::write(format::by_name("opencv").unwrap(), &export).unwrap().text;
    let mut drop = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        window.state_mut().state.screen.earlier = Earlier::default();
        drop_on(&mut window, path);
        until(&mut window, |app| {
            app.state.screen.earlier.shown().is_some() || app.state.screen.notice.is_some()
        });
        settle(&mut window);
        ["No longer valid", "Still valid", "no camera file format", "straightedge convert --scale"]
            .into_iter()
            .filter(|words| says(&window, words))
            .collect::<Vec<_>>()
    };
    assert_eq!(drop("zoomed.yaml", &yaml), ["No longer valid"]);
    assert_eq!(drop("report.html", &html::page(&report)), ["Still valid"]);
    assert_eq!(
        drop(
            "other.yaml",
            &yaml
                .replace("image_width: 800", "image_width: 400")
                .replace("image_height: 600", "image_height: 300")
        ),
        ["straightedge convert --scale"]
    );
    assert_eq!(drop("notes.txt", "no camera"), ["no camera file format"]);
    click(&mut window, "Dismiss");
    // The pictures are still open.
    assert_eq!(window.state().state.doc.frames.len(), 15);
    assert!(says(&window, "Is it still the same camera?") && says(&window, "Open camera files…"));
}

/// The camera of the pictures as an earlier calibration, with another focal length.
fn calibrated_before(window: &Harness<'_, App>, name: &str, days: f64, focal: f64) -> Action {
    let mut report = window.state().state.data.answer.as_ref().unwrap().report().clone();
    report.solution.as_mut().unwrap().camera.params[..2].iter_mut().for_each(|f| *f *= focal);
    Action::Beside(Box::new(Beside::read(Path::new(name), report.to_json(), Some(days)).unwrap()))
}

#[test]
fn earlier_calibrations_are_shown_over_time() {
    let mut window = demonstrated(SIZE, Theme::Dark);
    let [zoomed, same] = [("zoomed.json", 100.0, 1.01), ("same.json", 200.0, 1.0)]
        .map(|(name, days, focal)| calibrated_before(&window, name, days, focal));
    window.state_mut().act(zoomed);
    settle(&mut window);
    // One of them is held against the pictures at once.
    assert!(says(&window, "No longer valid: the focal length moved by"));
    window.state_mut().act(same);
    settle(&mut window);
    assert!(says(&window, "2 of 2 differ from it by more than chance") && says(&window, "1970-04-11"));
    let field = window.get_by_role_and_label(egui::accesskit::Role::TextInput, "Temperature of same.json");
    field.focus();
    field.type_text("21,5");
    window.run_ok();
    window.key_press(Key::Enter);
    settle(&mut window);
    assert_eq!(state(&window).screen.earlier.list[1].1, Some(21.5));
    window.get_by_label("same.json").click();
    settle(&mut window);
    assert!(says(&window, "Still valid: the new pictures fit to"));
    click(&mut window, "Over time");
    settle(&mut window);
    click(&mut window, "Close zoomed.json");
    settle(&mut window);
    assert!(says(&window, "Steady: the others agree with the first") && !says(&window, "zoomed.json"));
    // Calibrations of another camera are no series: the reason is told, and they can be taken away.
    let mut report = state(&window).data.answer.as_ref().unwrap().report().clone();
    report.solution.as_mut().unwrap().camera.size_px = [400, 300];
    let half = Beside::read(Path::new("half.json"), report.to_json(), None).unwrap();
    window.state_mut().act(Action::Beside(Box::new(half)));
    settle(&mut window);
    assert!(says(&window, "straightedge convert --scale"));
    click(&mut window, "Close half.json");
    settle(&mut window);
    assert!(says(&window, "Steady"));
}

/// Two pictures have no camera of their own, but an earlier one can be held against them.
#[test]
fn two_pictures_tell_whether_a_calibration_holds() {
    let mut window = demonstrated(SIZE, Theme::Dark);
    let list = [("zoomed.json", 1.05), ("same.json", 1.0)]
        .map(|(name, focal)| calibrated_before(&window, name, 100.0, focal));
    let mut doc = state(&window).doc.clone();
    doc.excluded = Arc::new(doc.frames.iter().skip(2).map(|f| f.id).collect());
    window.state_mut().act(Action::Edit(Box::new(doc)));
    settle(&mut window);
    for (beside, answer) in list.into_iter().zip([Answer::Recalibrate, Answer::StillValid]) {
        window.state_mut().state.screen.earlier = Earlier::default();
        window.state_mut().act(beside);
        settle(&mut window);
        let found = state(&window).data.validity.as_ref().unwrap().1.as_ref().unwrap();
        assert_eq!((found.answer, found.pictures), (answer, 2), "{}", found.sentence);
    }
}

/// α stops where no corner supports what is shown; a second drag goes on.
#[test]
fn alpha_stops_at_the_safe_region() {
    let mut window = demonstrated(SIZE, Theme::Dark);
    // Corners as if they had been everywhere but in the corners of the picture.
    let mut answer = window.state().state.data.answer.as_deref().unwrap().clone();
    let around = (0..90).map(|i| f64::from(i) / 90.0 * std::f64::consts::TAU);
    let polygon: Vec<[f64; 2]> = around.map(|a| [399.5 + 480.0 * a.cos(), 299.5 + 480.0 * a.sin()]).collect();
    let solution = answer.evidence.report.solution.as_mut().unwrap();
    let most = widest_alpha(&solution.camera, &Framing::flat(0.0), &polygon).unwrap().unwrap();
    assert!(most > 0.05 && most < 0.9, "{most}");
    solution.safe_region.as_mut().unwrap().polygon_px = polygon;
    window.state_mut().state.data.answer = Some(Arc::new(answer));
    let mut doc = window.state().state.doc.clone();
    doc.alpha = 0.0;
    window.state_mut().act(Action::Edit(Box::new(doc)));
    window.state_mut().act(Action::Show(Box::new(Screen { center: Tile::Lens, ..Screen::default() })));
    settle(&mut window);
    let mut drag = |from: f32, to: f32| {
        let slider = window.get_by_role_and_label(egui::accesskit::Role::Slider, "α").rect();
        let at = |share: f32| slider.left_center() + egui::vec2(share * slider.width(), 0.0);
        window.drag_at(at(from));
        window.step();
        for part in [0.0, 0.25, 0.5, 0.75, 1.0] {
            window.hover_at(at(from + (to - from) * part));
            window.step();
        }
        window.drop_at(at(to));
        settle(&mut window);
        window.state().state.doc.alpha
    };
    assert_eq!(drag(0.04, 0.97), most);
    assert!(drag(most as f32, 0.97) > 0.9);
    // Within the region it moves freely, and stops again.
    assert!(drag(0.97, 0.04) < most);
    assert_eq!(drag(0.04, 0.97), most);
}

#[test]
fn a_twin_is_drawn_and_can_be_cancelled() {
    let mut window = window(SIZE, Theme::Dark);
    window.state_mut().act(Action::Open(straightedge::app::action::demo()[..5].to_vec()));
    settle(&mut window);
    let screen = Screen { lab: Some(Part::Twin), ..Screen::default() };
    window.state_mut().act(Action::Show(Box::new(screen)));
    window.run_ok();
    click(&mut window, "Draw it 30 times");
    until(&mut window, |app| app.state.data.progress.is_some_and(|p| p.1 > 0.0));
    assert!(state(&window).data.twin.is_none());
    click(&mut window, "Cancel the twin");
    settle(&mut window);
    assert!(state(&window).data.twin.is_none() && state(&window).screen.twin.is_none());
    click(&mut window, "Draw it 30 times");
    settle(&mut window);
    let outcome = state(&window).data.twin.clone().unwrap().1.unwrap();
    assert_eq!((outcome.pictures, outcome.runs + outcome.failed), (5, 30));
    assert!(says(&window, "your σ") && says(&window, "lower left corner"));
}

/// What stands beside a source of error is done: its evidence is shown, and its remedy changes the document.
#[test]
fn sources_show_their_evidence_and_mend() {
    let mut window = window(SIZE, Theme::Dark);
    window.state_mut().act(Action::Open(straightedge::app::action::demo()[..6].to_vec()));
    settle(&mut window);
    let errors = Tile::Errors.index();
    let mut sources = Screen { center: Tile::Errors, ..Screen::default() };
    sources.pages[errors] = PANELS[errors].pages.iter().position(|p| p.name == "Sources").unwrap();
    let open = |window: &mut Harness<'static, App>| {
        window.state_mut().act(Action::Show(Box::new(sources.clone())));
        window.run_ok();
    };
    open(&mut window);
    let answer = state(&window).data.answer.clone().unwrap();
    let cards = answer.report().sources.as_ref().unwrap().cards.clone();
    for (k, card) in cards.iter().enumerate() {
        open(&mut window);
        // The answer's findings beside it have buttons of the same name: those of the page are in the centre.
        let shows = |window: &Harness<'static, App>| {
            let all = window.get_all_by_label("Show").map(|n| n.rect()).filter(|r| r.left() < 960.0);
            let mut all: Vec<egui::Rect> = all.collect();
            all.sort_by(|a, b| a.top().total_cmp(&b.top()));
            all
        };
        assert_eq!(shows(&window).len(), cards.len());
        // Those below are scrolled to.
        let node = window.get_all_by_label("Show").find(|n| n.rect() == shows(&window)[k]).unwrap();
        node.scroll_to_me();
        window.run_ok();
        let at = shows(&window)[k].center();
        window.drag_at(at);
        window.drop_at(at);
        window.run_ok();
        let screen = &state(&window).screen;
        let page = PANELS[screen.center.index()].pages[screen.pages[screen.center.index()]].name;
        let wanted = match card.show {
            Show::Picture(_) | Show::Pictures => (Tile::Picture, "Picture"),
            Show::Errors => (Tile::Errors, "Overview"),
            Show::Field => (Tile::Errors, "Map"),
            Show::Certainty => (Tile::Coverage, "Certainty"),
            Show::Corners => (Tile::Coverage, "Corners"),
            Show::Diversity => (Tile::Coverage, "Diversity"),
            Show::Lens => (Tile::Lens, "Swipe"),
        };
        assert_eq!((screen.center, page), wanted, "{}", card.title);
    }
    // Six pictures do not tell all terms of the lens.
    let holds = |card: &Source| match &card.remedy {
        Some(Remedy::Hold(names)) => Some((card.remedy.as_ref().unwrap().label(), names.clone())),
        _ => None,
    };
    let (label, names) = cards.iter().find_map(holds).expect("a term of the lens to hold");
    open(&mut window);
    let remedy = window.get_all_by_label(&label).min_by(|a, b| a.rect().left().total_cmp(&b.rect().left()));
    remedy.unwrap().scroll_to_me();
    window.run_ok();
    window
        .get_all_by_label(&label)
        .min_by(|a, b| a.rect().left().total_cmp(&b.rect().left()))
        .unwrap()
        .click();
    settle(&mut window);
    let (now, solution) = state(&window).data.solved().unwrap();
    assert!(names.iter().all(|name| state(&window).doc.holds(name)), "{names:?}");
    assert!(names.iter().all(|name| solution.sigma.get(name) == Some(&None)));
    // What is wrong is measured anew.
    assert!(now.sourced && now.key != answer.key && now.report().sources != answer.report().sources);
    assert_eq!(state(&window).screen.center, Tile::Errors);
}

/// Where nothing can be planned the reason is told, and the camera stands.
#[test]
fn advice_that_fails_says_why() {
    let folder = tempfile::tempdir().unwrap();
    pictures(folder.path(), 0..4);
    let mut window = window(SIZE, Theme::Dark);
    opened(&mut window, vec![folder.path().to_owned()]);
    let key = state(&window).data.advice.as_ref().unwrap().0;
    let result = Err(Error::Crashed("attempt to plan with five sides".to_owned()));
    window.state_mut().act(Action::Finished(Box::new(Reply { key, result })));
    settle(&mut window);
    assert!(says(&window, "could not be planned") && says(&window, "attempt to plan with five sides"));
    assert!(state(&window).data.solved().is_some());
}

/// Where even α = 0 shows what no corner supports, the slider has no place to stop at, and says so.
#[test]
fn alpha_without_a_stop_is_told() {
    let mut window = demonstrated(SIZE, Theme::Dark);
    window.state_mut().act(Action::Show(Box::new(Screen { center: Tile::Lens, ..Screen::default() })));
    settle(&mut window);
    let mut told = |reach: f64, salt: u128| {
        let mut answer = window.state().state.data.answer.as_deref().unwrap().clone();
        let solution = answer.evidence.report.solution.as_mut().unwrap();
        // A rectangle about the middle of the picture, of so many of its sides.
        let side = |x: f64, y: f64| [399.5 + reach * 400.0 * x, 299.5 + reach * 300.0 * y];
        solution.safe_region.as_mut().unwrap().polygon_px =
            vec![side(-1.0, -1.0), side(1.0, -1.0), side(1.0, 1.0), side(-1.0, 1.0)];
        // Or what is known of the answer would stay.
        answer.key.0 ^= salt;
        window.state_mut().state.data.answer = Some(Arc::new(answer));
        window.run_ok();
        says(&window, "0 is not safe either")
    };
    assert!(!told(1.0, 1));
    assert!(told(0.25, 2));
}
