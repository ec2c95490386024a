//! What to photograph next, on photographs.

use straightedge::calib::{
    advice::{self, State, advise, expected},
    camera::Model,
    target::Unit,
    uncertainty::{self, Range},
};

use crate::influence::{problem, solve};

/// Three pictures whose boards nearly face the camera: a strongly tilted one is asked for, and one that is there brings what is expected
/// of its pose.
#[test]
fn three_boards_that_face_the_camera_want_tilt() {
    let Some((report, whole)) = problem("opencv_left", Model::Brown5) else { return };
    let position = |name: &str| report.frames.iter().position(|f| f.name() == name).unwrap() as u32;
    let mut few = whole.clone();
    let mut frames = ["left01.jpg", "left04.jpg", "left07.jpg"].map(position).to_vec();
    few.observations.retain(|o| frames.contains(&o.frame.0));
    let before = solve(&few);
    let start = std::time::Instant::now();
    let advice = advise(&before, &whole.target, Unit::Squares, advice::Goal::default());
    println!("{} {} {:?}", advice.sentence, advice.promise, start.elapsed());
    assert_eq!(advice.state, State::Next);
    assert!(advice.next.unwrap().stance.tilt_rad.to_degrees() >= 30.0);

    let left02 = position("left02.jpg");
    let all = solve(&whole);
    let pose = all.views.iter().find(|v| v.frame.0 == left02).unwrap().camera_from_board;
    frames.push(left02);
    few.observations = whole.observations.iter().filter(|o| frames.contains(&o.frame.0)).cloned().collect();
    let after = solve(&few);
    let range = uncertainty::distance(&before, &whole.target, Range::Boards);
    let (promised, focal) = expected(&before, &whole.target, &pose, range).unwrap();
    let found = uncertainty::of(&after, &whole.target, Range::At(range.unwrap()));
    let now = uncertainty::of(&before, &whole.target, Range::Boards);
    // Towards the borders three such pictures say too little of the lens to promise anything.
    for (name, now, promised, found) in [
        ("σ of fx", before.sigma[0], focal, after.sigma[0]),
        ("centre", now.center_px, promised.center_px, found.center_px),
    ] {
        println!("{name}: {now:?} becomes {promised:?} as promised, {found:?} as found");
        let (now, promised, found) = (now.unwrap(), promised.unwrap(), found.unwrap());
        let off = ((now - promised) / (now - found)).ln().abs();
        assert!(off < 1.3f64.ln(), "{name}: {off}");
    }
}
