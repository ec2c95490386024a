use std::ops::ControlFlow;

use nalgebra::Vector2;

use super::{escape, page};
use crate::calib::{
    calibrate::{CameraSetup, Options, Problem, calibrate},
    diagnose,
    observation::{Corner, FrameId, Observation},
    report::{Failure, FrameReport, FrameState, Report, Settings},
    solution::Warning,
    synth::Scene,
    target::Unit,
};

/// A calibrated report of the built-in scene whose corners are off by small amounts; one picture has a hostile name.
fn report() -> Report {
    let scene = Scene::seed();
    let truth = scene.truth();
    let shift = |k: usize| 0.02 * (1.7 * k as f64).sin();
    let corners = |i: usize| -> Vec<Corner> {
        let all = truth.frames[i].corners.iter();
        all.map(|&(index, x, y)| {
            let k = 100 * i + index as usize;
            Corner { index, px: Vector2::new(x + shift(k), y + shift(3 * k + 1)), sigma_px: 0.02 }
        })
        .collect()
    };
    let mut frames: Vec<FrameReport> = (0..truth.frames.len())
        .map(|i| {
            let mut f = FrameReport::new(truth.frames[i].file.clone());
            (f.state, f.found, f.image_size_px, f.corners) =
                (FrameState::Full, true, Some([800, 600]), corners(i));
            f
        })
        .collect();
    frames[3].file = "a/<script>alert('x')</script>&\".png".to_owned();
    let mut unread = FrameReport::new("b/broken.jpg".to_owned());
    (unread.state, unread.why) = (FrameState::Unreadable, "it is cut short </script><b>".to_owned());
    frames.push(unread);
    let target = truth.target();
    let problem = Problem {
        cameras: vec![CameraSetup {
            size_px: [800, 600],
            model: scene.camera.model,
            start: None,
            focal_hint_px: None,
        }],
        target: target.clone(),
        observations: (0..truth.frames.len())
            .map(|i| Observation { camera: 0, frame: FrameId(i as u32), corners: corners(i) })
            .collect(),
        options: Options::default(),
    };
    let calibration = calibrate(&problem, &mut |_| ControlFlow::Continue(())).unwrap();
    let settings = Settings {
        board: Some(truth.board),
        square: 30.0,
        unit: Unit::Mm,
        images: 16,
        ..Settings::default()
    };
    let warning = Warning::new("test", "one & <two>").about(["a/<i>.png".to_owned()]);
    let mut report = Report::new(settings, Vec::new(), frames, vec![warning]);
    report.calibrated(&calibration, &target);
    report.compared(&calibration, &scene.camera).unwrap();
    report
}

/// The embedded JSON, and the page without it.
fn parts(html: &str) -> (&str, String) {
    let open = "<script type=\"application/json\" id=\"report\">\n";
    let from = html.find(open).unwrap() + open.len();
    let to = from + html[from..].find("</script>").unwrap();
    (&html[from..to], format!("{}{}", &html[..from], &html[to..]))
}

#[test]
fn the_page_holds_every_number_and_needs_nothing_else() {
    let report = report();
    let html = page(&report);
    let (json, rest) = parts(&html);
    assert_eq!(Report::from_json(json).unwrap(), report);
    let solution = report.solution.as_ref().unwrap();
    for (param, value) in solution.camera.spec().params.iter().zip(&solution.camera.params) {
        let sigma = solution.sigma.get(param.name).copied().flatten().unwrap();
        let [value, sigma] = crate::calib::number::with_sigma(*value, sigma);
        let row = format!("<tr><th>{}</th><td>{value}</td><td>{sigma}</td>", param.name);
        assert!(rest.replace('\u{2007}', "").contains(&row), "{row}");
    }
    for number in solution.covariance.iter() {
        assert!(rest.contains(&format!("<td>{number:.3e}</td>")));
    }
    for f in report.included() {
        assert!(rest.contains(&format!(">{}</td>", crate::calib::number::significant(f.rms_px.unwrap(), 3))));
    }
    for words in [
        "Error per picture",
        "Magnitude",
        "Uncertainty of the projection",
        "Error against tilt",
        "broken.jpg",
        "truth",
    ] {
        assert!(rest.contains(words), "{words}");
    }
    let (level, verdict) = diagnose::summary(&report);
    let head = format!("<p class=\"verdict {}\">{}</p>", super::tone(level), verdict);
    assert!(rest.contains(&head), "{head}");
    // What is behind it stands in the page and in its JSON, as does what RMS alone would have said.
    let (verdict, findings) = (diagnose::verdict(&report), diagnose::findings(&report));
    assert!(!findings.is_empty() && rest.contains(&escape(&verdict.rms_words())));
    for f in &findings {
        assert!(rest.contains(&escape(&f.text)), "{}", f.text);
    }
    let json: serde_json::Value = serde_json::from_str(parts(&html).0).unwrap();
    assert_eq!(serde_json::from_value::<Vec<diagnose::Finding>>(json["findings"].clone()).unwrap(), findings);
    assert_eq!(json["verdict"]["sentence"], verdict.sentence);
    assert_eq!(rest.matches("<figure>").count(), 11);
    // Nothing is fetched: no address, no link, no import; pictures are embedded.
    assert!(
        !html.contains("http")
            && !rest.contains("url(")
            && !rest.contains("@import")
            && !rest.contains("<link")
    );
    let embedded = rest.matches("href=\"data:image/png;base64,").count();
    assert_eq!(rest.matches("href=\"").count(), embedded);
    assert!(!rest.contains("NaN") && !rest.contains("src="));
}

#[test]
fn models_stand_side_by_side() {
    use crate::calib::{
        calibrate::{Candidate, Comparison, SplinedCandidate},
        camera::Model,
    };
    let mut report = report();
    assert!(!page(&report).contains("Camera models"));
    let candidate = |model, held_out_px, against: &str| Candidate {
        model,
        free: 9,
        rms_px: 0.2,
        held_out_px,
        worst_corner_px: Some(1.25),
        unobservable: vec!["k3".to_owned()],
        against: against.to_owned(),
    };
    report.models = Some(Comparison {
        candidates: vec![
            candidate(Model::Pinhole, Some(1.7), ""),
            candidate(Model::Brown5, Some(0.21), ""),
            candidate(Model::Rational, None, "folds <inside>"),
        ],
        recommended: Model::Brown5,
        why: "Brown & no other".to_owned(),
        folds: 10,
        splined: Some(SplinedCandidate {
            base: Model::Brown5,
            knots: [20, 15],
            rms_px: 0.1,
            supported: 0.9,
            held_out_px: Some(0.25),
            base_held_out_px: Some(0.21),
            worth_having: false,
            against: String::new(),
        }),
    });
    let html = page(&report);
    for words in [
        "k3 not told from zero",
        "recommended",
        "folds &lt;inside&gt;",
        "<td class=\"n\">–</td>",
        "Brown &amp; no other",
        "A splined camera errs by 0.250 px in new pictures, Brown, 5 terms by 0.210 px: not worth having",
    ] {
        assert!(html.contains(words), "{words}");
    }
    assert_eq!(Report::from_json(parts(&html).0).unwrap(), report);
}

#[test]
fn names_and_reasons_cannot_leave_their_place() {
    let html = page(&report());
    let (json, rest) = parts(&html);
    assert!(!html.contains("<script>alert") && !html.contains("</script><b>") && !rest.contains("<b>"));
    assert!(rest.contains("&lt;script&gt;alert(&#39;x&#39;)") && rest.contains("One &amp; &lt;two&gt;"));
    assert!(rest.contains("title=\"a/&lt;script&gt;alert(&#39;x&#39;)&lt;/script&gt;&amp;&quot;.png\""));
    assert!(!json.contains('<'));
    assert_eq!(html.matches("</script>").count(), 2);
}

#[test]
fn the_page_is_well_formed() {
    // XML is stricter than HTML about what is checked here: every element is closed, every attribute quoted.
    let html = page(&report());
    let (_, rest) = parts(&html);
    let from = rest.find("<main>").unwrap();
    let to = rest.find("</main>").unwrap() + "</main>".len();
    let main = rest[from..to].replace("&nbsp;", " ");
    roxmltree::Document::parse(&main).unwrap();
}

#[test]
fn without_a_calibration_the_reason_stands_at_the_head() {
    let mut report = report();
    report.solution = None;
    report.frames.iter_mut().for_each(|f| f.included = false);
    report.error = Some(Failure { code: "too_few_views".into(), text: "too few <pictures>".into() });
    let html = page(&report);
    assert!(
        html.contains("<p class=\"verdict bad\">No camera from these pictures: too few &lt;pictures&gt;")
    );
    assert!(html.contains("broken.jpg") && !html.contains("<figure>"));
}
