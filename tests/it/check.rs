//! A report reproduces itself: solved again from what is in it, every number is the same; what was changed is found.

use std::ops::ControlFlow;

use nalgebra::Vector2;
use straightedge::{
    calib::{
        board::Design,
        calibrate::{Loss, Weights, parse_fixes},
        camera::{Camera, Model},
        check::{Check, TOLERANCE, compare},
        format, html,
        observation::Corner,
        pose::Pose,
        report::{Report, Settings},
        target::{Length, Target, Unit},
    },
    job::{
        Other,
        assemble::{Entry, Finding, Seen},
        evidence::{Case, again, evidence},
        photo::Exif,
    },
};

fn brown() -> Camera {
    let params = vec![620.0, 621.0, 318.0, 243.0, -0.25, 0.09, 0.001, -0.0005, 0.01];
    Camera::new(Model::Brown5, [640, 480], params).unwrap()
}

fn fisheye() -> Camera {
    Camera::new(Model::Kb4, [640, 480], vec![300.0, 300.5, 320.0, 238.0, 0.02, -0.01, 0.004, -0.001]).unwrap()
}

fn board(words: &str) -> Target {
    let edge = Length { value: 30.0, unit: Unit::Mm };
    words.parse::<Design>().unwrap().target(edge, 30.0).unwrap()
}

/// Pictures of a board from all sides, their corners off by about 0.05 px.
pub(super) fn entries(camera: &Camera, target: &Target, count: usize, salt: u32) -> Vec<Entry> {
    let middle = target.center_in_board();
    let extent = target.points_in_board().iter().map(|p| (p - middle).norm()).fold(0.0, f64::max);
    let picture = |k: usize| {
        let phase = k as f64 * 2.4 + f64::from(salt);
        let angles = [25.0 * phase.sin(), 25.0 * (1.3 * phase).cos(), 40.0 * k as f64];
        let away = extent * camera.params[0] / 200.0 * (1.0 + 0.2 * (2.1 * phase).sin());
        let aside = 0.22 * away;
        let turned = Pose::from_euler_deg(angles, nalgebra::Vector3::zeros());
        let at = nalgebra::Vector3::new(aside * phase.cos(), 0.8 * aside * (1.7 * phase).sin(), away);
        let pose = Pose::from_euler_deg(angles, at - turned.apply(&middle).coords);
        let noise = |n: f64| 0.08 * (12.9898 * n + 78.233 * (k as f64 + f64::from(salt))).sin();
        let corners = (0..).zip(target.points_in_board()).filter_map(|(index, point)| {
            let px = (camera.spec().project_px)(&camera.params, &pose.apply(&point).coords)?;
            let n = f64::from(index);
            let px = px + Vector2::new(noise(n), noise(n * 1.7 + 0.3));
            let inside = (0.0..639.0).contains(&px.x) && (0.0..479.0).contains(&px.y);
            inside.then_some(Corner { index, px, sigma_px: 0.04 + 0.02 * noise(n).abs() })
        });
        let finding = Finding::Corners { corners: corners.collect(), why: String::new() };
        let seen = Seen {
            size_px: camera.size_px,
            exif: Exif::default(),
            pixels_hash: None,
            notes: Vec::new(),
            finding,
            other: Other::default(),
        };
        Entry { file: format!("view_{k:02}.png"), seen: Ok(seen) }
    };
    (0..count).map(picture).collect()
}

pub(super) fn case(camera: &Camera, target: &Target, count: usize, salt: u32) -> Case {
    let settings = Settings { square: 30.0, unit: Unit::Mm, ..Settings::default() };
    Case {
        target: Some(target.clone()),
        models: vec![camera.model],
        ..Case::new(entries(camera, target, count, salt), settings)
    }
}

pub(super) fn solved(case: &Case) -> Report {
    let report = evidence(case, &mut |_| ControlFlow::Continue(())).unwrap().report;
    assert_eq!(report.error, None);
    report
}

/// Checks a text as the command does.
fn checked(text: &str) -> Check {
    let held = Report::from_json(html::embedded(text).unwrap_or(text)).unwrap();
    let page = html::embedded(text).and_then(|_| html::is_as_written(text, &held));
    compare(&held, &again(&held, &mut |_| ControlFlow::Continue(())).unwrap(), page)
}

/// On one processor the bits are the same, in the JSON and in the page.
fn reproduces(what: &str, case: &Case) {
    let report = solved(case);
    for text in [report.to_json(), html::page(&report)] {
        let check = checked(&text);
        assert!(check.agrees, "{what}: {check:?}");
        assert_eq!(check.worst().unwrap().relative, 0.0, "{what}");
        let used = report.included().count();
        assert!(used >= 7 && check.numbers() > 9 + 6 * used, "{what}: {used} pictures");
        let camera = format::read(&text, "report.html").unwrap();
        assert_eq!(
            (camera.format, &camera.camera),
            ("straightedge", &report.solution.as_ref().unwrap().camera)
        );
    }
}

#[test]
fn boards_and_models_reproduce() {
    for (words, camera) in [
        ("9x6", brown()),
        ("charuco:9x6", brown()),
        ("circles:9x6", brown()),
        ("acircles:4x11", fisheye()),
        ("9x6", fisheye()),
    ] {
        let what = format!("{words} {}", camera.model);
        reproduces(&what, &case(&camera, &board(words), 8, 0));
    }
    let auto = Case { models: Model::USUAL.to_vec(), ..case(&brown(), &board("9x6"), 8, 0) };
    reproduces("auto", &auto);
}

#[test]
fn settings_reproduce() {
    let plain = case(&brown(), &board("9x6"), 10, 0);
    let with = |change: &dyn Fn(&mut Case)| {
        let mut case = plain.clone();
        change(&mut case);
        case
    };
    reproduces("linear", &with(&|c| c.options.loss = Loss::Linear));
    reproduces("weights", &with(&|c| c.options.weights = Weights::None));
    reproduces("one start", &with(&|c| c.options.multi_start = false));
    reproduces("fixed", &with(&|c| c.options.fixed = parse_fixes("fx=fy,cx,p1=0.001,k3").unwrap()));
    let mut start = brown();
    start.params[0] = 700.0;
    let held = parse_fixes("fx,k1").unwrap();
    reproduces(
        "start",
        &with(&|c| {
            (c.start, c.options.fixed) = (Some(("start.yaml".into(), start.clone())), held.clone());
        }),
    );
    reproduces(
        "dropped, excluded",
        &with(&|c| {
            (c.dropped, c.excluded) = (vec![(0, 3), (0, 4), (5, 17)], vec![2, 7]);
        }),
    );
    // A copy, another camera, an unreadable picture and one that contradicts all others.
    reproduces(
        "company",
        &with(&|c| {
            let mut list = c.entries.to_vec();
            list.insert(0, Entry { file: "broken.png".into(), seen: Err("cut short".into()) });
            list.push(Entry { file: "copy.png".into(), ..list[3].clone() });
            let mut other = Entry { file: "other.png".into(), ..list[4].clone() };
            let mut mirrored = Entry { file: "mirrored.png".into(), ..list[5].clone() };
            if let Ok(seen) = &mut other.seen {
                seen.size_px = [1280, 960];
            }
            if let Ok(Seen { finding: Finding::Corners { corners, .. }, .. }) = &mut mirrored.seen {
                corners.iter_mut().for_each(|c| c.px.x = 639.0 - c.px.x);
            }
            list.extend([other, mirrored]);
            c.entries = list.into();
        }),
    );
}

#[test]
fn what_was_changed_is_found() {
    let report = solved(&case(&brown(), &board("9x6"), 8, 0));
    let spoiled = |change: &dyn Fn(&mut Report)| {
        let mut other = report.clone();
        change(&mut other);
        checked(&other.to_json())
    };
    let fails = |name: &str, check: &Check| {
        assert!(!check.agrees, "{name}");
        let part = check.parts.iter().find(|p| p.name == name).unwrap();
        assert!(part.differ > 0 && part.worst.as_ref().unwrap().relative > TOLERANCE, "{part:?}");
    };
    let of = |r: &mut Report| r.solution.clone().unwrap();
    // An observation: the residuals tell it also where the camera hardly moves.
    fails("residuals", &spoiled(&|r| r.frames[1].corners[4].px.x += 1e-6));
    fails("intrinsics", &spoiled(&|r| r.frames[1].corners[4].px.x += 0.1));
    fails(
        "intrinsics",
        &spoiled(&|r| {
            let mut s = of(r);
            s.camera.params[0] += 1e-6;
            r.solution = Some(s);
        }),
    );
    fails(
        "RMS",
        &spoiled(&|r| {
            let mut s = of(r);
            s.rms_px -= 1e-8;
            r.solution = Some(s);
        }),
    );
    fails(
        "σ and covariance",
        &spoiled(&|r| {
            let mut s = of(r);
            s.covariance[(0, 0)] *= 0.9;
            r.solution = Some(s);
        }),
    );
    fails("poses", &spoiled(&|r| r.frames[2].tvec.as_mut().unwrap()[2] += 1e-5));
    assert!(!spoiled(&|r| r.settings.weights = Weights::None).agrees);
    let left_out = spoiled(&|r| r.frames[3].included = false);
    assert!(!left_out.agrees && left_out.used_by_one == ["view_03.png"]);
    // The words of a page are checked too; figures, line ends and other versions are not.
    let page = html::page(&report);
    let changed = page.replacen("pictures", "photographs", 1);
    assert_eq!(checked(&changed).page_as_written, Some(false));
    assert!(!checked(&changed).agrees && checked(&page.replace('\n', "\r\n")).agrees);
    assert!(checked(&page.replacen("<svg", "<svg x=\"1\"", 1)).agrees);
    let mut older = report.clone();
    older.version = "0.0.1".into();
    let check = checked(&html::page(&older));
    assert!(check.agrees && check.page_as_written.is_none() && check.written_by == "0.0.1");
}

#[test]
fn what_holds_no_observations_says_so() {
    let report = solved(&case(&brown(), &board("9x6"), 8, 0));
    let again = |r: &Report| again(r, &mut |_| ControlFlow::Continue(())).unwrap_err().to_string();
    let mut none = report.clone();
    none.frames.iter_mut().for_each(|f| (f.found, f.corners) = (false, Vec::new()));
    assert!(again(&none).contains("no corners"));
    none.solution = None;
    assert!(again(&none).contains("no calibration"));
    for text in ["", "{}", "<!doctype html><p>hello", &html::page(&report).replace("application/json", "x")] {
        assert_eq!(html::embedded(text), None);
    }
}
