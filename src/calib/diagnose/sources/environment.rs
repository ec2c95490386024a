//! What changed or moved while the pictures were taken, and a board that is not what it is said to be.

use super::{Card, Facts, Remedy, Show, px};
use crate::calib::diagnose::faults::Fault;

pub(super) fn card(facts: &Facts<'_>) -> Card {
    let own = || facts.faults.iter().filter(|f| f.code != "lens_model");
    let found = own().filter(|f| f.found);
    // A picture that was set aside does no harm any more, but says more than anything else.
    let worst = found.reduce(|a, b| if b.moves_px > a.moves_px { b } else { a });
    let Some(fault) = worst else {
        let text = format!("None of {} faults stands out{}.", own().count(), corrected(facts));
        return Card {
            px: 0.0,
            text,
            show: Show::Pictures,
            remedy: None,
            advice: "A glass board, a camera that is warm".to_owned(),
        };
    };
    let more = match own().filter(|f| f.found).count() - 1 {
        0 => String::new(),
        n => format!(" {n} more."),
    };
    let text = format!(
        "{}: {}; it explains {} RMS of the errors.{more}",
        fault.title,
        fault.size,
        px(fault.explains_px)
    );
    Card {
        px: fault.moves_px,
        text,
        show: show(fault),
        remedy: remedy(facts, fault),
        advice: advice(&fault.code).to_owned(),
    }
}

/// A picture that had been corrected before it came here has no distortion.
fn corrected(facts: &Facts<'_>) -> String {
    let camera = &facts.capture.calibration.camera;
    let mut straight = camera.clone();
    let spec = camera.spec();
    straight.params.truncate(4);
    straight.params.extend_from_slice(spec.neutral);
    let bends = facts.capture.map.between(&straight, camera);
    match bends {
        Some(bends)
            if spec.perspective
                && spec.params.len() > 4
                && bends < 2.0 * facts.capture.sigma_px.max(0.05) =>
        {
            "; there is no distortion, as if the pictures had been corrected already".to_owned()
        }
        _ => String::new(),
    }
}

/// Where a fault is to be seen.
pub(in crate::calib::diagnose) fn show(fault: &Fault) -> Show {
    match &fault.frames[..] {
        [one, ..] if fault.frames.len() < 3 || fault.code == "zoom_step" => Show::Picture(*one),
        _ => Show::Field,
    }
}

/// What the program can do about it.
pub(in crate::calib::diagnose) fn remedy(facts: &Facts<'_>, fault: &Fault) -> Option<Remedy> {
    let frames = &facts.capture.report.frames;
    match &fault.frames[..] {
        [one] => {
            let frame = frames.get(*one).filter(|f| f.included)?;
            Some(Remedy::SetAside(vec![*one], frame.stem().to_owned()))
        }
        _ => None,
    }
}

/// What helps.
pub(in crate::calib::diagnose) fn advice(code: &str) -> &'static str {
    match code {
        "bowed_board" => "Glue the board to glass or an aluminium plate",
        "board_aspect" => "Measure the squares in both directions, or print again at 100 %",
        "zoomed_picture" | "zoom_step" | "focus_varies" => "Fix zoom and focus, switch autofocus off",
        "focal_drift" | "centre_drift" => "Let the camera warm up before",
        "rolling_shutter" => "Hold camera and board still, or use a shorter exposure on a tripod",
        "shifted_pictures" => "Switch stabilisation and lens correction off",
        "lens_model" => "Take a model with more terms",
        _ => "Set the picture aside",
    }
}
