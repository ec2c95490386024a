use std::{path::PathBuf, sync::Arc};

use super::*;
use crate::{
    calib::{detect, synth::Scene},
    job::Source,
};

/// Inspections of six small pictures and of a file that is not there.
fn jobs() -> Vec<Job> {
    let mut scene = Scene::seed();
    scene.camera.size_px = [400, 300];
    scene.camera.params[..4].copy_from_slice(&[500.0, 500.0, 199.75, 149.75]);
    let scene = Arc::new(scene);
    let sources = (0..6).map(|view| Source::View { scene: scene.clone(), view });
    let missing = Source::File(PathBuf::from("no/such/picture.png"));
    let options = detect::Options::default();
    sources.chain([missing]).map(|source| Job::Inspect { source, options, thumbnail_px: 0 }).collect()
}

fn go(_: usize) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

/// What does not come from the clock.
fn timeless(results: Vec<Result<Output>>) -> Vec<Result<Output>> {
    let strip = |output| match output {
        Output::Inspection(mut i) => {
            (i.read_ms, i.detect_ms) = (0.0, 0.0);
            Output::Inspection(i)
        }
        other => other,
    };
    results.into_iter().map(|r| r.map(strip)).collect()
}

#[test]
fn results_are_in_order_and_the_same_bits_for_any_number_of_lanes() {
    let mut heard = Vec::new();
    let one = Pool::new(1).map(jobs(), &mut |done| {
        heard.push(done);
        ControlFlow::Continue(())
    });
    let one = timeless(one.unwrap());
    assert_eq!(heard.last(), Some(&7));
    assert!(one[..6].iter().all(|r| matches!(r, Ok(Output::Inspection(i)) if i.detection.grid.is_some())));
    assert!(matches!(&one[6], Err(Error::File { path, .. }) if path.contains("no/such")), "{:?}", one[6]);
    for lanes in [2, 5, 16] {
        assert_eq!(timeless(Pool::new(lanes).map(jobs(), &mut go).unwrap()), one, "{lanes} lanes");
    }
}

#[test]
fn a_pool_that_was_stopped_works_on() {
    let mut pool = Pool::new(2);
    assert_eq!(pool.map(jobs(), &mut |_| ControlFlow::Break(())), Err(Error::Stopped));
    assert_eq!(pool.map(jobs(), &mut go).unwrap().len(), 7);
    assert_eq!((pool.wait(), pool.poll()), (None, None));
}

#[test]
fn what_nobody_wants_any_more_is_dropped() {
    let mut pool = Pool::new(1);
    for (i, job) in jobs().into_iter().enumerate() {
        pool.submit(Request { key: Key(i as u128), job });
    }
    pool.keep(|key| key.0 == 3);
    let mut done = Vec::new();
    while let Some(event) = pool.wait() {
        if let Event::Done(reply) = event {
            done.push(reply.key.0);
        }
    }
    // The first was running; it may have been past its last look at the stop flag.
    done.retain(|key| *key != 0);
    assert_eq!(done, [3]);
}

#[test]
fn what_someone_looks_at_is_done_before_all_else() {
    let mut pool = Pool::new(1);
    let request = |(i, job)| Request { key: Key(i), job };
    let mut then: Vec<Request> = (0..).zip(jobs()).map(request).collect();
    let first = then.split_off(4);
    pool.submit_all(first, then);
    let mut done = Vec::new();
    while let Some(event) = pool.wait() {
        if let Event::Done(reply) = event {
            done.push(reply.key.0);
        }
    }
    assert_eq!(done, [6, 5, 4, 0, 1, 2, 3]);
}
