//! What the errors say.

use nalgebra::Vector2;

use super::{Facts, Finding, Level, Remedy, Show, finding};
use crate::calib::{
    camera::Model,
    influence::{Influence, Role},
    number::{counted, significant},
    order,
    report::FrameReport,
    stats::{
        quantile,
        spatial::{Moran, Pairs, Placed, moran},
    },
};

/// Focal length in picture widths below which the lens may be a fisheye.
const WIDE: f64 = 0.65;

pub(super) fn misfit(facts: &Facts<'_>) -> Option<Finding> {
    let solution = facts.solution?;
    let level = facts.misfit()?;
    let title = "The camera does not fit the pictures";
    let camera = &solution.camera;
    let perhaps = if camera.spec().perspective {
        "Is the lens a fisheye, the board bent or on a screen with stripes, or a picture of another camera among them?"
    } else {
        "Is the board bent or on a screen with stripes, or a picture of another camera among them? A lens with a mirror in it follows none of \
         the models here: do not calibrate it with them."
    };
    let text = format!(
        "It misses the corners by {} px RMS; 0.1 to 0.5 px is usual. {perhaps}",
        significant(solution.rms_inliers_px, 2)
    );
    let wide = camera.params[0] < WIDE * f64::from(camera.size_px[0]);
    let remedy = (camera.spec().perspective && wide).then_some(Remedy::Model(Model::Kb4));
    Some(finding("misfit", level, title, text, Show::Errors, remedy))
}

/// Pictures that pull the camera away from where the others put it, the strongest first.
pub(super) fn harmful(facts: &Facts<'_>) -> Option<Finding> {
    let mut list: Vec<(usize, &FrameReport, Influence)> =
        facts.used.iter().filter_map(|(i, f)| Some((*i, *f, f.influence?))).collect();
    list.retain(|(.., influence)| influence.role == Role::Harmful);
    order::by(&mut list, |(.., influence)| [-influence.moves_px]);
    let (position, frame, influence) = *list.first()?;
    let name = frame.stem();
    let title = format!("{name} pulls the camera away");
    let more = match list.len() - 1 {
        0 => String::new(),
        n => format!(" {} more, less strongly.", counted(n, "picture")),
    };
    let text = format!(
        "Without it the projection moves by {} px, {} times as far as chance would take it.{more} Look whether it shows another board, a bent \
         one, or another zoom.",
        significant(influence.moves_px, 2),
        significant(influence.moves_px / influence.by_chance_px, 2)
    );
    let remedy = Some(Remedy::SetAside(vec![position], name.to_owned()));
    Some(finding("harmful_picture", Level::Warn, title, text, Show::Picture(position), remedy))
}

/// A picture whose error stands out from the others'.
pub(super) fn loud_picture(facts: &Facts<'_>) -> Option<Finding> {
    let errors: Vec<(f64, usize, &FrameReport)> =
        facts.used.iter().map(|(i, f)| (f.mean_px(), *i, *f)).collect();
    let mut means: Vec<f64> = errors.iter().map(|e| e.0).collect();
    means.sort_by(f64::total_cmp);
    if means.len() < 4 {
        return None;
    }
    let usual = quantile(&means, 0.5);
    let spread = (quantile(&means, 0.75) - quantile(&means, 0.25)).max(0.1 * usual);
    let limit = (usual + 5.0 * spread).max(1.8 * usual);
    let (mean, position, frame) =
        errors.into_iter().filter(|e| e.0 > limit).max_by(|a, b| a.0.total_cmp(&b.0))?;
    let name = frame.stem();
    let title = format!("{name} fits worse than the others");
    let text = format!(
        "Its mean error is {} px, usual is {} px. Look whether it is blurred or shows another board.",
        significant(mean, 2),
        significant(usual, 2)
    );
    let remedy = Some(Remedy::SetAside(vec![position], name.to_owned()));
    Some(finding("loud_picture", Level::Warn, title, text, Show::Picture(position), remedy))
}

/// Effects below this are nothing to act upon, px RMS.
const TINY_PX: f64 = 0.05;
/// RMS from which a pattern is more than worth knowing, px.
const SERIOUS_PX: f64 = 0.3;

pub(super) fn bent_board(facts: &Facts<'_>) -> Option<Finding> {
    // Where sources were asked for, they say it with a shape.
    let said = facts
        .report
        .sources
        .as_ref()
        .is_some_and(|s| s.faults.iter().any(|f| f.found && f.code == "bowed_board"));
    let bend = facts.bend().filter(|b| b.explained_px > TINY_PX && !said)?;
    let settings = &facts.report.settings;
    let title = "The board was not flat";
    let text = format!(
        "Heights of {} {} or more between its corners explain {} px RMS of the errors. Glue it to glass or an aluminium plate.",
        significant(bend.height, 2),
        settings.unit.name(),
        significant(bend.explained_px, 2)
    );
    let level = if bend.explained_px > SERIOUS_PX { Level::Warn } else { Level::Info };
    Some(finding("bent_board", level, title, text, Show::Field, None))
}

/// Smallest Moran's I that is worth a word: significance alone comes with numbers.
const NOTABLE: f64 = 0.2;

pub(super) fn lens_pattern(facts: &Facts<'_>) -> Option<Finding> {
    let between = between(facts).filter(|m| m.index > NOTABLE)?;
    let title = "The lens model does not explain everything";
    let text = format!(
        "Errors of different pictures agree where they meet (correlation {:.2}): the lens bends in a way that this model cannot.",
        between.index
    );
    Some(finding("lens_pattern", level(facts), title, text, Show::Field, None))
}

/// Neighbours that err alike in each picture by itself; what a lens or a bent board explains is said there.
pub(super) fn picture_pattern(facts: &Facts<'_>) -> Option<Finding> {
    let within = pattern(facts, Pairs::WithinViews).filter(|m| m.index > 2.0 * NOTABLE)?;
    let lens = between(facts).is_some_and(|b| b.index > 0.5 * within.index);
    if lens || facts.bend().is_some() {
        return None;
    }
    let title = "Each picture errs in its own way";
    let text = format!(
        "Neighbouring corners err alike (correlation {:.2}): the board gave way between the pictures, or something moved while they were taken.",
        within.index
    );
    Some(finding("picture_pattern", level(facts), title, text, Show::Field, None))
}

fn level(facts: &Facts<'_>) -> Level {
    let rms = facts.solution.map_or(0.0, |s| s.rms_inliers_px);
    if rms > SERIOUS_PX { Level::Warn } else { Level::Info }
}

/// What errors of different pictures share.
fn between(facts: &Facts<'_>) -> Option<Moran> {
    *facts.between.get_or_init(|| pattern(facts, Pairs::BetweenViews))
}

/// A pattern that is neither chance nor too small to matter.
fn pattern(facts: &Facts<'_>, pairs: Pairs) -> Option<Moran> {
    /// Most residuals that are looked at: more say nothing new and cost time.
    const MOST: usize = 700;
    const PERMUTATIONS: usize = 39;
    let solution = facts.solution.filter(|s| s.rms_inliers_px > TINY_PX)?;
    let [w, h] = solution.camera.size_px.map(f64::from);
    let near = 0.06 * w.hypot(h);
    // With few shuffles the chance is read off their spread.
    moran(&field(facts, MOST), pairs, near, PERMUTATIONS, 1).filter(|m| m.z > 4.0)
}

/// Residuals at their places, whole pictures at a time.
fn field(facts: &Facts<'_>, most: usize) -> Vec<Placed> {
    let corners: usize = facts.used.iter().map(|(_, f)| f.residuals_px.len()).sum();
    let pictures = facts.used.iter().step_by(corners.div_ceil(most).max(1));
    pictures
        .flat_map(|(view, frame)| {
            let residuals = frame.corners.iter().zip(&frame.residuals_px);
            // What the robust loss names as an outlier is said elsewhere.
            residuals
                .filter(|(corner, _)| !frame.outliers.contains(&corner.index))
                .map(|(corner, r)| Placed { px: corner.px, view: *view, residual_px: Vector2::from(*r) })
        })
        .collect()
}

pub(super) fn outliers(facts: &Facts<'_>) -> Option<Finding> {
    let n: usize = facts.used.iter().map(|(_, f)| f.outliers.len()).sum();
    let (position, _) = facts.used.iter().max_by_key(|(_, f)| f.outliers.len()).filter(|_| n > 0)?;
    let (title, text) = if n == 1 {
        let text =
            "It lies further off than the others let expect; the robust loss gives it next to no weight.";
        ("1 corner is an outlier".to_owned(), text)
    } else {
        let text =
            "They lie further off than the others let expect; the robust loss gives them next to no weight.";
        (format!("{n} corners are outliers"), text)
    };
    Some(finding("outliers", Level::Info, title, text, Show::Picture(*position), None))
}
