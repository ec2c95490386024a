//! `check`: reports reproduce themselves, and what cannot be checked says so.

use std::fs;

use super::{json, photos, run, scene, stderr, stdout};
use straightedge::calib::synth::Scene;

#[test]
fn reports_are_solved_again() {
    let scene = Scene { poses: Vec::new(), ..scene() };
    let folder = photos(&scene);
    let at = folder.path();
    fs::write(at.join("truth.json"), super::scene().truth().to_json()).unwrap();
    let args =
        ["calibrate", "--corners", "truth.json", "--report", "r.html", "--out", "c.json", "--out", "c.yaml"];
    assert_eq!(run(at, &args).status.code(), Some(0));
    for file in ["r.html", "c.json"] {
        let output = run(at, &["check", file]);
        let text = stdout(&output);
        assert_eq!(output.status.code(), Some(0), "{text}{}", stderr(&output));
        assert!(text.contains("in 8 pictures") && text.contains("It agrees"), "{text}");
        let answer = json(at, &["check", file, "--json"], 0);
        assert_eq!((&answer["agrees"], &answer["pictures"]), (&true.into(), &8.into()));
    }
    // The page is a camera file, too.
    let converted = run(at, &["convert", "r.html", "again.json"]);
    assert_eq!(converted.status.code(), Some(0), "{}", stderr(&converted));
    // A changed corner.
    let page = fs::read_to_string(at.join("r.html")).unwrap();
    let from = page.find("\"corners\": [").unwrap();
    let digit = from + page[from..].find('.').unwrap() + 1;
    let changed = if &page[digit..=digit] == "5" { "6" } else { "5" };
    fs::write(at.join("edited.html"), [&page[..digit], changed, &page[digit + 1..]].concat()).unwrap();
    let output = run(at, &["check", "edited.html"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(stdout(&output).contains("It does not agree"), "{}", stdout(&output));
    // Cut short, without observations, missing.
    fs::write(at.join("short.html"), &page[..page.len() / 2]).unwrap();
    for (file, says) in [
        ("short.html", "short.html"),
        ("c.yaml", "holds no observations"),
        ("again.json", "not all of a report"),
        ("none.html", "no such file"),
    ] {
        let output = run(at, &["check", file]);
        assert_eq!(output.status.code(), Some(2), "{file}");
        assert!(stderr(&output).contains(says), "{file}: {}", stderr(&output));
    }
}
