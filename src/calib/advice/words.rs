//! Advice as sentences. Sides are those of the picture, as the camera sees the board.

use super::{Advice, Figures, State, hold::Hold};
use crate::calib::{
    number::{counted, significant},
    target::Unit,
};

/// What a person does: one sentence.
pub(super) fn hold(hold: &Hold, distance: f64, unit: Unit) -> String {
    let mut text = if hold.tilt_deg < 10.0 {
        "Hold the board square to the camera".to_owned()
    } else {
        format!("Tilt the board by {:.0}°, its {} away from the camera", hold.tilt_deg, away(hold.away_deg))
    };
    let turned = hold.roll_deg.rem_euclid(180.0);
    if (10.0..170.0).contains(&turned) {
        text += &format!(", turned by {turned:.0}° in its plane");
    }
    text += &format!(", {}, {}", place(hold.side, hold.reach), times(hold.times));
    match unit.metres() {
        Some(_) => text + &format!(" ({} {}).", significant(distance, 2), unit.name()),
        None => text + ".",
    }
}

fn away(deg: f64) -> &'static str {
    const SIDES: [&str; 8] = [
        "right side",
        "lower right corner",
        "lower side",
        "lower left corner",
        "left side",
        "upper left corner",
        "upper side",
        "upper right corner",
    ];
    SIDES[(deg / 45.0).round().rem_euclid(8.0) as usize]
}

fn place([x, y]: [i8; 2], reach: f64) -> String {
    let name = match (x, y) {
        (0, 0) => return "in the middle of the picture".to_owned(),
        (-1, 0) => "left edge",
        (1, 0) => "right edge",
        (0, -1) => "upper edge",
        (0, _) => "lower edge",
        (-1, -1) => "upper left corner",
        (_, -1) => "upper right corner",
        (-1, _) => "lower left corner",
        _ => "lower right corner",
    };
    if reach < 0.9 {
        return format!("between the middle and the {name} of the picture");
    }
    format!("{} the {name} of the picture", if x == 0 || y == 0 { "at" } else { "in" })
}

fn times(times: f64) -> &'static str {
    match times {
        t if t < 0.6 => "at half the usual distance",
        t if t < 0.9 => "at two thirds of the usual distance",
        t if t < 1.2 => "at the usual distance",
        t if t < 1.7 => "at one and a half times the usual distance",
        _ => "at twice the usual distance",
    }
}

/// What to do where nothing is known yet.
pub(super) const FIRST: &str = "Photograph the whole board from at least three sides: once square to the camera, then tilted by 30 to 45° to the left, to the right, up and down, so large that it fills half of the picture.";

/// Share of σ that a picture must not leave of it where a gain is promised. Three pictures of 54 corners tell σ₀ to 4 %, and so σ: what is
/// gained is within 30 % of what was promised, at 2 σ, from a fifth of σ on.
const LITTLE: f64 = 0.75;

/// What it brings, and how much is still to do: a sentence or two.
pub(super) fn promise(advice: &Advice) -> String {
    let px = |px: Option<f64>| px.map_or("unknown".to_owned(), |px| format!("±{} px", significant(px, 2)));
    let goal = advice.goal_words();
    let of = |figures: &Figures| advice.goal.figure.of_figures(figures);
    let before = advice.before.as_ref().and_then(of);
    match advice.state {
        State::Unknown => format!("The goal is {goal}."),
        State::Enough => format!("The goal is reached: {} of {goal}.", px(before)),
        State::Stuck => format!("{} of {goal}: a picture more brings next to nothing.", px(before)),
        State::Next => {
            let after = advice.after.as_ref().and_then(of);
            let where_ = advice.goal.figure.words();
            let mut text = match (before, after, advice.focal_px) {
                (Some(_), Some(_), _) | (_, _, None) => {
                    format!("Expected: {} {where_} becomes {}.", px(before), px(after))
                }
                // A board where the model folds is no news of the focal length.
                (None, _, Some([now, then])) if then > LITTLE * now => {
                    format!("The model of the lens has no answer {where_} yet: a board there tells it more.")
                }
                (.., Some([now, then])) => {
                    format!(
                        "Expected: the focal length, known to {}, becomes known to {}.",
                        px(Some(now)),
                        px(Some(then))
                    )
                }
            };
            text += &match advice.pictures {
                Some(1) => format!(" That reaches {goal}."),
                Some(n) => format!(" It takes {} to {goal}.", counted(n, "picture")),
                None if before.is_none() => {
                    format!(" How many pictures it takes to reach {goal} cannot be told yet.")
                }
                None => format!(" It takes more than {} pictures to {goal}.", super::MOST_PICTURES),
            };
            text
        }
    }
}
