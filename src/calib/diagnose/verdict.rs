//! The one sentence: whether the camera can be used, and where.

use super::{Facts, Level, UNSURE_FOCAL, Verdict, facts};
use crate::calib::{
    number::{counted, significant},
    report::Solution,
};

/// Certainty beyond which a place is a guess, px.
const GUESS_PX: f64 = 1.0;
/// Largest share of its distance from the middle by which one term may move a corner of the picture.
const LARGEST_BEND: f64 = 3.0;
/// Largest k1, k2 and k3: a long lens that bends by three hundredths has a tenth of that.
const LARGEST: [f64; 3] = [100.0, 5e3, 1e6];
/// Share of outliers beyond which the robust loss hides a misfit.
const MANY_OUTLIERS: f64 = 0.05;
/// Pictures below which nothing checks the camera.
const NO_CHECK: usize = 3;
/// Pictures below which next to nothing does.
const FEW: usize = 5;

/// What was found to object to.
type Objection = Option<(Level, String)>;

/// Asked in this order; the first of the most serious is the sentence.
const CHECKS: &[fn(&Facts<'_>, &Solution) -> Objection] = &[
    not_converged,
    absurd_focal,
    unsure_focal,
    absurd_lens,
    unsure_middle,
    misfit,
    too_few,
    outliers,
    guessed,
    facing,
    few,
    unseen,
];

pub(super) fn of(facts: &Facts<'_>) -> Verdict {
    let Some(solution) = facts.solution else {
        let (level, sentence) = match &facts.report.error {
            Some(_) => (Level::Bad, "No camera from these pictures"),
            None => (Level::Info, "No camera yet"),
        };
        return Verdict { level, sentence: sentence.to_owned(), rms_alone: String::new() };
    };
    let rms_alone = match solution.rms_px {
        rms if rms <= 0.25 => "excellent",
        rms if rms <= 0.5 => "good",
        _ => "poor",
    };
    let objections = CHECKS.iter().filter_map(|check| check(facts, solution));
    let (level, sentence) = objections
        .reduce(|worst, next| if next.0 > worst.0 { next } else { worst })
        .unwrap_or_else(|| (Level::Good, good(solution)));
    Verdict { level, sentence, rms_alone: rms_alone.to_owned() }
}

fn good(solution: &Solution) -> String {
    let u = &solution.uncertainty;
    let [center, corner] = [u.center_px, u.worst_corner_px].map(|px| bound(px.unwrap_or_default()));
    format!("Good everywhere: {center} at the centre, {corner} in the corners")
}

/// Nobody needs, or believes, more digits than thousandths of a pixel.
fn bound(px: f64) -> String {
    if px >= 0.001 { format!("±{} px", significant(px, 2)) } else { "under 0.001 px".to_owned() }
}

fn not_trustworthy(why: impl std::fmt::Display) -> Objection {
    Some((Level::Bad, format!("Not trustworthy: {why}")))
}

fn not_converged(_: &Facts<'_>, solution: &Solution) -> Objection {
    if solution.termination.converged() {
        return None;
    }
    not_trustworthy("the refinement did not reach its optimum")
}

fn absurd_focal(facts: &Facts<'_>, solution: &Solution) -> Objection {
    facts.report.warnings.iter().find(|w| w.code == "focal_absurd")?;
    let widths = solution.camera.intrinsics()[0] / f64::from(solution.camera.size_px[0]);
    not_trustworthy(format_args!("no lens has a focal length of {} picture widths", significant(widths, 2)))
}

/// A lens that folds the picture over, or whose terms are larger than any lens's, is absurd whatever the RMS.
fn absurd_lens(facts: &Facts<'_>, solution: &Solution) -> Objection {
    if facts.report.warnings.iter().any(|w| w.code == "model_folds") {
        return not_trustworthy("the lens model is absurd, it folds inside the picture");
    }
    let camera = &solution.camera;
    let [w, h] = camera.size_px.map(f64::from);
    let reach = 0.5 * w.hypot(h) / camera.intrinsics()[0];
    let absurd = ["k1", "k2", "k3"].iter().enumerate().find_map(|(k, name)| {
        let value = camera.get(name).filter(|_| camera.spec().perspective)?;
        // Of a rational lens the denominator may make it good.
        let alone = camera.get("k4").is_none();
        let bends = value.abs() * reach.powi(2 * (k as i32 + 1));
        (alone && (bends > LARGEST_BEND || value.abs() > LARGEST[k])).then_some((name, value))
    });
    let (name, value) = absurd?;
    not_trustworthy(format_args!("the lens model is absurd, {name} = {}", significant(value, 2)))
}

fn unsure_focal(_: &Facts<'_>, solution: &Solution) -> Objection {
    let sigma = solution.sigma.get("fx").copied().flatten()?;
    if sigma <= UNSURE_FOCAL * solution.camera.intrinsics()[0] {
        return None;
    }
    not_trustworthy(format_args!("the focal length is only known to ±{} px", significant(sigma, 2)))
}

fn unsure_middle(_: &Facts<'_>, solution: &Solution) -> Objection {
    match solution.uncertainty.center_px {
        None => not_trustworthy("the pictures do not determine the camera"),
        Some(px) if px > GUESS_PX => {
            not_trustworthy(format_args!("±{} px even in the middle", significant(px, 2)))
        }
        Some(_) => None,
    }
}

fn misfit(facts: &Facts<'_>, solution: &Solution) -> Objection {
    let level = facts.misfit()?;
    let missed = format!("the camera misses the corners by {} px", significant(solution.rms_inliers_px, 2));
    if level == Level::Bad {
        not_trustworthy(missed)
    } else {
        Some((level, format!("Use with care: {missed}")))
    }
}

fn too_few(facts: &Facts<'_>, _: &Solution) -> Objection {
    let n = facts.used.len();
    if n >= NO_CHECK {
        return None;
    }
    not_trustworthy(format_args!("nothing checks a camera from {}", counted(n, "picture")))
}

fn outliers(facts: &Facts<'_>, _: &Solution) -> Objection {
    let corners: usize = facts.used.iter().map(|(_, f)| f.corners.len()).sum();
    let outliers: usize = facts.used.iter().map(|(_, f)| f.outliers.len()).sum();
    let share = outliers as f64 / corners.max(1) as f64;
    (share > MANY_OUTLIERS)
        .then(|| (Level::Warn, format!("Use with care: {:.0} % of the corners do not fit", 100.0 * share)))
}

fn guessed(_: &Facts<'_>, solution: &Solution) -> Objection {
    let u = &solution.uncertainty;
    let corners = u.worst_corner_px.is_none_or(|px| px > GUESS_PX).then_some("in the corners");
    let place = facts::guessed(u, GUESS_PX).or(corners)?;
    // An error bar, not praise: the same camera may fit badly.
    let known = u.center_px.map(|px| format!("Known to {} in the middle", bound(px)))?;
    Some((Level::Warn, format!("{known}, a guess {place}")))
}

fn facing(facts: &Facts<'_>, _: &Solution) -> Objection {
    let most = facts.most_tilt_deg()?;
    (most < facts::FLAT_DEG)
        .then(|| (Level::Warn, format!("Use with care: no board was tilted by more than {most:.0}°")))
}

fn few(facts: &Facts<'_>, _: &Solution) -> Objection {
    let n = facts.used.len();
    (n < FEW)
        .then(|| (Level::Warn, format!("Use with care: only {}, little is checked", counted(n, "picture"))))
}

/// Where the model alone speaks: σ presumes that it is right.
fn unseen(facts: &Facts<'_>, _: &Solution) -> Objection {
    let largest = facts.empty.first().filter(|r| r.is_quarter())?;
    Some((Level::Warn, format!("Good where the boards were, unchecked {}", largest.name)))
}
