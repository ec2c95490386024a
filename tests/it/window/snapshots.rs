//! Pictures of the window, in both themes: each page of each panel comes from the registry.

use std::{ops::ControlFlow, path::Path, sync::Arc};

use egui::Theme;
use egui_kittest::{Harness, image_snapshot_options};
use image::imageops;
use straightedge::{
    app::{
        App,
        action::{Action, demo},
        lab::Part,
        panels::{PANELS, Tile},
        screen::{Beside, Dialog, Earlier, ExportPart, Screen},
        state::Frame,
    },
    calib::{
        experiment::ablate::{Numbers, TRIALS},
        observation::FrameId,
    },
    job::{Job, Key, Output, Request, Source, run},
};

use super::{alike, click, demonstrated, picture, says, settle, window};

const SIZE: [f32; 2] = [1280.0, 720.0];
/// The centre of a window of that size: left, top, width, height.
const CENTER: [u32; 4] = [250, 68, 726, 454];

fn name(theme: Theme, what: &str) -> String {
    let theme = if theme == Theme::Dark { "dark" } else { "light" };
    format!("{}_{theme}", what.to_lowercase().replace(" / ", "-").replace(' ', "_"))
}

/// Shows something and waits for it; times are masked.
fn show(window: &mut Harness<'_, App>, screen: Screen) {
    window.state_mut().act(Action::Show(Box::new(screen)));
    settle(window);
    window.state_mut().state.data.took_ms = None;
    window.run_ok();
}

fn every_page(theme: Theme) {
    let mut window = demonstrated(SIZE, theme);
    let report = window.state().state.data.answer.as_ref().unwrap().report().clone();
    let made = |name: &str, days: f64, focal_px: f64, k1: f64| {
        let mut report = report.clone();
        let camera = &mut report.solution.as_mut().unwrap().camera;
        camera.params[..2].iter_mut().for_each(|f| *f += focal_px);
        camera.params[4] += k1;
        Beside::read(Path::new(name), report.to_json(), Some(days)).unwrap()
    };
    let mut earlier = Earlier::default();
    earlier.open(made("last_may.json", 20_580.0, 0.2, 0.002));
    for panel in &PANELS {
        for (i, page) in panel.pages.iter().enumerate() {
            let mut screen = Screen { center: panel.tile, ..Screen::default() };
            screen.pages[panel.tile.index()] = i;
            show(&mut window, screen);
            let name = name(theme, &format!("{} {}", panel.title, page.name));
            if i == 0 {
                picture(&mut window, &name);
            } else {
                // The rest of the window is on the first page's picture.
                let [x, y, w, h] = CENTER;
                let center = imageops::crop_imm(&window.render().unwrap(), x, y, w, h).to_image();
                image_snapshot_options(&center, &name, &alike());
            }
        }
    }
    let mut shoot = |screen: Screen, what: &str| {
        show(&mut window, screen);
        picture(&mut window, &name(theme, what));
    };
    shoot(Screen { sheet: true, ..Screen::default() }, "sheet");
    let mut lens = Screen { center: Tile::Lens, earlier, ..Screen::default() };
    lens.pages[Tile::Lens.index()] = PANELS[Tile::Lens.index()].pages.len() - 1;
    shoot(lens.clone(), "compared");
    for (name, days, focal_px) in
        [("june.json", 20_610.0, 0.01), ("july.json", 20_640.0, -0.02), ("august.json", 20_672.0, 0.15)]
    {
        lens.earlier.open(made(name, days, focal_px, 0.0));
    }
    shoot(lens, "over time");
    shoot(Screen { more: true, ..Screen::default() }, "more");
    let export = |part| Dialog::Export { part, format: 0 };
    for (dialog, what) in [
        (export(ExportPart::Camera), "export"),
        (export(ExportPart::Pictures), "export pictures"),
        (Dialog::Shortcuts, "shortcuts"),
        (Dialog::Board, "board"),
    ] {
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
fn empty_dark() {
    picture(&mut window(SIZE, Theme::Dark), "empty_dark");
}

#[test]
fn empty_light() {
    picture(&mut window(SIZE, Theme::Light), "empty_light");
}

#[test]
fn while_pictures_are_read() {
    let mut window = window(SIZE, Theme::Dark);
    let all = demo();
    window.state_mut().act(Action::Open(all[..6].to_vec()));
    settle(&mut window);
    // More have been opened; nothing plans for them, so the picture stands still.
    let state = &mut window.state_mut().state;
    let frames = all.into_iter().enumerate().map(|(i, source)| Frame { id: FrameId(i as u32), source });
    state.doc.frames = Arc::new(frames.collect());
    state.data.took_ms = None;
    picture(&mut window, "reading_dark");
}

#[test]
fn nothing_can_be_read() {
    let mut window = window(SIZE, Theme::Dark);
    let files = ["IMG_0001.jpg", "IMG_0002.jpg", "IMG_0003.jpg"];
    window.state_mut().act(Action::Open(files.map(|f| Source::File(format!("holiday/{f}").into())).to_vec()));
    settle(&mut window);
    window.state_mut().state.data.took_ms = None;
    picture(&mut window, "nothing_found_dark");
}

/// Few pictures: what to photograph next is in the answer, and the board as it should be held in the centre.
#[test]
fn the_next_picture() {
    let mut window = window(SIZE, Theme::Dark);
    window.state_mut().act(Action::Open(demo()[..4].to_vec()));
    settle(&mut window);
    let coverage = Tile::Coverage.index();
    let mut screen = Screen { center: Tile::Coverage, ..Screen::default() };
    screen.pages[coverage] = PANELS[coverage].pages.iter().position(|p| p.name == "Next picture").unwrap();
    show(&mut window, screen);
    picture(&mut window, "next_picture_dark");
}

/// The demo's pictures over and over, as if they were different ones.
fn many(window: &mut Harness<'_, App>, n: u32) {
    let state = &mut window.state_mut().state;
    let mut doc = state.doc.clone();
    let mut frames = doc.frames.to_vec();
    for id in frames.len() as u32..n {
        let from = &state.doc.frames[id as usize % 15];
        let mut seen = state.data.inspections[&from.id].clone().unwrap().as_ref().clone();
        seen.pixels_hash = u128::from(id);
        // The same corners to the last bit would be a copy.
        for corner in &mut seen.detection.grid.as_mut().unwrap().corners {
            let wobble = (f64::from(id) * 0.7 + f64::from(corner.cell[0] * 31 + corner.cell[1])).sin();
            corner.px.x += 0.05 * wobble;
        }
        state.data.inspections.insert(FrameId(id), Ok(Arc::new(seen)));
        state.data.thumbnails.insert(FrameId(id), state.data.thumbnails[&from.id].clone());
        frames.push(Frame { id: FrameId(id), source: from.source.clone() });
    }
    doc.next_id = n;
    doc.frames = Arc::new(frames);
    window.state_mut().act(Action::Edit(Box::new(doc)));
    settle(window);
}

#[test]
fn two_hundred_pictures() {
    let mut window = demonstrated(SIZE, Theme::Dark);
    many(&mut window, 200);
    show(&mut window, Screen { center: PANELS[2].tile, ..Screen::default() });
    picture(&mut window, "two_hundred_dark");
}

#[test]
fn small_window() {
    let mut window = demonstrated([1024.0, 640.0], Theme::Light);
    window.state_mut().state.data.took_ms = None;
    picture(&mut window, "small_light");
}

#[test]
fn large_window() {
    let mut window = demonstrated([1920.0, 1080.0], Theme::Dark);
    window.state_mut().state.data.took_ms = None;
    picture(&mut window, "large_dark");
}

#[test]
fn at_twice_the_size() {
    let mut window = demonstrated([1920.0, 1080.0], Theme::Light);
    window.ctx.set_zoom_factor(2.0);
    window.state_mut().state.data.took_ms = None;
    picture(&mut window, "zoom_200_light");
}

#[test]
fn in_four_thousand_pixels() {
    let mut window = demonstrated([3840.0, 2160.0], Theme::Dark);
    window.state_mut().state.data.took_ms = None;
    picture(&mut window, "uhd_dark");
}

#[test]
fn the_lab() {
    let mut window = demonstrated(SIZE, Theme::Dark);
    // One change is measured here; for the picture its numbers stand for all.
    let one = run(Request { key: Key(0), job: Job::Ablate(0) }, &mut |_| ControlFlow::Continue(()));
    let Ok(Output::Effect(Ok(one))) = one.unwrap().result else { panic!("no effect") };
    let effects = &mut window.state_mut().state.data.effects;
    effects.extend(
        (0..TRIALS as u32)
            .map(|n| (n, Ok(Numbers { map_px: Some(0.01 * f64::from(n + 1)), ..*one.clone() }))),
    );
    effects.insert(3, Err("refused".to_owned()));
    for (part, name) in [
        (Part::Scene, "lab_scene_dark"),
        (Part::Ablation, "lab_ablation_dark"),
        (Part::Starts, "lab_starts_dark"),
        (Part::Twin, "lab_twin_dark"),
    ] {
        show(&mut window, Screen { lab: Some(part), ..Screen::default() });
        picture(&mut window, name);
    }
}

#[test]
fn an_unlocked_layout() {
    let mut window = demonstrated(SIZE, Theme::Light);
    show(&mut window, Screen { unlocked: true, ..Screen::default() });
    picture(&mut window, "unlocked_light");
}

#[test]
fn models_side_by_side() {
    let mut window = demonstrated(SIZE, Theme::Dark);
    window.state_mut().state.data.took_ms = None;
    click(&mut window, "Lens, Brown, 5 terms");
    settle(&mut window);
    assert!(says(&window, "in pictures that it was not fitted to"));
    picture(&mut window, "models_dark");
    // Another model is in use: the recommended one is a click away, and the table is still there.
    click(&mut window, "Pinhole, no distortion");
    settle(&mut window);
    let recommended = window.state().state.data.compared.as_ref().unwrap().1.as_ref().unwrap().recommended;
    click(&mut window, &format!("Use {}", recommended.spec().title));
    settle(&mut window);
    assert_eq!(window.state().state.doc.model, Some(recommended));
    assert!(says(&window, "is recommended"));
}

const PHONE: [f32; 2] = [390.0, 844.0];

#[test]
fn empty_on_a_phone() {
    picture(&mut window(PHONE, Theme::Dark), "phone_empty");
}

#[test]
fn on_a_phone() {
    let mut window = demonstrated(PHONE, Theme::Dark);
    picture(&mut window, "phone_dark");
    let screen = window.state().state.screen.clone();
    show(&mut window, Screen { center: PANELS[2].tile, ..screen });
    picture(&mut window, "phone_errors");
}
