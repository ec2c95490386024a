//! The source document's experiment: what it must find.

use std::ops::ControlFlow;
use straightedge::calib::{
    experiment::{
        self, Experiment,
        ablate::{ABLATIONS, Numbers},
        claims::{CLAIMS, Verdict},
        evidence::{COLUMNS, EXACT, EXACT_ITS},
        figures::Figure,
        pipeline::{Bench, Setup},
    },
    synth::Scene,
};

#[test]
fn the_exact_renderer_gives_the_camera_back() {
    let run = Bench::default().run(Setup::new(Scene::seed())).unwrap();
    assert_eq!((run.full(), run.corners(), run.calibration.set_aside.len()), (15, 810, 0));
    let (rms, found) = (run.calibration.rms_px, run.localisation().rms);
    println!("RMS {rms:.4} px, corners {found:.4} px from the truth");
    assert!(rms < 0.012 && found < 0.012);
    for c in run.comparison().unwrap() {
        println!("{} {} {:.2} sigma", c.name, c.estimate, c.in_sigma.unwrap());
        assert!(c.in_sigma.unwrap() < 3.0, "{}: {} sigma", c.name, c.in_sigma.unwrap());
    }
    let numbers = Numbers::of(&run).unwrap();
    assert!(numbers.map_px.unwrap() < 0.05 && numbers.uncertainty_px.iter().all(|u| u.unwrap() < 0.3));
}

fn verdict<'a>(found: &'a Experiment, id: &str) -> &'a Verdict {
    &found.claims.iter().find(|c| c.id == id).unwrap().judgement.verdict
}

#[test]
fn the_document_is_judged() {
    let mut steps = 0;
    let found = experiment::run(false, &mut |_| {
        steps += 1;
        ControlFlow::Continue(())
    })
    .unwrap();
    assert!(steps > 20);
    let e = &found.evidence;
    // Its own size of error comes from its renderer.
    for (run, name) in e.runs.iter().zip(COLUMNS) {
        let stats = run.errors();
        println!("{name}: {stats:?}");
        assert_eq!((run.full(), run.corners(), stats.n), (15, 810, 810), "{name}");
        assert!((stats.rms - run.calibration.rms_px).abs() < 1e-12);
    }
    assert!(e.runs[..EXACT_ITS].iter().all(|r| (0.35..0.55).contains(&r.calibration.rms_px)));
    // cornerSubPix and calibrateCamera leave 0.06 px on exact pictures.
    assert!((0.04..0.08).contains(&e.runs[EXACT_ITS].calibration.rms_px));
    let coverage = e.runs[EXACT].coverage();
    assert!(
        (coverage.width_fraction - 0.655).abs() < 1e-3 && (coverage.height_fraction - 0.706).abs() < 1e-3
    );
    let (columns, truth) = e.displacements().unwrap();
    assert!((truth[0] - 33.5).abs() < 0.1 && (columns[EXACT][0] - truth[0]).abs() < 0.2);
    for (id, expected) in [
        ("rms", Verdict::Holds),
        ("detection", Verdict::Holds),
        ("five_terms", Verdict::Holds),
        ("no_pattern", Verdict::Holds),
        ("table_iv", Verdict::DoesNotHold),
        ("coverage", Verdict::DoesNotHold),
        ("displacement_px", Verdict::DoesNotHold),
        ("origin", Verdict::DoesNotHold),
        ("smallest_tilt", Verdict::DoesNotHold),
        ("consistent_estimates", Verdict::DoesNotHold),
        ("steep_views", Verdict::DoesNotHold),
        ("refinement", Verdict::OnlyWith(COLUMNS[EXACT].to_owned())),
        ("center", Verdict::OnlyWith(COLUMNS[EXACT].to_owned())),
    ] {
        assert_eq!(verdict(&found, id), &expected, "{id}");
    }
    // The test of patterns sees a lens term that is left out.
    let lean = e.models.iter().find(|m| m.terms == "k1 k2").unwrap();
    assert!(lean.pattern.unwrap().is_significant() && lean.excess.unwrap() > 100.0);

    let page = experiment::page::markdown(&found, "figures").unwrap();
    for figure in &found.figures {
        let Figure { file, panel, .. } = figure;
        assert!(page.contains(&format!("figures/{file}")));
        assert!(roxmltree::Document::parse(&panel.svg()).is_ok(), "{file}");
    }
    assert!(found.claims.iter().all(|c| page.contains(&c.says)) && !page.contains("NaN"));
    let json: serde_json::Value = serde_json::from_str(&found.json().unwrap()).unwrap();
    assert_eq!(json["columns"].as_array().unwrap().len(), 4);
    assert_eq!(json["claims"].as_array().unwrap().len(), found.claims.len());
}

#[test]
fn names_are_unique() {
    let mut ids: Vec<_> = CLAIMS.iter().flat_map(|g| g.iter()).map(|c| c.id).collect();
    let mut changes: Vec<_> = ABLATIONS.iter().map(|a| (a.group, a.name)).collect();
    let (n, m) = (ids.len(), changes.len());
    ids.sort_unstable();
    ids.dedup();
    changes.sort_unstable();
    changes.dedup();
    assert_eq!((ids.len(), changes.len()), (n, m));
}

#[test]
fn it_can_be_stopped() {
    let stopped = experiment::run(true, &mut |_| ControlFlow::Break(()));
    assert_eq!(stopped.unwrap_err(), straightedge::calib::Error::Stopped);
}
